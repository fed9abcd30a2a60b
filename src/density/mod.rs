//! Desired edge lengths l' for the adaptation energy: uniform, and shorter where the shape is complex. Layer 2.

mod curvature;

pub use curvature::CurvatureDensity;

/// l'_u: every vertex is to have the mean of the mean edge lengths `[N]`.
pub fn uniform_lengths(lengths: &[f32]) -> Vec<f32> {
    vec![mean(lengths); lengths.len()]
}

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len().max(1) as f32
}
