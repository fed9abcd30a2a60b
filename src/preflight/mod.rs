//! What is worth knowing before a registration: of a scan by itself, and of a collection's landmarks. Layer 3.

mod alignment;
mod audit;
mod canonical;
mod connectivity;
mod face_model;
mod finding;
mod frame;
mod inspection;
mod off_surface;
mod scan_landmarks;
mod suspicion;
#[cfg(test)]
mod tests;
mod triangles;

pub use audit::{AuditCase, LandmarkAudit, ScanAudit, audit};
pub use connectivity::{BoundaryLoop, Component};
pub use finding::{Code, Finding, Severity};
pub use frame::{Axes, Basis, Unit, UnitGuess};
pub use inspection::Inspection;
pub use off_surface::landmark_distances;
pub use scan_landmarks::LandmarkFigures;
