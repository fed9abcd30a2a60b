//! The distant light of shaded pictures, estimated from them and the present shape.

use glam::Vec3A;
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use super::error::InvertError;
use crate::render::{Light, Renderer, Surface, Target};

/// Most views that an estimate looks at.
const VIEWS: usize = 8;
/// Rounds of reweighting, after which the estimate is that of least absolute differences, and the least of these.
const ROUNDS: usize = 4;
const FLOOR: f64 = 0.02;
/// Keeps what the pictures do not show of the light small, as a share of what they show.
const RIDGE: f64 = 1e-4;

type Matrix = SMatrix<f64, 9, 9>;
type Factors = SMatrix<f64, 9, 3>;

/// A pixel of the object in a picture and in its rendering.
struct Sample {
    /// The polynomials of the rendered normal, times the albedo, for each channel `[3, 9]`.
    terms: [[f32; 9]; 3],
    colour: [f32; 3],
}

/// The light under which a surface looks most like the targets, with its albedo held: L1 over the pixels that are the
/// object's in both. Leaves the renderer with that light for every target. `None` if no pixel is.
pub(super) fn estimate(
    renderer: &mut dyn Renderer,
    surface: &Surface,
    targets: &[Target],
    solid: &[Vec<bool>],
) -> Result<Option<Light>, InvertError> {
    let samples = samples(renderer, surface, targets, solid)?;
    let light = (!samples.is_empty()).then(|| fitted(&samples)).flatten();
    let lights: Vec<Light> = targets.iter().map(|target| light.unwrap_or(target.light)).collect();
    renderer.set_lights(&lights)?;
    Ok(light)
}

fn samples(
    renderer: &mut dyn Renderer,
    surface: &Surface,
    targets: &[Target],
    solid: &[Vec<bool>],
) -> Result<Vec<Sample>, InvertError> {
    let seen = (0..targets.len()).step_by(targets.len().div_ceil(VIEWS).max(1)).collect::<Vec<_>>();
    let bare = Surface { albedo: None, ..*surface };
    renderer.set_lights(&vec![Light::world_normals(); targets.len()])?;
    let normals = seen.iter().map(|&i| renderer.picture(&bare, i)).collect::<Result<Vec<_>, _>>()?;
    let albedos = if surface.albedo.is_some() {
        renderer.set_lights(&vec![Light::uniform([1.0; 3]); targets.len()])?;
        Some(seen.iter().map(|&i| renderer.picture(surface, i)).collect::<Result<Vec<_>, _>>()?)
    } else {
        None
    };
    let mut samples = Vec::new();
    for (at, &target) in seen.iter().enumerate() {
        for pixel in (0..solid[target].len()).filter(|&p| normals[at].covered[p] && solid[target][p]) {
            let normal = (Vec3A::from_array(normals[at].colours[pixel]) * 2.0 - 1.0).normalize_or_zero();
            let y = Light::polynomials(normal);
            let albedo = albedos.as_ref().map_or([1.0; 3], |albedos| albedos[at].colours[pixel]);
            let colour = targets[target].colours[pixel];
            samples.push(Sample { terms: albedo.map(|a| y.map(|y| a * y)), colour });
        }
    }
    Ok(samples)
}

fn fitted(samples: &[Sample]) -> Option<Light> {
    let mut factors = None::<Factors>;
    for _ in 0..ROUNDS {
        let channels: Vec<Option<SVector<f64, 9>>> =
            (0..3).into_par_iter().map(|channel| solved(samples, channel, factors.as_ref())).collect();
        let [red, green, blue] = [channels[0]?, channels[1]?, channels[2]?];
        factors = Some(Factors::from_columns(&[red, green, blue]));
    }
    factors.map(|factors| Light(std::array::from_fn(|j| std::array::from_fn(|c| factors[(j, c)] as f32))))
}

fn solved(samples: &[Sample], channel: usize, before: Option<&Factors>) -> Option<SVector<f64, 9>> {
    let (mut matrix, mut wanted) = (Matrix::zeros(), SVector::<f64, 9>::zeros());
    for sample in samples {
        let terms = SVector::<f64, 9>::from_fn(|j, _| f64::from(sample.terms[channel][j]));
        let colour = f64::from(sample.colour[channel]);
        let off = before.map_or(1.0, |factors| (terms.dot(&factors.column(channel)) - colour).abs());
        let weight = 1.0 / off.max(FLOOR);
        matrix.ger(weight, &terms, &terms, 1.0);
        wanted.axpy(weight * colour, &terms, 1.0);
    }
    let ridge = RIDGE * matrix.trace() / 9.0;
    Some((matrix + Matrix::identity() * ridge).cholesky()?.solve(&wanted))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Random;

    #[test]
    fn a_light_is_found_again_though_some_pixels_lie() {
        let mut random = Random::new(5);
        let truth = Light(std::array::from_fn(|_| std::array::from_fn(|_| random.signed() as f32)));
        let samples: Vec<Sample> = (0..2000)
            .map(|i| {
                let n = Vec3A::new(random.signed() as f32, random.signed() as f32, random.signed() as f32);
                let n = n.normalize_or(Vec3A::X);
                let albedo = [0.3 + 0.5 * random.unit() as f32, 0.8, 0.5];
                let y = Light::polynomials(n);
                let lit = truth.colour(n);
                let lie = if i % 10 == 0 { 3.0 } else { 0.0 };
                Sample {
                    terms: albedo.map(|a| y.map(|y| a * y)),
                    colour: std::array::from_fn(|c| albedo[c] * lit[c] + lie),
                }
            })
            .collect();
        let found = fitted(&samples).unwrap();
        for (a, b) in found.0.as_flattened().iter().zip(truth.0.as_flattened()) {
            assert!((a - b).abs() < 0.05, "{a} {b}");
        }
    }
}
