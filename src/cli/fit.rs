use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context;
use glam::DVec3;
use onemesh::evaluate::surface_figures;
use onemesh::formats::{read_mesh, write_whole};
use onemesh::mesh::{Icosphere, Topology, TriangleMesh, sphere_layout};
use onemesh::pipeline::{ResultMesh, confidence, fit_scan};

use super::formats::Formats;
use super::parameters::Parameters;
use super::progress::ProgressBars;

/// Fits the template to one scan, without landmarks, and prints how closely it lies.
#[derive(Debug, clap::Args)]
pub struct Fit {
    /// The scan: OBJ, PLY, STL, glTF or GLB
    scan: PathBuf,
    /// The GLB, OBJ or PLY to write; with --format, for each format under its own extension
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    formats: Formats,
    #[command(flatten)]
    parameters: Parameters,
}

impl Fit {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        let settings = self.parameters.for_fit()?;
        let outputs = self.formats.of_file(&self.output)?;
        let scan = read_mesh(&self.scan)?;
        let name = self.scan.file_stem().map_or("scan".into(), |stem| stem.to_string_lossy());
        let start = Instant::now();
        let (positions, surface) = fit_scan(&name, &scan, &settings.fit, &ProgressBars::new())?;
        remark!("fitted in {:.2} s", start.elapsed().as_secs_f64());
        let level = settings.fit.levels.last().map_or(0, |level| level.level);
        let sphere = Icosphere::new(level);
        let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
        let mesh = TriangleMesh::new(positions, sphere.triangles)
            .with_context(|| format!("the fit to {} failed", self.scan.display()))?;
        // Without landmarks the scan is taken to look along +Z.
        let layout = sphere_layout(&topology, &sphere.positions, DVec3::Z, DVec3::Y);
        let unit: Vec<_> = mesh.positions().iter().map(|p| surface.to_unit(*p)).collect();
        let residuals = surface.distances(&unit);
        let known: Vec<f64> = confidence(&surface, &topology, &unit).into_iter().map(f64::from).collect();
        let result = ResultMesh {
            name: &name,
            mesh: &mesh,
            texture_coordinates: Some(&layout),
            figures: vec![("residual", &residuals), ("confidence", &known)],
            extras: serde_json::Value::Null,
        };
        for (format, path) in outputs {
            write_whole(&path, &result.bytes(format, None).map_err(|error| error.in_file(&path))?)?;
        }
        say!("{}", serde_json::to_string_pretty(&surface_figures(&scan, &mesh, false))?);
        Ok(())
    }
}
