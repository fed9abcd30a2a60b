use std::any::Any;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::engine::lock;

/// How long what was read is told again, where nothing was written meanwhile: steps that run get on without that.
const FRESH: Duration = Duration::from_millis(250);

/// How jobs stand, for a moment, so that a thousand clients who ask at once read the database once.
#[derive(Default)]
pub(super) struct Snapshots(Mutex<Kept>);

#[derive(Default)]
struct Kept {
    /// Counts what was written.
    generation: u64,
    /// What was read of each id, and when.
    jobs: HashMap<String, (Instant, Arc<dyn Any + Send + Sync>)>,
}

/// What had been written when the reading began.
#[derive(Clone, Copy)]
pub(super) struct Generation(u64);

impl Snapshots {
    /// What is known of an id; else the sign to keep by what is read now.
    pub fn get<T: Any + Send + Sync>(&self, id: &str) -> Result<Arc<T>, Generation> {
        let kept = lock(&self.0);
        let known = kept.jobs.get(id).filter(|(since, _)| since.elapsed() < FRESH);
        let known = known.and_then(|(_, job)| job.clone().downcast().ok());
        known.ok_or(Generation(kept.generation))
    }

    /// Keeps what was read, unless something was written since the reading began.
    pub fn keep<T: Any + Send + Sync>(&self, Generation(begun): Generation, id: &str, job: &Arc<T>) {
        let mut kept = lock(&self.0);
        if kept.generation == begun {
            kept.jobs.retain(|_, (since, _)| since.elapsed() < FRESH);
            kept.jobs.insert(id.to_owned(), (Instant::now(), job.clone()));
        }
    }

    /// Forgets all, because something was written.
    pub fn forget(&self) {
        let mut kept = lock(&self.0);
        kept.generation += 1;
        kept.jobs.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn begun(snapshots: &Snapshots) -> Generation {
        snapshots.get::<&str>("job").expect_err("nothing is kept")
    }

    #[test]
    fn what_was_written_meanwhile_is_read_again() {
        let (snapshots, job) = (Snapshots::default(), Arc::new("running"));
        let generation = begun(&snapshots);
        snapshots.keep(generation, "job", &job);
        assert_eq!(snapshots.get("job").ok(), Some(job.clone()));
        snapshots.forget();
        begun(&snapshots);
        snapshots.keep(generation, "job", &job);
        begun(&snapshots);
    }

    #[test]
    fn nothing_is_kept_for_long() {
        let (snapshots, job) = (Snapshots::default(), Arc::new("running"));
        snapshots.keep(begun(&snapshots), "job", &job);
        std::thread::sleep(FRESH);
        begun(&snapshots);
        snapshots.keep(begun(&snapshots), "other", &job);
        assert_eq!(lock(&snapshots.0).jobs.len(), 1);
    }
}
