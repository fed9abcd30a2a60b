//! onemesh: one mesh for every face.

pub mod formats;
pub mod mesh;
