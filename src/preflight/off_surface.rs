use std::collections::BTreeMap;

use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use crate::mesh::{LandmarkSet, Points, TriangleMesh};
use crate::spatial::{SurfaceIndex, closest_on_triangle};

/// For more points than this it pays to sort the triangles first.
const FEW: usize = 100;

/// How far each landmark that is there is from its scan's surface, in the scan's units.
pub fn landmark_distances(mesh: &TriangleMesh, landmarks: &LandmarkSet) -> BTreeMap<String, f64> {
    let distances = distances_from_surface(mesh, &landmarks.points);
    let there = landmarks.names.iter().zip(distances).filter(|(_, distance)| !distance.is_nan());
    there.map(|(name, distance)| (name.clone(), distance)).collect()
}

/// How far each point is from a surface, in the surface's units; NaN for one that is missing.
pub(super) fn distances_from_surface(mesh: &TriangleMesh<impl Points>, points: &[Option<DVec3>]) -> Vec<f64> {
    let there = points.iter().flatten().count();
    let all = |distance: &(dyn Fn(DVec3) -> f64 + Sync)| {
        points.par_iter().map(|point| point.map_or(f64::NAN, distance)).collect()
    };
    if there <= FEW {
        let farthest = farthest_reach(mesh);
        return all(&|point| scanned(mesh, farthest, point));
    }
    let centre = mesh.centroid();
    let radius = mesh.radius_about(centre);
    // The index is in single precision: about the origin and of size one it is good for a ten-thousandth of a head.
    let enter = |p: DVec3| ((p - centre) / radius).as_vec3a();
    let positions: Vec<Vec3A> = mesh.points().each().map(enter).collect();
    let index = SurfaceIndex::new(&positions, mesh.triangles());
    all(&|point| radius * f64::from(index.closest(enter(point)).distance_squared).sqrt())
}

/// How far a triangle reaches from its first corner, squared.
fn reach_squared([a, b, c]: [DVec3; 3]) -> f64 {
    a.distance_squared(b).max(a.distance_squared(c))
}

/// How far a triangle reaches from its first corner at most.
fn farthest_reach(mesh: &TriangleMesh<impl Points>) -> f64 {
    let reach = |corners: &[u32; 3]| reach_squared(corners.map(|i| mesh.position(i)));
    mesh.triangles().par_iter().with_min_len(4096).map(reach).reduce(|| 0.0, f64::max).sqrt()
}

/// The distance of a point from the surface: from all triangles that begin near enough to be the nearest, of which none
/// reaches farther than `farthest`.
fn scanned(mesh: &TriangleMesh<impl Points>, farthest: f64, point: DVec3) -> f64 {
    let begins = |corners: &[u32; 3]| mesh.position(corners[0]).distance_squared(point);
    let mut nearest = mesh.triangles().iter().map(begins).fold(f64::INFINITY, f64::min).sqrt();
    for corners in mesh.triangles() {
        let begin = begins(corners);
        if begin > (nearest + farthest).powi(2) {
            continue;
        }
        let places = corners.map(|i| mesh.position(i));
        let limit = nearest + reach_squared(places).sqrt();
        if begin <= limit * limit {
            // About the point and relative to the distance, single precision loses nothing that matters.
            let scale = limit.max(f64::MIN_POSITIVE);
            let corners = places.map(|p| ((p - point) / scale).as_vec3a());
            let square = closest_on_triangle(Vec3A::ZERO, corners).distance_squared;
            nearest = nearest.min(scale * f64::from(square).sqrt());
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Icosphere;
    use crate::numeric::Random;

    #[test]
    fn few_points_and_many_are_as_far() {
        let Icosphere { positions, triangles } = Icosphere::new(4);
        let mesh =
            TriangleMesh::new(positions.iter().map(|&p| 90.0 * p + DVec3::X).collect(), triangles).unwrap();
        let mut random = Random::new(2);
        let mut points: Vec<Option<DVec3>> =
            (0..150).map(|_| Some(120.0 * DVec3::from_array([0; 3].map(|_| random.signed())))).collect();
        points[3] = None;
        points[4] = Some(mesh.positions()[7]);
        let many = distances_from_surface(&mesh, &points);
        let few = distances_from_surface(&mesh, &points[..60]);
        for (few, many) in few.iter().zip(&many) {
            assert!((few - many).abs() < 1e-3 || (few.is_nan() && many.is_nan()), "{few} {many}");
        }
        assert!(few[3].is_nan() && few[4] < 1e-9);
    }
}
