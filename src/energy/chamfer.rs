use glam::Vec3A;

use super::{Gradient, Shape};
use crate::mesh::interpolate;

/// How a distance r pulls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pull {
    /// E = r, the paper's: far and near pull alike.
    Distance,
    /// E = r^2 / (2 s) below the scale s and r - s / 2 above (Huber): settles softly, yet outliers do not rule.
    Huber(f32),
}

impl Pull {
    /// Value and derivative divided by r, so that the gradient is that factor times the difference vector.
    #[inline]
    fn at(self, distance: f32) -> (f32, f32) {
        match self {
            Self::Distance => (distance, 1.0 / distance.max(1e-7)),
            Self::Huber(scale) if distance < scale => (0.5 * distance * distance / scale, 1.0 / scale),
            Self::Huber(scale) => (distance - 0.5 * scale, 1.0 / distance),
        }
    }
}

/// Where a template vertex is pulled to.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct VertexMatch {
    /// Closest point on the scan.
    pub point: Vec3A,
    /// The scan's unit normal there.
    pub normal: Vec3A,
    /// Zero where there is no data.
    pub weight: f32,
}

/// The Chamfer distance D_c from template vertices to their frozen closest scan points: 1/N sum_i w_i r(|p_i - q_i|).
pub struct TemplateToScan<'a> {
    /// A match for each vertex `[N]`.
    pub matches: &'a [VertexMatch],
    /// How distance pulls.
    pub pull: Pull,
}

impl TemplateToScan<'_> {
    /// Adds `weight` times the gradient and returns the unweighted value.
    pub fn add(&self, shape: Shape, weight: f32, gradient: &mut Gradient) -> f64 {
        let scale = weight / self.matches.len() as f32;
        let mut sum = 0.0;
        for ((matched, &p), gradient) in self.matches.iter().zip(shape.positions).zip(&mut gradient.positions)
        {
            if matched.weight > 0.0 {
                let difference = p - matched.point;
                let (value, factor) = self.pull.at(difference.length());
                sum += f64::from(matched.weight * value);
                *gradient += difference * (factor * scale * matched.weight);
            }
        }
        sum / self.matches.len() as f64
    }
}

/// A scan sample and the template point it pulls.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SampleMatch {
    /// The template's triangle.
    pub triangle: u32,
    /// Zero where there is no match.
    pub weight: f32,
    /// Barycentric weights on the triangle.
    pub weights: [f32; 3],
    /// The scan sample.
    pub point: Vec3A,
    /// The scan's unit normal there.
    pub normal: Vec3A,
}

/// The Chamfer distance from scan samples to their frozen closest template points: 1/S sum_s w_s r(|x_s - B_s p|).
pub struct ScanToTemplate<'a> {
    /// A match for each sample `[S]`.
    pub matches: &'a [SampleMatch],
    /// How distance pulls.
    pub pull: Pull,
}

impl ScanToTemplate<'_> {
    /// Adds `weight` times the gradient and returns the unweighted value.
    pub fn add(&self, shape: Shape, weight: f32, gradient: &mut Gradient) -> f64 {
        let scale = weight / self.matches.len().max(1) as f32;
        let mut sum = 0.0;
        for matched in self.matches.iter().filter(|matched| matched.weight > 0.0) {
            let corners = shape.topology.triangles[matched.triangle as usize];
            let difference = interpolate(shape.positions, corners, matched.weights) - matched.point;
            let (value, factor) = self.pull.at(difference.length());
            sum += f64::from(matched.weight * value);
            let force = difference * (factor * scale * matched.weight);
            for (&i, w) in corners.iter().zip(matched.weights) {
                gradient.positions[i as usize] += force * w;
            }
        }
        sum / self.matches.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::super::shape::bumpy::{gradient_error, sphere, vector};
    use super::*;
    use crate::numeric::Random;

    /// Distances, and Huber's on both sides of its scale.
    const PULLS: [Pull; 2] = [Pull::Distance, Pull::Huber(0.25)];

    #[test]
    fn gradient_of_the_template_to_the_scan() {
        let mut random = Random::new(21);
        let matches: Vec<VertexMatch> = (sphere().1.iter().enumerate())
            .map(|(i, &p)| VertexMatch {
                point: p + (0.1 + 0.4 * random.unit() as f32) * vector(&mut random).normalize(),
                normal: Vec3A::Z,
                weight: (i % 4) as f32,
            })
            .collect();
        for pull in PULLS {
            let error = gradient_error(|shape, weight, gradient| {
                TemplateToScan { matches: &matches, pull }.add(shape, weight, gradient)
            });
            assert!(error < 2e-3, "{pull:?}: {error}");
        }
    }

    #[test]
    fn gradient_of_the_scan_to_the_template() {
        let (topology, positions) = sphere();
        let mut random = Random::new(22);
        let sample = |i: usize| {
            let triangle = random.below(topology.triangles.len());
            let near = positions[topology.triangles[triangle][0] as usize];
            let [a, b] = [random.unit() as f32, random.unit() as f32].map(|w| 0.5 * w);
            SampleMatch {
                triangle: triangle as u32,
                weight: (i % 4) as f32,
                weights: [1.0 - a - b, a, b],
                point: near * (1.3 + 0.5 * random.unit() as f32),
                normal: Vec3A::Z,
            }
        };
        let matches: Vec<SampleMatch> = (0..400).map(sample).collect();
        for pull in PULLS {
            let error = gradient_error(|shape, weight, gradient| {
                ScanToTemplate { matches: &matches, pull }.add(shape, weight, gradient)
            });
            assert!(error < 2e-3, "{pull:?}: {error}");
        }
    }
}
