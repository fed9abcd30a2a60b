use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use super::Colour;

/// Why a picture could not be written.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The file could not be made.
    #[error("cannot create the picture file: {0}")]
    File(#[from] std::io::Error),
    /// The PNG encoder failed.
    #[error("cannot write the picture as PNG: {0}")]
    Png(#[from] png::EncodingError),
}

/// Pixels `[height, width]` in eight-bit sRGB, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Image {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Image {
    /// An image of one colour.
    pub fn filled(width: usize, height: usize, colour: Colour) -> Self {
        Self { width, height, pixels: vec![colour.bytes(); width * height] }
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Pixels in a column.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The sRGB bytes at column `x` and row `y`.
    ///
    /// # Panics
    /// If the pixel is outside of the image.
    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        assert!(x < self.width && y < self.height, "pixel ({x}, {y}) is outside of the image");
        self.pixels[y * self.width + x]
    }

    /// Sets one pixel; outside of the image it does nothing.
    pub fn set(&mut self, x: usize, y: usize, bytes: [u8; 3]) {
        if x < self.width && y < self.height {
            self.pixels[y * self.width + x] = bytes;
        }
    }

    /// Copies `other` with its top left corner to (`left`, `top`), cut off at the border.
    pub fn paste(&mut self, other: &Self, left: usize, top: usize) {
        for y in 0..other.height {
            for x in 0..other.width {
                self.set(left + x, top + y, other.pixel(x, y));
            }
        }
    }

    /// The image as the bytes of a PNG file; the same image gives the same bytes.
    ///
    /// # Errors
    /// [`PictureError`] for an image without pixels, or too large for PNG.
    pub fn png_bytes(&self) -> Result<Vec<u8>, PictureError> {
        let mut bytes = Vec::new();
        self.encode(&mut bytes)?;
        Ok(bytes)
    }

    /// Writes the image as a PNG file.
    ///
    /// # Errors
    /// [`PictureError`] if the file cannot be created or written.
    pub fn write_png(&self, path: &Path) -> Result<(), PictureError> {
        self.encode(BufWriter::new(File::create(path)?))
    }

    fn encode(&self, out: impl Write) -> Result<(), PictureError> {
        let mut encoder = png::Encoder::new(out, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.write_header()?.write_image_data(self.pixels.as_flattened())?;
        Ok(())
    }
}
