//! Pictures of a mesh from all sides: examples, tests and round trips for inversions.

use glam::{DVec3, Vec3A};

use super::invert::{InvertError, Shown};
use super::observer::{Observer, Stage, Watch};
use crate::camera::{Intrinsics, Pose};
use crate::formats::{Photograph, Pixels};
use crate::mesh::{Normals, Topology, TriangleMesh, capped};
use crate::render::{Light, MeshLayout, Renderer, Rendering, Surface, Target, View};

/// How a mesh is taken pictures of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CaptureSettings {
    /// How many pictures, from places on a Fibonacci sphere.
    pub views: usize,
    /// Width and height in pixels.
    pub size: u32,
    /// What they show.
    pub shown: Shown,
    /// Samples along a pixel's side.
    pub samples: u32,
}

/// The cameras' angle of view, and the room around the mesh.
const ANGLE: f64 = 0.7;
const ROOM: f64 = 1.06;

/// A soft light from above and the front, a little warmer than what comes from below.
const STUDIO: Light = Light([
    [0.52, 0.50, 0.48],
    [0.10, 0.08, 0.05],
    [0.22, 0.20, 0.17],
    [0.12, 0.12, 0.13],
    [0.04, 0.03, 0.02],
    [0.03, 0.04, 0.04],
    [0.02, 0.02, 0.03],
    [-0.05, -0.04, -0.03],
    [0.03, 0.02, 0.02],
]);

/// The light that shaded pictures are taken in.
pub fn studio_light() -> Light {
    STUDIO
}

/// Takes pictures of a mesh, in light intensities. Its openings are shown with a flat cap: what no surface bounds has an
/// inside that would be seen, and no solid looks like that.
///
/// # Errors
/// [`InvertError::Render`], [`InvertError::Mesh`], [`InvertError::Canceled`].
pub fn capture(
    mesh: &TriangleMesh,
    settings: &CaptureSettings,
    renderer: &mut dyn Renderer,
    observer: &dyn Observer,
) -> Result<Vec<Photograph>, InvertError> {
    let watch = Watch { observer, stage: Stage::Capture, scan: "pictures", iterations: settings.views };
    let solid = &capped(mesh, &Topology::of(mesh))?;
    let topology = Topology::of(solid);
    // Meshes far from the origin would lose their shape in single precision.
    let (low, high) = mesh
        .positions()
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
    let centre = 0.5 * (low + high);
    let radius = mesh.radius_about(centre);
    let positions: Vec<Vec3A> =
        solid.positions().iter().map(|p| ((*p - centre) / radius).as_vec3a()).collect();
    let normals = Normals::new(&topology, &positions).vertices;
    let surface = Surface { positions: &positions, normals: &normals, albedo: None };
    // Caps have vertices of their own: nothing is open though it looks so to the topology.
    let layout = MeshLayout { closed: true, ..MeshLayout::of(&topology) };
    let mut photographs = Vec::with_capacity(settings.views);
    for (at, direction) in fibonacci(settings.views).enumerate() {
        let intrinsics = Intrinsics::with_angle([settings.size; 2], ANGLE);
        let distance = ROOM / (0.5 * ANGLE).sin();
        let pose = Pose::looking(direction * distance, DVec3::ZERO, DVec3::Y);
        let mut photograph = Photograph {
            name: format!("{at:03}"),
            pose,
            intrinsics,
            pixels: Pixels { size: intrinsics.size, values: Vec::new() },
            has_silhouette: true,
            unseen: None,
        };
        let target = target(&photograph, settings);
        renderer.prepare(layout, std::slice::from_ref(&target))?;
        photograph.pixels = averaged(&renderer.picture(&surface, 0)?, settings.samples);
        photograph.pose.translation = pose.translation * radius - pose.rotation * centre;
        photographs.push(photograph);
        watch.step(at + 1, 0.0)?;
    }
    Ok(photographs)
}

fn target(photograph: &Photograph, settings: &CaptureSettings) -> Target {
    let size = photograph.intrinsics.size.map(|side| side * settings.samples);
    let light = match settings.shown {
        Shown::Shaded => STUDIO,
        shown => shown.light(photograph),
    };
    let view = View { pose: photograph.pose, intrinsics: photograph.intrinsics.resized(size) };
    Target { view, light, background: [0.0; 3], colours: vec![[0.0; 3]; view.pixels()], weights: None }
}

/// Each square of samples one pixel, with the share of them that shows the surface as its opacity.
fn averaged(rendering: &Rendering, samples: u32) -> Pixels {
    let [width, height] = rendering.size;
    let values = (0..width * height).map(|at| {
        let [red, green, blue] = rendering.colours[at];
        if rendering.covered[at] { [red, green, blue, 1.0] } else { [0.0; 4] }
    });
    let mut pixels = Pixels { size: [width as u32, height as u32], values: values.collect() };
    let mut left = samples;
    while left > 1 {
        pixels = pixels.halved();
        left /= 2;
    }
    pixels
}

/// Directions spread evenly over the sphere, from the upper pole to the lower one.
fn fibonacci(count: usize) -> impl Iterator<Item = DVec3> {
    let turn = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..count).map(move |i| {
        let y = 1.0 - (2 * i + 1) as f64 / count as f64;
        let level = (1.0 - y * y).sqrt();
        let (sine, cosine) = (i as f64 * turn).sin_cos();
        DVec3::new(level * sine, y, level * cosine)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_spread_evenly() {
        let directions: Vec<DVec3> = fibonacci(16).collect();
        assert!(directions.iter().all(|d| (d.length() - 1.0).abs() < 1e-12));
        assert!(directions.iter().sum::<DVec3>().length() < 0.5);
        let nearest = |a: &DVec3| {
            directions.iter().filter(|b| *b != a).map(|b| a.distance(*b)).fold(f64::INFINITY, f64::min)
        };
        assert!(directions.iter().all(|d| nearest(d) > 0.6), "sixteen points have about 0.85 between them");
    }
}
