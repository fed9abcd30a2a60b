//! One step from its claim to its end.

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use sqlx::{Sqlite, Transaction};
use tokio::sync::{Notify, broadcast, watch};
use tracing::{Instrument, info_span};

use super::blobs::{Blobs, Kept};
use super::cache::Cache;
use super::compute::{Compute, Control, Panicked, Stop};
use super::data_folder::DataFolder;
use super::database::Database;
use super::event::{Event, EventKind};
use super::graph::{self, Changed, Claim, Done};
use super::inputs::Inputs;
use super::record::{Fractions, add_event};
use super::settings::JobSettings;
use super::snapshots::Snapshots;
use super::state::Problem;
use super::store_error::StoreError;
use super::told::Told;
use super::work::{Decided, Fault, Produced};
use super::{queue, sweep};
use crate::render::Adapter;

/// How often a running step is looked after: whether it is to stop, how far it is.
const LOOK: Duration = Duration::from_millis(200);
/// How often its progress is told.
const TELL: Duration = Duration::from_secs(1);
/// Residuals that are kept until somebody asks for them.
const RESIDUALS: usize = 10_000;
/// How long a step that is to stop may take to do so.
const GRACE: Duration = Duration::from_secs(60);

/// All that steps share.
pub(super) struct Engine {
    pub folder: Arc<DataFolder>,
    pub database: Database,
    pub blobs: Blobs,
    pub settings: JobSettings,
    pub cache: Cache,
    pub snapshots: Snapshots,
    compute: Compute,
    /// The steps that run, by their ids.
    running: Mutex<HashMap<i64, Arc<Control>>>,
    feeds: Mutex<HashMap<i64, broadcast::Sender<Arc<Told<Event>>>>>,
    /// Told when steps become ready.
    pub wake: Notify,
    /// What draws, once it was opened.
    pub renderer: tokio::sync::Mutex<Option<Adapter>>,
    /// Held by whoever unpacks a capture to look at it.
    pub unpacking: tokio::sync::Mutex<()>,
    /// Why no work begins, if none does.
    pub paused: watch::Sender<Option<String>>,
    /// Counts the jobs that ended.
    pub finished: watch::Sender<u64>,
    /// Whether the program ends.
    pub closing: watch::Sender<bool>,
    /// Seconds and number of the steps done, by stage.
    pub spent: Mutex<BTreeMap<&'static str, (u64, f64)>>,
    /// Residuals of the latest results that nobody has asked for yet.
    pub residuals: Mutex<Vec<f64>>,
    /// Workers that go from step to step.
    pub busy: watch::Sender<usize>,
}

/// How a step came to its end.
enum Outcome {
    Done(Produced),
    Failed(Problem),
    Stopped,
    Store(StoreError),
}

impl Outcome {
    fn name(&self) -> &'static str {
        match self {
            Self::Done(_) => "done",
            Self::Failed(_) => "failed",
            Self::Stopped => "stopped",
            Self::Store(_) => "store failed",
        }
    }
}

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Engine {
    pub fn new(
        folder: Arc<DataFolder>,
        database: Database,
        blobs: Blobs,
        settings: JobSettings,
    ) -> Result<Self, StoreError> {
        let compute = Compute::new(settings.threads)
            .map_err(|error| StoreError::Folder { path: folder.path().to_owned(), error })?;
        Ok(Self {
            cache: Cache::new(settings.cache_bytes),
            snapshots: Snapshots::default(),
            compute,
            folder,
            database,
            blobs,
            settings,
            running: Mutex::default(),
            feeds: Mutex::default(),
            wake: Notify::new(),
            renderer: tokio::sync::Mutex::default(),
            unpacking: tokio::sync::Mutex::default(),
            paused: watch::Sender::new(None),
            finished: watch::Sender::new(0),
            closing: watch::Sender::new(false),
            spent: Mutex::default(),
            residuals: Mutex::default(),
            busy: watch::Sender::new(0),
        })
    }

    /// Takes on the next step and does it; says whether there was one.
    ///
    /// # Errors
    /// [`StoreError`] where the store failed, so that nothing can go on for now.
    pub async fn turn(self: &Arc<Self>) -> Result<bool, StoreError> {
        if *self.closing.borrow() || self.paused.borrow().is_some() {
            return Ok(false);
        }
        let mut changed = Changed::default();
        let mut tx = self.database.begin_write().await?;
        // While the transaction is open nobody else begins a step.
        let (others_run, one_alone) = {
            let running = lock(&self.running);
            (!running.is_empty(), running.values().any(|control| control.alone))
        };
        if one_alone {
            return Ok(false);
        }
        let Some(claim) = graph::claim(&mut tx, &mut changed, others_run).await? else { return Ok(false) };
        let control = Arc::new(Control::new(claim.job, claim.alone));
        lock(&self.running).insert(claim.step, control.clone());
        let guard = Running { engine: self, step: claim.step };
        tx.commit().await?;
        self.publish(changed);
        let stage = claim.stage().name();
        let span = info_span!("step", job = claim.id, stage, place = claim.place, run = claim.run);
        let work = async {
            let start = Instant::now();
            let outcome = self.run(&claim, control).await;
            let seconds = start.elapsed().as_secs_f64();
            tracing::debug!(seconds, outcome = outcome.name(), "step ended");
            self.end(&claim, outcome, seconds).await
        };
        let ended = work.instrument(span).await;
        drop(guard);
        ended.map(|()| true)
    }

    async fn run(self: &Arc<Self>, claim: &Claim, control: Arc<Control>) -> Outcome {
        let inputs = match Inputs::fetch(self, claim).await {
            Ok(inputs) => inputs,
            Err(error) => return Outcome::Store(error),
        };
        let (engine, own) = (self.clone(), control.clone());
        let work = move || inputs.into_work(&engine.cache)?.run(&*own);
        let mut work = std::pin::pin!(self.compute.run(work));
        let (start, mut told) = (Instant::now(), Instant::now());
        let mut last = 0.0;
        loop {
            match tokio::time::timeout(LOOK, &mut work).await {
                Ok(Ok(Ok(produced))) => return Outcome::Done(produced),
                Ok(Ok(Err(Fault::Problem(problem)))) => return Outcome::Failed(problem),
                Ok(Ok(Err(Fault::Stopped))) => return self.stopped(&control),
                Ok(Err(panicked)) => return crashed(panicked),
                Err(_) => {}
            }
            if start.elapsed() > self.settings.step_time {
                control.stop(Stop::TooSlow);
            }
            if self.is_over(claim.job).await {
                control.stop(Stop::Canceled);
            }
            if start.elapsed() > self.settings.step_time + GRACE {
                // It hears nothing: its threads are left to it.
                return self.stopped(&control);
            }
            if told.elapsed() > TELL && control.fraction() > last {
                (last, told) = (control.fraction(), Instant::now());
                self.tell(claim, last).await;
            }
        }
    }

    fn stopped(&self, control: &Control) -> Outcome {
        if control.stopped() != Some(Stop::TooSlow) {
            return Outcome::Stopped;
        }
        let seconds = self.settings.step_time.as_secs();
        Outcome::Failed(Problem {
            code: "too_slow".to_owned(),
            detail: format!("one step took longer than {seconds} s: give a coarser scan, or fewer vertices"),
        })
    }

    /// Whether a job has ended, by somebody else's hand.
    async fn is_over(&self, job: i64) -> bool {
        let query =
            sqlx::query_scalar::<_, i64>("SELECT 1 FROM job WHERE sequence = ? AND status = 'running'");
        let found = query.bind(job).fetch_optional(self.database.reader()).await;
        matches!(found, Ok(None))
    }

    /// Tells how far a step is. What cannot be told is no reason to stop.
    async fn tell(&self, claim: &Claim, stage_progress: f64) {
        let told = async {
            let mut connection = self.database.reader().acquire().await?;
            let scan = sqlx::query_scalar::<_, String>("SELECT scan FROM child WHERE job = ? AND place = ?");
            let scan = scan.bind(claim.job).bind(claim.place).fetch_optional(&mut *connection).await?;
            let scan = scan.map(|scan| scan.parse()).transpose().map_err(super::record::broken)?;
            let fractions = self.fractions();
            let progress = super::record::progress_of(&mut connection, claim.job, &fractions).await?;
            drop(connection);
            let stage = claim.stage().name().to_owned();
            let mut tx = self.database.begin_write().await?;
            let event = EventKind::Progress { progress, scan, stage, stage_progress };
            let event = add_event(&mut tx, claim.job, event).await?;
            tx.commit().await?;
            self.publish(Changed { events: vec![event], ..Changed::default() });
            Ok::<(), StoreError>(())
        };
        if let Err(error) = told.await {
            tracing::warn!(%error, "progress cannot be told");
        }
    }

    async fn end(&self, claim: &Claim, outcome: Outcome, seconds: f64) -> Result<(), StoreError> {
        match outcome {
            Outcome::Done(produced) => self.keep(claim, produced, seconds).await,
            Outcome::Failed(problem) => {
                tracing::warn!(code = problem.code, detail = problem.detail, "step failed");
                let mut changed = Changed::default();
                let mut tx = self.database.begin_write().await?;
                graph::fail(&mut tx, claim, &problem, seconds, &mut changed).await?;
                self.commit(tx, changed).await
            }
            Outcome::Stopped => {
                let mut tx = self.database.begin_write().await?;
                graph::give_back(&mut tx, claim).await?;
                Ok(tx.commit().await?)
            }
            Outcome::Store(error) => self.store_failed(claim, error).await,
        }
    }

    /// Keeps what a step produced, and ends it.
    async fn keep(&self, claim: &Claim, produced: Produced, seconds: f64) -> Result<(), StoreError> {
        let Produced { output, files, decided } = produced;
        // Held until the records that name them are committed.
        let mut held: Vec<Kept> = Vec::new();
        let mut output_digest = None;
        if !output.is_empty() {
            let kept = self.blobs.put_bytes(output).await?;
            output_digest = Some(kept.info.digest);
            held.push(kept);
        }
        let mut records = Vec::new();
        for (file, bytes) in files {
            let kept = self.blobs.put_bytes(bytes).await?;
            records.push((file, kept.info.digest, kept.info.size));
            held.push(kept);
        }
        let residual = match &decided {
            Decided::Judgement(judgement) => judgement.residual,
            _ => None,
        };
        let mut changed = Changed::default();
        let mut tx = self.database.begin_write().await?;
        let done = Done { output: output_digest, files: records, decided, seconds };
        let own = graph::finish(&mut tx, claim, done, &mut changed).await?;
        if own {
            let mut spent = lock(&self.spent);
            let (count, sum) = spent.entry(claim.stage().name()).or_default();
            (*count, *sum) = (*count + 1, *sum + seconds);
            drop(spent);
            let mut residuals = lock(&self.residuals);
            let room = residuals.len() < RESIDUALS;
            residuals.extend(residual.filter(|_| room));
        }
        graph::end_if_too_long(&mut tx, claim.job, self.settings.job_time, &mut changed).await?;
        self.commit(tx, changed).await?;
        let digests = held.iter().map(|kept| kept.info.digest).collect();
        drop(held);
        if !own {
            // The job ended meanwhile: nobody will name these.
            sweep::collect(&self.database, &self.blobs, digests).await?;
        }
        Ok(())
    }

    /// A damaged intermediate result is made again; a damaged upload fails its scan; all else is tried again later.
    async fn store_failed(&self, claim: &Claim, error: StoreError) -> Result<(), StoreError> {
        let mut changed = Changed::default();
        let mut tx = self.database.begin_write().await?;
        let again = match &error {
            StoreError::Corrupted { digest } | StoreError::Missing { digest } => {
                graph::redo(&mut tx, claim, *digest, &mut changed).await?
            }
            // What is recorded will not change.
            StoreError::Record { .. } => false,
            _ => {
                graph::give_back(&mut tx, claim).await?;
                tx.commit().await?;
                return Err(error);
            }
        };
        tracing::error!(%error, again, "a step's inputs are damaged");
        if !again {
            let problem = Problem { code: "storage".to_owned(), detail: error.to_string() };
            graph::fail(&mut tx, claim, &problem, 0.0, &mut changed).await?;
        }
        self.commit(tx, changed).await
    }

    /// Commits a change with the tickets for the steps that it made ready, and tells of it.
    pub async fn commit(&self, mut tx: Transaction<'_, Sqlite>, changed: Changed) -> Result<(), StoreError> {
        // Workers that are at it go on by themselves.
        let idle = self.settings.threads.saturating_sub(*self.busy.borrow());
        queue::push(&mut tx, changed.ready.min(idle)).await?;
        tx.commit().await?;
        let dropped = changed.dropped.clone();
        self.cache.forget(&dropped);
        self.publish(changed);
        sweep::collect_soon(&self.database, &self.blobs, dropped).await;
        Ok(())
    }

    /// Tells of a change that is committed.
    fn publish(&self, changed: Changed) {
        self.snapshots.forget();
        let mut feeds = lock(&self.feeds);
        for (job, event) in changed.events {
            let last = event.kind.is_last();
            if let Some(feed) = feeds.get(&job) {
                // Nobody may listen any more.
                let _ = feed.send(Arc::new(Told::new(event)));
            }
            if last {
                feeds.remove(&job);
            }
        }
        feeds.retain(|_, feed| feed.receiver_count() > 0);
        drop(feeds);
        for job in &changed.ended {
            self.stop(*job);
        }
        if !changed.ended.is_empty() {
            self.finished.send_modify(|count| *count += changed.ended.len() as u64);
        }
        for _ in 0..changed.ready.min(self.settings.threads) {
            self.wake.notify_one();
        }
    }

    /// Begins no work until the store can be written again.
    pub fn pause(&self, error: &StoreError) {
        let reason = if error.is_full() { "the disk is full".to_owned() } else { error.to_string() };
        tracing::error!(reason, "no work is begun for now");
        self.paused.send_replace(Some(reason));
    }

    /// The events of a job from now on.
    pub fn subscribe(&self, job: i64) -> broadcast::Receiver<Arc<Told<Event>>> {
        const BUFFERED: usize = 64;
        let mut feeds = lock(&self.feeds);
        feeds.entry(job).or_insert_with(|| broadcast::channel(BUFFERED).0).subscribe()
    }

    /// Asks the steps of a job to stop.
    fn stop(&self, job: i64) {
        let running = lock(&self.running);
        running.values().filter(|own| own.job == job).for_each(|own| own.stop(Stop::Canceled));
    }

    /// Asks all steps to stop, because the program ends.
    pub fn stop_all(&self) {
        lock(&self.running).values().for_each(|control| control.stop(Stop::Shutdown));
    }

    /// The steps that run.
    pub fn running(&self) -> Vec<i64> {
        lock(&self.running).keys().copied().collect()
    }

    /// How far the steps that run have come.
    pub fn fractions(&self) -> Fractions {
        lock(&self.running).iter().map(|(&step, control)| (step, control.fraction())).collect()
    }
}

fn crashed(Panicked(message): Panicked) -> Outcome {
    let detail = format!("the engine crashed on it: {message}; please report it with the scan");
    Outcome::Failed(Problem { code: "crashed".to_owned(), detail })
}

/// A step among those that run, until this is dropped.
struct Running<'a> {
    engine: &'a Engine,
    step: i64,
}

impl Drop for Running<'_> {
    fn drop(&mut self) {
        lock(&self.engine.running).remove(&self.step);
    }
}
