//! Medians of repeated runs, as a markdown table.

mod clients;
mod clock;
mod inverse;
mod kernels;
mod memory;
mod readers;
mod rendering;
mod service;
mod stages;
mod upload;

use std::path::PathBuf;

use anyhow::Context;
use onemesh::demo::{SculptedHead, Sculptor, Settings};
use onemesh::formats::read_mesh;
use onemesh::mesh::{LandmarkSet, TriangleMesh};

use clock::Clock;

/// Triangles of a sculpted scan.
const TRIANGLES: usize = 120_000;
/// Triangles of a large one, whose fit is to take at most twice the time.
const MANY_TRIANGLES: usize = 1_000_000;
/// Scans of a sculpted collection.
const HEADS: usize = 12;

/// Times kernels and stages on this machine, and prints a markdown table of medians.
#[derive(Debug, clap::Args)]
pub struct Bench {
    /// Scans to fit, and collections (folders or manifests) to register, or meshes to invert pictures of; sculpted unless given
    inputs: Vec<PathBuf>,
    /// Fewer repetitions, no template of 40962 vertices, no scan of a million triangles, a smaller sculpted collection
    #[arg(long)]
    quick: bool,
    /// Nothing but so many small registrations through the service's jobs, and the memory in between
    #[arg(long, value_name = "N")]
    soak: Option<usize>,
    /// Nothing but how long answers take while two registrations run and so many clients, 1 to 2000, ask how they stand
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=2000))]
    clients: Option<u64>,
    /// Nothing but the memory that a server takes for an upload of so many triangles
    #[arg(long, value_name = "TRIANGLES", value_parser = clap::value_parser!(u64).range(1000..=10_000_000))]
    upload: Option<u64>,
    /// Leaves a part out; may be repeated
    #[arg(long, value_enum, value_name = "PART")]
    skip: Vec<Part>,
    #[command(flatten)]
    inverse: inverse::Inverse,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// Solves, orderings, factors, nearest points, the parts of an iteration
    Kernels,
    /// Reading a mesh in each format
    Readers,
    /// One scan with the `default` preset
    Fits,
    /// One scan with the `paper` preset
    Paper,
    /// A whole collection, from reading to written results
    Collection,
    /// The sculpted collection through the service's jobs, from upload to results
    Service,
    /// Pictures of sixteen views compared with targets, and the gradient
    Rendering,
}

impl Bench {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        if self.inverse.is_asked() {
            return self.inverse.run(&self.inputs);
        }
        let (collections, scans): (Vec<PathBuf>, Vec<PathBuf>) =
            self.inputs.iter().cloned().partition(|path| is_collection(path));
        let sculpted = self.inputs.is_empty();
        let clock = Clock::new(if self.quick { 1 } else { 5 });
        clock.head();
        if let Some(registrations) = self.soak {
            return service::soak(registrations);
        }
        if let Some(count) = self.clients {
            return clients::clients(count as usize);
        }
        if let Some(triangles) = self.upload {
            return upload::upload(triangles as usize);
        }
        // First, while nothing else has taken memory.
        if self.does(Part::Collection) {
            collections.iter().try_for_each(|path| stages::collection(path))?;
            if sculpted {
                stages::sculpted_collection(if self.quick { 3 } else { HEADS }, TRIANGLES)?;
            }
        }
        if self.does(Part::Service) && sculpted {
            service::collection(if self.quick { 3 } else { HEADS }, TRIANGLES)?;
        }
        let finest = if self.quick { 10242 } else { 40962 };
        for Bed { name, scan, landmarks } in beds(&scans, sculpted)? {
            if self.does(Part::Kernels) {
                kernels::nearest_points(&clock, &name, &scan);
                kernels::inspection(&clock, &name, &scan, landmarks.as_ref());
            }
            if self.does(Part::Readers) {
                readers::readers(&clock, &name, &scan)?;
            }
            if self.does(Part::Fits) {
                stages::fits(&clock, &name, &scan, finest)?;
            }
            if self.does(Part::Paper) {
                stages::paper(&clock, &name, &scan)?;
            }
        }
        if self.does(Part::Fits) && sculpted && !self.quick {
            let large = Bed::sculpted(MANY_TRIANGLES);
            stages::fits(&clock, &large.name, &large.scan, 10242)?;
        }
        if self.does(Part::Kernels) {
            kernels::solves(&clock, finest);
            kernels::iteration(&clock);
            kernels::self_intersection(&clock);
        }
        if self.does(Part::Rendering) {
            rendering::rendering(&clock)?;
        }
        Ok(())
    }

    fn does(&self, part: Part) -> bool {
        !self.skip.contains(&part)
    }
}

fn is_collection(path: &std::path::Path) -> bool {
    path.is_dir() || path.extension().is_some_and(|extension| extension == "json")
}

/// A scan to time work on.
struct Bed {
    name: String,
    scan: TriangleMesh,
    landmarks: Option<LandmarkSet>,
}

impl Bed {
    fn sculpted(triangles: usize) -> Self {
        let SculptedHead { mesh: scan, landmarks, .. } = sculpt(1, triangles).remove(0);
        Self {
            name: format!("sculpted, {} triangles", scan.triangles().len()),
            scan,
            landmarks: Some(landmarks),
        }
    }
}

fn beds(paths: &[PathBuf], sculpted: bool) -> anyhow::Result<Vec<Bed>> {
    if sculpted {
        return Ok(vec![Bed::sculpted(TRIANGLES)]);
    }
    let read = |path: &PathBuf| {
        let scan = read_mesh(path).with_context(|| "a scan to fit")?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let name = format!("{stem}, {} triangles", scan.triangles().len());
        Ok(Bed { name, scan, landmarks: None })
    };
    paths.iter().map(read).collect()
}

/// Sculpted heads of about this many triangles.
fn sculpt(count: usize, triangles: usize) -> Vec<SculptedHead> {
    Sculptor::new(3).with(Settings { triangles, ..Settings::default() }).collection(count, &[1.0, 2.0])
}
