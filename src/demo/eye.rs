use glam::DVec3;

use super::brush::{falloff, mirror, rise};

/// The eyes with their lids, as a displacement of the skull's surface.
#[derive(Debug, Clone)]
pub(super) struct Eyes;

/// The eyeball's middle on the left; its front lies `RADIUS` before it.
pub(super) const CENTRE: DVec3 = DVec3::new(3.15, 1.0, 6.95);
const RADIUS: f64 = 1.25;
/// From the middle to either corner.
pub(super) const HALF_WIDTH: f64 = 1.55;

impl Eyes {
    /// How far the eyes move a point of the skull that other forms have brought to `formed`.
    pub fn displacement(&self, skull: DVec3, formed: DVec3) -> DVec3 {
        if skull.z < 2.0 {
            return DVec3::ZERO;
        }
        let depth = left(skull, formed.z) + left(mirror(skull), formed.z);
        DVec3::new(0.0, 0.0, depth + brow(skull))
    }
}

/// Heights of the lower and the upper lid's edge over the eye's middle, at `x` from it.
pub(super) fn lids(x: f64) -> [f64; 2] {
    let along = (x / HALF_WIDTH).clamp(-1.2, 1.2);
    let arch = 1.0 - along * along;
    let tilt = 0.08 * along;
    [-0.46 * arch + tilt, 0.6 * arch * (1.0 - 0.12 * along) + tilt]
}

/// Height of the eyebrow over the eye's middle, at `x` from it.
pub(super) fn brow_line(x: f64) -> f64 {
    1.75 - 0.14 * (x - 0.5) * (x - 0.5)
}

fn brow(skull: DVec3) -> f64 {
    let x = skull.x.abs() - CENTRE.x;
    let height = skull.y - CENTRE.y - brow_line(x);
    0.13 * falloff((height / 0.42).powi(2)) * rise(-2.3, -1.5, x) * rise(2.2, 0.8, x)
}

/// How far the left eye brings forward what other forms have brought to depth `formed`.
fn left(skull: DVec3, formed: f64) -> f64 {
    let [x, y] = [skull.x - CENTRE.x, skull.y - CENTRE.y];
    let weight = falloff((x / 2.6).powi(2) + ((y - 0.1) / 2.0).powi(2)).sqrt();
    if weight == 0.0 {
        return 0.0;
    }
    let [lower, upper] = lids(x);
    let open = rise(-0.07, 0.08, upper - y) * rise(-0.07, 0.08, y - lower);
    let ball = RADIUS - (x * x + y * y) / (2.0 * RADIUS + 0.3);
    let iris = 0.07 * falloff((x * x + y * y) / 0.8) - 0.16 * falloff((x * x + y * y) / 0.1);
    let lid = 0.26 - 0.16 * falloff(((y - upper - 0.42) / 0.3).powi(2)) * rise(2.0, 1.2, x.abs());
    let depth = CENTRE.z + ball + open * iris + (1.0 - open) * lid;
    (depth - formed) * weight
}
