//! The passes on the processor, plainly: what the graphics adapter's kernels are compared with, and what draws where there
//! is none.

pub(super) mod backward;
pub(super) mod corner;
pub(super) mod frame;
pub(super) mod gather;
pub(super) mod lamp;
pub(super) mod loss;
pub(super) mod patch;
pub(super) mod raster;
pub(super) mod shade;
pub(super) mod silhouette;
#[cfg(test)]
mod tests;

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use self::backward::VertexGradient;
use self::frame::{Frame, Job};
use super::connectivity::Connectivity;
use super::{
    Adapter, AdapterKind, Light, MeshLayout, RenderError, RenderGradient, Renderer, Rendering, Surface,
    Target,
};

/// Draws on the processor.
#[derive(Debug)]
pub(super) struct Reference {
    adapter: Adapter,
    mesh: Option<Connectivity>,
    targets: Vec<Target>,
    /// Frames that no thread is drawing at the moment.
    frames: Mutex<Vec<Frame>>,
    /// A gradient for each view of the last call.
    gradients: Vec<Vec<VertexGradient>>,
}

impl Reference {
    pub fn new() -> Self {
        Self {
            adapter: adapter(),
            mesh: None,
            targets: Vec::new(),
            frames: Mutex::default(),
            gradients: Vec::new(),
        }
    }

    fn mesh(&self) -> Result<&Connectivity, RenderError> {
        self.mesh.as_ref().ok_or(RenderError::NoTriangles)
    }

    fn target(&self, index: usize) -> Result<&Target, RenderError> {
        self.targets.get(index).ok_or(RenderError::NoSuchTarget { index, targets: self.targets.len() })
    }

    /// Does something with a frame that nobody else uses.
    fn with_frame<T>(&self, work: impl FnOnce(&mut Frame) -> T) -> T {
        let frames = || self.frames.lock().unwrap_or_else(PoisonError::into_inner);
        let mut frame = frames().pop().unwrap_or_default();
        let done = work(&mut frame);
        frames().push(frame);
        done
    }
}

/// This program as an adapter.
pub(super) fn adapter() -> Adapter {
    Adapter {
        name: "reference".into(),
        kind: AdapterKind::Reference,
        driver: format!("onemesh {}", env!("CARGO_PKG_VERSION")),
    }
}

impl Renderer for Reference {
    fn adapter(&self) -> &Adapter {
        &self.adapter
    }

    fn prepare(&mut self, mesh: MeshLayout<'_>, targets: &[Target]) -> Result<(), RenderError> {
        self.mesh = Some(super::checked(mesh, targets)?);
        self.targets = targets.to_vec();
        Ok(())
    }

    fn set_lights(&mut self, lights: &[Light]) -> Result<(), RenderError> {
        if lights.len() != self.targets.len() {
            return Err(RenderError::Lights { found: lights.len(), targets: self.targets.len() });
        }
        for (target, &light) in self.targets.iter_mut().zip(lights) {
            target.light = light;
        }
        Ok(())
    }

    fn loss(
        &mut self,
        surface: &Surface<'_>,
        targets: &[usize],
        gradient: &mut RenderGradient,
    ) -> Result<f64, RenderError> {
        let mut gradients = std::mem::take(&mut self.gradients);
        let mesh = self.mesh()?;
        surface.check(mesh.vertices)?;
        let targets = targets.iter().map(|&index| self.target(index)).collect::<Result<Vec<_>, _>>()?;
        let total: f64 = 3.0 * targets.iter().map(|target| target.weight()).sum::<f64>();
        gradient.clear(mesh.vertices, surface.albedo.is_some());
        if total == 0.0 {
            return Ok(0.0);
        }
        gradients.resize_with(targets.len(), Vec::new);
        let values: Vec<f64> = (targets.par_iter().zip(&mut gradients))
            .with_max_len(1)
            .map(|(target, gradient)| {
                let job = Job { mesh, surface, target, scale: total.recip() as f32 };
                self.with_frame(|frame| {
                    for (_, pass) in Frame::PASSES {
                        pass(frame, job, gradient);
                    }
                    frame.value
                })
            })
            .collect();
        gather::gather(&gradients, surface.albedo.is_some(), gradient);
        self.gradients = gradients;
        Ok(values.iter().sum::<f64>() / total)
    }

    fn picture(&mut self, surface: &Surface<'_>, target: usize) -> Result<Rendering, RenderError> {
        let mesh = self.mesh()?;
        surface.check(mesh.vertices)?;
        let target = self.target(target)?;
        Ok(self.with_frame(|frame| {
            frame.draw(Job { mesh, surface, target, scale: 0.0 });
            Rendering {
                size: target.view.size(),
                colours: frame.picture.iter().map(|colour| colour.to_array()).collect(),
                covered: frame.raster.ids.iter().map(|&id| id != 0).collect(),
            }
        }))
    }

    fn pass_times(
        &mut self,
        surface: &Surface<'_>,
        targets: &[usize],
    ) -> Result<Vec<(&'static str, Duration)>, RenderError> {
        let mesh = self.mesh()?;
        surface.check(mesh.vertices)?;
        let targets = targets.iter().map(|&index| self.target(index)).collect::<Result<Vec<_>, _>>()?;
        let mut frames = vec![Frame::default(); targets.len()];
        let mut gradients = vec![Vec::new(); targets.len()];
        let mut times = Vec::new();
        for (name, pass) in Frame::PASSES {
            let run = |((frame, gradient), target): ((&mut Frame, &mut Vec<_>), &&Target)| {
                pass(frame, Job { mesh, surface, target, scale: 1.0 }, gradient)
            };
            // Once before, for memory that is asked for.
            for last in [false, true] {
                let begun = Instant::now();
                (frames.par_iter_mut().zip(&mut gradients)).zip(&targets).with_max_len(1).for_each(run);
                if last {
                    times.push((name, begun.elapsed()));
                }
            }
        }
        let mut gradient = RenderGradient::default();
        gradient.clear(mesh.vertices, surface.albedo.is_some());
        let begun = Instant::now();
        gather::gather(&gradients, surface.albedo.is_some(), &mut gradient);
        times.push(("gather", begun.elapsed()));
        Ok(times)
    }
}
