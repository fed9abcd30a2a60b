use glam::DVec3;

/// A stroke of sculpting: moves and stretches what lies around a place, smoothly less towards its reach.
#[derive(Debug, Clone, Copy)]
pub(super) struct Brush {
    /// The place.
    pub centre: DVec3,
    /// Half-axes of the ellipsoid outside of which nothing moves.
    pub reach: DVec3,
    /// The displacement at the centre.
    pub shift: DVec3,
    /// Growth along each axis, away from the centre.
    pub stretch: DVec3,
    /// Whether the other half of the head gets the mirrored stroke too.
    pub mirrored: bool,
}

impl Brush {
    /// A stroke that moves.
    pub const fn shifting(centre: [f64; 3], reach: [f64; 3], shift: [f64; 3]) -> Self {
        let (centre, reach) = (DVec3::from_array(centre), DVec3::from_array(reach));
        Self { centre, reach, shift: DVec3::from_array(shift), stretch: DVec3::ZERO, mirrored: false }
    }

    /// A stroke that stretches.
    pub const fn stretching(centre: [f64; 3], reach: [f64; 3], stretch: [f64; 3]) -> Self {
        let still = Self::shifting(centre, reach, [0.0; 3]);
        Self { stretch: DVec3::from_array(stretch), ..still }
    }

    /// The same on both halves of the head.
    pub const fn on_both_sides(self) -> Self {
        Self { mirrored: true, ..self }
    }

    /// How far the stroke moves `point`.
    pub fn displacement(&self, point: DVec3) -> DVec3 {
        let here = self.one_side(point);
        if self.mirrored { here + mirror(self.one_side(mirror(point))) } else { here }
    }

    fn one_side(&self, point: DVec3) -> DVec3 {
        let away = point - self.centre;
        let weight = falloff((away / self.reach).length_squared());
        if weight == 0.0 { DVec3::ZERO } else { weight * (self.shift + self.stretch * away) }
    }
}

/// The point on the other half of the head.
pub(super) fn mirror(point: DVec3) -> DVec3 {
    DVec3::new(-point.x, point.y, point.z)
}

/// 1 at 0, falling smoothly (twice differentiable) to 0 where the squared distance reaches 1.
pub(super) fn falloff(squared: f64) -> f64 {
    (1.0 - squared).max(0.0).powi(3)
}

/// Rises smoothly from 0 at `from` to 1 at `to`.
pub(super) fn rise(from: f64, to: f64, x: f64) -> f64 {
    let at = ((x - from) / (to - from)).clamp(0.0, 1.0);
    at * at * at * (at * (6.0 * at - 15.0) + 10.0)
}
