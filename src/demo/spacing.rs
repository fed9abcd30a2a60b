use glam::DVec3;

use super::Random;
use super::brush::{mirror, rise};

/// How long edges should be on one head: short where there is much to see, and everywhere a little as chance has it.
#[derive(Debug, Clone)]
pub(super) struct Spacing {
    factor: f64,
    /// Directions across the skull along which lengths swell and ebb, and their phases.
    waves: [(DVec3, f64); 3],
}

/// Where there is much to see on the left half of the skull: middle, reach, edge length in centimetres.
const DETAILS: [(DVec3, DVec3, f64); 5] = [
    (DVec3::new(3.15, 1.1, 8.0), DVec3::new(2.0, 1.3, 3.0), 0.13),
    (DVec3::new(0.0, -6.4, 9.5), DVec3::new(3.0, 1.3, 3.0), 0.14),
    (DVec3::new(0.0, -3.9, 9.5), DVec3::new(2.2, 1.2, 3.0), 0.16),
    (DVec3::new(6.9, -0.9, -1.7), DVec3::new(3.0, 3.5, 2.5), 0.18),
    (DVec3::new(0.0, -2.0, 9.5), DVec3::new(5.5, 7.0, 6.0), 0.3),
];
/// Edge length elsewhere.
const PLAIN: f64 = 0.6;

impl Spacing {
    /// Lengths of one head's own, before [`Self::times`] brings them to a number of triangles.
    pub fn random(random: &mut Random) -> Self {
        let wave = |_| {
            let pace = random.between(0.2, 0.5);
            (pace * random.direction(), random.between(0.0, std::f64::consts::TAU))
        };
        Self { factor: 1.0, waves: [0, 1, 2].map(wave) }
    }

    /// All lengths multiplied.
    pub fn times(self, factor: f64) -> Self {
        Self { factor: self.factor * factor, ..self }
    }

    /// The edge length wanted at a point of the skull.
    pub fn at(&self, skull: DVec3) -> f64 {
        let half = if skull.x < 0.0 { mirror(skull) } else { skull };
        let length = |(middle, reach, fine): (DVec3, DVec3, f64)| {
            PLAIN + (fine - PLAIN) * rise(1.7, 0.8, ((half - middle) / reach).length())
        };
        let plain = DETAILS.into_iter().map(length).fold(PLAIN, f64::min);
        let swell: f64 = self.waves.iter().map(|(pace, phase)| (pace.dot(skull) + phase).sin()).sum();
        plain * self.factor * (1.0 + 0.08 * swell)
    }
}
