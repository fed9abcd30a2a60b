//! What the pictures show, found out where it is not said.

use glam::{DVec2, DVec3};

use super::error::InvertError;
use super::settings::What;
use crate::formats::Photograph;
use crate::render::Light;

/// How far the length of a normal may be from one that a picture rounded and smoothed.
const NORMAL_LENGTH: std::ops::Range<f32> = 0.8..1.2;
/// The share of the pixels that has to look like normals, or black and white.
const MOST: f64 = 0.95;

/// What the pictures show, and in which axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shown {
    /// The outline alone.
    Silhouette,
    /// Normals in the world's axes.
    WorldNormal,
    /// Normals in the camera's: x right, y up, z towards the viewer.
    CameraNormal,
    /// The object itself under distant light.
    Shaded,
}

impl Shown {
    /// What photographs show, of pictures without decoding and with silhouettes.
    pub fn of(photographs: &[Photograph], what: What) -> Self {
        match what {
            What::Silhouette => Self::Silhouette,
            What::WorldNormal => Self::WorldNormal,
            What::CameraNormal => Self::CameraNormal,
            What::Shaded => Self::Shaded,
            What::Normal => axes(photographs),
            What::Detect if photographs.iter().all(is_silhouette) => Self::Silhouette,
            What::Detect if photographs.iter().all(is_normals) => axes(photographs),
            What::Detect => Self::Shaded,
        }
    }

    /// The light that makes pictures of a camera show that; a grey one for shaded pictures.
    pub fn light(self, photograph: &Photograph) -> Light {
        let mut light = match self {
            Self::Silhouette => return Light::uniform([1.0; 3]),
            Self::Shaded => return Light::uniform([0.5; 3]),
            Self::WorldNormal => return Light::world_normals(),
            Self::CameraNormal => Light::camera_normals(&photograph.pose),
        };
        // From y down and z forward to y up and z towards the viewer.
        for axis in 1..4 {
            for channel in 1..3 {
                light.0[axis][channel] = -light.0[axis][channel];
            }
        }
        light
    }
}

/// The colours of the object's own pixels.
fn colours(photograph: &Photograph) -> impl Iterator<Item = [f32; 3]> {
    let whole = |pixel: &&[f32; 4]| pixel[3] > 0.99;
    photograph.pixels.values.iter().filter(whole).map(|&[red, green, blue, _]| [red, green, blue])
}

fn share<T>(values: impl Iterator<Item = T>, holds: impl Fn(T) -> bool) -> f64 {
    let (mut those, mut all) = (0.0, 0.0);
    for value in values {
        those += f64::from(u8::from(holds(value)));
        all += 1.0;
    }
    those / f64::max(all, 1.0)
}

/// The object in one colour, white or black.
fn is_silhouette(photograph: &Photograph) -> bool {
    let white = share(colours(photograph), |colour| colour.iter().all(|c| *c > 0.95));
    let black = share(colours(photograph), |colour| colour.iter().all(|c| *c < 0.05));
    white.max(black) > MOST
}

fn is_normals(photograph: &Photograph) -> bool {
    share(colours(photograph), |colour| NORMAL_LENGTH.contains(&normal(colour).length())) > MOST
}

fn normal(colour: [f32; 3]) -> glam::Vec3 {
    glam::Vec3::from_array(colour) * 2.0 - 1.0
}

/// The axes in which the surface turns towards the cameras that see it.
fn axes(photographs: &[Photograph]) -> Shown {
    let towards = |shown: Shown| -> f64 { photographs.iter().map(|p| facing(p, shown)).sum() };
    if towards(Shown::WorldNormal) > towards(Shown::CameraNormal) {
        Shown::WorldNormal
    } else {
        Shown::CameraNormal
    }
}

/// The mean cosine between normals and the directions to the camera.
fn facing(photograph: &Photograph, shown: Shown) -> f64 {
    let width = photograph.pixels.size[0] as usize;
    let (mut sum, mut count) = (0.0, 0.0);
    for (at, pixel) in photograph.pixels.values.iter().enumerate().filter(|(_, pixel)| pixel[3] > 0.99) {
        let place = DVec2::new((at % width) as f64 + 0.5, (at / width) as f64 + 0.5);
        let ray = photograph.intrinsics.direction(place).extend(1.0).normalize();
        let normal = normal([pixel[0], pixel[1], pixel[2]]).as_dvec3();
        let seen = match shown {
            Shown::WorldNormal => photograph.pose.rotation * normal,
            _ => DVec3::new(normal.x, -normal.y, -normal.z),
        };
        sum -= seen.dot(ray);
        count += 1.0;
    }
    sum / f64::max(count, 1.0)
}

/// Finds silhouettes where the files have none: in pictures in black and white, and where colours are normals.
///
/// # Errors
/// [`InvertError::NoSilhouette`] for a picture that is neither, [`InvertError::Unmasked`] if the object fills them all.
pub(super) fn silhouettes(photographs: &mut [Photograph], what: What) -> Result<(), InvertError> {
    let may_be_normals = !matches!(what, What::Silhouette | What::Shaded);
    for photograph in photographs.iter_mut().filter(|photograph| !photograph.has_silhouette) {
        if matches!(what, What::Silhouette | What::Detect) && is_black_and_white(photograph) {
            // White is the object, grey a share of it.
            photograph.pixels.values.iter_mut().for_each(|pixel| *pixel = [pixel[0]; 4]);
        } else if may_be_normals && has_normals(photograph) {
            let is_normal = |p: &[f32; 4]| NORMAL_LENGTH.contains(&normal([p[0], p[1], p[2]]).length());
            photograph.pixels.values.iter_mut().filter(|p| !is_normal(p)).for_each(|pixel| *pixel = [0.0; 4]);
        } else {
            return Err(InvertError::NoSilhouette { view: photograph.name.clone() });
        }
        photograph.has_silhouette = true;
    }
    let full = |photograph: &Photograph| photograph.pixels.values.iter().all(|pixel| pixel[3] > 0.5);
    if photographs.iter().all(full) { Err(InvertError::Unmasked) } else { Ok(()) }
}

fn is_grey(pixel: &[f32; 4]) -> bool {
    (pixel[0] - pixel[1]).abs() < 0.02 && (pixel[1] - pixel[2]).abs() < 0.02
}

fn is_black_and_white(photograph: &Photograph) -> bool {
    let values = &photograph.pixels.values;
    let extreme = |pixel: &[f32; 4]| is_grey(pixel) && !(0.1..0.9).contains(&pixel[0]);
    share(values.iter(), extreme) > 0.9
        && values.iter().any(|p| p[0] > 0.9)
        && values.iter().any(|p| p[0] < 0.1)
}

/// Whether colours of unit length stand before a background of others.
fn has_normals(photograph: &Photograph) -> bool {
    let values = photograph.pixels.values.iter();
    let unit = share(values, |p| (0.9..1.1).contains(&normal([p[0], p[1], p[2]]).length()));
    let off = photograph.pixels.values.iter();
    let none = share(off, |p| !NORMAL_LENGTH.contains(&normal([p[0], p[1], p[2]]).length()));
    unit > 0.02 && unit + none > 0.9
}
