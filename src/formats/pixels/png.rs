use std::io::Cursor;

use png::{BitDepth, Decoder, Limits, Transformations};

use super::{Decoded, affordable};
use crate::formats::error::Fault;

/// Palettes and levels of less than 8 bits are expanded, 16 bits stay.
pub(super) fn decode(bytes: &[u8]) -> Result<Decoded, Fault> {
    let broken = |error: png::DecodingError| Fault::at("the PNG", error.to_string());
    // The limit is on what stands beside the pixels; theirs is below.
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: 1 << 26 });
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(broken)?;
    let (width, height) = reader.info().size();
    let size = affordable(width as usize, height as usize, "the PNG")?;
    let (colour, depth) = reader.output_color_type();
    let length = reader.output_buffer_size().ok_or_else(|| Fault::at("the PNG", "is too large"))?;
    let mut samples = vec![0; length];
    let frame = reader.next_frame(&mut samples).map_err(broken)?;
    samples.truncate(frame.buffer_size());
    let bytes = if depth == BitDepth::Sixteen { 2 } else { 1 };
    Ok(Decoded { size, channels: colour.samples(), bytes, samples })
}
