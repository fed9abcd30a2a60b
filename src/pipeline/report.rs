use std::collections::BTreeMap;

use serde::Serialize;

use super::membership::FailedScan;
use super::register::Subject;
use super::template::Template;
use crate::evaluate::Fidelity;
use crate::mesh::{SurfacePoint, TriangleMesh};

/// How well a registration went; but for the seconds, the same inputs and settings give the same report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Version of this record.
    pub record: u32,
    /// The program and its version.
    pub program: String,
    /// Wall-clock seconds of each stage, of reading and of writing.
    pub seconds: BTreeMap<String, f64>,
    /// The scans in their order.
    pub scans: Vec<ScanReport>,
    /// The scans that were left out.
    pub failed: Vec<FailedScan>,
}

/// How well the template lies on one scan; lengths are in the scan's units.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScanReport {
    /// The scan's name.
    pub name: String,
    /// Distances, normals and the state of the triangles.
    #[serde(flatten)]
    pub fidelity: Fidelity,
    /// Mean distance of the landmarks.
    pub landmark_mean: f64,
    /// Distance of each of the template's landmarks from the scan's.
    pub landmarks: BTreeMap<String, f64>,
}

impl ScanReport {
    /// Holds a result against its scan.
    pub fn of(subject: &Subject, result: &TriangleMesh, template: &Template) -> Self {
        let residual = |(name, at): (&String, &SurfacePoint)| {
            let target = subject.landmarks.get(name)?;
            Some((name.clone(), position(result, at).distance(target)))
        };
        let landmarks: BTreeMap<String, f64> = template.landmarks.iter().filter_map(residual).collect();
        Self {
            name: subject.name.clone(),
            fidelity: Fidelity::of(&subject.mesh, result),
            landmark_mean: landmarks.values().sum::<f64>() / landmarks.len().max(1) as f64,
            landmarks,
        }
    }
}

/// Where a point of the shared triangles lies on a result.
pub(super) fn position(result: &TriangleMesh, at: &SurfacePoint) -> glam::DVec3 {
    result.corners(at.triangle).iter().zip(at.weights).map(|(&corner, weight)| corner * weight).sum()
}
