use std::io::Write;
use std::path::Path;

use crate::formats::error::FormatError;
use crate::formats::output::write_whole;
use crate::mesh::TriangleMesh;

/// The mesh as OBJ, vertices in their order, every coordinate with as many digits as it needs to be read back exactly.
pub fn obj_bytes(mesh: &TriangleMesh) -> Vec<u8> {
    let mut out = Vec::new();
    let written = write_statements(mesh, &mut out);
    debug_assert!(written.is_ok(), "memory takes every write");
    out
}

fn write_statements(mesh: &TriangleMesh, out: &mut Vec<u8>) -> std::io::Result<()> {
    for p in mesh.positions() {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for corners in mesh.triangles() {
        let [a, b, c] = corners.map(|index| u64::from(index) + 1);
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(())
}

/// Writes [`obj_bytes`] to a file.
///
/// # Errors
/// [`FormatError`] where the file cannot be written.
pub fn write_obj(path: impl AsRef<Path>, mesh: &TriangleMesh) -> Result<(), FormatError> {
    write_whole(path.as_ref(), &obj_bytes(mesh))
}
