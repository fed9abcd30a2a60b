use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::register::Subject;
use crate::mesh::LandmarkSet;
use crate::preflight::{
    AuditCase, Code, Finding, Inspection, LandmarkAudit, ScanAudit, audit, landmark_distances,
};

/// What is known of a scan before it is registered.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Precheck {
    /// What is wrong or worth knowing, the worst first.
    pub findings: Vec<Finding>,
    /// Edges of three and more triangles or of opposed ones, degenerate and duplicate triangles: how many there are to a
    /// triangle.
    pub damage: f64,
    /// Share of the surface's area in its largest part.
    pub largest_part: f64,
}

/// What is seen of a scan by itself, for the [`Precheck`] beside the others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Inspected {
    /// What is known without the others.
    pub alone: Precheck,
    /// Its landmarks.
    pub landmarks: LandmarkSet,
    /// How far each lies from the surface.
    pub distances: BTreeMap<String, f64>,
}

impl Inspected {
    /// Looks at a scan.
    pub fn of(subject: &Subject) -> Self {
        let Subject { mesh, landmarks, .. } = subject;
        let alone = Precheck::alone(Inspection::new(mesh, Some(landmarks)));
        Self { alone, landmarks: landmarks.clone(), distances: landmark_distances(mesh, landmarks) }
    }

    fn case<'a>(&'a self, name: &'a str) -> AuditCase<'a> {
        AuditCase { name, landmarks: &self.landmarks, distances: Some(&self.distances) }
    }
}

/// Looks at all scans of a collection, each by itself and their landmarks beside each other; in their order.
pub fn precheck(subjects: &[Subject]) -> Vec<Precheck> {
    let inspected: Vec<Inspected> = subjects.par_iter().map(Inspected::of).collect();
    let named: Vec<_> = subjects.iter().map(|subject| subject.name.as_str()).zip(&inspected).collect();
    precheck_inspected(&named).0
}

/// Holds the scans of a collection, by their names, beside each other; in their order.
pub fn precheck_inspected(scans: &[(&str, &Inspected)]) -> (Vec<Precheck>, LandmarkAudit) {
    let cases: Vec<AuditCase> = scans.iter().map(|(name, inspected)| inspected.case(name)).collect();
    let audit = audit(&cases);
    let beside =
        |((_, inspected), audited): (&(&str, &Inspected), &ScanAudit)| inspected.alone.beside(audited);
    (scans.iter().zip(&audit.scans).map(beside).collect(), audit)
}

/// Holds the landmarks of a collection against each other and against their scans.
pub fn audit_landmarks(subjects: &[Subject]) -> LandmarkAudit {
    let distances = |subject: &Subject| landmark_distances(&subject.mesh, &subject.landmarks);
    let distances: Vec<_> = subjects.par_iter().map(distances).collect();
    let cases = subjects.iter().zip(&distances).map(|(Subject { name, landmarks, .. }, distances)| {
        AuditCase { name, landmarks, distances: Some(distances) }
    });
    audit(&cases.collect::<Vec<_>>())
}

impl Precheck {
    fn alone(inspection: Inspection) -> Self {
        let Inspection { non_manifold_edges, opposed_edges, degenerate_triangles, .. } = inspection;
        let damaged =
            non_manifold_edges + opposed_edges + degenerate_triangles + inspection.duplicate_triangles;
        let largest = inspection.components.first().map_or(0.0, |part| part.area);
        Self {
            findings: inspection.findings,
            damage: damaged as f64 / inspection.triangles as f64,
            largest_part: if inspection.area > 0.0 { largest / inspection.area } else { 0.0 },
        }
    }

    fn beside(&self, audited: &ScanAudit) -> Self {
        // The other scans judge landmarks better than the scan does alone.
        let judged = !audited.strangeness.is_empty() || !audited.findings.is_empty();
        let alone = self.findings.iter().filter(|f| !(judged && judges_places(f.code)));
        let mut findings: Vec<Finding> = alone.chain(&audited.findings).cloned().collect();
        // Stable: findings of one severity stay in their order.
        findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
        Self { findings, ..*self }
    }
}

/// Whether a finding says that landmarks are in the wrong place.
fn judges_places(code: Code) -> bool {
    matches!(
        code,
        Code::LandmarksOffSurface
            | Code::LandmarksElsewhere
            | Code::LandmarksMirrored
            | Code::LeftRightSwapped
            | Code::LandmarksSwapped
            | Code::LandmarkMisplaced
            | Code::LandmarksDisordered
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::{Sculptor, Settings};

    fn codes(check: &Precheck) -> Vec<Code> {
        check.findings.iter().map(|finding| finding.code).collect()
    }

    #[test]
    fn each_fault_is_said_once_and_by_whom_it_is_seen_best() {
        let small = Settings { triangles: 3000, ..Settings::default() };
        let heads = Sculptor::new(7).with(small).collection(2, &[1.0]);
        let subject = |at: usize| {
            let (name, mesh) = (heads[at].name.clone(), heads[at].mesh.clone());
            Subject { name, mesh, landmarks: heads[at].landmarks.clone(), mask: None }
        };
        let mut subjects = [subject(0), subject(1)];
        subjects[1].landmarks.points.swap(8, 27);
        let checks = precheck(&subjects);
        assert_eq!(codes(&checks[0]), [Code::OpenBoundary]);
        assert_eq!(codes(&checks[1]), [Code::LandmarksSwapped, Code::OpenBoundary]);
        assert_eq!((checks[0].damage, checks[0].largest_part), (0.0, 1.0));

        // Without a scheme two scans cannot be held against each other, but still against their surfaces.
        subjects.iter_mut().for_each(|subject| subject.landmarks.scheme = None);
        subjects[1].landmarks.points.iter_mut().flatten().for_each(|p| *p *= 10.0);
        let checks = precheck(&subjects);
        assert!(!codes(&checks[0]).contains(&Code::LandmarksOffSurface), "{:?}", checks[0]);
        assert!(codes(&checks[1]).contains(&Code::LandmarksOffSurface), "{:?}", checks[1]);
    }
}
