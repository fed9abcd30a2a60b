use glam::Vec3A;

use super::{Gradient, Shape};
use crate::mesh::{SurfacePoint, interpolate};

/// A landmark: a point of the template, and where it belongs on the scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LandmarkPull {
    /// The template's triangle.
    pub triangle: u32,
    /// Barycentric weights c on it.
    pub weights: [f32; 3],
    /// k: the landmark on the scan, in unit space.
    pub target: Vec3A,
    /// Weight of this landmark.
    pub weight: f32,
}

impl LandmarkPull {
    /// A point of the template that belongs at `target`, with weight one.
    pub fn new(point: &SurfacePoint, target: Vec3A) -> Self {
        Self { triangle: point.triangle.0, weights: point.weights.map(|w| w as f32), target, weight: 1.0 }
    }
}

/// The landmark term: 1/B sum_i w_i |c_i - k_i|^2.
pub struct Landmarks<'a> {
    /// The landmarks known on both sides `[B]`.
    pub pulls: &'a [LandmarkPull],
}

impl Landmarks<'_> {
    /// Adds `weight` times the gradient and returns the unweighted value.
    pub fn add(&self, shape: Shape, weight: f32, gradient: &mut Gradient) -> f64 {
        let count = self.pulls.len().max(1) as f32;
        let mut sum = 0.0;
        for pull in self.pulls {
            let corners = shape.topology.triangles[pull.triangle as usize];
            let difference = interpolate(shape.positions, corners, pull.weights) - pull.target;
            sum += f64::from(pull.weight * difference.length_squared());
            for (&i, w) in corners.iter().zip(pull.weights) {
                gradient.positions[i as usize] += difference * (2.0 * weight * pull.weight * w / count);
            }
        }
        sum / f64::from(count)
    }
}

#[cfg(test)]
mod tests {
    use super::super::shape::bumpy::{gradient_error, vector};
    use super::*;
    use crate::numeric::Random;

    #[test]
    fn gradient() {
        let mut random = Random::new(41);
        let pull = |i: u16| LandmarkPull {
            triangle: u32::from(i) * 11,
            weights: [0.5, 0.2, 0.3],
            target: vector(&mut random),
            weight: 0.5 + f32::from(i % 3),
        };
        let pulls: Vec<LandmarkPull> = (0..20).map(pull).collect();
        let error = gradient_error(|shape, weight, gradient| {
            Landmarks { pulls: &pulls }.add(shape, weight, gradient)
        });
        assert!(error < 2e-3, "{error}");
    }
}
