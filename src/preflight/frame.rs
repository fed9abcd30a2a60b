//! In which unit a scan is, and how it is turned.

use glam::DVec3;
use serde::Serialize;

use super::alignment::{Aligned, MIRROR};
use super::connectivity::BoundaryLoop;
use crate::formats::{Region, Scheme};
use crate::mesh::LandmarkSet;

/// Millimetres between the centres of an adult's eyes.
const BETWEEN_EYES: f64 = 62.0;
/// Millimetres of the longest side of the box around a head.
const HEAD: f64 = 270.0;
/// A length is taken for another that it is at most this many times as long or as short as.
const CLEARLY: f64 = 2.2;
/// Rims longer than this share of the box's longest side may be a neck's.
const NECK: f64 = 0.8;

/// What a conclusion is drawn from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// Landmarks of a known scheme.
    Landmarks,
    /// The surface's extent alone: a guess.
    Extent,
}

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Unit {
    /// Metre.
    #[serde(rename = "m")]
    Metre,
    /// Centimetre.
    #[serde(rename = "cm")]
    Centimetre,
    /// Millimetre.
    #[serde(rename = "mm")]
    Millimetre,
}

impl Unit {
    const ALL: [Self; 3] = [Self::Metre, Self::Centimetre, Self::Millimetre];

    /// Millimetres to it.
    pub fn millimetres(self) -> f64 {
        match self {
            Self::Metre => 1000.0,
            Self::Centimetre => 10.0,
            Self::Millimetre => 1.0,
        }
    }

    /// Its sign.
    pub fn sign(self) -> &'static str {
        match self {
            Self::Metre => "m",
            Self::Centimetre => "cm",
            Self::Millimetre => "mm",
        }
    }
}

/// In which unit a scan seems to be.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct UnitGuess {
    /// The unit in which the face comes closest to natural size.
    pub unit: Unit,
    /// Whether it is then of natural size.
    pub clear: bool,
    /// What it is concluded from.
    pub basis: Basis,
    /// The length that was looked at, in scan units: between the eyes, or the box's longest side.
    pub length: f64,
}

impl UnitGuess {
    /// From the distance between the eyes, or else from the longest side of the box around the scan.
    pub fn new(extent: DVec3, eyes: Option<f64>) -> Self {
        let (length, natural, basis) = match eyes.filter(|&eyes| eyes > 0.0) {
            Some(eyes) => (eyes, BETWEEN_EYES, Basis::Landmarks),
            None => (extent.max_element(), HEAD, Basis::Extent),
        };
        let off = |unit: &Unit| (unit.millimetres() * length / natural).ln().abs();
        let unit = Unit::ALL.into_iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(Unit::Millimetre);
        Self { unit, clear: off(&unit) < CLEARLY.ln(), basis, length }
    }
}

/// How a face is turned in its scan's space.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Axes {
    /// Unit vector from the chin to the crown.
    pub up: [f64; 3],
    /// Unit vector in which the face looks, square to `up`.
    pub facing: [f64; 3],
    /// What it is concluded from.
    pub basis: Basis,
}

impl Axes {
    /// From landmarks that were brought onto an upright face, or whose mirror image was.
    pub(super) fn of_aligned(aligned: &Aligned, mirrored: bool) -> Self {
        let back = aligned.similarity.rotation.transpose();
        let direction = |axis: DVec3| (back * axis * if mirrored { MIRROR } else { DVec3::ONE }).to_array();
        Self { up: direction(DVec3::Y), facing: direction(DVec3::Z), basis: Basis::Landmarks }
    }

    /// A guess: a head is highest along its up axis, its neck below.
    pub fn guessed(centre: DVec3, extent: DVec3, loops: &[BoundaryLoop]) -> Self {
        let neck = loops.first().filter(|rim| rim.length > NECK * extent.max_element());
        let from_neck = neck.map(|rim| centre - DVec3::from_array(rim.centre));
        // Wide shoulders and hair make other sides longer, but no axis longer than height is likely to be it.
        let longest = if extent.z > extent.y && extent.z > extent.x { DVec3::Z } else { DVec3::Y };
        let up = match from_neck {
            Some(away) if away.dot(longest).abs() > 0.5 * away.length() => {
                longest * away.dot(longest).signum()
            }
            _ => longest,
        };
        let facing = if up.z == 0.0 { DVec3::Z } else { -DVec3::Y };
        Self { up: up.to_array(), facing: facing.to_array(), basis: Basis::Extent }
    }

    /// The axes that `up` and `facing` are nearest to, as `+Y`, each with the angle between them in degrees.
    pub fn nearest(&self) -> ((String, f64), (String, f64)) {
        (nearest_axis(self.up), nearest_axis(self.facing))
    }
}

/// The axis that a direction is nearest to, as `+Y`, and the angle between them in degrees.
fn nearest_axis(direction: [f64; 3]) -> (String, f64) {
    let axis = (0..3).max_by(|&a, &b| direction[a].abs().total_cmp(&direction[b].abs())).unwrap_or(0);
    let sign = if direction[axis] < 0.0 { '-' } else { '+' };
    let angle = direction[axis].abs().min(1.0).acos().to_degrees();
    (format!("{sign}{}", ['X', 'Y', 'Z'][axis]), angle)
}

/// The distance between the eyes' centres.
pub(super) fn between_eyes(scheme: &Scheme, landmarks: &LandmarkSet) -> Option<f64> {
    let centre = |region| scheme.centre(region, landmarks);
    Some(centre(Region::RightEye)?.distance(centre(Region::LeftEye)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_natural_heads() {
        let head = DVec3::new(180.0, 270.0, 240.0);
        for (factor, unit) in [(1.0, Unit::Millimetre), (0.1, Unit::Centimetre), (0.001, Unit::Metre)] {
            let guess = UnitGuess::new(head * factor, None);
            assert_eq!((guess.unit, guess.clear, guess.basis), (unit, true, Basis::Extent));
            let guess = UnitGuess::new(head * factor * 30.0, Some(64.0 * factor));
            assert_eq!((guess.unit, guess.clear, guess.basis), (unit, true, Basis::Landmarks));
        }
        assert!(!UnitGuess::new(head / 70_000.0, None).clear, "a head of unit size could be anything");
    }

    #[test]
    fn a_neck_is_below() {
        let rim = |centre: [f64; 3]| [BoundaryLoop { vertices: 9, length: 40.0, centre }];
        let extent = DVec3::new(18.0, 27.0, 24.0);
        let axes = Axes::guessed(DVec3::ZERO, extent, &rim([0.0, 13.0, 1.0]));
        assert_eq!((axes.up, axes.facing), ([0.0, -1.0, 0.0], [0.0, 0.0, 1.0]));
        let axes = Axes::guessed(DVec3::ZERO, DVec3::new(18.0, 24.0, 27.0), &rim([0.0, 1.0, -13.0]));
        assert_eq!((axes.up, axes.facing), ([0.0, 0.0, 1.0], [0.0, -1.0, 0.0]));
        assert_eq!(nearest_axis([0.1, -0.99, 0.0]).0, "-Y");
    }
}
