use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use onemesh::mesh::TriangleMesh;
use onemesh::pipeline::{Outputs, Preset, Settings, fit_scan};

use super::clock::{Clock, row};
use super::{memory, sculpt};
use crate::cli::demo::write_heads;
use crate::cli::register::register_collection;

/// One scan with the `default` preset on each template.
pub fn fits(clock: &Clock, name: &str, scan: &TriangleMesh, finest: usize) -> anyhow::Result<()> {
    for vertices in [2562, 10242, 40962].into_iter().filter(|&vertices| vertices <= finest) {
        fit(clock, name, scan, Preset::Default, vertices)?;
    }
    Ok(())
}

/// One scan with the `paper` preset.
pub fn paper(clock: &Clock, name: &str, scan: &TriangleMesh) -> anyhow::Result<()> {
    fit(clock, name, scan, Preset::Paper, 10242)
}

fn fit(
    clock: &Clock,
    name: &str,
    scan: &TriangleMesh,
    preset: Preset,
    vertices: usize,
) -> anyhow::Result<()> {
    let settings = Settings::for_fit(preset, vertices)?;
    let preset = format!("{preset:?}").to_lowercase();
    clock.stage(&format!("fit, `{preset}`, {vertices} vertices ({name})"), || {
        fit_scan(name, scan, &settings.fit, &())?;
        Ok(())
    })
}

/// A folder that is there while it is used.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> anyhow::Result<Self> {
        let path = std::env::temp_dir().join(format!("onemesh-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).with_context(|| path.display().to_string())?;
        Ok(Self(path))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // Left behind at worst, among other temporary files.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Sculpted heads through all stages.
pub fn sculpted_collection(count: usize, triangles: usize) -> anyhow::Result<()> {
    let folder = Scratch::new("heads")?;
    let path = write_heads(&sculpt(count, triangles), &folder.0)?;
    collection(&path)
}

/// A collection through all stages, once: from reading to written results.
pub fn collection(path: &Path) -> anyhow::Result<()> {
    let output = Scratch::new("bench")?;
    let settings = Settings::preset(Preset::Default, 10242)?;
    memory::forget_peak();
    let start = Instant::now();
    let outcome = register_collection(path, &output.0, None, Outputs::GLB, &settings)?;
    let elapsed = start.elapsed();
    let peak = memory::peak().map_or("memory unknown".to_owned(), |peak| format!("{peak:.0} MiB at most"));
    row(&format!("{} scans, read to written, 10242 vertices ({peak})", outcome.subjects.len()), &[elapsed]);
    for (stage, seconds) in &outcome.report.seconds {
        row(&format!("- of it {stage}"), &[std::time::Duration::from_secs_f64(*seconds)]);
    }
    Ok(())
}
