//! Jobs as the database has them.

use std::collections::HashMap;
use std::fmt;

use sqlx::sqlite::{SqliteConnection, SqliteRow};
use sqlx::{Executor, Row, Sqlite};

use super::clock::now;
use super::event::{Event, EventKind};
use super::job_id::{JobId, JobKind, OfKind};
use super::stage::JobStage;
use super::state::{Child, Job, Priority, Status};
use super::store_error::StoreError;
use crate::pipeline::Verdict;

/// Version of the stored record.
pub(super) const RECORD: i64 = 1;

/// The place of a step of all scans.
pub(super) const ALL: i64 = -1;

/// How far steps that run have come, by their ids.
pub(super) type Fractions = HashMap<i64, f64>;

pub(super) fn broken(problem: impl fmt::Display) -> StoreError {
    StoreError::Record { what: "a job", problem: problem.to_string() }
}

/// A value that is kept as JSON.
pub(super) fn json(value: &impl serde::Serialize) -> String {
    serde_json::to_string(value).unwrap_or_default()
}

pub(super) fn from_json<T: serde::de::DeserializeOwned>(text: &str) -> Result<T, StoreError> {
    serde_json::from_str(text).map_err(broken)
}

fn optional<T: serde::de::DeserializeOwned>(row: &SqliteRow, column: &str) -> Result<Option<T>, StoreError> {
    row.try_get::<Option<&str>, _>(column)?.map(from_json).transpose()
}

/// A kind as it is kept.
pub(super) fn kind_of(name: &str) -> Result<JobKind, StoreError> {
    let known = JobKind::ALL.into_iter().find(|kind| kind.name() == name);
    known.ok_or_else(|| broken(format!("no kind {name:?}")))
}

/// A status as it is kept.
pub(super) fn status_of(name: &str) -> Result<Status, StoreError> {
    let all = [
        Status::Queued,
        Status::Running,
        Status::Succeeded,
        Status::PartiallySucceeded,
        Status::Failed,
        Status::Canceled,
    ];
    all.into_iter().find(|status| status.name() == name).ok_or_else(|| broken(format!("no status {name:?}")))
}

fn priority_of(number: i64) -> Priority {
    match number {
        ..0 => Priority::Low,
        0 => Priority::Normal,
        1.. => Priority::High,
    }
}

/// A priority as it is kept.
pub(super) fn priority_number(priority: Priority) -> i64 {
    match priority {
        Priority::Low => -1,
        Priority::Normal => 0,
        Priority::High => 1,
    }
}

/// A job without its children and what they say of it.
pub(super) fn job<K>(row: &SqliteRow) -> Result<(i64, Job<K>, Vec<JobStage>), StoreError> {
    let record: i64 = row.try_get("record")?;
    if record != RECORD {
        return Err(broken(format!("it is of version {record}")));
    }
    let stages: Vec<JobStage> = from_json(row.try_get("stages")?)?;
    let status = status_of(row.try_get("status")?)?;
    let stage = row.try_get::<Option<i64>, _>("stage")?.and_then(|stage| stages.get(stage as usize));
    let job = Job {
        id: row.try_get::<&str, _>("id")?.parse().map_err(broken)?,
        name: row.try_get("name")?,
        status,
        queue_position: None,
        stage: stage.filter(|_| status == Status::Running).map(|stage| stage.name().to_owned()),
        progress: if status.is_final() { 1.0 } else { 0.0 },
        priority: priority_of(row.try_get("priority")?),
        template: from_json(row.try_get("template")?)?,
        settings: from_json(row.try_get("settings")?)?,
        webhook: row.try_get("webhook")?,
        owner: row.try_get("owner")?,
        problem: optional(row, "problem")?,
        children: Vec::new(),
        created_at: row.try_get("created_at")?,
        started_at: row.try_get("started_at")?,
        finished_at: row.try_get("finished_at")?,
        expires_at: row.try_get("expires_at")?,
        last_event: row.try_get::<i64, _>("last_event")?.cast_unsigned(),
    };
    Ok((row.try_get("sequence")?, job, stages))
}

fn child(row: &SqliteRow, stages: &[JobStage]) -> Result<Child, StoreError> {
    let stage = row.try_get::<Option<i64>, _>("stage")?.and_then(|stage| stages.get(stage as usize));
    let status = status_of(row.try_get("status")?)?;
    Ok(Child {
        scan: row.try_get::<&str, _>("scan")?.parse().map_err(broken)?,
        name: row.try_get("name")?,
        status,
        stage: stage.map(|stage| stage.name().to_owned()),
        progress: if status.is_final() { 1.0 } else { 0.0 },
        verdict: optional::<Verdict>(row, "verdict")?,
        problem: optional(row, "problem")?,
        started_at: row.try_get("started_at")?,
        finished_at: row.try_get("finished_at")?,
    })
}

/// A job with its children, progress and place in the queue.
pub(super) async fn whole<K: OfKind>(
    connection: &mut SqliteConnection,
    id: &JobId<K>,
    fractions: &Fractions,
) -> Result<Option<Job<K>>, StoreError> {
    let query = sqlx::query("SELECT * FROM job WHERE id = ? AND kind = ?");
    let query = query.bind(id.as_str()).bind(K::KIND.name());
    match query.fetch_optional(&mut *connection).await? {
        Some(row) => Ok(Some(whole_of(connection, &row, fractions).await?)),
        None => Ok(None),
    }
}

/// The share of a job's work that is done.
pub(super) async fn progress_of(
    connection: &mut SqliteConnection,
    sequence: i64,
    fractions: &Fractions,
) -> Result<f64, StoreError> {
    let query = sqlx::query("SELECT * FROM job WHERE sequence = ?").bind(sequence);
    let row = query.fetch_one(&mut *connection).await?;
    Ok(whole_of::<()>(connection, &row, fractions).await?.progress)
}

async fn whole_of<K>(
    connection: &mut SqliteConnection,
    row: &SqliteRow,
    fractions: &Fractions,
) -> Result<Job<K>, StoreError> {
    let (sequence, mut job, stages) = job(row)?;
    let children = sqlx::query("SELECT * FROM child WHERE job = ? ORDER BY place").bind(sequence);
    let children = children.fetch_all(&mut *connection).await?;
    job.children = children.iter().map(|row| child(row, &stages)).collect::<Result<_, _>>()?;
    if job.status == Status::Queued {
        job.queue_position = Some(position(connection, sequence, job.priority).await?);
    }
    if job.status == Status::Running {
        let steps = sqlx::query("SELECT id, place, state FROM step WHERE job = ?").bind(sequence);
        progress(&mut job, &stages, &steps.fetch_all(&mut *connection).await?, fractions)?;
    }
    Ok(job)
}

/// How many are before it.
async fn position(
    connection: &mut SqliteConnection,
    sequence: i64,
    priority: Priority,
) -> Result<u64, StoreError> {
    let before = "SELECT count(*) FROM job
        WHERE status = 'queued' AND (priority > ?1 OR priority = ?1 AND sequence < ?2)";
    let before = sqlx::query_scalar::<_, i64>(before).bind(priority_number(priority)).bind(sequence);
    Ok(before.fetch_one(connection).await?.cast_unsigned())
}

/// The share of the work that is done, each stage of a scan, or of a job without scans, counted alike.
fn progress<K>(
    job: &mut Job<K>,
    stages: &[JobStage],
    steps: &[SqliteRow],
    fractions: &Fractions,
) -> Result<(), StoreError> {
    // Before the plan is known it is taken for that of a collection from the head.
    const USUAL: usize = 5;
    let share = |step: &SqliteRow| {
        Ok::<_, StoreError>(match step.try_get::<&str, _>("state")? {
            "done" => 1.0,
            "running" => fractions.get(&step.try_get("id")?).copied().unwrap_or(0.0),
            _ => 0.0,
        })
    };
    if job.children.is_empty() {
        let done: f64 = steps.iter().map(share).sum::<Result<_, _>>()?;
        job.progress = (done / stages.len().max(1) as f64).min(1.0);
        return Ok(());
    }
    let own = stages.iter().filter(|stage| !stage.is_shared()).count();
    let own = if stages.len() == JobStage::FIRST.len() { USUAL } else { own } as f64;
    for step in steps {
        let (share, place): (f64, i64) = (share(step)?, step.try_get("place")?);
        let child = usize::try_from(place).ok().and_then(|place| job.children.get_mut(place));
        if let Some(child) = child.filter(|child| !child.status.is_final()) {
            child.progress = (child.progress + share / own).min(1.0);
        }
    }
    let sum: f64 = job.children.iter().map(|child| child.progress).sum();
    job.progress = sum / job.children.len().max(1) as f64;
    Ok(())
}

/// Keeps an event as the next of a job.
pub(super) async fn add_event(
    connection: &mut SqliteConnection,
    job: i64,
    kind: EventKind,
) -> Result<(i64, Event), StoreError> {
    let count = "UPDATE job SET last_event = last_event + 1 WHERE sequence = ? RETURNING last_event";
    let sequence: i64 = sqlx::query_scalar(count).bind(job).fetch_one(&mut *connection).await?;
    let at = now();
    let insert = sqlx::query("INSERT INTO event (job, sequence, at, kind) VALUES (?, ?, ?, ?)");
    insert.bind(job).bind(sequence).bind(at).bind(json(&kind)).execute(connection).await?;
    Ok((job, Event { sequence: sequence.cast_unsigned(), at, kind }))
}

/// The events after a number, at most so many.
pub(super) async fn events(
    reader: impl Executor<'_, Database = Sqlite>,
    job: i64,
    after: u64,
    most: i64,
) -> Result<Vec<Event>, StoreError> {
    let query = "SELECT sequence, at, kind FROM event
        WHERE job = ? AND sequence > ? ORDER BY sequence LIMIT ?";
    let after = i64::try_from(after).unwrap_or(i64::MAX);
    let rows = sqlx::query(query).bind(job).bind(after).bind(most).fetch_all(reader).await?;
    let event = |row: &SqliteRow| {
        let sequence: i64 = row.try_get("sequence")?;
        let kind = from_json(row.try_get("kind")?)?;
        Ok(Event { sequence: sequence.cast_unsigned(), at: row.try_get("at")?, kind })
    };
    rows.iter().map(event).collect()
}
