use std::io;
use std::path::PathBuf;

use crate::formats::Sha256;

/// Why something cannot be kept or found again.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The data folder cannot be used.
    #[error("{}: cannot be used as data folder: {error}; it must be there, writable and not full", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// Another server works in the data folder.
    #[error("{}: another onemesh works in this data folder; stop it or choose another folder", path.display())]
    InUse {
        /// The folder.
        path: PathBuf,
    },
    /// The database is of a version that this program does not know.
    #[error(
        "the database cannot be brought to this program's version: {0}; was the data folder used by a newer onemesh?"
    )]
    Version(#[from] sqlx::migrate::MigrateError),
    /// The database failed.
    #[error("the database failed: {0}")]
    Database(#[from] sqlx::Error),
    /// The blob store failed.
    #[error("the blob store failed: {0}")]
    Blobs(#[from] object_store::Error),
    /// A blob's bytes are not those that were kept.
    #[error(
        "the blob {digest} is damaged: its bytes have another digest; put the scan again, or restore a backup"
    )]
    Corrupted {
        /// The digest that it should have.
        digest: Sha256,
    },
    /// A blob is gone.
    #[error("the blob {digest} is missing; put the scan again, or restore a backup")]
    Missing {
        /// Its digest.
        digest: Sha256,
    },
    /// What comes in ended early.
    #[error("what was sent broke off: {0}")]
    BrokenOff(String),
    /// What comes in is too large.
    #[error("more than {limit} bytes were sent")]
    TooLarge {
        /// Bytes that are taken.
        limit: u64,
    },
    /// A stored record cannot be understood.
    #[error("a stored record of {what} cannot be read: {problem}")]
    Record {
        /// What it is of.
        what: &'static str,
        /// What is wrong with it.
        problem: String,
    },
}

impl StoreError {
    /// Whether the disk has no room left.
    pub fn is_full(&self) -> bool {
        let full = |error: &io::Error| {
            matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded)
        };
        let mut source = Some(self as &(dyn std::error::Error + 'static));
        while let Some(error) = source {
            let database = error.downcast_ref::<sqlx::Error>().and_then(|error| error.as_database_error());
            // SQLITE_FULL.
            if error.downcast_ref().is_some_and(full)
                || database.is_some_and(|e| e.code().as_deref() == Some("13"))
            {
                return true;
            }
            source = error.source();
        }
        matches!(self, Self::Folder { error, .. } if full(error))
    }
}
