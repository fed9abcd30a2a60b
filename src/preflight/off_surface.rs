use glam::{DVec3, Vec3A};

use crate::mesh::TriangleMesh;
use crate::spatial::SurfaceIndex;

/// How far each point is from a surface, in the surface's units; NaN for one that is missing.
pub(super) fn distances_from_surface(mesh: &TriangleMesh, points: &[Option<DVec3>]) -> Vec<f64> {
    let centre = mesh.centroid();
    let radius = mesh.radius_about(centre);
    // The index is in single precision: about the origin and of size one it is good for a ten-thousandth of a head.
    let enter = |p: DVec3| ((p - centre) / radius).as_vec3a();
    let positions: Vec<Vec3A> = mesh.positions().iter().map(|&p| enter(p)).collect();
    let index = SurfaceIndex::new(&positions, mesh.triangles());
    let distance = |p: DVec3| radius * f64::from(index.closest(enter(p)).distance_squared).sqrt();
    points.iter().map(|point| point.map_or(f64::NAN, distance)).collect()
}
