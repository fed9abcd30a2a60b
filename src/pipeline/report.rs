use std::collections::BTreeMap;

use serde::Serialize;

use super::carried::matched_triangles;
use super::membership::FailedScan;
use super::package::program;
use super::precheck::Precheck;
use super::register::Subject;
use super::template::Template;
use super::verdict::{Reason, Verdict};
use crate::evaluate::Fidelity;
use crate::mesh::{SurfacePoint, TriangleMesh};

/// Version of this record.
const RECORD: u32 = 2;

/// How well a registration went; but for the seconds, the same inputs and settings give the same report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report<S = ScanReport> {
    /// Version of this record.
    pub record: u32,
    /// The program and its version.
    pub program: String,
    /// Wall-clock seconds of each stage, of reading and of writing.
    pub seconds: BTreeMap<String, f64>,
    /// The scans in their order.
    pub scans: Vec<S>,
    /// The scans that were left out.
    pub failed: Vec<FailedScan>,
}

/// How well the template lies on one scan; lengths are in the scan's units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScanReport {
    /// The scan's name.
    pub name: String,
    /// Whether the result can be used.
    pub verdict: Verdict,
    /// Why not as it is, the worst first; empty if it passes.
    pub reasons: Vec<Reason>,
    /// What was known before.
    #[serde(flatten)]
    pub precheck: Precheck,
    /// Distances, normals and the state of the triangles, of what is matched: without the template's carried and masked
    /// parts, against the scan without what its mask leaves out.
    #[serde(flatten)]
    pub fidelity: Fidelity,
    /// Share of the result's area that the scan's data says: where the vertices' confidence is above a half.
    pub coverage: f64,
    /// Mean distance of the landmarks.
    pub landmark_mean: f64,
    /// Distance of each of the template's landmarks from the scan's.
    pub landmarks: BTreeMap<String, f64>,
}

impl ScanReport {
    /// Holds a result against its scan, and judges it; `confidence` `[N]` is its vertices'.
    pub fn of(
        subject: &Subject,
        precheck: &Precheck,
        result: &TriangleMesh,
        confidence: &[f32],
        template: &Template,
    ) -> Self {
        let residual = |(name, at): (&String, &SurfacePoint)| {
            let target = subject.landmarks.get(name)?;
            Some((name.clone(), position(result, at).distance(target)))
        };
        let landmarks: BTreeMap<String, f64> = template.landmarks.iter().filter_map(residual).collect();
        let matched = result.only(matched_triangles(template));
        let mut report = Self {
            name: subject.name.clone(),
            verdict: Verdict::Pass,
            reasons: Vec::new(),
            precheck: precheck.clone(),
            fidelity: Fidelity::of_part(&subject.mesh, |corners| is_data(subject, corners), &matched),
            coverage: coverage(&matched, confidence),
            landmark_mean: landmarks.values().sum::<f64>() / landmarks.len().max(1) as f64,
            landmarks,
        };
        report.reasons = Reason::all_of(&report);
        report.verdict = report.reasons.first().map_or(Verdict::Pass, |worst| worst.verdict);
        report
    }
}

impl<S> Report<S> {
    /// The report on scans that were registered, and on those that were left out.
    pub fn of(seconds: BTreeMap<String, f64>, scans: Vec<S>, failed: Vec<FailedScan>) -> Self {
        Self { record: RECORD, program: program(), seconds, scans, failed }
    }
}

impl Report {
    /// How many scans have this verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.scans.iter().filter(|scan| scan.verdict == verdict).count()
    }
}

/// Whether the scan's mask leaves a triangle's corners in.
fn is_data(subject: &Subject, corners: &[u32; 3]) -> bool {
    subject.mask.as_ref().is_none_or(|mask| corners.iter().all(|&i| mask[i as usize] > 0.0))
}

/// The share of a mesh's area around vertices of a confidence above a half.
fn coverage(mesh: &TriangleMesh, confidence: &[f32]) -> f64 {
    let (mut known, mut all) = (0.0, 0.0);
    for corners in mesh.triangles() {
        let [a, b, c] = corners.map(|i| mesh.positions()[i as usize]);
        let area = (b - a).cross(c - a).length();
        all += area;
        known += area * corners.iter().filter(|&&i| confidence[i as usize] > 0.5).count() as f64 / 3.0;
    }
    if all > 0.0 { known / all } else { 0.0 }
}

/// Where a point of the shared triangles lies on a result.
pub(super) fn position(result: &TriangleMesh, at: &SurfacePoint) -> glam::DVec3 {
    result.corners(at.triangle).iter().zip(at.weights).map(|(&corner, weight)| corner * weight).sum()
}
