use glam::{DMat4, DVec4};
use serde::Deserialize;
use serde_json::value::RawValue;

use super::Frame;
use super::lens::{brown, checked, pinhole, size};
use crate::camera::{Camera, Distortion, Intrinsics, Pose};
use crate::formats::error::Fault;
use crate::formats::text::without_mark;

/// `transforms.json` of instant-ngp and nerfstudio: one camera for all, whose numbers a frame may override.
#[derive(Deserialize)]
struct Transforms<'a> {
    #[serde(flatten)]
    camera: Lens,
    #[serde(borrow)]
    frames: Vec<&'a RawValue>,
}

#[derive(Deserialize)]
struct FrameEntry {
    file_path: String,
    mask_path: Option<String>,
    transform_matrix: Vec<Vec<f64>>,
    #[serde(flatten)]
    camera: Lens,
}

#[derive(Deserialize, Clone, Default)]
struct Lens {
    camera_model: Option<String>,
    is_fisheye: Option<bool>,
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

/// The frames of the file; where it does not say how large its pictures are, cameras of size zero have focal lengths and
/// centre in widths.
pub(super) fn read(bytes: &[u8]) -> Result<Vec<Frame>, Fault> {
    let wrong = |error: serde_json::Error| Fault::at("its JSON", format!("is no transforms.json: {error}"));
    let transforms: Transforms = serde_json::from_slice(without_mark(bytes)).map_err(wrong)?;
    let frame = |(at, raw): (usize, &&RawValue)| {
        let place = format!("frames[{at}]");
        let entry: FrameEntry =
            serde_json::from_str(raw.get()).map_err(|error| Fault::at(&place, error.to_string()))?;
        let pose = pose(&entry.transform_matrix, &format!("{place}.transform_matrix"))?;
        let lens = entry.camera.over(&transforms.camera);
        let (intrinsics, distortion) = lens.read(&place)?;
        let camera = Camera { pose, distortion, intrinsics };
        Ok(Frame { name: entry.file_path, mask: entry.mask_path, camera })
    };
    transforms.frames.iter().enumerate().map(frame).collect()
}

/// From rows of a matrix that takes OpenGL's camera axes (y up, z backwards) to the world.
fn pose(rows: &[Vec<f64>], place: &str) -> Result<Pose, Fault> {
    let row = |at: usize| match rows.get(at).map(Vec::as_slice) {
        Some(&[a, b, c, d]) => Ok(DVec4::new(a, b, c, d)),
        _ => Err(Fault::at(place, "must be four rows of four numbers")),
    };
    let to_world = DMat4::from_cols(row(0)?, row(1)?, row(2)?, DVec4::W).transpose();
    let to_opengl = DMat4::from_diagonal(DVec4::new(1.0, -1.0, -1.0, 1.0));
    Pose::of_camera_to_world(to_world * to_opengl).map_err(|error| Fault::at(place, error.to_string()))
}

impl Lens {
    /// These numbers, and the others' where there is none.
    fn over(&self, other: &Self) -> Self {
        Self {
            camera_model: self.camera_model.clone().or_else(|| other.camera_model.clone()),
            is_fisheye: self.is_fisheye.or(other.is_fisheye),
            camera_angle_x: self.camera_angle_x.or(other.camera_angle_x),
            camera_angle_y: self.camera_angle_y.or(other.camera_angle_y),
            w: self.w.or(other.w),
            h: self.h.or(other.h),
            fl_x: self.fl_x.or(other.fl_x),
            fl_y: self.fl_y.or(other.fl_y),
            cx: self.cx.or(other.cx),
            cy: self.cy.or(other.cy),
            k1: self.k1.or(other.k1),
            k2: self.k2.or(other.k2),
            k3: self.k3.or(other.k3),
            k4: self.k4.or(other.k4),
            p1: self.p1.or(other.p1),
            p2: self.p2.or(other.p2),
        }
    }

    fn read(&self, place: &str) -> Result<(Intrinsics, Distortion), Fault> {
        let distortion = self.distortion(place)?;
        let intrinsics = match (self.w, self.h) {
            (Some(width), Some(height)) => {
                let size = size(width.round() as u64, height.round() as u64, place)?;
                self.intrinsics(size, place)?
            }
            _ => self.without_size(place)?,
        };
        checked(intrinsics, distortion, place)
    }

    fn intrinsics(&self, size: [u32; 2], place: &str) -> Result<Intrinsics, Fault> {
        let [width, height] = size.map(f64::from);
        let by_angle = |length: f64, angle: f64| 0.5 * length / (0.5 * angle).tan();
        let across = self.fl_x.or(self.camera_angle_x.map(|angle| by_angle(width, angle)));
        let down = self.fl_y.or(self.camera_angle_y.map(|angle| by_angle(height, angle)));
        let (Some(across), Some(down)) = (across.or(down), down.or(across)) else {
            return Err(no_focal(place));
        };
        let centre = [self.cx.unwrap_or(0.5 * width), self.cy.unwrap_or(0.5 * height)];
        Ok(pinhole(size, [across, down], centre))
    }

    /// The field of view alone, of a picture whose size is yet to be read: its width is one.
    fn without_size(&self, place: &str) -> Result<Intrinsics, Fault> {
        if self.fl_x.is_some() || self.fl_y.is_some() || self.cx.is_some() || self.cy.is_some() {
            return Err(Fault::at(place, "has lengths in pixels and no w and h: add the pictures' size"));
        }
        let angle = self.camera_angle_x.ok_or_else(|| no_focal(place))?;
        Ok(pinhole([0, 0], [0.5 / (0.5 * angle).tan(); 2], [0.5, 0.5]))
    }

    fn distortion(&self, place: &str) -> Result<Distortion, Fault> {
        let [k1, k2, k3, k4] = [self.k1, self.k2, self.k3, self.k4].map(|k| k.unwrap_or(0.0));
        let fisheye = self.is_fisheye.unwrap_or(false);
        match self.camera_model.as_deref() {
            Some("OPENCV_FISHEYE") => Ok(Distortion::Fisheye { radial: [k1, k2, k3, k4] }),
            _ if fisheye => Ok(Distortion::Fisheye { radial: [k1, k2, k3, k4] }),
            None
            | Some("OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" | "PERSPECTIVE") => {
                let tangential = [self.p1, self.p2].map(|p| p.unwrap_or(0.0));
                Ok(brown([k1, k2, k3, k4], [0.0; 3], tangential))
            }
            Some(other) => {
                let problem =
                    format!("has the camera_model `{other}`: use OPENCV, OPENCV_FISHEYE or PINHOLE");
                Err(Fault::at(place, problem))
            }
        }
    }
}

fn no_focal(place: &str) -> Fault {
    Fault::at(place, "has no focal length: give fl_x, or camera_angle_x in radians")
}
