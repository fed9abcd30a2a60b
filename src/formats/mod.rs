//! Files in and out: meshes, landmarks and whole collections. Layer 2: imports `mesh`, and `camera` for captures.
//!
//! Readers trust nothing that a file says of itself: every count is held against the bytes that are there before
//! memory is taken for it, so that memory stays within a small multiple of the file's size, and no input panics.

mod area_normals;
mod capture;
mod collection;
mod digest;
mod error;
mod geometry;
mod glb;
mod gltf;
mod input;
mod landmarks;
mod mask;
mod mesh_file;
mod mesh_format;
mod mesh_source;
mod numbering;
mod obj;
mod output;
mod pixels;
mod ply;
mod polygons;
mod scheme;
mod splices;
mod stl;
mod stream;
mod text;
mod texture;
mod weld;

use std::path::Path;

pub use capture::{Capture, CaptureView, Photograph, write_capture};
pub use collection::{Collection, CollectionError, Member, Refused, Scan};
pub use digest::Sha256;
pub use error::{Fault, FormatError};
pub use glb::{Glb, glb_bytes, write_glb};
pub use gltf::scene_extras;
pub use input::InputFile;
pub use landmarks::{LandmarkFile, landmarks_json, parse_landmarks, read_landmarks, write_landmarks};
pub use mask::MaskFile;
pub use mesh_file::MeshFile;
pub use mesh_format::MeshFormat;
pub use mesh_source::MeshSource;
pub use obj::{Obj, obj_bytes, write_obj};
pub use output::write_whole;
pub use pixels::{Encoding, Pixels};
pub use ply::{Ply, ply_bytes, write_ply};
pub use polygons::Polygons;
pub use scheme::{Region, Scheme};
pub use texture::{ImageOrigin, Texture, TextureImage};

use crate::mesh::TriangleMesh;

/// The mesh alone of [`MeshFile::read`].
///
/// # Errors
/// As [`MeshFile::read`].
pub fn read_mesh(path: impl AsRef<Path>) -> Result<TriangleMesh, FormatError> {
    MeshFile::read(path).map(|file| file.mesh)
}

/// The mesh alone of [`MeshFile::parse`].
///
/// # Errors
/// As [`MeshFile::parse`].
pub fn parse_mesh(bytes: &[u8], format: MeshFormat) -> Result<TriangleMesh, FormatError> {
    MeshFile::parse(bytes, format).map(|file| file.mesh)
}
