use std::path::PathBuf;

use anyhow::Context;
use onemesh::formats::{Capture, write_whole};
use onemesh::pipeline::{Inversion, InvertPreset, InvertSettings, Views, What, invert};
use onemesh::render::{AdapterChoice, open};

use super::formats::Formats;
use super::progress::ProgressBars;

/// Makes a mesh from several pictures with cameras.
#[derive(Debug, clap::Args)]
pub struct Invert {
    /// The folder with pictures and cameras, or the cameras' file: transforms.json, a COLMAP model, a Metashape XML
    capture: PathBuf,
    /// The GLB, OBJ or PLY to write; report, contact sheet and residual pictures come beside it
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    formats: Formats,
    /// What the pictures show; found out unless given
    #[arg(long, value_enum, value_name = "WHAT")]
    what: Option<WhatName>,
    /// Where to begin: `default` is ours, `paper` the published method, the others what it used for its scene of that name
    #[arg(long, value_enum, default_value = "default", value_name = "NAME")]
    preset: PresetName,
    /// `off` leaves density adaptation out
    #[arg(long, value_enum, value_name = "off")]
    density: Option<DensityName>,
    /// Plain positions under a smoothness energy in place of the diffusion re-parameterization, to compare with
    #[arg(long, value_enum, value_name = "ENERGY")]
    smooth: Option<SmoothName>,
    /// Vertices of the mesh: 642, 2562, 10242 or 40962
    #[arg(long, default_value_t = 10242, value_name = "N")]
    vertices: usize,
    /// Parameters from a JSON file in place of a preset: an earlier report, or its `settings`
    #[arg(long, value_name = "FILE", conflicts_with_all = ["preset", "vertices"])]
    settings: Option<PathBuf>,
    /// Sets one parameter by its dotted name, as in `levels.0.iterations=500`; may be repeated
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// What draws: `best`, `fastest`, `reference` (this program, on the processor), or part of an adapter's name
    #[arg(long, default_value = "best", value_name = "NAME")]
    adapter: String,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum WhatName {
    Silhouette,
    Normal,
    WorldNormal,
    CameraNormal,
    Shaded,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum PresetName {
    Default,
    Paper,
    TShirt,
    Suzanne,
    Bunny,
    Cranium,
    Plank,
    Bob,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum DensityName {
    Off,
}

#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
enum SmoothName {
    Laplacian,
    BiLaplacian,
}

impl From<WhatName> for What {
    fn from(name: WhatName) -> Self {
        match name {
            WhatName::Silhouette => Self::Silhouette,
            WhatName::Normal => Self::Normal,
            WhatName::WorldNormal => Self::WorldNormal,
            WhatName::CameraNormal => Self::CameraNormal,
            WhatName::Shaded => Self::Shaded,
        }
    }
}

impl From<PresetName> for InvertPreset {
    fn from(name: PresetName) -> Self {
        match name {
            PresetName::Default => Self::Default,
            PresetName::Paper => Self::Paper,
            PresetName::TShirt => Self::TShirt,
            PresetName::Suzanne => Self::Suzanne,
            PresetName::Bunny => Self::Bunny,
            PresetName::Cranium => Self::Cranium,
            PresetName::Plank => Self::Plank,
            PresetName::Bob => Self::Bob,
        }
    }
}

impl Invert {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        let settings = self.parameters()?;
        let outputs = self.formats.of_file(&self.output)?;
        let capture = Capture::open(&self.capture)?;
        let mut renderer = open(&self.adapter.parse::<AdapterChoice>()?)?;
        let bars = ProgressBars::new();
        let views = read(&capture, &settings, &bars)?;
        remark!("{} views, drawn by {}", views.photographs.len(), renderer.adapter());
        let found = invert(&views, &settings, &mut *renderer, &bars)
            .with_context(|| capture.cameras.display().to_string())?;
        let name = self.output.file_stem().map_or("mesh".into(), |stem| stem.to_string_lossy());
        for (format, path) in outputs {
            write_whole(&path, &found.bytes(&name, format).map_err(|error| error.in_file(&path))?)?;
        }
        self.write_evidence(&found)?;
        summary(&found);
        Ok(())
    }

    fn parameters(&self) -> anyhow::Result<InvertSettings> {
        let mut settings = match &self.settings {
            Some(file) => {
                let bytes =
                    std::fs::read(file).with_context(|| format!("{}: cannot be read", file.display()))?;
                InvertSettings::from_json(&bytes).with_context(|| file.display().to_string())?
            }
            None => InvertSettings::preset(self.preset.into(), self.vertices).context("--vertices")?,
        };
        if self.density.is_some() {
            settings = settings.without_density();
        }
        if let Some(smooth) = self.smooth {
            settings = settings.smoothed(smooth == SmoothName::BiLaplacian);
        }
        if let Some(what) = self.what {
            settings.what = what.into();
        }
        for assignment in &self.set {
            let (name, value) = assignment
                .split_once('=')
                .with_context(|| format!("--set {assignment}: write it as NAME=VALUE"))?;
            settings.set(name, value).with_context(|| format!("--set {assignment}"))?;
        }
        Ok(settings)
    }

    /// The report, the contact sheet and a picture of each view's difference.
    fn write_evidence(&self, found: &Inversion) -> anyhow::Result<()> {
        let beside = |end: &str| self.output.with_extension(end);
        write_whole(beside("report.json"), found.report_json().as_bytes())?;
        write_whole(beside("sheet.png"), &found.sheet().png_bytes()?)?;
        let folder = beside("residuals");
        std::fs::create_dir_all(&folder).with_context(|| format!("{}: cannot be made", folder.display()))?;
        for (name, picture) in found.residuals() {
            write_whole(folder.join(name), &picture.png_bytes()?)?;
        }
        Ok(())
    }
}

fn read(capture: &Capture, settings: &InvertSettings, bars: &ProgressBars) -> anyhow::Result<Views> {
    let spinner = bars.spinner("reading the pictures");
    let views = Views::of_capture(capture, settings, bars);
    spinner.finish_and_clear();
    views.with_context(|| capture.cameras.display().to_string())
}

fn summary(found: &Inversion) {
    let report = &found.report;
    say!(
        "{} vertices; silhouettes overlap by {:.2} %, pixels differ by {:.4} on average; {:.1} s",
        found.mesh.positions().len(),
        100.0 * report.overlap,
        report.mae,
        report.seconds.values().sum::<f64>()
    );
    for warning in &report.warnings {
        say!("- {warning}");
    }
}
