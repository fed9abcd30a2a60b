//! Triangle meshes, the landmarks on them, and the template spheres. Layer 0: imports nothing of this crate.

mod cap;
mod component;
mod edge_length;
mod icosphere;
mod landmark;
mod normals;
mod points;
mod rim;
mod sphere_layout;
mod topology;
mod triangle_mesh;

pub use cap::capped;
pub use component::components;
pub use edge_length::{mean_edge_lengths, pull_back_mean_edge_lengths};
pub use icosphere::{Icosphere, Midpoints};
pub use landmark::{LandmarkSet, SurfacePoint, interpolate};
pub use normals::{Normals, pull_back_area_vectors};
pub use points::{FilePoints, Points};
pub use rim::Rim;
pub use sphere_layout::sphere_layout;
pub use topology::{Rows, Topology};
pub use triangle_mesh::{MeshError, TriangleId, TriangleMesh, VertexId};
