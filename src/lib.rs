//! onemesh: one mesh for every face.

pub mod mesh;
pub mod picture;
