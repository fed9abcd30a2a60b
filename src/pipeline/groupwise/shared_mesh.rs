use std::sync::Arc;

use glam::{DVec3, Vec3A};

use super::film::flatten_films;
use super::redistribute;
use crate::mesh::{SurfacePoint, TriangleId, interpolate};
use crate::pipeline::{GroupwiseSettings, ScanSurface, Sphere};
use crate::spatial::{Hit, SurfaceIndex};

/// What the members of a collection share, and each member's positions under it, while rounds pass.
pub struct SharedMesh {
    /// The sphere whose triangles they share.
    pub sphere: Arc<Sphere>,
    /// The landmarks on those triangles.
    pub points: Vec<SurfacePoint>,
    /// Each member's positions `[M][N, 3]` in its unit space.
    pub shapes: Vec<Vec<Vec3A>>,
    /// The last round's mean `[N, 3]`; empty before the first.
    pub mean: Vec<Vec3A>,
}

impl SharedMesh {
    /// Subdivides up to a level; a level that is reached stays.
    pub fn refine_to(&mut self, level: u32) {
        while self.sphere.level < level {
            let finer = Sphere::of_level(self.sphere.level + 1);
            self.points = finer.surface_points(self.sphere.directions(&self.points));
            self.shapes = self.shapes.iter().map(|shape| finer.subdivide(shape)).collect();
            self.sphere = finer;
        }
    }

    /// Moves the vertices to where the members need them, landmarks, mean and members with them, and draws the mean's
    /// films flat.
    pub fn redistribute(&mut self, scans: &[&ScanSurface], settings: &GroupwiseSettings) {
        let members: Vec<_> = scans.iter().copied().zip(self.shapes.iter().map(Vec::as_slice)).collect();
        let moved = redistribute(&self.sphere, &members, settings);
        self.points = relocated(&self.sphere, &self.points, &moved);
        self.mean = carried(&self.sphere, &self.mean, &moved);
        self.shapes = self.shapes.iter().map(|shape| carried(&self.sphere, shape, &moved)).collect();
        flatten_films(&self.sphere, &mut self.mean, &self.shapes, settings.film_stretch);
    }
}

/// Values on the sphere `[N, 3]` at the points that its vertices moved to.
fn carried(sphere: &Sphere, values: &[Vec3A], moved: &[Hit]) -> Vec<Vec3A> {
    let at = |hit: &Hit| {
        interpolate(values, sphere.connectivity.topology.triangles[hit.triangle as usize], hit.weights)
    };
    moved.iter().map(at).collect()
}

/// The same points of the sphere on its moved triangles.
fn relocated(sphere: &Sphere, points: &[SurfacePoint], moved: &[Hit]) -> Vec<SurfacePoint> {
    let vertices: Vec<Vec3A> = moved.iter().map(|hit| hit.point).collect();
    let index = SurfaceIndex::new(&vertices, &sphere.connectivity.topology.triangles);
    let relocate = |position: DVec3| {
        let hit = index.closest(position.as_vec3a());
        SurfacePoint { triangle: TriangleId(hit.triangle), weights: hit.weights.map(f64::from) }
    };
    sphere.directions(points).map(relocate).collect()
}
