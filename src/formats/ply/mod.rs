//! PLY: ascii, binary little-endian and binary big-endian.

mod ascii;
mod binary;
mod body;
mod header;
#[cfg(test)]
mod tests;
mod writer;

pub use writer::{ply_bytes, write_ply};

use super::error::Fault;
use super::geometry::Geometry;
use ascii::AsciiRows;
use binary::BinaryRows;
use header::{Encoding, Header};

/// Reads `x`, `y`, `z` of the element `vertex` and the polygons of the element `face`, cut into fans. Other properties
/// and elements are skipped.
pub(super) fn read(bytes: &[u8]) -> Result<Geometry, Fault> {
    let header = Header::read(bytes)?;
    let data = &bytes[header.length..];
    match header.encoding {
        Encoding::Ascii => body::read(&header, AsciiRows::new(data, header.lines)),
        Encoding::LittleEndian => body::read(&header, BinaryRows::<false>::new(data)),
        Encoding::BigEndian => body::read(&header, BinaryRows::<true>::new(data)),
    }
}
