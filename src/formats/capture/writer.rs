use std::fs;
use std::path::Path;

use glam::{DMat3, DVec3};
use serde_json::{Value, json};

use super::Photograph;
use crate::formats::error::{Fault, FormatError};
use crate::formats::output::write_whole;
use crate::formats::pixels::Encoding;

/// Writes photographs as a folder of nerfstudio's: `transforms.json`, and PNGs with opacity in `images/`.
///
/// # Errors
/// [`FormatError`] names the file that cannot be written.
pub fn write_capture(
    folder: impl AsRef<Path>,
    photographs: &[Photograph],
    encoding: Encoding,
) -> Result<(), FormatError> {
    let folder = folder.as_ref();
    let images = folder.join("images");
    let unwritable = |error| FormatError::from(Fault::Unwritable(error)).in_file(&images);
    fs::create_dir_all(&images).map_err(unwritable)?;
    for photograph in photographs {
        let path = folder.join(file_path(photograph));
        let bytes = photograph.pixels.png_bytes(encoding).map_err(|fault| super::in_file(fault, &path))?;
        write_whole(path, &bytes)?;
    }
    let frames: Vec<Value> = photographs.iter().map(frame).collect();
    let transforms = json!({ "camera_model": "PINHOLE", "frames": frames });
    write_whole(folder.join("transforms.json"), format!("{transforms:#}\n").as_bytes())
}

fn file_path(photograph: &Photograph) -> String {
    format!("images/{}.png", photograph.name)
}

fn frame(photograph: &Photograph) -> Value {
    let Photograph { pose, intrinsics, .. } = photograph;
    // From OpenCV's axes to OpenGL's, as rows.
    let axes = pose.rotation.transpose() * DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let centre = pose.centre();
    let row = |i: usize| [axes.row(i).x, axes.row(i).y, axes.row(i).z, centre[i]];
    json!({
        "file_path": file_path(photograph),
        "w": intrinsics.size[0],
        "h": intrinsics.size[1],
        "fl_x": intrinsics.focal.x,
        "fl_y": intrinsics.focal.y,
        "cx": intrinsics.centre.x,
        "cy": intrinsics.centre.y,
        "transform_matrix": [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]],
    })
}
