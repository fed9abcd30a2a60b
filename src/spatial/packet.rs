use glam::{Vec3A, Vec4};

use super::boxes::Bounds;
use super::lanes::Lanes;
use super::triangle::{DEGENERATE, TINY};

/// Four triangles side by side, prepared for distance queries.
#[derive(Debug, Clone, Copy)]
pub(super) struct Packet {
    /// The triangles' indices; where there are fewer than four, the first one again.
    pub triangles: [u32; 4],
    corner: Lanes,
    first_edge: Lanes,
    second_edge: Lanes,
    /// Unit normals; zero where the triangle is degenerate.
    normal: Lanes,
    /// One over the normal's length before it was made unit; zero where the triangle is degenerate.
    inverse_area: Vec4,
    /// One over the squared lengths of the first edge, the second and the one between their ends; zero where they have none.
    inverse_edges: [Vec4; 3],
}

impl Packet {
    /// An unfilled packet for one to four triangles.
    pub fn of(members: &[u32]) -> Self {
        let triangles = [0, 1, 2, 3].map(|lane| *members.get(lane).unwrap_or(&members[0]));
        let (zero, none) = (Lanes::default(), Vec4::ZERO);
        Self {
            triangles,
            corner: zero,
            first_edge: zero,
            second_edge: zero,
            normal: zero,
            inverse_area: none,
            inverse_edges: [none; 3],
        }
    }

    /// Places the triangles; returns the boxes of their corners and of their normals.
    #[inline]
    pub fn place(&mut self, positions: &[Vec3A], triangles: &[[u32; 3]]) -> (Bounds, Bounds) {
        let corners = self.triangles.map(|t| triangles[t as usize].map(|v| positions[v as usize]));
        let extent = corners.iter().flatten().fold(Bounds::EMPTY, |bounds, &p| bounds.with(p));
        self.corner = Lanes::new(corners.map(|c| c[0]));
        self.first_edge = Lanes::new(corners.map(|c| c[1])) - self.corner;
        self.second_edge = Lanes::new(corners.map(|c| c[2])) - self.corner;
        self.prepare();
        let normals = (0..4).fold(Bounds::EMPTY, |bounds, lane| bounds.with(self.normal.get(lane)));
        (extent, normals)
    }

    #[inline]
    fn prepare(&mut self) {
        let third_edge = self.second_edge - self.first_edge;
        let lengths = [self.first_edge, self.second_edge, third_edge].map(Lanes::length_squared);
        let inverse = |x: Vec4, usable| Vec4::select(usable, Vec4::ONE / x, Vec4::ZERO);
        self.inverse_edges = lengths.map(|x| inverse(x, x.cmpgt(Vec4::splat(TINY))));

        let normal = self.first_edge.cross(self.second_edge);
        let square = normal.length_squared();
        let least = (lengths[0] * lengths[1] * DEGENERATE).max(Vec4::splat(TINY));
        let length = square.map(f32::sqrt);
        self.inverse_area = inverse(length, square.cmpgt(least));
        self.normal = normal * self.inverse_area;
    }

    /// Squared distances of the triangles from a point, the same in every lane of `p`.
    ///
    /// Each is the distance to some point of the triangle, so that rounding can lose a little but never undercut.
    #[inline]
    pub fn distance_squared(&self, p: Lanes) -> Vec4 {
        let to_p = p - self.corner;
        let turned = self.normal.cross(to_p) * self.inverse_area;
        let (v, w) = (self.second_edge.dot(turned), Vec4::ZERO - self.first_edge.dot(turned));
        let inside = v.min(w).min(Vec4::ONE - v - w).cmpge(Vec4::ZERO);
        let face = (to_p - self.first_edge * v - self.second_edge * w).length_squared();

        let third_edge = self.second_edge - self.first_edge;
        let edges = segment(to_p, self.first_edge, self.inverse_edges[0])
            .min(segment(to_p, self.second_edge, self.inverse_edges[1]))
            .min(segment(to_p - self.first_edge, third_edge, self.inverse_edges[2]));
        Vec4::select(inside, face.min(edges), edges)
    }

    /// Cosines of the angles between the triangles' normals and `n`, a unit vector; zero where the triangle is degenerate.
    #[inline]
    pub fn cosine(&self, n: Lanes) -> Vec4 {
        self.normal.dot(n)
    }

    /// The corners of the triangle in one lane.
    #[inline]
    pub fn corners(&self, lane: usize) -> [Vec3A; 3] {
        let corner = self.corner.get(lane);
        [corner, corner + self.first_edge.get(lane), corner + self.second_edge.get(lane)]
    }

    /// The unit normal of the triangle in one lane, or zero.
    #[inline]
    pub fn normal(&self, lane: usize) -> Vec3A {
        self.normal.get(lane)
    }
}

/// Squared distances from segments that start at the origin.
#[inline]
fn segment(p: Lanes, edge: Lanes, inverse: Vec4) -> Vec4 {
    let t = (p.dot(edge) * inverse).max(Vec4::ZERO).min(Vec4::ONE);
    (p - edge * t).length_squared()
}
