use std::path::Path;

use crate::formats::error::FormatError;
use crate::formats::output::write_whole;
use crate::mesh::TriangleMesh;

/// The mesh as binary little-endian PLY, vertices in their order, coordinates as doubles: read back, it is the same mesh.
pub fn ply_bytes(mesh: &TriangleMesh) -> Vec<u8> {
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\n\
         property double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.positions().len(),
        mesh.triangles().len()
    );
    let mut out = header.into_bytes();
    out.reserve(mesh.positions().len() * 24 + mesh.triangles().len() * 13);
    for coordinate in mesh.positions().iter().flat_map(|p| p.to_array()) {
        out.extend(coordinate.to_le_bytes());
    }
    for corners in mesh.triangles() {
        out.push(3);
        out.extend(corners.iter().flat_map(|index| index.to_le_bytes()));
    }
    out
}

/// Writes [`ply_bytes`] to a file.
///
/// # Errors
/// [`FormatError`] where the file cannot be written.
pub fn write_ply(path: impl AsRef<Path>, mesh: &TriangleMesh) -> Result<(), FormatError> {
    write_whole(path.as_ref(), &ply_bytes(mesh))
}
