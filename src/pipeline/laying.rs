use glam::{DVec3, Vec3A};

use crate::numeric::Similarity;

/// A shape `[N, 3]` moved by the similarity that brings points of it `[B, 3]` closest to `targets` `[B, 3]` of these
/// weights.
pub(super) fn laid(shape: &[DVec3], points: &[DVec3], targets: &[DVec3], weights: &[f64]) -> Vec<Vec3A> {
    let similarity = Similarity::between(points, targets, weights);
    shape.iter().map(|p| similarity.apply(*p).as_vec3a()).collect()
}
