//! Differentiable pictures of a mesh: colours by a rasterizer, and the gradient of their difference from other pictures.
//! Layer 3; alone names wgpu.
//!
//! One model of appearance serves silhouettes, normal maps and shaded pictures: see [`Light`]. A pixel shows what its
//! centre sees; where a silhouette passes between two pixels' centres, the one that it crosses blends both by the
//! place of the crossing, which is what makes visibility differentiable (Laine et al. 2020, "Modular Primitives for
//! High-Performance Differentiable Rendering", section 3.5).

mod adapter;
mod connectivity;
mod error;
mod gpu;
mod light;
mod reference;
#[cfg(test)]
mod scenes;
mod surface;
mod target;
mod view;

use std::time::Duration;

use self::connectivity::Connectivity;
use self::gpu::Gpu;
use self::reference::Reference;
use self::reference::silhouette::MOST_EDGES;

pub use adapter::{Adapter, AdapterChoice, AdapterKind};
pub use error::RenderError;
pub use light::Light;
pub use surface::{MeshLayout, RenderGradient, Rendering, Surface};
pub use target::Target;
pub use view::View;

/// Draws surfaces of one mesh as several cameras see them, and compares them with targets.
///
/// Same input, same bytes out, on one adapter.
pub trait Renderer: Send {
    /// Which device draws.
    fn adapter(&self) -> &Adapter;

    /// Takes the triangles of every surface to come, and the pictures to match.
    ///
    /// # Errors
    /// [`RenderError`] for triangles of vertices that are not there, for a target that is not whole, and for what the
    /// adapter has no room for.
    fn prepare(&mut self, mesh: MeshLayout<'_>, targets: &[Target]) -> Result<(), RenderError>;

    /// Other lights for the same targets, one a target.
    ///
    /// # Errors
    /// [`RenderError::Lights`] if there are more or fewer.
    fn set_lights(&mut self, lights: &[Light]) -> Result<(), RenderError>;

    /// E_p = sum w |R(p) - I| / sum w: the weighted mean over the pixels and the three channels of the listed targets;
    /// zero where nothing has a weight. `gradient` is set to its gradient with respect to positions (through what is
    /// visible, and through interpolation), vertex normals and albedo, each with the others held.
    ///
    /// # Errors
    /// [`RenderError`] for a surface that is not of the mesh, a target that is not prepared, or a driver's failure.
    fn loss(
        &mut self,
        surface: &Surface<'_>,
        targets: &[usize],
        gradient: &mut RenderGradient,
    ) -> Result<f64, RenderError>;

    /// The picture R of a surface as the camera of a target sees it.
    ///
    /// # Errors
    /// As [`Self::loss`].
    fn picture(&mut self, surface: &Surface<'_>, target: usize) -> Result<Rendering, RenderError>;

    /// Runs the passes of a loss one by one, each to its end: their names, and how long each took.
    ///
    /// # Errors
    /// As [`Self::loss`].
    fn pass_times(
        &mut self,
        surface: &Surface<'_>,
        targets: &[usize],
    ) -> Result<Vec<(&'static str, Duration)>, RenderError>;
}

/// Every graphics adapter that has a driver, the preferred first.
pub fn adapters() -> Vec<Adapter> {
    gpu::adapters()
}

/// Opens an adapter: the best, one by its name, or this program's own rasterizer.
///
/// # Errors
/// [`RenderError::NoAdapter`], [`RenderError::NoSuchAdapter`], or [`RenderError::Device`] where the driver fails.
pub fn open(choice: &AdapterChoice) -> Result<Box<dyn Renderer>, RenderError> {
    let in_software = || adapters().first().is_none_or(|adapter| adapter.kind >= AdapterKind::Software);
    Ok(match choice {
        AdapterChoice::Reference => Box::new(Reference::new()),
        AdapterChoice::Fastest if in_software() => Box::new(Reference::new()),
        choice => Box::new(Gpu::open(choice)?),
    })
}

/// What is asked of every renderer's mesh and targets.
fn checked(mesh: MeshLayout<'_>, targets: &[Target]) -> Result<Connectivity, RenderError> {
    mesh.check()?;
    for (index, target) in targets.iter().enumerate() {
        target.check(index)?;
    }
    let mesh = Connectivity::new(mesh);
    if mesh.edges.len() > MOST_EDGES {
        return Err(RenderError::TooLarge {
            what: "the mesh's number of edges".into(),
            found: mesh.edges.len() as u64,
            limit: MOST_EDGES as u64,
            remedy: "simplify the mesh",
        });
    }
    Ok(mesh)
}
