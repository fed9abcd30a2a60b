use glam::DVec3;

use super::brush::{falloff, rise};
use super::spline::Spline;

/// Lips that almost close over a pocket, as a displacement of the skull's surface.
#[derive(Debug, Clone)]
pub(super) struct Mouth {
    /// By height over the mouth's line: displacement in y and z.
    lips: Spline<2>,
}

/// Height of the mouth's line on the skull.
pub(super) const LINE: f64 = -6.35;

const LIPS: [(f64, [f64; 2]); 19] = [
    (-2.5, [0.0, 0.0]),
    (-1.8, [0.0, -0.18]),
    (-1.4, [0.0, -0.05]),
    (-1.15, [0.02, 0.2]),
    (-0.9, [0.08, 0.5]),
    (-0.6, [0.2, 0.62]),
    (-0.33, [0.22, 0.4]),
    (-0.18, [0.1, 0.0]),
    (-0.09, [0.02, -0.38]),
    (0.0, [0.0, -0.5]),
    (0.09, [-0.02, -0.38]),
    (0.18, [-0.1, 0.0]),
    (0.33, [-0.22, 0.38]),
    (0.55, [-0.2, 0.52]),
    (0.8, [-0.08, 0.45]),
    (0.95, [-0.02, 0.36]),
    (1.12, [0.0, 0.18]),
    (1.4, [0.0, 0.04]),
    (2.0, [0.0, 0.0]),
];

impl Mouth {
    pub fn new() -> Self {
        Self { lips: Spline::through(&LIPS) }
    }

    /// How far the mouth moves a point of the skull.
    pub fn displacement(&self, skull: DVec3) -> DVec3 {
        let side = skull.x.abs();
        if skull.z < 3.0 || side > 3.2 {
            return DVec3::ZERO;
        }
        let height = skull.y - line(skull.x);
        let thickness = thickness(skull.x, height);
        let [y, z] = self.lips.value(height / thickness);
        // The lips lose their fullness before they meet.
        let [apart, full] = [1.8, 0.8].map(|from| rise(2.8, from, side));
        DVec3::new(0.0, y * thickness * apart, z * full)
    }
}

/// Height of the line between the lips on the skull, at `x` from the middle.
pub(super) fn line(x: f64) -> f64 {
    LINE + 0.02 * x * x - 0.05 * falloff((x / 0.9).powi(2))
}

/// Height on the skull of a `part` of the lips at `x`: 0 at the line between them, 1 and -1 at about their outlines.
pub(super) fn height(x: f64, part: f64) -> f64 {
    line(x) + part * thickness(x, part)
}

/// Whether a point of the skull lies within the gap between the lips.
pub(super) fn hides(skull: DVec3) -> bool {
    let height = skull.y - line(skull.x);
    skull.z > 3.0 && skull.x.abs() < 2.6 && height.abs() < 0.22 * thickness(skull.x, height)
}

/// Thickness of the lips at a place relative to the middle's: a bow above, an arc below.
fn thickness(x: f64, height: f64) -> f64 {
    let arc = (1.0 - (x / 2.7).powi(2)).max(0.0);
    let lower = 0.4 + 0.6 * arc;
    let upper = 0.4 + 0.65 * arc.powf(1.2) - 0.15 * falloff((x / 0.55).powi(2));
    lower + (upper - lower) * rise(-0.3, 0.3, height)
}
