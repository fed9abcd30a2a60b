use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use super::store_error::StoreError;

/// The one folder that holds everything the service keeps: `onemesh.db`, `blobs/`, and `uploads/` for what has not
/// arrived whole. One server at a time works in it.
#[derive(Debug)]
pub struct DataFolder {
    path: PathBuf,
    /// Locked as long as it is open; the system lets go of it even if the process is killed.
    _lock: File,
}

impl DataFolder {
    /// Opens the folder, and makes it where it is not there. What is left in `uploads/` by a process that ended is deleted.
    ///
    /// # Errors
    /// [`StoreError::Folder`] if it cannot be written to; [`StoreError::InUse`] if another server works in it.
    pub fn open(path: impl Into<PathBuf>) -> Result<Self, StoreError> {
        let path = path.into();
        let failed = |error| StoreError::Folder { path: path.clone(), error };
        std::fs::create_dir_all(path.join("blobs")).map_err(failed)?;
        let lock = File::create(path.join("lock")).map_err(failed)?;
        match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(StoreError::InUse { path }),
            Err(TryLockError::Error(error)) => return Err(failed(error)),
        }
        let uploads = path.join("uploads");
        match std::fs::remove_dir_all(&uploads) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(failed(error)),
            _ => std::fs::create_dir(&uploads).map_err(failed)?,
        }
        Ok(Self { path, _lock: lock })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The database's file.
    pub fn database(&self) -> PathBuf {
        self.path.join("onemesh.db")
    }

    /// A folder on the same disk for what may be deleted at any time that nobody works in it.
    pub fn uploads(&self) -> PathBuf {
        self.path.join("uploads")
    }

    /// Whether a file can be made, written to the disk and deleted again.
    ///
    /// # Errors
    /// [`StoreError::Folder`] with what the system says.
    pub fn check_writable(&self) -> Result<(), StoreError> {
        // Several may ask at the same time.
        let probe = self.uploads().join(format!("probe-{}", uuid::Uuid::new_v4().simple()));
        let write = || {
            std::fs::write(&probe, b"probe")?;
            File::open(&probe)?.sync_all()?;
            std::fs::remove_file(&probe)
        };
        write().map_err(|error| StoreError::Folder { path: self.path.clone(), error })
    }

    /// Bytes that are free on its disk.
    ///
    /// # Errors
    /// [`StoreError::Folder`] if the system does not say.
    pub fn free_bytes(&self) -> Result<u64, StoreError> {
        let failed = |error| StoreError::Folder { path: self.path.clone(), error };
        fs4::available_space(&self.path).map_err(failed)
    }
}
