use super::{Gradient, Shape};
use crate::mesh::pull_back_mean_edge_lengths;

/// The adaptation energy, equation (2): E_a = 1/N |l(p) - l'|^2 with frozen desired edge lengths l'.
pub struct Adaptation<'a> {
    /// l(p): mean edge length per vertex `[N]` of the present shape.
    pub lengths: &'a [f32],
    /// l': the desired ones `[N]`.
    pub desired: &'a [f32],
}

impl Adaptation<'_> {
    /// Adds `weight` times the gradient and returns the unweighted value.
    pub fn add(&self, shape: Shape, weight: f32, gradient: &mut Gradient) -> f64 {
        let n = self.lengths.len() as f32;
        let difference = || self.lengths.iter().zip(self.desired).map(|(l, desired)| l - desired);
        let upstream: Vec<f32> = difference().map(|d| 2.0 * weight / n * d).collect();
        pull_back_mean_edge_lengths(shape.topology, shape.positions, &upstream, &mut gradient.positions);
        difference().map(|d| f64::from(d * d)).sum::<f64>() / f64::from(n)
    }
}

#[cfg(test)]
mod tests {
    use super::super::shape::bumpy::gradient_error;
    use super::*;
    use crate::mesh::mean_edge_lengths;

    #[test]
    fn gradient() {
        let error = gradient_error(|shape, weight, gradient| {
            let lengths = mean_edge_lengths(shape.topology, shape.positions);
            let desired: Vec<f32> = (0..lengths.len()).map(|i| 0.2 + 0.02 * (i % 7) as f32).collect();
            Adaptation { lengths: &lengths, desired: &desired }.add(shape, weight, gradient)
        });
        assert!(error < 2e-3, "{error}");
    }
}
