use glam::DVec3;

use super::TriangleId;

/// A point on a mesh that moves with it: a triangle and the barycentric weights of its corners (sum 1).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SurfacePoint {
    /// The triangle it lies on.
    pub triangle: TriangleId,
    /// Weights of the triangle's first, second and third corner.
    pub weights: [f64; 3],
}

/// The value at a point of a triangle: the mean of its corners' `values` with barycentric `weights`.
#[inline]
pub fn interpolate<T>(values: &[T], corners: [u32; 3], weights: [f32; 3]) -> T
where
    T: Copy + std::ops::Mul<f32, Output = T> + std::iter::Sum,
{
    corners.iter().zip(weights).map(|(&i, w)| values[i as usize] * w).sum()
}

/// Named landmark positions `[B, 3]` on one scan, in its own space; a missing landmark is `None`.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct LandmarkSet {
    /// The naming scheme, for instance `multipie68`, if one is stated.
    pub scheme: Option<String>,
    /// A name for each landmark, unique in the set; a plain list is named by its indices "0", "1", ...
    pub names: Vec<String>,
    /// A position for each name.
    pub points: Vec<Option<DVec3>>,
}

impl LandmarkSet {
    /// The landmark called `name`, if it is there and not missing.
    pub fn get(&self, name: &str) -> Option<DVec3> {
        let at = self.names.iter().position(|n| n == name)?;
        self.points[at]
    }

    /// The landmarks that are not missing, with their names.
    pub fn present(&self) -> impl Iterator<Item = (&str, DVec3)> {
        self.names.iter().zip(&self.points).filter_map(|(n, p)| p.map(|p| (n.as_str(), p)))
    }
}
