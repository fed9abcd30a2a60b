//! What is no longer needed goes: blobs that no record names, registrations and scans whose time is over.

use std::collections::HashSet;

use futures_util::TryStreamExt;
use sqlx::sqlite::SqliteConnection;

use super::clock::now;
use super::engine::Engine;
use super::graph::{self, Changed};
use super::registration::Status;
use super::store_error::StoreError;
use crate::formats::Sha256;

/// Blobs that are deleted while others wait to write.
const AT_ONCE: usize = 64;

/// Deletes those of these blobs that no record names.
///
/// # Errors
/// [`StoreError`].
pub(super) async fn collect(engine: &Engine, candidates: Vec<Sha256>) -> Result<usize, StoreError> {
    let mut deleted = 0;
    for some in candidates.chunks(AT_ONCE) {
        // In a transaction that may write: records of a blob are made by such ones, while the blob is pinned.
        let mut tx = engine.database.begin_write().await?;
        let named = named(&mut tx).await?;
        for digest in some.iter().filter(|digest| !named.contains(*digest)) {
            deleted += usize::from(engine.blobs.remove_unpinned(*digest).await?);
        }
        tx.rollback().await?;
    }
    Ok(deleted)
}

async fn named(tx: &mut SqliteConnection) -> Result<HashSet<Sha256>, StoreError> {
    let query = "SELECT digest FROM uploaded_blob UNION SELECT digest FROM registered_blob";
    let digests: Vec<String> = sqlx::query_scalar(query).fetch_all(tx).await?;
    Ok(digests.iter().filter_map(|digest| digest.parse().ok()).collect())
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
    collect(engine, all.into_iter().filter(|digest| !named.contains(digest)).collect()).await
}

/// Deletes registrations and scans whose time is over.
///
/// # Errors
/// [`StoreError`].
pub(super) async fn expire(engine: &Engine) -> Result<(), StoreError> {
    let due = "SELECT (SELECT count(*) FROM registration WHERE expires_at < ?1) + (SELECT count(*) FROM scan WHERE expires_at < ?1)";
    let due: i64 = sqlx::query_scalar(due).bind(now()).fetch_one(engine.database.reader()).await?;
    if due == 0 {
        return Ok(());
    }
    let mut tx = engine.database.begin_write().await?;
    sqlx::query("DELETE FROM registration WHERE expires_at < ?").bind(now()).execute(&mut *tx).await?;
    sqlx::query("DELETE FROM scan WHERE expires_at < ?").bind(now()).execute(&mut *tx).await?;
    tx.commit().await?;
    collect_all(engine).await?;
    Ok(())
}

/// Deletes a registration, whatever of it is open.
///
/// # Errors
/// [`StoreError`].
pub(super) async fn delete(engine: &Engine, registration: i64) -> Result<(), StoreError> {
    let mut changed = Changed::default();
    let mut tx = engine.database.begin_write().await?;
    let open = "SELECT 1 FROM registration WHERE sequence = ? AND status IN ('queued', 'running')";
    if sqlx::query_scalar::<_, i64>(open).bind(registration).fetch_optional(&mut *tx).await?.is_some() {
        graph::end(&mut tx, registration, Status::Canceled, None, &mut changed).await?;
    }
    let blobs = "SELECT digest FROM result WHERE registration = ?1
        UNION SELECT j.value FROM child c, json_each(c.parts) j WHERE c.registration = ?1 AND length(j.value) = 64
        UNION SELECT j.value FROM registration r, json_each(r.template_parts) j
            WHERE r.sequence = ?1 AND length(j.value) = 64";
    let blobs: Vec<String> = sqlx::query_scalar(blobs).bind(registration).fetch_all(&mut *tx).await?;
    changed.dropped.extend(blobs.iter().filter_map(|digest| digest.parse::<Sha256>().ok()));
    sqlx::query("DELETE FROM registration WHERE sequence = ?").bind(registration).execute(&mut *tx).await?;
    engine.commit(tx, changed).await
}
