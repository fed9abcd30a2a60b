use std::time::{Duration, Instant};

use glam::{DVec3, Vec3A};
use onemesh::camera::{Intrinsics, Pose};
use onemesh::mesh::{Icosphere, Normals, Topology};
use onemesh::render::{
    AdapterChoice, Light, MeshLayout, RenderGradient, Renderer, Surface, Target, View, adapters, open,
};

use super::clock::{Clock, row};

/// Cameras around the surface.
const VIEWS: usize = 16;
/// Pictures' widths and heights.
const SIDES: [u32; 2] = [256, 512];
/// Subdivisions of the surfaces: 5120 and 20 480 triangles.
const LEVELS: [u32; 2] = [4, 5];

/// A loss of sixteen views with its gradient, whole and by passes, on the best adapter and on the processor.
pub fn rendering(clock: &Clock) -> anyhow::Result<()> {
    let mut choices = vec![AdapterChoice::Reference];
    if !adapters().is_empty() {
        choices.insert(0, AdapterChoice::Best);
    }
    for choice in &choices {
        let mut renderer = open(choice)?;
        for level in LEVELS {
            for side in SIDES {
                losses(clock, &mut *renderer, level, side)?;
            }
        }
    }
    Ok(())
}

fn losses(clock: &Clock, renderer: &mut dyn Renderer, level: u32, side: u32) -> anyhow::Result<()> {
    let (topology, positions) = bumpy(level);
    let normals = Normals::new(&topology, &positions).vertices;
    let surface = Surface { positions: &positions, normals: &normals, albedo: None };
    let targets: Vec<Target> = (0..VIEWS).map(|view| target(view, side)).collect();
    renderer.prepare(MeshLayout::of(&topology), &targets)?;
    let triangles = topology.triangles.len();
    let name = format!("{}: {VIEWS} views, {side}^2, {triangles} triangles", renderer.adapter().name);
    let listed: Vec<usize> = (0..VIEWS).collect();
    let mut gradient = RenderGradient::default();
    let mut whole = Vec::new();
    let mut passes: Vec<(&str, Vec<Duration>)> = Vec::new();
    // The first run compiles and asks for memory.
    for run in 0..=clock.runs() {
        let start = Instant::now();
        renderer.loss(&surface, &listed, &mut gradient)?;
        let time = start.elapsed();
        let times = renderer.pass_times(&surface, &listed)?;
        if run == 0 {
            passes.extend(times.iter().map(|(pass, _)| (*pass, Vec::new())));
            continue;
        }
        whole.push(time);
        passes.iter_mut().zip(times).for_each(|((_, all), (_, time))| all.push(time));
    }
    row(&format!("{name}, whole"), &whole);
    for (pass, times) in passes {
        row(&format!("{name}, {pass}"), &times);
    }
    Ok(())
}

fn bumpy(level: u32) -> (Topology, Vec<Vec3A>) {
    let Icosphere { positions, triangles } = Icosphere::new(level);
    let topology = Topology::new(positions.len(), &triangles);
    let bump = |p: &DVec3| 1.0 + 0.02 * ((7.0 * p.x).sin() * (6.0 * p.y).cos() + (9.0 * p.z).sin());
    (topology, positions.iter().map(|p| (*p * bump(p)).as_vec3a()).collect())
}

/// Noise, seen from a direction of Fibonacci's spiral; the surface fills half of it.
fn target(view: usize, side: u32) -> Target {
    let height = 1.0 - 2.0 * (view as f64 + 0.5) / VIEWS as f64;
    let around = std::f64::consts::PI * (3.0 - 5f64.sqrt()) * view as f64;
    let flat = (1.0 - height * height).sqrt();
    let centre = 3.5 * DVec3::new(flat * around.cos(), height, flat * around.sin());
    let pose = Pose::looking(centre, DVec3::ZERO, DVec3::Y);
    let noise = |pixel: u32| pixel.wrapping_mul(2_654_435_761) >> 8;
    let colour = |pixel| [0, 8, 16].map(|shift| (noise(pixel) >> shift & 127) as f32 / 255.0);
    Target {
        view: View { pose, intrinsics: Intrinsics::with_angle([side, side], 0.71) },
        light: Light::camera_normals(&pose),
        background: [0.0; 3],
        colours: (0..side * side).map(colour).collect(),
        weights: None,
    }
}
