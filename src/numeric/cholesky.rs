use glam::Vec3A;
use nalgebra_sparse::factorization::CscCholesky;
use nalgebra_sparse::{CooMatrix, CscMatrix};

use super::Dissection;
use super::supernodal::{ColumnFactor, SolveBuffer, SupernodalFactor};
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
}

/// The matrix has a direction in which it does not grow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the matrix is not positive definite")]
pub struct NotPositiveDefinite;

/// A sparse Cholesky factorisation A = P^T L L^T P: made once, then solved for many right-hand sides.
#[derive(Debug, Clone)]
pub struct SparseCholesky {
    order: Vec<u32>,
    factor: SupernodalFactor,
}

impl SparseCholesky {
    /// Factors `matrix` in the order of `dissection`, in double precision; solves run in single.
    ///
    /// # Errors
    /// [`NotPositiveDefinite`] where the matrix is not.
    pub fn new(
        topology: &Topology,
        matrix: &SymmetricMatrix,
        dissection: &Dissection,
    ) -> Result<Self, NotPositiveDefinite> {
        let permuted = permuted(topology, matrix, &dissection.order);
        let l = CscCholesky::factor(&permuted).map_err(|_| NotPositiveDefinite)?.take_l();
        let (starts, rows, values) = l.csc_data();
        let columns = ColumnFactor { starts, rows, values };
        Ok(Self { order: dissection.order.clone(), factor: SupernodalFactor::new(&columns, dissection) })
    }

    /// Solves A x = b for three right-hand sides at once, in place `[N, 3]`. `buffer` keeps its memory between calls.
    pub fn solve(&self, b: &mut [Vec3A], buffer: &mut SolveBuffer) {
        self.factor.solve(&self.order, b, buffer);
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

/// The matrix with its vertices renumbered by `order`.
fn permuted(topology: &Topology, matrix: &SymmetricMatrix, order: &[u32]) -> CscMatrix<f64> {
    let mut place = vec![0usize; order.len()];
    for (i, &v) in order.iter().enumerate() {
        place[v as usize] = i;
    }
    let mut entries = CooMatrix::new(order.len(), order.len());
    for (v, &value) in matrix.diagonal.iter().enumerate() {
        entries.push(place[v], place[v], value);
    }
    for (&[a, b], &value) in topology.edges.iter().zip(&matrix.edges) {
        entries.push(place[a as usize], place[b as usize], value);
        entries.push(place[b as usize], place[a as usize], value);
    }
    CscMatrix::from(&entries)
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::mesh::Icosphere;
    use crate::numeric::Random;

    fn residual(level: u32, lambda: f64) -> f32 {
        let sphere = Icosphere::new(level);
        let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
        let positions: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
        let matrix = SymmetricMatrix::diffusion(&topology, lambda);
        let dissection = Dissection::new(&topology, &positions);
        let cholesky = SparseCholesky::new(&topology, &matrix, &dissection).unwrap();
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
            let dissection = Dissection::new(&topology, &positions);
            let cholesky = SparseCholesky::new(&topology, &matrix, &dissection).unwrap();
            let row = |m: &DMatrix<f64>, i| Vec3A::from_array([0, 1, 2].map(|k| m[(i, k)] as f32));
            let mut x: Vec<Vec3A> = (0..n).map(|i| row(&b, i)).collect();
            cholesky.solve(&mut x, &mut SolveBuffer::default());
            let size = wanted.abs().max() as f32;
            let error = (0..n).map(|i| x[i].distance(row(&wanted, i))).fold(0.0, f32::max);
            assert!(error < 1e-5 * size, "{kept}: {error} of {size}");
        }
    }

    #[test]
    fn refuses_an_indefinite_matrix() {
        let sphere = Icosphere::new(0);
        let topology = Topology::new(12, &sphere.triangles);
        let positions: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
        let matrix = SymmetricMatrix { diagonal: vec![-1.0; 12], edges: vec![0.0; 30] };
        let dissection = Dissection::new(&topology, &positions);
        assert_eq!(SparseCholesky::new(&topology, &matrix, &dissection).err(), Some(NotPositiveDefinite));
    }
}
