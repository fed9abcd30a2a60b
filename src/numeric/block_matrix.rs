use glam::{Mat3A, Vec3A};

use super::cholesky::SparseCholesky;
use super::supernodal::SolveBuffer;
use crate::mesh::Topology;

/// A symmetric matrix of symmetric blocks of three rows with the sparsity of a mesh: a block per vertex and one per edge.
#[derive(Debug, Clone)]
pub struct BlockMatrix {
    /// Blocks on the diagonal `[N]`.
    pub diagonal: Vec<Mat3A>,
    /// The block of each edge of the topology `[E]`, on both sides of the diagonal.
    pub edges: Vec<Mat3A>,
}

/// n n^T.
pub fn squared(n: Vec3A) -> Mat3A {
    Mat3A::from_cols(n * n.x, n * n.y, n * n.z)
}

impl BlockMatrix {
    /// The product with one vector per vertex `[N, 3]`.
    pub fn multiply(&self, topology: &Topology, x: &[Vec3A]) -> Vec<Vec3A> {
        let mut product: Vec<Vec3A> = x.iter().zip(&self.diagonal).map(|(&x, block)| *block * x).collect();
        for (&[a, b], block) in topology.edges.iter().zip(&self.edges) {
            product[a as usize] += *block * x[b as usize];
            product[b as usize] += *block * x[a as usize];
        }
        product
    }

    /// Solves A x = b by conjugate gradients, preconditioned by a matrix near to A, until the residual is `tolerance` of b
    /// or for `most` steps; in place `[N, 3]`.
    pub fn solve(
        &self,
        topology: &Topology,
        near: &SparseCholesky,
        b: &mut [Vec3A],
        (tolerance, most): (f64, usize),
        buffer: &mut SolveBuffer,
    ) {
        let mut x = vec![Vec3A::ZERO; b.len()];
        let residual = b;
        let enough = tolerance * tolerance * dot(residual, residual);
        let mut direction: Vec<Vec3A> = Vec::new();
        let mut last = 0.0;
        for step in 0..most {
            if dot(residual, residual) <= enough {
                break;
            }
            let mut nearer = residual.to_vec();
            near.solve(&mut nearer, buffer);
            let product = dot(residual, &nearer);
            if step == 0 {
                direction = nearer;
            } else {
                let share = (product / last) as f32;
                direction.iter_mut().zip(nearer).for_each(|(d, nearer)| *d = nearer + *d * share);
            }
            last = product;
            let image = self.multiply(topology, &direction);
            let length = (product / dot(&direction, &image)) as f32;
            x.iter_mut().zip(&direction).for_each(|(x, &d)| *x += d * length);
            residual.iter_mut().zip(image).for_each(|(r, image)| *r -= image * length);
        }
        residual.copy_from_slice(&x);
    }
}

/// In one order, whatever the threads.
fn dot(a: &[Vec3A], b: &[Vec3A]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(a.dot(*b))).sum()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::mesh::Icosphere;
    use crate::numeric::{Elimination, Random, SymmetricMatrix};

    #[test]
    fn conjugate_gradients_solve_what_a_dense_matrix_does() {
        let sphere = Icosphere::new(2);
        let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
        let positions: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
        let mut random = Random::new(3);
        let mut any = || Vec3A::from_array([0; 3].map(|_| random.signed() as f32));
        // Squares of differences along vectors of their own, as edges of trusses have them.
        let mut matrix = BlockMatrix {
            diagonal: vec![Mat3A::IDENTITY; positions.len()],
            edges: vec![Mat3A::ZERO; topology.edges.len()],
        };
        let mut bound = SymmetricMatrix::diffusion(&topology, 0.0);
        for (edge, &[a, b]) in topology.edges.iter().enumerate() {
            let along = any();
            for end in [a, b] {
                matrix.diagonal[end as usize] += squared(along);
                bound.diagonal[end as usize] += f64::from(along.length_squared());
            }
            matrix.edges[edge] -= squared(along);
            bound.edges[edge] -= f64::from(along.length_squared());
        }
        let b: Vec<Vec3A> = positions.iter().map(|_| any()).collect();
        let near = SparseCholesky::new(&Arc::new(Elimination::new(&topology, &positions)), &bound).unwrap();
        let mut x = b.clone();
        matrix.solve(&topology, &near, &mut x, (1e-6, 100), &mut SolveBuffer::default());

        let mut dense = DMatrix::<f64>::zeros(3 * b.len(), 3 * b.len());
        let mut put = |row: u32, column: u32, block: &Mat3A| {
            for (j, k) in (0..9).map(|at| (at / 3, at % 3)) {
                dense[(3 * row as usize + j, 3 * column as usize + k)] = f64::from(block.col(k)[j]);
            }
        };
        (0..b.len() as u32).for_each(|i| put(i, i, &matrix.diagonal[i as usize]));
        for (&[a, b], block) in topology.edges.iter().zip(&matrix.edges) {
            put(a, b, block);
            put(b, a, block);
        }
        let flat: Vec<f64> = b.iter().flat_map(|v| v.to_array().map(f64::from)).collect();
        let exact = dense.cholesky().unwrap().solve(&DVector::from_vec(flat));
        for (i, x) in x.iter().enumerate() {
            let exact = Vec3A::from_array([0, 1, 2].map(|k| exact[3 * i + k] as f32));
            assert!((*x - exact).length() < 1e-4 * exact.length().max(1.0), "{x} {exact}");
        }
        assert!(
            matrix.multiply(&topology, &x).iter().zip(&b).all(|(image, b)| (*image - *b).length() < 1e-4)
        );
    }
}
