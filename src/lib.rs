//! onemesh: one mesh for every face.

pub mod energy;
pub mod mesh;
pub mod numeric;
pub mod picture;
pub mod pipeline;
pub mod reparam;
pub mod spatial;
