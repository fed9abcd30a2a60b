//! The landmarks of a collection, held against each other and against their surfaces.

use std::collections::BTreeMap;

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::alignment::{Aligned, Points, align_either, median, shared_shape};
use super::canonical::Canonical;
use super::face_model::FaceModel;
use super::finding::{Code, Finding, some_of};
use super::suspicion::Suspicion;
use crate::mesh::LandmarkSet;

/// Landmarks that are held against each other at most: the first that enough scans have.
const MOST_LANDMARKS: usize = 400;
/// Fewer landmarks on a scan are no face.
pub(super) const LEAST_LANDMARKS: usize = 6;
/// Fewer scans tell too little of how faces vary; sculpted heads help where the scheme is known.
const LEAST_SCANS: usize = 8;
/// Parts of a collection, each of which is judged by the others.
const PARTS: usize = 16;
/// Landmarks whose median distance from the shared shape is more of a face's root mean square radius are no face.
const NO_FACE: f64 = 0.5;
/// A landmark farther from the surface than this, in units of the face's root mean square radius, lies off it: about
/// two millimetres.
pub(super) const OFF_SURFACE: f64 = 0.035;
/// Where a collection's landmarks lie off their surfaces altogether, so many times their median distance.
const FAR_OFF: f64 = 6.0;
/// However far they lie off.
const MOST_OFF: f64 = 0.15;
/// A scan of which this share of landmarks lies off the surface has landmarks from elsewhere.
const ELSEWHERE: f64 = 0.3;

/// One scan's landmarks to be audited.
#[derive(Debug, Clone, Copy)]
pub struct AuditCase<'a> {
    /// The scan's name.
    pub name: &'a str,
    /// Its landmarks.
    pub landmarks: &'a LandmarkSet,
    /// How far each is from its surface, see [`landmark_distances`](super::landmark_distances), if that is to be asked.
    pub distances: Option<&'a BTreeMap<String, f64>>,
}

/// What a collection's landmarks look like beside each other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LandmarkAudit {
    /// For each landmark that was audited, the median over scans of its distance from the shared shape after a robust
    /// alignment, in units of the face's root mean square radius.
    pub spread: BTreeMap<String, f64>,
    /// The scans, in the order given.
    pub scans: Vec<ScanAudit>,
}

/// What one scan's landmarks look like.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScanAudit {
    /// The scan.
    pub name: String,
    /// What is wrong, if anything.
    pub findings: Vec<Finding>,
    /// For each audited landmark of the scan, how strange it looks: 1 and more is misplaced.
    pub strangeness: BTreeMap<String, f64>,
    /// For each audited landmark of the scan, how much it should count in a registration, from 0 to 1.
    pub weights: BTreeMap<String, f64>,
}

/// Finds landmarks that are misplaced, exchanged, mirrored or those of another scan.
///
/// Every landmark is held against where it should be from the scan's other landmarks, as the other scans teach: a scan
/// is never judged by itself. Fewer than eight scans are judged by sculpted heads if they state a scheme that the program
/// knows, and not at all otherwise. With their distances, landmarks are also held against the surface. Landmarks that less than
/// half of the scans have are passed over, and all beyond the first 400.
pub fn audit(cases: &[AuditCase]) -> LandmarkAudit {
    let names = names(cases);
    let faces: Vec<Points> = cases
        .iter()
        .map(|case| {
            let points: BTreeMap<&str, DVec3> = case.landmarks.present().collect();
            names.iter().map(|name| points.get(name.as_str()).copied()).collect()
        })
        .collect();
    let distance = |own: &BTreeMap<String, f64>, name| own.get(name).copied().unwrap_or(f64::NAN);
    let in_order = |own: &BTreeMap<String, f64>| names.iter().map(|name| distance(own, name)).collect();
    let distances: Vec<Option<Vec<f64>>> = cases.iter().map(|case| case.distances.map(in_order)).collect();
    let whole = |face: &&Points| face.iter().flatten().count() >= LEAST_LANDMARKS;
    let usable: Vec<Points> = faces.iter().filter(whole).cloned().collect();
    let canonical =
        (usable.len() < LEAST_SCANS).then(|| Canonical::of(cases.iter().map(|c| c.landmarks), &names));
    let shape = match &canonical {
        Some(Some(canonical)) => canonical.shape.clone(),
        Some(None) => Vec::new(),
        None => shared_shape(&usable),
    };
    let aligned: Vec<Option<(Aligned, bool)>> = if shape.is_empty() {
        faces.iter().map(|_| None).collect()
    } else {
        faces.par_iter().map(|face| whole(&face).then(|| align_either(face, &shape))).collect()
    };
    let off = off_surface_limit(&aligned, &distances);
    let judged = |models: &Models| -> Vec<ScanAudit> {
        let judge = |at: usize| match &aligned[at] {
            Some((aligned, mirrored)) => {
                let surface = distances[at].as_deref();
                let judge = Judge { names: &names, aligned, mirrored: *mirrored, surface, off };
                judge.judged(cases[at].name, models.for_scan(at))
            }
            None => unjudged(cases[at].name, &names, &faces[at]),
        };
        (0..cases.len()).into_par_iter().map(judge).collect()
    };
    let scans = match canonical.flatten() {
        Some(canonical) => judged(&Models(vec![canonical.model])),
        None => {
            // What is found wrong at first teaches nothing the second time.
            let teachers: Vec<Option<Points>> =
                aligned.iter().map(|face| face.as_ref().map(|(aligned, _)| aligned.points.clone())).collect();
            let first = judged(&Models::new(&teachers, &shape));
            if first.iter().all(|scan| scan.findings.is_empty()) {
                first
            } else {
                let right =
                    teachers.into_iter().zip(&first).map(|(face, scan)| Some(trusted(face?, &names, scan)));
                judged(&Models::new(&right.collect::<Vec<_>>(), &shape))
            }
        }
    };
    LandmarkAudit { spread: spread(&names, &aligned, &shape), scans }
}

/// A face without the landmarks that count nothing; one that is mirrored was mirrored back, and teaches as any other.
fn trusted(face: Points, names: &[String], scan: &ScanAudit) -> Points {
    let sides = [Code::LandmarksMirrored, Code::LeftRightSwapped];
    if matches!(&scan.findings[..], [finding] if sides.contains(&finding.code)) {
        return face;
    }
    let counts = |name: &String| scan.weights.get(name).is_some_and(|&weight| weight > 0.0);
    face.into_iter().zip(names).map(|(point, name)| point.filter(|_| counts(name))).collect()
}

/// The landmarks that at least half of the scans have, in the order in which they are met.
fn names(cases: &[AuditCase]) -> Vec<String> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let mut order = Vec::new();
    for (name, _) in cases.iter().flat_map(|case| case.landmarks.present()) {
        let count = counts.entry(name).or_insert(0);
        if *count == 0 {
            order.push(name);
        }
        *count += 1;
    }
    let common = order.into_iter().filter(|name| 2 * counts[name] >= cases.len());
    common.take(MOST_LANDMARKS).map(str::to_owned).collect()
}

/// Models of faces, each learned from all parts of the collection but one.
struct Models(Vec<FaceModel>);

impl Models {
    fn new(faces: &[Option<Points>], shape: &[DVec3]) -> Self {
        let parts = faces.len().min(PARTS);
        let without = |part: usize| {
            let others = faces.iter().enumerate().filter(|(at, _)| at % parts != part);
            FaceModel::new(&others.filter_map(|(_, face)| face.as_ref()).collect::<Vec<_>>(), shape)
        };
        Self((0..parts).into_par_iter().map(without).collect())
    }

    fn for_scan(&self, at: usize) -> &FaceModel {
        &self.0[at % self.0.len()]
    }
}

/// The distance from the surface, in units of the face's root mean square radius, beyond which a landmark lies off it.
fn off_surface_limit(aligned: &[Option<(Aligned, bool)>], distances: &[Option<Vec<f64>>]) -> f64 {
    let relative = aligned.iter().zip(distances).filter_map(|(aligned, distances)| {
        let scale = aligned.as_ref()?.0.similarity.scale;
        let there = distances.as_ref()?.iter().copied().filter(|d| d.is_finite());
        Some(scale * median(there))
    });
    let usual: Vec<f64> = relative.collect();
    if usual.len() < LEAST_SCANS {
        OFF_SURFACE
    } else {
        (FAR_OFF * median(usual)).clamp(OFF_SURFACE, MOST_OFF)
    }
}

fn spread(names: &[String], aligned: &[Option<(Aligned, bool)>], shape: &[DVec3]) -> BTreeMap<String, f64> {
    let faces = || aligned.iter().flatten().map(|(aligned, _)| &aligned.points);
    let of = |at: usize| median(faces().filter_map(|face| face[at]).map(|p| p.distance(shape[at])));
    let spreads = names.iter().enumerate().map(|(at, name)| (name.clone(), of(at)));
    if shape.is_empty() { BTreeMap::new() } else { spreads.filter(|(_, s)| s.is_finite()).collect() }
}

/// A scan whose landmarks are too few, or of an unknown kind.
fn unjudged(name: &str, names: &[String], face: &Points) -> ScanAudit {
    let there = names.iter().zip(face).filter(|(_, point)| point.is_some());
    let weights = there.map(|(name, _)| (name.clone(), 1.0)).collect();
    ScanAudit { name: name.to_owned(), findings: Vec::new(), strangeness: BTreeMap::new(), weights }
}

/// One scan and what is known of it.
pub(super) struct Judge<'a> {
    pub names: &'a [String],
    pub aligned: &'a Aligned,
    pub mirrored: bool,
    /// The landmarks' distances from the surface, in the scan's units; NaN for missing ones.
    pub surface: Option<&'a [f64]>,
    /// The distance, in units of the face's root mean square radius, beyond which a landmark lies off the surface.
    pub off: f64,
}

impl Judge<'_> {
    pub fn judged(&self, name: &str, model: &FaceModel) -> ScanAudit {
        let off = self.off_surface();
        let there = self.aligned.points.iter().flatten().count();
        let elsewhere = off.len() as f64 > ELSEWHERE * there as f64;
        let mut scan = unjudged(name, self.names, &self.aligned.points);
        if self.mirrored {
            scan.findings.push(self.mirror_finding(elsewhere));
        } else if elsewhere {
            scan.findings.push(self.elsewhere_finding(off.len(), there));
        }
        if self.aligned.distance > NO_FACE {
            scan.findings.push(disordered(self.aligned.distance));
        }
        if !scan.findings.is_empty() {
            scan.weights.values_mut().for_each(|weight| *weight = 0.0);
            return scan;
        }
        if let Some(expectation) = model.expectation(&self.aligned.points) {
            self.by_shape(&mut scan, &Suspicion::new(expectation));
        }
        self.by_surface(&mut scan, &off);
        scan
    }

    fn by_shape(&self, scan: &mut ScanAudit, suspicion: &Suspicion) {
        let name = |at: usize| self.names[suspicion.landmarks[at]].as_str();
        let scale = self.aligned.similarity.scale;
        for (at, weight) in suspicion.weights().into_iter().enumerate() {
            scan.weights.insert(name(at).to_owned(), weight);
            scan.strangeness.insert(name(at).to_owned(), suspicion.strangeness[at]);
        }
        for &[one, other] in &suspicion.exchanged {
            let found = format!("`{}` and `{}` are each where the other should be", name(one), name(other));
            let finding = Finding::new(Code::LandmarksSwapped, found, "exchange them");
            scan.findings.push(finding.about([name(one), name(other)]));
        }
        for &at in
            suspicion.misplaced.iter().filter(|at| !suspicion.exchanged.iter().flatten().any(|e| e == *at))
        {
            let found = format!(
                "`{}` is {:.3} scan units from where the other landmarks put it",
                name(at),
                suspicion.distances[at] / scale
            );
            let finding =
                Finding::new(Code::LandmarkMisplaced, found, "look at it and place it anew, or give null");
            scan.findings.push(finding.about([name(at)]));
        }
    }

    fn by_surface(&self, scan: &mut ScanAudit, off: &[usize]) {
        if off.is_empty() {
            return;
        }
        let names: Vec<&str> = off.iter().map(|&at| self.names[at].as_str()).collect();
        for name in &names {
            scan.weights.insert((*name).to_owned(), 0.0);
        }
        scan.findings.push(off_surface_finding(&names, self.farthest(off)));
    }

    fn farthest(&self, off: &[usize]) -> f64 {
        self.surface.map_or(0.0, |distances| off.iter().map(|&at| distances[at]).fold(0.0, f64::max))
    }

    fn off_surface(&self) -> Vec<usize> {
        let scale = self.aligned.similarity.scale;
        let distances = self.surface.unwrap_or_default().iter().enumerate();
        distances.filter(|(_, d)| **d * scale > self.off).map(|(at, _)| at).collect()
    }

    fn mirror_finding(&self, elsewhere: bool) -> Finding {
        if self.surface.is_some() && !elsewhere {
            return Finding::new(
                Code::LeftRightSwapped,
                "the landmarks lie on the surface, but those of the left are named as those of the right",
                "exchange the names of left and right; left is the person's own, and in a scheme's picture on the right. \
                 If the whole scan is mirrored, mirror it back",
            );
        }
        Finding::new(
            Code::LandmarksMirrored,
            "the landmarks are those of a mirrored face",
            "mirror their coordinates back (negate one axis, as the scan's file has it), or exchange the names of left \
             and right",
        )
    }

    fn elsewhere_finding(&self, off: usize, there: usize) -> Finding {
        let all: Vec<usize> = self.off_surface();
        Finding::new(
            Code::LandmarksElsewhere,
            format!(
                "{off} of {there} landmarks lie off the surface, by up to {:.3} scan units",
                self.farthest(&all)
            ),
            "check that they belong to this scan, and are in its unit and pose",
        )
    }
}

pub(super) fn off_surface_finding(names: &[&str], farthest: f64) -> Finding {
    let found = format!(
        "{} off the surface, by up to {farthest:.3} scan units: {}",
        if names.len() == 1 {
            "1 landmark lies".to_owned()
        } else {
            format!("{} landmarks lie", names.len())
        },
        some_of(names)
    );
    let advice = "place them on the surface, or give null where the surface is missing";
    Finding::new(Code::LandmarksOffSurface, found, advice).about(names.iter().copied())
}

fn disordered(distance: f64) -> Finding {
    Finding::new(
        Code::LandmarksDisordered,
        format!(
            "half of the landmarks are more than {:.0} % of the face's radius from where they should be",
            100.0 * distance
        ),
        "check that they are in the order of their scheme, and all from one scan",
    )
}
