//! The stage of ours: the mean of the registered set is the shape from which every member is registered again, so that
//! what lies between landmarks corresponds too.
//!
//! E(p) = sum_i |n^.(p_i - q_i)|^2 + sum_s |x_s - B_s p|^2 + w_l sum_b |c_b - k_b|^2 + mu E_J(p), where E_J holds the
//! edges to the mean's, turned and stretched by deformation gradients J that vary smoothly over the surface: any smooth
//! deformation costs nothing, whatever its size.
//!
//! Cavities that only some members have, as open mouths, are closed by films in the mean; in the late phases these fall
//! into the scans that have them (`film.rs`). In the end triangles, not vertices, come to lie on the scan (`settle.rs`),
//! and what is folded is unfolded there (`unfold.rs`).

mod closure;
mod film;
mod mean;
mod member;
mod redistribution;
mod rest_shape;
mod settle;
mod shared_mesh;
mod unfold;

pub use closure::close_smoothly;
pub use mean::mean_shape;
pub use member::{Member, Turn, register_member};
pub use redistribution::{need, redistribute};
pub use rest_shape::RestShape;
pub use shared_mesh::{SharedMesh, carried};

use glam::Vec3A;

use crate::mesh::{Normals, Topology};

/// A third of the area around each vertex `[N]`.
fn vertex_areas(topology: &Topology, p: &[Vec3A]) -> Vec<f32> {
    let normals = Normals::new(topology, p);
    let area = |i: usize| {
        topology.fans.row(i).iter().map(|f| normals.area_vectors[f[0] as usize].length()).sum::<f32>()
    };
    (0..p.len()).map(|i| area(i) / 6.0).collect()
}
