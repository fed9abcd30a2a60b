use glam::DVec3;

use super::Random;
use super::brush::Brush;

/// Who somebody is: how far each of [`PARAMETERS`] departs from the mean head, in natural deviations.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    weights: [f64; PARAMETERS.len()],
}

/// A way in which heads differ.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// What it is called.
    pub name: &'static str,
    /// One natural deviation of it, as strokes on the mean head.
    strokes: &'static [Brush],
}

const fn parameter(name: &'static str, strokes: &'static [Brush]) -> Parameter {
    Parameter { name, strokes }
}

use Brush as B;

/// The ways in which heads differ. Each is a smooth field of displacements on the mean head, so that identities add up.
#[rustfmt::skip]
pub const PARAMETERS: [Parameter; 33] = [
    parameter("skull width", &[B::stretching([0.0, 4.0, -1.0], [18.0, 14.0, 18.0], [0.05, 0.0, 0.0])]),
    parameter("skull height", &[B::shifting([0.0, 12.0, -1.0], [16.0, 13.0, 16.0], [0.0, 0.6, 0.0])]),
    parameter("skull depth", &[B::shifting([0.0, 4.0, -10.0], [16.0, 14.0, 14.0], [0.0, 0.0, -0.6])]),
    parameter("forehead", &[B::shifting([0.0, 6.5, 8.5], [10.0, 6.5, 9.0], [0.0, 0.0, 0.35])]),
    parameter("face width", &[B::stretching([0.0, -1.5, 4.0], [15.0, 10.0, 13.0], [0.06, 0.0, 0.0])]),
    parameter("face length", &[B::shifting([0.0, -10.5, 6.0], [15.0, 13.0, 15.0], [0.0, -0.6, 0.0])]),
    parameter("jaw width", &[B::shifting([5.4, -7.0, 1.0], [5.5, 5.5, 7.0], [0.4, 0.0, 0.0]).on_both_sides()]),
    parameter("chin length", &[B::shifting([0.0, -10.3, 9.0], [6.0, 4.5, 7.0], [0.0, -0.35, 0.0])]),
    parameter("chin projection", &[B::shifting([0.0, -9.6, 9.8], [6.0, 4.0, 7.0], [0.0, 0.0, 0.4])]),
    parameter("chin width", &[B::stretching([0.0, -9.4, 9.0], [6.0, 4.0, 6.0], [0.16, 0.0, 0.0])]),
    parameter("cheekbones", &[B::shifting([5.4, -1.0, 5.8], [4.0, 3.6, 5.5], [0.25, 0.0, 0.25]).on_both_sides()]),
    parameter("cheeks", &[B::shifting([4.2, -5.0, 7.0], [4.5, 4.2, 5.5], [0.3, 0.0, 0.3]).on_both_sides()]),
    parameter("brow ridge", &[B::shifting([0.0, 2.8, 9.4], [7.0, 2.4, 5.0], [0.0, 0.0, 0.25])]),
    parameter("brow height", &[B::shifting([3.3, 2.8, 8.8], [3.4, 1.8, 4.0], [0.0, 0.16, 0.0]).on_both_sides()]),
    parameter("eye spacing", &[B::shifting([3.15, 1.0, 8.0], [3.1, 3.2, 5.0], [0.14, 0.0, 0.0]).on_both_sides()]),
    parameter("eye size", &[B::stretching([3.15, 1.0, 8.0], [3.1, 2.8, 4.0], [0.07, 0.1, 0.0]).on_both_sides()]),
    parameter("eye tilt", &[B::shifting([4.7, 1.0, 7.4], [2.4, 2.2, 3.5], [0.0, 0.12, 0.0]).on_both_sides()]),
    parameter("eye depth", &[B::shifting([3.15, 1.0, 8.0], [3.4, 2.8, 4.0], [0.0, 0.0, -0.2]).on_both_sides()]),
    parameter("nose length", &[B::shifting([0.0, -3.7, 11.0], [3.6, 4.0, 5.0], [0.0, -0.3, 0.0])]),
    parameter("nose projection", &[B::stretching([0.0, -3.0, 9.3], [3.2, 5.0, 8.0], [0.0, 0.0, 0.14])]),
    parameter("nose width", &[B::stretching([0.0, -3.7, 10.5], [3.2, 2.8, 4.0], [0.16, 0.0, 0.0])]),
    parameter("nose bridge", &[B::shifting([0.0, -0.6, 10.6], [2.2, 2.6, 4.0], [0.0, 0.0, 0.25])]),
    parameter("nose bridge width", &[B::stretching([0.0, 0.0, 9.8], [2.6, 3.0, 3.5], [0.16, 0.0, 0.0])]),
    parameter("nose tip turn", &[B::shifting([0.0, -3.2, 12.0], [2.6, 2.2, 2.8], [0.0, 0.25, 0.0])]),
    parameter("mouth width", &[B::stretching([0.0, -6.4, 9.6], [5.2, 3.0, 5.0], [0.11, 0.0, 0.0])]),
    parameter("mouth height", &[B::shifting([0.0, -6.4, 10.0], [5.5, 3.6, 5.0], [0.0, 0.18, 0.0])]),
    parameter("lip fullness", &[B::stretching([0.0, -6.35, 10.0], [4.0, 2.2, 3.0], [0.0, 0.17, 0.12])]),
    parameter("lip projection", &[B::shifting([0.0, -6.35, 10.3], [4.0, 2.6, 4.0], [0.0, 0.0, 0.2])]),
    parameter("ear size", &[B::stretching([7.2, -0.9, -1.9], [4.5, 5.5, 5.0], [0.0, 0.1, 0.1]).on_both_sides()]),
    parameter("ear stand", &[B::shifting([8.6, -0.2, -3.2], [2.3, 4.5, 3.2], [0.25, 0.0, 0.1]).on_both_sides()]),
    parameter("neck width", &[B::stretching([0.0, -15.0, -1.5], [14.0, 8.0, 14.0], [0.07, 0.0, 0.07])]),
    parameter("nose lean", &[B::shifting([0.0, -2.8, 11.5], [3.2, 4.0, 4.0], [0.1, 0.0, 0.0])]),
    parameter("jaw lean", &[B::shifting([0.0, -9.0, 7.0], [9.0, 5.5, 9.0], [0.14, 0.0, 0.0])]),
];

impl Identity {
    /// The mean head itself.
    pub fn mean() -> Self {
        Self { weights: [0.0; PARAMETERS.len()] }
    }

    /// Somebody at random, `strength` times as far from the mean as is natural.
    pub fn random(random: &mut Random, strength: f64) -> Self {
        // Nobody is extreme in one parameter: that leaves room for caricature.
        Self { weights: PARAMETERS.map(|_| strength * random.bell().clamp(-1.8, 1.8)) }
    }

    /// The same with one parameter set.
    ///
    /// # Panics
    /// If no parameter is called `name`.
    pub fn with(mut self, name: &str, weight: f64) -> Self {
        let at = PARAMETERS.iter().position(|parameter| parameter.name == name);
        self.weights[at.unwrap_or_else(|| panic!("no parameter is called {name}"))] = weight;
        self
    }

    /// How far the identity moves a point of the mean head.
    pub(super) fn displacement(&self, mean: DVec3) -> DVec3 {
        let moved = |(parameter, &weight): (&Parameter, &f64)| {
            weight * parameter.strokes.iter().map(|stroke| stroke.displacement(mean)).sum::<DVec3>()
        };
        PARAMETERS.iter().zip(&self.weights).map(moved).sum()
    }
}
