use serde::{Deserialize, Serialize};

use crate::pipeline::settings::Density;

/// A named set of parameters of an inversion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InvertPreset {
    /// Ours: coarse to fine in mesh and pictures, a few views at a time.
    Default,
    /// The paper's, with iterations, rate and strength from the middle of its table.
    Paper,
    /// The paper's for its scene of that name, as are the following.
    TShirt,
    /// A monkey's head.
    Suzanne,
    /// The Stanford bunny.
    Bunny,
    /// A skull.
    Cranium,
    /// A bent board.
    Plank,
    /// A rubber ring with a duck's head.
    Bob,
}

/// What the pictures show of the object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// To be found out from the pictures.
    Detect,
    /// Its outline alone.
    Silhouette,
    /// Its normals as colours 0.5 + 0.5 n, in the axes that are detected.
    Normal,
    /// The same in the world's axes.
    WorldNormal,
    /// The same in the camera's axes: x right, y up, z towards the viewer.
    CameraNormal,
    /// Itself, under distant light.
    Shaded,
}

/// The colour of the object's surface in shaded pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Albedo {
    /// One for the whole object, which the light takes in.
    Constant,
    /// One for each vertex, estimated with the shape.
    Vertex,
}

/// Regularisation of plain positions, in place of the diffusion re-parameterization: ablations of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Smooth {
    /// None: u = (I + lambda L) p does it.
    Off,
    /// The Laplacian energy.
    Laplacian {
        /// Its weight.
        weight: f32,
    },
    /// The bi-Laplacian energy.
    BiLaplacian {
        /// Its weight.
        weight: f32,
    },
}

/// Every parameter of an inversion; what its report says was used.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InvertSettings {
    /// The preset these started from.
    pub preset: InvertPreset,
    /// Vertices of the result: 10 * 4^k + 2.
    pub vertices: usize,
    /// What the pictures show.
    pub what: What,
    /// The surface's colour in shaded pictures.
    pub albedo: Albedo,
    /// The light of shaded pictures, `[9, 3]` factors of 1, x, y, z, xy, yz, 3z^2 - 1, xz, x^2 - y^2 of the world normal;
    /// empty: estimated.
    pub light: Vec<[f32; 3]>,
    /// Iterations between two estimates of the light.
    pub light_refresh: usize,
    /// Most views that are read; of more, those that stand farthest from one another.
    pub most_views: usize,
    /// Cells along the longest side of the region that the silhouettes are carved from.
    pub hull_cells: usize,
    /// Whether the first level's sphere is fitted to the hull's surface as to a scan, before any picture is looked at.
    pub hull_fit: bool,
    /// lambda of the diffusion (I + lambda L)^-1 that smooths what was fitted to the hull.
    pub hull_diffusion: f64,
    /// lambda of the diffusion that smooths the shape before a finer level: what no view sees crumples, and no picture takes
    /// that back.
    #[serde(default)]
    pub level_diffusion: f64,
    /// Radius of the sphere otherwise, in those of the ball with the hull's volume.
    pub start_radius: f32,
    /// The levels in order, each on the same sphere as the one before or on its subdivision.
    pub levels: Vec<InvertLevel>,
}

/// One level of an inversion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InvertLevel {
    /// Subdivisions k of the icosahedron: 10 * 4^k + 2 vertices.
    pub level: u32,
    /// Longest side of the pictures, which are halved until they are no longer.
    pub size: u32,
    /// Views compared in an iteration, taken in turn; 0 takes all.
    pub batch: usize,
    /// Iterations T.
    pub iterations: usize,
    /// lambda of u = (I + lambda L) p.
    pub lambda: f64,
    /// Step of AdamUniform at the first iteration.
    pub rate: f32,
    /// Step at the last iteration, as a share of the first; in between it decays geometrically.
    pub rate_end: f32,
    /// Share of the step by which L^2 u is taken off u after each: bends that no picture asks for wear off.
    #[serde(default)]
    pub fairing: f32,
    /// Density adaptation.
    pub density: Density,
    /// Regularisation of plain positions.
    pub smooth: Smooth,
}
