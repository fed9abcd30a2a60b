use super::{Encoding, Pixels};
use crate::formats::error::Fault;

impl Pixels {
    /// The picture as a PNG of 8 bits with opacity; the same picture gives the same bytes.
    ///
    /// # Errors
    /// [`Fault`] for a picture without pixels.
    pub(in crate::formats) fn png_bytes(&self, encoding: Encoding) -> Result<Vec<u8>, Fault> {
        let [width, height] = self.size;
        let broken =
            |error: png::EncodingError| Fault::DoesNotFit(format!("the picture cannot be a PNG: {error}"));
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, width, height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        let samples: Vec<u8> = self.values.iter().flat_map(|pixel| straight(pixel, encoding)).collect();
        encoder.write_header().and_then(|mut writer| writer.write_image_data(&samples)).map_err(broken)?;
        Ok(bytes)
    }
}

/// Colours not times opacity, in bytes.
fn straight(&[red, green, blue, opacity]: &[f32; 4], encoding: Encoding) -> [u8; 4] {
    let byte = |level: f32| (255.0 * level.clamp(0.0, 1.0)).round() as u8;
    let colour = |value: f32| {
        let level = if opacity > 0.0 { value / opacity } else { 0.0 };
        byte(match encoding {
            Encoding::Linear => level,
            Encoding::Srgb if level <= 0.003_130_8 => 12.92 * level,
            Encoding::Srgb => 1.055 * level.powf(1.0 / 2.4) - 0.055,
        })
    };
    [colour(red), colour(green), colour(blue), byte(opacity)]
}
