//! What is no longer needed goes: blobs that no record names, jobs and scans whose time is over.

use std::collections::HashSet;

use futures_util::TryStreamExt;
use sqlx::sqlite::SqliteConnection;

use super::blobs::Blobs;
use super::clock::now;
use super::database::Database;
use super::engine::Engine;
use super::graph::{self, Changed};
use super::record::json;
use super::state::Status;
use super::store_error::StoreError;
use crate::formats::Sha256;

/// Blobs that are deleted while others wait to write.
const AT_ONCE: usize = 64;

/// Deletes those of these blobs that no record names.
///
/// # Errors
/// [`StoreError`].
pub(super) async fn collect(
    database: &Database,
    blobs: &Blobs,
    candidates: Vec<Sha256>,
) -> Result<usize, StoreError> {
    let mut deleted = 0;
    for some in candidates.chunks(AT_ONCE) {
        // In a transaction that may write: records of a blob are made by such ones, while the blob is pinned.
        let mut tx = database.begin_write().await?;
        let named = named_of(&mut tx, some).await?;
        for digest in some.iter().filter(|digest| !named.contains(*digest)) {
            deleted += usize::from(blobs.remove_unpinned(*digest).await?);
        }
        tx.rollback().await?;
    }
    Ok(deleted)
}

/// Those of some blobs that a record names.
async fn named_of(tx: &mut SqliteConnection, some: &[Sha256]) -> Result<HashSet<Sha256>, StoreError> {
    let query = "SELECT digest FROM (SELECT digest FROM uploaded_blob UNION SELECT digest FROM job_blob)
        WHERE digest IN (SELECT value FROM json_each(?))";
    let some: Vec<String> = some.iter().map(ToString::to_string).collect();
    let digests: Vec<String> = sqlx::query_scalar(query).bind(json(&some)).fetch_all(tx).await?;
    Ok(digests.iter().filter_map(|digest| digest.parse().ok()).collect())
}

async fn named(tx: &mut SqliteConnection) -> Result<HashSet<Sha256>, StoreError> {
    let query = "SELECT digest FROM uploaded_blob UNION SELECT digest FROM job_blob";
    let digests: Vec<String> = sqlx::query_scalar(query).fetch_all(tx).await?;
    Ok(digests.iter().filter_map(|digest| digest.parse().ok()).collect())
}

/// The same of blobs whose record has just gone: what fails is deleted later.
pub(super) async fn collect_soon(database: &Database, blobs: &Blobs, candidates: Vec<Sha256>) {
    if let Err(error) = collect(database, blobs, candidates).await {
        tracing::warn!(%error, "what is no longer needed cannot be deleted now");
    }
}

/// Deletes every blob that no record names, as a run that ended in the middle leaves them.
///
/// # Errors
/// [`StoreError`].
pub(super) async fn collect_all(engine: &Engine) -> Result<usize, StoreError> {
    let all: Vec<Sha256> = engine.blobs.list().map_ok(|(digest, _)| digest).try_collect().await?;
    let mut connection = engine.database.reader().acquire().await?;
    let named = named(&mut connection).await?;
    drop(connection);
    let unnamed = all.into_iter().filter(|digest| !named.contains(digest)).collect();
    collect(&engine.database, &engine.blobs, unnamed).await
}

/// Deletes jobs and scans whose time is over.
///
/// # Errors
/// [`StoreError`].
pub(super) async fn expire(engine: &Engine) -> Result<(), StoreError> {
    let due = "SELECT (SELECT count(*) FROM job WHERE expires_at < ?1) + (SELECT count(*) FROM scan WHERE expires_at < ?1)";
    let due: i64 = sqlx::query_scalar(due).bind(now()).fetch_one(engine.database.reader()).await?;
    if due == 0 {
        return Ok(());
    }
    let mut tx = engine.database.begin_write().await?;
    sqlx::query("DELETE FROM job WHERE expires_at < ?").bind(now()).execute(&mut *tx).await?;
    sqlx::query("DELETE FROM scan WHERE expires_at < ?").bind(now()).execute(&mut *tx).await?;
    tx.commit().await?;
    engine.snapshots.forget();
    collect_all(engine).await?;
    Ok(())
}

/// Deletes a job, whatever of it is open.
///
/// # Errors
/// [`StoreError`].
pub(super) async fn delete(engine: &Engine, job: i64) -> Result<(), StoreError> {
    let mut changed = Changed::default();
    let mut tx = engine.database.begin_write().await?;
    let open = "SELECT 1 FROM job WHERE sequence = ? AND status IN ('queued', 'running')";
    if sqlx::query_scalar::<_, i64>(open).bind(job).fetch_optional(&mut *tx).await?.is_some() {
        graph::end(&mut tx, job, Status::Canceled, None, &mut changed).await?;
    }
    let blobs = "SELECT digest FROM result WHERE job = ?1
        UNION SELECT j.value FROM child c, json_each(c.parts) j WHERE c.job = ?1 AND length(j.value) = 64
        UNION SELECT p.value FROM job j, json_tree(j.parts) p
            WHERE j.sequence = ?1 AND p.type = 'text' AND length(p.value) = 64";
    let blobs: Vec<String> = sqlx::query_scalar(blobs).bind(job).fetch_all(&mut *tx).await?;
    changed.dropped.extend(blobs.iter().filter_map(|digest| digest.parse::<Sha256>().ok()));
    sqlx::query("DELETE FROM job WHERE sequence = ?").bind(job).execute(&mut *tx).await?;
    engine.commit(tx, changed).await
}
