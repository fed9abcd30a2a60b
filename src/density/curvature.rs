use std::sync::Arc;

use glam::Vec3A;

use super::mean;
use crate::mesh::Topology;
use crate::numeric::{Elimination, NotPositiveDefinite, SolveBuffer, SparseCholesky, SymmetricMatrix};

/// The adaptive density: edges shrink where the Laplacian of the present shape is longer than on average.
///
/// K_i = |(L p)_i| / mean(l) with the uniform weighted L = I - D^-1 A; S = (I + lambda_s L)^-1 K, lambda_s = 1;
/// l'_k = l * min(mean(S) / S, 1).
#[derive(Debug, Clone)]
pub struct CurvatureDensity {
    /// D (I + lambda_s L) = D + lambda_s (D - A): the same system made symmetric.
    cholesky: SparseCholesky,
}

impl CurvatureDensity {
    /// Factors the smoothing for a template.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] if a vertex of the template has no neighbour.
    pub fn new(topology: &Topology, elimination: &Arc<Elimination>) -> Result<Self, NotPositiveDefinite> {
        const LAMBDA_S: f64 = 1.0;
        let valence = |i: usize| topology.neighbours.row(i).len() as f64;
        let matrix = SymmetricMatrix {
            diagonal: (0..topology.vertex_count()).map(|i| (1.0 + LAMBDA_S) * valence(i)).collect(),
            edges: vec![-LAMBDA_S; topology.edges.len()],
        };
        Ok(Self { cholesky: SparseCholesky::new(elimination, &matrix)? })
    }

    /// l'_k `[N]` of a shape with positions `[N, 3]` and mean edge lengths l `[N]`.
    pub fn lengths(
        &self,
        topology: &Topology,
        positions: &[Vec3A],
        lengths: &[f32],
        buffer: &mut SolveBuffer,
    ) -> Vec<f32> {
        let scale = mean(lengths).max(f32::MIN_POSITIVE);
        let mut smoothed: Vec<f32> = (0..positions.len())
            .map(|i| {
                let ring = topology.neighbours.row(i);
                let sum: Vec3A = ring.iter().map(|&j| positions[j as usize]).sum();
                // D K: the symmetric system's right-hand side.
                (positions[i] * ring.len() as f32 - sum).length() / scale
            })
            .collect();
        self.cholesky.solve_scalar(&mut smoothed, buffer);
        let average = mean(&smoothed);
        let shrink = |s: f32| if s > average { average / s } else { 1.0 };
        lengths.iter().zip(&smoothed).map(|(l, &s)| l * shrink(s)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Icosphere, mean_edge_lengths};

    #[test]
    fn edges_shrink_at_a_spike_and_stay_elsewhere() {
        let sphere = Icosphere::new(3);
        let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
        let mut positions: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
        let elimination = Arc::new(Elimination::new(&topology, &positions));
        // So high that the mean is above the Laplacian of every vertex of the plain sphere.
        positions[100] *= 3.0;
        let lengths = mean_edge_lengths(&topology, &positions);
        let density = CurvatureDensity::new(&topology, &elimination).unwrap();
        let desired = density.lengths(&topology, &positions, &lengths, &mut SolveBuffer::default());
        assert!(desired[100] < 0.5 * lengths[100]);
        let far = (0..positions.len()).max_by(|&a, &b| {
            positions[a].distance(positions[100]).total_cmp(&positions[b].distance(positions[100]))
        });
        let far = far.unwrap();
        assert!((desired[far] - lengths[far]).abs() < 1e-6);
        assert!(desired.iter().zip(&lengths).all(|(d, l)| *d <= *l));
    }
}
