use rayon::prelude::*;

use super::{Encoding, Pixels};

/// A picture's samples as its file has them.
pub(in crate::formats) struct Decoded {
    pub size: [u32; 2],
    /// Grey, grey and opacity, colour, or colour and opacity.
    pub channels: usize,
    /// Bytes of a sample, the higher first.
    pub bytes: usize,
    pub samples: Vec<u8>,
}

impl Decoded {
    /// Whether it has an opacity.
    pub fn has_opacity(&self) -> bool {
        self.channels.is_multiple_of(2)
    }

    /// The picture with each square of `factor` pixels a side made one; rows and columns that fill no square are left out.
    pub fn reduced(&self, factor: u32, encoding: Encoding) -> Pixels {
        let [width, height] = self.size.map(|side| (side / factor).max(1));
        let decode = levels(self.bytes, encoding);
        let factor = factor as usize;
        let row = |y: usize| {
            let pixel = |x: usize| self.mean(x * factor, y * factor, factor, &decode);
            (0..width as usize).map(pixel).collect::<Vec<_>>()
        };
        let rows: Vec<Vec<[f32; 4]>> = (0..height as usize).into_par_iter().map(row).collect();
        Pixels { size: [width, height], values: rows.concat() }
    }

    /// The mean of a square of pixels, colours times opacity.
    fn mean(&self, left: usize, top: usize, side: usize, decode: &[f32]) -> [f32; 4] {
        let [width, height] = self.size.map(|side| side as usize);
        let mut sum = [0.0; 4];
        let mut count = 0.0;
        for y in top..(top + side).min(height) {
            for x in left..(left + side).min(width) {
                let [red, green, blue, opacity] = self.pixel(y * width + x, decode);
                for (sum, value) in sum.iter_mut().zip([red, green, blue, 1.0]) {
                    *sum += value * opacity;
                }
                count += 1.0;
            }
        }
        sum.map(|sum| sum / count)
    }

    fn pixel(&self, at: usize, decode: &[f32]) -> [f32; 4] {
        let sample = |channel: usize| {
            let start = (at * self.channels + channel) * self.bytes;
            let bytes = &self.samples[start..start + self.bytes];
            bytes.iter().fold(0, |value, byte| 256 * value + usize::from(*byte))
        };
        let level = |channel: usize| decode[sample(channel)];
        let largest = (decode.len() - 1) as f32;
        let opacity = if self.has_opacity() { sample(self.channels - 1) as f32 / largest } else { 1.0 };
        match self.channels {
            1 | 2 => [level(0), level(0), level(0), opacity],
            _ => [level(0), level(1), level(2), opacity],
        }
    }
}

/// What each sample stands for.
fn levels(bytes: usize, encoding: Encoding) -> Vec<f32> {
    let count = if bytes == 2 { 1 << 16 } else { 1 << 8 };
    let level = |sample: i32| {
        let value = sample as f32 / (count - 1) as f32;
        match encoding {
            Encoding::Linear => value,
            Encoding::Srgb if value <= 0.04045 => value / 12.92,
            Encoding::Srgb => ((value + 0.055) / 1.055).powf(2.4),
        }
    };
    (0..count).map(level).collect()
}
