//! Stage 2: where the scans' landmarks lie on the template sphere.

use glam::{DVec3, Vec3A};

use super::sphere::Sphere;
use crate::mesh::interpolate;
use crate::numeric::weighted_rotation;
use crate::spatial::SurfaceIndex;

/// The landmarks of one fitted scan carried to the unit sphere `[B, 3]`: the closest point of the fit to each.
pub fn landmarks_on_sphere(sphere: &Sphere, fitted: &[Vec3A], landmarks: &[Vec3A]) -> Vec<DVec3> {
    let triangles = &sphere.connectivity.topology.triangles;
    let index = SurfaceIndex::new(fitted, triangles);
    let carry = |point: &Vec3A| {
        let hit = index.closest(*point);
        let corners = triangles[hit.triangle as usize];
        interpolate(&sphere.rest, corners, hit.weights).as_dvec3().normalize_or(DVec3::Z)
    };
    landmarks.iter().map(carry).collect()
}

/// The mean of the members' sphere landmarks `[M][B, 3]`, each turned by a weighted Kabsch rotation onto the first
/// member's, back on the sphere.
pub fn average(members: &[Vec<DVec3>], weights: &[f64]) -> Vec<DVec3> {
    let Some(first) = members.first() else { return Vec::new() };
    let mut sums = vec![DVec3::ZERO; weights.len()];
    for member in members {
        let rotation = weighted_rotation(member, first, weights);
        for (sum, own) in sums.iter_mut().zip(member) {
            *sum += rotation * *own;
        }
    }
    sums.into_iter().zip(first).map(|(sum, first)| sum.normalize_or(*first)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Random;
    use glam::DMat3;

    #[test]
    fn turned_members_average_to_the_first() {
        let mut random = Random::new(5);
        let mut direction = || DVec3::new(random.signed(), random.signed(), random.signed()).normalize();
        let first: Vec<DVec3> = (0..12).map(|_| direction()).collect();
        let turned = |angle: f64| {
            let rotation = DMat3::from_axis_angle(DVec3::new(0.0, 0.6, 0.8), angle);
            first.iter().map(|p| rotation * *p).collect::<Vec<_>>()
        };
        let members = [first.clone(), turned(0.5), turned(-1.0)];
        let mut weights = vec![1.0; 12];
        weights[3] = 1e4;
        for (mean, first) in average(&members, &weights).iter().zip(&first) {
            assert!(mean.distance(*first) < 1e-9);
        }
    }

    #[test]
    fn a_fit_that_is_the_sphere_carries_landmarks_radially() {
        let sphere = Sphere::of_level(3);
        let point = Vec3A::new(0.3, -0.4, 0.8).normalize();
        let carried = landmarks_on_sphere(&sphere, &sphere.rest, &[point * 1.2]);
        assert!(carried[0].distance(point.as_dvec3()) < 1e-2);
    }
}
