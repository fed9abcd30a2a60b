use std::path::PathBuf;

use anyhow::ensure;
use onemesh::formats::{Encoding, read_mesh, write_capture};
use onemesh::pipeline::{CaptureSettings, Shown, capture};
use onemesh::render::{AdapterChoice, open};

use super::progress::ProgressBars;

/// Takes pictures of a mesh from all sides, as `invert` reads them.
#[derive(Debug, clap::Args)]
pub struct Capture {
    /// The mesh: OBJ, PLY, STL, glTF or GLB
    mesh: PathBuf,
    /// The folder to write to: `transforms.json`, and PNGs with opacity in `images/`
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// How many pictures
    #[arg(long, default_value_t = 16, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=10_000))]
    views: u16,
    /// Width and height in pixels
    #[arg(long, default_value_t = 512, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(8..=2048))]
    size: u32,
    /// What they show
    #[arg(long, value_enum, default_value = "shaded", value_name = "WHAT")]
    what: Shows,
    /// Samples along a pixel's side: 1, 2, 4 or 8
    #[arg(long, default_value_t = 4, value_name = "N")]
    samples: u32,
    /// What draws: `best`, `fastest`, `reference` (this program, on the processor), or part of an adapter's name
    #[arg(long, default_value = "best", value_name = "NAME")]
    adapter: String,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Shows {
    /// White on nothing
    Silhouette,
    /// Normals as colours, in the world's axes
    Normal,
    /// Normals in the camera's axes: x right, y up, z towards the viewer
    CameraNormal,
    /// Grey under a soft light
    Shaded,
}

impl From<Shows> for Shown {
    fn from(shows: Shows) -> Self {
        match shows {
            Shows::Silhouette => Self::Silhouette,
            Shows::Normal => Self::WorldNormal,
            Shows::CameraNormal => Self::CameraNormal,
            Shows::Shaded => Self::Shaded,
        }
    }
}

impl Capture {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        ensure!([1, 2, 4, 8].contains(&self.samples), "--samples {}: choose 1, 2, 4 or 8", self.samples);
        let mesh = read_mesh(&self.mesh)?;
        let mut renderer = open(&self.adapter.parse::<AdapterChoice>()?)?;
        let shown = self.what.into();
        let settings =
            CaptureSettings { views: self.views.into(), size: self.size, shown, samples: self.samples };
        let photographs = capture(&mesh, &settings, &mut *renderer, &ProgressBars::new())?;
        let encoding = if shown == Shown::Shaded { Encoding::Srgb } else { Encoding::Linear };
        write_capture(&self.output, &photographs, encoding)?;
        say!("{} pictures: {}", photographs.len(), self.output.display());
        Ok(())
    }
}
