//! The handle through which registrations are asked for and watched.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use sqlx::Row;
use tokio::sync::watch;
use tokio::task::JoinSet;

use super::blobs::{BlobInfo, Blobs};
use super::clock::now;
use super::data_folder::DataFolder;
use super::database::Database;
use super::engine::{Engine, lock};
use super::error::JobError;
use super::event::EventKind;
use super::feed::EventFeed;
use super::graph::{self, Changed};
use super::record::{self, add_event, broken, json, priority_number, status_of};
use super::registration::{
    NewMember, NewRegistration, Registration, RegistrationId, ResultFile, Status, TemplateChoice,
};
use super::scan::{MeshKind, Scans};
use super::settings::JobSettings;
use super::stage::JobStage;
use super::store_error::StoreError;
use super::submission::{self, Member};
use super::template::{TemplateError, TemplateParts, Templates};
use super::{queue, supervisor, sweep};

/// How long steps may take to stop when the program ends; what has not stopped is begun anew at the next start.
const CLOSING: Duration = Duration::from_secs(5);

/// Registrations: asked for, watched, stopped; cheap to clone.
#[derive(Clone)]
pub struct Jobs {
    engine: Arc<Engine>,
    scans: Scans,
    templates: Templates,
    work: Arc<tokio::sync::Mutex<JoinSet<()>>>,
}

/// Which registrations to list, the latest first.
#[derive(Debug, Clone, Default)]
pub struct Page {
    /// At most so many.
    pub limit: usize,
    /// Only those before this one.
    pub before: Option<RegistrationId>,
    /// Only those of this status.
    pub status: Option<Status>,
    /// Only those of this owner.
    pub owner: Option<String>,
}

/// How much there is to do, for metrics.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct QueueFigures {
    /// Registrations by status.
    pub registrations: Vec<(Status, u64)>,
    /// Steps that could run now.
    pub steps_ready: u64,
    /// Steps that run.
    pub steps_running: u64,
    /// Steps done since the start by stage: how many, and their seconds.
    pub stages: BTreeMap<&'static str, (u64, f64)>,
    /// Why no work is begun, if none is.
    pub paused: Option<String>,
}

impl Jobs {
    /// Takes up the work in a data folder where it was left, and begins it. Blobs that no record names are deleted.
    ///
    /// # Errors
    /// [`StoreError`].
    pub async fn start(
        folder: Arc<DataFolder>,
        database: Database,
        blobs: Blobs,
        (scans, templates): (Scans, Templates),
        settings: JobSettings,
    ) -> Result<Self, StoreError> {
        queue::set_up(&database).await?;
        let engine = Arc::new(Engine::new(folder, database, blobs, settings)?);
        queue::recover(&engine).await?;
        sweep::collect_all(&engine).await?;
        let mut work = JoinSet::new();
        work.spawn(queue::work(engine.clone()));
        work.spawn(supervisor::watch(engine.clone()));
        Ok(Self { engine, scans, templates, work: Arc::new(tokio::sync::Mutex::new(work)) })
    }

    /// Begins no more steps, asks those that run to stop, and waits a little for it.
    pub async fn close(&self) {
        self.engine.closing.send_replace(true);
        self.engine.stop_all();
        let mut work = self.work.lock().await;
        let all = async { while work.join_next().await.is_some() {} };
        let _ = tokio::time::timeout(CLOSING, all).await;
        work.abort_all();
    }

    /// Takes a registration on: it is kept before this returns.
    ///
    /// # Errors
    /// [`JobError::Invalid`] names the field; [`JobError::TooMany`] if the owner has too many open;
    /// [`JobError::Unavailable`] while nothing can be kept.
    pub async fn submit(&self, new: NewRegistration) -> Result<Registration, JobError> {
        if let Some(reason) = self.engine.paused.borrow().clone() {
            return Err(JobError::Unavailable(reason));
        }
        if let Some(key) = &new.dedupe_key
            && let Some(known) = self.by_dedupe_key(key).await?
        {
            return Ok(known);
        }
        let Engine { blobs, settings: own, folder, .. } = &*self.engine;
        let members = submission::members(&self.scans, &new.scans, own).await?;
        let template = self.template_parts(&new.template).await?;
        let scratch = folder.uploads();
        let settings =
            submission::settings(blobs, &new, template.as_ref(), own.scan_limits, &scratch).await?;
        let id = RegistrationId::new();
        let mut changed = Changed::default();
        let mut tx = self.engine.database.begin_write().await?;
        self.check_room(&mut tx, new.owner.as_deref()).await?;
        // Its turn comes with those who have had the least work of its priority.
        let turn = "SELECT coalesce(min(turn), 0.0) FROM registration WHERE status IN ('queued', 'running') AND priority = ?";
        let priority = priority_number(new.priority);
        let turn: f64 = sqlx::query_scalar(turn).bind(priority).fetch_one(&mut *tx).await?;
        let insert =
            "INSERT INTO registration (id, record, name, owner, dedupe_key, status, priority, template,
                template_parts, settings, webhook, stages, turn, keep, created_at)
            VALUES (?, ?, ?, ?, ?, 'queued', ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (dedupe_key) DO NOTHING
            RETURNING sequence";
        let sequence = sqlx::query_scalar::<_, i64>(insert)
            .bind(id.as_str())
            .bind(record::RECORD)
            .bind(&new.name)
            .bind(&new.owner)
            .bind(&new.dedupe_key)
            .bind(priority)
            .bind(json(&new.template))
            .bind(template.as_ref().map(json))
            .bind(json(&settings))
            .bind(&new.webhook)
            .bind(json(&JobStage::FIRST))
            .bind(turn)
            .bind(own.keep.map(|keep| i64::try_from(keep.as_millis()).unwrap_or(i64::MAX / 4)))
            .bind(now())
            .fetch_optional(&mut *tx)
            .await?;
        let Some(sequence) = sequence else {
            tx.rollback().await?;
            let known = self.by_dedupe_key(new.dedupe_key.as_deref().unwrap_or_default()).await?;
            return known.ok_or_else(|| JobError::NotFound("registration".to_owned()));
        };
        for (place, member) in (0..).zip(&members) {
            insert_member(&mut tx, sequence, place, member).await?;
        }
        check_still_there(&mut tx, sequence, members.len()).await?;
        changed.ready = members.len();
        let event = EventKind::Status { status: Status::Queued };
        changed.events.push(add_event(&mut tx, sequence, event).await?);
        self.engine.commit(tx, changed).await?;
        self.get(&id).await
    }

    /// A registration of further scans, against the template that a finished one left: the results of that stay as
    /// they are.
    ///
    /// # Errors
    /// As [`submit`](Self::submit); [`JobError::Conflict`] while the earlier one has no template.
    pub async fn add_scans(
        &self,
        to: &RegistrationId,
        scans: Vec<NewMember>,
        owner: Option<String>,
        dedupe_key: Option<String>,
    ) -> Result<Registration, JobError> {
        let earlier = self.get(to).await?;
        let template = TemplateChoice::Of(to.clone());
        let (name, priority) = (earlier.name, earlier.priority);
        let usual = NewRegistration::default();
        self.submit(NewRegistration { name, priority, scans, template, owner, dedupe_key, ..usual }).await
    }

    /// How it stands.
    ///
    /// # Errors
    /// [`JobError::NotFound`].
    pub async fn get(&self, id: &RegistrationId) -> Result<Registration, JobError> {
        // One transaction, so that what is said of its scans goes with what is said of it.
        let mut tx = self.engine.database.reader().begin().await?;
        let found = record::whole(&mut tx, id, &self.engine.fractions()).await?;
        found.ok_or_else(|| no_such(id))
    }

    /// Some of them, the latest first, without their children.
    ///
    /// # Errors
    /// [`JobError::Store`].
    pub async fn list(&self, page: Page) -> Result<Vec<Registration>, JobError> {
        let reader = self.engine.database.reader();
        let before = match &page.before {
            // Ids sort by time: where that one was deleted meanwhile, those before its time follow.
            Some(id) => {
                let query = "SELECT COALESCE((SELECT sequence FROM registration WHERE id = ?1),
                    (SELECT MAX(sequence) + 1 FROM registration WHERE id < ?1), 0)";
                sqlx::query_scalar(query).bind(id.as_str()).fetch_one(reader).await?
            }
            None => i64::MAX,
        };
        let query = "SELECT * FROM registration WHERE sequence < ?1 AND (?2 IS NULL OR status = ?2)
            AND (?3 IS NULL OR owner = ?3) ORDER BY sequence DESC LIMIT ?4";
        let query = sqlx::query(query).bind(before).bind(page.status.map(Status::name)).bind(&page.owner);
        let rows = query.bind(page.limit as i64).fetch_all(reader).await?;
        Ok(rows.iter().map(|row| Ok(record::registration(row)?.1)).collect::<Result<_, StoreError>>()?)
    }

    /// Stops it: it ends at once, and the work on it within a second. One that has ended stays as it is.
    ///
    /// # Errors
    /// [`JobError::NotFound`].
    pub async fn cancel(&self, id: &RegistrationId) -> Result<Registration, JobError> {
        let mut changed = Changed::default();
        let sequence = self.sequence(id).await?;
        let mut tx = self.engine.database.begin_write().await?;
        let open = "SELECT 1 FROM registration WHERE sequence = ? AND status IN ('queued', 'running')";
        if sqlx::query_scalar::<_, i64>(open).bind(sequence).fetch_optional(&mut *tx).await?.is_some() {
            graph::end(&mut tx, sequence, Status::Canceled, None, &mut changed).await?;
        }
        self.engine.commit(tx, changed).await?;
        self.get(id).await
    }

    /// Stops it where it runs, and deletes it and its results.
    ///
    /// # Errors
    /// [`JobError::NotFound`].
    pub async fn delete(&self, id: &RegistrationId) -> Result<(), JobError> {
        Ok(sweep::delete(&self.engine, self.sequence(id).await?).await?)
    }

    /// Its events after a number, 0 for all: those of the past, then those to come.
    ///
    /// # Errors
    /// [`JobError::NotFound`].
    pub async fn events_after(&self, id: &RegistrationId, sequence: u64) -> Result<EventFeed, JobError> {
        Ok(EventFeed::new(self.engine.clone(), self.sequence(id).await?, sequence))
    }

    /// Where a result is kept.
    ///
    /// # Errors
    /// [`JobError::NotFound`] for what will not be there; [`JobError::Conflict`] for what is not there yet.
    pub async fn result(&self, id: &RegistrationId, file: &ResultFile) -> Result<BlobInfo, JobError> {
        let query = "SELECT r.status, f.digest, f.size FROM registration r
            LEFT JOIN result f ON f.registration = r.sequence AND f.file = ? WHERE r.id = ?";
        let row = sqlx::query(query).bind(file.path()).bind(id.as_str());
        let row = row.fetch_optional(self.engine.database.reader()).await?.ok_or_else(|| no_such(id))?;
        let Some(digest) = row.try_get::<Option<&str>, _>("digest")? else {
            return Err(match status_of(row.try_get("status")?)? {
                status if status.is_final() => {
                    JobError::NotFound(format!("{} of registration {id}", file.path()))
                }
                _ => JobError::Conflict(format!(
                    "{} is not there yet: wait for the registration's end",
                    file.path()
                )),
            });
        };
        let size: i64 = row.try_get("size")?;
        Ok(BlobInfo { digest: digest.parse().map_err(broken)?, size: size.cast_unsigned() })
    }

    /// Every file of the set with its name, as `set.zip` has them: meshes by the names of their scans.
    ///
    /// # Errors
    /// [`JobError::NotFound`]; [`JobError::Conflict`] before the end.
    pub async fn set(&self, id: &RegistrationId) -> Result<Vec<(String, BlobInfo)>, JobError> {
        let registration = self.get(id).await?;
        if !registration.status.is_final() {
            return Err(JobError::Conflict(
                "the set is not there yet: wait for the registration's end".to_owned(),
            ));
        }
        let mut names: BTreeMap<String, String> = BTreeMap::new();
        for child in &registration.children {
            names.insert(ResultFile::Mesh(child.scan.clone()).path(), format!("{}.glb", child.name));
        }
        let query =
            "SELECT f.file, f.digest, f.size FROM result f JOIN registration r ON r.sequence = f.registration
            WHERE r.id = ? ORDER BY f.file";
        let rows = sqlx::query(query).bind(id.as_str()).fetch_all(self.engine.database.reader()).await?;
        if rows.is_empty() {
            return Err(JobError::NotFound(format!("result of registration {id}")));
        }
        let mut files = Vec::new();
        for row in rows {
            let file: String = row.try_get("file")?;
            let digest = row.try_get::<&str, _>("digest")?.parse().map_err(broken)?;
            let size: i64 = row.try_get("size")?;
            let name = names.get(&file).cloned().unwrap_or(file);
            files.push((name, BlobInfo { digest, size: size.cast_unsigned() }));
        }
        Ok(files)
    }

    /// How much there is to do.
    ///
    /// # Errors
    /// [`JobError::Store`].
    pub async fn figures(&self) -> Result<QueueFigures, JobError> {
        let reader = self.engine.database.reader();
        let query = "SELECT status, count(*) FROM registration GROUP BY status";
        let counts: Vec<(String, i64)> = sqlx::query_as(query).fetch_all(reader).await?;
        let count = |(name, count): &(String, i64)| Ok((status_of(name)?, count.cast_unsigned()));
        let query = "SELECT count(*) FROM step WHERE state = 'ready'";
        let ready: i64 = sqlx::query_scalar(query).fetch_one(reader).await?;
        Ok(QueueFigures {
            registrations: counts.iter().map(count).collect::<Result<_, StoreError>>()?,
            steps_ready: ready.cast_unsigned(),
            steps_running: self.engine.running().len() as u64,
            stages: lock(&self.engine.spent).clone(),
            paused: self.engine.paused.borrow().clone(),
        })
    }

    /// The residuals of results since this was last asked, for metrics: each scan's mean distance from its result, in the
    /// scan's radius.
    pub fn take_residuals(&self) -> Vec<f64> {
        std::mem::take(&mut lock(&self.engine.residuals))
    }

    /// Counts registrations that came to an end, for those who tell of it.
    pub fn finished(&self) -> watch::Receiver<u64> {
        self.engine.finished.subscribe()
    }

    /// Deletes what is over now, without waiting for the next time that it is looked for.
    ///
    /// # Errors
    /// [`JobError::Store`].
    pub async fn expire(&self) -> Result<(), JobError> {
        Ok(sweep::expire(&self.engine).await?)
    }

    /// Why no work is begun, if none is.
    pub fn paused(&self) -> Option<String> {
        self.engine.paused.borrow().clone()
    }

    async fn sequence(&self, id: &RegistrationId) -> Result<i64, JobError> {
        let query = sqlx::query_scalar("SELECT sequence FROM registration WHERE id = ?").bind(id.as_str());
        query.fetch_optional(self.engine.database.reader()).await?.ok_or_else(|| no_such(id))
    }

    async fn by_dedupe_key(&self, key: &str) -> Result<Option<Registration>, JobError> {
        let query =
            sqlx::query_scalar::<_, String>("SELECT id FROM registration WHERE dedupe_key = ?").bind(key);
        match query.fetch_optional(self.engine.database.reader()).await? {
            Some(id) => Ok(Some(self.get(&id.parse().map_err(broken)?).await?)),
            None => Ok(None),
        }
    }

    async fn template_parts(&self, choice: &TemplateChoice) -> Result<Option<TemplateParts>, JobError> {
        match choice {
            TemplateChoice::Default => Ok(None),
            TemplateChoice::Stored(id) => match self.templates.get(id).await {
                Ok(stored) => Ok(Some(stored.parts)),
                Err(TemplateError::Store(error)) => Err(error.into()),
                Err(error) => Err(JobError::invalid("template", error)),
            },
            TemplateChoice::Of(id) => {
                let frozen = self.result(id, &ResultFile::Template).await?;
                let mesh = frozen.digest;
                Ok(Some(TemplateParts { kind: MeshKind::Glb, mesh, landmarks: None, mask: None }))
            }
        }
    }

    async fn check_room(&self, tx: &mut sqlx::SqliteConnection, owner: Option<&str>) -> Result<(), JobError> {
        let open = "SELECT count(*) FROM registration WHERE status IN ('queued', 'running') AND owner IS ?";
        let open: i64 = sqlx::query_scalar(open).bind(owner).fetch_one(tx).await?;
        let most = self.engine.settings.jobs_per_owner;
        if open as usize >= most {
            return Err(JobError::TooMany(format!(
                "{open} registrations are open, {most} may be: wait for one to end"
            )));
        }
        Ok(())
    }
}

async fn insert_member(
    tx: &mut sqlx::SqliteConnection,
    registration: i64,
    place: i64,
    member: &Member,
) -> Result<(), StoreError> {
    let child =
        "INSERT INTO child (registration, place, scan, name, parts, status) VALUES (?, ?, ?, ?, ?, 'queued')";
    let child = sqlx::query(child).bind(registration).bind(place).bind(member.scan.as_str());
    child.bind(&member.name).bind(json(&member.parts)).execute(&mut *tx).await?;
    let step = "INSERT INTO step (registration, stage, place, state) VALUES (?, 0, ?, 'ready')";
    sqlx::query(step).bind(registration).bind(place).execute(tx).await?;
    Ok(())
}

/// Whether no scan was deleted since it was looked at: from now on its files are kept.
async fn check_still_there(
    tx: &mut sqlx::SqliteConnection,
    registration: i64,
    members: usize,
) -> Result<(), JobError> {
    let there = "SELECT count(*) FROM child c JOIN scan s ON s.id = c.scan WHERE c.registration = ?";
    let there: i64 = sqlx::query_scalar(there).bind(registration).fetch_one(tx).await?;
    match there as usize == members {
        true => Ok(()),
        false => Err(JobError::invalid("scans", "one was deleted just now: leave it out")),
    }
}

fn no_such(id: &RegistrationId) -> JobError {
    JobError::NotFound(format!("registration {id}"))
}
