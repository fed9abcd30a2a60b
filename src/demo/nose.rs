use glam::DVec3;

use super::brush::{Brush, rise};
use super::spline::Spline;

/// The nose, as a displacement of the skull's surface.
#[derive(Debug, Clone)]
pub(super) struct Nose {
    /// Along the middle, by height on the skull: displacement in y and z, reach to the sides.
    ridge: Spline<3>,
}

const RIDGE: [(f64, [f64; 3]); 16] = [
    (-5.8, [0.0, 0.0, 1.3]),
    (-5.3, [0.03, 0.0, 1.3]),
    (-4.95, [0.12, 0.08, 1.3]),
    (-4.6, [0.2, 0.3, 1.3]),
    (-4.3, [0.1, 0.85, 1.35]),
    (-4.0, [-0.08, 1.4, 1.4]),
    (-3.7, [-0.2, 1.95, 1.45]),
    (-3.4, [-0.25, 2.4, 1.5]),
    (-3.1, [-0.2, 2.6, 1.5]),
    (-2.8, [-0.15, 2.55, 1.45]),
    (-2.0, [0.0, 2.05, 1.35]),
    (-1.0, [0.0, 1.5, 1.3]),
    (0.0, [0.0, 0.95, 1.3]),
    (1.2, [0.0, 0.35, 1.4]),
    (2.0, [0.0, 0.06, 1.5]),
    (2.8, [0.0, 0.0, 1.5]),
];

/// Wings, the crease behind them, nostrils.
const STROKES: [Brush; 3] = [
    Brush::shifting([1.25, -3.7, 9.3], [0.95, 0.95, 3.0], [0.4, -0.15, 1.0]).on_both_sides(),
    Brush::shifting([2.0, -2.2, 9.0], [1.1, 2.2, 3.0], [0.0, 0.0, -0.4]).on_both_sides(),
    Brush::shifting([0.7, -4.25, 9.5], [0.5, 0.45, 3.0], [0.0, 0.6, -0.3]).on_both_sides(),
];

impl Nose {
    pub fn new() -> Self {
        Self { ridge: Spline::through(&RIDGE) }
    }

    /// How far the nose moves a point of the skull.
    pub fn displacement(&self, skull: DVec3) -> DVec3 {
        if skull.z < 4.0 {
            return DVec3::ZERO;
        }
        let [y, z, reach] = self.ridge.value(skull.y);
        let ridge = DVec3::new(0.0, y, z) * rise(1.0, 0.05, skull.x.abs() / reach);
        ridge + STROKES.iter().map(|stroke| stroke.displacement(skull)).sum::<DVec3>()
    }
}
