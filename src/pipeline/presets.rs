use super::settings::{
    Density, FitSettings, GroupwiseSettings, LevelSettings, Preset, ResampleSettings, SettingError, Settings,
    SettleSettings,
};
use crate::mesh::Icosphere;

/// The coarsest sphere a fit begins with: 642 vertices.
const COARSEST: u32 = 3;

impl Settings {
    /// The parameters of a preset for a template of `vertices` vertices.
    ///
    /// # Errors
    /// [`SettingError::Vertices`] unless there is such a sphere.
    pub fn preset(preset: Preset, vertices: usize) -> Result<Self, SettingError> {
        let level = match Icosphere::level_of(vertices) {
            Some(level @ COARSEST..=6) => level,
            _ => return Err(SettingError::Vertices(vertices)),
        };
        let resample =
            ResampleSettings { nose_tip_weight: 1e4, weights: std::collections::BTreeMap::default() };
        Ok(match preset {
            Preset::Paper => Self {
                preset,
                vertices,
                fit: paper(level),
                resample,
                register: paper(level),
                from_head: false,
                audit_weights: false,
                groupwise: GroupwiseSettings { rounds: 0, ..groupwise() },
                transfer: transfer(),
            },
            Preset::Default => Self {
                preset,
                vertices,
                fit: coarse_to_fine(level.min(4), 120),
                resample,
                register: coarse_to_fine(level.min(4), 150),
                from_head: true,
                audit_weights: false,
                groupwise: GroupwiseSettings {
                    // With few vertices lips that were drawn flat do not grow anew.
                    film_share: if level > 4 { 0.3 } else { 0.4 },
                    // A few long triangles line open mouths unless much is asked for them; more vertices than these have
                    // enough there, fewer have none to spare.
                    most_need: if level == 4 { 4.0 } else { 2.0 },
                    ..groupwise()
                },
                transfer: transfer(),
            },
        })
    }

    /// The parameters of `fit` alone, which goes up to the last level.
    ///
    /// # Errors
    /// As [`Settings::preset`].
    pub fn for_fit(preset: Preset, vertices: usize) -> Result<Self, SettingError> {
        let settings = Self::preset(preset, vertices)?;
        let fit = match preset {
            Preset::Default => coarse_to_fine(Icosphere::level_of(vertices).unwrap_or(COARSEST), 140),
            Preset::Paper => settings.fit,
        };
        Ok(Self { fit, ..settings })
    }

    /// The same without density adaptation: diffusion re-parameterization alone.
    pub fn without_density(mut self) -> Self {
        for level in self.fit.levels.iter_mut().chain(&mut self.register.levels) {
            level.density = Density::Off;
        }
        self
    }
}

/// Section 5.1 and the supplement: one level, fixed weights, no decay of the step.
///
/// The closest points are the paper's but for `vertex_fresh`: on four scans, fits with one exact search in eight lay
/// as close as those with all of them exact (Chamfer distances 0.88 to 1.18 times as large, the geometric mean 1.00).
fn paper(level: u32) -> FitSettings {
    FitSettings {
        start_radius: 1.0,
        levels: vec![LevelSettings {
            level,
            iterations: 1400,
            lambda: 19.0,
            rate: 1e-2,
            rate_end: 1.0,
            refresh: 1,
            vertex_fresh: 8,
            sample_fresh: 1,
            samples: 0,
            normal_weight: [1.0, 1.0],
            normal_search: [0.0, 0.0],
            least_cosine: -1.0,
            density: Density::Scheduled { strength: 1.5 },
            foldover: [0.0, 0.0],
            landmark_weight: [1.0, 1.0],
        }],
    }
}

/// Up to the finest level, which takes so many iterations; each coarser one takes 30 less.
fn coarse_to_fine(finest: u32, iterations: usize) -> FitSettings {
    let of = |k| level(k, iterations - 30 * (finest - k) as usize);
    FitSettings { start_radius: 0.9, levels: (COARSEST..=finest).map(of).collect() }
}

/// On ten scans and twelve sculpted heads long steps under little diffusion beat twice the iterations under as much as the
/// paper's lambda: at 10242 vertices the Chamfer distance was half and a quarter as large. Steps of 0.3 on the second level
/// leave sheets beside some heads; of 0.2 on the first, registrations from the sphere enter fewer mouths.
fn level(level: u32, iterations: usize) -> LevelSettings {
    let depth = (level - COARSEST) as usize;
    let shrink = 0.6f32.powi(depth as i32);
    LevelSettings {
        level,
        iterations,
        lambda: [4.0, 4.0, 5.0, 6.0][depth],
        rate: [0.4, 0.2, 0.2, 0.1][depth],
        rate_end: 0.05,
        refresh: [2, 3, 4, 4][depth],
        // With one exact vertex in eight the Chamfer distance of six scans was half as large again, with one in two
        // a seventh; samples that walk on fine levels left it within its scatter.
        vertex_fresh: 1,
        sample_fresh: if depth < 2 { 1 } else { 4 },
        samples: (2 * (10 * 4usize.pow(level) + 2)).min(20_000),
        normal_weight: [0.06, 0.3],
        normal_search: [0.15 * shrink, 0.045 * shrink],
        least_cosine: 0.0,
        density: Density::Fading { uniform: 3.0 },
        foldover: [0.0, 0.0],
        landmark_weight: [10.0, 10.0],
    }
}

/// A template that is a face begins nearer: six iterations in place of four bring twelve scans .015 mm nearer to each other.
fn transfer() -> GroupwiseSettings {
    GroupwiseSettings { rounds: 2, iterations: 4, ..groupwise() }
}

fn groupwise() -> GroupwiseSettings {
    GroupwiseSettings {
        rounds: 3,
        curvature_power: 0.67,
        need_smoothing: 2.0,
        most_need: 2.0,
        phases: 12,
        iterations: 12,
        stiffness: [1000.0, 0.05],
        smoothing: [1000.0, 1.0],
        landmark_weight: 60.0,
        normal_search: [0.05, 0.02],
        reach: [0.3, 0.03],
        least_cosine: 0.0,
        samples: 20_000,
        sample_reach: 0.04,
        sample_least_cosine: 0.2,
        slack: 0.005,
        own_share: 0.3,
        fall_beyond: 0.02,
        film_stretch: 6.0,
        film_share: 0.3,
        plane: 0.9,
        settle: SettleSettings { iterations: 12, normals: 0.2, stiffness: 0.003 },
    }
}
