//! Triangle meshes, the landmarks on them, and the template spheres. Layer 1: imports nothing of this crate.

mod landmark;
mod triangle_mesh;

pub use landmark::{LandmarkSet, SurfacePoint};
pub use triangle_mesh::{MeshError, TriangleId, TriangleMesh, VertexId};
