use std::path::PathBuf;

use onemesh::formats::{read_landmarks, read_mesh};
use onemesh::preflight::{Axes, Basis, Inspection, UnitGuess};

use super::findings::print_findings;

/// Says what is known of a scan before it is registered, and what is wrong with it.
#[derive(Debug, clap::Args)]
pub struct Inspect {
    /// The scan: PLY, OBJ, GLB or glTF
    scan: PathBuf,
    /// Its landmarks, in JSON
    #[arg(long, value_name = "FILE")]
    landmarks: Option<PathBuf>,
    /// Prints JSON
    #[arg(long)]
    json: bool,
}

impl Inspect {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        let mesh = read_mesh(&self.scan)?;
        let landmarks = self.landmarks.map(read_landmarks).transpose()?;
        let inspection = Inspection::new(&mesh, landmarks.as_ref());
        if self.json {
            say!("{}", serde_json::to_string_pretty(&inspection)?);
            return Ok(());
        }
        say!("{}", self.scan.display());
        print_figures(&inspection);
        print_findings(&inspection.findings);
        Ok(())
    }
}

fn print_figures(inspection: &Inspection) {
    let Inspection { vertices, triangles, min, max, area, .. } = inspection;
    let extent = [0, 1, 2].map(|axis| max[axis] - min[axis]);
    let [x, y, z] = extent;
    say!("  surface     {vertices} vertices, {triangles} triangles, area {area:.4}");
    say!("  extent      {x:.4} x {y:.4} x {z:.4}, from {min:.4?} to {max:.4?}");
    say!("  unit        {}", unit(&inspection.unit));
    say!("  axes        {}", axes(&inspection.axes));
    say!("  parts       {}", inspection.component_count);
    for part in inspection.components.iter().filter(|_| inspection.component_count > 1) {
        say!("              {} triangles, area {:.4}", part.triangles, part.area);
    }
    say!("  rims        {}", inspection.boundary_loop_count);
    for rim in &inspection.boundary_loops {
        say!("              {} vertices, length {:.4}", rim.vertices, rim.length);
    }
    let outward = match inspection.outward {
        Some(true) => "outwards",
        Some(false) => "inwards",
        None => "not clear: the surface has no inside",
    };
    say!("  normals     {outward}");
    if let Some(landmarks) = &inspection.landmarks {
        let scheme = landmarks.scheme.as_deref().unwrap_or("of an unknown scheme");
        let farthest = landmarks.farthest_from_surface;
        let farthest = farthest.map_or(String::new(), |d| format!(", at most {d:.4} off the surface"));
        say!("  landmarks   {} of {}, {scheme}{farthest}", landmarks.present, landmarks.named);
    }
}

fn unit(guess: &UnitGuess) -> String {
    let sign = guess.unit.sign();
    let from = match guess.basis {
        Basis::Landmarks => format!("{:.4} between the eyes", guess.length),
        Basis::Extent => format!("a guess from {:.4} along the longest side", guess.length),
    };
    if guess.clear { format!("{sign} ({from})") } else { format!("not clear; {sign} is nearest ({from})") }
}

fn axes(axes: &Axes) -> String {
    let ((up, tilt), (facing, turn)) = axes.nearest();
    match axes.basis {
        Basis::Landmarks => {
            format!("up {up} ({tilt:.0} degrees off), facing {facing} ({turn:.0} degrees off)")
        }
        Basis::Extent => format!("up {up}, facing {facing}: a guess"),
    }
}
