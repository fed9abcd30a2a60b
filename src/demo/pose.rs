use glam::{DQuat, DVec3};

use super::Random;

/// Where a head is in its file: turned, then moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// The turn about the head's middle.
    pub turn: DQuat,
    /// The move after it, in centimetres.
    pub shift: DVec3,
}

impl Pose {
    /// Upright at the origin.
    pub const UPRIGHT: Self = Self { turn: DQuat::IDENTITY, shift: DVec3::ZERO };

    /// A little turned and moved.
    pub fn random(random: &mut Random) -> Self {
        const DEGREES: f64 = 8.0;
        let turn = random.turn(DEGREES.to_radians());
        Self { turn, shift: 2.0 * random.direction() }
    }

    /// Where the pose brings a point.
    pub fn applied(&self, point: DVec3) -> DVec3 {
        self.turn * point + self.shift
    }
}
