//! The paper's comparison: inversions with density adaptation and without it, on scenes whose shape is known.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context;
use onemesh::demo::{Figure, Sculptor, Settings};
use onemesh::evaluate::surface_figures;
use onemesh::formats::read_mesh;
use onemesh::mesh::TriangleMesh;
use onemesh::pipeline::{
    CaptureSettings, InvertPreset, InvertSettings, Shown, Views, What, capture, invert, studio_light,
};
use onemesh::render::{AdapterChoice, open};

/// Cells along the longest side of a figure, and triangles of a head.
const CELLS: usize = 120;
const TRIANGLES: usize = 40_000;

/// What of the comparison is run.
#[derive(Debug, Clone, clap::Args)]
pub struct Inverse {
    /// Nothing but inversions of pictures of the inputs, sculpted figures and heads unless given: with density adaptation,
    /// without it, and with the `default` preset
    #[arg(long)]
    inverse: bool,
    /// Width and height of the pictures
    #[arg(long, default_value_t = 512, value_name = "PIXELS", requires = "inverse")]
    size: u32,
    /// How many pictures
    #[arg(long, default_value_t = 16, value_name = "N", requires = "inverse")]
    views: usize,
    /// Vertices of the spheres
    #[arg(long, default_values_t = [2562, 10242], value_name = "N", requires = "inverse")]
    spheres: Vec<usize>,
    /// The adapter that draws: `best`, `fastest`, `reference` or part of a name
    #[arg(long, default_value = "best", value_name = "NAME", requires = "inverse")]
    adapter: String,
    /// Iterations of the `paper` preset in place of its own
    #[arg(long, value_name = "N", requires = "inverse")]
    iterations: Option<usize>,
    /// Sets one parameter of every run by its dotted name; may be repeated
    #[arg(long, value_name = "NAME=VALUE", requires = "inverse")]
    set: Vec<String>,
    /// Which ones
    #[arg(long, value_enum, default_values_t = [Way::On, Way::Off, Way::Default], value_name = "WAY", requires = "inverse")]
    ways: Vec<Way>,
}

/// How a scene is inverted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Way {
    /// The `paper` preset
    On,
    /// The `paper` preset without density adaptation
    Off,
    /// The `default` preset
    Default,
    /// The Laplacian energy on plain positions
    Laplacian,
    /// The bi-Laplacian energy on plain positions
    BiLaplacian,
}

impl Way {
    fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }
}

impl Inverse {
    /// Whether it is asked for.
    pub fn is_asked(&self) -> bool {
        self.inverse
    }

    /// Runs it on meshes, or the program's own scenes.
    pub fn run(&self, inputs: &[PathBuf]) -> anyhow::Result<()> {
        say!(
            "| scene | vertices | way | chamfer | normal | top 5 % distance | top 5 % normal | overlap | MAE | s |"
        );
        say!("|---|---|---|---|---|---|---|---|---|---|");
        let mut rows = Vec::new();
        for (name, mesh) in scenes(inputs)? {
            rows.extend(self.scene(&name, &mesh)?);
        }
        [Way::On, Way::Default].into_iter().for_each(|way| compare(&rows, way));
        Ok(())
    }

    fn scene(&self, name: &str, mesh: &TriangleMesh) -> anyhow::Result<Vec<Row>> {
        let mut rows = Vec::new();
        let mut renderer = open(&self.adapter.parse::<AdapterChoice>()?)?;
        let taken = CaptureSettings { views: self.views, size: self.size, shown: Shown::Shaded, samples: 4 };
        let views = Views::new(capture(mesh, &taken, &mut *renderer, &())?, What::Shaded)?;
        for &vertices in &self.spheres {
            for &way in &self.ways {
                let settings = self.settings(way, vertices)?;
                let start = Instant::now();
                let found = invert(&views, &settings, &mut *renderer, &())?;
                let seconds = start.elapsed().as_secs_f64();
                let figures = surface_figures(mesh, &found.mesh, false);
                say!(
                    "| {name} | {vertices} | {} | {:.3e} | {:.4} | {:.3e} | {:.4} | {:.4} | {:.5} | {seconds:.0} |",
                    way.name(),
                    figures.chamfer,
                    figures.normal,
                    figures.top5[0],
                    figures.top5[1],
                    found.report.overlap,
                    found.report.mae,
                );
                let figures = [figures.chamfer, figures.normal, figures.top5[0], figures.top5[1]];
                rows.push(Row { way, figures, seconds });
            }
        }
        Ok(rows)
    }

    fn settings(&self, way: Way, vertices: usize) -> anyhow::Result<InvertSettings> {
        let preset = if way == Way::Default { InvertPreset::Default } else { InvertPreset::Paper };
        let mut settings = InvertSettings::preset(preset, vertices).context("--spheres")?;
        settings.light = studio_light().0.to_vec();
        settings = match way {
            Way::On | Way::Default => settings,
            Way::Off => settings.without_density(),
            Way::Laplacian => settings.smoothed(false),
            Way::BiLaplacian => settings.smoothed(true),
        };
        for assignment in &self.set {
            let (name, value) = assignment.split_once('=').context("--set: write it as NAME=VALUE")?;
            settings.set(name, value).with_context(|| format!("--set {assignment}"))?;
        }
        for level in &mut settings.levels {
            level.size = level.size.min(self.size);
            if let Some(iterations) = self.iterations.filter(|_| preset == InvertPreset::Paper) {
                level.iterations = iterations;
            }
        }
        Ok(settings)
    }
}

/// What was measured of one inversion.
struct Row {
    way: Way,
    figures: [f64; 4],
    seconds: f64,
}

/// How many times as large the figures of a way are as those of the `paper` preset without density adaptation, which comes
/// in the same order of scenes: geometric means.
fn compare(rows: &[Row], way: Way) {
    let of = |way: Way| rows.iter().filter(move |row| row.way == way);
    let pairs: Vec<(&Row, &Row)> = of(way).zip(of(Way::Off)).collect();
    if pairs.is_empty() || of(way).count() != of(Way::Off).count() {
        return;
    }
    let mean = |ratio: &dyn Fn(&Row, &Row) -> f64| {
        (pairs.iter().map(|(one, other)| ratio(one, other).ln()).sum::<f64>() / pairs.len() as f64).exp()
    };
    let [chamfer, normal, distance, top_normal] =
        [0, 1, 2, 3].map(|k| mean(&|one: &Row, other: &Row| one.figures[k] / other.figures[k]));
    let seconds = mean(&|one, other| one.seconds / other.seconds);
    say!(
        "| {} scenes | | {} / off | {chamfer:.3} | {normal:.3} | {distance:.3} | {top_normal:.3} | | | {seconds:.2} |",
        pairs.len(),
        way.name(),
    );
}

fn scenes(inputs: &[PathBuf]) -> anyhow::Result<Vec<(String, TriangleMesh)>> {
    if inputs.is_empty() {
        let figures = Figure::all().into_iter().map(|figure| (figure.name.to_owned(), figure.mesh(CELLS)));
        let settings = Settings { triangles: TRIANGLES, open_neck: false, ..Settings::default() };
        let heads = Sculptor::new(3).with(settings).collection(2, &[1.0, 2.0]);
        return Ok(figures.chain(heads.into_iter().map(|head| (head.name, head.mesh))).collect());
    }
    let read = |path: &PathBuf| {
        let name = path.components().rev().take(2).map(|part| part.as_os_str().to_string_lossy());
        let name: Vec<_> = name.collect();
        Ok((name.into_iter().rev().collect::<Vec<_>>().join("/"), read_mesh(path)?))
    };
    inputs.iter().map(read).collect()
}
