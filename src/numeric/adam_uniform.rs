use glam::Vec3A;
use rayon::prelude::*;

/// AdamUniform of Nicolet et al. 2021: Adam whose second moment is one number, the largest entry, so that every
/// coordinate is scaled alike and a smooth gradient gives a smooth step.
#[derive(Debug, Clone)]
pub struct AdamUniform {
    beta1: f32,
    beta2: f32,
    first: Vec<Vec3A>,
    second: Vec<Vec3A>,
    steps: i32,
}

impl AdamUniform {
    /// Decay rates 0.9 and 0.999 for `[N, 3]` unknowns.
    pub fn new(unknowns: usize) -> Self {
        Self {
            beta1: 0.9,
            beta2: 0.999,
            first: vec![Vec3A::ZERO; unknowns],
            second: vec![Vec3A::ZERO; unknowns],
            steps: 0,
        }
    }

    /// With another decay rate of the second moment: a smaller one forgets large early gradients sooner.
    pub fn with_beta2(mut self, beta2: f32) -> Self {
        self.beta2 = beta2;
        self
    }

    /// u -= rate * m / sqrt(max v), with bias-corrected moments of `gradient` `[N, 3]`.
    pub fn step(&mut self, u: &mut [Vec3A], gradient: &[Vec3A], rate: f32) {
        let (beta1, beta2) = (self.beta1, self.beta2);
        self.steps += 1;
        let largest = self
            .first
            .par_iter_mut()
            .zip(&mut self.second)
            .zip(gradient)
            .with_min_len(1024)
            .map(|((first, second), &g)| {
                *first = *first * beta1 + g * (1.0 - beta1);
                *second = *second * beta2 + g * g * (1.0 - beta2);
                second.max_element()
            })
            .reduce(|| 0.0, f32::max);
        let first_bias = 1.0 - beta1.powi(self.steps);
        let second_bias = 1.0 - beta2.powi(self.steps);
        let scale = rate / first_bias / ((largest / second_bias).sqrt() + 1e-12);
        u.par_iter_mut().zip(&self.first).with_min_len(1024).for_each(|(u, first)| *u -= *first * scale);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reaches_the_minimum_of_a_bowl() {
        let target = Vec3A::new(1.0, -2.0, 3.0);
        let mut u = [Vec3A::ZERO];
        let mut adam = AdamUniform::new(1);
        for i in 0..2000 {
            let gradient = [2.0 * (u[0] - target)];
            adam.step(&mut u, &gradient, 0.05 * 0.997f32.powi(i));
        }
        assert!(u[0].distance(target) < 1e-2, "{}", u[0]);
    }

    #[test]
    fn scales_every_coordinate_alike() {
        let mut u = [Vec3A::ZERO; 2];
        AdamUniform::new(2).step(&mut u, &[Vec3A::X, Vec3A::new(0.0, 0.5, 0.0)], 0.1);
        assert!((u[0].x / u[1].y - 2.0).abs() < 1e-5);
    }
}
