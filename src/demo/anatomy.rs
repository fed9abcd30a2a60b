use glam::DVec3;

use super::brush::Brush;
use super::ear::Ears;
use super::eye::Eyes;
use super::mouth::Mouth;
use super::nose::Nose;
use super::skull::Skull;

/// What all heads share: the mean head as a smooth map from the unit directions of the anatomical sphere.
#[derive(Debug, Clone)]
pub struct Anatomy {
    skull: Skull,
    eyes: Eyes,
    nose: Nose,
    mouth: Mouth,
    ears: Ears,
}

/// An anatomical place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Where it is on the bare skull: the chart in which features are laid out.
    pub skull: DVec3,
    /// Where it is on the mean head.
    pub mean: DVec3,
}

/// Forms of the face that are no organ of their own, on the skull's surface.
const FORMS: [Brush; 9] = [
    // Brow ridge, eye socket, the hollow beside the nose's root.
    Brush::shifting([2.6, 2.6, 8.6], [2.6, 1.1, 3.0], [0.0, 0.0, 0.3]).on_both_sides(),
    Brush::shifting([3.0, 0.9, 8.0], [3.0, 2.0, 3.0], [0.0, 0.0, -0.4]).on_both_sides(),
    Brush::shifting([1.5, 0.9, 9.0], [1.0, 1.5, 3.0], [0.0, 0.0, -0.4]).on_both_sides(),
    // Cheekbone, hollow cheek.
    Brush::shifting([4.4, -1.4, 6.8], [3.0, 2.4, 4.0], [0.3, 0.0, 0.4]).on_both_sides(),
    Brush::shifting([4.6, -5.0, 6.0], [3.0, 3.0, 4.0], [-0.3, 0.0, -0.3]).on_both_sides(),
    // Groove over the upper lip, chin.
    Brush::shifting([0.0, -5.2, 9.7], [0.45, 0.8, 2.0], [0.0, 0.0, -0.12]),
    Brush::shifting([0.0, -9.2, 9.5], [2.0, 1.6, 3.0], [0.0, 0.0, 0.3]),
    // Temple, under the jaw.
    Brush::shifting([6.6, 3.0, 4.0], [3.0, 3.0, 4.0], [-0.35, 0.0, 0.0]).on_both_sides(),
    Brush::shifting([4.4, -10.2, 2.5], [3.5, 2.6, 6.0], [-0.6, 0.2, 0.0]).on_both_sides(),
];

impl Default for Anatomy {
    fn default() -> Self {
        Self { skull: Skull::new(), eyes: Eyes, nose: Nose::new(), mouth: Mouth::new(), ears: Ears::new() }
    }
}

impl Anatomy {
    /// The bare skull.
    pub(super) fn skull(&self) -> &Skull {
        &self.skull
    }

    /// The place in a unit `direction`.
    pub fn place(&self, direction: DVec3) -> Place {
        let skull = self.skull.point(direction);
        let formed = skull + FORMS.iter().map(|form| form.displacement(skull)).sum::<DVec3>();
        let mean = formed
            + self.eyes.displacement(skull, formed)
            + self.nose.displacement(skull)
            + self.mouth.displacement(skull)
            + self.ears.displacement(skull);
        Place { skull, mean }
    }
}
