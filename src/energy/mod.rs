//! The terms that are minimised, one a file; each gives its value and adds its gradient. Layer 2.
//!
//! A term holds its targets as frozen data: what is not differentiated is a field, what is differentiated is the
//! [`Shape`].

mod adaptation;
mod chamfer;
mod foldover;
mod landmark;
mod normal;
mod shape;
mod smoothness;

pub use adaptation::Adaptation;
pub use chamfer::{Pull, SampleMatch, ScanToTemplate, TemplateToScan, VertexMatch};
pub use foldover::Foldover;
pub use landmark::{LandmarkPull, Landmarks};
pub use normal::{SampleNormals, VertexNormals};
pub use shape::{Gradient, Shape};
pub use smoothness::{Smoothness, laplacian};
