use glam::DVec3;

use crate::formats::error::Fault;
use crate::formats::stream::Stream;
use crate::mesh::FilePoints;

/// Anything at all, then the count of triangles.
const HEADER: usize = 84;
/// A normal and three corners of 32-bit numbers, then two bytes.
const TRIANGLE: usize = 50;

/// Whether a file is as long as its count of triangles says.
pub(super) fn has_its_length(beginning: &[u8], length: u64) -> bool {
    declared(beginning) == Some(length) && length > HEADER as u64
}

/// The corners of all triangles `[3 F]`.
pub(super) fn read(stream: &mut Stream) -> Result<FilePoints, Fault> {
    let length = stream.left();
    let header = stream.take::<HEADER>();
    let declared = header.and_then(|header| declared(&header)).ok_or_else(|| {
        let problem = format!("is cut short: binary STL begins with {HEADER} bytes, here are {length}");
        Fault::at("the header", problem)
    })?;
    let triangles = (declared - HEADER as u64) / TRIANGLE as u64;
    let cut_short = || {
        let problem = format!(
            "declares {triangles} triangles, which take {declared} bytes, but the file has {length}: it is cut short or damaged"
        );
        Fault::at("the header", problem)
    };
    if declared > length {
        return Err(cut_short());
    }
    let mut corners = FilePoints::with_capacity(3 * triangles as usize);
    for number in 0..triangles {
        let triangle = stream.take::<TRIANGLE>().ok_or_else(cut_short)?;
        let (numbers, _) = triangle.as_chunks::<4>();
        let (points, _) = numbers[3..].as_chunks::<3>();
        for point in points {
            let point = DVec3::from(point.map(|bytes| f64::from(f32::from_le_bytes(bytes))));
            if !point.is_finite() {
                let problem = format!("has a corner at {point}: every coordinate must be a finite number");
                return Err(Fault::at(format_args!("triangle {number}"), problem));
            }
            corners.push(point);
        }
    }
    Ok(corners)
}

/// The length that the count of triangles asks for.
fn declared(bytes: &[u8]) -> Option<u64> {
    let count = u32::from_le_bytes(*bytes.get(HEADER - 4..)?.first_chunk()?);
    Some(HEADER as u64 + u64::from(count) * TRIANGLE as u64)
}
