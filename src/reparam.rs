//! Diffusion re-parameterization: u = (I + lambda L) p and the way back, equations (3) and (4). Layer 2.

use std::sync::Arc;

use glam::Vec3A;

use crate::mesh::Topology;
use crate::numeric::{Elimination, NotPositiveDefinite, SolveBuffer, SparseCholesky, SymmetricMatrix};

/// The change of variables between positions p and their diffusion parameters u, factored once per template and lambda.
#[derive(Debug, Clone)]
pub struct Reparameterization {
    matrix: SymmetricMatrix,
    cholesky: SparseCholesky,
}

impl Reparameterization {
    /// Factors I + lambda L, with the combinatorial Laplacian L = D - A.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] for a lambda so negative that the matrix is not.
    pub fn new(
        topology: &Topology,
        elimination: &Arc<Elimination>,
        lambda: f64,
    ) -> Result<Self, NotPositiveDefinite> {
        let matrix = SymmetricMatrix::diffusion(topology, lambda);
        let cholesky = SparseCholesky::new(elimination, &matrix)?;
        Ok(Self { matrix, cholesky })
    }

    /// u of positions `[N, 3]`.
    pub fn parameters(&self, topology: &Topology, positions: &[Vec3A]) -> Vec<Vec3A> {
        self.matrix.multiply(topology, positions)
    }

    /// p of parameters u, in place `[N, 3]`.
    pub fn to_positions(&self, u: &mut [Vec3A], buffer: &mut SolveBuffer) {
        self.cholesky.solve(u, buffer);
    }

    /// dE/du of dE/dp, in place `[N, 3]`: the same solve, since the matrix is symmetric.
    pub fn pull_back(&self, gradient: &mut [Vec3A], buffer: &mut SolveBuffer) {
        self.cholesky.solve(gradient, buffer);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Icosphere;
    use crate::numeric::finite_difference::directional_error;

    #[test]
    fn goes_there_and_back_and_pulls_gradients_with_it() {
        let sphere = Icosphere::new(2);
        let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
        let positions: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
        let elimination = Arc::new(Elimination::new(&topology, &positions));
        let reparameterization = Reparameterization::new(&topology, &elimination, 19.0).unwrap();
        let mut buffer = SolveBuffer::default();
        let u = reparameterization.parameters(&topology, &positions);
        let mut back = u.clone();
        reparameterization.to_positions(&mut back, &mut buffer);
        assert!(back.iter().zip(&positions).all(|(a, b)| a.distance(*b) < 1e-5));
        // E(u) = sum of cubes of the positions.
        let mut gradient: Vec<Vec3A> = positions.iter().map(|p| 3.0 * *p * *p).collect();
        reparameterization.pull_back(&mut gradient, &mut buffer);
        let error = directional_error(&u, &gradient, 1e-1, 5, |u| {
            let mut p = u.to_vec();
            reparameterization.to_positions(&mut p, &mut SolveBuffer::default());
            p.iter().map(|p| f64::from((*p * *p * *p).element_sum())).sum()
        });
        assert!(error < 1e-2, "{error}");
    }
}
