use glam::{Vec3A, Vec4};

use super::lanes::Lanes;

/// The axis-aligned box of some points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub min: Vec3A,
    pub max: Vec3A,
}

impl Bounds {
    /// The box of nothing: a union with it changes nothing, and it is infinitely far away.
    pub const EMPTY: Self = Self { min: Vec3A::INFINITY, max: Vec3A::NEG_INFINITY };

    #[inline]
    pub fn with(self, point: Vec3A) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }
}

/// Four boxes side by side.
#[derive(Debug, Clone, Copy)]
pub(super) struct Boxes {
    min: Lanes,
    max: Lanes,
}

impl Boxes {
    /// Four times [`Bounds::EMPTY`].
    pub fn empty() -> Self {
        Self { min: Lanes::splat(Vec3A::INFINITY), max: Lanes::splat(Vec3A::NEG_INFINITY) }
    }

    /// Changes one of the boxes.
    #[inline]
    pub fn set(&mut self, lane: usize, bounds: Bounds) {
        self.min.set(lane, bounds.min);
        self.max.set(lane, bounds.max);
    }

    /// The box around all four.
    #[inline]
    pub fn union(&self) -> Bounds {
        let (min, max) = (&self.min, &self.max);
        Bounds {
            min: Vec3A::new(min.x.min_element(), min.y.min_element(), min.z.min_element()),
            max: Vec3A::new(max.x.max_element(), max.y.max_element(), max.z.max_element()),
        }
    }

    /// Squared distances of the boxes from a point, the same in every lane of `p`.
    #[inline]
    pub fn distance_squared(&self, p: Lanes) -> Vec4 {
        // Zero comes first because the maximum of a NaN is the second operand: a NaN must not look near.
        Lanes::default().max((self.min - p).max(p - self.max)).length_squared()
    }
}
