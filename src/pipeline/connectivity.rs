use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock};

use glam::{Mat3A, Vec3A};

use crate::mesh::{Rim, Topology};
use crate::numeric::{BlockMatrix, Elimination, SparseCholesky, SymmetricMatrix, once};
use crate::spatial::SurfaceWalk;

/// The triangles of a template with what is made for them once and kept: topology, elimination, factors.
pub struct Connectivity {
    /// Triangles, edges and rings.
    pub topology: Topology,
    /// Where they end.
    pub rim: Rim,
    /// The shape `[N, 3]` that the elimination's order is cut by.
    rest: Vec<Vec3A>,
    elimination: OnceLock<Arc<Elimination>>,
    walk: OnceLock<SurfaceWalk>,
    /// The edges of each triangle: from its first, second, third corner to the next.
    triangle_edges: Vec<[u32; 3]>,
    diffusions: Mutex<HashMap<u64, Arc<SparseCholesky>>>,
}

/// A poisoned cache is still a cache: entries are only ever inserted whole.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// What a cache keeps for a lambda, made at its first use and outside of the cache, as by [`once`].
pub(super) fn once_for<T>(
    cache: &Mutex<HashMap<u64, Arc<T>>>,
    lambda: f64,
    make: impl FnOnce() -> T,
) -> Arc<T> {
    let kept = lock(cache).get(&lambda.to_bits()).cloned();
    kept.unwrap_or_else(|| {
        let made = Arc::new(make());
        lock(cache).entry(lambda.to_bits()).or_insert(made).clone()
    })
}

impl Connectivity {
    /// Triangles `[F, 3]` on positions `[N, 3]` that show which vertices are near each other.
    pub fn new(rest: &[Vec3A], triangles: &[[u32; 3]]) -> Self {
        let topology = Topology::new(rest.len(), triangles);
        Self {
            triangle_edges: triangle_edges(&topology),
            rim: Rim::of(&topology),
            topology,
            rest: rest.to_vec(),
            elimination: OnceLock::new(),
            walk: OnceLock::new(),
            diffusions: Mutex::default(),
        }
    }

    /// How unknowns of the vertices are eliminated.
    pub fn elimination(&self) -> &Arc<Elimination> {
        once(&self.elimination, || Arc::new(Elimination::new(&self.topology, &self.rest)))
    }

    /// Nearest points from the last answer on.
    pub fn walk(&self) -> &SurfaceWalk {
        self.walk.get_or_init(|| SurfaceWalk::new(&self.topology))
    }

    /// The solver of (I + lambda L) x = b, factored at its first use.
    pub fn diffusion(&self, lambda: f64) -> Arc<SparseCholesky> {
        once_for(&self.diffusions, lambda, || {
            let matrix = SymmetricMatrix::diffusion(&self.topology, lambda.max(0.0));
            let made = SparseCholesky::new(self.elimination(), &matrix);
            made.expect("I + lambda L is positive definite for lambda >= 0")
        })
    }

    /// Adds `weight` b b^T to a matrix, for a point b of barycentric weights on a triangle.
    pub fn add_point(&self, matrix: &mut SymmetricMatrix, triangle: u32, weights: [f32; 3], weight: f64) {
        self.add_products(matrix, triangle, |j, k| weight * f64::from(weights[j]) * f64::from(weights[k]));
    }

    /// Adds a symmetric matrix of three rows, given by its entries, to the rows and columns of a triangle's corners.
    pub fn add_products(
        &self,
        matrix: &mut SymmetricMatrix,
        triangle: u32,
        entry: impl Fn(usize, usize) -> f64,
    ) {
        let corners = self.topology.triangles[triangle as usize];
        let edges = self.triangle_edges[triangle as usize];
        for k in 0..3 {
            matrix.diagonal[corners[k] as usize] += entry(k, k);
            matrix.edges[edges[k] as usize] += entry(k, (k + 1) % 3);
        }
    }

    /// Adds a symmetric matrix of three rows, given by its entries, each times `block`, to those of a triangle's corners.
    pub fn add_blocks(
        &self,
        matrix: &mut BlockMatrix,
        triangle: u32,
        block: Mat3A,
        entry: impl Fn(usize, usize) -> f32,
    ) {
        let corners = self.topology.triangles[triangle as usize];
        let edges = self.triangle_edges[triangle as usize];
        for k in 0..3 {
            matrix.diagonal[corners[k] as usize] += block * entry(k, k);
            matrix.edges[edges[k] as usize] += block * entry(k, (k + 1) % 3);
        }
    }
}

fn triangle_edges(topology: &Topology) -> Vec<[u32; 3]> {
    let edge = |a: u32, b: u32| {
        let at = topology.edges.binary_search(&[a.min(b), a.max(b)]);
        at.expect("every side of a triangle is an edge") as u32
    };
    topology.triangles.iter().map(|&[a, b, c]| [edge(a, b), edge(b, c), edge(c, a)]).collect()
}
