use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex, OnceLock};

use glam::{DVec3, Vec3A};

use crate::density::CurvatureDensity;
use crate::mesh::{Icosphere, Midpoints, SurfacePoint, Topology, TriangleId};
use crate::numeric::{Dissection, SparseCholesky, SymmetricMatrix};
use crate::reparam::Reparameterization;
use crate::spatial::SurfaceIndex;

/// A template sphere with what is made for it once and kept: topology, elimination order, factors.
pub struct Sphere {
    /// Subdivisions of the icosahedron.
    pub level: u32,
    /// Vertex positions `[N, 3]` on the unit sphere.
    pub rest: Vec<Vec3A>,
    /// Triangles, edges and rings.
    pub topology: Topology,
    dissection: OnceLock<Dissection>,
    /// How the level came from the one below it.
    midpoints: Option<Midpoints>,
    reparameterizations: Mutex<HashMap<u64, Arc<Reparameterization>>>,
    curvature: OnceLock<Arc<CurvatureDensity>>,
    /// The edges of each triangle: from its first, second, third corner to the next.
    triangle_edges: Vec<[u32; 3]>,
    diffusions: Mutex<HashMap<u64, Arc<SparseCholesky>>>,
}

static SPHERES: LazyLock<Mutex<HashMap<u32, Arc<Sphere>>>> = LazyLock::new(Mutex::default);

/// A poisoned cache is still a cache: entries are only ever inserted whole.
fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl Sphere {
    /// The sphere of a level, made at its first use.
    pub fn of_level(level: u32) -> Arc<Self> {
        lock(&SPHERES).entry(level).or_insert_with(|| Arc::new(Self::new(level))).clone()
    }

    fn new(level: u32) -> Self {
        let sphere = Icosphere::new(level);
        let midpoints = level.checked_sub(1).map(|coarser| {
            let coarser = Icosphere::new(coarser);
            Midpoints::of(coarser.positions.len(), &coarser.triangles)
        });
        let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
        Self {
            level,
            triangle_edges: triangle_edges(&topology),
            diffusions: Mutex::default(),
            rest: sphere.positions.iter().map(|p| p.as_vec3a()).collect(),
            topology,
            dissection: OnceLock::new(),
            midpoints,
            reparameterizations: Mutex::default(),
            curvature: OnceLock::new(),
        }
    }

    /// The elimination order of its vertices.
    pub fn dissection(&self) -> &Dissection {
        self.dissection.get_or_init(|| Dissection::new(&self.topology, &self.rest))
    }

    /// Positions of the level below, carried to this one.
    pub fn subdivide(&self, coarser: &[Vec3A]) -> Vec<Vec3A> {
        match &self.midpoints {
            Some(midpoints) => midpoints.subdivide(coarser),
            None => coarser.to_vec(),
        }
    }

    /// u and p for a lambda, factored at its first use.
    pub fn reparameterization(&self, lambda: f64) -> Arc<Reparameterization> {
        lock(&self.reparameterizations)
            .entry(lambda.to_bits())
            .or_insert_with(|| {
                let made = Reparameterization::new(&self.topology, self.dissection(), lambda.max(0.0));
                Arc::new(made.expect("I + lambda L is positive definite for lambda >= 0"))
            })
            .clone()
    }

    /// The solver of (I + lambda L) x = b, factored at its first use.
    pub fn diffusion(&self, lambda: f64) -> Arc<SparseCholesky> {
        lock(&self.diffusions)
            .entry(lambda.to_bits())
            .or_insert_with(|| {
                let matrix = SymmetricMatrix::diffusion(&self.topology, lambda.max(0.0));
                let made = SparseCholesky::new(&self.topology, &matrix, self.dissection());
                Arc::new(made.expect("I + lambda L is positive definite for lambda >= 0"))
            })
            .clone()
    }

    /// Adds `weight` b b^T to a matrix, for a point b of barycentric weights on a triangle.
    pub fn add_point(&self, matrix: &mut SymmetricMatrix, triangle: u32, weights: [f32; 3], weight: f64) {
        let corners = self.topology.triangles[triangle as usize];
        let edges = self.triangle_edges[triangle as usize];
        for k in 0..3 {
            let (own, next) = (f64::from(weights[k]), f64::from(weights[(k + 1) % 3]));
            matrix.diagonal[corners[k] as usize] += weight * own * own;
            matrix.edges[edges[k] as usize] += weight * own * next;
        }
    }

    /// The curvature-driven density, factored at its first use.
    pub fn curvature_density(&self) -> Arc<CurvatureDensity> {
        self.curvature
            .get_or_init(|| {
                let made = CurvatureDensity::new(&self.topology, self.dissection());
                Arc::new(made.expect("every vertex of a sphere has neighbours"))
            })
            .clone()
    }

    /// The positions on the sphere of surface points.
    pub fn directions(&self, points: &[SurfacePoint]) -> impl Iterator<Item = DVec3> {
        points.iter().map(|point| {
            let corners = self.topology.triangles[point.triangle.0 as usize];
            corners.iter().zip(point.weights).map(|(&i, w)| self.rest[i as usize].as_dvec3() * w).sum()
        })
    }

    /// The surface points of the sphere nearest to directions.
    pub fn surface_points(&self, directions: impl IntoIterator<Item = DVec3>) -> Vec<SurfacePoint> {
        let mut directions = directions.into_iter().peekable();
        if directions.peek().is_none() {
            return Vec::new();
        }
        let index = SurfaceIndex::new(&self.rest, &self.topology.triangles);
        directions
            .map(|direction| {
                let hit = index.closest(direction.normalize_or_zero().as_vec3a());
                SurfacePoint { triangle: TriangleId(hit.triangle), weights: hit.weights.map(f64::from) }
            })
            .collect()
    }
}

fn triangle_edges(topology: &Topology) -> Vec<[u32; 3]> {
    let edge = |a: u32, b: u32| {
        let at = topology.edges.binary_search(&[a.min(b), a.max(b)]);
        at.expect("every side of a triangle is an edge") as u32
    };
    topology.triangles.iter().map(|&[a, b, c]| [edge(a, b), edge(b, c), edge(c, a)]).collect()
}
