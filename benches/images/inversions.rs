//! Makes the README's pictures of inversions: a figure without and with density adaptation and by the `default` preset, and
//! a contact sheet.
//!
//! ```sh
//! cargo run --release --example inversions
//! ```

use std::path::Path;

use onemesh::demo::Figure;
use onemesh::mesh::TriangleMesh;
use onemesh::picture::{Frame, Image, Sheet, Style, View, render};
use onemesh::pipeline::{
    CaptureSettings, InvertPreset, InvertSettings, Shown, Views, What, capture, invert, studio_light,
};
use onemesh::render::{AdapterChoice, open};

const DENSITY: &str = "benches/images/inversions.png";
const CONTACT: &str = "benches/images/inversion_sheet.png";

/// Pixels of a tile's sides, and of the pictures that are inverted.
const SIDE: usize = 300;
const SIZE: u32 = 128;
const VERTICES: usize = 2562;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let truth = Figure::hare().mesh(120);
    let mut renderer = open(&AdapterChoice::Fastest)?;
    let taken = CaptureSettings { views: 16, size: SIZE, shown: Shown::Shaded, samples: 4 };
    let views = Views::new(capture(&truth, &taken, &mut *renderer, &())?, What::Shaded)?;
    let mut sheet = Sheet::new("a sphere of 2562 vertices to sixteen pictures");
    sheet.row(row("the figure", &truth, &truth, &Style::smooth()));
    let paper = InvertSettings::preset(InvertPreset::Paper, VERTICES)?;
    let default = InvertSettings::preset(InvertPreset::Default, VERTICES)?;
    let ways =
        [("density off", paper.clone().without_density()), ("density on", paper), ("default", default)];
    for (title, mut settings) in ways {
        settings.light = studio_light().0.to_vec();
        settings.levels.iter_mut().for_each(|level| level.size = SIZE);
        let found = invert(&views, &settings, &mut *renderer, &())?;
        sheet.row(row(title, &found.mesh, &truth, &Style::wireframe()));
        if title == "default" {
            found.sheet().write_png(Path::new(CONTACT))?;
        }
    }
    sheet.image().write_png(Path::new(DENSITY))?;
    println!("{DENSITY}\n{CONTACT}");
    Ok(())
}

/// From the front, the side and behind, at the figure's scale.
fn row(title: &str, mesh: &TriangleMesh, truth: &TriangleMesh, style: &Style) -> Vec<(String, Image)> {
    let frame = Frame::around(truth);
    let views = [View::front(), View::new(60.0), View::new(180.0)];
    let picture = |view: View| render(mesh, &view.sized(SIDE, SIDE).framed(frame), style);
    views.into_iter().map(|view| (title.to_owned(), picture(view))).collect()
}
