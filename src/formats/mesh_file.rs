use std::borrow::Cow;
use std::io::Read;
use std::path::Path;

use glam::{DVec2, DVec3};

use super::error::{Fault, FormatError};
use super::geometry::{FileOrder, Geometry};
use super::input::{HashedFile, InputFile, Siblings};
use super::mesh_format::MeshFormat;
use super::polygons::Polygons;
use super::stream::Stream;
use super::texture::{ImageOrigin, Texture};
use super::{gltf, obj, ply, stl, text};
use crate::mesh::{FilePoints, Points, TriangleMesh};

/// All that is read from a mesh file: the checked mesh, what the file has beside it, and what could not be used.
///
/// The mesh is in double precision, or as [`FilePoints`] where a file is only looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFile<P = Vec<DVec3>> {
    /// The surface, in the file's own space and units.
    pub mesh: TriangleMesh<P>,
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
        MeshFile::look_at(path).map(Self::from)
    }

    /// Reads a file as [`read`](Self::read) does, from its bytes.
    ///
    /// # Errors
    /// [`FormatError`] without a file; [`FormatError::in_file`] adds one. A glTF whose mesh is in other files is refused.
    pub fn parse(bytes: &[u8], format: MeshFormat) -> Result<Self, FormatError> {
        Ok(MeshFile::of_format(&mut Stream::of(bytes), format, &Siblings::none())?.into())
    }

    /// The file at `path` and those it was read from, the first of them `path` itself; pictures are not read.
    pub(super) fn read_with_inputs(path: &Path) -> Result<(Self, Vec<InputFile>), FormatError> {
        MeshFile::with_inputs(path).map(|(file, inputs)| (file.into(), inputs))
    }

    /// The file at `path`, which holds `bytes`; its format, and those it was read from, the first of them itself.
    pub(super) fn of_bytes(
        bytes: &[u8],
        path: &Path,
    ) -> Result<(Self, MeshFormat, Vec<InputFile>), FormatError> {
        let siblings = Siblings::of(path);
        let read = MeshFile::of_stream(&mut Stream::of(bytes), extension(path), &siblings);
        let (file, format) = read.map_err(|fault| FormatError::from(fault).in_file(path))?;
        let mut inputs = vec![InputFile::of(path, bytes)];
        inputs.extend(siblings.into_read());
        Ok((file.into(), format, inputs))
    }
}

impl MeshFile<FilePoints> {
    /// Reads a file to be looked at as [`MeshFile::read`] does.
    ///
    /// # Errors
    /// As [`MeshFile::read`].
    pub fn look_at(path: impl AsRef<Path>) -> Result<Self, FormatError> {
        Self::with_inputs(path.as_ref()).map(|(file, _)| file)
    }

    /// Reads the `length` bytes of a file as [`look_at`](Self::look_at) does. Beside what is read of them, 256 KiB of the bytes
    /// or the longest line are in memory at a time; of glTF all.
    ///
    /// # Errors
    /// As [`MeshFile::parse`].
    pub fn look_into(input: impl Read, length: u64, extension: Option<&str>) -> Result<Self, FormatError> {
        let mut stream = Stream::new(input, length);
        Ok(Self::of_stream(&mut stream, extension, &Siblings::none()).map(|(file, _)| file)?)
    }

    fn with_inputs(path: &Path) -> Result<(Self, Vec<InputFile>), FormatError> {
        let in_file = |fault| FormatError::from(fault).in_file(path);
        let mut own = HashedFile::open(path)?;
        let length = own.length;
        let siblings = Siblings::of(path);
        let read = Self::of_stream(&mut Stream::new(&mut own, length), extension(path), &siblings);
        let (file, _) = read.map_err(in_file)?;
        let mut inputs = vec![own.finish()?];
        inputs.extend(siblings.into_read());
        Ok((file, inputs))
    }

    fn of_stream(
        stream: &mut Stream,
        extension: Option<&str>,
        siblings: &Siblings,
    ) -> Result<(Self, MeshFormat), Fault> {
        let length = stream.left();
        let beginning = stream.beginning();
        let Some(format) = MeshFormat::sniff(beginning, length, extension) else {
            let start = text::shown(beginning);
            return Err(stream.error().map_or(Fault::UnknownFormat { start }, Fault::Unreadable));
        };
        Self::of_format(stream, format, siblings).map(|file| (file, format))
    }

    fn of_format(stream: &mut Stream, format: MeshFormat, siblings: &Siblings) -> Result<Self, Fault> {
        let states_ras = states_ras(stream.beginning());
        let read = match format {
            MeshFormat::Obj => obj::read(stream, siblings),
            MeshFormat::Ply => ply::read(stream, siblings),
            MeshFormat::Stl => stl::read(stream),
            MeshFormat::Gltf => gltf::read(&stream.rest(), siblings),
        };
        // What a reader says of a file that cannot be read on is not its fault.
        if let Some(error) = stream.error() {
            return Err(Fault::Unreadable(error));
        }
        let Geometry { positions, polygons, colours, texture, order, warnings } = read?;
        let (triangles, cut) = polygons.into_triangles();
        let mesh = TriangleMesh::new(positions, triangles)?;
        Ok(Self { mesh, cut, colours, texture, warnings, order, states_ras })
    }
}

impl<P: Points> MeshFile<P> {
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
        let mut of_vertices = vec![None; self.mesh.points().count()];
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
}

impl From<MeshFile<FilePoints>> for MeshFile {
    fn from(file: MeshFile<FilePoints>) -> Self {
        let MeshFile { mesh, colours, texture, warnings, cut, order, states_ras } = file;
        Self { mesh: mesh.into(), colours, texture, warnings, cut, order, states_ras }
    }
}

fn extension(path: &Path) -> Option<&str> {
    path.extension()?.to_str()
}

/// 3D Slicer notes the axes of a mesh in a comment at the beginning of its file.
fn states_ras(bytes: &[u8]) -> bool {
    const BEGINNING: usize = 1024;
    bytes[..bytes.len().min(BEGINNING)].windows(9).any(|window| window == b"SPACE=RAS")
}
