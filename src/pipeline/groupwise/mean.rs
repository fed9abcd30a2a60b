use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use crate::numeric::Similarity;

/// Alignments of the members to their own mean, each round closer.
const ROUNDS: usize = 3;

/// The weighted mean of members `[M][N, 3]` after aligning each by a similarity, in unit space (Procrustes).
pub fn mean_shape(members: &[Vec<Vec3A>], weights: &[f64]) -> Vec<Vec3A> {
    let members: Vec<Vec<DVec3>> =
        members.iter().map(|member| member.iter().map(|p| p.as_dvec3()).collect()).collect();
    let Some(first) = members.first() else { return Vec::new() };
    let mut mean = first.clone();
    for _ in 0..ROUNDS {
        mean = unit(weighted_mean(&aligned(&members, &mean), weights));
    }
    mean.into_iter().map(|p| p.as_vec3a()).collect()
}

fn aligned(members: &[Vec<DVec3>], to: &[DVec3]) -> Vec<Vec<DVec3>> {
    let equal = vec![1.0; to.len()];
    let align = |member: &Vec<DVec3>| {
        let similarity = Similarity::between(member, to, &equal);
        member.iter().map(|p| similarity.apply(*p)).collect()
    };
    members.par_iter().map(align).collect()
}

fn weighted_mean(members: &[Vec<DVec3>], weights: &[f64]) -> Vec<DVec3> {
    let total: f64 = weights.iter().sum();
    let at = |i: usize| members.iter().zip(weights).map(|(member, w)| member[i] * (w / total)).sum();
    (0..members[0].len()).map(at).collect()
}

/// Centred, with the farthest vertex at distance one.
fn unit(points: Vec<DVec3>) -> Vec<DVec3> {
    let centre = points.iter().sum::<DVec3>() / points.len() as f64;
    let radius = points.iter().map(|p| p.distance(centre)).fold(f64::MIN_POSITIVE, f64::max);
    points.into_iter().map(|p| (p - centre) / radius).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Mat3A, Vec3};

    #[test]
    fn moved_copies_have_their_own_shape_as_mean() {
        let shape: Vec<Vec3A> = (0..40)
            .map(|i| {
                let t = i as f32;
                Vec3A::new(t.sin(), (1.3 * t).cos(), (0.7 * t).sin())
            })
            .collect();
        let turn = Mat3A::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), 0.7);
        let moved = shape.iter().map(|p| turn * *p * 2.5 + Vec3A::new(3.0, -1.0, 0.5)).collect();
        let mean = mean_shape(&[shape.clone(), moved], &[1.0, 3.0]);
        let ratio = mean[0].distance(mean[7]) / shape[0].distance(shape[7]);
        for i in 1..40 {
            let (a, b) = (mean[0].distance(mean[i]), shape[0].distance(shape[i]));
            assert!((a / b - ratio).abs() < 1e-3 * ratio);
        }
    }
}
