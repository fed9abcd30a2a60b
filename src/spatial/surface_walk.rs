use glam::Vec3A;

use super::packet::Packet;
use super::search::Best;
use super::surface_index::{Hit, Oriented};
use super::triangle::closest_on_triangle;
use crate::mesh::Topology;

/// Nearest points by walking over the surface from the last answer, from triangle to neighbour, while the cost falls.
///
/// Far cheaper than [`SurfaceIndex`](super::SurfaceIndex) and not exact: it ends in the local minimum it comes to.
/// It holds who neighbours whom; positions are passed in, so that they may move.
#[derive(Debug, Clone)]
pub struct SurfaceWalk {
    triangles: Vec<[u32; 3]>,
    /// Each triangle and those across its edges; itself again where there is none.
    patches: Vec<[u32; 4]>,
}

impl SurfaceWalk {
    /// Learns the neighbours among a topology's triangles.
    pub fn new(topology: &Topology) -> Self {
        let mut patches: Vec<[u32; 4]> = (0..topology.triangles.len() as u32).map(|t| [t; 4]).collect();
        let mut met = vec![0; patches.len()];
        for &[left, right] in topology.edge_triangles.iter().filter(|[left, right]| left != right) {
            for (triangle, other) in [(left, right), (right, left)] {
                let triangle = triangle as usize;
                met[triangle] += 1;
                patches[triangle][met[triangle]] = other;
            }
        }
        Self { triangles: topology.triangles.clone(), patches }
    }

    /// The point that minimises `|p - q|^2 + normal_weight |n - n_t|^2` among those that a walk from the triangle
    /// `from` comes to, over triangles whose unit normal has `n . n_t > min_cosine`; positions `[N]`. `None` if
    /// neither `from` nor a neighbour qualifies.
    ///
    /// Costs are those of [`SurfaceIndex::closest_oriented`](super::SurfaceIndex::closest_oriented).
    pub fn closest_oriented(
        &self,
        positions: &[Vec3A],
        p: Vec3A,
        n: Vec3A,
        normal_weight: f32,
        min_cosine: f32,
        from: u32,
    ) -> Option<Hit> {
        let query = Oriented::new(p, n, normal_weight, min_cosine, f32::INFINITY);
        let mut best = Best { triangle: None, cost: f32::INFINITY };
        let mut here = from;
        loop {
            let mut patch = Packet::of(&self.patches[here as usize]);
            patch.place(positions, &self.triangles);
            best.improve(query.packet_cost(&patch), &patch.triangles);
            match best.triangle? {
                triangle if triangle == here => break,
                triangle => here = triangle,
            }
        }
        let corners = self.triangles[here as usize].map(|v| positions[v as usize]);
        Some(Hit::new(here, closest_on_triangle(p, corners)))
    }
}
