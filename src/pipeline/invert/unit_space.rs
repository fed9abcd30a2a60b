use glam::{DVec3, Vec3A};

use crate::camera::Pose;

/// The world moved and scaled so that the hull's middle is the origin and its farthest cell at distance one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitSpace {
    /// The middle in the world.
    pub centre: DVec3,
    /// The length that becomes one.
    pub radius: f64,
}

impl UnitSpace {
    /// A camera's pose in it: x_c / r = R p + (R c + t) / r shows the same pixels.
    pub fn pose(&self, pose: &Pose) -> Pose {
        let translation = (pose.rotation * self.centre + pose.translation) / self.radius;
        Pose { rotation: pose.rotation, translation }
    }

    /// A point of the world in it.
    pub fn to_unit(&self, point: DVec3) -> Vec3A {
        ((point - self.centre) / self.radius).as_vec3a()
    }

    /// A point of it in the world.
    pub fn to_world(&self, point: Vec3A) -> DVec3 {
        point.as_dvec3() * self.radius + self.centre
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_sees_the_same_in_both_spaces() {
        let pose = Pose::looking(DVec3::new(500.0, 40.0, 30.0), DVec3::new(20.0, 30.0, 10.0), DVec3::Y);
        let space = UnitSpace { centre: DVec3::new(22.0, 31.0, 9.0), radius: 120.0 };
        let point = Vec3A::new(0.3, -0.2, 0.5);
        let there = space.pose(&pose).to_camera(point.as_dvec3());
        let here = pose.to_camera(space.to_world(point));
        assert!((there * 120.0).distance(here) < 1e-4, "{there} {here}");
        assert!(space.to_unit(space.to_world(point)).distance(point) < 1e-6);
    }
}
