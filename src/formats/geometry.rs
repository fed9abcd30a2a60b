use super::polygons::Polygons;
use super::texture::Texture;
use crate::mesh::FilePoints;

/// What a reader finds, before it is checked to be a mesh.
#[derive(Debug, Default)]
pub(super) struct Geometry {
    /// `[N, 3]`
    pub positions: FilePoints,
    pub polygons: Polygons,
    /// `[N, 4]`: red, green, blue, opacity.
    pub colours: Option<Vec<[u8; 4]>>,
    pub texture: Option<Texture>,
    pub order: FileOrder,
    /// What is there but could not be used, colours, texture coordinates and pictures among it.
    pub warnings: Vec<String>,
}

/// Which vertex and triangle of the mesh those of the file have become: landmarks may name them by their numbers.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct FileOrder {
    pub vertices: Numbers,
    pub triangles: Numbers,
}

/// From a number in the file to that in the mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) enum Numbers {
    /// The mesh has the file's own.
    #[default]
    Kept,
    /// For each number in the file that in the mesh, or [`GONE`].
    Changed(Vec<u32>),
    /// The format numbers nothing.
    None,
}

/// What is in the file and not in the mesh.
pub(super) const GONE: u32 = u32::MAX;
