use std::sync::Arc;

use glam::Vec3A;
use nalgebra_sparse::{CooMatrix, CscMatrix};

use super::elimination::Elimination;
use super::factorization::factor;
use super::supernodal::{SolveBuffer, solve};
use crate::mesh::Topology;

/// A symmetric matrix with the sparsity of a mesh: a value per vertex and one per edge.
#[derive(Debug, Clone)]
pub struct SymmetricMatrix {
    /// Diagonal `[N]`.
    pub diagonal: Vec<f64>,
    /// Off-diagonal value of each edge of the topology `[E]`.
    pub edges: Vec<f64>,
}

impl SymmetricMatrix {
    /// I + lambda L with the combinatorial Laplacian L = D - A.
    pub fn diffusion(topology: &Topology, lambda: f64) -> Self {
        let valence = |i: usize| topology.neighbours.row(i).len() as f64;
        Self {
            diagonal: (0..topology.vertex_count()).map(|i| 1.0 + lambda * valence(i)).collect(),
            edges: vec![-lambda; topology.edges.len()],
        }
    }

    /// The product with one vector per vertex `[N, 3]`.
    pub fn multiply(&self, topology: &Topology, x: &[Vec3A]) -> Vec<Vec3A> {
        let mut product: Vec<Vec3A> = x.iter().zip(&self.diagonal).map(|(&x, &d)| x * d as f32).collect();
        for (&[a, b], &value) in topology.edges.iter().zip(&self.edges) {
            product[a as usize] += x[b as usize] * value as f32;
            product[b as usize] += x[a as usize] * value as f32;
        }
        product
    }

    /// The whole of it as a matrix of nalgebra's, vertex `order[i]` in row and column i.
    pub fn in_order(&self, topology: &Topology, order: &[u32]) -> CscMatrix<f64> {
        let mut place = vec![0; order.len()];
        for (i, &v) in order.iter().enumerate() {
            place[v as usize] = i;
        }
        let mut entries = CooMatrix::new(order.len(), order.len());
        for (&at, &value) in place.iter().zip(&self.diagonal) {
            entries.push(at, at, value);
        }
        for (&[a, b], &value) in topology.edges.iter().zip(&self.edges) {
            entries.push(place[a as usize], place[b as usize], value);
            entries.push(place[b as usize], place[a as usize], value);
        }
        CscMatrix::from(&entries)
    }
}

/// The matrix has a direction in which it does not grow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the matrix is not positive definite")]
pub struct NotPositiveDefinite;

/// A sparse Cholesky factorisation A = P^T L L^T P: made once, then solved for many right-hand sides.
#[derive(Debug, Clone)]
pub struct SparseCholesky {
    elimination: Arc<Elimination>,
    /// Of each part its blocks.
    values: [Vec<f32>; 3],
}

impl SparseCholesky {
    /// Factors `matrix`, in double precision; solves run in single.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] where the matrix is not.
    pub fn new(
        elimination: &Arc<Elimination>,
        matrix: &SymmetricMatrix,
    ) -> Result<Self, NotPositiveDefinite> {
        Ok(Self { elimination: elimination.clone(), values: factor(elimination, matrix)? })
    }

    /// Solves A x = b for three right-hand sides at once, in place `[N, 3]`. `buffer` keeps its memory between calls.
    pub fn solve(&self, b: &mut [Vec3A], buffer: &mut SolveBuffer) {
        solve(&self.elimination, &self.values, b, buffer);
    }

    /// Solves A x = b for one right-hand side, in place `[N]`.
    pub fn solve_scalar(&self, b: &mut [f32], buffer: &mut SolveBuffer) {
        let mut vectors: Vec<Vec3A> = b.iter().map(|&x| Vec3A::new(x, 0.0, 0.0)).collect();
        self.solve(&mut vectors, buffer);
        for (b, x) in b.iter_mut().zip(vectors) {
            *b = x.x;
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use nalgebra_sparse::factorization::CscCholesky;

    use super::*;
    use crate::mesh::Icosphere;
    use crate::numeric::Random;

    fn residual(level: u32, lambda: f64) -> f32 {
        let sphere = Icosphere::new(level);
        let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
        let positions: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
        let matrix = SymmetricMatrix::diffusion(&topology, lambda);
        let elimination = Arc::new(Elimination::new(&topology, &positions));
        let cholesky = SparseCholesky::new(&elimination, &matrix).unwrap();
        let mut random = Random::new(1);
        let x: Vec<Vec3A> = positions
            .iter()
            .map(|_| Vec3A::new(random.signed() as f32, random.signed() as f32, random.signed() as f32))
            .collect();
        let mut b = matrix.multiply(&topology, &x);
        cholesky.solve(&mut b, &mut SolveBuffer::default());
        b.iter().zip(&x).map(|(b, x)| b.distance(*x)).fold(0.0, f32::max)
    }

    #[test]
    fn recovers_the_solution() {
        for (level, lambda) in [(0, 1.0), (1, 19.0), (3, 19.0), (4, 4.0)] {
            let error = residual(level, lambda);
            assert!(error < 1e-4, "level {level}, lambda {lambda}: {error}");
        }
    }

    /// Diagonally dominant, otherwise by chance.
    fn random_matrix(topology: &Topology, random: &mut Random) -> SymmetricMatrix {
        let edges: Vec<f64> = topology.edges.iter().map(|_| random.signed()).collect();
        let mut diagonal: Vec<f64> = (0..topology.vertex_count()).map(|_| 0.1 + random.unit()).collect();
        for (&[a, b], value) in topology.edges.iter().zip(&edges) {
            diagonal[a as usize] += value.abs();
            diagonal[b as usize] += value.abs();
        }
        SymmetricMatrix { diagonal, edges }
    }

    #[test]
    fn agrees_with_a_dense_solve() {
        let mut random = Random::new(2);
        let sphere = Icosphere::new(2);
        let positions: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
        let n = positions.len();
        // Closed, torn, and in pieces with isolated vertices.
        for kept in [1.0, 0.7, 0.2] {
            let triangles: Vec<[u32; 3]> =
                sphere.triangles.iter().copied().filter(|_| random.unit() < kept).collect();
            let topology = Topology::new(n, &triangles);
            let matrix = random_matrix(&topology, &mut random);
            let mut dense = DMatrix::from_diagonal(&DVector::from_column_slice(&matrix.diagonal));
            for (&[a, b], &value) in topology.edges.iter().zip(&matrix.edges) {
                dense[(a as usize, b as usize)] = value;
                dense[(b as usize, a as usize)] = value;
            }
            let b = DMatrix::from_fn(n, 3, |_, _| random.signed());
            let wanted = dense.cholesky().unwrap().solve(&b);
            let elimination = Arc::new(Elimination::new(&topology, &positions));
            let cholesky = SparseCholesky::new(&elimination, &matrix).unwrap();
            let row = |m: &DMatrix<f64>, i| Vec3A::from_array([0, 1, 2].map(|k| m[(i, k)] as f32));
            let mut x: Vec<Vec3A> = (0..n).map(|i| row(&b, i)).collect();
            cholesky.solve(&mut x, &mut SolveBuffer::default());
            let size = wanted.abs().max() as f32;
            let error = (0..n).map(|i| x[i].distance(row(&wanted, i))).fold(0.0, f32::max);
            assert!(error < 1e-5 * size, "{kept}: {error} of {size}");
        }
    }

    #[test]
    fn agrees_with_the_library_on_a_large_mesh() {
        let mut random = Random::new(3);
        let sphere = Icosphere::new(4);
        let positions: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
        let topology = Topology::new(positions.len(), &sphere.triangles);
        let matrix = random_matrix(&topology, &mut random);
        let elimination = Arc::new(Elimination::new(&topology, &positions));
        let order = &elimination.order;
        let b = DMatrix::from_fn(order.len(), 3, |_, _| random.signed());
        let library = CscCholesky::factor(&matrix.in_order(&topology, order)).unwrap();
        let wanted = library.solve(&b);
        let mut x = vec![Vec3A::ZERO; order.len()];
        let row = |m: &DMatrix<f64>, i| Vec3A::from_array([0, 1, 2].map(|k| m[(i, k)] as f32));
        order.iter().enumerate().for_each(|(i, &v)| x[v as usize] = row(&b, i));
        SparseCholesky::new(&elimination, &matrix).unwrap().solve(&mut x, &mut SolveBuffer::default());
        let size = wanted.abs().max() as f32;
        let error = order.iter().enumerate().map(|(i, &v)| x[v as usize].distance(row(&wanted, i)));
        let error = error.fold(0.0, f32::max);
        assert!(error < 1e-5 * size, "{error} of {size}");
    }

    #[test]
    fn refuses_an_indefinite_matrix() {
        let sphere = Icosphere::new(0);
        let topology = Topology::new(12, &sphere.triangles);
        let positions: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
        let matrix = SymmetricMatrix { diagonal: vec![-1.0; 12], edges: vec![0.0; 30] };
        let elimination = Arc::new(Elimination::new(&topology, &positions));
        assert_eq!(SparseCholesky::new(&elimination, &matrix).err(), Some(NotPositiveDefinite));
    }
}
