//! Surfaces and cameras to test with.

use glam::{DVec3, Vec3A};

use super::{Light, Surface, Target, View};
use crate::camera::{Intrinsics, Pose};
use crate::mesh::{Icosphere, Normals, Topology};
use crate::numeric::Random;

/// A surface with what it looks like.
#[derive(Debug, Clone)]
pub struct Scene {
    pub topology: Topology,
    pub positions: Vec<Vec3A>,
    pub normals: Vec<Vec3A>,
    pub albedo: Vec<[f32; 3]>,
}

impl Scene {
    fn new(positions: Vec<Vec3A>, triangles: &[[u32; 3]]) -> Self {
        let topology = Topology::new(positions.len(), triangles);
        let normals = Normals::new(&topology, &positions).vertices;
        let albedo =
            positions.iter().map(|p| (0.65 + 0.35 * (3.0 * *p + 1.0).map(f32::sin)).to_array()).collect();
        Self { topology, positions, normals, albedo }
    }

    /// A sphere with bumps, about one in radius.
    pub fn bumpy(level: u32) -> Self {
        let (positions, triangles) = ball(level, |p| {
            let [x, y, z] = p.to_array();
            p * (1.0 + 0.05 * ((7.0 * x).sin() * (6.0 * y).cos() + (5.0 * z).sin()))
        });
        Self::new(positions, &triangles)
    }

    /// A ball with a smaller flat one before its side as seen along z: an outline before a surface.
    pub fn eared() -> Self {
        let (mut positions, mut triangles) = ball(3, |p| 0.8 * p);
        let first = positions.len() as u32;
        let (ear, more) = ball(2, |p| Vec3A::new(0.35, 0.45, 0.2) * p + Vec3A::new(0.3, 0.1, 1.2));
        positions.extend(ear);
        triangles.extend(more.into_iter().map(|corners| corners.map(|corner| corner + first)));
        Self::new(positions, &triangles)
    }

    /// The half of a bumpy ball that is above a plane: a rim, and an inside that is seen.
    pub fn bowl() -> Self {
        let Self { topology, positions, .. } = Self::bumpy(3);
        let above = |&corner: &u32| positions[corner as usize].dot(Vec3A::new(0.3, 0.2, 0.9)) > 0.1;
        let kept: Vec<_> =
            topology.triangles.iter().copied().filter(|corners| corners.iter().all(above)).collect();
        Self::new(positions, &kept)
    }

    pub fn surface(&self) -> Surface<'_> {
        Surface { positions: &self.positions, normals: &self.normals, albedo: Some(&self.albedo) }
    }

    /// The same triangles on other positions, with their normals.
    pub fn moved(&self, positions: Vec<Vec3A>) -> Self {
        let normals = Normals::new(&self.topology, &positions).vertices;
        Self { positions, normals, ..self.clone() }
    }
}

fn ball(level: u32, shape: impl Fn(Vec3A) -> Vec3A) -> (Vec<Vec3A>, Vec<[u32; 3]>) {
    let Icosphere { positions, triangles } = Icosphere::new(level);
    (positions.iter().map(|p| shape(p.as_vec3a())).collect(), triangles)
}

/// Cameras around the origin, the first on the axis z.
pub fn views(count: usize, size: [u32; 2]) -> Vec<View> {
    (0..count)
        .map(|i| {
            let height = 1.0 - 2.0 * i as f64 / count as f64;
            let around = 2.399_963 * i as f64;
            let flat = (1.0 - height * height).sqrt();
            let centre = 4.0 * DVec3::new(flat * around.cos(), flat * around.sin(), height);
            let up = if flat < 0.5 { DVec3::Y } else { DVec3::Z };
            let mut intrinsics = Intrinsics::with_angle(size, 0.7);
            intrinsics.skew = 0.01 * f64::from(size[0]);
            View { pose: Pose::looking(centre, DVec3::new(0.02, 0.01, 0.0), up), intrinsics }
        })
        .collect()
}

/// Some light from every side.
pub fn light() -> Light {
    let mut random = Random::new(2);
    let mut factors = [[0; 3]; 9].map(|row| row.map(|_| 0.15 * random.signed() as f32));
    factors[0] = [0.6, 0.5, 0.7];
    Light(factors)
}

/// Targets whose colours are, in patches, below or above all that is drawn: differences do not change their sign.
pub fn targets(views: &[View], random: &mut Random) -> Vec<Target> {
    views
        .iter()
        .map(|&view| {
            let [width, height] = view.size();
            let patches: Vec<[f32; 3]> =
                (0..4).map(|_| [0; 3].map(|_| if random.unit() < 0.5 { -1.0 } else { 3.0 })).collect();
            let patch = |x: usize, y: usize| patches[(2 * y / height) * 2 + 2 * x / width];
            let colours = (0..width * height).map(|i| patch(i % width, i / width)).collect();
            let weights = (0..width * height).map(|i| if i % 7 == 0 { 0.5 } else { 1.0 }).collect();
            Target { view, light: light(), background: [0.1, 0.2, 0.05], colours, weights: Some(weights) }
        })
        .collect()
}
