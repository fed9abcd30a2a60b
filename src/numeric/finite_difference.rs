//! Central differences, to hold analytic gradients against. Tests only.

use glam::Vec3A;

use super::Random;

/// Compares `gradient` `[N, 3]` with central differences of `value` along `probes` random directions; returns the
/// largest difference relative to the largest slope seen.
pub fn directional_error(
    positions: &[Vec3A],
    gradient: &[Vec3A],
    step: f64,
    probes: usize,
    mut value: impl FnMut(&[Vec3A]) -> f64,
) -> f64 {
    let mut random = Random::new(17);
    let (mut worst, mut steepest) = (0f64, 0f64);
    for _ in 0..probes {
        let direction: Vec<Vec3A> = positions
            .iter()
            .map(|_| Vec3A::new(random.signed() as f32, random.signed() as f32, random.signed() as f32))
            .collect();
        let shifted = |sign: f64| -> Vec<Vec3A> {
            positions.iter().zip(&direction).map(|(p, d)| *p + *d * (sign * step) as f32).collect()
        };
        let numeric = (value(&shifted(1.0)) - value(&shifted(-1.0))) / (2.0 * step);
        let analytic: f64 = gradient.iter().zip(&direction).map(|(g, d)| g.dot(*d) as f64).sum();
        worst = worst.max((numeric - analytic).abs());
        steepest = steepest.max(numeric.abs()).max(analytic.abs());
    }
    worst / steepest.max(1e-12)
}
