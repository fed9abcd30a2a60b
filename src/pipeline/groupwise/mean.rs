use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use crate::numeric::Similarity;

/// Alignments of the members to their own mean, each round closer.
const ROUNDS: usize = 3;

/// The weighted mean of members `[M][N, 3]` after aligning each by a similarity, in unit space (Procrustes).
///
/// `weights` `[M]` are the members', `known` `[M][N]` those of their vertices: what one member has not seen comes from
/// the others, and does not turn or stretch it.
pub fn mean_shape(
    members: &[impl AsRef<[Vec3A]>],
    weights: &[f64],
    known: &[impl AsRef<[f64]>],
) -> Vec<Vec3A> {
    let members: Vec<Vec<DVec3>> =
        members.iter().map(|member| member.as_ref().iter().map(|p| p.as_dvec3()).collect()).collect();
    let known: Vec<&[f64]> = known.iter().map(|known| known.as_ref()).collect();
    let share = |k: usize| known[k].iter().sum::<f64>();
    let most = (0..members.len()).reduce(|best, k| if share(k) > share(best) { k } else { best });
    let Some(most) = most else { return Vec::new() };
    let mut mean = members[most].clone();
    for _ in 0..ROUNDS {
        mean = unit(weighted_mean(&aligned(&members, &mean, &known), weights, &known));
    }
    mean.into_iter().map(|p| p.as_vec3a()).collect()
}

fn aligned(members: &[Vec<DVec3>], to: &[DVec3], known: &[&[f64]]) -> Vec<Vec<DVec3>> {
    let align = |(member, known): (&Vec<DVec3>, &&[f64])| {
        let similarity = Similarity::between(member, to, known);
        member.iter().map(|p| similarity.apply(*p)).collect()
    };
    members.par_iter().zip(known).map(align).collect()
}

fn weighted_mean(members: &[Vec<DVec3>], weights: &[f64], known: &[&[f64]]) -> Vec<DVec3> {
    let at = |i: usize| {
        let total: f64 = weights.iter().zip(known).map(|(w, known)| w * known[i]).sum();
        let members = members.iter().zip(weights).zip(known);
        members.map(|((member, w), known)| member[i] * (w * known[i] / total)).sum()
    };
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
        let moved: Vec<Vec3A> = shape.iter().map(|p| turn * *p * 2.5 + Vec3A::new(3.0, -1.0, 0.5)).collect();
        let mean = mean_shape(&[shape.clone(), moved], &[1.0, 3.0], &[vec![1.0; 40], vec![1.0; 40]]);
        let ratio = mean[0].distance(mean[7]) / shape[0].distance(shape[7]);
        for i in 1..40 {
            let (a, b) = (mean[0].distance(mean[i]), shape[0].distance(shape[i]));
            assert!((a / b - ratio).abs() < 1e-3 * ratio);
        }
    }

    #[test]
    fn what_a_member_does_not_know_comes_from_the_others() {
        let shape: Vec<Vec3A> = (0..40)
            .map(|i| Vec3A::new((i as f32).sin(), (1.3 * i as f32).cos(), (0.7 * i as f32).sin()))
            .collect();
        let mut wrong = shape.clone();
        wrong[30..].iter_mut().for_each(|p| *p += Vec3A::new(0.0, 9.0, 2.0));
        let known =
            |count: usize| -> Vec<f64> { (0..40).map(|i| if i < count { 1.0 } else { 1e-9 }).collect() };
        let mean = mean_shape(&[wrong, shape.clone()], &[1.0, 1.0], &[known(30), known(40)]);
        let ratio = mean[0].distance(mean[7]) / shape[0].distance(shape[7]);
        for i in 1..40 {
            let (a, b) = (mean[0].distance(mean[i]), shape[0].distance(shape[i]));
            assert!((a / b - ratio).abs() < 1e-3 * ratio, "{i}");
        }
    }
}
