use std::sync::Arc;

use glam::{Mat3A, Vec3A};
use rayon::prelude::*;

use crate::mesh::{Normals, Topology, interpolate};
use crate::numeric::{SolveBuffer, SparseCholesky, SymmetricMatrix};
use crate::pipeline::Connectivity;

/// The shape that members are deformed from, and the elastic energy of doing so.
///
/// E_J(p) = sum over edges (i, j) of w_ij |(p_i - p_j) - J_ij (m_i - m_j)|^2 with rest positions m, cotangent weights w
/// and J_ij the mean of frozen deformation gradients at both ends.
pub struct RestShape {
    /// Its triangles.
    pub connectivity: Arc<Connectivity>,
    /// Rest positions m `[N, 3]` in unit space.
    pub positions: Vec<Vec3A>,
    /// w per edge `[E]`, kept positive and bounded.
    weights: Vec<f32>,
    /// Twice the area of each triangle `[F]`.
    areas: Vec<f32>,
    inverse_frames: Vec<Mat3A>,
    /// How much each vertex takes of the scans' data `[N]`, 0 to 1; `None` where all do.
    mask: Option<Vec<f32>>,
}

/// Two edges of a triangle and its normal, as long as its area's square root asks.
fn frame(topology: &Topology, positions: &[Vec3A], triangle: usize) -> Mat3A {
    let [a, b, c] = topology.triangles[triangle].map(|i| positions[i as usize]);
    let area = (b - a).cross(c - a);
    Mat3A::from_cols(b - a, c - a, area / area.length().sqrt().max(f32::MIN_POSITIVE))
}

impl RestShape {
    /// Prepares positions `[N, 3]` on a template\'s triangles.
    pub fn new(connectivity: Arc<Connectivity>, positions: Vec<Vec3A>) -> Self {
        let topology = &connectivity.topology;
        let inverse = |t: usize| {
            let frame = frame(topology, &positions, t);
            if frame.determinant().abs() > 1e-24 { frame.inverse() } else { Mat3A::ZERO }
        };
        let inverse_frames = (0..topology.triangles.len()).map(inverse).collect();
        let areas = Normals::new(topology, &positions).area_vectors.iter().map(|e| e.length()).collect();
        let weights = cotangent_weights(topology, &positions);
        Self { connectivity, positions, weights, areas, inverse_frames, mask: None }
    }

    /// The same whose vertices take as much of the scans' data as `mask` `[N]` says, 0 to 1.
    pub fn masked(self, mask: Option<&[f32]>) -> Self {
        let mask = mask.filter(|mask| mask.iter().any(|taken| *taken != 1.0));
        Self { mask: mask.map(<[f32]>::to_vec), ..self }
    }

    /// How much a vertex takes of the scans' data.
    pub fn takes(&self, vertex: usize) -> f32 {
        self.mask.as_ref().map_or(1.0, |mask| mask[vertex])
    }

    /// How much a point of barycentric weights on a triangle does.
    pub fn takes_at(&self, triangle: u32, weights: [f32; 3]) -> f32 {
        let corners = self.connectivity.topology.triangles[triangle as usize];
        self.mask.as_ref().map_or(1.0, |mask| interpolate(mask, corners, weights))
    }

    /// Deformation gradients per vertex `[N]` of positions p, diffused over the surface by `smoother`.
    pub fn gradients(&self, p: &[Vec3A], smoother: &SparseCholesky, buffer: &mut SolveBuffer) -> Vec<Mat3A> {
        let topology = &self.connectivity.topology;
        let of_triangles: Vec<Mat3A> = (0..topology.triangles.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|t| frame(topology, p, t) * self.inverse_frames[t] * self.areas[t])
            .collect();
        let of_vertex = |i: usize| -> Mat3A {
            let fan = topology.fans.row(i);
            let area: f32 = fan.iter().map(|f| self.areas[f[0] as usize]).sum();
            let sum = fan.iter().fold(Mat3A::ZERO, |sum, f| sum + of_triangles[f[0] as usize]);
            sum * (1.0 / area.max(f32::MIN_POSITIVE))
        };
        let mut gradients: Vec<Mat3A> =
            (0..p.len()).into_par_iter().with_min_len(1024).map(of_vertex).collect();
        for axis in 0..3 {
            let mut column: Vec<Vec3A> = gradients.iter().map(|j| *axis_of(&mut { *j }, axis)).collect();
            smoother.solve(&mut column, buffer);
            for (gradient, value) in gradients.iter_mut().zip(column) {
                *axis_of(gradient, axis) = value;
            }
        }
        gradients
    }

    /// How far the edges at each vertex are from what the gradients ask of them, in their lengths at rest, as a root
    /// mean square `[N]`: small where the shape bends and stretches smoothly, large where it tears or folds.
    pub fn distortion(&self, p: &[Vec3A], gradients: &[Mat3A]) -> Vec<f32> {
        let mut sums = vec![(0.0, 0.0); p.len()];
        for &[a, b] in &self.connectivity.topology.edges {
            let (a, b) = (a as usize, b as usize);
            let rest = self.positions[a] - self.positions[b];
            let wanted = 0.5 * (gradients[a] * rest + gradients[b] * rest);
            let off = (p[a] - p[b]).distance_squared(wanted) / rest.length_squared().max(f32::MIN_POSITIVE);
            for i in [a, b] {
                sums[i] = (sums[i].0 + off, sums[i].1 + 1.0);
            }
        }
        sums.into_iter().map(|(sum, count)| (sum / f32::max(count, 1.0)).sqrt()).collect()
    }

    /// Adds -mu/2 dE_J/dp `[N, 3]` at positions p with frozen gradients `[N]`.
    pub fn add_force(&self, p: &[Vec3A], gradients: &[Mat3A], mu: f32, force: &mut [Vec3A]) {
        for (&[a, b], &weight) in self.connectivity.topology.edges.iter().zip(&self.weights) {
            let (a, b) = (a as usize, b as usize);
            let rest = self.positions[a] - self.positions[b];
            let wanted = 0.5 * (gradients[a] * rest + gradients[b] * rest);
            let pull = (wanted - (p[a] - p[b])) * (mu * weight);
            force[a] += pull;
            force[b] -= pull;
        }
    }

    /// Adds mu times the energy's half Hessian, a Laplacian, to a matrix.
    pub fn add_stiffness(&self, mu: f64, matrix: &mut SymmetricMatrix) {
        for (k, (&[a, b], &weight)) in self.connectivity.topology.edges.iter().zip(&self.weights).enumerate()
        {
            let weight = mu * f64::from(weight);
            matrix.diagonal[a as usize] += weight;
            matrix.diagonal[b as usize] += weight;
            matrix.edges[k] -= weight;
        }
    }
}

fn axis_of(matrix: &mut Mat3A, axis: usize) -> &mut Vec3A {
    match axis {
        0 => &mut matrix.x_axis,
        1 => &mut matrix.y_axis,
        _ => &mut matrix.z_axis,
    }
}

/// Half the cotangents opposite each edge, clamped so that every edge holds and none rules.
fn cotangent_weights(topology: &Topology, positions: &[Vec3A]) -> Vec<f32> {
    let opposite = |t: u32, [a, b]: [u32; 2]| {
        let corner = topology.triangles[t as usize].into_iter().find(|&c| c != a && c != b).unwrap_or(a);
        let corner = positions[corner as usize];
        let (e, f) = (positions[a as usize] - corner, positions[b as usize] - corner);
        e.dot(f) / e.cross(f).length().max(1e-12)
    };
    let edges = topology.edges.iter().zip(&topology.edge_triangles);
    edges
        .map(|(&edge, [left, right])| {
            (0.5 * (opposite(*left, edge) + opposite(*right, edge))).clamp(0.1, 3.0)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::finite_difference::directional_error;
    use crate::pipeline::Sphere;
    use glam::Vec3;

    fn smoother(sphere: &Sphere) -> SparseCholesky {
        let matrix = SymmetricMatrix::diffusion(&sphere.connectivity.topology, 5.0);
        SparseCholesky::new(sphere.connectivity.elimination(), &matrix).unwrap()
    }

    #[test]
    fn what_is_torn_out_is_distorted_and_what_bends_is_not() {
        let sphere = Sphere::of_level(4);
        let rest = RestShape::new(sphere.connectivity.clone(), sphere.rest.clone());
        let mut p: Vec<Vec3A> = sphere.rest.iter().map(|m| *m * (1.0 + 0.2 * (5.0 * m.x).sin())).collect();
        let torn = 100;
        p[torn] *= 1.5;
        let gradients = rest.gradients(&p, &smoother(&sphere), &mut SolveBuffer::default());
        let distortion = rest.distortion(&p, &gradients);
        let ring = sphere.connectivity.topology.neighbours.row(torn);
        for (i, &distortion) in distortion.iter().enumerate() {
            let near = i == torn || ring.contains(&(i as u32));
            let far = ring.iter().all(|&j| sphere.rest[i].distance(sphere.rest[j as usize]) > 0.4);
            assert!(i != torn || distortion > 2.0, "{distortion}");
            assert!(near || !far || distortion < 0.4, "{i}: {distortion}");
        }
    }

    #[test]
    fn any_affine_deformation_is_free_of_force() {
        let sphere = Sphere::of_level(4);
        let rest = RestShape::new(sphere.connectivity.clone(), sphere.rest.clone());
        let affine = Mat3A::from_axis_angle(Vec3::Y, 0.8) * Mat3A::from_diagonal(Vec3::new(2.0, 0.7, 1.1));
        let p: Vec<Vec3A> = sphere.rest.iter().map(|m| affine * *m + Vec3A::X).collect();
        let gradients = rest.gradients(&p, &smoother(&sphere), &mut SolveBuffer::default());
        let mut force = vec![Vec3A::ZERO; p.len()];
        rest.add_force(&p, &gradients, 1.0, &mut force);
        // The normal's stretch is a convention, so only the surface's own directions are exact: what is left falls with
        // the square of the edges' length.
        let largest = force.iter().map(|f| f.length()).fold(0.0, f32::max);
        assert!(largest < 0.004, "{largest}");
    }

    #[test]
    fn force_is_the_gradient_of_the_energy() {
        let sphere = Sphere::of_level(2);
        let rest = RestShape::new(sphere.connectivity.clone(), sphere.rest.clone());
        let p: Vec<Vec3A> = sphere.rest.iter().map(|m| *m * (1.0 + 0.2 * (5.0 * m.x).sin())).collect();
        let gradients = rest.gradients(&p, &smoother(&sphere), &mut SolveBuffer::default());
        let mut force = vec![Vec3A::ZERO; p.len()];
        rest.add_force(&p, &gradients, 1.0, &mut force);
        let half_gradient: Vec<Vec3A> = force.iter().map(|f| -*f).collect();
        let error = directional_error(&p, &half_gradient, 1e-2, 5, |p| {
            let edges = rest.connectivity.topology.edges.iter().zip(&rest.weights);
            let energy = |(&[a, b], &w): (&[u32; 2], &f32)| {
                let (a, b) = (a as usize, b as usize);
                let m = rest.positions[a] - rest.positions[b];
                let wanted = 0.5 * (gradients[a] * m + gradients[b] * m);
                f64::from(w * ((p[a] - p[b]) - wanted).length_squared())
            };
            0.5 * edges.map(energy).sum::<f64>()
        });
        assert!(error < 1e-3, "{error}");
    }
}
