use glam::DVec3;

use super::register::Subject;
use crate::mesh::TriangleMesh;
use crate::picture::{Frame, Image, Sheet, Style, View, render};

/// Pixels of a picture's sides.
const SIDE: usize = 400;
/// Most scans on one sheet; more make it larger than people look at.
pub const MOST_ROWS: usize = 32;

/// A scan and its result with the shared triangles' edges, from the front and from the side, all at one scale; each
/// picture with what it is called.
pub type ComparisonRow = Vec<(String, Image)>;

/// A sheet with a row for each scan, and how many more there are.
pub fn comparison_sheet(rows: Vec<ComparisonRow>, scans: usize) -> Image {
    let title = match scans.saturating_sub(rows.len()) {
        0 => "scan and result".to_owned(),
        more => format!("scan and result, and {more} more"),
    };
    let mut sheet = Sheet::new(title);
    rows.into_iter().for_each(|tiles| sheet.row(tiles));
    sheet.image()
}

/// The row of a scan.
pub fn comparison_row(subject: &Subject, result: &TriangleMesh) -> ComparisonRow {
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
