//! The handle through which jobs are asked for and watched.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use sqlx::Row;
use tokio::sync::watch;
use tokio::task::JoinSet;

use super::blobs::{BlobInfo, Blobs};
use super::data_folder::DataFolder;
use super::database::Database;
use super::engine::{Engine, lock};
use super::error::JobError;
use super::feed::EventFeed;
use super::graph::{self, Changed};
use super::job_id::{JobId, JobKind, OfKind};
use super::record::{self, broken, kind_of, status_of};
use super::registration::{Registering, RegistrationId};
use super::result_file::ResultFile;
use super::scan::Scans;
use super::settings::JobSettings;
use super::state::{Job, Status};
use super::store_error::StoreError;
use super::template::Templates;
use super::told::Told;
use super::{queue, supervisor, sweep};

/// How long steps may take to stop when the program ends; what has not stopped is begun anew at the next start.
const CLOSING: Duration = Duration::from_secs(5);

/// Jobs: asked for, watched, stopped; cheap to clone.
#[derive(Clone)]
pub struct Jobs {
    pub(super) engine: Arc<Engine>,
    pub(super) scans: Scans,
    pub(super) templates: Templates,
    work: Arc<tokio::sync::Mutex<JoinSet<()>>>,
}

/// Which jobs to list, the latest first.
#[derive(Debug, Clone)]
pub struct Page<K> {
    /// At most so many.
    pub limit: usize,
    /// Only those before this one.
    pub before: Option<JobId<K>>,
    /// Only those of this status.
    pub status: Option<Status>,
    /// Only those of this owner.
    pub owner: Option<String>,
}

impl<K> Default for Page<K> {
    fn default() -> Self {
        Self { limit: 0, before: None, status: None, owner: None }
    }
}

/// How much there is to do, for metrics.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct QueueFigures {
    /// How many jobs there are of a kind in a status.
    pub jobs: Vec<(JobKind, Status, u64)>,
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
        if tokio::time::timeout(CLOSING, all).await.is_err() {
            tracing::warn!("steps have not stopped in time: they are begun anew at the next start");
        }
        // Whatever held the data folder has let go of it then.
        work.shutdown().await;
    }

    /// How it stands.
    ///
    /// # Errors
    /// [`JobError::NotFound`].
    pub async fn get<K: OfKind>(&self, id: &JobId<K>) -> Result<Job<K>, JobError> {
        Ok(Job::clone(&*self.snapshot(id).await?))
    }

    /// How it stood a moment ago, together with all who ask now.
    ///
    /// # Errors
    /// [`JobError::NotFound`].
    pub async fn snapshot<K: OfKind>(&self, id: &JobId<K>) -> Result<Arc<Told<Job<K>>>, JobError> {
        let snapshots = &self.engine.snapshots;
        let generation = match snapshots.get(id.as_str()) {
            Ok(job) => return Ok(job),
            Err(generation) => generation,
        };
        // One transaction, so that what is said of its scans goes with what is said of it.
        let mut tx = self.engine.database.reader().begin().await?;
        let found = record::whole(&mut tx, id, &self.engine.fractions()).await?;
        let job = Arc::new(Told::new(found.ok_or_else(|| no_such(id))?));
        snapshots.keep(generation, id.as_str(), &job);
        Ok(job)
    }

    /// Some of them, the latest first, without their children.
    ///
    /// # Errors
    /// [`JobError::Store`].
    pub async fn list<K: OfKind>(&self, page: Page<K>) -> Result<Vec<Job<K>>, JobError> {
        let reader = self.engine.database.reader();
        let before = match &page.before {
            // Ids sort by time: where that one was deleted meanwhile, those before its time follow.
            Some(id) => {
                let query = "SELECT COALESCE((SELECT sequence FROM job WHERE id = ?1),
                    (SELECT MAX(sequence) + 1 FROM job WHERE id < ?1), 0)";
                sqlx::query_scalar(query).bind(id.as_str()).fetch_one(reader).await?
            }
            None => i64::MAX,
        };
        let query = "SELECT * FROM job WHERE sequence < ?1 AND (?2 IS NULL OR status = ?2)
            AND (?3 IS NULL OR owner = ?3) AND kind = ?4 ORDER BY sequence DESC LIMIT ?5";
        let query = sqlx::query(query).bind(before).bind(page.status.map(Status::name)).bind(&page.owner);
        let rows = query.bind(K::KIND.name()).bind(page.limit as i64).fetch_all(reader).await?;
        Ok(rows.iter().map(|row| Ok(record::job(row)?.1)).collect::<Result<_, StoreError>>()?)
    }

    /// Stops it: it ends at once, and the work on it within a second. One that has ended stays as it is.
    ///
    /// # Errors
    /// [`JobError::NotFound`].
    pub async fn cancel<K: OfKind>(&self, id: &JobId<K>) -> Result<Job<K>, JobError> {
        let mut changed = Changed::default();
        let sequence = self.sequence(id).await?;
        let mut tx = self.engine.database.begin_write().await?;
        let open = "SELECT 1 FROM job WHERE sequence = ? AND status IN ('queued', 'running')";
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
    pub async fn delete<K: OfKind>(&self, id: &JobId<K>) -> Result<(), JobError> {
        Ok(sweep::delete(&self.engine, self.sequence(id).await?).await?)
    }

    /// Its events after a number, 0 for all: those of the past, then those to come.
    ///
    /// # Errors
    /// [`JobError::NotFound`].
    pub async fn events_after<K: OfKind>(&self, id: &JobId<K>, sequence: u64) -> Result<EventFeed, JobError> {
        Ok(EventFeed::new(self.engine.clone(), self.sequence(id).await?, sequence))
    }

    /// Where a result is kept.
    ///
    /// # Errors
    /// [`JobError::NotFound`] for what will not be there; [`JobError::Conflict`] for what is not there yet.
    pub async fn result<K: OfKind>(&self, id: &JobId<K>, file: &ResultFile) -> Result<BlobInfo, JobError> {
        let query = "SELECT r.status, f.digest, f.size FROM job r
            LEFT JOIN result f ON f.job = r.sequence AND f.file = ? WHERE r.id = ? AND r.kind = ?";
        let row = sqlx::query(query).bind(file.path()).bind(id.as_str()).bind(K::KIND.name());
        let row = row.fetch_optional(self.engine.database.reader()).await?.ok_or_else(|| no_such(id))?;
        let Some(digest) = row.try_get::<Option<&str>, _>("digest")? else {
            return Err(match status_of(row.try_get("status")?)? {
                status if status.is_final() => {
                    JobError::NotFound(format!("{} of {} {id}", file.path(), K::KIND))
                }
                _ => not_yet::<K>(&file.path()),
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
        let job = self.get(id).await?;
        if !job.status.is_final() {
            return Err(not_yet::<Registering>("the set"));
        }
        let mut names: BTreeMap<String, String> = BTreeMap::new();
        for child in &job.children {
            names.insert(ResultFile::Mesh(child.scan.clone()).path(), format!("{}.glb", child.name));
        }
        let query = "SELECT f.file, f.digest, f.size FROM result f JOIN job r ON r.sequence = f.job
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
        let query = "SELECT kind, status, count(*) FROM job GROUP BY kind, status";
        let counts: Vec<(String, String, i64)> = sqlx::query_as(query).fetch_all(reader).await?;
        let count = |(kind, status, count): &(String, String, i64)| {
            Ok((kind_of(kind)?, status_of(status)?, count.cast_unsigned()))
        };
        let query = "SELECT count(*) FROM step WHERE state = 'ready'";
        let ready: i64 = sqlx::query_scalar(query).fetch_one(reader).await?;
        Ok(QueueFigures {
            jobs: counts.iter().map(count).collect::<Result<_, StoreError>>()?,
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

    /// Counts jobs that came to an end, for those who tell of it.
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

    async fn sequence<K: OfKind>(&self, id: &JobId<K>) -> Result<i64, JobError> {
        let query = sqlx::query_scalar("SELECT sequence FROM job WHERE id = ? AND kind = ?");
        let query = query.bind(id.as_str()).bind(K::KIND.name());
        query.fetch_optional(self.engine.database.reader()).await?.ok_or_else(|| no_such(id))
    }
}

fn no_such<K: OfKind>(id: &JobId<K>) -> JobError {
    JobError::NotFound(format!("{} {id}", K::KIND))
}

fn not_yet<K: OfKind>(what: &str) -> JobError {
    JobError::Conflict(format!("{what} is not there yet: wait for the {}'s end", K::KIND))
}
