use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::{Decoded, affordable};
use crate::formats::error::Fault;

/// As stored: a rotation in the EXIF is not applied, since cameras are calibrated on the pixels as they are.
pub(super) fn decode(bytes: &[u8]) -> Result<Decoded, Fault> {
    let broken = |error: zune_jpeg::errors::DecodeErrors| Fault::at("the JPEG", error.to_string());
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(broken)?;
    let info = decoder.info().ok_or_else(|| Fault::at("the JPEG", "has no size"))?;
    let size = affordable(usize::from(info.width), usize::from(info.height), "the JPEG")?;
    let samples = decoder.decode().map_err(broken)?;
    Ok(Decoded { size, channels: 3, bytes: 1, samples })
}
