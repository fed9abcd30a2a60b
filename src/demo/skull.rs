use glam::DVec3;

use super::spline::Spline;

/// The head without its features: a smooth surface lofted over slices from the crown down to the neck.
#[derive(Debug, Clone)]
pub(super) struct Skull {
    slices: Spline<9>,
}

/// From the crown (0) to the middle of the neck's end (1): front y, z; side y, x, z; back y, z; squareness of the
/// slice in front and behind.
const SLICES: [(f64, [f64; 9]); 19] = [
    (0.00, [12.6, -1.0, 12.6, 0.0, -1.0, 12.6, -1.0, 0.00, 0.00]),
    (0.10, [12.0, 2.8, 11.5, 3.7, -1.2, 11.7, -5.0, 0.05, 0.05]),
    (0.20, [9.8, 6.5, 9.0, 6.3, -1.4, 9.3, -8.2, 0.10, 0.06]),
    (0.28, [7.2, 8.4, 6.6, 7.3, -1.6, 6.6, -9.6, 0.14, 0.06]),
    (0.35, [4.6, 9.3, 4.2, 7.5, -1.5, 4.0, -10.0, 0.14, 0.05]),
    (0.41, [2.5, 9.5, 2.2, 7.35, -1.2, 1.8, -9.8, 0.12, 0.03]),
    (0.45, [1.2, 9.2, 0.8, 7.15, -0.9, 0.2, -9.4, 0.10, 0.0]),
    (0.50, [-0.8, 9.1, -0.8, 6.95, -0.5, -1.4, -8.8, 0.07, 0.0]),
    (0.55, [-2.8, 9.3, -2.2, 6.7, -0.4, -2.9, -8.0, 0.03, 0.0]),
    (0.59, [-4.4, 9.6, -3.4, 6.4, -0.3, -4.1, -7.4, 0.0, 0.0]),
    (0.63, [-6.0, 9.8, -4.6, 6.1, -0.3, -5.3, -6.9, -0.02, 0.0]),
    (0.67, [-7.6, 9.6, -5.7, 5.8, -0.3, -6.5, -6.5, -0.03, 0.0]),
    (0.71, [-9.1, 9.6, -6.8, 5.45, -0.3, -7.7, -6.3, -0.03, 0.0]),
    (0.745, [-10.4, 9.1, -7.8, 5.1, -0.5, -8.8, -6.2, -0.03, 0.0]),
    (0.78, [-11.0, 7.2, -8.9, 4.85, -0.9, -9.9, -6.2, 0.0, 0.0]),
    (0.82, [-11.4, 4.8, -10.4, 4.75, -1.2, -11.2, -6.2, 0.02, 0.02]),
    (0.87, [-13.2, 3.8, -12.6, 4.8, -1.5, -13.0, -6.3, 0.03, 0.03]),
    (0.93, [-16.4, 3.9, -16.2, 5.1, -1.6, -16.4, -6.8, 0.03, 0.03]),
    (1.00, [-18.0, -1.6, -18.0, 0.0, -1.6, -18.0, -1.6, 0.00, 0.00]),
];

impl Skull {
    /// The skull every head starts from.
    pub fn new() -> Self {
        let mut keys = SLICES.to_vec();
        // The slices go on beyond both ends on the other side, so that crown and end are round.
        let beyond = |key: f64, [fy, fz, sy, sx, sz, by, bz, fq, bq]: [f64; 9]| {
            (key, [by, bz, sy, -sx, sz, fy, fz, bq, fq])
        };
        keys.insert(0, beyond(-SLICES[1].0, SLICES[1].1));
        keys.push(beyond(2.0 - SLICES[17].0, SLICES[17].1));
        Self { slices: Spline::through(&keys) }
    }

    /// The skull's point in a unit `direction` of the anatomical sphere.
    pub fn point(&self, direction: DVec3) -> DVec3 {
        let level = direction.x.hypot(direction.z);
        let slice = level.atan2(direction.y) / std::f64::consts::PI;
        let (sine, cosine) =
            if level > 0.0 { (direction.x / level, direction.z / level) } else { (0.0, 1.0) };
        let [fy, fz, sy, sx, sz, by, bz, fq, bq] = self.slices.value(slice);
        // The quadratic in the cosine that passes through the front, side and back values.
        let around = |front: f64, side: f64, back: f64| {
            side + cosine * (front - back) / 2.0 + cosine * cosine * ((front + back) / 2.0 - side)
        };
        let square = around(fq, 0.0, bq);
        DVec3::new(sx * sine * (1.0 + square), around(fy, sy, by), around(fz, sz, bz))
    }
}
