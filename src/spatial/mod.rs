//! Nearest points on a surface: an exact index over its triangles, and a walk from the last answer; and where a surface
//! passes through itself. Layer 2.

mod boxes;
mod lanes;
mod packet;
mod search;
mod self_intersection;
mod surface_index;
mod surface_walk;
#[cfg(test)]
mod tests;
mod tree;
mod triangle;
mod triangle_pair;

pub use self_intersection::{SelfIntersections, self_intersections};
pub use surface_index::{Hit, SurfaceIndex};
pub use surface_walk::SurfaceWalk;
pub use triangle::{TrianglePoint, closest_on_triangle};
