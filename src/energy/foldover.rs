use glam::Vec3A;

use super::shape::add_unit_normal_gradient;
use super::{Gradient, Shape};

/// Keeps the surface from folding over: 1/E sum over edges of max(0, c - n_a . n_b)^2, the unit normals of the two
/// triangles at the edge, c the cosine from which a crease is sharp enough to be one.
pub struct Foldover {
    /// The cosine c below which a crease costs.
    pub cosine: f32,
    /// Area vectors shorter than this count as this long, so that slivers do not blow up.
    pub floor: f32,
}

impl Foldover {
    /// Adds `weight` times the gradient and returns the unweighted value.
    pub fn add(&self, shape: Shape, weight: f32, gradient: &mut Gradient) -> f64 {
        let topology = shape.topology;
        let scale = 2.0 * weight / topology.edges.len() as f32;
        let mut upstream = vec![Vec3A::ZERO; topology.triangles.len()];
        let mut sum = 0.0;
        for &[left, right] in &topology.edge_triangles {
            if left == right {
                continue;
            }
            let (a, b) = (shape.normals.triangle(left as usize), shape.normals.triangle(right as usize));
            let short = self.cosine - a.dot(b);
            if short > 0.0 {
                sum += f64::from(short * short);
                upstream[left as usize] -= b * (scale * short);
                upstream[right as usize] -= a * (scale * short);
            }
        }
        add_unit_normal_gradient(shape, gradient, self.floor, |t| upstream[t]);
        sum / topology.edges.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::super::shape::bumpy::gradient_error;
    use super::*;

    #[test]
    fn gradient() {
        // The bumpy sphere has creases on both sides of this cosine.
        let error = gradient_error(|shape, weight, gradient| {
            Foldover { cosine: 0.95, floor: 0.0 }.add(shape, weight, gradient)
        });
        assert!(error < 2e-3, "{error}");
    }
}
