use std::borrow::Cow;
use std::path::Path;

use glam::DVec2;

use super::error::{Fault, FormatError};
use super::geometry::{FileOrder, Geometry};
use super::input::{self, InputFile, Siblings};
use super::mesh_format::MeshFormat;
use super::polygons::Polygons;
use super::texture::{ImageOrigin, Texture};
use super::{gltf, obj, ply, stl, text};
use crate::mesh::TriangleMesh;

/// All that is read from a mesh file: the checked mesh, what the file has beside it, and what could not be used.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFile {
    /// The surface, in the file's own space and units.
    pub mesh: TriangleMesh,
    /// The colour of each vertex `[N, 4]`: red, green, blue, opacity, as the file has them, scaled to 0 to 255.
    pub colours: Option<Vec<[u8; 4]>>,
    /// Texture coordinates and the pictures they belong to.
    pub texture: Option<Texture>,
    /// Parts of the file, colours and textures among them, that are wrong or missing and that the mesh does without.
    pub warnings: Vec<String>,
    /// The polygons that the mesh's triangles were cut from, where they are others.
    cut: Option<Polygons>,
    /// How landmarks that name vertices and triangles of the file are to be understood.
    pub(super) order: FileOrder,
    /// Whether the file says that its x and y point to the right and to the front of a patient.
    pub(super) states_ras: bool,
}

impl MeshFile {
    /// Reads an OBJ, PLY, STL, glTF or GLB file, and what it names beside it.
    ///
    /// The format is told from the content, and from the file's extension where the content does not say. Polygons
    /// become fans of triangles; polygons of fewer than three corners are left out.
    ///
    /// Vertices of OBJ and PLY keep their number and order, also those that no triangle names. glTF repeats a vertex
    /// for each normal and texture coordinate it has, and STL for each triangle, so that their seams are closed again:
    /// vertices of open edges in the same place become one, vertices that no triangle names are dropped, and the others
    /// keep their order. Files by [`write_glb`](super::write_glb) are read as they are.
    ///
    /// # Errors
    /// [`FormatError`] names the file, the line or element, what was found there and what to do. Colours and textures
    /// that are wrong or missing are no errors but [`warnings`](Self::warnings).
    pub fn read(path: impl AsRef<Path>) -> Result<Self, FormatError> {
        Self::read_with_inputs(path.as_ref()).map(|(file, _)| file)
    }

    /// Reads a file as [`read`](Self::read) does, from its bytes.
    ///
    /// # Errors
    /// [`FormatError`] without a file; [`FormatError::in_file`] adds one. A glTF whose mesh is in other files is refused.
    pub fn parse(bytes: &[u8], format: MeshFormat) -> Result<Self, FormatError> {
        Ok(Self::parse_beside(bytes, format, &Siblings::none())?)
    }

    /// The polygons that the mesh's triangles were cut from, with the mesh's vertex indices.
    pub fn polygons(&self) -> Cow<'_, Polygons> {
        match &self.cut {
            Some(polygons) => Cow::Borrowed(polygons),
            None => Cow::Owned(Polygons::of_triangles(self.mesh.triangles())),
        }
    }

    /// The vertex of each of the polygons' corners.
    pub(super) fn corners(&self) -> &[u32] {
        self.cut.as_ref().map_or(self.mesh.triangles().as_flattened(), Polygons::corners)
    }

    /// Texture coordinates `[N, 2]`, (0, 0) in the picture's upper left corner, if every vertex has one pair or none.
    pub fn vertex_texture_coordinates(&self) -> Option<Vec<DVec2>> {
        let texture = self.texture.as_ref()?;
        let mut of_vertices = vec![None; self.mesh.positions().len()];
        for (corner, &vertex) in self.corners().iter().enumerate() {
            let own = texture.coordinate(corner)?;
            let slot = &mut of_vertices[vertex as usize];
            if slot.is_some_and(|other| other != own) {
                return None;
            }
            *slot = Some(own);
        }
        let upright = |own: Option<DVec2>| match (own.unwrap_or_default(), texture.origin) {
            (own, ImageOrigin::UpperLeft) => own,
            (own, ImageOrigin::LowerLeft) => DVec2::new(own.x, 1.0 - own.y),
        };
        Some(of_vertices.into_iter().map(upright).collect())
    }

    /// The file at `path` and those it was read from, the first of them `path` itself; pictures are not read.
    pub(super) fn read_with_inputs(path: &Path) -> Result<(Self, Vec<InputFile>), FormatError> {
        let (file, _, inputs) = Self::of_bytes(&input::read_file(path)?, path)?;
        Ok((file, inputs))
    }

    /// The file at `path`, which holds `bytes`; its format, and those it was read from, the first of them itself.
    pub(super) fn of_bytes(
        bytes: &[u8],
        path: &Path,
    ) -> Result<(Self, MeshFormat, Vec<InputFile>), FormatError> {
        let siblings = Siblings::of(path);
        let extension = path.extension().and_then(|e| e.to_str());
        let read = match MeshFormat::sniff(bytes, extension) {
            Some(format) => Self::parse_beside(bytes, format, &siblings).map(|file| (file, format)),
            None => Err(Fault::UnknownFormat { start: text::shown(bytes) }),
        };
        let (file, format) = read.map_err(|fault| FormatError::from(fault).in_file(path))?;
        let mut inputs = vec![InputFile::of(path, bytes)];
        inputs.extend(siblings.into_read());
        Ok((file, format, inputs))
    }

    fn parse_beside(bytes: &[u8], format: MeshFormat, siblings: &Siblings) -> Result<Self, Fault> {
        let Geometry { positions, polygons, colours, texture, order, warnings } = match format {
            MeshFormat::Obj => obj::read(bytes, siblings),
            MeshFormat::Ply => ply::read(bytes, siblings),
            MeshFormat::Stl => stl::read(bytes),
            MeshFormat::Gltf => gltf::read(bytes, siblings),
        }?;
        let (triangles, cut) = polygons.into_triangles();
        let mesh = TriangleMesh::new(positions, triangles)?;
        let states_ras = states_ras(bytes);
        Ok(Self { mesh, cut, colours, texture, warnings, order, states_ras })
    }
}

/// 3D Slicer notes the axes of a mesh in a comment at the beginning of its file.
fn states_ras(bytes: &[u8]) -> bool {
    const BEGINNING: usize = 1024;
    bytes[..bytes.len().min(BEGINNING)].windows(9).any(|window| window == b"SPACE=RAS")
}
