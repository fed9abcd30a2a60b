use anyhow::{Context, ensure};
use glam::{DVec3, Vec3A};
use onemesh::camera::{Intrinsics, Pose};
use onemesh::mesh::{Icosphere, Topology};
use onemesh::render::{
    AdapterChoice, Light, MeshLayout, RenderGradient, Renderer, Surface, Target, View, adapters, open,
};

/// Says what this machine has for onemesh: processor, threads, and graphics adapters; the exit code is 0 if one draws.
#[derive(Debug, clap::Args)]
pub struct Doctor {
    /// The adapter to try: best, fastest, reference, or part of a name
    #[arg(long, default_value = "best", value_name = "NAME", env = "ONEMESH_ADAPTER")]
    adapter: AdapterChoice,
}

impl Doctor {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        say!("onemesh {}", env!("CARGO_PKG_VERSION"));
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        say!("processors: {cores}, threads: {}", rayon::current_num_threads());
        say!("processor: {}, with {}", std::env::consts::ARCH, listed(features()));
        let found = adapters();
        say!("graphics adapters:{}", if found.is_empty() { " none" } else { "" });
        for adapter in &found {
            say!("  {adapter}");
        }
        let mut chosen = open(&self.adapter)?;
        let picture = picture(&mut *chosen).context("the chosen adapter cannot draw")?;
        say!("chosen ({}): {}", self.adapter, chosen.adapter());
        let wanted = self::picture(&mut *open(&AdapterChoice::Reference)?)?;
        let off = (picture - wanted).abs();
        ensure!(
            off < 1e-3,
            "the chosen adapter draws a sphere with a loss of {picture}, and it is {wanted}: choose another by \
             --adapter, \"reference\" for one"
        );
        say!("it draws as it should");
        Ok(())
    }
}

/// How far a white sphere's silhouette is from a grey picture: the sphere's share of it.
fn picture(renderer: &mut dyn Renderer) -> anyhow::Result<f64> {
    let sphere = Icosphere::new(3);
    let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
    let positions: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
    let intrinsics = Intrinsics::with_angle([64, 64], 1.0);
    let pose = Pose::looking(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, DVec3::Y);
    let target = Target {
        view: View { pose, intrinsics },
        light: Light::uniform([1.0; 3]),
        background: [0.0; 3],
        colours: vec![[0.2; 3]; 64 * 64],
        weights: None,
    };
    renderer.prepare(MeshLayout::of(&topology), &[target])?;
    let surface = Surface { positions: &positions, normals: &positions, albedo: None };
    Ok(renderer.loss(&surface, &[0], &mut RenderGradient::default())?)
}

fn listed(features: Vec<&str>) -> String {
    if features.is_empty() { "nothing that is used".into() } else { features.join(", ") }
}

/// What this processor has of what the kernels use.
#[cfg(target_arch = "x86_64")]
fn features() -> Vec<&'static str> {
    let known = [
        ("sse4.2", is_x86_feature_detected!("sse4.2")),
        ("avx", is_x86_feature_detected!("avx")),
        ("avx2", is_x86_feature_detected!("avx2")),
        ("fma", is_x86_feature_detected!("fma")),
    ];
    known.into_iter().filter(|(_, there)| *there).map(|(name, _)| name).collect()
}

/// What this processor has of what the kernels use.
#[cfg(not(target_arch = "x86_64"))]
fn features() -> Vec<&'static str> {
    Vec::new()
}
