use glam::{DQuat, DVec3};

use super::Head;
use super::spacing::Spacing;
use super::tessellation::{Surface, Tessellation};

/// A head to be triangulated.
#[derive(Debug, Clone)]
pub(super) struct Clay<'a> {
    pub head: &'a Head<'a>,
    pub spacing: Spacing,
}

impl Surface for Clay<'_> {
    fn point(&self, direction: DVec3) -> DVec3 {
        self.head.point(direction)
    }

    fn spacing(&self, direction: DVec3) -> f64 {
        self.spacing.at(self.head.anatomy.skull().point(direction))
    }
}

impl Clay<'_> {
    /// The same with its spacing brought to about so many triangles.
    pub fn with_triangles(self, triangles: f64) -> Self {
        let factor = (self.triangles() / triangles).sqrt();
        Self { spacing: self.spacing.times(factor), ..self }
    }

    /// About how many triangles the spacing makes.
    fn triangles(&self) -> f64 {
        /// Triangles for each square of the spacing.
        const DENSITY: f64 = 3.2;
        let coarse = Tessellation::icosphere(self, 24, DQuat::IDENTITY);
        let part = |corners: &[u32; 3]| {
            let [a, b, c] = corners.map(|i| coarse.positions[i as usize]);
            let area = (b - a).cross(c - a).length() / 2.0;
            area / self.spacing(coarse.directions[corners[0] as usize]).powi(2)
        };
        DENSITY * coarse.triangles.iter().map(part).sum::<f64>()
    }
}
