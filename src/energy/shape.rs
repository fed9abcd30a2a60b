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

/// What the terms' tests share: a bumpy sphere, and central differences on it.
#[cfg(test)]
pub mod bumpy {
    use super::*;
    use crate::mesh::Icosphere;
    use crate::numeric::Random;
    use crate::numeric::finite_difference::directional_error;

    /// A direction of any length below the square root of three.
    pub fn vector(random: &mut Random) -> Vec3A {
        Vec3A::new(random.signed() as f32, random.signed() as f32, random.signed() as f32)
    }

    /// A sphere of 162 vertices, each moved by chance.
    pub fn sphere() -> (Topology, Vec<Vec3A>) {
        let sphere = Icosphere::new(2);
        let mut random = Random::new(8);
        let moved = sphere.positions.iter().map(|p| p.as_vec3a() + 0.05 * vector(&mut random)).collect();
        (Topology::new(sphere.positions.len(), &sphere.triangles), moved)
    }

    /// The largest error, relative to the steepest slope, of the gradient that a term adds with a weight.
    pub fn gradient_error(add: impl Fn(Shape, f32, &mut Gradient) -> f64) -> f64 {
        const WEIGHT: f32 = 0.7;
        let (topology, positions) = sphere();
        let of = |positions: &[Vec3A]| {
            let normals = Normals::new(&topology, positions);
            let shape = Shape { topology: &topology, positions, normals: &normals };
            let mut gradient = Gradient::zero(&topology);
            let value = add(shape, WEIGHT, &mut gradient);
            (f64::from(WEIGHT) * value, std::mem::take(gradient.total(shape)))
        };
        let (_, gradient) = of(&positions);
        assert!(gradient.iter().any(|g| *g != Vec3A::ZERO), "the term does nothing here");
        directional_error(&positions, &gradient, 1e-3, 8, |moved| of(moved).0)
    }
}
