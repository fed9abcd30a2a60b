//! STL, ascii and binary: triangles with corners of their own, which are made one where they are in the same place.

mod ascii;
mod binary;
#[cfg(test)]
mod tests;

use super::error::Fault;
use super::geometry::{FileOrder, Geometry, Numbers};
use super::polygons::Polygons;
use super::stream::Stream;
use super::weld::weld;
use crate::mesh::{FilePoints, Points};

/// Reads all triangles. Normals and attribute bytes are passed over: the corners' order says what is outside.
pub(super) fn read(stream: &mut Stream) -> Result<Geometry, Fault> {
    let length = stream.left();
    let corners =
        if is_ascii(stream.beginning(), length) { ascii::read(stream) } else { binary::read(stream) }?;
    let welded = weld(separate(corners)?);
    // A corner has no number: programs count those of a file differently.
    let order = FileOrder { vertices: Numbers::None, ..welded.order };
    Ok(Geometry { order, ..welded })
}

/// Whether the content alone says that a file of so many bytes is STL.
pub(super) fn looks_like_stl(beginning: &[u8], length: u64) -> bool {
    binary::has_its_length(beginning, length)
        || (is_ascii(beginning, length) && contains(beginning, b"facet"))
}

/// Binary files too may begin with `solid`, but not have the length that their count of triangles asks for by chance.
fn is_ascii(beginning: &[u8], length: u64) -> bool {
    beginning.trim_ascii_start().starts_with(b"solid")
        && !binary::has_its_length(beginning, length)
        && !contains(beginning, b"\0")
}

/// Whether `word` is in the beginning of a file.
fn contains(bytes: &[u8], word: &[u8]) -> bool {
    const BEGINNING: usize = 1024;
    bytes[..bytes.len().min(BEGINNING)].windows(word.len()).any(|window| window == word)
}

/// Triangles that share nothing, of corners `[3 F]`.
fn separate(positions: FilePoints) -> Result<Geometry, Fault> {
    let corners = u32::try_from(positions.count())
        .map_err(|_| Fault::at("the triangles", "are more than 32-bit indices reach"))?;
    let mut polygons = Polygons::with_capacity(positions.count() / 3);
    (0..corners / 3).for_each(|t| polygons.push_triangle([3 * t, 3 * t + 1, 3 * t + 2]));
    Ok(Geometry { positions, polygons, ..Geometry::default() })
}
