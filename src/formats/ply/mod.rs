//! PLY: ascii, binary little-endian and binary big-endian.

mod ascii;
mod binary;
mod body;
mod faces;
mod header;
mod rewriter;
#[cfg(test)]
mod tests;
mod vertices;
mod writer;

pub(super) use rewriter::rewrite;
pub use writer::{Ply, ply_bytes, write_ply};

use super::error::Fault;
use super::geometry::Geometry;
use super::input::Siblings;
use super::stream::Stream;
use ascii::AsciiRows;
use binary::BinaryRows;
use header::{Encoding, Header};

/// Reads positions, colours and texture coordinates of the element `vertex`, and the polygons of the element `face` with
/// their texture coordinates. Other properties and elements are skipped.
pub(super) fn read(stream: &mut Stream, siblings: &Siblings) -> Result<Geometry, Fault> {
    let header = Header::read(stream)?;
    match header.encoding {
        Encoding::Ascii => body::read(&header, AsciiRows::new(stream), siblings),
        Encoding::LittleEndian => body::read(&header, BinaryRows::<false>::new(stream), siblings),
        Encoding::BigEndian => body::read(&header, BinaryRows::<true>::new(stream), siblings),
    }
}
