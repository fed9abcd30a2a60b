use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context;
use glam::DVec3;
use onemesh::evaluate::{Fidelity, surface_figures};
use onemesh::formats::{Glb, read_mesh, write_glb};
use onemesh::mesh::{Icosphere, Topology, TriangleMesh, sphere_layout};
use onemesh::pipeline::{fit_scan, vertex_normals};

use super::parameters::Parameters;
use super::progress::ProgressBars;

/// Fits the template to one scan, without landmarks, and prints how closely it lies.
#[derive(Debug, clap::Args)]
pub struct Fit {
    /// The scan: OBJ, PLY, STL, glTF or GLB
    scan: PathBuf,
    /// The GLB to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    parameters: Parameters,
}

impl Fit {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        let settings = self.parameters.for_fit()?;
        let scan = read_mesh(&self.scan)?;
        let name = self.scan.file_stem().map_or("scan".into(), |stem| stem.to_string_lossy());
        let start = Instant::now();
        let positions = fit_scan(&name, &scan, &settings.fit, &ProgressBars::new())?;
        eprintln!("fitted in {:.2} s", start.elapsed().as_secs_f64());
        let level = settings.fit.levels.last().map_or(0, |level| level.level);
        let sphere = Icosphere::new(level);
        let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
        let mesh = TriangleMesh::new(positions, sphere.triangles)
            .with_context(|| format!("the fit to {} failed", self.scan.display()))?;
        // Without landmarks the scan is taken to look along +Z.
        let layout = sphere_layout(&topology, &sphere.positions, DVec3::Z, DVec3::Y);
        let residuals = Fidelity::of(&scan, &mesh).residuals;
        let glb = Glb {
            name: &name,
            normals: Some(&vertex_normals(&mesh)),
            texture_coordinates: Some(&layout),
            scalars: vec![("_RESIDUAL", &residuals)],
            ..Glb::new(&mesh)
        };
        write_glb(&self.output, &glb)?;
        println!("{}", serde_json::to_string_pretty(&surface_figures(&scan, &mesh, false))?);
        Ok(())
    }
}
