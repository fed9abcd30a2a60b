use std::io::Cursor;

use glam::DVec2;
use png::{Decoder, Transformations};

use crate::formats::error::Fault;
use crate::formats::mesh_file::MeshFile;
use crate::formats::texture::ImageOrigin;
use crate::mesh::Points;

/// Most pixels of a picture: 8192 in both directions. A small file may claim any number.
const MOST_PIXELS: u64 = 1 << 26;

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// A picture's brightness, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Painted {
    width: usize,
    height: usize,
    levels: Vec<u8>,
}

pub(super) fn is_png(bytes: &[u8]) -> bool {
    bytes.starts_with(SIGNATURE)
}

impl Painted {
    /// Reads a PNG, in colour or not; its opacity is not looked at.
    pub fn decode(bytes: &[u8]) -> Result<Self, Fault> {
        let broken = |error: png::DecodingError| Fault::at("the PNG", error.to_string());
        let mut decoder = Decoder::new(Cursor::new(bytes));
        decoder.set_transformations(Transformations::normalize_to_color8());
        let mut reader = decoder.read_info().map_err(broken)?;
        let (width, height) = reader.info().size();
        let size = reader.output_buffer_size();
        let Some(size) = size.filter(|_| u64::from(width) * u64::from(height) <= MOST_PIXELS) else {
            let problem = format!("is {width} x {height} pixels large: use at most 8192 x 8192");
            return Err(Fault::at("the PNG", problem));
        };
        let mut pixels = vec![0; size];
        let frame = reader.next_frame(&mut pixels).map_err(broken)?;
        let samples = frame.color_type.samples();
        let level = |pixel: &[u8]| match pixel {
            [red, green, blue, ..] => ((u16::from(*red) + u16::from(*green) + u16::from(*blue)) / 3) as u8,
            [grey, ..] => *grey,
            [] => 0,
        };
        let levels = pixels[..frame.buffer_size()].chunks_exact(samples).map(level).collect();
        Ok(Self { width: width as usize, height: height as usize, levels })
    }

    /// The weights of a mesh's vertices `[N]`: the mean over their corners; 1 where none has texture coordinates.
    pub fn on(&self, mesh: &MeshFile<impl Points>) -> Result<Vec<f32>, Fault> {
        let missing = || Fault::at("the mask", "is painted, but the mesh's file has no texture coordinates");
        let texture = mesh.texture.as_ref().ok_or_else(missing)?;
        if texture.images.len() > 1 {
            let problem = format!(
                "is one picture, but the mesh has {} textures: give weights by vertex, or spheres",
                texture.images.len()
            );
            return Err(Fault::at("the mask", problem));
        }
        let mut sums = vec![(0.0, 0.0); mesh.mesh.points().count()];
        for (corner, &vertex) in mesh.corners().iter().enumerate() {
            if let Some(at) = texture.coordinate(corner) {
                let (sum, count) = &mut sums[vertex as usize];
                *sum += self.level_at(at, texture.origin);
                *count += 1.0;
            }
        }
        if sums.iter().all(|(_, count)| *count == 0.0) {
            return Err(missing());
        }
        Ok(sums.into_iter().map(|(sum, count)| if count > 0.0 { sum / count } else { 1.0 }).collect())
    }

    /// The level at texture coordinates, 0 to 1, between the four nearest pixels; beyond its sides the picture repeats.
    fn level_at(&self, at: DVec2, origin: ImageOrigin) -> f32 {
        let wrapped = |x: f64| if (0.0..=1.0).contains(&x) { x } else { x.rem_euclid(1.0) };
        let (u, v) = (wrapped(at.x), wrapped(at.y));
        let from_the_top = match origin {
            ImageOrigin::LowerLeft => 1.0 - v,
            ImageOrigin::UpperLeft => v,
        };
        // Pixels' values are those of their middles.
        let place = |share: f64, count: usize| {
            let x = (share * count as f64 - 0.5).clamp(0.0, (count - 1) as f64);
            (x as usize, (x as usize + 1).min(count - 1), (x - x.floor()) as f32)
        };
        let (left, right, along) = place(u, self.width);
        let (upper, lower, down) = place(from_the_top, self.height);
        let level = |x: usize, y: usize| f32::from(self.levels[y * self.width + x]) / 255.0;
        let row = |y: usize| level(left, y) * (1.0 - along) + level(right, y) * along;
        row(upper) * (1.0 - down) + row(lower) * down
    }
}
