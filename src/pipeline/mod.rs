//! The paper's stages over a collection: fit, resample, register, and what we add to them. Layer 4.

mod scan_surface;
pub mod fit;
pub mod groupwise;
pub mod resample;

pub use scan_surface::{ScanSurface, SurfaceSample};
