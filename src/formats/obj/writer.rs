use std::io::Write;
use std::path::Path;

use glam::DVec3;

use crate::formats::error::FormatError;
use crate::formats::output::write_whole;
use crate::formats::polygons::Polygons;
use crate::formats::texture::{ImageOrigin, Texture};
use crate::mesh::TriangleMesh;

/// What is written to an OBJ file.
#[derive(Debug, Clone, Copy)]
pub struct Obj<'a> {
    /// `[N, 3]`
    pub positions: &'a [DVec3],
    /// The polygons on them.
    pub polygons: &'a Polygons,
    /// Texture coordinates of the polygons' corners; pictures are not written.
    pub texture: Option<&'a Texture>,
}

impl Obj<'_> {
    /// The file, vertices in their order, every coordinate with as many digits as it needs to be read back exactly.
    pub fn bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let written = self.write(&mut out);
        debug_assert!(written.is_ok(), "memory takes every write");
        out
    }

    fn write(&self, out: &mut Vec<u8>) -> std::io::Result<()> {
        for p in self.positions {
            writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
        }
        for uv in self.texture.iter().flat_map(|texture| &texture.coordinates) {
            let up = self.texture.is_some_and(|texture| texture.origin == ImageOrigin::LowerLeft);
            writeln!(out, "vt {} {}", uv.x, if up { uv.y } else { 1.0 - uv.y })?;
        }
        let mut corner = 0;
        for polygon in self.polygons.iter() {
            write!(out, "f")?;
            for index in polygon {
                write!(out, " {}", u64::from(*index) + 1)?;
                let entry = self.texture.and_then(|texture| texture.corners.get(corner));
                if let Some(entry) = entry.filter(|entry| **entry != Texture::NONE) {
                    write!(out, "/{}", u64::from(*entry) + 1)?;
                }
                corner += 1;
            }
            writeln!(out)?;
        }
        Ok(())
    }
}

/// The triangles of a mesh as OBJ, see [`Obj::bytes`].
pub fn obj_bytes(mesh: &TriangleMesh) -> Vec<u8> {
    let polygons = Polygons::of_triangles(mesh.triangles());
    Obj { positions: mesh.positions(), polygons: &polygons, texture: None }.bytes()
}

/// Writes [`obj_bytes`] to a file.
///
/// # Errors
/// [`FormatError`] where the file cannot be written.
pub fn write_obj(path: impl AsRef<Path>, mesh: &TriangleMesh) -> Result<(), FormatError> {
    write_whole(path.as_ref(), &obj_bytes(mesh))
}
