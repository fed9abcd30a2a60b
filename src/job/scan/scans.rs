use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use serde_json::Value;
use sha2::Digest;
use sqlx::sqlite::SqliteRow;
use tokio::sync::Semaphore;

use super::fault::{Part, ScanFault};
use super::files::ScanFiles;
use super::id::ScanId;
use super::limits::ScanLimits;
use super::record::{MeshKind, RECORD, Scan, ScanParts};
use crate::formats::Sha256;
use crate::job::blobs::{Blobs, Kept};
use crate::job::clock::now;
use crate::job::database::Database;
use crate::job::store_error::StoreError;
use crate::job::sweep::collect_soon;

/// The scans of a data folder; cheap to clone.
#[derive(Debug, Clone)]
pub struct Scans {
    database: Database,
    blobs: Blobs,
    /// Where zips are unpacked.
    scratch: PathBuf,
    limits: ScanLimits,
    /// How long a scan is kept.
    keep: Option<Duration>,
    /// Scans that are read at the same time, which bounds memory.
    readers: Arc<Semaphore>,
}

/// A scan whose files are in the store and that nobody has looked at yet.
#[derive(Debug)]
pub struct NewScan {
    /// What people call it.
    pub name: Option<String>,
    /// What the mesh's bytes are.
    pub kind: MeshKind,
    /// The mesh, or the zip that holds it.
    pub mesh: Kept,
    /// The landmarks.
    pub landmarks: Option<Kept>,
    /// The mask.
    pub mask: Option<Kept>,
    /// The texture.
    pub texture: Option<Kept>,
}

/// Why a scan cannot be kept or found.
#[derive(Debug, thiserror::Error)]
pub enum ScanError {
    /// A file of it is wrong.
    #[error(transparent)]
    Fault(#[from] ScanFault),
    /// There is none of that id.
    #[error("there is no scan {0}")]
    NotFound(ScanId),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The reader crashed, which is a fault of ours.
    #[error("reading the scan crashed; please report it with the file")]
    Crashed,
}

impl From<sqlx::Error> for ScanError {
    fn from(error: sqlx::Error) -> Self {
        Self::Store(error.into())
    }
}

impl Scans {
    /// The scans of a database and blob store. `scratch` is a folder that zips are unpacked in, `keep` how long a scan is
    /// kept, `at_once` how many are read at the same time.
    pub fn new(
        database: Database,
        blobs: Blobs,
        scratch: PathBuf,
        limits: ScanLimits,
        keep: Option<Duration>,
        at_once: usize,
    ) -> Self {
        let readers = Arc::new(Semaphore::new(at_once.max(1)));
        Self { database, blobs, scratch, limits, keep, readers }
    }

    /// How large scans may be.
    pub fn limits(&self) -> &ScanLimits {
        &self.limits
    }

    /// Reads an uploaded scan, and keeps it with what was found; says whether it is new. The same files under the same
    /// name are the same scan, as it stands, and are kept as long from now on.
    ///
    /// # Errors
    /// [`ScanError::Fault`] if a file is wrong: nothing is kept then.
    pub async fn add(&self, new: NewScan) -> Result<(Scan, bool), ScanError> {
        let id = id_of(&new);
        let expires_at = self.expiry();
        let touch = "UPDATE scan SET expires_at = ? WHERE id = ? RETURNING *";
        let touch = sqlx::query(touch).bind(expires_at).bind(id.as_str());
        if let Some(row) = touch.fetch_optional(self.database.writer()).await? {
            return Ok((row.try_into()?, false));
        }
        let parts = parts_of(&new);
        let report = self.report(&parts).await?;
        let insert = "INSERT INTO scan \
            (id, record, name, format, mesh, landmarks, mask, texture, size, report, created_at, expires_at) \
            VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?) \
            ON CONFLICT (id) DO UPDATE SET expires_at = excluded.expires_at RETURNING *";
        let row = sqlx::query(insert)
            .bind(id.as_str())
            .bind(RECORD)
            .bind(&new.name)
            .bind(parts.kind.extension())
            .bind(parts.mesh.to_string())
            .bind(text(parts.landmarks))
            .bind(text(parts.mask))
            .bind(text(parts.texture))
            .bind(new.mesh.info.size.cast_signed())
            .bind(report.to_string())
            .bind(now())
            .bind(expires_at)
            .fetch_one(self.database.writer())
            .await?;
        Ok((row.try_into()?, true))
    }

    /// A scan.
    ///
    /// # Errors
    /// [`ScanError::NotFound`].
    pub async fn get(&self, id: &ScanId) -> Result<Scan, ScanError> {
        let query = sqlx::query("SELECT * FROM scan WHERE id = ?").bind(id.as_str());
        found(id, query.fetch_optional(self.database.reader()).await?)
    }

    /// At most `limit` scans, the latest first, all from before `before`, a scan's `sequence`.
    ///
    /// # Errors
    /// [`ScanError::Store`].
    pub async fn list(&self, limit: u32, before: Option<i64>) -> Result<Vec<Scan>, ScanError> {
        let query = "SELECT * FROM scan WHERE sequence < ? ORDER BY sequence DESC LIMIT ?";
        let query = sqlx::query(query).bind(before.unwrap_or(i64::MAX)).bind(limit);
        let rows = query.fetch_all(self.database.reader()).await?;
        Ok(rows.into_iter().map(Scan::try_from).collect::<Result<_, _>>()?)
    }

    /// Deletes a scan. Registrations that were asked for keep its files as long as they need them.
    ///
    /// # Errors
    /// [`ScanError::NotFound`].
    pub async fn delete(&self, id: &ScanId) -> Result<(), ScanError> {
        let query = sqlx::query("DELETE FROM scan WHERE id = ? RETURNING *").bind(id.as_str());
        let deleted = found(id, query.fetch_optional(self.database.writer()).await?)?;
        collect_soon(&self.database, &self.blobs, deleted.parts.digests().collect()).await;
        Ok(())
    }

    /// Gives a scan its landmarks, mask or texture in place of those it had, and looks at all of it again.
    ///
    /// # Errors
    /// [`ScanError::Fault`] if it does not go with the scan, which then stays as it was; [`ScanError::NotFound`].
    pub async fn set(&self, id: &ScanId, part: Part, file: Kept) -> Result<Scan, ScanError> {
        let (scan, before) = self.replace(id, part, file).await?;
        collect_soon(&self.database, &self.blobs, before.digests().collect()).await;
        Ok(scan)
    }

    /// Sets a part; gives the scan, and the parts that it had.
    async fn replace(&self, id: &ScanId, part: Part, file: Kept) -> Result<(Scan, ScanParts), ScanError> {
        loop {
            let old = self.get(id).await?.parts;
            let mut parts = old.clone();
            let digest = Some(file.info.digest);
            match part {
                Part::Landmarks => parts.landmarks = digest,
                Part::Mask => parts.mask = digest,
                Part::Texture => parts.texture = digest,
                // A scan is its mesh: another one is another scan.
                Part::Mesh => return Ok((self.get(id).await?, old)),
            }
            let report = self.report(&parts).await?;
            // Another part may have been set meanwhile, which the report then would not know.
            let update = "UPDATE scan SET landmarks = ?, mask = ?, texture = ?, report = ? \
                WHERE id = ? AND landmarks IS ? AND mask IS ? AND texture IS ? RETURNING *";
            let row = sqlx::query(update)
                .bind(text(parts.landmarks))
                .bind(text(parts.mask))
                .bind(text(parts.texture))
                .bind(report.to_string())
                .bind(id.as_str())
                .bind(text(old.landmarks))
                .bind(text(old.mask))
                .bind(text(old.texture))
                .fetch_optional(self.database.writer())
                .await?;
            if let Some(row) = row {
                return Ok((row.try_into()?, old));
            }
        }
    }

    /// Reads a scan's files on a thread for such work, and says what is known of it.
    async fn report(&self, parts: &ScanParts) -> Result<Value, ScanError> {
        let _turn = self.readers.acquire().await;
        let files = ScanFiles::fetch(&self.blobs, parts).await?;
        let (limits, scratch) = (self.limits, self.scratch.clone());
        let work = move || {
            let read = files.read(&limits, &scratch)?;
            let mut report = serde_json::to_value(read.inspect()).unwrap_or_default();
            report["warnings"] = read.file.warnings.into();
            Ok(report)
        };
        tokio::task::spawn_blocking(work).await.map_err(|_| ScanError::Crashed)?
    }

    fn expiry(&self) -> Option<i64> {
        let keep = i64::try_from(self.keep?.as_millis()).unwrap_or(i64::MAX);
        Some(now().saturating_add(keep))
    }
}

fn found(id: &ScanId, row: Option<SqliteRow>) -> Result<Scan, ScanError> {
    match row {
        Some(row) => Ok(row.try_into()?),
        None => Err(ScanError::NotFound(id.clone())),
    }
}

fn parts_of(new: &NewScan) -> ScanParts {
    let digest = |kept: &Option<Kept>| kept.as_ref().map(|kept| kept.info.digest);
    ScanParts {
        kind: new.kind,
        mesh: new.mesh.info.digest,
        landmarks: digest(&new.landmarks),
        mask: digest(&new.mask),
        texture: digest(&new.texture),
    }
}

fn id_of(new: &NewScan) -> ScanId {
    let ScanParts { kind, mesh, landmarks, mask, texture } = parts_of(new);
    let mut hasher = sha2::Sha256::new();
    let name = new.name.as_deref();
    for part in [Some(mesh), landmarks, mask, texture].map(text) {
        hasher.update(part.unwrap_or_default());
        hasher.update("\n");
    }
    hasher.update(format!("{kind}\n{}", name.map(|name| format!("={name}")).unwrap_or_default()));
    ScanId::of(hasher.into())
}

fn text(digest: Option<Sha256>) -> Option<String> {
    digest.map(|digest| digest.to_string())
}
