use serde::{Deserialize, Serialize};

use super::scan::ScanId;
use super::state::{Problem, Status};
use crate::pipeline::Verdict;

/// Something that happened to a job; kept in the database as long as the job is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Counts a job's events from 1.
    pub sequence: u64,
    /// Milliseconds since 1970.
    pub at: i64,
    /// What happened.
    #[serde(flatten)]
    pub kind: EventKind,
}

/// What happened.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum EventKind {
    /// The job's status changed; a final one is the last event.
    Status {
        /// The new one.
        status: Status,
    },
    /// A stage began.
    Stage {
        /// Its name.
        stage: String,
    },
    /// Work moved on.
    Progress {
        /// Share of the job's work done, 0 to 1.
        progress: f64,
        /// The scan that moved, where it was one.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        scan: Option<ScanId>,
        /// What is done to it.
        stage: String,
        /// Share of that stage done on it, 0 to 1.
        stage_progress: f64,
    },
    /// A scan came to its end.
    Child {
        /// The scan.
        scan: ScanId,
        /// How it ended.
        status: Status,
        /// Whether its result can be used.
        verdict: Option<Verdict>,
        /// Why it failed.
        problem: Option<Problem>,
    },
}

impl EventKind {
    /// Its name, as it is serialised under `event`.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Status { .. } => "status",
            Self::Stage { .. } => "stage",
            Self::Progress { .. } => "progress",
            Self::Child { .. } => "child",
        }
    }

    /// Whether no event comes after it.
    pub fn is_last(&self) -> bool {
        matches!(self, Self::Status { status } if status.is_final())
    }
}
