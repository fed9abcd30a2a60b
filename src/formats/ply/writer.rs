use std::path::Path;

use glam::{DVec2, DVec3};

use crate::formats::error::FormatError;
use crate::formats::output::write_whole;
use crate::formats::polygons::Polygons;
use crate::mesh::TriangleMesh;

/// What is written to a PLY file.
#[derive(Debug, Clone)]
pub struct Ply<'a> {
    /// `[N, 3]`
    pub positions: &'a [DVec3],
    /// The polygons on them.
    pub polygons: &'a Polygons,
    /// Texture coordinates of each vertex `[N, 2]`, (0, 0) in the image's upper left corner; written as `s` and `t`,
    /// which count from the lower left.
    pub texture_coordinates: Option<&'a [DVec2]>,
    /// Numbers of each vertex `[N]` by the names of their properties, written as floats; one that is not there is 0.
    pub scalars: Vec<(&'a str, &'a [f64])>,
}

impl Ply<'_> {
    /// The file as binary little-endian PLY, vertices in their order, coordinates as doubles.
    pub fn bytes(&self) -> Vec<u8> {
        let counts_fit = self.polygons.iter().all(|polygon| polygon.len() <= usize::from(u8::MAX));
        let mut out = self.header(if counts_fit { "uchar" } else { "uint" }).into_bytes();
        for (vertex, position) in self.positions.iter().enumerate() {
            out.extend(position.to_array().map(f64::to_le_bytes).as_flattened());
            if let Some(coordinates) = self.texture_coordinates {
                let uv = coordinates.get(vertex).copied().unwrap_or_default();
                out.extend([uv.x, 1.0 - uv.y].map(|x| (x as f32).to_le_bytes()).as_flattened());
            }
            for (_, values) in &self.scalars {
                let value = values.get(vertex).copied().unwrap_or_default();
                out.extend((value as f32).to_le_bytes());
            }
        }
        for polygon in self.polygons.iter() {
            let count = (polygon.len() as u32).to_le_bytes();
            out.extend(&count[..if counts_fit { 1 } else { 4 }]);
            out.extend(polygon.iter().flat_map(|index| index.to_le_bytes()));
        }
        out
    }

    fn header(&self, count: &str) -> String {
        let mut header = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
             property double z\n",
            self.positions.len()
        );
        if self.texture_coordinates.is_some() {
            header += "property float s\nproperty float t\n";
        }
        for (name, _) in &self.scalars {
            header += &format!("property float {name}\n");
        }
        let faces = self.polygons.len();
        header + &format!("element face {faces}\nproperty list {count} int vertex_indices\nend_header\n")
    }
}

/// The triangles of a mesh as binary little-endian PLY, see [`Ply::bytes`]: read back, it is the same mesh.
pub fn ply_bytes(mesh: &TriangleMesh) -> Vec<u8> {
    let polygons = Polygons::of_triangles(mesh.triangles());
    Ply { positions: mesh.positions(), polygons: &polygons, texture_coordinates: None, scalars: Vec::new() }
        .bytes()
}

/// Writes [`ply_bytes`] to a file.
///
/// # Errors
/// [`FormatError`] where the file cannot be written.
pub fn write_ply(path: impl AsRef<Path>, mesh: &TriangleMesh) -> Result<(), FormatError> {
    write_whole(path.as_ref(), &ply_bytes(mesh))
}
