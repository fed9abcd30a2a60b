use std::collections::VecDeque;
use std::sync::Arc;

use tokio::sync::broadcast;
use tokio::sync::broadcast::error::RecvError;

use super::engine::Engine;
use super::error::JobError;
use super::event::Event;
use super::record::events;
use super::told::Told;

/// Events that are read at once.
const PAGE: i64 = 256;

/// The events of one job, those of the past first.
pub struct EventFeed {
    engine: Arc<Engine>,
    job: i64,
    /// The number of the last that was given.
    last: u64,
    waiting: VecDeque<Arc<Told<Event>>>,
    live: broadcast::Receiver<Arc<Told<Event>>>,
    /// Whether there may be some in the database that have not been read.
    behind: bool,
    ended: bool,
}

impl EventFeed {
    pub(super) fn new(engine: Arc<Engine>, job: i64, after: u64) -> Self {
        // Before the past is read, so that nothing falls between.
        let live = engine.subscribe(job);
        Self { engine, job, last: after, waiting: VecDeque::new(), live, behind: true, ended: false }
    }

    /// The next one; `None` after the last that will ever come.
    ///
    /// # Errors
    /// [`JobError::Store`].
    pub async fn next(&mut self) -> Result<Option<Arc<Told<Event>>>, JobError> {
        loop {
            if let Some(event) = self.waiting.pop_front() {
                if event.sequence > self.last {
                    self.last = event.sequence;
                    self.ended = event.kind.is_last();
                    return Ok(Some(event));
                }
            } else if self.ended {
                return Ok(None);
            } else if self.behind {
                self.read().await?;
            } else {
                match self.live.recv().await {
                    Ok(event) => self.waiting.push_back(event),
                    Err(RecvError::Lagged(_)) => self.behind = true,
                    // The job has ended or is gone: what was missed is in the database.
                    Err(RecvError::Closed) => {
                        self.read().await?;
                        self.ended = self.waiting.is_empty();
                    }
                }
            }
        }
    }

    async fn read(&mut self) -> Result<(), JobError> {
        let reader = self.engine.database.reader();
        let page = events(reader, self.job, self.last, PAGE).await?;
        self.behind = page.len() as i64 == PAGE;
        // After its end nothing comes, also to those who have seen the end.
        let query = "SELECT 1 FROM job WHERE sequence = ? AND status IN ('queued', 'running')";
        let query = sqlx::query_scalar::<_, i64>(query).bind(self.job);
        if page.is_empty() && query.fetch_optional(reader).await?.is_none() {
            self.ended = true;
        }
        self.waiting.extend(page.into_iter().map(|event| Arc::new(Told::new(event))));
        Ok(())
    }
}
