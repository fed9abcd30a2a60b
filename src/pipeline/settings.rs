use serde::{Deserialize, Serialize};

/// A value that moves from one number to another while a level's iterations run.
pub type Ramp = [f32; 2];

/// A named set of parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// Ours: coarse to fine, both data directions, a groupwise stage.
    Default,
    /// The paper's: T = 1400, lambda = 19, m = 1.5, template to scan only, its schedule. Closest points are walked to,
    /// with one exact search in eight, which was measured to end as close to the scan as exact searches alone.
    Paper,
}

/// Every parameter of the pipeline; what a report says was used.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// The preset these started from.
    pub preset: Preset,
    /// Template vertices: 10 * 4^k + 2.
    pub vertices: usize,
    /// Stage 1 of a registration, without landmarks.
    pub fit: FitSettings,
    /// Stage 2.
    pub resample: ResampleSettings,
    /// Stage 3, with landmarks.
    pub register: FitSettings,
    /// Where the landmarks are those of the head that comes with the program, the groupwise stage starts from it and the
    /// sphere is left out; a scan alone is registered to it. It has vertices for `vertices` up to 10242.
    #[serde(default)]
    pub from_head: bool,
    /// Landmarks that the audit doubts count less, and not at all where it finds them misplaced. Off, all count alike.
    #[serde(default)]
    pub audit_weights: bool,
    /// The groupwise stage; zero rounds leave it out.
    pub groupwise: GroupwiseSettings,
    /// Registration from a given template. After each of its rounds but the last the mean takes the template's place,
    /// so that what lies between landmarks corresponds; from the template of a frozen collection there is one round.
    pub transfer: GroupwiseSettings,
}

/// A sphere deformed to a scan, coarse to fine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FitSettings {
    /// Radius of the sphere at the start; the scan's is one.
    pub start_radius: f32,
    /// The levels in order, each a subdivision of the one before.
    pub levels: Vec<LevelSettings>,
}

/// One level of a fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LevelSettings {
    /// Subdivisions k of the icosahedron: 10 * 4^k + 2 vertices.
    pub level: u32,
    /// Iterations T.
    pub iterations: usize,
    /// lambda of u = (I + lambda L) p.
    pub lambda: f64,
    /// Step of AdamUniform at the first iteration.
    pub rate: f32,
    /// Step at the last iteration, as a share of the first; in between it decays geometrically.
    pub rate_end: f32,
    /// Iterations between two searches for closest points.
    pub refresh: usize,
    /// One vertex in this many seeks its closest point among all each time; the others walk to it over the scan from
    /// their last one, which is faster and may miss a closer one elsewhere. With 1 every search is exact.
    #[serde(default = "exact")]
    pub vertex_fresh: usize,
    /// The same of samples, which walk over the template.
    #[serde(default = "exact")]
    pub sample_fresh: usize,
    /// Scan samples pulled at the template; zero leaves the direction scan to template out.
    pub samples: usize,
    /// Weight of the normal terms.
    pub normal_weight: Ramp,
    /// Weight of normals against positions in the search for closest points, a length in unit space.
    pub normal_search: Ramp,
    /// Cosine between the normals below which a template vertex takes no point; -1 takes all.
    pub least_cosine: f32,
    /// Density adaptation.
    pub density: Density,
    /// Weight of the foldover term.
    pub foldover: Ramp,
    /// Weight of the landmark term.
    pub landmark_weight: Ramp,
}

/// Files from before there were walks mean exact searches.
fn exact() -> usize {
    1
}

/// Which adaptation energies act when.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Density {
    /// None: diffusion re-parameterization alone.
    Off,
    /// The paper's schedule: w_u = m in the first quarter, w_k = 2 m in the second, none after.
    Scheduled {
        /// Strength m.
        strength: f32,
    },
    /// Uniform with a weight that fades linearly to nothing.
    Fading {
        /// w_u at the first iteration.
        uniform: f32,
    },
}

/// How sphere landmarks are averaged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ResampleSettings {
    /// Weight of the nose tip in the alignment; every other landmark has weight one.
    pub nose_tip_weight: f64,
    /// Weights by landmark name, over the ones above.
    pub weights: std::collections::BTreeMap<String, f64>,
}

/// Registration of every scan from the collection's mean.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroupwiseSettings {
    /// How often a mean is taken and registered to every scan: the last time on the template's own level, before that
    /// on the last one of `register`, which may be coarser.
    pub rounds: usize,
    /// Exponent of curvature in the vertex density of the shared template; zero leaves it even.
    pub curvature_power: f32,
    /// Diffusion of the need for vertices.
    pub need_smoothing: f64,
    /// Most vertices a place may draw in a round, relative to the median.
    pub most_need: f32,
    /// Phases of a round, from stiff to soft.
    pub phases: usize,
    /// Iterations of a phase in the last round; those before it take fewer. From a template, a single round takes twice as many.
    pub iterations: usize,
    /// Stiffness mu in the first and the last phase.
    pub stiffness: [f64; 2],
    /// Diffusion of the deformation gradients in the first and the last phase.
    pub smoothing: [f64; 2],
    /// Weight of a landmark against a vertex's data.
    pub landmark_weight: f64,
    /// Weight of normals in the search for closest points, in the first and the last phase.
    pub normal_search: Ramp,
    /// Largest distance of a template vertex's closest point, in the first and the last phase.
    pub reach: Ramp,
    /// Cosine between the normals below which a match is dropped.
    pub least_cosine: f32,
    /// Scan samples pulled at the template.
    pub samples: usize,
    /// Largest distance of a scan sample's closest template point.
    pub sample_reach: f32,
    /// Cosine between the normals below which a sample's match is dropped.
    pub sample_least_cosine: f32,
    /// A template point this far from the scan is free to be pulled by any sample.
    pub slack: f32,
    /// Otherwise only by samples whose distance, times this, its own distance exceeds.
    pub own_share: f32,
    /// A vertex farther than this in the air over the scan falls inwards in the late phases; zero lets none fall.
    pub fall_beyond: f32,
    /// Where a member's area is more than this many times the mean's, the mean is drawn flat.
    pub film_stretch: f32,
    /// Where that film ends: the less, the more of what is around it is drawn flat with it; zero, as files from before have it,
    /// leaves its edge as ragged as it is found.
    #[serde(default)]
    pub film_share: f32,
    /// Share of a match's pull along the scan's normal only: 1 lets the template slide freely.
    pub plane: f32,
    /// How the shape settles on the scan at the end of a round.
    #[serde(default)]
    pub settle: SettleSettings,
}

/// The end of a round: triangles, not vertices, come to lie on the scan. Zeros, as files from before have it, do nothing.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SettleSettings {
    /// How often all samples are matched anew.
    pub iterations: usize,
    /// The distance that counts as much as a normal turned by one radian, as a share of the triangle's size (the root of
    /// twice its area).
    pub normals: f32,
    /// Stiffness mu of a step.
    pub stiffness: f32,
}

/// A parameter that cannot be set.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SettingError {
    /// No template of that size.
    #[error("a template of {0} vertices does not exist; choose 642, 2562, 10242 or 40962")]
    Vertices(usize),
    /// No parameter of that name.
    #[error("there is no parameter {name:?}; at {parent:?} there are: {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The part of it that exists.
        parent: String,
        /// What exists there.
        known: String,
    },
    /// The levels of a fit do not follow one another.
    #[error("the levels of {stage:?} {problem}")]
    Levels {
        /// Which fit.
        stage: &'static str,
        /// What is wrong.
        problem: String,
    },
    /// A file that holds no settings.
    #[error("these are no settings: {0}; begin with those of a manifest")]
    File(String),
    /// Not a value for that parameter.
    #[error("parameter {name:?} cannot be {value:?}: {reason}")]
    Value {
        /// The parameter.
        name: String,
        /// The value given.
        value: String,
        /// Why not.
        reason: String,
    },
}
