use std::ops::{Mul, Sub};

use glam::{Vec3A, Vec4};

/// Four 3D vectors side by side, one a lane, so that one SSE instruction serves all four.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Lanes {
    pub x: Vec4,
    pub y: Vec4,
    pub z: Vec4,
}

impl Lanes {
    /// The same vector in every lane.
    #[inline]
    pub fn splat(v: Vec3A) -> Self {
        Self { x: Vec4::splat(v.x), y: Vec4::splat(v.y), z: Vec4::splat(v.z) }
    }

    /// A vector for each lane.
    #[inline]
    pub fn new(v: [Vec3A; 4]) -> Self {
        let axis = |k: usize| Vec4::new(v[0][k], v[1][k], v[2][k], v[3][k]);
        Self { x: axis(0), y: axis(1), z: axis(2) }
    }

    /// The vector in one lane.
    #[inline]
    pub fn get(&self, lane: usize) -> Vec3A {
        Vec3A::new(self.x[lane], self.y[lane], self.z[lane])
    }

    /// Changes the vector in one lane.
    #[inline]
    pub fn set(&mut self, lane: usize, v: Vec3A) {
        (self.x[lane], self.y[lane], self.z[lane]) = (v.x, v.y, v.z);
    }

    #[inline]
    pub fn dot(self, other: Self) -> Vec4 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline]
    pub fn length_squared(self) -> Vec4 {
        self.dot(self)
    }

    #[inline]
    pub fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    #[inline]
    pub fn max(self, other: Self) -> Self {
        Self { x: self.x.max(other.x), y: self.y.max(other.y), z: self.z.max(other.z) }
    }
}

impl Sub for Lanes {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl Mul<Vec4> for Lanes {
    type Output = Self;
    #[inline]
    fn mul(self, scale: Vec4) -> Self {
        Self { x: self.x * scale, y: self.y * scale, z: self.z * scale }
    }
}
