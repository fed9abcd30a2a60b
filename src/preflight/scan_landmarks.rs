use glam::DVec3;
use serde::Serialize;

use super::alignment::align_either;
use super::audit::{Judge, LEAST_LANDMARKS, OFF_SURFACE, off_surface_finding};
use super::canonical::Canonical;
use super::finding::{Code, Finding, some_of};
use super::frame::Axes;
use super::off_surface::distances_from_surface;
use crate::formats::Scheme;
use crate::mesh::{LandmarkSet, Points, TriangleMesh};

/// Fewer landmarks do not turn a scan onto another.
const LEAST: usize = 3;

/// One scan's landmarks.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LandmarkFigures {
    /// The scheme that they state, by the name that the program knows it by.
    pub scheme: Option<String>,
    /// How many names there are.
    pub named: usize,
    /// How many of them have a position.
    pub present: usize,
    /// The largest distance of a landmark from the surface, in scan units.
    pub farthest_from_surface: Option<f64>,
    /// The same, in units of the root mean square distance of the landmarks from their centre.
    pub farthest_relative: Option<f64>,
}

/// Looks at a scan's landmarks, by themselves, on the surface and beside those of sculpted heads.
///
/// They also tell how the face is turned, if they are a face.
pub(super) fn inspect_landmarks(
    mesh: &TriangleMesh<impl Points>,
    set: &LandmarkSet,
) -> (LandmarkFigures, Option<Axes>, Vec<Finding>) {
    let distances = distances_from_surface(mesh, &set.points);
    let radius = radius(&set.points);
    let farthest = distances.iter().copied().filter(|d| d.is_finite()).reduce(f64::max);
    let scheme = set.scheme.as_deref().and_then(Scheme::named);
    let present = set.present().count();
    let figures = LandmarkFigures {
        scheme: scheme.map(|scheme| scheme.name.to_owned()),
        named: set.names.len(),
        present,
        farthest_from_surface: farthest,
        farthest_relative: farthest.map(|d| d / radius).filter(|d| d.is_finite()),
    };
    let mut findings = counted(set, scheme, present);
    let beside = beside_heads(set, &distances);
    let axes = beside.as_ref().and_then(|(axes, _)| *axes);
    if let Some((_, beside)) = beside {
        findings.extend(beside);
    } else if present >= LEAST {
        findings.extend(alone(set, &distances, OFF_SURFACE * radius));
    }
    (figures, axes, findings)
}

/// The root mean square distance of points from their centre.
fn radius(points: &[Option<DVec3>]) -> f64 {
    let there: Vec<DVec3> = points.iter().flatten().copied().collect();
    let centre = there.iter().sum::<DVec3>() / there.len() as f64;
    (there.iter().map(|p| p.distance_squared(centre)).sum::<f64>() / there.len() as f64).sqrt()
}

fn counted(set: &LandmarkSet, scheme: Option<&Scheme>, present: usize) -> Vec<Finding> {
    let mut findings = Vec::new();
    if present < LEAST {
        let found = format!("{present} landmarks have a position");
        findings.push(Finding::new(
            Code::TooFewLandmarks,
            found,
            "give at least 3, and better 20 all over the face",
        ));
    }
    let missing: Vec<&str> = set
        .names
        .iter()
        .zip(&set.points)
        .filter(|(_, p)| p.is_none())
        .map(|(name, _)| name.as_str())
        .collect();
    let unnamed: Vec<String> = scheme.map_or_else(Vec::new, |scheme| {
        (0..scheme.count()).map(|at| at.to_string()).filter(|name| !set.names.contains(name)).collect()
    });
    let missing: Vec<&str> = missing.into_iter().chain(unnamed.iter().map(String::as_str)).collect();
    if !missing.is_empty() {
        let found = format!("{} landmarks have no position: {}", missing.len(), some_of(&missing));
        let advice = "nothing, if they cannot be seen: a collection is registered by the landmarks that all scans have";
        findings.push(Finding::new(Code::LandmarksMissing, found, advice).about(missing));
    }
    if scheme.is_none() {
        let found = match &set.scheme {
            Some(name) => format!("the scheme `{}` is not known", name.escape_default()),
            None => "no scheme is stated".to_owned(),
        };
        findings.push(Finding::new(
            Code::SchemeUnknown,
            found + ", so that the landmarks' order and sides cannot be checked",
            "add \"scheme\": \"multipie68\" to the file if they are those",
        ));
    }
    findings
}

/// How the face is turned and what is wrong with the landmarks, from sculpted heads; `None` if the landmarks' scheme is
/// not known or there are too few.
fn beside_heads(set: &LandmarkSet, distances: &[f64]) -> Option<(Option<Axes>, Vec<Finding>)> {
    if set.present().count() < LEAST_LANDMARKS {
        return None;
    }
    let canonical = Canonical::of(std::iter::once(set), &set.names)?;
    let (aligned, mirrored) = align_either(&set.points, &canonical.shape);
    let judge =
        Judge { names: &set.names, aligned: &aligned, mirrored, surface: Some(distances), off: OFF_SURFACE };
    let findings = judge.judged("", &canonical.model).findings;
    let is_face = findings.iter().all(|finding| finding.code != Code::LandmarksDisordered);
    Some((is_face.then(|| Axes::of_aligned(&aligned, mirrored)), findings))
}

/// The landmarks on the surface alone, none of which should be farther from it than `limit`.
fn alone(set: &LandmarkSet, distances: &[f64], limit: f64) -> Option<Finding> {
    let off: Vec<usize> = (0..distances.len()).filter(|&at| distances[at] > limit).collect();
    let names: Vec<&str> = off.iter().map(|&at| set.names[at].as_str()).collect();
    let farthest = off.iter().map(|&at| distances[at]).fold(0.0, f64::max);
    (!off.is_empty()).then(|| off_surface_finding(&names, farthest))
}
