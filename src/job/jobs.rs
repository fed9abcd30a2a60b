//! The handle through which registrations are asked for and watched.

use tokio::sync::watch;

use super::blobs::BlobInfo;
use super::event::Event;
use super::registration::{NewMember, NewRegistration, Registration, RegistrationId, ResultFile, Status};

/// Registrations: asked for, watched, stopped; cheap to clone.
#[derive(Clone)]
pub struct Jobs {}

/// Why something cannot be done with registrations.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// What was asked for is wrong in itself.
    #[error("{field}: {problem}")]
    Invalid {
        /// The field, as `scans[2]` or `parameters.groupwise.rounds`.
        field: String,
        /// What was found and what to do.
        problem: String,
    },
    /// There is no such registration, or scan in it.
    #[error("there is no {0}")]
    NotFound(String),
    /// Not in this state.
    #[error("{0}")]
    Conflict(String),
    /// Too much at once.
    #[error("{0}")]
    TooMany(String),
    /// No work is taken for now: the disk is full or cannot be written.
    #[error("no work is taken for now: {0}")]
    Unavailable(String),
    /// The store failed.
    #[error("the store failed: {0}")]
    Store(String),
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
    /// Why no work is begun, if none is.
    pub paused: Option<String>,
}

/// The events of one registration, those of the past first.
pub struct EventFeed {}

impl EventFeed {
    /// The next one; `None` after the last that will ever come.
    ///
    /// # Errors
    /// [`JobError::Store`].
    pub async fn next(&mut self) -> Result<Option<Event>, JobError> {
        todo!()
    }
}

impl Jobs {
    /// Takes a registration on: it is kept before this returns.
    ///
    /// # Errors
    /// [`JobError::Invalid`] names the field; [`JobError::Unavailable`] while nothing can be kept.
    pub async fn submit(&self, _new: NewRegistration) -> Result<Registration, JobError> {
        todo!()
    }

    /// A registration of further scans, against the template that a finished one left.
    ///
    /// # Errors
    /// As [`submit`](Self::submit); [`JobError::Conflict`] while the earlier one has no template.
    pub async fn add_scans(
        &self,
        _to: &RegistrationId,
        _scans: Vec<NewMember>,
        _owner: Option<String>,
    ) -> Result<Registration, JobError> {
        todo!()
    }

    /// How it stands.
    ///
    /// # Errors
    /// [`JobError::NotFound`].
    pub async fn get(&self, _id: &RegistrationId) -> Result<Registration, JobError> {
        todo!()
    }

    /// Some of them, the latest first, without their children.
    ///
    /// # Errors
    /// [`JobError::Store`].
    pub async fn list(&self, _page: Page) -> Result<Vec<Registration>, JobError> {
        todo!()
    }

    /// Asks it to stop; it does within a second. One that has ended stays as it is.
    ///
    /// # Errors
    /// [`JobError::NotFound`].
    pub async fn cancel(&self, _id: &RegistrationId) -> Result<Registration, JobError> {
        todo!()
    }

    /// Stops it where it runs, and removes it and its results.
    ///
    /// # Errors
    /// [`JobError::NotFound`].
    pub async fn delete(&self, _id: &RegistrationId) -> Result<(), JobError> {
        todo!()
    }

    /// Its events after a number, 0 for all: those of the past, then those to come.
    ///
    /// # Errors
    /// [`JobError::NotFound`].
    pub async fn events_after(&self, _id: &RegistrationId, _sequence: u64) -> Result<EventFeed, JobError> {
        todo!()
    }

    /// Where a result is kept.
    ///
    /// # Errors
    /// [`JobError::NotFound`] for what is not there; [`JobError::Conflict`] for what is not there yet.
    pub async fn result(&self, _id: &RegistrationId, _file: &ResultFile) -> Result<BlobInfo, JobError> {
        todo!()
    }

    /// Every file of the set with its name, as `set.zip` has them.
    ///
    /// # Errors
    /// As [`result`](Self::result).
    pub async fn set(&self, _id: &RegistrationId) -> Result<Vec<(String, BlobInfo)>, JobError> {
        todo!()
    }

    /// How much there is to do.
    ///
    /// # Errors
    /// [`JobError::Store`].
    pub async fn figures(&self) -> Result<QueueFigures, JobError> {
        todo!()
    }

    /// Counts registrations that came to an end, for those who tell of it.
    pub fn finished(&self) -> watch::Receiver<u64> {
        todo!()
    }
}
