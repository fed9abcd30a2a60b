//! onemesh: one mesh for every face.

pub mod demo;
pub mod mesh;
pub mod picture;
