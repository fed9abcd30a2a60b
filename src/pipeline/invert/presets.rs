use super::settings::{Albedo, InvertLevel, InvertPreset, InvertSettings, Smooth, What};
use crate::mesh::Icosphere;
use crate::pipeline::settings::{Density, SettingError};

/// The coarsest sphere an inversion begins with: 642 vertices.
const COARSEST: u32 = 3;

/// The table's strengths in ours. E_a goes with the square of lengths and the photometric loss does not, so that they depend
/// on the size of its scenes, which it does not give: in unit space they move vertices by a fiftieth of an edge. Of 10, 20, 40
/// and more times as much this helps the most curved parts and costs the normals of the rest the least.
const STRENGTH_IN_UNIT_SPACE: f32 = 10.0;

/// What the supplement's tables say of a scene.
struct Scene {
    strength: f32,
    iterations: usize,
    rate: f32,
    /// Weights of the Laplacian and of the bi-Laplacian energy.
    smooth: [f32; 2],
    /// Iterations with these.
    smooth_iterations: usize,
}

impl InvertPreset {
    fn scene(self) -> Scene {
        let (strength, iterations, rate, smooth, smooth_iterations) = match self {
            Self::TShirt => (0.5, 370, 3e-3, [12.0, 12.0], 390),
            Self::Suzanne => (1.8, 1080, 2e-3, [2.8, 3.8], 1130),
            Self::Bunny => (2.0, 1380, 1e-2, [3.8, 2.1], 1450),
            Self::Cranium => (2.7, 5000, 5e-3, [0.21, 0.16], 1910),
            Self::Plank => (0.7, 1500, 3e-3, [3.8, 5.0], 960),
            Self::Bob => (0.7, 930, 3e-3, [0.67, 0.37], 940),
            // The medians of these six.
            Self::Paper | Self::Default => (1.25, 1230, 3e-3, [3.3, 2.95], 1045),
        };
        Scene { strength, iterations, rate, smooth, smooth_iterations }
    }
}

impl InvertSettings {
    /// The parameters of a preset for a result of `vertices` vertices.
    ///
    /// # Errors
    /// [`SettingError::Vertices`] unless there is such a sphere.
    pub fn preset(preset: InvertPreset, vertices: usize) -> Result<Self, SettingError> {
        let level = match Icosphere::level_of(vertices) {
            Some(level @ COARSEST..=6) => level,
            _ => return Err(SettingError::Vertices(vertices)),
        };
        let levels = match preset {
            InvertPreset::Default => coarse_to_fine(level),
            _ => vec![paper(level, &preset.scene())],
        };
        Ok(Self {
            preset,
            vertices,
            what: What::Detect,
            albedo: Albedo::Constant,
            light: Vec::new(),
            light_refresh: 25,
            most_views: 200,
            hull_cells: 80,
            hull_fit: preset == InvertPreset::Default,
            hull_diffusion: 1.0,
            level_diffusion: 0.4,
            start_radius: 1.0,
            levels,
        })
    }

    /// The same without density adaptation: diffusion re-parameterization alone (Nicolet et al. 2021).
    pub fn without_density(mut self) -> Self {
        self.levels.iter_mut().for_each(|level| level.density = Density::Off);
        self
    }

    /// The same with plain positions under the preset's Laplacian energy, or its bi-Laplacian one.
    pub fn smoothed(mut self, squared: bool) -> Self {
        let Scene { smooth: [laplacian, bi_laplacian], smooth_iterations, .. } = self.preset.scene();
        for level in &mut self.levels {
            level.density = Density::Off;
            level.lambda = 0.0;
            level.fairing = 0.0;
            level.smooth = if squared {
                Smooth::BiLaplacian { weight: bi_laplacian }
            } else {
                Smooth::Laplacian { weight: laplacian }
            };
            if self.preset != InvertPreset::Default {
                level.iterations = smooth_iterations;
            }
        }
        self
    }

    /// Longest side of any level's pictures.
    pub fn longest_side(&self) -> u32 {
        self.levels.iter().map(|level| level.size).max().unwrap_or(1)
    }

    /// Iterations of all levels.
    pub fn iterations(&self) -> usize {
        self.levels.iter().map(|level| level.iterations).sum()
    }
}

/// Section 4 and the supplement: one level, all views, no decay of the step.
fn paper(level: u32, scene: &Scene) -> InvertLevel {
    InvertLevel {
        level,
        size: 512,
        batch: 0,
        iterations: scene.iterations,
        lambda: 19.0,
        rate: scene.rate,
        rate_end: 1.0,
        fairing: 0.0,
        density: Density::Scheduled { strength: STRENGTH_IN_UNIT_SPACE * scene.strength },
        smooth: Smooth::Off,
    }
}

/// The hull gives the outlines, so that no level has far to go; small pictures suffice while the mesh is coarse, and a few of
/// the large ones at a time. What is left then is small, and a small lambda lets it in.
fn coarse_to_fine(finest: u32) -> Vec<InvertLevel> {
    let coarsest = finest.min(4);
    let level = |level: u32, size, batch, iterations, lambda, [rate, rate_end]: [f32; 2]| InvertLevel {
        level,
        size,
        batch,
        iterations,
        lambda,
        rate,
        rate_end,
        fairing: 0.0,
        density: Density::Off,
        smooth: Smooth::Off,
    };
    let finer = (coarsest + 1).min(finest)..=finest;
    let first = level(coarsest, 256, 0, 300, 5.0, [3e-2, 0.3]);
    let finer = finer.map(|k| InvertLevel {
        // What is a bend of the shape on a coarse mesh is a crumple on a fine one.
        fairing: 0.01 * 5f32.powi(k as i32 - 4),
        ..level(k, 512, 8, 350, 2.0, [1e-2, 0.05])
    });
    std::iter::once(first).chain(finer).collect()
}
