use std::path::PathBuf;

use glam::DVec2;

use super::polygons::Polygons;

/// How pictures lie on the polygons of a mesh file; everything as the file has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// Texture coordinates `[K, 2]`, in the file's order.
    pub coordinates: Vec<DVec2>,
    /// For each polygon corner `[C]` its entry in `coordinates`, or [`Texture::NONE`].
    pub corners: Vec<u32>,
    /// For each polygon `[P]` its entry in `images`, or [`Texture::NONE`].
    pub polygon_images: Vec<u32>,
    /// The pictures that are there. One that the file names and that is missing is among the warnings instead.
    pub images: Vec<TextureImage>,
    /// Where in a picture the coordinates (0, 0) are.
    pub origin: ImageOrigin,
}

/// Where in a picture the texture coordinates (0, 0) are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageOrigin {
    /// In its lower left corner, as in OBJ and PLY.
    LowerLeft,
    /// In its upper left corner, as in glTF.
    UpperLeft,
}

/// A picture as it was found: its bytes are neither decoded nor looked at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum TextureImage {
    /// A file beside the mesh's.
    File(PathBuf),
    /// The encoded picture, held by the mesh's file itself.
    Embedded {
        /// What the file says the bytes are, for instance `image/png`.
        media_type: Option<String>,
        /// The picture's file, whole.
        bytes: Vec<u8>,
    },
}

impl Texture {
    /// No entry: the corner has no texture coordinates, or the polygon no picture.
    pub const NONE: u32 = u32::MAX;

    /// Coordinates of each vertex `[N, 2]`, (0, 0) in the picture's upper left corner, on polygons; without a picture.
    pub fn of_vertices(coordinates: &[DVec2], polygons: &Polygons) -> Self {
        Self {
            coordinates: coordinates.to_vec(),
            corners: polygons.corners().to_vec(),
            polygon_images: vec![Self::NONE; polygons.len()],
            images: Vec::new(),
            origin: ImageOrigin::UpperLeft,
        }
    }

    /// The texture coordinates of polygon corner `corner`, if it has any.
    pub fn coordinate(&self, corner: usize) -> Option<DVec2> {
        self.coordinates.get(*self.corners.get(corner)? as usize).copied()
    }

    /// The picture on polygon `polygon`, if it has one.
    pub fn image(&self, polygon: usize) -> Option<&TextureImage> {
        self.images.get(*self.polygon_images.get(polygon)? as usize)
    }
}
