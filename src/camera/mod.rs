//! Cameras: what they see of a point. Layer 1.
//!
//! Axes are those of OpenCV: x to the right of the picture, y down, z forward. Pixels are counted from the picture's
//! upper left corner, so that the first pixel's centre is (0.5, 0.5).

mod distortion;
mod intrinsics;
mod pose;

pub use distortion::Distortion;
pub use intrinsics::Intrinsics;
pub use pose::{Pose, PoseError};

use glam::{DVec2, DVec3};

/// A camera: where it stands, its lens, and its picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// From the world to the camera's axes.
    pub pose: Pose,
    /// What the lens bends.
    pub distortion: Distortion,
    /// From directions to pixels.
    pub intrinsics: Intrinsics,
}

impl Camera {
    /// The pixel that shows a point of the world, lens included; `None` for points behind the camera.
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        let seen = self.pose.to_camera(point);
        (seen.z > 0.0).then(|| {
            let straight = seen.truncate() / seen.z;
            self.intrinsics.pixel(self.distortion.distort(straight))
        })
    }

    /// The unit direction in the world from the camera's centre through a pixel; `None` where the lens shows nothing,
    /// beyond the radius at which its formula turns back.
    pub fn ray(&self, pixel: DVec2) -> Option<DVec3> {
        let straight = self.distortion.undistort(self.intrinsics.direction(pixel))?;
        Some(self.pose.rotation.transpose() * straight.extend(1.0).normalize())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DMat4, DQuat};

    fn camera() -> Camera {
        let rotation = DMat3::from_quat(DQuat::from_xyzw(0.1, -0.3, 0.2, 0.9).normalize());
        Camera {
            pose: Pose { rotation, translation: DVec3::new(0.2, -0.1, 3.0) },
            distortion: Distortion::Brown {
                radial: [-0.2, 0.05, 0.01, 0.0],
                denominator: [0.0; 3],
                tangential: [1e-3, -2e-3],
            },
            intrinsics: Intrinsics {
                size: [640, 480],
                focal: DVec2::new(600.0, 610.0),
                centre: DVec2::new(322.0, 236.0),
                skew: 0.5,
            },
        }
    }

    #[test]
    fn the_ray_through_a_point_s_pixel_meets_the_point() {
        let camera = camera();
        for point in [DVec3::ZERO, DVec3::new(0.5, 0.3, -0.4), DVec3::new(-0.6, 0.2, 0.7)] {
            let ray = camera.ray(camera.project(point).unwrap()).unwrap();
            let towards = (point - camera.pose.centre()).normalize();
            assert!(ray.distance(towards) < 1e-9, "{ray} {towards}");
        }
    }

    #[test]
    fn nothing_behind_the_camera_is_seen() {
        let camera = camera();
        let behind = camera.pose.centre() - (DVec3::ZERO - camera.pose.centre());
        assert_eq!(camera.project(behind), None);
    }

    #[test]
    fn a_pose_and_its_matrix_are_one() {
        let pose = camera().pose;
        let to_world = DMat4::from_cols(
            pose.rotation.transpose().x_axis.extend(0.0),
            pose.rotation.transpose().y_axis.extend(0.0),
            pose.rotation.transpose().z_axis.extend(0.0),
            pose.centre().extend(1.0),
        );
        let back = Pose::of_camera_to_world(to_world).unwrap();
        assert!(back.translation.distance(pose.translation) < 1e-12);
        assert!(back.centre().distance(pose.centre()) < 1e-12);
    }
}
