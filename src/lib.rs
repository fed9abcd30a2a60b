//! onemesh: one mesh for every face.

pub mod evaluate;
pub mod mesh;
pub mod spatial;
