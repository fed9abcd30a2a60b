use rayon::prelude::*;
use serde::Serialize;

use super::register::Subject;
use crate::preflight::{AuditCase, Code, Finding, Inspection, LandmarkAudit, ScanAudit, audit};

/// What is known of a scan before it is registered.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Precheck {
    /// What is wrong or worth knowing, the worst first.
    pub findings: Vec<Finding>,
    /// Edges of three and more triangles or of opposed ones, degenerate and duplicate triangles: how many there are to a
    /// triangle.
    pub damage: f64,
    /// Share of the surface's area in its largest part.
    pub largest_part: f64,
}

/// Looks at all scans of a collection, each by itself and their landmarks beside each other; in their order.
pub fn precheck(subjects: &[Subject]) -> Vec<Precheck> {
    let inspect = |subject: &Subject| Inspection::new(&subject.mesh, Some(&subject.landmarks));
    let inspections: Vec<Inspection> = subjects.par_iter().map(inspect).collect();
    inspections
        .into_iter()
        .zip(audit_landmarks(subjects).scans)
        .map(|(inspection, audited)| Precheck::new(inspection, audited))
        .collect()
}

/// Holds the landmarks of a collection against each other and against their scans.
pub fn audit_landmarks(subjects: &[Subject]) -> LandmarkAudit {
    let cases = subjects.iter().map(|Subject { name, mesh, landmarks, .. }| AuditCase {
        name,
        landmarks,
        mesh: Some(mesh),
    });
    audit(&cases.collect::<Vec<_>>())
}

impl Precheck {
    fn new(inspection: Inspection, audited: ScanAudit) -> Self {
        let Inspection { non_manifold_edges, opposed_edges, degenerate_triangles, .. } = inspection;
        let damaged =
            non_manifold_edges + opposed_edges + degenerate_triangles + inspection.duplicate_triangles;
        let largest = inspection.components.first().map_or(0.0, |part| part.area);
        // The other scans judge landmarks better than the scan does alone.
        let judged = !audited.strangeness.is_empty() || !audited.findings.is_empty();
        let alone = inspection.findings.into_iter().filter(|f| !(judged && judges_places(f.code)));
        let mut findings: Vec<Finding> = alone.chain(audited.findings).collect();
        // Stable: findings of one severity stay in their order.
        findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
        Self {
            findings,
            damage: damaged as f64 / inspection.triangles as f64,
            largest_part: if inspection.area > 0.0 { largest / inspection.area } else { 0.0 },
        }
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
