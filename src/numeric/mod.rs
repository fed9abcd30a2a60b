//! Numbers without geometry: sparse solves, rotations between point sets, the optimiser. Layer 1.

mod adam_uniform;
mod block_matrix;
mod cholesky;
mod dissection;
mod elimination;
mod factorization;
#[cfg(test)]
pub mod finite_difference;
mod kabsch;
mod once;
mod random;
mod supernodal;

pub use adam_uniform::AdamUniform;
pub use block_matrix::{BlockMatrix, squared};
pub use cholesky::{NotPositiveDefinite, SparseCholesky, SymmetricMatrix};
use dissection::Dissection;
pub use elimination::Elimination;
pub use kabsch::{Similarity, weighted_rotation};
pub use once::once;
pub use random::Random;
pub use supernodal::SolveBuffer;
