use glam::DVec3;

use super::chart::Chart;
use super::skull::Skull;
use super::{eye, mouth};

/// Directions of the 68 landmarks of the iBUG and Multi-PIE layout on the anatomical sphere, in that layout's order.
///
/// The layout counts from the left of the picture, which is the head's right. 0-16 jaw, 17-26 brows, 27-35 nose,
/// 36-47 eyes, 48-67 lips.
pub(super) fn directions(skull: &Skull) -> Vec<DVec3> {
    let chart = Chart::new(skull);
    let jaw = jaw().map(|point| chart.nearest(point));
    let front = brows().chain(nose()).chain(eyes()).chain(lips()).map(|[x, y]| chart.front(x, y));
    jaw.chain(front).collect()
}

/// From before the right ear under the chin to the left ear.
fn jaw() -> impl Iterator<Item = DVec3> {
    const HALF: [[f64; 3]; 9] = [
        [0.0, -10.3, 9.2],
        [1.9, -10.1, 8.4],
        [3.4, -9.6, 6.6],
        [4.5, -8.7, 4.6],
        [5.2, -7.5, 2.9],
        [5.8, -5.9, 2.0],
        [6.3, -4.1, 1.6],
        [6.65, -2.2, 1.5],
        [6.9, -0.3, 1.6],
    ];
    (-8_i32..=8).map(|step| {
        let [x, y, z] = HALF[step.unsigned_abs() as usize];
        DVec3::new(x * f64::from(step.signum()), y, z)
    })
}

fn brows() -> impl Iterator<Item = [f64; 2]> {
    const ALONG: [f64; 5] = [-1.6, -0.7, 0.2, 1.05, 1.9];
    let left = |x: f64| [eye::CENTRE.x + x, eye::CENTRE.y + eye::brow_line(x)];
    ALONG.into_iter().rev().map(move |x| mirrored(left(x))).chain(ALONG.map(left))
}

/// Down the bridge to the tip, then along the base.
fn nose() -> impl Iterator<Item = [f64; 2]> {
    let bridge = [1.2, -0.2, -1.7, -3.15].map(|y| [0.0, y]);
    let base = [[-1.5, -4.4], [-0.75, -4.72], [0.0, -4.8], [0.75, -4.72], [1.5, -4.4]];
    bridge.into_iter().chain(base)
}

/// Each eye from its corner on the picture's left over the upper lid and back along the lower.
fn eyes() -> impl Iterator<Item = [f64; 2]> {
    let left = |x: f64, upper: bool| [eye::CENTRE.x + x, eye::CENTRE.y + eye::lids(x)[usize::from(upper)]];
    let (corner, along) = (eye::HALF_WIDTH, 0.55);
    let right =
        [(corner, true), (along, true), (-along, true), (-corner, true), (-along, false), (along, false)];
    let other =
        [(-corner, true), (-along, true), (along, true), (corner, true), (along, false), (-along, false)];
    right
        .into_iter()
        .map(move |(x, upper)| mirrored(left(x, upper)))
        .chain(other.map(|(x, upper)| left(x, upper)))
}

/// The outline, then the edges of the gap, both from the corner on the picture's left over the upper lip.
fn lips() -> impl Iterator<Item = [f64; 2]> {
    let upper =
        [-2.65, -1.75, -0.65, 0.0, 0.65, 1.75, 2.65].map(|x| (x, if f64::abs(x) > 2.0 { 0.0 } else { 0.95 }));
    let lower = [1.7, 0.85, 0.0, -0.85, -1.7].map(|x| (x, -1.1));
    let inner_upper = [-2.3, -0.95, 0.0, 0.95, 2.3].map(|x| (x, if f64::abs(x) > 2.0 { 0.0 } else { 0.27 }));
    let inner_lower = [0.95, 0.0, -0.95].map(|x| (x, -0.27));
    let all = upper.into_iter().chain(lower).chain(inner_upper).chain(inner_lower);
    all.map(|(x, part)| [x, mouth::height(x, part)])
}

fn mirrored([x, y]: [f64; 2]) -> [f64; 2] {
    [-x, y]
}
