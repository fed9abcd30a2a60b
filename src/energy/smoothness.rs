use glam::Vec3A;
use rayon::prelude::*;

use super::{Gradient, Shape};
use crate::mesh::Topology;

/// Smoothness of plain positions with the combinatorial Laplacian L = D - A, as Nicolet et al. 2021 compare with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Smoothness {
    /// E = 1/3N p . L p: membranes.
    Laplacian,
    /// E = 1/3N |L p|^2: thin plates.
    BiLaplacian,
}

impl Smoothness {
    /// Adds `weight` times the gradient and returns the unweighted value.
    pub fn add(self, shape: Shape, weight: f32, gradient: &mut Gradient) -> f64 {
        let entries = 3.0 * shape.positions.len() as f32;
        let once = laplacian(shape.topology, shape.positions);
        let (value, slope) = match self {
            Self::Laplacian => (dot(shape.positions, &once), once),
            Self::BiLaplacian => (dot(&once, &once), laplacian(shape.topology, &once)),
        };
        for (gradient, slope) in gradient.positions.iter_mut().zip(slope) {
            *gradient += slope * (2.0 * weight / entries);
        }
        value / f64::from(entries)
    }
}

/// L v of values `[N, 3]`, with the combinatorial Laplacian.
pub fn laplacian(topology: &Topology, values: &[Vec3A]) -> Vec<Vec3A> {
    let at = |i: usize| {
        let ring = topology.neighbours.row(i);
        values[i] * ring.len() as f32 - ring.iter().map(|&j| values[j as usize]).sum::<Vec3A>()
    };
    (0..values.len()).into_par_iter().with_min_len(1024).map(at).collect()
}

fn dot(a: &[Vec3A], b: &[Vec3A]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(a.dot(*b))).sum()
}

#[cfg(test)]
mod tests {
    use super::super::shape::bumpy::gradient_error;
    use super::*;

    #[test]
    fn gradients() {
        for term in [Smoothness::Laplacian, Smoothness::BiLaplacian] {
            let error = gradient_error(|shape, weight, gradient| term.add(shape, weight, gradient));
            assert!(error < 2e-3, "{term:?}: {error}");
        }
    }
}
