use std::path::Path;

use glam::DVec2;
use rayon::prelude::*;

use super::CaptureView;
use crate::camera::{Camera, Distortion, Intrinsics, Pose};
use crate::formats::error::{Fault, FormatError};
use crate::formats::input::read_file;
use crate::formats::pixels::{self, Encoding, Pixels};

/// A picture as a pinhole camera would have taken it.
#[derive(Debug, Clone, PartialEq)]
pub struct Photograph {
    /// What the cameras' file calls it.
    pub name: String,
    /// From the world to the camera's axes.
    pub pose: Pose,
    /// From directions to pixels; its size is the picture's.
    pub intrinsics: Intrinsics,
    /// Colours times opacity, and the opacity `[H * W, 4]`.
    pub pixels: Pixels,
    /// Whether the opacity is the object's silhouette; otherwise the file has neither opacity nor mask.
    pub has_silhouette: bool,
    /// Where the lens shows nothing `[H * W]`; `None`: nowhere.
    pub unseen: Option<Vec<bool>>,
}

impl CaptureView {
    /// Reads the picture and its mask, reduced by a whole number so that no side is longer than `longest`, and undoes the
    /// lens. Opacity, and the mask's brightness or its opacity where it has one, are the silhouette.
    ///
    /// # Errors
    /// [`FormatError`] names the file: unreadable, larger than 8192 x 8192 pixels, of another size than its camera's or
    /// its mask's, or a mask of nothing.
    pub fn photograph(&self, longest: u32, encoding: Encoding) -> Result<Photograph, FormatError> {
        let picture = decode(&self.image)?;
        let intrinsics = fitted(self.camera.intrinsics, picture.size)
            .map_err(|fault| FormatError::from(fault).in_file(&self.image))?;
        let factor = picture.size[0].max(picture.size[1]).div_ceil(longest.max(1));
        let mut has_silhouette = picture.has_opacity();
        let size = picture.size;
        let mut pixels = picture.reduced(factor, encoding);
        drop(picture);
        if let Some(path) = &self.mask {
            mask(&mut pixels, path, size, factor)?;
            has_silhouette = true;
        }
        if has_silhouette && !pixels.values.iter().any(|pixel| pixel[3] > 0.5) {
            let path = self.mask.as_ref().unwrap_or(&self.image);
            let problem = "shows nothing of the object, all of it is empty: mask it anew, or leave the view out of the \
                           cameras' file";
            return Err(FormatError::from(Fault::at("its silhouette", problem)).in_file(path));
        }
        let camera = Camera { intrinsics: intrinsics.reduced(factor, pixels.size), ..self.camera };
        let (pixels, unseen) = match camera.distortion {
            Distortion::None => (pixels, None),
            _ => straightened(&pixels, &camera),
        };
        let (pose, intrinsics) = (camera.pose, camera.intrinsics);
        Ok(Photograph { name: self.name.clone(), pose, intrinsics, pixels, has_silhouette, unseen })
    }
}

fn decode(path: &Path) -> Result<pixels::Decoded, FormatError> {
    pixels::decode(&read_file(path)?).map_err(|fault| FormatError::from(fault).in_file(path))
}

/// Intrinsics of a picture of this size, which those without a size take.
fn fitted(intrinsics: Intrinsics, size: [u32; 2]) -> Result<Intrinsics, Fault> {
    if intrinsics.size == [0, 0] {
        let [width, height] = size.map(f64::from);
        let centre = DVec2::new(intrinsics.centre.x * width, 0.5 * height);
        return Ok(Intrinsics {
            size,
            focal: intrinsics.focal * width,
            centre,
            skew: intrinsics.skew * width,
        });
    }
    if intrinsics.size == size {
        return Ok(intrinsics);
    }
    let ([width, height], [wide, high]) = (size, intrinsics.size);
    let problem = format!(
        "is {width} x {height} pixels large, but its camera is calibrated for {wide} x {high}: give the picture as it \
         was calibrated, or scale the camera's size, focal lengths and centre along"
    );
    Err(Fault::at("the picture", problem))
}

/// Multiplies with the mask in a file.
fn mask(pixels: &mut Pixels, path: &Path, size: [u32; 2], factor: u32) -> Result<(), FormatError> {
    let mask = decode(path)?;
    if mask.size != size {
        let ([width, height], [wide, high]) = (mask.size, size);
        let problem = format!(
            "is {width} x {height} pixels large, but its picture is {wide} x {high}: make them alike"
        );
        return Err(FormatError::from(Fault::at("the mask", problem)).in_file(path));
    }
    let opaque = mask.has_opacity();
    let reduced = mask.reduced(factor, Encoding::Linear);
    // A mask with an opacity that says nothing is as bright as it is opaque.
    let varies = opaque && reduced.values.iter().any(|pixel| pixel[3] < 0.5);
    for (pixel, mask) in pixels.values.iter_mut().zip(&reduced.values) {
        let share = if varies { mask[3] } else { (mask[0] + mask[1] + mask[2]) / 3.0 };
        *pixel = pixel.map(|value| value * share);
    }
    Ok(())
}

/// The picture without its lens, and where the lens shows nothing.
fn straightened(pixels: &Pixels, camera: &Camera) -> (Pixels, Option<Vec<bool>>) {
    let [width, height] = pixels.size;
    let value = |at: u32| {
        let pixel = DVec2::new(f64::from(at % width) + 0.5, f64::from(at / width) + 0.5);
        let direction = camera.intrinsics.direction(pixel);
        let bent = camera.distortion.distort(direction);
        // Beyond where the formula turns back, another direction is seen there.
        let back = camera.distortion.undistort(bent);
        let seen = camera.intrinsics.pixel(bent);
        back.filter(|back| back.distance(direction) < 1e-6).and_then(|_| between(pixels, seen))
    };
    let values: Vec<Option<[f32; 4]>> = (0..width * height).into_par_iter().map(value).collect();
    let unseen = values.iter().any(Option::is_none).then(|| values.iter().map(Option::is_none).collect());
    let values = values.into_iter().map(|value| value.unwrap_or([0.0; 4])).collect();
    (Pixels { size: pixels.size, values }, unseen)
}

/// The value at a place of the picture, between the four nearest pixels; `None` outside.
fn between(pixels: &Pixels, at: DVec2) -> Option<[f32; 4]> {
    let [width, height] = pixels.size.map(f64::from);
    if !(at.x >= 0.0 && at.y >= 0.0 && at.x <= width && at.y <= height) {
        return None;
    }
    let place = |x: f64, count: u32| {
        let x = (x - 0.5).clamp(0.0, f64::from(count - 1));
        (x as usize, (x as usize + 1).min(count as usize - 1), (x - x.floor()) as f32)
    };
    let ((left, right, along), (upper, lower, down)) =
        (place(at.x, pixels.size[0]), place(at.y, pixels.size[1]));
    let value = |x: usize, y: usize| pixels.values[y * pixels.size[0] as usize + x];
    let mix = |a: [f32; 4], b: [f32; 4], t: f32| [0, 1, 2, 3].map(|c| a[c] + (b[c] - a[c]) * t);
    let row = |y: usize| mix(value(left, y), value(right, y), along);
    Some(mix(row(upper), row(lower), down))
}
