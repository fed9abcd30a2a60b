use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::statistics::{mean, quantile};
use super::surface::{Surface, UnitSpace};
use crate::mesh::{SurfacePoint, TriangleId, TriangleMesh};
use crate::spatial::Hit;

/// One face of a collection with dense points that are known to correspond.
#[derive(Debug, Clone, Copy)]
pub struct CorrespondenceCase<'a> {
    /// The registered mesh.
    pub mesh: &'a TriangleMesh,
    /// The scan it was registered to.
    pub scan: &'a TriangleMesh,
    /// True points `[P]` in the scan's space: the same anatomical points in the same order in every case.
    pub truth: &'a [DVec3],
}

/// In what unit the scans are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CorrespondenceOptions {
    /// Millimetres to a unit of the scans.
    pub millimetres: f64,
    /// How far from the scanned surface, in millimetres, a true point may lie and still count as scanned.
    pub reach: f64,
}

impl Default for CorrespondenceOptions {
    /// Scans in centimetres, points within 1.5 mm.
    fn default() -> Self {
        Self { millimetres: 10.0, reach: 1.5 }
    }
}

/// How well the same point of the shared mesh marks the same anatomical point on every scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CorrespondenceFigures {
    /// Whether all meshes have the same triangles; without that nothing else counts.
    pub identical_triangles: bool,
    /// True points that every scan shows.
    pub points: usize,
    /// The distances, if the triangles are identical.
    #[serde(flatten)]
    pub distances: Option<CarriedDistances>,
}

/// Distances in millimetres; `mean_mm` to `p95_mm` between a true point and where the shared triangles carry the same
/// point of another case, over all points and ordered pairs of cases.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CarriedDistances {
    /// Mean distance from the scanned surface at the true points to the mesh.
    pub face_mm: f64,
    /// Mean.
    pub mean_mm: f64,
    /// Median.
    pub median_mm: f64,
    /// 95th percentile.
    pub p95_mm: f64,
    /// Ordered pairs of cases.
    pub pairs: usize,
}

/// Why cases cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CorrespondenceError {
    /// One case corresponds to nothing.
    #[error("correspondence needs at least two cases, not {0}")]
    TooFewCases(usize),
    /// The true points are not the same.
    #[error("case {case} has {found} true points, but the first case has {expected}")]
    PointCount {
        /// The case, counted from 0.
        case: usize,
        /// Its number of true points.
        found: usize,
        /// The first case's.
        expected: usize,
    },
    /// No true point lies on all scans.
    #[error(
        "no true point lies within {reach_mm} mm of the scanned surface in every case: is the unit right?"
    )]
    NothingSeen {
        /// The reach in millimetres.
        reach_mm: f64,
    },
}

/// Carries every true point of each case to every other through the shared triangles, and holds it against the truth.
///
/// # Errors
/// [`CorrespondenceError`] says what keeps the cases from being compared.
pub fn correspondence_figures(
    cases: &[CorrespondenceCase],
    options: CorrespondenceOptions,
) -> Result<CorrespondenceFigures, CorrespondenceError> {
    check(cases)?;
    let seen = seen_everywhere(cases, options);
    if seen.is_empty() {
        return Err(CorrespondenceError::NothingSeen { reach_mm: options.reach });
    }
    let shared = cases[0].mesh.triangles();
    let identical_triangles = cases.iter().all(|case| case.mesh.triangles() == shared);
    let distances = identical_triangles.then(|| carried_distances(cases, &seen, options.millimetres));
    Ok(CorrespondenceFigures { identical_triangles, points: seen.len(), distances })
}

fn check(cases: &[CorrespondenceCase]) -> Result<(), CorrespondenceError> {
    if cases.len() < 2 {
        return Err(CorrespondenceError::TooFewCases(cases.len()));
    }
    let expected = cases[0].truth.len();
    match cases.iter().position(|case| case.truth.len() != expected) {
        Some(case) => Err(CorrespondenceError::PointCount { case, found: cases[case].truth.len(), expected }),
        None => Ok(()),
    }
}

/// The true points that lie on the scanned surface of every case.
fn seen_everywhere(cases: &[CorrespondenceCase], options: CorrespondenceOptions) -> Vec<usize> {
    let mut seen: Vec<usize> = (0..cases[0].truth.len()).collect();
    for case in cases {
        let distances = distances(case.scan, case.scan, case.truth);
        seen.retain(|&point| distances[point] * options.millimetres < options.reach);
    }
    seen
}

fn carried_distances(cases: &[CorrespondenceCase], seen: &[usize], millimetres: f64) -> CarriedDistances {
    let (mut marks, mut face) = (Vec::new(), Vec::new());
    for case in cases {
        let truth: Vec<DVec3> = seen.iter().map(|&point| case.truth[point]).collect();
        marks.push(nearest(case.mesh, case.scan, &truth));
        let scanned: Vec<DVec3> =
            nearest(case.scan, case.scan, &truth).iter().map(|at| position(case.scan, at)).collect();
        face.extend(distances(case.mesh, case.scan, &scanned).iter().map(|d| d * millimetres));
    }
    let mut errors = Vec::new();
    for (a, marks) in marks.iter().enumerate() {
        for (_, case) in cases.iter().enumerate().filter(|&(b, _)| a != b) {
            let carried = marks.iter().map(|at| position(case.mesh, at));
            errors.extend(carried.zip(seen).map(|(p, &point)| p.distance(case.truth[point]) * millimetres));
        }
    }
    CarriedDistances {
        face_mm: mean(&face),
        mean_mm: mean(&errors),
        median_mm: quantile(&errors, 0.5),
        p95_mm: quantile(&errors, 0.95),
        pairs: cases.len() * (cases.len() - 1),
    }
}

/// The nearest points of `mesh` to `points`; `scan` sets the scale that the search works at.
fn nearest(mesh: &TriangleMesh, scan: &TriangleMesh, points: &[DVec3]) -> Vec<SurfacePoint> {
    let space = UnitSpace::of(scan);
    let points: Vec<DVec3> = points.iter().map(|&p| space.enter(p)).collect();
    let hits = Surface::new(mesh, &space).closest(&points);
    let mark =
        |hit: &Hit| SurfacePoint { triangle: TriangleId(hit.triangle), weights: hit.weights.map(f64::from) };
    hits.iter().map(mark).collect()
}

/// Distances of `points` from `mesh`, in its unit.
fn distances(mesh: &TriangleMesh, scan: &TriangleMesh, points: &[DVec3]) -> Vec<f64> {
    let nearest = nearest(mesh, scan, points);
    points.iter().zip(&nearest).map(|(p, at)| p.distance(position(mesh, at))).collect()
}

fn position(mesh: &TriangleMesh, at: &SurfacePoint) -> DVec3 {
    mesh.corners(at.triangle).iter().zip(at.weights).map(|(&corner, weight)| corner * weight).sum()
}
