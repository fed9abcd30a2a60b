//! onemesh: one mesh for every face.

pub mod demo;
pub mod density;
pub mod energy;
pub mod evaluate;
pub mod formats;
pub mod mesh;
pub mod numeric;
pub mod picture;
pub mod pipeline;
pub mod reparam;
pub mod spatial;
