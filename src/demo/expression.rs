use glam::{DMat3, DVec3};

use super::brush::{Brush, falloff, rise};
use super::{Place, Random, mouth};

/// What a face does, each part from 0 for nothing to 1 for as far as it goes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Expression {
    /// How far the jaw is open.
    pub open: f64,
    /// How far the mouth's corners are drawn up and apart.
    pub smile: f64,
    /// How far the eyebrows are raised.
    pub brows: f64,
}

/// Corners of the mouth, cheeks, lower lids.
const SMILE: [Brush; 3] = [
    Brush::shifting([2.6, -6.3, 9.4], [2.6, 2.6, 4.0], [0.5, 0.5, -0.25]).on_both_sides(),
    Brush::shifting([4.0, -3.0, 8.0], [2.8, 2.4, 4.0], [0.1, 0.25, 0.3]).on_both_sides(),
    Brush::shifting([3.3, 0.2, 8.0], [1.6, 0.9, 3.0], [0.0, 0.12, 0.0]).on_both_sides(),
];
const BROWS: [Brush; 1] =
    [Brush::shifting([3.0, 3.2, 9.0], [3.6, 2.4, 4.0], [0.0, 0.4, 0.0]).on_both_sides()];

/// Where the jaw turns, and radians by which it opens.
const HINGE: DVec3 = DVec3::new(0.0, -1.5, 0.0);
const OPENING: f64 = 0.3;

impl Expression {
    /// Some smile, some open mouth, some raised brows.
    pub fn random(random: &mut Random) -> Self {
        let mut some = |most: f64| random.between(-0.5 * most, most).max(0.0);
        Self { open: some(0.6), smile: some(0.9), brows: some(0.8) }
    }

    /// How far the expression moves a place of the mean head.
    pub(super) fn displacement(&self, place: Place) -> DVec3 {
        let strokes = |strokes: &[Brush]| strokes.iter().map(|s| s.displacement(place.mean)).sum::<DVec3>();
        self.jaw(place) + self.smile * strokes(&SMILE) + self.brows * strokes(&BROWS)
    }

    fn jaw(&self, Place { skull, mean }: Place) -> DVec3 {
        if self.open == 0.0 || skull.z < -2.0 {
            return DVec3::ZERO;
        }
        let arm = mean - HINGE;
        let turned = DMat3::from_rotation_x(self.open * OPENING) * arm - arm;
        let height = skull.y - mouth::line(skull.x);
        // In the middle the lips part at once, towards their corners less and less, and cheeks stretch.
        let side = skull.x.abs();
        let stretch = 0.15 + 0.9 * rise(0.3, 2.6, side) + 2.2 * rise(2.2, 6.5, side);
        let jaw = rise(stretch, -stretch, height) * rise(-2.0, 6.0, skull.z) * rise(-14.5, -10.0, skull.y);
        let hollow = falloff((height / 0.3).powi(2)) * rise(2.6, 0.0, side) * rise(4.0, 6.0, skull.z);
        jaw * turned - DVec3::Z * (2.5 * self.open * hollow)
    }
}
