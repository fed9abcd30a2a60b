use glam::{DMat3, DVec3};

use crate::camera::{Intrinsics, Pose};

/// A pinhole camera with its picture's size, the lens already undone.
///
/// Rows run from the top, the first pixel's centre is (0.5, 0.5), axes are those of [`crate::camera`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// From the world to the camera's axes.
    pub pose: Pose,
    /// From directions to pixels.
    pub intrinsics: Intrinsics,
}

impl View {
    /// Width and height in pixels.
    pub fn size(&self) -> [usize; 2] {
        self.intrinsics.size.map(|side| side as usize)
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.size().iter().product()
    }

    /// H = K [R | t], the rows `[3, 4]` that take a point of the world to (u w, v w, w): its pixel (u, v) and its depth w.
    pub fn projection(&self) -> [[f32; 4]; 3] {
        let Intrinsics { focal, centre, skew, .. } = self.intrinsics;
        let lens = DMat3::from_cols(
            DVec3::new(focal.x, 0.0, 0.0),
            DVec3::new(skew, focal.y, 0.0),
            DVec3::new(centre.x, centre.y, 1.0),
        );
        let turned = lens * self.pose.rotation;
        let moved = lens * self.pose.translation;
        [0, 1, 2].map(|row| {
            let axes = turned.row(row);
            [axes.x, axes.y, axes.z, moved[row]].map(|entry| entry as f32)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Distortion};
    use glam::DVec2;

    #[test]
    fn projects_as_its_camera() {
        let pose = Pose::looking(DVec3::new(1.0, 0.4, 3.0), DVec3::new(0.1, 0.0, 0.2), DVec3::Y);
        let intrinsics = Intrinsics {
            size: [640, 480],
            focal: DVec2::new(600.0, 610.0),
            centre: DVec2::new(322.0, 236.0),
            skew: 0.5,
        };
        let point = DVec3::new(0.3, -0.2, 0.5);
        let rows = View { pose, intrinsics }.projection();
        let [u, v, w] = rows.map(|row| point.extend(1.0).dot(glam::Vec4::from_array(row).as_dvec4()));
        let camera = Camera { pose, distortion: Distortion::None, intrinsics };
        let pixel = camera.project(point).unwrap();
        assert!(DVec2::new(u / w, v / w).distance(pixel) < 1e-3);
        assert!((w - pose.to_camera(point).z).abs() < 1e-6);
    }
}
