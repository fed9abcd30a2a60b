use glam::Vec3A;

use super::shape::add_unit_normal_gradient;
use super::{Gradient, SampleMatch, Shape, VertexMatch};

/// The normal loss D_n of template vertices: 1/N sum_i w_i (1 - n_i . n^_i) with frozen scan normals.
pub struct VertexNormals<'a> {
    /// A match for each vertex `[N]`.
    pub matches: &'a [VertexMatch],
}

impl VertexNormals<'_> {
    /// Adds `weight` times the gradient and returns the unweighted value.
    pub fn add(&self, shape: Shape, weight: f32, gradient: &mut Gradient) -> f64 {
        let scale = weight / self.matches.len() as f32;
        let mut sum = 0.0;
        let vertices = self.matches.iter().zip(&shape.normals.vertices).zip(&mut gradient.vertex_normals);
        for ((matched, &normal), gradient) in vertices {
            if matched.weight > 0.0 {
                sum += f64::from(matched.weight * (1.0 - normal.dot(matched.normal)));
                *gradient -= matched.normal * (scale * matched.weight);
            }
        }
        sum / self.matches.len() as f64
    }
}

/// The normal loss of scan samples against the triangles they are matched to: 1/S sum_s w_s (1 - n_t . n^_s).
pub struct SampleNormals<'a> {
    /// A match for each sample `[S]`.
    pub matches: &'a [SampleMatch],
    /// Area vectors shorter than this count as this long, so that slivers do not blow up.
    pub floor: f32,
}

impl SampleNormals<'_> {
    /// Adds `weight` times the gradient and returns the unweighted value.
    pub fn add(&self, shape: Shape, weight: f32, gradient: &mut Gradient) -> f64 {
        let scale = weight / self.matches.len().max(1) as f32;
        let mut wanted = vec![Vec3A::ZERO; shape.topology.triangles.len()];
        let mut sum = 0.0;
        for matched in self.matches.iter().filter(|matched| matched.weight > 0.0) {
            let normal = shape.normals.triangle(matched.triangle as usize);
            sum += f64::from(matched.weight * (1.0 - normal.dot(matched.normal)));
            wanted[matched.triangle as usize] -= matched.normal * (scale * matched.weight);
        }
        add_unit_normal_gradient(shape, gradient, self.floor, |t| wanted[t]);
        sum / self.matches.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::super::shape::bumpy::{gradient_error, sphere, vector};
    use super::*;
    use crate::numeric::Random;

    #[test]
    fn gradient_at_vertices() {
        let mut random = Random::new(31);
        let normal = |i| VertexMatch {
            point: Vec3A::ZERO,
            normal: vector(&mut random).normalize(),
            weight: (i % 3) as f32,
        };
        let matches: Vec<VertexMatch> = (0..sphere().1.len()).map(normal).collect();
        let error = gradient_error(|shape, weight, gradient| {
            VertexNormals { matches: &matches }.add(shape, weight, gradient)
        });
        assert!(error < 2e-3, "{error}");
    }

    #[test]
    fn gradient_at_samples() {
        let mut random = Random::new(32);
        let triangles = sphere().0.triangles.len();
        let sample = |i| SampleMatch {
            triangle: random.below(triangles) as u32,
            weight: (i % 3) as f32,
            normal: vector(&mut random).normalize(),
            ..SampleMatch::default()
        };
        let matches: Vec<SampleMatch> = (0..400).map(sample).collect();
        let error = gradient_error(|shape, weight, gradient| {
            SampleNormals { matches: &matches, floor: 0.0 }.add(shape, weight, gradient)
        });
        assert!(error < 2e-3, "{error}");
    }
}
