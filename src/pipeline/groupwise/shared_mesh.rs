use std::sync::Arc;

use glam::{DVec3, Vec3A};

use super::film::flatten_films;
use super::redistribute;
use crate::mesh::{SurfacePoint, TriangleId, interpolate};
use crate::pipeline::{GroupwiseSettings, Sphere};
use crate::spatial::{Hit, SurfaceIndex};

/// What the members of a collection share while rounds pass.
pub struct SharedMesh {
    /// The sphere whose triangles they share.
    pub sphere: Arc<Sphere>,
    /// The landmarks on those triangles.
    pub points: Vec<SurfacePoint>,
    /// The round's mean `[N, 3]`; empty before it is taken.
    pub mean: Vec<Vec3A>,
}

impl SharedMesh {
    /// Subdivides up to a level; a level that is reached stays. It has no mean then.
    pub fn refine_to(&mut self, level: u32) {
        while self.sphere.level < level {
            let finer = Sphere::of_level(self.sphere.level + 1);
            self.points = finer.surface_points(self.sphere.directions(&self.points));
            self.sphere = finer;
        }
    }

    /// Moves the vertices to where the members need them, landmarks and mean with them, and draws the mean flat where
    /// the members `[M][N, 3]` have films. Returns the points of the sphere `[N]` that the vertices moved to.
    pub fn redistribute(
        &mut self,
        shapes: &[&[Vec3A]],
        needs: &[impl AsRef<[f32]>],
        settings: &GroupwiseSettings,
    ) -> Vec<Hit> {
        let moved = redistribute(&self.sphere, needs, settings);
        self.points = relocated(&self.sphere, &self.points, &moved);
        self.mean = carried(&self.sphere, &self.mean, moved.iter().map(at));
        let shapes: Vec<Vec<Vec3A>> =
            shapes.iter().map(|shape| carried(&self.sphere, shape, moved.iter().map(at))).collect();
        flatten_films(&self.sphere, &mut self.mean, &shapes, settings);
        moved
    }
}

/// The triangle and the weights of a hit.
fn at(hit: &Hit) -> (u32, [f32; 3]) {
    (hit.triangle, hit.weights)
}

/// Values on the sphere `[N, 3]` at points of it, each a triangle and weights.
pub fn carried(
    sphere: &Sphere,
    values: &[Vec3A],
    points: impl Iterator<Item = (u32, [f32; 3])>,
) -> Vec<Vec3A> {
    let triangles = &sphere.connectivity.topology.triangles;
    points.map(|(triangle, weights)| interpolate(values, triangles[triangle as usize], weights)).collect()
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
