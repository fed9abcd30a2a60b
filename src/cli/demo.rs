use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use onemesh::demo::{SculptedHead, Sculptor};
use onemesh::evaluate::{
    CorrespondenceCase, CorrespondenceFigures, CorrespondenceOptions, correspondence_figures,
};
use onemesh::formats::{landmarks_json, ply_bytes, write_whole};
use onemesh::mesh::TriangleMesh;
use onemesh::pipeline::Outputs;
use serde_json::json;

use super::parameters::Parameters;
use super::register::{Outcome, register_collection};
use super::summary::Summary;

/// How far the demo's heads depart from the mean, in turn: natural ones and caricatures.
const STRENGTHS: [f64; 3] = [1.0, 1.8, 2.6];

/// Sculpts a collection of heads, registers it, and says how well.
#[derive(Debug, clap::Args)]
pub struct Demo {
    /// The folder to write to: `scans/`, `collection.json` and the results in `result/`
    #[arg(short, long, default_value = "demo", value_name = "FOLDER")]
    output: PathBuf,
    /// How many heads
    #[arg(long, default_value_t = 6, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=999))]
    count: u16,
    /// Other heads for another number
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u64,
    /// Sculpts the collection and leaves it at that
    #[arg(long)]
    scans_only: bool,
    #[command(flatten)]
    parameters: Parameters,
}

impl Demo {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        let settings = self.parameters.for_registration()?;
        let heads = Sculptor::new(self.seed).collection(usize::from(self.count), &STRENGTHS);
        let collection = write_heads(&heads, &self.output)?;
        say!("{} heads are sculpted: {}", heads.len(), collection.display());
        if self.scans_only {
            return Ok(());
        }
        let (results, start) = (self.output.join("result"), Instant::now());
        let outcome = register_collection(&collection, &results, None, Outputs::GLB, &settings)?;
        Summary::of(&results)?.print(&results, start.elapsed());
        let figures = correspondence(&heads, &outcome)?;
        if let Some(distances) = figures.distances {
            say!(
                "the same vertex marks the same point to within {:.2} mm on average ({:.2} median, {:.2} for 95 %)",
                distances.mean_mm,
                distances.median_mm,
                distances.p95_mm
            );
        }
        Ok(())
    }
}

/// Writes heads as a collection with a manifest of its own, so that no head of an earlier demo slips in.
pub fn write_heads(heads: &[SculptedHead], folder: &Path) -> anyhow::Result<PathBuf> {
    for head in heads {
        let own = folder.join("scans").join(&head.name);
        std::fs::create_dir_all(&own).with_context(|| format!("{}: cannot be made", own.display()))?;
        let truth: Vec<[f64; 3]> = head.truth.iter().map(|point| point.to_array()).collect();
        write_whole(own.join("scan.ply"), &ply_bytes(&head.mesh))?;
        write_whole(own.join("landmarks.json"), landmarks_json(&head.landmarks).to_string().as_bytes())?;
        write_whole(own.join("truth.json"), json!(truth).to_string().as_bytes())?;
    }
    let entry = |head: &SculptedHead| {
        let own = format!("scans/{}", head.name);
        json!({ "name": head.name, "mesh": format!("{own}/scan.ply"), "landmarks": format!("{own}/landmarks.json") })
    };
    let manifest = json!({ "scans": heads.iter().map(entry).collect::<Vec<_>>() });
    let path = folder.join("collection.json");
    write_whole(&path, manifest.to_string().as_bytes())?;
    Ok(path)
}

fn correspondence(heads: &[SculptedHead], outcome: &Outcome) -> anyhow::Result<CorrespondenceFigures> {
    let triangles = &outcome.registration.template.triangles;
    let results = outcome.registration.members.iter();
    let meshes = results.map(|positions| TriangleMesh::new(positions.clone(), triangles.clone()));
    let meshes = meshes.collect::<Result<Vec<_>, _>>()?;
    let cases: Vec<CorrespondenceCase> = outcome
        .subjects
        .iter()
        .zip(&meshes)
        .filter_map(|(subject, mesh)| {
            let head = heads.iter().find(|head| head.name == subject.name)?;
            Some(CorrespondenceCase { mesh, scan: &subject.mesh, truth: &head.truth })
        })
        .collect();
    Ok(correspondence_figures(&cases, CorrespondenceOptions::default())?)
}
