use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use glam::DVec3;
use onemesh::evaluate::{
    CorrespondenceCase, CorrespondenceOptions, SurfaceFigures, correspondence_figures,
    dense_points_from_json, dense_points_from_npy, surface_figures,
};
use onemesh::formats::read_mesh;
use onemesh::mesh::TriangleMesh;
use serde_json::{Map, Value, json};

/// Says how good results are, as JSON: how closely meshes lie on their scans, or how well they correspond.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct Evaluate {
    #[command(subcommand)]
    what: Option<What>,
    /// Scans and meshes in turn: SCAN MESH [SCAN MESH ...]
    #[arg(value_name = "SCAN MESH", required = true)]
    files: Vec<PathBuf>,
    /// Count from scan to mesh only, since the mesh may rightly go on past the scan's rim
    #[arg(long)]
    open: bool,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    Correspondence(Correspondence),
}

/// How well the same point of the shared mesh marks the same anatomical point on every scan.
#[derive(Debug, clap::Args)]
struct Correspondence {
    /// Holds NAME/scan.ply and NAME/truth.npy (or truth.json): points that correspond, in their order
    folder: PathBuf,
    /// The registered meshes: NAME=MESH
    #[arg(value_name = "NAME=MESH", required = true)]
    meshes: Vec<String>,
    /// Counts only the first N true points
    #[arg(long, value_name = "N")]
    first: Option<usize>,
    /// Millimetres to a unit of the scans
    #[arg(long, default_value_t = 10.0, value_name = "MM")]
    millimetres: f64,
}

impl Evaluate {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        let figures = match self.what {
            Some(What::Correspondence(correspondence)) => correspondence.figures()?,
            None => surface(&self.files, self.open)?,
        };
        say!("{}", serde_json::to_string_pretty(&figures)?);
        Ok(())
    }
}

fn surface(files: &[PathBuf], open: bool) -> anyhow::Result<Value> {
    let (pairs, odd) = files.as_chunks::<2>();
    if let [scan] = odd {
        anyhow::bail!("{}: is a scan without a mesh: give scans and meshes in turn", scan.display());
    }
    let mut meshes = Map::new();
    let mut rows = Vec::new();
    for [scan, mesh] in pairs {
        let figures = surface_figures(&read_mesh(scan)?, &read_mesh(mesh)?, open);
        meshes.insert(mesh.display().to_string(), serde_json::to_value(&figures)?);
        rows.push(figures);
    }
    let mean = |of: fn(&SurfaceFigures) -> f64| rows.iter().map(of).sum::<f64>() / rows.len() as f64;
    Ok(json!({
        "meshes": meshes,
        "mean_chamfer": mean(|f| f.chamfer),
        "mean_normal": mean(|f| f.normal),
        "mean_hausdorff": mean(|f| f.hausdorff),
        "mean_flipped": mean(|f| f.flipped),
        "mean_sliver": mean(|f| f.sliver),
        "mean_top20": [mean(|f| f.top20[0]), mean(|f| f.top20[1])],
        "mean_top5": [mean(|f| f.top5[0]), mean(|f| f.top5[1])],
    }))
}

/// A face as it is read.
struct Face {
    mesh: TriangleMesh,
    scan: TriangleMesh,
    truth: Vec<DVec3>,
}

impl Correspondence {
    fn figures(&self) -> anyhow::Result<Value> {
        ensure!(self.millimetres > 0.0, "--millimetres {}: must be positive", self.millimetres);
        let faces = self.meshes.iter().map(|pair| self.face(pair)).collect::<anyhow::Result<Vec<_>>>()?;
        let cases: Vec<CorrespondenceCase> =
            faces.iter().map(|Face { mesh, scan, truth }| CorrespondenceCase { mesh, scan, truth }).collect();
        let options =
            CorrespondenceOptions { millimetres: self.millimetres, ..CorrespondenceOptions::default() };
        let figures =
            correspondence_figures(&cases, options).with_context(|| self.folder.display().to_string())?;
        Ok(serde_json::to_value(figures)?)
    }

    fn face(&self, pair: &str) -> anyhow::Result<Face> {
        let (name, mesh) = pair.split_once('=').with_context(|| format!("{pair}: write it as NAME=MESH"))?;
        let folder = self.folder.join(name);
        let mut truth = read_truth(&folder)?;
        truth.truncate(self.first.unwrap_or(usize::MAX));
        Ok(Face { mesh: read_mesh(mesh)?, scan: read_mesh(folder.join("scan.ply"))?, truth })
    }
}

/// The true points in a scan's folder.
fn read_truth(folder: &Path) -> anyhow::Result<Vec<DVec3>> {
    let npy = folder.join("truth.npy");
    let file = if npy.exists() { npy } else { folder.join("truth.json") };
    let bytes = std::fs::read(&file).with_context(|| format!("{}: cannot be read", file.display()))?;
    let is_json = file.extension().is_some_and(|extension| extension == "json");
    let points = if is_json { dense_points_from_json(&bytes) } else { dense_points_from_npy(&bytes) };
    points.with_context(|| file.display().to_string())
}
