use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use crate::mesh::TriangleMesh;
use crate::spatial::{Hit, SurfaceIndex};

/// Twice a triangle's area, in unit space, below which it has no normal.
const DEGENERATE: f64 = 1e-13;

/// The similarity into unit space: `(x - centre) / radius`.
#[derive(Debug, Clone, Copy)]
pub(super) struct UnitSpace {
    centre: DVec3,
    /// Scan units to one unit.
    pub radius: f64,
}

impl UnitSpace {
    /// The unit space in which `scan` has its vertices' mean at the origin and its farthest vertex at distance 1.
    pub fn of(scan: &TriangleMesh) -> Self {
        let centre = scan.centroid();
        Self { centre, radius: scan.radius_about(centre) }
    }

    pub fn enter(&self, p: DVec3) -> DVec3 {
        (p - self.centre) / self.radius
    }
}

/// A mesh in unit space, ready to be asked for nearest points.
pub(super) struct Surface<'a> {
    /// Vertex positions `[N]`.
    pub positions: Vec<DVec3>,
    /// Triangles `[F, 3]`.
    pub triangles: &'a [[u32; 3]],
    /// Cross product of each triangle's first two edges: its normal, as long as twice its area.
    pub crosses: Vec<DVec3>,
    index: SurfaceIndex,
}

impl<'a> Surface<'a> {
    pub fn new(mesh: &'a TriangleMesh, space: &UnitSpace) -> Self {
        let positions: Vec<DVec3> = mesh.positions().iter().map(|&p| space.enter(p)).collect();
        let triangles = mesh.triangles();
        let cross = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| positions[v as usize]);
            (b - a).cross(c - a)
        };
        let crosses = triangles.iter().map(cross).collect();
        let single: Vec<Vec3A> = positions.iter().map(|p| p.as_vec3a()).collect();
        let index = SurfaceIndex::new(&single, triangles);
        Self { positions, triangles, crosses, index }
    }

    /// Corner positions of a triangle.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    /// A triangle's unit normal, or zero if it is degenerate.
    pub fn normal(&self, triangle: u32) -> DVec3 {
        let cross = self.crosses[triangle as usize];
        let length = cross.length();
        if length > DEGENERATE { cross / length } else { DVec3::ZERO }
    }

    /// The nearest point to each of `points`.
    pub fn closest(&self, points: &[DVec3]) -> Vec<Hit> {
        points.par_iter().map(|p| self.index.closest(p.as_vec3a())).collect()
    }
}
