use std::sync::Arc;

use super::settings::Density;
use super::sphere::Sphere;
use crate::density::{CurvatureDensity, uniform_lengths};
use crate::energy::{Adaptation, Gradient, Shape};
use crate::mesh::mean_edge_lengths;
use crate::numeric::SolveBuffer;

/// w_u E_a + w_k E_a on a schedule, with desired edge lengths of the present shape.
pub(super) struct DensityTerm {
    density: Density,
    curvature: Option<Arc<CurvatureDensity>>,
}

impl DensityTerm {
    pub fn new(density: Density, sphere: &Sphere) -> Self {
        let scheduled = matches!(density, Density::Scheduled { .. });
        Self { density, curvature: scheduled.then(|| sphere.curvature_density()) }
    }

    /// Adds the weighted gradient at a share x of the iterations and returns the weighted value.
    pub fn add(&self, shape: Shape, x: f32, gradient: &mut Gradient, buffer: &mut SolveBuffer) -> f64 {
        let (uniform, adaptive) = self.density.weights(x);
        let weight = uniform.max(adaptive);
        if weight <= 0.0 {
            return 0.0;
        }
        let lengths = mean_edge_lengths(shape.topology, shape.positions);
        let desired = match &self.curvature {
            Some(curvature) if adaptive > 0.0 => {
                curvature.lengths(shape.topology, shape.positions, &lengths, buffer)
            }
            _ => uniform_lengths(&lengths),
        };
        let adaptation = Adaptation { lengths: &lengths, desired: &desired };
        f64::from(weight) * adaptation.add(shape, weight, gradient)
    }
}

impl Density {
    /// w_u and w_k at a share x of the iterations; never both.
    pub(super) fn weights(self, x: f32) -> (f32, f32) {
        match self {
            Self::Off => (0.0, 0.0),
            Self::Scheduled { strength } if x < 0.25 => (strength, 0.0),
            Self::Scheduled { strength } if x < 0.5 => (0.0, 2.0 * strength),
            Self::Scheduled { .. } => (0.0, 0.0),
            Self::Fading { uniform } => (uniform * (1.0 - x), 0.0),
        }
    }
}
