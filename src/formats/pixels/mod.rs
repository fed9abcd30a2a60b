//! Pictures as numbers: PNG and JPEG in, reduced to the size that is worked with while they are read.

mod decoded;
mod encoded;
mod jpeg;
mod png;
#[cfg(test)]
mod tests;

use super::error::Fault;
pub(super) use decoded::Decoded;

/// Most pixels of a picture file: 8192 in both directions. A small file may claim any number.
const MOST_PIXELS: u64 = 1 << 26;

/// What the numbers of a picture's file stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Themselves: normals, silhouettes, intensities.
    Linear,
    /// Intensities by the curve of sRGB, as photographs and most renderings have them.
    Srgb,
}

/// A picture with its opacity, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Pixels {
    /// Width and height.
    pub size: [u32; 2],
    /// Red, green and blue, each times the opacity, and the opacity `[H * W, 4]`, from 0 to 1.
    pub values: Vec<[f32; 4]>,
}

impl Pixels {
    /// Half as large: each pixel the mean of two by two, the last odd row or column left out.
    pub fn halved(&self) -> Self {
        let [width, height] = self.size.map(|side| (side / 2).max(1));
        let stride = self.size[0] as usize;
        let last = [self.size[0] as usize - 1, self.size[1] as usize - 1];
        let at = |x: usize, y: usize| self.values[y.min(last[1]) * stride + x.min(last[0])];
        let mean = |x: usize, y: usize| {
            let four =
                [at(2 * x, 2 * y), at(2 * x + 1, 2 * y), at(2 * x, 2 * y + 1), at(2 * x + 1, 2 * y + 1)];
            [0, 1, 2, 3].map(|c| four.iter().map(|pixel| pixel[c]).sum::<f32>() / 4.0)
        };
        let rows = 0..height as usize;
        let values = rows.flat_map(|y| (0..width as usize).map(move |x| mean(x, y))).collect();
        Self { size: [width, height], values }
    }
}

/// Decodes a PNG or JPEG, told apart by how it begins.
pub(super) fn decode(bytes: &[u8]) -> Result<Decoded, Fault> {
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        png::decode(bytes)
    } else if bytes.starts_with(b"\xff\xd8\xff") {
        jpeg::decode(bytes)
    } else {
        let problem = if bytes.is_empty() { "is empty" } else { "is neither a PNG nor a JPEG" };
        Err(Fault::at("the picture", format!("{problem}: save it as one of these")))
    }
}

/// A picture's size, before memory is taken for it.
fn affordable(width: usize, height: usize, kind: &str) -> Result<[u32; 2], Fault> {
    let pixels = (width as u64).saturating_mul(height as u64);
    if pixels == 0 || pixels > MOST_PIXELS {
        let problem = format!(
            "is {width} x {height} pixels large: at most {MOST_PIXELS} pixels, 8192 x 8192, are read; reduce it, and \
             the camera's lengths in pixels with it"
        );
        return Err(Fault::at(kind, problem));
    }
    Ok([width as u32, height as u32])
}
