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
pub fn average(members: &[Vec<Option<DVec3>>], weights: &[f64], power: f64) -> Vec<Option<DVec3>> {
    let Some(first) = members.first() else { return Vec::new() };
    let mut aligned = Vec::new();
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
        aligned.push(member.iter().map(|p| p.map(|p| rotation * p)).collect::<Vec<_>>());
    }
    let mean = weighted(&aligned, |_, _| 1.0);
    let near: Vec<Vec<usize>> = (0..weights.len()).map(|b| nearest(&mean, b, 6)).collect();
    weighted(&aligned, |m, b| room(&aligned[m], b, &near[b]).powf(power))
}

fn nearest(points: &[Option<DVec3>], b: usize, count: usize) -> Vec<usize> {
    let Some(p) = points[b] else { return Vec::new() };
    let mut others: Vec<(f64, usize)> = points.iter().enumerate().filter(|(k, _)| *k != b).filter_map(|(k, q)| q.map(|q| (q.distance(p), k))).collect();
    others.sort_by(|a, b| a.0.total_cmp(&b.0));
    others.into_iter().take(count).map(|(_, k)| k).collect()
}

fn room(member: &[Option<DVec3>], b: usize, near: &[usize]) -> f64 {
    let Some(p) = member[b] else { return 0.0 };
    let d: Vec<f64> = near.iter().filter_map(|&k| member[k].map(|q| q.distance(p))).collect();
    d.iter().sum::<f64>() / d.len().max(1) as f64
}

fn weighted(members: &[Vec<Option<DVec3>>], weight: impl Fn(usize, usize) -> f64) -> Vec<Option<DVec3>> {
    (0..members[0].len())
        .map(|b| {
            let sum: DVec3 = members.iter().enumerate().filter_map(|(m, member)| member[b].map(|p| p * weight(m, b))).sum();
            (sum != DVec3::ZERO).then(|| sum.normalize())
        })
        .collect()
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
