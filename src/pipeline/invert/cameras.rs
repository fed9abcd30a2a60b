//! Whether the cameras and the silhouettes can be of one object, and what is wrong with the cameras if not.

use glam::{DMat3, DVec3};

use super::error::InvertError;
use super::hull::Hull;
use super::silhouette::Silhouette;
use crate::camera::{Intrinsics, Pose};

/// The share of the silhouettes that the hull of good cameras covers at least.
const GOOD: f64 = 0.98;
/// Below it the cameras are of no use.
const USELESS: f64 = 0.5;
/// What another reading of the cameras has to gain to be suggested.
const GAIN: f64 = 0.1;
/// Cells of the hulls that readings are compared by.
const COARSE: usize = 32;
/// What leaving one view out has to gain, and how many are tried.
const GAIN_OF_ONE: f64 = 0.01;
const SUSPECTS: usize = 5;

/// A hull and what is thought of the cameras that gave it.
#[derive(Debug)]
pub(super) struct Agreement {
    pub hull: Hull,
    /// Views that the hull of the others does not fit.
    pub strays: Vec<usize>,
    /// What is wrong with all of them, if it can be told.
    pub suspicion: Option<String>,
}

impl Agreement {
    /// Carves the hull; where the silhouettes do not agree, without the few that do not, or finds out how the cameras
    /// would have to be read for all to agree.
    ///
    /// # Errors
    /// [`InvertError::Cameras`] where nothing is left that most silhouettes agree on.
    pub fn of(silhouettes: &[Silhouette], cells: usize) -> Result<Self, InvertError> {
        let plain = Hull::carve(silhouettes, cells, 0);
        let agreement = plain.as_ref().map_or(0.0, Hull::agreement);
        if let Some(hull) = plain.clone().filter(|_| agreement >= GOOD) {
            return Ok(Self { hull, strays: Vec::new(), suspicion: None });
        }
        if let Some(found) = without_strays(silhouettes, cells) {
            return Ok(found);
        }
        let suspicion = another_reading(silhouettes, agreement);
        match plain.filter(|hull| agreement >= USELESS && !hull.cells.is_empty()) {
            Some(hull) => Ok(Self { hull, strays: Vec::new(), suspicion }),
            None => Err(InvertError::Cameras {
                agreement: 100.0 * agreement,
                remedy: suspicion.unwrap_or_else(|| {
                    "check that poses, axes, focal lengths and masks are of these pictures".to_owned()
                }),
            }),
        }
    }
}

/// The hull without a fifth of the views at most, and which these are; `None` if the others do not agree either.
fn without_strays(silhouettes: &[Silhouette], cells: usize) -> Option<Agreement> {
    let of = |kept: &[usize]| kept.iter().map(|&at| silhouettes[at].clone()).collect::<Vec<_>>();
    let agreement = |kept: &[usize]| Hull::carve(&of(kept), COARSE, 0).map_or(0.0, |hull| hull.agreement());
    let mut kept: Vec<usize> = (0..silhouettes.len()).collect();
    let mut before = agreement(&kept);
    for _ in 0..silhouettes.len() / 5 {
        let without = |at: usize| kept.iter().copied().filter(|&other| other != at).collect::<Vec<_>>();
        let tried = suspects(&of(&kept)).into_iter().map(|place| without(kept[place]));
        let (found, others) =
            tried.map(|others| (agreement(&others), others)).max_by(|a, b| a.0.total_cmp(&b.0))?;
        if found < before + GAIN_OF_ONE {
            return None;
        }
        (before, kept) = (found, others);
        if before >= GOOD {
            let hull = Hull::carve(&of(&kept), cells, 0)?;
            let strays = (0..silhouettes.len()).filter(|at| !kept.contains(at)).collect();
            return Some(Agreement { hull, strays, suspicion: None });
        }
    }
    None
}

/// The few silhouettes that fit the hull least which each may contradict once.
fn suspects(silhouettes: &[Silhouette]) -> Vec<usize> {
    let Some(loose) = Hull::carve(silhouettes, COARSE, 1) else { return Vec::new() };
    let misfit = |at: &usize| loose.covered[*at] - loose.beside[*at];
    let mut order: Vec<usize> = (0..silhouettes.len()).collect();
    order.sort_by(|a, b| misfit(a).total_cmp(&misfit(b)));
    order.truncate(SUSPECTS);
    order
}

/// How else cameras are read by mistake, and what to tell whoever made the mistake.
const READINGS: [(Reading, &str); 10] = [
    (
        Reading::Axes([1.0, -1.0, -1.0]),
        "the cameras' y and z axes point the other way: the file has OpenCV's axes (y down, z forward) where OpenGL's \
         (y up, z backward) are expected, or the reverse; negate the second and third column of each camera-to-world \
         matrix",
    ),
    (
        Reading::Axes([-1.0, -1.0, 1.0]),
        "the pictures are upside down for their cameras: turn them by half a turn, or negate the first two columns of \
         each camera-to-world matrix",
    ),
    (
        Reading::Axes([-1.0, 1.0, -1.0]),
        "the cameras look backwards: negate the first and third column of each camera-to-world matrix",
    ),
    (Reading::Inverse { own: SAME, world: SAME }, INVERSE),
    (Reading::Inverse { own: OTHER, world: OTHER }, INVERSE),
    (Reading::Inverse { own: SAME, world: OTHER }, INVERSE),
    (
        Reading::Mirrored([-1.0, 1.0]),
        "the pictures seem to be mirrored left to right for their cameras: mirror the pictures",
    ),
    (
        Reading::Mirrored([1.0, -1.0]),
        "the pictures seem to be mirrored top to bottom for their cameras: mirror the pictures",
    ),
    (
        Reading::Focal(0.5),
        "the focal lengths seem to be twice too long: are they those of pictures twice as large?",
    ),
    (
        Reading::Focal(2.0),
        "the focal lengths seem to be half too long: are they those of pictures half as large?",
    ),
];

const INVERSE: &str = "the matrices seem to be the other way round, world-to-camera where camera-to-world is expected or the reverse: \
     invert each of them";
const SAME: [f64; 3] = [1.0; 3];
/// From OpenGL's axes to OpenCV's.
const OTHER: [f64; 3] = [1.0, -1.0, -1.0];

#[derive(Debug, Clone, Copy)]
enum Reading {
    /// The camera's axes, each with a sign.
    Axes([f64; 3]),
    /// The pose the other way round, the file's matrix in the axes of either convention.
    Inverse { own: [f64; 3], world: [f64; 3] },
    /// The picture's axes, each with a sign.
    Mirrored([f64; 2]),
    /// A factor of the focal lengths.
    Focal(f64),
}

impl Reading {
    fn of(self, silhouette: &Silhouette) -> Silhouette {
        let (pose, intrinsics) = (silhouette.pose, silhouette.intrinsics);
        match self {
            Self::Axes(signs) => {
                let turn = DMat3::from_diagonal(DVec3::from(signs));
                let pose = Pose { rotation: turn * pose.rotation, translation: turn * pose.translation };
                silhouette.with(pose, intrinsics)
            }
            Self::Inverse { own, world } => {
                let [own, world] = [own, world].map(|signs| DMat3::from_diagonal(DVec3::from(signs)));
                let rotation = own * pose.rotation.transpose() * world;
                silhouette.with(Pose { rotation, translation: own * pose.centre() }, intrinsics)
            }
            Self::Mirrored(signs) => {
                let [x, y] = signs;
                let focal = intrinsics.focal * glam::DVec2::new(x, y);
                silhouette.with(pose, Intrinsics { focal, ..intrinsics })
            }
            Self::Focal(factor) => {
                let focal = intrinsics.focal * factor;
                silhouette.with(pose, Intrinsics { focal, ..intrinsics })
            }
        }
    }
}

/// What to tell of the reading with which the silhouettes agree best, if that is much better than as they are read.
fn another_reading(silhouettes: &[Silhouette], agreement: f64) -> Option<String> {
    let agreeing = |(reading, remedy): (Reading, &'static str)| {
        let read: Vec<Silhouette> = silhouettes.iter().map(|silhouette| reading.of(silhouette)).collect();
        let agreement = Hull::carve(&read, COARSE, 0).map_or(0.0, |hull| hull.agreement());
        (agreement, remedy)
    };
    let best = READINGS.into_iter().map(agreeing).max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 > (agreement + GAIN).max(USELESS))
        .then(|| format!("{} (with that {:.0} % of the silhouettes' area agree)", best.1, 100.0 * best.0))
}
