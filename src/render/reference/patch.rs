use glam::{Vec2, Vec3A};

use super::corner::{Corner, doubled_area};

/// Least doubled area in square pixels of a triangle whose corners are moved by what its pixels show: the gradient of
/// interpolation grows as the inverse of it.
pub(in crate::render) const LEAST_AREA: f32 = 1.0 / 32.0;

/// A triangle before a camera, for interpolation across it.
///
/// With h_k the homogeneous corners, taken from an origin on the picture, a pixel X = (x, y, 1) shows the point with
/// weights b_k = a_k / sum a, a_0 = (h_1 x h_2) . X, and cyclically (Olano and Greer 1997, "Triangle Scan Conversion
/// using 2D Homogeneous Coordinates").
#[derive(Debug, Clone, Copy)]
pub struct Patch {
    /// The origin's column and row: what is far from the picture's corner would cancel there.
    pub origin: [i32; 2],
    /// h.
    pub corners: [Vec3A; 3],
    /// h_1 x h_2, h_2 x h_0, h_0 x h_1.
    planes: [Vec3A; 3],
    /// Whether its pixels move its corners.
    pub is_wide: bool,
}

impl Patch {
    /// Of a triangle's corners, which all are before the camera.
    #[inline]
    pub fn new(origin: [i32; 2], corners: [&Corner; 3]) -> Self {
        let [x, y] = [origin[0] as f32 + 0.5, origin[1] as f32 + 0.5];
        let is_wide = doubled_area(corners.map(|corner| corner.pixel)).abs() >= LEAST_AREA;
        let corners = corners.map(|corner| {
            let h = corner.homogeneous;
            Vec3A::new(h.x - x * h.z, h.y - y * h.z, h.z)
        });
        let [h0, h1, h2] = corners;
        Self { origin, corners, planes: [h1.cross(h2), h2.cross(h0), h0.cross(h1)], is_wide }
    }

    /// The pixel as seen from the origin, and what weighs the corners there.
    #[inline]
    pub fn at(&self, x: i32, y: i32) -> Weights {
        let from = Vec2::new((x - self.origin[0]) as f32, (y - self.origin[1]) as f32);
        let from = Vec3A::new(from.x, from.y, 1.0);
        let a = self.planes.map(|plane| plane.dot(from));
        let sum = a[0] + a[1] + a[2];
        let inverse_sum = if sum == 0.0 { 0.0 } else { 1.0 / sum };
        // A pixel's centre may lie outside by the rounding of corners, and by much outside of a sliver.
        let clamped = a.map(|a| (a * inverse_sum).max(0.0));
        let total = clamped[0] + clamped[1] + clamped[2];
        let scale = if total == 0.0 { 0.0 } else { 1.0 / total };
        Weights { from, inverse_sum, corners: clamped.map(|weight| weight * scale) }
    }
}

/// How a pixel weighs a triangle's corners.
#[derive(Debug, Clone, Copy)]
pub struct Weights {
    /// X.
    pub from: Vec3A,
    /// 1 / sum a.
    pub inverse_sum: f32,
    /// b, none negative, with sum one.
    pub corners: [f32; 3],
}

impl Weights {
    /// The weighted mean of what the corners have.
    #[inline]
    pub fn mean(&self, values: [Vec3A; 3]) -> Vec3A {
        let [a, b, c] = self.corners;
        values[0] * a + values[1] * b + values[2] * c
    }
}
