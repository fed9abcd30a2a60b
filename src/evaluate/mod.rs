//! Figures that say how good a result is: how closely a mesh lies on its scan, and how well the same point of the
//! shared mesh marks the same anatomical point on every scan. Layer 3.

mod correspondence;
mod curvature;
mod dense_points;
mod fidelity;
mod samples;
mod scan_quality;
mod spacing;
mod statistics;
mod surface;
mod surface_figures;
#[cfg(test)]
mod tests;

pub use correspondence::{
    CarriedDistances, CorrespondenceCase, CorrespondenceError, CorrespondenceFigures, CorrespondenceOptions,
    correspondence_figures,
};
pub use dense_points::{DensePointsError, dense_points_from_json, dense_points_from_npy};
pub use fidelity::{Distances, Fidelity, NOISE_TOLERANCE, Overlap, TOLERANCE};
pub use scan_quality::ScanQuality;
pub use spacing::Spacing;
pub use surface_figures::{SurfaceFigures, surface_figures};
