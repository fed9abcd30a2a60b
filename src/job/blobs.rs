//! Files by their content, on the disk.

use std::collections::HashMap;
use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use bytes::Bytes;
use futures_util::stream::BoxStream;
use futures_util::{Stream, StreamExt, TryStreamExt};
use object_store::local::LocalFileSystem;
use object_store::path::Path as Key;
use object_store::{GetOptions, GetRange, ObjectMeta, ObjectStore, ObjectStoreExt, WriteMultipart};
use sha2::Digest;

use super::store_error::StoreError;
use crate::formats::Sha256;

/// Bytes that are written at once.
const PART: usize = 1 << 20;
/// Parts of one upload on their way to the disk.
const PARTS_UNDER_WAY: usize = 2;

/// Bytes kept under their own SHA-256: what is put twice is there once, and never changes.
#[derive(Debug, Clone)]
pub struct Blobs {
    store: Arc<dyn ObjectStore>,
    /// Where the files are, for readers that need a path.
    root: PathBuf,
    pins: Arc<Pins>,
}

/// Who holds which blob.
#[derive(Debug, Default)]
struct Pins(Mutex<Held>);

#[derive(Debug, Default)]
struct Held {
    /// How often each blob is held by someone who is about to keep a record of it.
    counts: HashMap<Sha256, usize>,
    /// Blobs that were let go of since this was last asked.
    released: Vec<Sha256>,
}

/// Which bytes, and how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BlobInfo {
    /// Their digest, by which they are found.
    pub digest: Sha256,
    /// Their number.
    pub size: u64,
}

/// A blob that has been put. While this value lives, [`Blobs::remove_unpinned`] leaves the blob alone, so hold it until
/// the record that names the blob is committed.
#[derive(Debug)]
pub struct Kept {
    /// Which.
    pub info: BlobInfo,
    pins: Arc<Pins>,
}

/// A blob's bytes, or a range of them, as they are read.
pub struct BlobStream {
    /// Bytes of the whole blob.
    pub size: u64,
    /// The bytes that come.
    pub range: Range<u64>,
    /// The bytes.
    pub bytes: BoxStream<'static, Result<Bytes, object_store::Error>>,
}

impl Blobs {
    /// The blobs of a data folder, beneath its `blobs/`; what is being written is beneath its `uploads/`.
    ///
    /// # Errors
    /// [`StoreError::Blobs`] if the folder is not there.
    pub fn open(data_folder: &Path) -> Result<Self, StoreError> {
        let store = LocalFileSystem::new_with_prefix(data_folder)?.with_fsync(true);
        let root = std::path::absolute(data_folder).unwrap_or_else(|_| data_folder.to_owned());
        Ok(Self { store: Arc::new(store), root, pins: Arc::default() })
    }

    /// Keeps what a stream brings, up to `limit` bytes. It is on the disk, with its name, when this returns.
    ///
    /// # Errors
    /// [`StoreError::TooLarge`], [`StoreError::BrokenOff`] if the stream fails, [`StoreError::Blobs`] if the disk does;
    /// nothing is kept then.
    pub async fn put<E: std::fmt::Display>(
        &self,
        stream: impl Stream<Item = Result<Bytes, E>>,
        limit: u64,
    ) -> Result<Kept, StoreError> {
        let upload = Key::from(format!("uploads/{}", uuid::Uuid::new_v4().simple()));
        let mut writer = WriteMultipart::new_with_chunk_size(self.store.put_multipart(&upload).await?, PART);
        let written = write(stream, limit, &mut writer).await;
        let (digest, size) = match written {
            Ok(written) => written,
            Err(error) => {
                // What is left behind otherwise goes when the folder is opened next.
                let _ = writer.abort().await;
                return Err(error);
            }
        };
        writer.finish().await?;
        let kept = self.pin(digest, size);
        // Also where it is there already: a damaged copy is so repaired.
        self.store.rename(&upload, &key(digest)).await?;
        Ok(kept)
    }

    /// Keeps bytes that are there already.
    ///
    /// # Errors
    /// [`StoreError::Blobs`].
    pub async fn put_bytes(&self, bytes: impl Into<Bytes>) -> Result<Kept, StoreError> {
        let one = futures_util::stream::iter([Ok::<_, std::convert::Infallible>(bytes.into())]);
        self.put(one, u64::MAX).await
    }

    /// The whole of a blob, whose bytes are held against its digest.
    ///
    /// # Errors
    /// [`StoreError::Missing`], [`StoreError::Corrupted`], [`StoreError::Blobs`].
    pub async fn read(&self, digest: Sha256) -> Result<Bytes, StoreError> {
        let found = self.store.get(&key(digest)).await.map_err(|error| missing(digest, error))?;
        let bytes = found.bytes().await?;
        let whole = bytes.clone();
        let found = tokio::task::spawn_blocking(move || Sha256::of(&whole)).await;
        if found.is_ok_and(|found| found == digest) {
            Ok(bytes)
        } else {
            Err(StoreError::Corrupted { digest })
        }
    }

    /// A blob's bytes, or those of a range of it, as a stream.
    ///
    /// # Errors
    /// [`StoreError::Missing`], [`StoreError::Blobs`].
    pub async fn open_range(
        &self,
        digest: Sha256,
        range: Option<Range<u64>>,
    ) -> Result<BlobStream, StoreError> {
        let options = GetOptions { range: range.map(GetRange::Bounded), ..GetOptions::default() };
        let found =
            self.store.get_opts(&key(digest), options).await.map_err(|error| missing(digest, error))?;
        Ok(BlobStream { size: found.meta.size, range: found.range.clone(), bytes: found.into_stream() })
    }

    /// Bytes of a blob; `None` if it is not there.
    ///
    /// # Errors
    /// [`StoreError::Blobs`].
    pub async fn size(&self, digest: Sha256) -> Result<Option<u64>, StoreError> {
        match self.store.head(&key(digest)).await {
            Ok(found) => Ok(Some(found.size)),
            Err(object_store::Error::NotFound { .. }) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// Whether a blob's bytes are those that were kept; reads all of it, a little at a time.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub async fn verify(&self, digest: Sha256) -> Result<(), StoreError> {
        let mut found = self.open_range(digest, None).await?.bytes;
        let mut hasher = sha2::Sha256::new();
        while let Some(bytes) = found.try_next().await? {
            hasher.update(&bytes);
        }
        if Sha256::from(hasher) == digest { Ok(()) } else { Err(StoreError::Corrupted { digest }) }
    }

    /// The file of a blob, whose bytes are held against its digest before, for readers that take a piece at a time. It
    /// can be read as long as it is open, even where the blob is deleted meanwhile.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub async fn open_file(&self, digest: Sha256) -> Result<File, StoreError> {
        self.verify(digest).await?;
        File::open(self.path(digest)).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => StoreError::Missing { digest },
            _ => StoreError::Folder { path: self.path(digest), error },
        })
    }

    /// The file of a blob, for readers that need a path. Its bytes are not looked at.
    pub fn path(&self, digest: Sha256) -> PathBuf {
        self.root.join(key(digest).as_ref())
    }

    /// Every blob that is kept, in no order; files whose names are no digests are passed over.
    pub fn list(&self) -> BoxStream<'static, Result<(Sha256, ObjectMeta), StoreError>> {
        let all = self.store.list(Some(&Key::from("blobs"))).map_err(StoreError::from);
        all.try_filter_map(|meta| async {
            Ok(meta.location.filename().and_then(|name| name.parse().ok()).map(|digest| (digest, meta)))
        })
        .boxed()
    }

    /// Deletes a blob unless somebody is about to keep a record of it; says whether it did. Ask in a write transaction
    /// that sees no record of it: records are committed by such transactions while the blob is pinned.
    ///
    /// # Errors
    /// [`StoreError::Blobs`].
    pub async fn remove_unpinned(&self, digest: Sha256) -> Result<bool, StoreError> {
        if self.pins.lock().counts.contains_key(&digest) {
            return Ok(false);
        }
        match self.store.delete(&key(digest)).await {
            Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(true),
            Err(error) => Err(error.into()),
        }
    }

    /// The blobs that nobody holds any more, since this was last asked. Those that no record names were put in vain.
    pub fn take_released(&self) -> Vec<Sha256> {
        std::mem::take(&mut self.pins.lock().released)
    }

    fn pin(&self, digest: Sha256, size: u64) -> Kept {
        *self.pins.lock().counts.entry(digest).or_insert(0) += 1;
        Kept { info: BlobInfo { digest, size }, pins: self.pins.clone() }
    }
}

async fn write<E: std::fmt::Display>(
    stream: impl Stream<Item = Result<Bytes, E>>,
    limit: u64,
    writer: &mut WriteMultipart,
) -> Result<(Sha256, u64), StoreError> {
    let mut stream = std::pin::pin!(stream);
    let (mut hasher, mut size) = (sha2::Sha256::new(), 0);
    while let Some(bytes) = stream.next().await {
        let bytes = bytes.map_err(|error| StoreError::BrokenOff(error.to_string()))?;
        size += bytes.len() as u64;
        if size > limit {
            return Err(StoreError::TooLarge { limit });
        }
        hasher.update(&bytes);
        writer.wait_for_capacity(PARTS_UNDER_WAY).await?;
        writer.put(bytes);
    }
    Ok((Sha256::from(hasher), size))
}

/// In one of 256 folders, so that none grows too large to list.
fn key(digest: Sha256) -> Key {
    let name = digest.to_string();
    Key::from(format!("blobs/{}/{name}", &name[..2]))
}

fn missing(digest: Sha256, error: object_store::Error) -> StoreError {
    match error {
        object_store::Error::NotFound { .. } => StoreError::Missing { digest },
        error => error.into(),
    }
}

impl Pins {
    fn lock(&self) -> std::sync::MutexGuard<'_, Held> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Kept {
    fn drop(&mut self) {
        let digest = self.info.digest;
        let Held { counts, released } = &mut *self.pins.lock();
        if let Some(count) = counts.get_mut(&digest) {
            *count -= 1;
            if *count == 0 {
                counts.remove(&digest);
                released.push(digest);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;
    use crate::job::DataFolder;

    fn blobs() -> (tempfile::TempDir, DataFolder, Blobs) {
        let kept = tempfile::tempdir().unwrap();
        let folder = DataFolder::open(kept.path()).unwrap();
        let blobs = Blobs::open(folder.path()).unwrap();
        (kept, folder, blobs)
    }

    fn parts(count: usize) -> impl Stream<Item = Result<Bytes, Infallible>> {
        futures_util::stream::iter((0..count).map(|k| Ok(Bytes::from(vec![k as u8; 700_000]))))
    }

    #[tokio::test]
    async fn what_is_put_is_there_under_its_digest() {
        let (_kept, folder, blobs) = blobs();
        let kept = blobs.put(parts(5), u64::MAX).await.unwrap();
        let BlobInfo { digest, size } = kept.info;
        let whole = blobs.read(digest).await.unwrap();
        assert_eq!((size, Sha256::of(&whole)), (3_500_000, digest));
        let part = blobs.open_range(digest, Some(699_999..700_001)).await.unwrap();
        let part: Vec<Bytes> = part.bytes.try_collect().await.unwrap();
        assert_eq!(part.concat(), [0, 1]);
        assert_eq!(std::fs::read(blobs.path(digest)).unwrap(), whole);
        let all: Vec<_> = blobs.list().try_collect().await.unwrap();
        assert_eq!(all.iter().map(|(digest, _)| *digest).collect::<Vec<_>>(), [digest]);
        assert_eq!(std::fs::read_dir(folder.uploads()).unwrap().count(), 0);
    }

    #[tokio::test]
    async fn what_breaks_off_or_is_too_large_leaves_nothing() {
        let (_kept, folder, blobs) = blobs();
        assert!(matches!(
            blobs.put(parts(5), 3_000_000).await,
            Err(StoreError::TooLarge { limit: 3_000_000 })
        ));
        let breaks =
            parts(3).map(|part| part.map_err(|_| "")).chain(futures_util::stream::iter([Err("gone")]));
        assert!(matches!(blobs.put(breaks, u64::MAX).await, Err(StoreError::BrokenOff(_))));
        assert_eq!(blobs.list().count().await, 0);
        assert_eq!(std::fs::read_dir(folder.uploads()).unwrap().count(), 0);
    }

    #[tokio::test]
    async fn a_damaged_blob_is_found_and_repaired_by_the_same_bytes() {
        let (_kept, _folder, blobs) = blobs();
        let digest = blobs.put_bytes("whole").await.unwrap().info.digest;
        std::fs::write(blobs.path(digest), "wrong").unwrap();
        assert!(matches!(blobs.read(digest).await, Err(StoreError::Corrupted { .. })));
        assert!(matches!(blobs.verify(digest).await, Err(StoreError::Corrupted { .. })));
        blobs.put_bytes("whole").await.unwrap();
        blobs.verify(digest).await.unwrap();
        assert_eq!(blobs.read(digest).await.unwrap(), "whole");
    }

    #[tokio::test]
    async fn a_blob_stays_while_somebody_holds_it() {
        let (_kept, _folder, blobs) = blobs();
        let first = blobs.put_bytes("x").await.unwrap();
        let second = blobs.put_bytes("x").await.unwrap();
        let digest = first.info.digest;
        drop(first);
        assert!(!blobs.remove_unpinned(digest).await.unwrap());
        drop(second);
        assert!(blobs.remove_unpinned(digest).await.unwrap());
        assert!(matches!(blobs.read(digest).await, Err(StoreError::Missing { .. })));
        assert_eq!(blobs.size(digest).await.unwrap(), None);
    }
}
