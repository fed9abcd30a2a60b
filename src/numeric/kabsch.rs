use nalgebra::{Matrix3, Vector3};

use glam::{DMat3, DVec3};

/// The rotation R that minimises sum_i w_i |R a_i - b_i|^2, by the singular value decomposition of sum_i w_i b_i a_i^T
/// (Kabsch), never a reflection.
pub fn weighted_rotation(a: &[DVec3], b: &[DVec3], weights: &[f64]) -> DMat3 {
    let mut covariance = Matrix3::zeros();
    for ((a, b), &w) in a.iter().zip(b).zip(weights) {
        covariance += w * Vector3::from(b.to_array()) * Vector3::from(a.to_array()).transpose();
    }
    let svd = covariance.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else {
        return DMat3::IDENTITY;
    };
    // Flip the direction of the smallest singular value where U V^T would mirror.
    let mut turn = Matrix3::identity();
    turn[(svd.singular_values.imin(), svd.singular_values.imin())] = (u * v_t).determinant().signum();
    let rotation: Matrix3<f64> = u * turn * v_t;
    DMat3::from_cols_slice(rotation.as_slice())
}

/// x to s R x + t: scale, rotation, translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// Positive factor s.
    pub scale: f64,
    /// Rotation R.
    pub rotation: DMat3,
    /// Translation t.
    pub translation: DVec3,
}

impl Similarity {
    /// Leaves everything where it is.
    pub const IDENTITY: Self = Self { scale: 1.0, rotation: DMat3::IDENTITY, translation: DVec3::ZERO };

    /// The least-squares similarity of points `[B, 3]` onto others (Umeyama 1991), with weights `[B]`.
    ///
    /// Fewer than two distinct points give a translation.
    pub fn between(from: &[DVec3], to: &[DVec3], weights: &[f64]) -> Self {
        let total: f64 = weights.iter().sum();
        let mean = |points: &[DVec3]| points.iter().zip(weights).map(|(p, &w)| *p * w).sum::<DVec3>() / total;
        let (mean_from, mean_to) = (mean(from), mean(to));
        let a: Vec<DVec3> = from.iter().map(|p| *p - mean_from).collect();
        let b: Vec<DVec3> = to.iter().map(|p| *p - mean_to).collect();
        let spread: f64 = a.iter().zip(weights).map(|(a, w)| w * a.length_squared()).sum();
        let rotation = weighted_rotation(&a, &b, weights);
        let along: f64 = a.iter().zip(&b).zip(weights).map(|((a, b), w)| w * b.dot(rotation * *a)).sum();
        let scale = if spread > 0.0 && along > 0.0 { along / spread } else { 1.0 };
        Self { scale, rotation, translation: mean_to - scale * (rotation * mean_from) }
    }

    /// The image of a point.
    pub fn apply(&self, point: DVec3) -> DVec3 {
        self.scale * (self.rotation * point) + self.translation
    }

    /// The way back.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        let scale = 1.0 / self.scale;
        Self { scale, rotation, translation: -scale * (rotation * self.translation) }
    }

    /// First `self`, then `next`.
    pub fn then(&self, next: &Self) -> Self {
        Self {
            scale: next.scale * self.scale,
            rotation: next.rotation * self.rotation,
            translation: next.apply(self.translation),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Random;

    fn points(random: &mut Random, n: usize) -> Vec<DVec3> {
        (0..n).map(|_| DVec3::new(random.signed(), random.signed(), random.signed())).collect()
    }

    fn rotation(random: &mut Random) -> DMat3 {
        let axis = DVec3::new(random.signed(), random.signed(), random.signed()).normalize();
        DMat3::from_axis_angle(axis, 3.0 * random.signed())
    }

    #[test]
    fn recovers_a_known_similarity() {
        let mut random = Random::new(3);
        for _ in 0..50 {
            let from = points(&mut random, 7);
            let weights: Vec<f64> = from.iter().map(|_| 0.1 + random.unit()).collect();
            let known = Similarity {
                scale: 0.1 + 3.0 * random.unit(),
                rotation: rotation(&mut random),
                translation: DVec3::new(random.signed(), 5.0, -7.0),
            };
            let to: Vec<DVec3> = from.iter().map(|p| known.apply(*p)).collect();
            let found = Similarity::between(&from, &to, &weights);
            for p in &from {
                assert!(found.apply(*p).distance(known.apply(*p)) < 1e-9);
                assert!(found.then(&found.inverse()).apply(*p).distance(*p) < 1e-9);
            }
        }
    }

    #[test]
    fn never_mirrors() {
        let mut random = Random::new(4);
        let from = points(&mut random, 9);
        let mirrored: Vec<DVec3> = from.iter().map(|p| DVec3::new(-p.x, p.y, p.z)).collect();
        let rotation = weighted_rotation(&from, &mirrored, &[1.0; 9]);
        assert!((rotation.determinant() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn heavy_weights_win() {
        let from = [DVec3::X, DVec3::Y, DVec3::Z];
        let to = [DVec3::Y, -DVec3::X, DVec3::new(0.7, 0.0, 0.7)];
        let rotation = weighted_rotation(&from, &to, &[1e6, 1e6, 1.0]);
        assert!((rotation * DVec3::X).distance(DVec3::Y) < 1e-3);
    }
}
