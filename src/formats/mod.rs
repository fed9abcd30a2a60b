//! Files in and out: meshes, landmarks and whole collections. Layer 2: imports `mesh` alone.
//!
//! Readers trust nothing that a file says of itself: every count is held against the bytes that are there before
//! memory is taken for it, so that memory stays within a small multiple of the file's size, and no input panics.

mod collection;
mod digest;
mod error;
mod geometry;
mod glb;
mod gltf;
mod input;
mod landmarks;
mod mesh_format;
#[cfg(test)]
mod mutation;
mod obj;
mod output;
mod ply;
mod scheme;
mod text;

use std::path::Path;

pub use collection::{Collection, CollectionError, Member, Scan};
pub use digest::Sha256;
pub use error::{Fault, FormatError};
pub use glb::{Glb, glb_bytes, write_glb};
pub use input::InputFile;
pub use landmarks::{landmarks_json, parse_landmarks, read_landmarks, write_landmarks};
pub use mesh_format::MeshFormat;
pub use obj::{obj_bytes, write_obj};
pub use output::write_whole;
pub use ply::{ply_bytes, write_ply};
pub use scheme::{Region, Scheme};

use crate::mesh::TriangleMesh;
use input::Siblings;

/// Reads the triangle mesh in an OBJ, PLY, glTF or GLB file, in the file's own space and units.
///
/// The format is told from the content, and from the file's extension where the content does not say. Polygons become
/// fans of triangles; polygons of fewer than three corners are left out.
///
/// Vertices of OBJ and PLY keep their number and order, also those that no triangle names. glTF repeats a vertex for
/// each normal and texture coordinate it has, so that its seams are closed again: vertices of open edges in the same
/// place become one, vertices that no triangle names are dropped, and the others keep their order. Files by
/// [`write_glb`] are read as they are.
///
/// # Errors
/// [`FormatError`] names the file, the line or element, what was found there and what to do.
pub fn read_mesh(path: impl AsRef<Path>) -> Result<TriangleMesh, FormatError> {
    let path = path.as_ref();
    let siblings = Siblings::of(path);
    read_with(path, &siblings).map(|(mesh, _)| mesh)
}

/// Reads a mesh as [`read_mesh`] does, from the bytes of a file of the given format.
///
/// # Errors
/// [`FormatError`] without a file; [`FormatError::in_file`] adds one. A glTF that names other files is refused.
pub fn parse_mesh(bytes: &[u8], format: MeshFormat) -> Result<TriangleMesh, FormatError> {
    Ok(parse(bytes, format, &Siblings::none())?)
}

/// The mesh at `path` and the files it was read from, the first of them `path` itself.
fn read_mesh_and_inputs(path: &Path) -> Result<(TriangleMesh, Vec<InputFile>), FormatError> {
    let siblings = Siblings::of(path);
    let (mesh, bytes) = read_with(path, &siblings)?;
    let mut inputs = vec![InputFile::of(path, &bytes)];
    inputs.extend(siblings.into_read());
    Ok((mesh, inputs))
}

fn read_with(path: &Path, siblings: &Siblings) -> Result<(TriangleMesh, Vec<u8>), FormatError> {
    let bytes = input::read_file(path)?;
    let extension = path.extension().and_then(|e| e.to_str());
    let mesh = match MeshFormat::sniff(&bytes, extension) {
        Some(format) => parse(&bytes, format, siblings),
        None => Err(Fault::UnknownFormat { start: text::shown(&bytes) }),
    };
    mesh.map(|mesh| (mesh, bytes)).map_err(|fault| FormatError::from(fault).in_file(path))
}

fn parse(bytes: &[u8], format: MeshFormat, siblings: &Siblings) -> Result<TriangleMesh, Fault> {
    let geometry = match format {
        MeshFormat::Obj => obj::read(bytes),
        MeshFormat::Ply => ply::read(bytes),
        MeshFormat::Gltf => gltf::read(bytes, siblings),
    }?;
    Ok(TriangleMesh::new(geometry.positions, geometry.triangles)?)
}
