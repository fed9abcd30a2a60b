use glam::{DVec2, DVec3};

use super::brush::{falloff, mirror, rise};
use super::spline::Spline;

/// The ears, standing off the head, with a folded rim and a hollow.
#[derive(Debug, Clone)]
pub(super) struct Ears {
    /// By angle in turns from the back upwards: the outline's distance from the ear's middle.
    outline: Spline<1>,
    /// By distance in the ear's patch: part of the way to the outline, and height over the ear's plane. Where the ear
    /// folds, on its lobe, and towards the face.
    rim: Spline<2>,
    lobe: Spline<2>,
    front: Spline<2>,
}

/// The left ear's middle.
pub(super) const CENTRE: DVec3 = DVec3::new(6.9, -0.9, -1.7);
/// Half-axes of the skull's patch that becomes an ear: backwards and up.
pub(super) const PATCH: DVec2 = DVec2::new(2.6, 3.9);
/// Radians by which the ear stands off the head, and by which its top leans back.
const STAND: f64 = 0.5;
const LEAN: f64 = 0.2;

const OUTLINE: [(f64, [f64; 1]); 11] = [
    (0.0, [1.8]),
    (0.125, [2.35]),
    (0.25, [3.0]),
    (0.33, [2.75]),
    (0.42, [1.85]),
    (0.5, [1.4]),
    (0.58, [1.35]),
    (0.67, [1.8]),
    (0.75, [2.75]),
    (0.83, [2.6]),
    (0.92, [1.95]),
];
const RIM: [(f64, [f64; 2]); 11] = [
    (0.0, [0.0, -0.6]),
    (0.1, [0.2, -0.5]),
    (0.24, [0.42, 0.08]),
    (0.32, [0.58, 0.55]),
    (0.4, [0.74, 0.37]),
    (0.47, [0.86, 0.65]),
    (0.54, [0.97, 0.76]),
    (0.62, [1.0, 0.56]),
    (0.72, [0.82, 0.3]),
    (0.86, [0.64, 0.0]),
    (1.0, [1.05, 0.0]),
];
const LOBE: [(f64, [f64; 2]); 11] = [
    (0.0, [0.0, -0.6]),
    (0.1, [0.2, -0.45]),
    (0.24, [0.42, 0.1]),
    (0.34, [0.62, 0.4]),
    (0.46, [0.84, 0.46]),
    (0.55, [0.98, 0.38]),
    (0.62, [1.0, 0.22]),
    (0.7, [0.9, 0.06]),
    (0.79, [0.83, 0.0]),
    (0.9, [0.92, 0.0]),
    (1.0, [1.1, 0.0]),
];
const FRONT: [(f64, [f64; 2]); 9] = [
    (0.0, [0.0, -0.6]),
    (0.12, [0.2, -0.5]),
    (0.26, [0.4, -0.2]),
    (0.34, [0.56, 0.15]),
    (0.42, [0.68, 0.3]),
    (0.52, [0.85, 0.16]),
    (0.68, [1.08, 0.0]),
    (0.84, [1.33, 0.0]),
    (1.0, [1.6, 0.0]),
];

impl Ears {
    pub fn new() -> Self {
        let round: Vec<_> =
            (-1..=1).flat_map(|turn| OUTLINE.map(|(at, v)| (at + f64::from(turn), v))).collect();
        Self {
            outline: Spline::through(&round),
            rim: Spline::through(&RIM),
            lobe: Spline::through(&LOBE),
            front: Spline::through(&FRONT),
        }
    }

    /// How far the ears move a point of the skull.
    pub fn displacement(&self, skull: DVec3) -> DVec3 {
        if skull.x > 0.0 { self.left(skull) } else { mirror(self.left(mirror(skull))) }
    }

    fn left(&self, skull: DVec3) -> DVec3 {
        let (distance, turn) = patch(skull);
        if distance >= 1.0 || skull.x < 1.0 {
            return DVec3::ZERO;
        }
        // From the front: over the rim, the lobe below, and the front again, whose outside has grown to the head.
        let grown = 0.13 * rise(0.57, 0.78, distance);
        let rim = rise(0.45 - grown, 0.33 - grown, turn) * rise(-0.22, -0.12, turn);
        let lobe = rise(-0.36 + grown, -0.28 + grown, turn) * rise(-0.12, -0.22, turn);
        let front = 1.0 - rim - lobe;
        let [a, b, c] = [&self.rim, &self.lobe, &self.front].map(|profile| profile.value(distance));
        let [part, height] = [0, 1].map(|i| rim * a[i] + lobe * b[i] + front * c[i]);
        let height = height + tragus(distance, turn);

        let (up, back) = (turn * std::f64::consts::TAU).sin_cos();
        let radius = part * self.outline.value(turn)[0];
        let (lean, upright) = LEAN.sin_cos();
        let flat = DVec2::new(back * upright + up * lean, up * upright - back * lean) * radius;
        let height = height + floor(flat) + rise(0.7, 0.85, distance) * (head(flat) - floor(flat));
        let (stand, lie) = STAND.sin_cos();
        let ear = CENTRE + DVec3::new(flat.x * stand + height * lie, flat.y, height * stand - flat.x * lie);
        (ear - skull) * rise(1.0, 0.8 - 0.25 * front, distance)
    }
}

/// The flap before the ear's hollow.
fn tragus(distance: f64, turn: f64) -> f64 {
    let below_front = (turn + 0.46 - (turn + 0.46).round()) / 0.1;
    0.4 * falloff(below_front.powi(2) + ((distance - 0.42) / 0.2).powi(2))
}

/// About where the head is over the ear's plane.
fn head(flat: DVec2) -> f64 {
    0.12 * flat.y - 0.6 * flat.x
}

/// What the ear rests on: the head in front, its own plane behind.
fn floor(flat: DVec2) -> f64 {
    0.12 * flat.y + 0.3 * (flat.x.hypot(0.4) - flat.x) - 0.12
}

/// Place in the left ear's patch: distance from its middle, 1 at the border, and angle in turns from the back upwards,
/// between -1/2 and 1/2.
pub(super) fn patch(skull: DVec3) -> (f64, f64) {
    let place = DVec2::new(CENTRE.z - skull.z, skull.y - CENTRE.y) / PATCH;
    (place.length(), place.y.atan2(place.x) / std::f64::consts::TAU)
}
