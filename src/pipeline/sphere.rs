use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex, OnceLock};

use glam::{DVec3, Vec3A};

use super::connectivity::{Connectivity, lock, once_for};
use crate::density::CurvatureDensity;
use crate::mesh::{Icosphere, Midpoints, SurfacePoint, TriangleId};
use crate::numeric::once;
use crate::reparam::Reparameterization;
use crate::spatial::SurfaceIndex;

/// A template sphere with what is made for it once and kept: topology, elimination order, factors.
pub struct Sphere {
    /// Subdivisions of the icosahedron.
    pub level: u32,
    /// Vertex positions `[N, 3]` on the unit sphere.
    pub rest: Vec<Vec3A>,
    /// Its triangles.
    pub connectivity: Arc<Connectivity>,
    /// How the level came from the one below it.
    midpoints: Option<Midpoints>,
    reparameterizations: Mutex<HashMap<u64, Arc<Reparameterization>>>,
    curvature: OnceLock<Arc<CurvatureDensity>>,
}

static SPHERES: LazyLock<Mutex<HashMap<u32, Arc<Sphere>>>> = LazyLock::new(Mutex::default);

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
        let rest: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
        Self {
            level,
            connectivity: Arc::new(Connectivity::new(&rest, &sphere.triangles)),
            rest,
            midpoints,
            reparameterizations: Mutex::default(),
            curvature: OnceLock::new(),
        }
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
        once_for(&self.reparameterizations, lambda, || {
            let Connectivity { topology, .. } = &*self.connectivity;
            let made = Reparameterization::new(topology, self.connectivity.elimination(), lambda.max(0.0));
            made.expect("I + lambda L is positive definite for lambda >= 0")
        })
    }

    /// The curvature-driven density, factored at its first use.
    pub fn curvature_density(&self) -> Arc<CurvatureDensity> {
        let made = once(&self.curvature, || {
            let made = CurvatureDensity::new(&self.connectivity.topology, self.connectivity.elimination());
            Arc::new(made.expect("every vertex of a sphere has neighbours"))
        });
        made.clone()
    }

    /// The positions on the sphere of surface points.
    pub fn directions<'a>(
        &'a self,
        points: impl IntoIterator<Item = &'a SurfacePoint>,
    ) -> impl Iterator<Item = DVec3> {
        points.into_iter().map(|point| {
            let corners = self.connectivity.topology.triangles[point.triangle.0 as usize];
            corners.iter().zip(point.weights).map(|(&i, w)| self.rest[i as usize].as_dvec3() * w).sum()
        })
    }

    /// The surface points of the sphere nearest to directions.
    pub fn surface_points(&self, directions: impl IntoIterator<Item = DVec3>) -> Vec<SurfacePoint> {
        let mut directions = directions.into_iter().peekable();
        if directions.peek().is_none() {
            return Vec::new();
        }
        let index = SurfaceIndex::new(&self.rest, &self.connectivity.topology.triangles);
        directions
            .map(|direction| {
                let hit = index.closest(direction.normalize_or_zero().as_vec3a());
                SurfacePoint { triangle: TriangleId(hit.triangle), weights: hit.weights.map(f64::from) }
            })
            .collect()
    }
}
