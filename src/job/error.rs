use super::capture::CaptureFault;
use super::store_error::StoreError;

/// Why something cannot be done with jobs.
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
    /// There is no such job, or file of it.
    #[error("there is no {0}")]
    NotFound(String),
    /// The pictures or cameras of a capture are wrong.
    #[error("capture: {0}")]
    Capture(#[from] CaptureFault),
    /// Nothing can draw.
    #[error("{0}")]
    NoAdapter(String),
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
    #[error(transparent)]
    Store(StoreError),
}

impl JobError {
    pub(super) fn invalid(field: impl Into<String>, problem: impl ToString) -> Self {
        Self::Invalid { field: field.into(), problem: problem.to_string() }
    }
}

impl From<StoreError> for JobError {
    fn from(error: StoreError) -> Self {
        if error.is_full() { Self::Unavailable("the disk is full".to_owned()) } else { Self::Store(error) }
    }
}

impl From<sqlx::Error> for JobError {
    fn from(error: sqlx::Error) -> Self {
        StoreError::from(error).into()
    }
}
