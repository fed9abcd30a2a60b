use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::error::{Fault, FormatError};
use super::geometry::Numbers;
use super::input::{self, InputFile, Siblings};
use super::mesh_file::MeshFile;
use super::mesh_format::MeshFormat;
use super::texture::TextureImage;
use super::{gltf, obj, ply};

/// A mesh file that can be written again with its vertices elsewhere and everything else as it is.
#[derive(Debug, Clone)]
pub struct MeshSource {
    /// What was read from it.
    pub file: MeshFile,
    /// It, and what it names beside it.
    pub inputs: Vec<InputFile>,
    format: MeshFormat,
    bytes: Vec<u8>,
}

impl MeshSource {
    /// Reads a file as [`MeshFile::read`] does.
    ///
    /// # Errors
    /// As [`MeshFile::read`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, FormatError> {
        let path = path.as_ref();
        Self::of_bytes(path, input::read_file(path)?)
    }

    /// The file at `path`, which holds `bytes`, as [`read`](Self::read) does.
    ///
    /// # Errors
    /// As [`MeshFile::read`].
    pub fn of_bytes(path: impl AsRef<Path>, bytes: Vec<u8>) -> Result<Self, FormatError> {
        let path = path.as_ref();
        let (file, format, inputs) = MeshFile::of_bytes(&bytes, path)?;
        let bytes = match format {
            MeshFormat::Gltf => gltf::embed(&bytes, &Siblings::of(path))
                .map_err(|fault| FormatError::from(fault).in_file(path))?,
            _ => bytes,
        };
        Ok(Self { file, inputs, format, bytes })
    }

    /// The files that it names and that a copy of it needs beside it, of materials and pictures: the name that it has
    /// for each, from its own folder, and where each is. A glTF has its own within it.
    pub fn companions(&self) -> Vec<(PathBuf, PathBuf)> {
        if self.format == MeshFormat::Gltf {
            return Vec::new();
        }
        let [own, read @ ..] = &self.inputs[..] else { return Vec::new() };
        let folder = own.path.parent().unwrap_or(Path::new(""));
        let pictures = self.file.texture.iter().flat_map(|texture| &texture.images);
        let pictures = pictures.filter_map(|image| match image {
            TextureImage::File(path) => Some(path),
            TextureImage::Embedded { .. } => None,
        });
        let paths: BTreeSet<&PathBuf> = read.iter().map(|input| &input.path).chain(pictures).collect();
        let named = |path: &PathBuf| Some((path.strip_prefix(folder).ok()?.to_owned(), path.clone()));
        paths.into_iter().filter_map(named).collect()
    }

    /// The extension of files of its format: `obj`, `ply`, `stl`, `glb` or `gltf`.
    pub fn extension(&self) -> &'static str {
        match self.format {
            MeshFormat::Obj => "obj",
            MeshFormat::Ply => "ply",
            MeshFormat::Stl => "stl",
            MeshFormat::Gltf if self.bytes.starts_with(b"glTF") => "glb",
            MeshFormat::Gltf => "gltf",
        }
    }

    /// The file with its vertices at `positions` `[N, 3]`, in the mesh's order and in the file's own number type.
    ///
    /// Everything else stays byte for byte: polygons, texture coordinates, colours, groups, materials and all that is
    /// not read. Normals are taken anew: those of PLY; those of OBJ where each belongs to one vertex, otherwise none;
    /// those of glTF, creases staying creases. Tangents, morph targets and what no triangle of a glTF names stay. The
    /// buffers that a glTF has beside it are then within it.
    ///
    /// # Errors
    /// [`Fault::DoesNotFit`] or [`Fault::Malformed`] without a file, for STL, which has nothing to keep; for positions
    /// that are integers, quantized, sparse or shared by several parts of a scene; for one that is too large for the
    /// number type; and for as many as the mesh has not.
    pub fn with_positions(&self, positions: &[DVec3]) -> Result<Vec<u8>, FormatError> {
        let vertices = self.file.mesh.positions().len();
        let order = &self.file.order.vertices;
        if positions.len() != vertices || !positions.iter().all(|position| position.is_finite()) {
            let problem =
                format!("{} positions, not all finite perhaps, for {vertices} vertices", positions.len());
            return Err(Fault::DoesNotFit(problem).into());
        }
        Ok(match self.format {
            MeshFormat::Obj if *order == Numbers::Kept => obj::rewrite(&self.bytes, positions),
            MeshFormat::Ply if *order == Numbers::Kept => {
                ply::rewrite(&self.bytes, positions, self.file.mesh.triangles())?
            }
            MeshFormat::Gltf => gltf::rewrite(&self.bytes, order, positions)?,
            _ => {
                let problem = "keeps neither the order of vertices nor anything else that could be kept: \
                               have results as GLB, OBJ or PLY";
                return Err(Fault::at("STL", problem).into());
            }
        })
    }
}
