use serde::{Deserialize, Serialize};

/// How large a scan may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScanLimits {
    /// Bytes of one uploaded file.
    pub upload_bytes: u64,
    /// Vertices of a mesh.
    pub vertices: usize,
    /// Triangles of a mesh.
    pub triangles: usize,
    /// Pixels of a texture or of a painted mask.
    pub texture_pixels: u64,
    /// Bytes that a zip may have when it is unpacked.
    pub unpacked_bytes: u64,
    /// Files in a zip.
    pub zip_files: usize,
}

impl Default for ScanLimits {
    fn default() -> Self {
        Self {
            upload_bytes: 512 << 20,
            vertices: 5_000_000,
            triangles: 10_000_000,
            texture_pixels: 16_384 * 16_384,
            unpacked_bytes: 2 << 30,
            zip_files: 64,
        }
    }
}
