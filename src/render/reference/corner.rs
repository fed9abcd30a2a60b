use glam::{Vec2, Vec3A};
use rayon::prelude::*;

/// Nothing nearer to a camera than this is drawn, in the world's unit: depths are kept as inverses, for which any small
/// number does.
pub(in crate::render) const NEAR: f32 = 1e-6;

/// A vertex as a camera sees it.
#[derive(Debug, Clone, Copy, Default)]
pub struct Corner {
    /// (u w, v w, w).
    pub homogeneous: Vec3A,
    /// (u, v) in pixels.
    pub pixel: Vec2,
    /// 1 / w; zero for a vertex that is not before the camera.
    pub nearness: f32,
}

impl Corner {
    /// Projects a vertex by H `[3, 4]`.
    #[inline]
    pub fn new(projection: &[[f32; 4]; 3], position: Vec3A) -> Self {
        let along = |[x, y, z, moved]: [f32; 4]| x * position.x + y * position.y + z * position.z + moved;
        let homogeneous = Vec3A::from_array(projection.map(along));
        if homogeneous.z <= NEAR {
            return Self { homogeneous, ..Self::default() };
        }
        let nearness = 1.0 / homogeneous.z;
        let pixel = Vec2::new(homogeneous.x, homogeneous.y) * nearness;
        Self { homogeneous, pixel, nearness }
    }

    /// Whether the camera can see it.
    #[inline]
    pub fn is_before(&self) -> bool {
        self.nearness > 0.0
    }
}

/// Twice the area of a triangle on the picture; negative when its outside is seen, because rows run down.
#[inline]
pub fn doubled_area([a, b, c]: [Vec2; 3]) -> f32 {
    (b - a).perp_dot(c - a)
}

/// Projects every vertex `[N]`, keeping the memory.
pub fn project(projection: &[[f32; 4]; 3], positions: &[Vec3A], corners: &mut Vec<Corner>) {
    positions
        .par_iter()
        .with_min_len(4096)
        .map(|&position| Corner::new(projection, position))
        .collect_into_vec(corners);
}
