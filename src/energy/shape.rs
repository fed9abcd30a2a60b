use glam::Vec3A;
use rayon::prelude::*;

use crate::mesh::{Normals, Topology, pull_back_area_vectors};

/// The deformed template that energies look at: positions `[N, 3]` in unit space and what follows from them.
#[derive(Clone, Copy)]
pub struct Shape<'a> {
    /// Triangles, edges and rings.
    pub topology: &'a Topology,
    /// Vertex positions p `[N, 3]`.
    pub positions: &'a [Vec3A],
    /// Their normals.
    pub normals: &'a Normals,
}

/// A gradient in the making: with respect to the positions and to what follows from them.
#[derive(Debug, Clone, Default)]
pub struct Gradient {
    /// dE/dp `[N, 3]`.
    pub positions: Vec<Vec3A>,
    /// dE/dn of the vertex normals `[N, 3]`.
    pub vertex_normals: Vec<Vec3A>,
    /// dE/de of the triangles' area vectors `[F, 3]`.
    pub area_vectors: Vec<Vec3A>,
}

impl Gradient {
    /// A zero gradient for a topology.
    pub fn zero(topology: &Topology) -> Self {
        let mut gradient = Self::default();
        gradient.clear(topology);
        gradient
    }

    /// Sets everything to zero, keeping the memory.
    pub fn clear(&mut self, topology: &Topology) {
        for (values, length) in [
            (&mut self.positions, topology.vertex_count()),
            (&mut self.vertex_normals, topology.vertex_count()),
            (&mut self.area_vectors, topology.triangles.len()),
        ] {
            values.clear();
            values.resize(length, Vec3A::ZERO);
        }
    }

    /// Pulls the parts with respect to normals back to the positions and returns the whole dE/dp `[N, 3]`.
    pub fn total(&mut self, shape: Shape) -> &mut Vec<Vec3A> {
        let Self { positions, vertex_normals, area_vectors } = self;
        shape.normals.pull_back(shape.topology, shape.positions, vertex_normals, positions);
        pull_back_area_vectors(shape.topology, shape.positions, area_vectors, positions);
        positions
    }
}

/// Adds a gradient with respect to unit triangle normals, given by `upstream(triangle)`, to that of the area vectors.
///
/// dE/de = (g - n (n . g)) / |e|; |e| is kept above `floor`, so that slivers do not blow up.
pub fn add_unit_normal_gradient(
    shape: Shape,
    gradient: &mut Gradient,
    floor: f32,
    upstream: impl Fn(usize) -> Vec3A + Sync,
) {
    gradient.area_vectors.par_iter_mut().enumerate().with_min_len(2048).for_each(|(t, gradient)| {
        let upstream = upstream(t);
        if upstream != Vec3A::ZERO {
            let area = shape.normals.area_vectors[t];
            let length = area.length();
            let normal = area / length.max(f32::MIN_POSITIVE);
            *gradient += (upstream - normal * normal.dot(upstream)) / length.max(floor);
        }
    });
}
