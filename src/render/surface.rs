use glam::Vec3A;

use super::RenderError;
use crate::mesh::Topology;

/// The triangles that every surface drawn afterwards shares.
#[derive(Debug, Clone, Copy)]
pub struct MeshLayout<'a> {
    /// Vertex indices of each triangle `[F, 3]`, counter-clockwise as seen from outside.
    pub triangles: &'a [[u32; 3]],
    /// Number of vertices N.
    pub vertices: usize,
    /// Whether the surface has no rim: then its back faces are never seen, and not drawn.
    pub closed: bool,
}

impl<'a> MeshLayout<'a> {
    /// The layout of a mesh by its topology.
    pub fn of(topology: &'a Topology) -> Self {
        Self {
            triangles: &topology.triangles,
            vertices: topology.vertex_count(),
            closed: !topology.on_rim.contains(&true),
        }
    }

    pub(super) fn check(&self) -> Result<(), RenderError> {
        let beyond = |corners: &[u32; 3]| corners.iter().any(|&corner| corner as usize >= self.vertices);
        match self.triangles.iter().position(beyond) {
            Some(triangle) => Err(RenderError::Corner {
                triangle,
                corners: self.triangles[triangle],
                vertices: self.vertices,
            }),
            None if self.triangles.is_empty() => Err(RenderError::NoTriangles),
            None => Ok(()),
        }
    }
}

/// A surface to draw.
#[derive(Debug, Clone, Copy)]
pub struct Surface<'a> {
    /// p `[N, 3]`, in the world of the cameras.
    pub positions: &'a [Vec3A],
    /// n `[N, 3]`, of unit length.
    pub normals: &'a [Vec3A],
    /// a `[N, 3]`; ones where there is none.
    pub albedo: Option<&'a [[f32; 3]]>,
}

impl Surface<'_> {
    pub(super) fn check(&self, vertices: usize) -> Result<(), RenderError> {
        let albedo = self.albedo.map_or(vertices, <[_]>::len);
        for (what, found) in
            [("positions", self.positions.len()), ("normals", self.normals.len()), ("albedo", albedo)]
        {
            if found != vertices {
                return Err(RenderError::Count { what, found, vertices });
            }
        }
        match self.positions.iter().position(|position| !position.is_finite()) {
            Some(vertex) => Err(RenderError::NotFinite { vertex }),
            None => Ok(()),
        }
    }
}

/// The gradient of a photometric loss with respect to a surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RenderGradient {
    /// dE/dp with normals and albedo held `[N, 3]`.
    pub positions: Vec<Vec3A>,
    /// dE/dn `[N, 3]`, to be pulled back by [`crate::mesh::Normals::pull_back`].
    pub normals: Vec<Vec3A>,
    /// dE/da `[N, 3]`; empty for a surface that has none.
    pub albedo: Vec<[f32; 3]>,
}

impl RenderGradient {
    /// Zeros for so many vertices, keeping the memory.
    pub(super) fn clear(&mut self, vertices: usize, with_albedo: bool) {
        self.positions.clear();
        self.positions.resize(vertices, Vec3A::ZERO);
        self.normals.clear();
        self.normals.resize(vertices, Vec3A::ZERO);
        self.albedo.clear();
        self.albedo.resize(if with_albedo { vertices } else { 0 }, [0.0; 3]);
    }
}

/// A drawn picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Rendering {
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// R `[H * W, 3]`, rows from the top.
    pub colours: Vec<[f32; 3]>,
    /// Whether a pixel's centre shows the surface `[H * W]`.
    pub covered: Vec<bool>,
}
