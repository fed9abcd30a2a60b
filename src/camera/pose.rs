use glam::{DMat3, DMat4, DVec3};

/// From the world to a camera's axes: x_c = R x + t.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// R.
    pub rotation: DMat3,
    /// t.
    pub translation: DVec3,
}

/// Why a matrix is no camera's place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PoseError {
    /// A number is not finite.
    #[error("holds a number that is not finite")]
    NotFinite,
    /// Its axes lie in one plane.
    #[error("is singular: its three axes must stand square to each other")]
    Singular,
    /// Its axes are left-handed.
    #[error("mirrors: its axes are left-handed; negate one axis, or export with right-handed axes")]
    Mirrored,
    /// Its axes are of different lengths or not square to each other.
    #[error("is sheared: its three axes must be equally long and stand square to each other")]
    Sheared,
}

/// How far from square, and from each other's length, axes may be that were rounded on their way.
const ROUNDED: f64 = 1e-2;

/// Least volume of axes that span something, relative to their longest one's cube.
const SPANNED: f64 = 1e-6;

impl Pose {
    /// The pose of a camera by the matrix that takes its own axes to the world, which may be scaled; the scale is left
    /// out, the centre is the last column.
    ///
    /// # Errors
    /// [`PoseError`].
    pub fn of_camera_to_world(matrix: DMat4) -> Result<Self, PoseError> {
        if !matrix.is_finite() {
            return Err(PoseError::NotFinite);
        }
        let axes = DMat3::from_mat4(matrix);
        let lengths = [axes.x_axis, axes.y_axis, axes.z_axis].map(|axis| axis.length());
        let longest = lengths.into_iter().fold(0.0, f64::max);
        let volume = axes.determinant();
        if !(volume.abs() > SPANNED * longest.powi(3)) {
            return Err(PoseError::Singular);
        }
        if volume < 0.0 {
            return Err(PoseError::Mirrored);
        }
        let rotation = axes * volume.cbrt().recip();
        let off = rotation.transpose() * rotation - DMat3::IDENTITY;
        if off.to_cols_array().iter().any(|entry| entry.abs() > 2.0 * ROUNDED) {
            return Err(PoseError::Sheared);
        }
        let rotation = nearest_rotation(rotation).transpose();
        let centre = matrix.w_axis.truncate();
        Ok(Self { rotation, translation: -(rotation * centre) })
    }

    /// A point of the world in the camera's axes.
    pub fn to_camera(&self, point: DVec3) -> DVec3 {
        self.rotation * point + self.translation
    }

    /// Where the camera stands in the world.
    pub fn centre(&self) -> DVec3 {
        -(self.rotation.transpose() * self.translation)
    }

    /// The direction in which it looks.
    pub fn forward(&self) -> DVec3 {
        self.rotation.transpose().z_axis
    }

    /// The camera that stands at `centre` and looks at `target`, with `up` upwards in its picture.
    pub fn looking(centre: DVec3, target: DVec3, up: DVec3) -> Self {
        let forward = (target - centre).normalize_or(DVec3::Z);
        let right = forward.cross(up).normalize_or(forward.any_orthonormal_vector());
        let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
        Self { rotation, translation: -(rotation * centre) }
    }
}

/// The rotation nearest to a matrix that almost is one, by Newton's iteration for the polar decomposition.
fn nearest_rotation(mut matrix: DMat3) -> DMat3 {
    for _ in 0..8 {
        matrix = (matrix + matrix.inverse().transpose()) * 0.5;
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn matrix(axes: DMat3) -> DMat4 {
        let mut matrix = DMat4::from_mat3(axes);
        matrix.w_axis = DVec3::new(1.0, 2.0, 3.0).extend(1.0);
        matrix
    }

    #[test]
    fn a_scaled_and_rounded_matrix_is_a_rotation() {
        let rotation = DMat3::from_quat(DQuat::from_xyzw(0.3, 0.1, -0.2, 0.8).normalize());
        let mut rounded = rotation * 2.5;
        rounded.x_axis.y += 1e-3;
        let pose = Pose::of_camera_to_world(matrix(rounded)).unwrap();
        let square = pose.rotation * pose.rotation.transpose() - DMat3::IDENTITY;
        assert!(square.to_cols_array().iter().all(|entry| entry.abs() < 1e-12));
        assert!(pose.centre().distance(DVec3::new(1.0, 2.0, 3.0)) < 1e-12);
        assert!(pose.forward().distance(rotation.z_axis) < 1e-3);
    }

    #[test]
    fn no_place_is_told_why() {
        let of = |axes| Pose::of_camera_to_world(matrix(axes));
        assert_eq!(of(DMat3::from_diagonal(DVec3::new(1.0, 1.0, 0.0))), Err(PoseError::Singular));
        assert_eq!(of(DMat3::ZERO), Err(PoseError::Singular));
        assert_eq!(of(DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0))), Err(PoseError::Mirrored));
        assert_eq!(of(DMat3::from_diagonal(DVec3::new(1.0, 1.2, 1.0))), Err(PoseError::Sheared));
        assert_eq!(of(DMat3::from_diagonal(DVec3::new(1.0, f64::NAN, 1.0))), Err(PoseError::NotFinite));
    }

    #[test]
    fn who_looks_at_a_point_sees_it_ahead_and_up_is_up() {
        let pose = Pose::looking(DVec3::new(3.0, 1.0, 2.0), DVec3::ZERO, DVec3::Y);
        let seen = pose.to_camera(DVec3::ZERO);
        assert!(seen.truncate().length() < 1e-12 && seen.z > 0.0);
        // y points down.
        assert!(pose.to_camera(DVec3::Y).y < 0.0);
        assert!((pose.rotation.determinant() - 1.0).abs() < 1e-12);
    }
}
