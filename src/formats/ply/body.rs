use super::faces::FacePlan;
use super::header::{Element, Header, Kind, Scalar};
use super::vertices::VertexPlan;
use crate::formats::error::Fault;
use crate::formats::geometry::Geometry;
use crate::formats::input::Siblings;

/// Rows of numbers in one of PLY's encodings. Problems are sentences without a place: the caller knows the row.
pub(super) trait Rows {
    /// Bytes not read yet.
    fn left(&self) -> u64;
    /// The fewest bytes that a number takes.
    fn least(&self, scalar: Scalar) -> usize;
    fn start_row(&mut self) -> Result<(), String>;
    fn number(&mut self, scalar: Scalar) -> Result<f64, String>;
    /// A number that the mesh can do without: NaN where it is none.
    fn any_number(&mut self, scalar: Scalar) -> Result<f64, String>;
    /// A number of an integer type.
    fn integer(&mut self, scalar: Scalar) -> Result<i64, String>;
    /// Passes over `count` numbers.
    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<(), String>;
    fn end_row(&mut self) -> Result<(), String>;
    /// Where the current row is in the file, for a message.
    fn place(&self) -> String;
}

/// Reads the elements in the order of their rows until both vertices and faces are there.
pub(super) fn read(header: &Header, mut rows: impl Rows, siblings: &Siblings) -> Result<Geometry, Fault> {
    let vertex = header.element("vertex")?;
    let face = header.element("face")?;
    let vertex_plan = VertexPlan::new(vertex)?;
    let face_plan = FacePlan::new(face)?;
    let (mut vertices, mut faces) = (None, None);
    for element in header.elements.iter().filter(|element| !element.properties.is_empty()) {
        check_room(element, &rows)?;
        if std::ptr::eq(element, vertex) {
            vertices = Some(vertex_plan.read(element, &mut rows)?);
        } else if std::ptr::eq(element, face) {
            faces = Some(face_plan.read(element, vertex.count, &mut rows)?);
        } else {
            each_row(element, &mut rows, |_, property, rows| skip(property, rows))?;
        }
        if vertices.is_some() && faces.is_some() {
            break;
        }
    }
    // Both have properties, or there were no plans for them.
    Ok(vertices.unwrap_or_default().with(faces.unwrap_or_default(), &header.pictures, siblings))
}

/// Holds the declared number of rows against the bytes that are there, before memory is taken for them.
fn check_room(element: &Element, rows: &impl Rows) -> Result<(), Fault> {
    let least = |kind: Kind| match kind {
        Kind::One(scalar) | Kind::List { count: scalar, .. } => rows.least(scalar) as u64,
    };
    let row: u64 = element.properties.iter().map(|property| least(property.kind)).sum();
    // The last word of a text needs no blank after it.
    let left = rows.left() + 1;
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
pub(super) fn each_row<R: Rows>(
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

pub(super) fn skip(kind: Kind, rows: &mut impl Rows) -> Result<(), String> {
    match kind {
        Kind::One(scalar) => rows.skip(scalar, 1),
        Kind::List { count, item } => {
            let items = list_length(count, rows)?;
            rows.skip(item, items)
        }
    }
}

pub(super) fn list_length(count: Scalar, rows: &mut impl Rows) -> Result<u64, String> {
    let items = rows.integer(count)?;
    u64::try_from(items).map_err(|_| format!("a list has {items} items: a count cannot be negative"))
}
