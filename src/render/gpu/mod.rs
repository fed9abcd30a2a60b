//! The passes as kernels of a graphics adapter, by wgpu: the same on graphics cards and on drivers in software.
//!
//! For each batch of views: vertices are projected; triangles are drawn into a picture of their numbers; pixels are shaded;
//! edges mark where they are silhouettes; pictures are compared with their targets; triangles and edges gather what their
//! pixels ask of their corners, each into a place of its own; vertices sum that up in a fixed order. No float is added to
//! by two threads, so that the same input gives the same bytes. Gradients and losses alone come back.

mod buffers;
mod chunk;
mod device;
mod draw_order;
mod kernels;
mod layout;
mod passes;
mod raster;
#[cfg(test)]
mod tests;

use std::time::{Duration, Instant};

use glam::Vec3A;

use self::device::Device;
use self::kernels::Kernels;
use self::layout::{Binding, ROW, filled_pixels, stride};
use self::passes::{Loaded, Pass};
use super::connectivity::Connectivity;
use super::{
    Adapter, AdapterChoice, Light, MeshLayout, RenderError, RenderGradient, Renderer, Rendering, Surface,
    Target,
};

pub(super) use self::device::adapters;

/// Draws with a graphics adapter.
#[derive(Debug)]
pub(super) struct Gpu {
    choice: AdapterChoice,
    device: Device,
    kernels: Kernels,
    scene: Option<Scene>,
}

/// What is drawn and compared with, to be uploaded again if the device is lost.
#[derive(Debug)]
struct Scene {
    mesh: Connectivity,
    targets: Vec<Target>,
    loaded: Loaded,
    scratch: Vec<[f32; 4]>,
}

impl Gpu {
    /// Opens an adapter and compiles the kernels for it.
    ///
    /// # Errors
    /// As [`super::open`].
    pub fn open(choice: &AdapterChoice) -> Result<Self, RenderError> {
        let device = Device::open(choice)?;
        let kernels = Kernels::new(&device.device);
        device.check()?;
        Ok(Self { choice: choice.clone(), device, kernels, scene: None })
    }

    /// Does something, and once more on a new device if this one is lost by it.
    fn retried<T>(
        &mut self,
        mut work: impl FnMut(&mut Self) -> Result<T, RenderError>,
    ) -> Result<T, RenderError> {
        match work(self) {
            Err(_) if self.device.is_lost() => {
                let Self { device, kernels, .. } = Self::open(&self.choice)?;
                (self.device, self.kernels) = (device, kernels);
                if let Some(scene) = &mut self.scene {
                    let limits = self.device.device.limits();
                    scene.loaded =
                        Loaded::new(&self.device, &self.kernels, &scene.mesh, &scene.targets, &limits)?;
                }
                work(self)
            }
            done => done,
        }
    }

    /// The scene, if the surface and the listed targets are of it.
    fn scene(&mut self, surface: &Surface<'_>, listed: &[usize]) -> Result<&mut Scene, RenderError> {
        let scene = self.scene.as_mut().ok_or(RenderError::NoTriangles)?;
        surface.check(scene.mesh.vertices)?;
        let targets = scene.targets.len();
        match listed.iter().find(|&&index| index >= targets) {
            Some(&index) => Err(RenderError::NoSuchTarget { index, targets }),
            None => Ok(scene),
        }
    }

    /// Runs the passes of a loss; returns what is read back: gradients, then each view's loss.
    fn run(&mut self, surface: &Surface<'_>, listed: &[usize], scale: f32) -> Result<Vec<f32>, RenderError> {
        let Self { device, kernels, scene, .. } = self;
        let Scene { targets, loaded, scratch, mesh } = scene.as_mut().ok_or(RenderError::NoTriangles)?;
        loaded.upload_surface(device, surface, scratch);
        let result = loaded.buffers.get(Binding::Result, &loaded.buffers.read);
        let mut encoder = device.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(result, 0, None);
        device.queue.submit([encoder.finish()]);
        for batch in loaded.batches(listed, targets, surface.albedo.is_some(), scale) {
            loaded.upload_batch(device, &batch);
            let mut encoder = device.device.create_command_encoder(&Default::default());
            for pass in Pass::LOSS {
                loaded.encode(pass, kernels, &batch, &mut encoder);
            }
            device.queue.submit([encoder.finish()]);
        }
        let numbers = width(surface) * mesh.vertices + ROW as usize * loaded.room.views as usize;
        let mut encoder = device.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(result, 0, &loaded.buffers.read, 0, 4 * numbers as u64);
        device.queue.submit([encoder.finish()]);
        device.read(&loaded.buffers.read, numbers)
    }

    fn draw(&mut self, surface: &Surface<'_>, target: usize) -> Result<Rendering, RenderError> {
        let Self { device, kernels, scene, .. } = self;
        let Scene { targets, loaded, scratch, .. } = scene.as_mut().ok_or(RenderError::NoTriangles)?;
        loaded.upload_surface(device, surface, scratch);
        let mut encoder = device.device.create_command_encoder(&Default::default());
        for batch in loaded.batches(&[target], targets, surface.albedo.is_some(), 0.0) {
            loaded.upload_batch(device, &batch);
            for pass in Pass::PICTURE {
                loaded.encode(pass, kernels, &batch, &mut encoder);
            }
        }
        let view = &targets[target].view;
        let numbers = 4 * filled_pixels(view) as usize;
        let usage = wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST;
        let read = buffers::buffer(&device.device, usage, numbers as u64);
        let picture = loaded.buffers.get(Binding::Blends, &read);
        encoder.copy_buffer_to_buffer(picture, 0, &read, 0, 4 * numbers as u64);
        device.queue.submit([encoder.finish()]);
        let picture = device.read(&read, numbers)?;
        let (pixels, _) = picture.as_chunks::<4>();
        let (size, stride) = (view.size(), stride(view) as usize);
        let (colours, covered) = (pixels.chunks_exact(stride).flat_map(|row| &row[..size[0]]))
            .map(|&[r, g, b, covered]| ([r, g, b], covered != 0.0))
            .unzip();
        Ok(Rendering { size, colours, covered })
    }
}

/// Numbers of a vertex's gradient.
fn width(surface: &Surface<'_>) -> usize {
    if surface.albedo.is_some() { 9 } else { 6 }
}

impl Renderer for Gpu {
    fn adapter(&self) -> &Adapter {
        &self.device.adapter
    }

    fn prepare(&mut self, mesh: MeshLayout<'_>, targets: &[Target]) -> Result<(), RenderError> {
        let mesh = super::checked(mesh, targets)?;
        // What was there makes room first.
        self.scene = None;
        let loaded = self.retried(|gpu| {
            Loaded::new(&gpu.device, &gpu.kernels, &mesh, targets, &gpu.device.device.limits())
        })?;
        self.scene = Some(Scene { mesh, targets: targets.to_vec(), loaded, scratch: Vec::new() });
        Ok(())
    }

    fn set_lights(&mut self, lights: &[Light]) -> Result<(), RenderError> {
        let targets = self.scene.as_mut().map_or(&mut [][..], |scene| &mut scene.targets);
        if lights.len() != targets.len() {
            return Err(RenderError::Lights { found: lights.len(), targets: targets.len() });
        }
        for (target, &light) in targets.iter_mut().zip(lights) {
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
        let scene = self.scene(surface, targets)?;
        let vertices = scene.mesh.vertices;
        let total = 3.0 * targets.iter().map(|&index| scene.targets[index].weight()).sum::<f64>();
        gradient.clear(vertices, surface.albedo.is_some());
        if total == 0.0 {
            return Ok(0.0);
        }
        let read = self.retried(|gpu| gpu.run(surface, targets, total.recip() as f32))?;
        let (of_vertices, losses) = read.split_at(width(surface) * vertices);
        for (vertex, numbers) in of_vertices.chunks_exact(width(surface)).enumerate() {
            gradient.positions[vertex] = Vec3A::from_slice(numbers);
            gradient.normals[vertex] = Vec3A::from_slice(&numbers[3..]);
            if let Some(albedo) = gradient.albedo.get_mut(vertex) {
                albedo.copy_from_slice(&numbers[6..]);
            }
        }
        Ok(losses.iter().map(|&loss| f64::from(loss)).sum::<f64>() / total)
    }

    fn picture(&mut self, surface: &Surface<'_>, target: usize) -> Result<Rendering, RenderError> {
        self.scene(surface, &[target])?;
        self.retried(|gpu| gpu.draw(surface, target))
    }

    fn pass_times(
        &mut self,
        surface: &Surface<'_>,
        targets: &[usize],
    ) -> Result<Vec<(&'static str, Duration)>, RenderError> {
        self.scene(surface, targets)?;
        let Self { device, kernels, scene, .. } = self;
        let Scene { targets: all, loaded, scratch, .. } = scene.as_mut().ok_or(RenderError::NoTriangles)?;
        loaded.upload_surface(device, surface, scratch);
        let mut times = Pass::LOSS.map(|pass| (pass.name(), Duration::ZERO));
        for batch in loaded.batches(targets, all, surface.albedo.is_some(), 1.0) {
            loaded.upload_batch(device, &batch);
            device.queue.submit([]);
            device.wait()?;
            for (pass, (_, time)) in Pass::LOSS.into_iter().zip(&mut times) {
                let begun = Instant::now();
                let mut encoder = device.device.create_command_encoder(&Default::default());
                loaded.encode(pass, kernels, &batch, &mut encoder);
                device.queue.submit([encoder.finish()]);
                device.wait()?;
                *time += begun.elapsed();
            }
        }
        Ok(times.to_vec())
    }
}
