//! Stage 2: where the scans' landmarks lie on the template sphere.

use glam::{DVec3, Vec3A};

use crate::mesh::{SurfacePoint, TriangleId};
use crate::numeric::weighted_rotation;
use crate::spatial::SurfaceIndex;

/// The landmarks of one fitted scan, carried to the sphere: a position on it for each landmark that the scan has.
pub fn landmarks_on_sphere(
    sphere: &[DVec3],
    triangles: &[[u32; 3]],
    fitted: &[Vec3A],
    landmarks: &[Option<Vec3A>],
) -> Vec<Option<DVec3>> {
    let index = SurfaceIndex::new(fitted, triangles);
    let carry = |point: Vec3A| {
        let hit = index.closest(point);
        let corners = triangles[hit.triangle as usize];
        let on_sphere: DVec3 =
            corners.iter().zip(hit.weights).map(|(&i, w)| sphere[i as usize] * f64::from(w)).sum();
        on_sphere.normalize_or_zero()
    };
    landmarks.iter().map(|landmark| landmark.map(carry)).collect()
}

/// The mean of the members' sphere landmarks after rotating each by weighted Kabsch onto the first, back on the sphere.
pub fn average(members: &[Vec<Option<DVec3>>], weights: &[f64]) -> Vec<Option<DVec3>> {
    let Some(first) = members.first() else { return Vec::new() };
    let mut sums = vec![DVec3::ZERO; weights.len()];
    for member in members {
        let (mut a, mut b, mut w) = (Vec::new(), Vec::new(), Vec::new());
        for ((own, reference), &weight) in member.iter().zip(first).zip(weights) {
            if let (Some(own), Some(reference)) = (own, reference) {
                a.push(*own);
                b.push(*reference);
                w.push(weight);
            }
        }
        let rotation = weighted_rotation(&a, &b, &w);
        for (sum, own) in sums.iter_mut().zip(member) {
            if let Some(own) = own {
                *sum += rotation * *own;
            }
        }
    }
    sums.into_iter().map(|sum| (sum != DVec3::ZERO).then(|| sum.normalize())).collect()
}

/// The sphere's surface points nearest to positions on it.
pub fn on_template(sphere: &[DVec3], triangles: &[[u32; 3]], points: &[Option<DVec3>]) -> Vec<Option<SurfacePoint>> {
    let positions: Vec<Vec3A> = sphere.iter().map(|p| p.as_vec3a()).collect();
    let index = SurfaceIndex::new(&positions, triangles);
    points
        .iter()
        .map(|point| {
            point.map(|point| {
                let hit = index.closest(point.as_vec3a());
                SurfacePoint { triangle: TriangleId(hit.triangle), weights: hit.weights.map(f64::from) }
            })
        })
        .collect()
}
