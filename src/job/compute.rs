use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

use rayon::{ThreadPool, ThreadPoolBuilder};
use tokio::sync::oneshot;

use super::engine::lock;
use crate::pipeline::{Observer, Progress};

/// Most threads that one step computes on.
const WIDEST: usize = 4;

/// The threads that compute; no request waits on them, and they wait for none. A step has some to itself while it runs:
/// on threads that all share, one that waits for a part of its step takes up another step meanwhile, and the first one
/// waits for all of that.
pub(super) struct Compute {
    /// Threads of a step.
    width: usize,
    idle: Arc<Mutex<Vec<Arc<ThreadPool>>>>,
}

/// A step panicked, which is a fault of ours.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Panicked(pub String);

impl Compute {
    /// For so many steps at the same time, as many threads as there are for each.
    ///
    /// # Errors
    /// What the system says if it gives no threads.
    pub fn new(threads: usize) -> std::io::Result<Self> {
        let width = threads.clamp(1, WIDEST);
        let pools = (0..threads.max(1)).map(|_| pool(width)).collect::<Result<_, _>>()?;
        Ok(Self { width, idle: Arc::new(Mutex::new(pools)) })
    }

    /// Does work on threads of its own. Who stops waiting does not stop it, and leaves these threads to it.
    pub async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Panicked> {
        let (send, receive) = oneshot::channel();
        let known = lock(&self.idle).pop();
        let own = known.map_or_else(|| pool(self.width), Ok);
        let own = own.map_err(|error| Panicked(format!("no thread can be started: {error}")))?;
        let (span, idle, returned) = (tracing::Span::current(), self.idle.clone(), own.clone());
        own.spawn(move || {
            let _within = span.entered();
            let result = catch_unwind(AssertUnwindSafe(work)).map_err(|panic| Panicked(message(&*panic)));
            lock(&idle).push(returned);
            // Nobody may wait for it any more.
            let _ = send.send(result);
        });
        receive.await.unwrap_or_else(|_| Err(Panicked("its thread ended".to_owned())))
    }
}

fn pool(threads: usize) -> std::io::Result<Arc<ThreadPool>> {
    let named = ThreadPoolBuilder::new().num_threads(threads).thread_name(|k| format!("compute-{k}"));
    named.build().map(Arc::new).map_err(std::io::Error::other)
}

fn message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "it gave no reason".to_owned())
}

/// Why a step is to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stop {
    /// Its job was canceled or deleted.
    Canceled = 1,
    /// It has taken too long.
    TooSlow = 2,
    /// The program ends.
    Shutdown = 3,
}

/// A step that runs, as both sides see it.
#[derive(Debug, Default)]
pub(super) struct Control {
    /// Its job.
    pub job: i64,
    /// No other runs beside it.
    pub alone: bool,
    stop: AtomicU8,
    fraction: AtomicU32,
}

impl Control {
    pub fn new(job: i64, alone: bool) -> Self {
        Self { job, alone, ..Self::default() }
    }

    /// Asks it to stop; the first reason counts.
    pub fn stop(&self, why: Stop) {
        let _ = self.stop.compare_exchange(0, why as u8, Ordering::Relaxed, Ordering::Relaxed);
    }

    /// Why it is to stop, if it is.
    pub fn stopped(&self) -> Option<Stop> {
        [Stop::Canceled, Stop::TooSlow, Stop::Shutdown]
            .into_iter()
            .find(|why| *why as u8 == self.stop.load(Ordering::Relaxed))
    }

    /// The share of it that is done.
    pub fn fraction(&self) -> f64 {
        f64::from(f32::from_bits(self.fraction.load(Ordering::Relaxed)))
    }
}

impl Observer for Control {
    fn progress(&self, progress: Progress) {
        let share = progress.iteration as f32 / progress.iterations.max(1) as f32;
        self.fraction.store(share.to_bits(), Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        self.stopped().is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_panic_ends_the_step_and_not_the_threads() {
        let compute = Compute::new(1).unwrap();
        assert_eq!(compute.run(|| panic!("no {}", 7)).await, Err::<(), _>(Panicked("no 7".to_owned())));
        assert_eq!(compute.run(|| 7).await, Ok(7));
    }

    #[tokio::test]
    async fn what_does_not_stop_keeps_nobody_else_waiting() {
        let compute = Compute::new(1).unwrap();
        let (end, wait) = std::sync::mpsc::channel::<()>();
        let stuck = compute.run(move || wait.recv().is_ok());
        assert!(tokio::time::timeout(std::time::Duration::from_millis(50), stuck).await.is_err());
        assert_eq!(compute.run(|| 7).await, Ok(7));
        assert_eq!(lock(&compute.idle).len(), 1);
        drop(end);
    }

    #[tokio::test]
    async fn work_has_threads_of_its_own() {
        let compute = Compute::new(2).unwrap();
        let (told, hear) = std::sync::mpsc::channel::<()>();
        // Each waits for the other, on all of its threads.
        let one = compute.run(move || {
            assert_eq!(rayon::current_num_threads(), 2);
            hear.recv().is_ok()
        });
        let other = compute.run(move || told.send(()).is_ok());
        assert_eq!(tokio::join!(one, other), (Ok(true), Ok(true)));
        assert_eq!(lock(&compute.idle).len(), 2);
    }

    #[test]
    fn the_first_reason_to_stop_counts() {
        let control = Control::new(1, false);
        assert_eq!((control.cancelled(), control.stopped()), (false, None));
        control.stop(Stop::TooSlow);
        control.stop(Stop::Canceled);
        assert_eq!((control.cancelled(), control.stopped()), (true, Some(Stop::TooSlow)));
    }
}
