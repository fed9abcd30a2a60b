use glam::DVec3;

use super::header::{Element, Header, Kind, Scalar};
use crate::formats::error::Fault;
use crate::formats::geometry::{Fan, Geometry};

/// Rows of numbers in one of PLY's encodings. Problems are sentences without a place: the caller knows the row.
pub(super) trait Rows {
    /// Bytes not read yet.
    fn left(&self) -> usize;
    /// The fewest bytes that a number takes.
    fn least(&self, scalar: Scalar) -> usize;
    fn start_row(&mut self) -> Result<(), String>;
    fn number(&mut self, scalar: Scalar) -> Result<f64, String>;
    /// A number of an integer type.
    fn integer(&mut self, scalar: Scalar) -> Result<i64, String>;
    /// Passes over `count` numbers.
    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<(), String>;
    fn end_row(&mut self) -> Result<(), String>;
    /// Where the current row is in the file, for a message.
    fn place(&self) -> String;
}

/// Reads the elements in the order of their rows until both vertices and faces are there.
pub(super) fn read(header: &Header, mut rows: impl Rows) -> Result<Geometry, Fault> {
    let vertices = header.element("vertex")?;
    let faces = header.element("face")?;
    let axes = axes(vertices)?;
    let corners = corners(faces)?;
    let mut geometry = Geometry::default();
    let mut wanted = 2;
    for element in header.elements.iter().filter(|element| !element.properties.is_empty()) {
        check_room(element, &rows)?;
        if std::ptr::eq(element, vertices) {
            geometry.positions = read_vertices(element, axes, &mut rows)?;
            wanted -= 1;
        } else if std::ptr::eq(element, faces) {
            geometry.triangles = read_faces(element, corners, vertices.count, &mut rows)?;
            wanted -= 1;
        } else {
            each_row(element, &mut rows, |_, property, rows| skip(property, rows))?;
        }
        if wanted == 0 {
            break;
        }
    }
    Ok(geometry)
}

/// Where `x`, `y` and `z` stand among the vertex's properties.
fn axes(vertices: &Element) -> Result<[usize; 3], Fault> {
    let mut found = [0; 3];
    for (axis, name) in found.iter_mut().zip(["x", "y", "z"]) {
        let position = vertices.position(&[name]);
        let single = position.filter(|&at| matches!(vertices.properties[at].kind, Kind::One(_)));
        *axis = single.ok_or_else(|| {
            Fault::at(
                "the header",
                format!("the element `vertex` has no property `{name}` that is one number"),
            )
        })?;
    }
    Ok(found)
}

/// Where the list of a polygon's vertices stands among the face's properties.
fn corners(faces: &Element) -> Result<usize, Fault> {
    let position = faces.position(&["vertex_indices", "vertex_index"]);
    let list = position
        .filter(|&at| matches!(faces.properties[at].kind, Kind::List { item, .. } if item.is_integer()));
    let problem = "the element `face` has no property `vertex_indices` that is a list of integers";
    list.ok_or_else(|| Fault::at("the header", problem))
}

/// Holds the declared number of rows against the bytes that are there, before memory is taken for them.
fn check_room(element: &Element, rows: &impl Rows) -> Result<(), Fault> {
    let least = |kind: Kind| match kind {
        Kind::One(scalar) | Kind::List { count: scalar, .. } => rows.least(scalar) as u64,
    };
    let row: u64 = element.properties.iter().map(|property| least(property.kind)).sum();
    // The last word of a text needs no blank after it.
    let left = rows.left() as u64 + 1;
    if element.count.saturating_mul(row) <= left {
        return Ok(());
    }
    let problem = format!(
        "{} rows of at least {row} bytes are declared, but only {} bytes follow: the file is cut short or damaged",
        element.count,
        rows.left()
    );
    Err(Fault::at(format_args!("element `{}`", element.name), problem))
}

/// Visits each property of each row in turn.
fn each_row<R: Rows>(
    element: &Element,
    rows: &mut R,
    mut visit: impl FnMut(usize, Kind, &mut R) -> Result<(), String>,
) -> Result<(), Fault> {
    for row in 0..element.count {
        read_row(element, rows, &mut visit)
            .map_err(|problem| Fault::at(format_args!("{} {row}{}", element.name, rows.place()), problem))?;
    }
    Ok(())
}

fn read_row<R: Rows>(
    element: &Element,
    rows: &mut R,
    visit: &mut impl FnMut(usize, Kind, &mut R) -> Result<(), String>,
) -> Result<(), String> {
    rows.start_row()?;
    for (at, property) in element.properties.iter().enumerate() {
        visit(at, property.kind, rows)?;
    }
    rows.end_row()
}

fn skip(kind: Kind, rows: &mut impl Rows) -> Result<(), String> {
    match kind {
        Kind::One(scalar) => rows.skip(scalar, 1),
        Kind::List { count, item } => {
            let items = list_length(count, rows)?;
            rows.skip(item, items)
        }
    }
}

fn list_length(count: Scalar, rows: &mut impl Rows) -> Result<u64, String> {
    let items = rows.integer(count)?;
    u64::try_from(items).map_err(|_| format!("a list has {items} items: a count cannot be negative"))
}

fn read_vertices(element: &Element, axes: [usize; 3], rows: &mut impl Rows) -> Result<Vec<DVec3>, Fault> {
    let mut positions = Vec::with_capacity(element.count as usize);
    let mut position = DVec3::ZERO;
    let last = element.properties.len() - 1;
    each_row(element, rows, |at, kind, rows| {
        match (axes.iter().position(|&axis| axis == at), kind) {
            (Some(axis), Kind::One(scalar)) => position[axis] = rows.number(scalar)?,
            _ => skip(kind, rows)?,
        }
        if at == last {
            if !position.is_finite() {
                return Err(format!("is at {position}: every coordinate must be a finite number"));
            }
            positions.push(position);
        }
        Ok(())
    })?;
    Ok(positions)
}

fn read_faces(
    element: &Element,
    corners: usize,
    vertices: u64,
    rows: &mut impl Rows,
) -> Result<Vec<[u32; 3]>, Fault> {
    let mut triangles = Vec::with_capacity(element.count as usize);
    each_row(element, rows, |at, kind, rows| match kind {
        Kind::List { count, item } if at == corners => {
            let mut fan = Fan::default();
            for _ in 0..list_length(count, rows)? {
                let index = corner(rows.integer(item)?, vertices)?;
                triangles.extend(fan.corner(index));
            }
            Ok(())
        }
        _ => skip(kind, rows),
    })?;
    Ok(triangles)
}

fn corner(index: i64, vertices: u64) -> Result<u32, String> {
    let there = u64::try_from(index).is_ok_and(|index| index < vertices);
    let index_u32 = u32::try_from(index).ok().filter(|_| there);
    index_u32.ok_or_else(|| format!("names vertex {index}, but the file has {vertices}, counted from 0"))
}
