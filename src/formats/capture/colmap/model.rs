use crate::camera::{Distortion, Intrinsics};
use crate::formats::capture::lens::{brown, checked, pinhole, size};
use crate::formats::error::Fault;

/// A model's number, name and count of parameters, as COLMAP lists them.
pub(super) const MODELS: [(i64, &str, usize); 11] = [
    (0, "SIMPLE_PINHOLE", 3),
    (1, "PINHOLE", 4),
    (2, "SIMPLE_RADIAL", 4),
    (3, "RADIAL", 5),
    (4, "OPENCV", 8),
    (5, "OPENCV_FISHEYE", 8),
    (6, "FULL_OPENCV", 12),
    (7, "FOV", 5),
    (8, "SIMPLE_RADIAL_FISHEYE", 4),
    (9, "RADIAL_FISHEYE", 5),
    (10, "THIN_PRISM_FISHEYE", 12),
];

/// A camera of a model by its parameters.
pub(super) fn lens(
    model: &str,
    [width, height]: [u64; 2],
    parameters: &[f64],
    place: &str,
) -> Result<(Intrinsics, Distortion), Fault> {
    let size = size(width, height, place)?;
    let fisheye = |k1, k2, k3, k4| Distortion::Fisheye { radial: [k1, k2, k3, k4] };
    let radial = |k1, k2| brown([k1, k2, 0.0, 0.0], [0.0; 3], [0.0; 2]);
    let (focal, centre, distortion) = match (model, parameters) {
        ("SIMPLE_PINHOLE", &[f, cx, cy]) => ([f, f], [cx, cy], Distortion::None),
        ("PINHOLE", &[fx, fy, cx, cy]) => ([fx, fy], [cx, cy], Distortion::None),
        ("SIMPLE_RADIAL", &[f, cx, cy, k]) => ([f, f], [cx, cy], radial(k, 0.0)),
        ("RADIAL", &[f, cx, cy, k1, k2]) => ([f, f], [cx, cy], radial(k1, k2)),
        ("OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2]) => {
            ([fx, fy], [cx, cy], brown([k1, k2, 0.0, 0.0], [0.0; 3], [p1, p2]))
        }
        ("OPENCV_FISHEYE", &[fx, fy, cx, cy, k1, k2, k3, k4]) => {
            ([fx, fy], [cx, cy], fisheye(k1, k2, k3, k4))
        }
        ("FULL_OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6]) => {
            ([fx, fy], [cx, cy], brown([k1, k2, k3, 0.0], [k4, k5, k6], [p1, p2]))
        }
        ("SIMPLE_RADIAL_FISHEYE", &[f, cx, cy, k]) => ([f, f], [cx, cy], fisheye(k, 0.0, 0.0, 0.0)),
        ("RADIAL_FISHEYE", &[f, cx, cy, k1, k2]) => ([f, f], [cx, cy], fisheye(k1, k2, 0.0, 0.0)),
        (model, parameters) => return Err(no_lens(model, parameters.len(), place)),
    };
    checked(pinhole(size, focal, centre), distortion, place)
}

fn no_lens(model: &str, parameters: usize, place: &str) -> Fault {
    let known = MODELS.iter().find(|(_, name, _)| *name == model);
    match known {
        Some(&(_, _, count)) if count != parameters => {
            Fault::at(place, format!("has {parameters} parameters; {model} has {count}"))
        }
        _ => {
            let problem =
                format!("has the model {model}, which is not read: undistort the images with COLMAP first");
            Fault::at(place, problem)
        }
    }
}
