//! COLMAP's sparse models, text and binary.

mod binary;
mod model;
mod text;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::{DMat3, DQuat, DVec3};

use super::{Frame, in_file};
use crate::camera::{Camera, Distortion, Intrinsics, Pose};
use crate::formats::error::{Fault, FormatError};
use crate::formats::input::read_file;

/// What COLMAP knows of a picture.
struct PlacedImage {
    name: String,
    camera: u32,
    /// w, x, y, z of the rotation from the world to the camera.
    rotation: [f64; 4],
    translation: [f64; 3],
}

type Lenses = HashMap<u32, (Intrinsics, Distortion)>;

/// Whether a folder holds a model.
pub(super) fn is_model(folder: &Path) -> bool {
    let both = |extension: &str| {
        ["cameras", "images"].iter().all(|name| folder.join(format!("{name}.{extension}")).is_file())
    };
    both("bin") || both("txt")
}

/// The frames of the model in a folder, binary before text, and the file that places them.
pub(super) fn read(folder: &Path) -> Result<(PathBuf, Vec<Frame>), FormatError> {
    let binary = folder.join("images.bin").is_file() && folder.join("cameras.bin").is_file();
    let extension = if binary { "bin" } else { "txt" };
    let cameras = folder.join(format!("cameras.{extension}"));
    let images = folder.join(format!("images.{extension}"));
    let (bytes, placed) = (read_file(&cameras)?, read_file(&images)?);
    let lenses = if binary { binary::cameras(&bytes) } else { text::cameras(&bytes) };
    let lenses = lenses.map_err(|fault| in_file(fault, &cameras))?;
    let placed = if binary { binary::images(&placed) } else { text::images(&placed) };
    let placed = placed.map_err(|fault| in_file(fault, &images))?;
    let frames = placed.into_iter().map(|image| frame(image, &lenses)).collect::<Result<_, _>>();
    Ok((images.clone(), frames.map_err(|fault| in_file(fault, &images))?))
}

fn frame(image: PlacedImage, lenses: &Lenses) -> Result<Frame, Fault> {
    let PlacedImage { name, camera, rotation: [w, x, y, z], translation } = image;
    let place = format!("image `{name}`");
    let Some(&(intrinsics, distortion)) = lenses.get(&camera) else {
        return Err(Fault::at(place, format!("was taken by camera {camera}, which is not there")));
    };
    let rotation = DQuat::from_xyzw(x, y, z, w);
    let translation = DVec3::from(translation);
    if !(rotation.is_finite() && rotation.length() > 1e-6) || !translation.is_finite() {
        return Err(Fault::at(place, "has a quaternion of no length or a number that is not finite"));
    }
    let pose = Pose { rotation: DMat3::from_quat(rotation.normalize()), translation };
    Ok(Frame { name, mask: None, camera: Camera { pose, distortion, intrinsics } })
}
