//! The colour of what each pixel's centre sees.

use glam::Vec3A;

use super::corner::Corner;
use super::lamp::Lamp;
use super::patch::{Patch, Weights};
use super::raster::Raster;
use crate::render::{Light, Surface};

/// Least length of an interpolated normal that is scaled to one.
pub(in crate::render) const LEAST_NORMAL: f32 = 1e-6;

/// What the corners of a triangle look like.
#[derive(Debug, Clone, Copy)]
pub struct Looks {
    pub normals: [Vec3A; 3],
    pub albedo: Option<[Vec3A; 3]>,
}

impl Looks {
    #[inline]
    pub fn new(surface: &Surface<'_>, corners: [u32; 3]) -> Self {
        let corners = corners.map(|corner| corner as usize);
        let albedo = surface.albedo.map(|albedo| corners.map(|corner| Vec3A::from_array(albedo[corner])));
        Self { normals: corners.map(|corner| surface.normals[corner]), albedo }
    }

    /// The unit normal at a pixel, and one over the length that it had.
    #[inline]
    pub fn normal(&self, weights: &Weights) -> (Vec3A, f32) {
        let normal = weights.mean(self.normals);
        let inverse = 1.0 / normal.length().max(LEAST_NORMAL);
        (normal * inverse, inverse)
    }
}

/// Sets the colours `[H * W]` of a raster.
pub fn shade(
    raster: &Raster,
    corners: &[Corner],
    triangles: &[[u32; 3]],
    surface: &Surface<'_>,
    light: &Light,
    background: [f32; 3],
    colours: &mut Vec<Vec3A>,
) {
    let lamp = Lamp::new(light);
    colours.clear();
    colours.resize(raster.ids.len(), Vec3A::from_array(background));
    let rows = raster.ids.chunks_exact(raster.width).zip(colours.chunks_exact_mut(raster.width));
    for (y, (ids, colours)) in rows.enumerate() {
        let mut last: Option<(u32, Patch, Looks)> = None;
        for (x, (&id, colour)) in ids.iter().zip(colours).enumerate().filter(|(_, (id, _))| **id != 0) {
            let (x, y) = (x as i32, y as i32);
            // Neighbours mostly see the same triangle.
            if last.as_ref().is_none_or(|(seen, ..)| *seen != id) {
                let ends = triangles[id as usize - 1];
                let patch = Patch::new([x, y], ends.map(|end| &corners[end as usize]));
                last = Some((id, patch, Looks::new(surface, ends)));
            }
            let Some((_, patch, looks)) = &last else { continue };
            let weights = patch.at(x, y);
            let (normal, _) = looks.normal(&weights);
            let albedo = looks.albedo.map_or(Vec3A::ONE, |albedo| weights.mean(albedo));
            *colour = albedo * lamp.colour(normal);
        }
    }
}
