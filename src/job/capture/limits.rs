use serde::{Deserialize, Serialize};

/// How large a capture may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CaptureLimits {
    /// Bytes of one uploaded file.
    pub upload_bytes: u64,
    /// Bytes of all its files, unpacked.
    pub bytes: u64,
    /// Files.
    pub files: usize,
    /// Pictures with cameras.
    pub views: usize,
    /// Pixels of one picture.
    pub picture_pixels: u64,
}

impl Default for CaptureLimits {
    fn default() -> Self {
        Self { upload_bytes: 2 << 30, bytes: 4 << 30, files: 4000, views: 1000, picture_pixels: 64_000_000 }
    }
}
