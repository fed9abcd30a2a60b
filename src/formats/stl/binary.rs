use glam::DVec3;

use crate::formats::error::Fault;

/// Anything at all, then the count of triangles.
const HEADER: usize = 84;
/// A normal and three corners of 32-bit numbers, then two bytes.
const TRIANGLE: usize = 50;

/// Whether a file is as long as its count of triangles says.
pub(super) fn has_its_length(bytes: &[u8]) -> bool {
    declared(bytes).is_some_and(|length| length == bytes.len() as u64) && bytes.len() > HEADER
}

/// The corners of all triangles `[3 F]`.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<DVec3>, Fault> {
    let declared = declared(bytes).ok_or_else(|| {
        let problem =
            format!("is cut short: binary STL begins with {HEADER} bytes, here are {}", bytes.len());
        Fault::at("the header", problem)
    })?;
    if declared > bytes.len() as u64 {
        let problem = format!(
            "declares {} triangles, which take {declared} bytes, but the file has {}: it is cut short or damaged",
            (declared - HEADER as u64) / TRIANGLE as u64,
            bytes.len()
        );
        return Err(Fault::at("the header", problem));
    }
    let (triangles, _) = bytes[HEADER..declared as usize].as_chunks::<TRIANGLE>();
    let mut corners = Vec::with_capacity(3 * triangles.len());
    for (number, triangle) in triangles.iter().enumerate() {
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
