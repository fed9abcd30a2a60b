use std::borrow::Cow;

use glam::DVec3;

use super::points::{FilePoints, Points};

/// Index of a vertex in its mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VertexId(pub u32);

/// Index of a triangle in its mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub struct TriangleId(pub u32);

/// Why vertices and triangles do not make a mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// No vertex or no triangle.
    #[error("the mesh has {vertices} vertices and {triangles} triangles; it needs at least 3 and 1")]
    Empty {
        /// Vertices found.
        vertices: usize,
        /// Triangles found.
        triangles: usize,
    },
    /// A triangle names a vertex that does not exist.
    #[error(
        "triangle {triangle} names vertex {index}, but the mesh has {vertices} vertices (0 to {})",
        vertices - 1
    )]
    IndexOutOfRange {
        /// The triangle, counted from 0.
        triangle: usize,
        /// The index it names.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A position is NaN or infinite.
    #[error("vertex {vertex} is at ({x}, {y}, {z}): every coordinate must be a finite number", x = position.x, y = position.y, z = position.z)]
    NotFinite {
        /// The vertex, counted from 0.
        vertex: usize,
        /// Where it is.
        position: DVec3,
    },
    /// More vertices or triangles than 32-bit indices address.
    #[error("the mesh has {0} vertices or triangles; at most 2^31 are supported")]
    TooLarge(usize),
    /// All vertices coincide.
    #[error("all vertices of the mesh coincide: it has no extent")]
    NoExtent,
}

/// A validated triangle mesh: every index in range, every position finite, some extent.
///
/// Positions are `[N, 3]` in the scan's own space and units; triangles `[F, 3]`, counter-clockwise seen from outside.
/// Positions are in double precision wherever something is computed, and as their file has them where a scan is only
/// looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct TriangleMesh<P = Vec<DVec3>> {
    positions: P,
    triangles: Vec<[u32; 3]>,
}

impl<P: Points> TriangleMesh<P> {
    /// Checks and takes vertices `[N, 3]` and triangles `[F, 3]`.
    ///
    /// # Errors
    /// [`MeshError`] names the first vertex or triangle that is wrong.
    pub fn new(positions: P, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        let vertices = positions.count();
        if vertices < 3 || triangles.is_empty() {
            return Err(MeshError::Empty { vertices, triangles: triangles.len() });
        }
        let largest = vertices.max(triangles.len());
        if largest > i32::MAX as usize {
            return Err(MeshError::TooLarge(largest));
        }
        if let Some(vertex) = positions.each().position(|p| !p.is_finite()) {
            return Err(MeshError::NotFinite { vertex, position: positions.at(vertex) });
        }
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&index) = corners.iter().find(|&&i| i as usize >= vertices) {
                return Err(MeshError::IndexOutOfRange { triangle, index, vertices });
            }
        }
        let first = positions.at(triangles[0][0] as usize);
        let extends = triangles.iter().flatten().any(|&i| positions.at(i as usize) != first);
        if !extends {
            return Err(MeshError::NoExtent);
        }
        Ok(Self { positions, triangles })
    }

    /// Vertex positions `[N, 3]`.
    pub fn points(&self) -> &P {
        &self.positions
    }

    /// Where a vertex is.
    pub fn position(&self, vertex: u32) -> DVec3 {
        self.positions.at(vertex as usize)
    }

    /// Vertex indices of each triangle `[F, 3]`.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Corner positions of a triangle.
    pub fn corners(&self, triangle: TriangleId) -> [DVec3; 3] {
        self.triangles[triangle.0 as usize].map(|i| self.position(i))
    }

    /// The mean of the vertices.
    pub fn centroid(&self) -> DVec3 {
        self.positions.each().sum::<DVec3>() / self.positions.count() as f64
    }

    /// The largest distance of a vertex from `centre`.
    pub fn radius_about(&self, centre: DVec3) -> f64 {
        self.positions.each().map(|p| p.distance_squared(centre)).fold(0.0, f64::max).sqrt()
    }
}

impl TriangleMesh {
    /// Vertex positions `[N, 3]`.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Some of its triangles `[F, 3]` on all its vertices; all of it if these are no mesh.
    pub fn only(&self, triangles: Vec<[u32; 3]>) -> Cow<'_, Self> {
        if triangles.len() == self.triangles.len() {
            return Cow::Borrowed(self);
        }
        Self::new(self.positions.clone(), triangles).map_or(Cow::Borrowed(self), Cow::Owned)
    }

    /// The same triangles on other positions `[N, 3]`.
    ///
    /// # Errors
    /// As [`TriangleMesh::new`].
    pub fn with_positions(&self, positions: Vec<DVec3>) -> Result<Self, MeshError> {
        Self::new(positions, self.triangles.clone())
    }
}

impl From<TriangleMesh<FilePoints>> for TriangleMesh {
    fn from(mesh: TriangleMesh<FilePoints>) -> Self {
        Self { positions: mesh.positions.into(), triangles: mesh.triangles }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corners() -> Vec<DVec3> {
        vec![DVec3::ZERO, DVec3::X, DVec3::Y]
    }

    #[test]
    fn refuses_what_is_no_mesh() {
        assert!(matches!(TriangleMesh::new(vec![], vec![]), Err(MeshError::Empty { .. })));
        assert!(matches!(
            TriangleMesh::new(corners(), vec![[0, 1, 3]]),
            Err(MeshError::IndexOutOfRange { triangle: 0, index: 3, vertices: 3 })
        ));
        let mut bad = corners();
        bad[1].y = f64::NAN;
        assert!(matches!(
            TriangleMesh::new(bad, vec![[0, 1, 2]]),
            Err(MeshError::NotFinite { vertex: 1, .. })
        ));
        assert_eq!(TriangleMesh::new(vec![DVec3::ONE; 3], vec![[0, 1, 2]]), Err(MeshError::NoExtent));
    }

    #[test]
    fn measures_itself() {
        let mesh = TriangleMesh::new(corners(), vec![[0, 1, 2]]).unwrap();
        assert_eq!(mesh.centroid(), DVec3::new(1.0, 1.0, 0.0) / 3.0);
        assert_eq!(mesh.radius_about(DVec3::ZERO), 1.0);
    }
}
