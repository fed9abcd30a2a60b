//! The graph of steps in the database: which step is next, and what follows when one ends. Every change is one
//! transaction, so that what is done and what follows from it are never apart.

use std::time::Duration;

use sqlx::sqlite::SqliteConnection;
use sqlx::{FromRow, Row};

use super::clock::now;
use super::event::{Event, EventKind};
use super::record::{ALL, add_event, broken, from_json, json};
use super::result_file::ResultFile;
use super::scan::ScanId;
use super::stage::JobStage;
use super::state::{Problem, Status};
use super::store_error::StoreError;
use super::work::Decided;
use crate::formats::Sha256;
use crate::pipeline::Verdict;

/// Seconds that a step which runs is taken to need.
const ASSUMED: f64 = 1.0;

/// A step that ended the program so often runs alone, so that it harms no other and no other is taken for it.
const SUSPECT: i64 = 2;

/// A step that somebody has taken on.
#[derive(Debug, Clone)]
pub(super) struct Claim {
    pub step: i64,
    /// Counts its runs: a run that was taken from it cannot end it.
    pub run: i64,
    /// The job's id, for those who read logs.
    pub id: String,
    pub job: i64,
    /// Its number among the stages.
    pub number: i64,
    pub place: i64,
    pub stages: Vec<JobStage>,
    /// It must run alone.
    pub alone: bool,
}

impl Claim {
    pub fn stage(&self) -> JobStage {
        self.stages[self.number as usize]
    }
}

/// What a step left, in the store.
pub(super) struct Done {
    pub output: Option<Sha256>,
    pub files: Vec<(ResultFile, Sha256, u64)>,
    pub decided: Decided,
    pub seconds: f64,
}

/// What a change did, for those who watch.
#[derive(Default)]
pub(super) struct Changed {
    /// New events, each with its job.
    pub events: Vec<(i64, Event)>,
    /// Steps that became ready.
    pub ready: usize,
    /// Blobs that are no longer needed here.
    pub dropped: Vec<Sha256>,
    /// Jobs that came to an end.
    pub ended: Vec<i64>,
}

#[derive(FromRow)]
struct Candidate {
    id: i64,
    stage: i64,
    place: i64,
    crashes: i64,
}

/// Takes on the next step: that of the job which has had the least work of its priority, late stages first.
pub(super) async fn claim(
    tx: &mut SqliteConnection,
    changed: &mut Changed,
    others_run: bool,
) -> Result<Option<Claim>, StoreError> {
    let whose = "SELECT r.sequence, r.id, r.status, r.stage, r.stages FROM job r
        WHERE r.status IN ('queued', 'running')
            AND EXISTS (SELECT 1 FROM step s WHERE s.job = r.sequence AND s.state = 'ready' AND s.crashes < ?)
        ORDER BY r.priority DESC,
            r.turn + ? * (SELECT count(*) FROM step s WHERE s.job = r.sequence AND s.state = 'running'), r.sequence
        LIMIT 1";
    // Suspects have their turn when nothing else runs.
    let below = if others_run { SUSPECT } else { i64::MAX };
    let whose = sqlx::query(whose).bind(below).bind(ASSUMED);
    let Some(row) = whose.fetch_optional(&mut *tx).await? else { return Ok(None) };
    let job: i64 = row.try_get("sequence")?;
    let next = "SELECT id, stage, place, crashes FROM step
        WHERE job = ? AND state = 'ready' AND crashes < ? ORDER BY crashes, stage DESC, place LIMIT 1";
    let next = sqlx::query_as::<_, Candidate>(next).bind(job).bind(below);
    let Candidate { id, stage, place, crashes } = next.fetch_one(&mut *tx).await?;
    let run = "UPDATE step SET state = 'running', runs = runs + 1 WHERE id = ? RETURNING runs";
    let run: i64 = sqlx::query_scalar(run).bind(id).fetch_one(&mut *tx).await?;
    let stages: Vec<JobStage> = from_json(row.try_get("stages")?)?;
    let name =
        stages.get(usize::try_from(stage).map_err(broken)?).ok_or_else(|| broken("a step has no stage"))?;
    if row.try_get::<&str, _>("status")? == "queued" {
        let event = EventKind::Status { status: Status::Running };
        changed.events.push(add_event(tx, job, event).await?);
    }
    if row.try_get::<Option<i64>, _>("stage")?.is_none_or(|last| last < stage) {
        let event = EventKind::Stage { stage: name.name().to_owned() };
        changed.events.push(add_event(tx, job, event).await?);
    }
    let begin = "UPDATE job SET status = 'running', started_at = coalesce(started_at, ?1),
        stage = max(coalesce(stage, 0), ?2) WHERE sequence = ?3";
    sqlx::query(begin).bind(now()).bind(stage).bind(job).execute(&mut *tx).await?;
    let child = "UPDATE child SET status = 'running', started_at = coalesce(started_at, ?1), stage = ?2
        WHERE job = ?3 AND place = ?4";
    sqlx::query(child).bind(now()).bind(stage).bind(job).bind(place).execute(&mut *tx).await?;
    let alone = crashes >= SUSPECT;
    let (step, id) = (id, row.try_get("id")?);
    Ok(Some(Claim { step, run, id, job, number: stage, place, stages, alone }))
}

/// Ends a step that did its work, and begins what follows. Says whether it was still its own.
pub(super) async fn finish(
    tx: &mut SqliteConnection,
    claim: &Claim,
    done: Done,
    changed: &mut Changed,
) -> Result<bool, StoreError> {
    let Done { output, files, decided, seconds } = done;
    if !end_step(tx, claim, "done", output, seconds).await? {
        return Ok(false);
    }
    for (file, digest, size) in files {
        let insert = "INSERT INTO result (job, file, digest, size) VALUES (?, ?, ?, ?)
            ON CONFLICT DO UPDATE SET digest = excluded.digest, size = excluded.size";
        let insert = sqlx::query(insert).bind(claim.job).bind(file.path());
        insert.bind(digest.to_string()).bind(size.cast_signed()).execute(&mut *tx).await?;
    }
    let mut stages = claim.stages.clone();
    match decided {
        Decided::Nothing => {}
        Decided::Course(course, left_out) => {
            let set = sqlx::query("UPDATE job SET stages = ? WHERE sequence = ?");
            set.bind(json(&course)).bind(claim.job).execute(&mut *tx).await?;
            stages = course;
            for (place, detail) in left_out {
                let problem = Problem { code: "too_few_landmarks".to_owned(), detail };
                fail_child(tx, claim.job, place, &problem, changed).await?;
            }
        }
        Decided::Judgement(judgement) => end_child(tx, claim, judgement.verdict, changed).await?,
    }
    follow(tx, claim, &stages, changed).await?;
    Ok(true)
}

/// Ends a step that cannot do its work: its scan fails, or all do.
pub(super) async fn fail(
    tx: &mut SqliteConnection,
    claim: &Claim,
    problem: &Problem,
    seconds: f64,
    changed: &mut Changed,
) -> Result<bool, StoreError> {
    if !end_step(tx, claim, "failed", None, seconds).await? {
        return Ok(false);
    }
    if claim.place == ALL {
        end(tx, claim.job, Status::Failed, Some(problem), changed).await?;
    } else {
        fail_child(tx, claim.job, claim.place, problem, changed).await?;
        follow(tx, claim, &claim.stages, changed).await?;
    }
    Ok(true)
}

/// Gives a step back, to be run again.
pub(super) async fn give_back(tx: &mut SqliteConnection, claim: &Claim) -> Result<(), StoreError> {
    let query = "UPDATE step SET state = 'ready' WHERE id = ? AND runs = ? AND state = 'running'";
    sqlx::query(query).bind(claim.step).bind(claim.run).execute(tx).await?;
    Ok(())
}

/// Has the step run again whose output this is, and the claimed one after it; says whether there is one.
pub(super) async fn redo(
    tx: &mut SqliteConnection,
    claim: &Claim,
    output: Sha256,
    changed: &mut Changed,
) -> Result<bool, StoreError> {
    let output = output.to_string();
    // It keeps its output, so that others who find that damaged wait for it too.
    let again = "UPDATE step SET state = 'ready' WHERE job = ? AND output = ? AND state = 'done'";
    let again = sqlx::query(again).bind(claim.job).bind(&output).execute(&mut *tx).await?;
    changed.ready += again.rows_affected() as usize;
    let open =
        "SELECT count(*) FROM step WHERE job = ? AND output = ? AND state IN ('waiting', 'ready', 'running')";
    let open = sqlx::query_scalar::<_, i64>(open).bind(claim.job).bind(&output);
    if open.fetch_one(&mut *tx).await? == 0 {
        return Ok(false);
    }
    let wait = "UPDATE step SET state = 'waiting' WHERE id = ? AND runs = ? AND state = 'running'";
    sqlx::query(wait).bind(claim.step).bind(claim.run).execute(tx).await?;
    Ok(true)
}

/// Ends a job, whatever of it is open.
pub(super) async fn end(
    tx: &mut SqliteConnection,
    job: i64,
    status: Status,
    problem: Option<&Problem>,
    changed: &mut Changed,
) -> Result<(), StoreError> {
    let open = "UPDATE child SET status = ?, problem = coalesce(problem, ?), finished_at = ?
        WHERE job = ? AND status IN ('queued', 'running') RETURNING scan";
    let of_child = if status == Status::Canceled { Status::Canceled } else { Status::Failed };
    let kept = problem.map(json);
    let open = sqlx::query_scalar::<_, String>(open).bind(of_child.name()).bind(&kept);
    for scan in open.bind(now()).bind(job).fetch_all(&mut *tx).await? {
        let scan: ScanId = scan.parse().map_err(broken)?;
        let problem = problem.cloned();
        let event = EventKind::Child { scan, status: of_child, verdict: None, problem };
        changed.events.push(add_event(tx, job, event).await?);
    }
    let outputs =
        sqlx::query_scalar::<_, String>("SELECT output FROM step WHERE job = ? AND output IS NOT NULL");
    let outputs = outputs.bind(job).fetch_all(&mut *tx).await?;
    changed.dropped.extend(outputs.iter().filter_map(|digest| digest.parse::<Sha256>().ok()));
    changed.ended.push(job);
    let drop = "UPDATE step SET state = CASE state WHEN 'done' THEN 'done' WHEN 'failed' THEN 'failed' ELSE 'dropped' END,
        output = NULL WHERE job = ?";
    sqlx::query(drop).bind(job).execute(&mut *tx).await?;
    let query = "UPDATE job SET status = ?1, problem = ?2, finished_at = ?3, expires_at = ?3 + keep WHERE sequence = ?4";
    let query = sqlx::query(query).bind(status.name()).bind(kept).bind(now());
    query.bind(job).execute(&mut *tx).await?;
    changed.events.push(add_event(tx, job, EventKind::Status { status }).await?);
    Ok(())
}

async fn end_step(
    tx: &mut SqliteConnection,
    claim: &Claim,
    state: &str,
    output: Option<Sha256>,
    seconds: f64,
) -> Result<bool, StoreError> {
    let query = "UPDATE step SET state = ?, output = ?, seconds = coalesce(seconds, 0) + ?
        WHERE id = ? AND runs = ? AND state = 'running'";
    let query = sqlx::query(query).bind(state).bind(output.map(|digest| digest.to_string())).bind(seconds);
    let ended = query.bind(claim.step).bind(claim.run).execute(&mut *tx).await?.rows_affected() == 1;
    let charge = "UPDATE job SET seconds = seconds + ?1, turn = turn + ?1 WHERE sequence = ?2";
    sqlx::query(charge).bind(seconds).bind(claim.job).execute(tx).await?;
    Ok(ended)
}

async fn end_child(
    tx: &mut SqliteConnection,
    claim: &Claim,
    verdict: Verdict,
    changed: &mut Changed,
) -> Result<(), StoreError> {
    let query = "UPDATE child SET status = 'succeeded', verdict = ?, finished_at = ?
        WHERE job = ? AND place = ? RETURNING scan";
    let query = sqlx::query_scalar::<_, String>(query).bind(json(&verdict)).bind(now());
    let scan = query.bind(claim.job).bind(claim.place).fetch_one(&mut *tx).await?;
    let scan = scan.parse().map_err(broken)?;
    let event = EventKind::Child { scan, status: Status::Succeeded, verdict: Some(verdict), problem: None };
    changed.events.push(add_event(tx, claim.job, event).await?);
    Ok(())
}

/// Fails one scan; the others go on without it.
pub(super) async fn fail_child(
    tx: &mut SqliteConnection,
    job: i64,
    place: i64,
    problem: &Problem,
    changed: &mut Changed,
) -> Result<(), StoreError> {
    let query = "UPDATE child SET status = 'failed', problem = ?, finished_at = ?
        WHERE job = ? AND place = ? AND status IN ('queued', 'running') RETURNING scan";
    let query = sqlx::query_scalar::<_, String>(query).bind(json(problem)).bind(now());
    if let Some(scan) = query.bind(job).bind(place).fetch_optional(&mut *tx).await? {
        let (scan, problem) = (scan.parse().map_err(broken)?, Some(problem.clone()));
        let event = EventKind::Child { scan, status: Status::Failed, verdict: None, problem };
        changed.events.push(add_event(tx, job, event).await?);
    }
    Ok(())
}

/// Begins what follows a step that ended, done or failed.
pub(super) async fn follow(
    tx: &mut SqliteConnection,
    claim: &Claim,
    stages: &[JobStage],
    changed: &mut Changed,
) -> Result<(), StoreError> {
    let job = claim.job;
    let next = claim.number + 1;
    let is_shared = |number: i64| stages.get(number as usize).is_none_or(|stage| stage.is_shared());
    if claim.place == ALL && next as usize == stages.len() {
        return complete(tx, job, changed).await;
    }
    if !is_shared(next) {
        // The scan's own next stage waits for no other scan.
        let begin = "INSERT INTO step (job, stage, place, state)
            SELECT job, ?1, place, 'ready' FROM child
            WHERE job = ?2 AND status IN ('queued', 'running') AND (place = ?3 OR ?3 = -1)
            ON CONFLICT DO NOTHING";
        let begin = sqlx::query(begin).bind(next).bind(job).bind(claim.place);
        changed.ready += begin.execute(&mut *tx).await?.rows_affected() as usize;
    }
    let waiting = "UPDATE step SET state = 'ready' WHERE job = ?1 AND state = 'waiting' AND NOT EXISTS
        (SELECT 1 FROM step o WHERE o.job = ?1 AND o.state IN ('waiting', 'ready', 'running') AND o.stage < step.stage)";
    changed.ready += sqlx::query(waiting).bind(job).execute(&mut *tx).await?.rows_affected() as usize;
    let open = "SELECT count(*) FROM step WHERE job = ? AND state IN ('waiting', 'ready', 'running')";
    if sqlx::query_scalar::<_, i64>(open).bind(job).fetch_one(&mut *tx).await? > 0 {
        return Ok(());
    }
    let alive = "SELECT count(*) FROM child WHERE job = ? AND status != 'failed'";
    if sqlx::query_scalar::<_, i64>(alive).bind(job).fetch_one(&mut *tx).await? == 0 {
        let detail = "no scan is left to register: see what each of them failed by".to_owned();
        let problem = Problem { code: "no_scan_left".to_owned(), detail };
        return end(tx, job, Status::Failed, Some(&problem), changed).await;
    }
    let barrier = (next..).find(|&number| is_shared(number)).unwrap_or(next);
    let begin =
        "INSERT INTO step (job, stage, place, state) VALUES (?, ?, -1, 'ready') ON CONFLICT DO NOTHING";
    let begin = sqlx::query(begin).bind(job).bind(barrier).execute(&mut *tx).await?;
    changed.ready += begin.rows_affected() as usize;
    Ok(())
}

/// Ends a job of which everything is done.
async fn complete(tx: &mut SqliteConnection, job: i64, changed: &mut Changed) -> Result<(), StoreError> {
    let failed = "SELECT count(*) FROM child WHERE job = ? AND status = 'failed'";
    let failed: i64 = sqlx::query_scalar(failed).bind(job).fetch_one(&mut *tx).await?;
    let status = if failed > 0 { Status::PartiallySucceeded } else { Status::Succeeded };
    end(tx, job, status, None, changed).await
}

/// Fails a job that has taken more work than one may.
pub(super) async fn end_if_too_long(
    tx: &mut SqliteConnection,
    job: i64,
    most: Duration,
    changed: &mut Changed,
) -> Result<(), StoreError> {
    let query = "SELECT 1 FROM job WHERE sequence = ? AND status = 'running' AND seconds > ?";
    let query = sqlx::query_scalar::<_, i64>(query).bind(job).bind(most.as_secs_f64());
    if query.fetch_optional(&mut *tx).await?.is_none() {
        return Ok(());
    }
    let detail = format!("it took more than {} s of work: register fewer scans at once", most.as_secs());
    let problem = Problem { code: "too_slow".to_owned(), detail };
    end(tx, job, Status::Failed, Some(&problem), changed).await
}

/// Fails steps during which the program ended too often, each with its scan.
pub(super) async fn fail_crashed(
    tx: &mut SqliteConnection,
    most: u32,
    changed: &mut Changed,
) -> Result<(), StoreError> {
    let crashed = "SELECT s.id AS step, s.runs, s.job, s.stage, s.place, r.id, r.stages FROM step s
        JOIN job r ON r.sequence = s.job WHERE s.state = 'ready' AND s.crashes >= ?";
    for row in sqlx::query(crashed).bind(most).fetch_all(&mut *tx).await? {
        let claim = Claim {
            step: row.try_get("step")?,
            id: row.try_get("id")?,
            run: row.try_get("runs")?,
            job: row.try_get("job")?,
            number: row.try_get("stage")?,
            place: row.try_get("place")?,
            stages: from_json(row.try_get("stages")?)?,
            alone: true,
        };
        let running = sqlx::query("UPDATE step SET state = 'running' WHERE id = ?").bind(claim.step);
        running.execute(&mut *tx).await?;
        let detail = format!(
            "the program ended {most} times while it worked on this, perhaps for want of memory: give a smaller scan"
        );
        let problem = Problem { code: "crashed".to_owned(), detail };
        fail(tx, &claim, &problem, 0.0, changed).await?;
    }
    Ok(())
}
