use glam::DVec3;
use rayon::prelude::*;

use super::register::Subject;
use crate::mesh::TriangleMesh;
use crate::picture::{Frame, Image, Sheet, Style, View, render};

/// Pixels of a picture's sides.
const SIDE: usize = 400;
/// Most scans on one sheet; more make it larger than people look at.
const MOST: usize = 32;

/// A sheet with a row for each scan: the scan and its result with the shared triangles' edges, from the front and from
/// the side, all of a row at one scale.
pub fn comparison_sheet(subjects: &[Subject], results: &[TriangleMesh]) -> Image {
    let pairs: Vec<_> = subjects.iter().zip(results).take(MOST).collect();
    let title = match subjects.len() - pairs.len() {
        0 => "scan and result".to_owned(),
        more => format!("scan and result, and {more} more"),
    };
    let rows: Vec<_> = pairs.into_par_iter().map(|(subject, result)| row(subject, result)).collect();
    let mut sheet = Sheet::new(title);
    rows.into_iter().for_each(|tiles| sheet.row(tiles));
    sheet.image()
}

fn row(subject: &Subject, result: &TriangleMesh) -> Vec<(String, Image)> {
    let frame = frame(&subject.mesh);
    let picture = |mesh: &TriangleMesh, view: View, style: &Style| {
        render(mesh, &view.sized(SIDE, SIDE).framed(frame), style)
    };
    let (scan, smooth, edges) = (&subject.mesh, Style::smooth(), Style::wireframe());
    vec![
        (subject.name.clone(), picture(scan, View::front(), &smooth)),
        ("result".to_owned(), picture(result, View::front(), &smooth)),
        ("its triangles".to_owned(), picture(result, View::front(), &edges)),
        ("scan".to_owned(), picture(scan, View::side(), &smooth)),
        ("its triangles".to_owned(), picture(result, View::side(), &edges)),
    ]
}

/// The frame that just holds a scan's bounding box from the front and from the side.
fn frame(scan: &TriangleMesh) -> Frame {
    let low = scan.positions().iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = scan.positions().iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    Frame { radius: (high - low).max_element() / 2.0, ..Frame::around(scan) }
}
