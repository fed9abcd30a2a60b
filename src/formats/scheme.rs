//! Landmark schemes known by name.

use std::ops::RangeInclusive;

use glam::DVec3;

use super::numbering::Numbering;
use crate::mesh::LandmarkSet;

/// A part of the face; right and left are the face's own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Region {
    /// The outline from the right ear over the chin to the left ear.
    Jaw,
    /// The right eyebrow.
    RightBrow,
    /// The left eyebrow.
    LeftBrow,
    /// The nose from its root to its tip.
    NoseBridge,
    /// The underside of the nose.
    NoseBase,
    /// The right eye's rim.
    RightEye,
    /// The left eye's rim.
    LeftEye,
    /// The outer rim of the lips.
    OuterLips,
    /// The inner rim of the lips.
    InnerLips,
}

/// Facial landmarks whose meaning is known, named by their indices "0", "1", ...
#[derive(Debug)]
pub struct Scheme {
    /// The name that it is stored by.
    pub name: &'static str,
    nose_tip: usize,
    /// Each landmark's counterpart on the other half of the face; itself on the midline.
    mirror: &'static [usize],
    regions: &'static [(Region, RangeInclusive<usize>)],
}

static KNOWN: [Scheme; 1] = [MULTIPIE_68];

/// The 68 points of Multi-PIE, used by iBUG's 300-W and by dlib.
const MULTIPIE_68: Scheme = Scheme {
    name: "multipie68",
    nose_tip: 30,
    #[rustfmt::skip]
    mirror: &[
        16, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0, // jaw
        26, 25, 24, 23, 22, 21, 20, 19, 18, 17, // brows
        27, 28, 29, 30, 35, 34, 33, 32, 31, // nose
        45, 44, 43, 42, 47, 46, 39, 38, 37, 36, 41, 40, // eyes
        54, 53, 52, 51, 50, 49, 48, 59, 58, 57, 56, 55, // outer lips
        64, 63, 62, 61, 60, 67, 66, 65, // inner lips
    ],
    regions: &[
        (Region::Jaw, 0..=16),
        (Region::RightBrow, 17..=21),
        (Region::LeftBrow, 22..=26),
        (Region::NoseBridge, 27..=30),
        (Region::NoseBase, 31..=35),
        (Region::RightEye, 36..=41),
        (Region::LeftEye, 42..=47),
        (Region::OuterLips, 48..=59),
        (Region::InnerLips, 60..=67),
    ],
};

impl Scheme {
    /// The scheme that goes by this name (in any case), if it is known; a subset's name gives the whole.
    pub fn named(name: &str) -> Option<&'static Self> {
        let numbering = Numbering::named(name)?;
        KNOWN.iter().find(|scheme| scheme.name == numbering.scheme)
    }

    /// The number of its landmarks.
    pub fn count(&self) -> usize {
        self.mirror.len()
    }

    /// The name of the landmark on the tip of the nose.
    pub fn nose_tip(&self) -> String {
        self.nose_tip.to_string()
    }

    /// The region that a landmark marks; `None` for a name that the scheme does not have.
    pub fn region(&self, landmark: &str) -> Option<Region> {
        let index = self.index(landmark)?;
        self.regions.iter().find(|(_, indices)| indices.contains(&index)).map(|&(region, _)| region)
    }

    /// The landmark's counterpart on the other half of the face, itself on the midline.
    pub fn mirrored(&self, landmark: &str) -> Option<String> {
        Some(self.mirror[self.index(landmark)?].to_string())
    }

    /// How much a landmark counts where scans are turned onto each other: the tip of the nose 10 000, any other 1, as in
    /// the paper's supplement.
    pub fn alignment_weight(&self, landmark: &str) -> f64 {
        if self.index(landmark) == Some(self.nose_tip) { 1e4 } else { 1.0 }
    }

    /// The mean of a region's landmarks that are there: of an eye's rim, for instance, the eye's centre.
    pub fn centre(&self, region: Region, set: &LandmarkSet) -> Option<DVec3> {
        let points = set.present().filter(|(name, _)| self.region(name) == Some(region));
        let (sum, count) = points.fold((DVec3::ZERO, 0), |(sum, count), (_, point)| (sum + point, count + 1));
        (count > 0).then(|| sum / f64::from(count))
    }

    fn index(&self, landmark: &str) -> Option<usize> {
        let index: usize = landmark.parse().ok()?;
        // "007" and "+7" are other names.
        (index < self.count() && index.to_string() == landmark).then_some(index)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn multipie() -> &'static Scheme {
        Scheme::named("multipie68").unwrap()
    }

    #[test]
    fn goes_by_several_names() {
        assert!(std::ptr::eq(Scheme::named("iBUG68").unwrap(), multipie()));
        assert!(std::ptr::eq(Scheme::named("multipie49").unwrap(), multipie()));
        assert!(Scheme::named("wflw98").is_none() && Scheme::named("caricshop38").is_none());
    }

    #[test]
    fn mirroring_twice_is_nothing_and_swaps_sides() {
        let scheme = multipie();
        assert_eq!(scheme.count(), 68);
        for name in (0..68).map(|index| index.to_string()) {
            let other = scheme.mirrored(&name).unwrap();
            assert_eq!(scheme.mirrored(&other), Some(name.clone()));
            let side = |name: &str| match scheme.region(name).unwrap() {
                Region::RightBrow => Region::LeftBrow,
                Region::RightEye => Region::LeftEye,
                Region::LeftBrow => Region::RightBrow,
                Region::LeftEye => Region::RightEye,
                midline => midline,
            };
            assert_eq!(Some(side(&name)), scheme.region(&other));
        }
    }

    #[test]
    fn knows_the_nose_tip_and_no_strangers() {
        let scheme = multipie();
        assert_eq!(scheme.alignment_weight(&scheme.nose_tip()), 1e4);
        assert_eq!(scheme.alignment_weight("29"), 1.0);
        assert_eq!(scheme.region("30"), Some(Region::NoseBridge));
        assert!(["68", "030", "+3", "nose", ""].iter().all(|name| scheme.region(name).is_none()));
    }

    #[test]
    fn a_region_s_centre_leaves_missing_landmarks_out() {
        let names: Vec<_> = (0..68).map(|index| index.to_string()).collect();
        let mut points: Vec<_> = (0..68).map(|index| Some(DVec3::X * f64::from(index))).collect();
        points[36] = None;
        let set = LandmarkSet { scheme: None, names, points };
        assert_eq!(multipie().centre(Region::RightEye, &set), Some(DVec3::X * 39.0));
        assert_eq!(multipie().centre(Region::RightEye, &LandmarkSet::default()), None);
    }
}
