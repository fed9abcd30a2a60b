//! The job engine: apalis hands tickets to workers. A ticket says that some step is ready; which one it is, is decided
//! when a worker takes it up, by the graph's own table, so that jobs have their turns, a ticket that comes twice
//! or is lost does no harm, and a clock that jumps holds nothing back. apalis keeps the tickets, bounds how many are worked
//! on, and starts a worker again that fails.

use std::sync::Arc;
use std::time::Duration;

use apalis::prelude::*;
use apalis_sqlite::queries::push_tasks;
use apalis_sqlite::{Config, SqliteStorage};
use futures_util::{Stream, StreamExt};
use serde::{Deserialize, Serialize};
use sqlx::sqlite::SqliteConnection;
use tokio::sync::watch;

use super::database::Database;
use super::engine::Engine;
use super::store_error::StoreError;

const QUEUE: &str = "steps";
/// How long a worker waits for a sign before it looks for tickets itself.
const LOOK: Duration = Duration::from_millis(250);
/// How long tickets may take to be told that they are used up when the program ends.
const TICKETS: Duration = Duration::from_secs(1);

/// Some step is ready.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Ticket {}

/// Makes the engine's tables, and clears them of what an earlier run left: its tickets are given out anew.
///
/// # Errors
/// [`StoreError`].
pub(super) async fn set_up(database: &Database) -> Result<(), StoreError> {
    // Not `SqliteStorage::setup`, which takes the safety from the connection it is given (synchronous = OFF).
    SqliteStorage::<()>::migrations().run(database.writer()).await?;
    let mut tx = database.begin_write().await?;
    sqlx::query("DELETE FROM Jobs").execute(&mut *tx).await?;
    sqlx::query("DELETE FROM Workers").execute(&mut *tx).await?;
    Ok(tx.commit().await?)
}

/// Gives out tickets for so many steps that became ready.
///
/// # Errors
/// [`StoreError`].
pub(super) async fn push(tx: &mut SqliteConnection, steps: usize) -> Result<(), StoreError> {
    // At the beginning of time: a clock that is set back makes nobody wait.
    let ticket = |_| TaskBuilder::new(b"{}".to_vec()).run_at_timestamp(0).max_attempts(1).build();
    let tickets: Vec<_> = (0..steps).map(ticket).collect();
    push_tasks(tx, QUEUE, &tickets).await.map_err(super::record::broken)
}

/// Deletes tickets that are used up.
///
/// # Errors
/// [`StoreError`].
pub(super) async fn clear(tx: &mut SqliteConnection) -> Result<(), StoreError> {
    sqlx::query("DELETE FROM Jobs WHERE status IN ('Done', 'Failed', 'Killed')").execute(tx).await?;
    Ok(())
}

/// Gives out tickets where steps are ready and nobody is on the way to them, and gives steps back that nobody works on.
///
/// # Errors
/// [`StoreError`].
pub(super) async fn reconcile(engine: &Engine) -> Result<(), StoreError> {
    let open = "SELECT count(*) FILTER (WHERE state = 'ready'), count(*) FILTER (WHERE state = 'running')
        FROM step WHERE state IN ('ready', 'running')";
    let (ready, running): (i64, i64) = sqlx::query_as(open).fetch_one(engine.database.reader()).await?;
    let known = engine.running();
    if running <= known.len() as i64 && (ready == 0 || known.len() >= engine.settings.threads) {
        return Ok(());
    }
    let mut tx = engine.database.begin_write().await?;
    let known = super::record::json(&engine.running());
    let lost = "UPDATE step SET state = 'ready'
        WHERE state = 'running' AND id NOT IN (SELECT value FROM json_each(?))";
    sqlx::query(lost).bind(known).execute(&mut *tx).await?;
    let waiting = "SELECT count(*) FROM Jobs WHERE status = 'Pending'";
    let waiting: i64 = sqlx::query_scalar(waiting).fetch_one(&mut *tx).await?;
    if waiting == 0 {
        push(&mut tx, engine.settings.threads).await?;
    }
    tx.commit().await?;
    engine.wake.notify_one();
    Ok(())
}

/// What a run of the program that ended in the middle left: its steps are ready again, and one that ended the program
/// too often fails its scan.
///
/// # Errors
/// [`StoreError`].
pub(super) async fn recover(engine: &Engine) -> Result<(), StoreError> {
    let mut tx = engine.database.begin_write().await?;
    let interrupted = "UPDATE step SET state = 'ready', crashes = crashes + 1 WHERE state = 'running'";
    sqlx::query(interrupted).execute(&mut *tx).await?;
    let mut changed = super::graph::Changed::default();
    super::graph::fail_crashed(&mut tx, engine.settings.crashes, &mut changed).await?;
    let ready = sqlx::query_scalar::<_, i64>("SELECT count(*) FROM step WHERE state = 'ready'");
    changed.ready = ready.fetch_one(&mut *tx).await?.max(0) as usize;
    engine.commit(tx, changed).await
}

/// Works on tickets until the program ends.
pub(super) async fn work(engine: Arc<Engine>) {
    let boot = uuid::Uuid::now_v7().simple().to_string();
    let (mut closing, mut busy) = (engine.closing.subscribe(), engine.busy.subscribe());
    let monitor = Monitor::new().register(move |restarts| {
        let config = Config::default().queue(QUEUE).batch_size(1).persist_results(false);
        let config = config.heartbeat_interval(Duration::from_secs(5)).missed_heartbeats(3);
        let signs = signs(engine.clone());
        let storage = SqliteStorage::<Ticket>::new(engine.database.writer()).with_config(config);
        // Names are new at every start and restart: the engine takes a known one for alive.
        WorkerBuilder::new(format!("{boot}-{restarts}"))
            .backend(storage.poll_with_stream(signs))
            .data(engine.clone())
            .catch_panic()
            .concurrency(engine.settings.threads)
            .build(take)
    });
    let monitor = monitor.should_restart(|_, error| {
        tracing::warn!(%error, "the queue's worker failed and is started again");
        true
    });
    // Only when no worker is at a step: apalis, once told, leaves what it asks of the database unfinished until its workers
    // have ended, and they may wait for that very connection. The senders live as long as the engine.
    let closed = async move {
        let _ = closing.wait_for(|closing| *closing).await;
        let _ = busy.wait_for(|busy| *busy == 0).await;
        Ok(())
    };
    // What may still wait then is that a ticket is told to be used up, which nobody needs.
    let monitor = monitor.shutdown_timeout(TICKETS);
    if let Err(error) = monitor.run_with_signal(closed).await {
        tracing::error!(%error, "the queue ended");
    }
}

/// When to look for tickets.
fn signs(engine: Arc<Engine>) -> impl Stream<Item = ()> + Send + Unpin + 'static {
    let signs = futures_util::stream::unfold(engine, |engine| async {
        // Whichever comes first.
        let _ = tokio::time::timeout(LOOK, engine.wake.notified()).await;
        Some(((), engine))
    });
    let mut signs = signs.boxed();
    futures_util::stream::poll_fn(move |cx| {
        let sign = signs.poll_next_unpin(cx);
        if sign.is_ready() {
            // The engine forgets to wait for the next sign when one comes just as it finds no ticket: it is to ask again.
            cx.waker().wake_by_ref();
        }
        sign
    })
}

/// Does steps as long as there are some.
async fn take(_ticket: Ticket, engine: Data<Arc<Engine>>) -> Result<(), BoxDynError> {
    let _busy = Busy::new(&engine.busy);
    loop {
        match engine.turn().await {
            Ok(true) => {}
            Ok(false) => return Ok(()),
            Err(error) => {
                engine.pause(&error);
                return Ok(());
            }
        }
    }
}

/// Counts a worker that goes from step to step, until it is dropped.
struct Busy<'a>(&'a watch::Sender<usize>);

impl<'a> Busy<'a> {
    fn new(count: &'a watch::Sender<usize>) -> Self {
        count.send_modify(|count| *count += 1);
        Self(count)
    }
}

impl Drop for Busy<'_> {
    fn drop(&mut self) {
        self.0.send_modify(|count| *count -= 1);
    }
}
