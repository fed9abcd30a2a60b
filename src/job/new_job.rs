use std::time::Duration;

use sqlx::sqlite::SqliteConnection;
use sqlx::{Sqlite, Transaction};

use super::clock::now;
use super::error::JobError;
use super::event::EventKind;
use super::graph::Changed;
use super::job_id::{JobId, OfKind};
use super::jobs::Jobs;
use super::record::{RECORD, add_event, json, priority_number};
use super::registration::TemplateChoice;
use super::stage::JobStage;
use super::state::{Job, Priority, Status};
use super::store_error::StoreError;

/// A job that is asked for, of any kind, its files looked at and its settings complete.
pub(super) struct NewJob<'a, K> {
    pub id: &'a JobId<K>,
    pub name: Option<&'a str>,
    pub owner: Option<&'a str>,
    pub dedupe_key: Option<&'a str>,
    pub priority: Priority,
    /// What a registration's scans are registered from.
    pub template: &'a TemplateChoice,
    /// JSON of the files that are needed beside those of scans.
    pub parts: Option<String>,
    /// JSON of every parameter.
    pub settings: String,
    pub webhook: Option<&'a str>,
    pub stages: &'a [JobStage],
}

impl<K: OfKind> NewJob<'_, K> {
    /// Keeps it; gives its place among all jobs, or `None` if one was asked for with its key.
    ///
    /// # Errors
    /// [`StoreError`].
    async fn insert(
        &self,
        tx: &mut SqliteConnection,
        keep: Option<Duration>,
        changed: &mut Changed,
    ) -> Result<Option<i64>, StoreError> {
        // Its turn comes with those who have had the least work of its priority.
        let turn =
            "SELECT coalesce(min(turn), 0.0) FROM job WHERE status IN ('queued', 'running') AND priority = ?";
        let priority = priority_number(self.priority);
        let turn: f64 = sqlx::query_scalar(turn).bind(priority).fetch_one(&mut *tx).await?;
        let insert = "INSERT INTO job (id, kind, record, name, owner, dedupe_key, status, priority, template,
                parts, settings, webhook, stages, turn, keep, created_at)
            VALUES (?, ?, ?, ?, ?, ?, 'queued', ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (dedupe_key) DO NOTHING
            RETURNING sequence";
        let sequence = sqlx::query_scalar::<_, i64>(insert)
            .bind(self.id.as_str())
            .bind(K::KIND.name())
            .bind(RECORD)
            .bind(self.name)
            .bind(self.owner)
            .bind(self.dedupe_key)
            .bind(priority)
            .bind(json(self.template))
            .bind(&self.parts)
            .bind(&self.settings)
            .bind(self.webhook)
            .bind(json(&self.stages))
            .bind(turn)
            .bind(keep.map(|keep| i64::try_from(keep.as_millis()).unwrap_or(i64::MAX / 4)))
            .bind(now())
            .fetch_optional(&mut *tx)
            .await?;
        if let Some(sequence) = sequence {
            let event = EventKind::Status { status: Status::Queued };
            changed.events.push(add_event(tx, sequence, event).await?);
        }
        Ok(sequence)
    }
}

/// What came of asking for a job.
pub(super) enum Begun<K> {
    /// It was asked for before, with the same key.
    Known(Job<K>),
    /// It is kept when the transaction is committed, with its steps; its place among all jobs, and what changes.
    New(Transaction<'static, Sqlite>, i64, Changed),
}

impl Jobs {
    /// Begins to keep a job.
    ///
    /// # Errors
    /// [`JobError::TooMany`] if its owner has too many open; [`JobError::Store`].
    pub(super) async fn begin<K: OfKind>(&self, job: &NewJob<'_, K>) -> Result<Begun<K>, JobError> {
        let settings = &self.engine.settings;
        let mut changed = Changed::default();
        let mut tx = self.engine.database.begin_write().await?;
        check_room(&mut tx, job.owner, settings.jobs_per_owner).await?;
        if let Some(sequence) = job.insert(&mut tx, settings.keep, &mut changed).await? {
            return Ok(Begun::New(tx, sequence, changed));
        }
        tx.rollback().await?;
        let known = self.known(job.dedupe_key).await?;
        known.map(Begun::Known).ok_or_else(|| JobError::NotFound(K::KIND.to_string()))
    }
}

/// Whether an owner may have one more open.
async fn check_room(tx: &mut SqliteConnection, owner: Option<&str>, most: usize) -> Result<(), JobError> {
    let open = "SELECT count(*) FROM job WHERE status IN ('queued', 'running') AND owner IS ?";
    let open: i64 = sqlx::query_scalar(open).bind(owner).fetch_one(tx).await?;
    if open as usize >= most {
        let problem = format!("{open} jobs are open, {most} may be: wait for one to end");
        return Err(JobError::TooMany(problem));
    }
    Ok(())
}
