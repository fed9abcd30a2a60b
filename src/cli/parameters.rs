use std::path::PathBuf;

use anyhow::Context;
use onemesh::pipeline::{Preset, Settings};

/// Where the parameters come from.
#[derive(Debug, Clone, clap::Args)]
pub struct Parameters {
    /// Where to begin: `default` is ours, `paper` the published method to the letter
    #[arg(long, value_enum, default_value = "default", value_name = "NAME")]
    preset: PresetName,
    /// `off` leaves density adaptation out
    #[arg(long, value_enum, value_name = "off")]
    density: Option<DensityName>,
    /// Vertices of the template: 642, 2562, 10242 or 40962
    #[arg(long, default_value_t = 10242, value_name = "N")]
    vertices: usize,
    /// Parameters from a JSON file in place of a preset: a manifest, or its `settings`
    #[arg(long, value_name = "FILE", conflicts_with_all = ["preset", "vertices"])]
    settings: Option<PathBuf>,
    /// Sets one parameter by its dotted name, as in `groupwise.rounds=3` or `fit.levels.0.lambda=6`; may be repeated
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// How much a landmark counts where the template's are averaged, as in `30=10`; 1 unless said; may be repeated
    #[arg(long, value_name = "NAME=WEIGHT", value_parser = weight)]
    landmark_weight: Vec<(String, f64)>,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum PresetName {
    Default,
    Paper,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum DensityName {
    Off,
}

impl From<PresetName> for Preset {
    fn from(name: PresetName) -> Self {
        match name {
            PresetName::Default => Self::Default,
            PresetName::Paper => Self::Paper,
        }
    }
}

impl Parameters {
    /// The parameters for a whole registration.
    pub fn for_registration(&self) -> anyhow::Result<Settings> {
        self.over(Settings::preset)
    }

    /// The parameters for one scan, whose `fit` goes up to the last level.
    pub fn for_fit(&self) -> anyhow::Result<Settings> {
        self.over(Settings::for_fit)
    }

    fn over<E>(&self, preset: impl Fn(Preset, usize) -> Result<Settings, E>) -> anyhow::Result<Settings>
    where
        E: std::error::Error + Send + Sync + 'static,
    {
        let mut settings = match &self.settings {
            Some(file) => from_file(file)?,
            None => preset(self.preset.into(), self.vertices).context("--vertices")?,
        };
        if self.density.is_some() {
            settings = settings.without_density();
        }
        self.assign(settings)
    }

    /// The parameters that a frozen collection was registered with, but for those that are set by name.
    pub fn over_frozen(&self, settings: Settings) -> anyhow::Result<Settings> {
        self.assign(settings)
    }

    fn assign(&self, mut settings: Settings) -> anyhow::Result<Settings> {
        for assignment in &self.set {
            let (name, value) = assignment
                .split_once('=')
                .with_context(|| format!("--set {assignment}: write it as NAME=VALUE"))?;
            settings.set(name, value).with_context(|| format!("--set {assignment}"))?;
        }
        settings.resample.weights.extend(self.landmark_weight.iter().cloned());
        Ok(settings)
    }
}

fn weight(text: &str) -> Result<(String, f64), &'static str> {
    // Landmarks may have any name.
    let (name, weight) = text.rsplit_once('=').ok_or("write it as NAME=WEIGHT")?;
    let weight = weight.parse().ok().filter(|weight| (0.0..=1e9).contains(weight));
    Ok((name.to_owned(), weight.ok_or("a weight is a number from 0 to 1e9")?))
}

fn from_file(file: &PathBuf) -> anyhow::Result<Settings> {
    let bytes = std::fs::read(file).with_context(|| format!("{}: cannot be read", file.display()))?;
    Settings::from_json(&bytes).with_context(|| file.display().to_string())
}
