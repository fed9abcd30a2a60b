use serde::{Deserialize, Serialize};

use super::job_id::JobId;
use super::registration::TemplateChoice;
use super::scan::ScanId;
use crate::pipeline::Verdict;

/// Which jobs go first; those of the same priority take turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Priority {
    /// When nothing else is to be done.
    Low,
    /// As most.
    #[default]
    Normal,
    /// Somebody waits for it.
    High,
}

/// How far a job, or one of its scans, has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Nothing has begun.
    Queued,
    /// Work is being done or waits for a free thread.
    Running,
    /// All results are there.
    Succeeded,
    /// Some scans failed; the results of the others are there. Never a scan's.
    PartiallySucceeded,
    /// No result.
    Failed,
    /// Stopped on request.
    Canceled,
}

impl Status {
    /// Its name, as it is serialised.
    pub fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Succeeded => "succeeded",
            Self::PartiallySucceeded => "partially_succeeded",
            Self::Failed => "failed",
            Self::Canceled => "canceled",
        }
    }

    /// Whether it stays so.
    pub fn is_final(self) -> bool {
        !matches!(self, Self::Queued | Self::Running)
    }
}

/// Why a scan or a job failed: a stable code, what was found and what to do.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Problem {
    /// A name that stays: `unusable_scan`, `crashed`, `too_slow`, `engine`, `storage`, `too_few_landmarks`.
    pub code: String,
    /// What was found and what to do.
    pub detail: String,
}

/// A job of a kind as it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Job<K> {
    /// Its id.
    pub id: JobId<K>,
    /// What people call it.
    pub name: Option<String>,
    /// How far it is.
    pub status: Status,
    /// While it is queued: how many are before it.
    pub queue_position: Option<u64>,
    /// What is done now.
    pub stage: Option<String>,
    /// Share of the work done, 0 to 1.
    pub progress: f64,
    /// Which goes first.
    pub priority: Priority,
    /// What a registration's scans are registered from.
    pub template: TemplateChoice,
    /// Every parameter that is used.
    pub settings: serde_json::Value,
    /// Where the end is told.
    pub webhook: Option<String>,
    /// Whose it is.
    pub owner: Option<String>,
    /// Why there is no result.
    pub problem: Option<Problem>,
    /// The scans that are registered, in the order of their names.
    pub children: Vec<Child>,
    /// Milliseconds since 1970 when it was asked for.
    pub created_at: i64,
    /// When work began.
    pub started_at: Option<i64>,
    /// When it ended.
    pub finished_at: Option<i64>,
    /// When it and its results go.
    pub expires_at: Option<i64>,
    /// The number of its latest event.
    pub last_event: u64,
}

/// One scan of a registration.
#[derive(Debug, Clone, PartialEq)]
pub struct Child {
    /// The scan.
    pub scan: ScanId,
    /// What it is called in the results.
    pub name: String,
    /// How far it is.
    pub status: Status,
    /// What is done to it, or was last.
    pub stage: Option<String>,
    /// Share of its work done, 0 to 1.
    pub progress: f64,
    /// Whether its result can be used.
    pub verdict: Option<Verdict>,
    /// Why it failed.
    pub problem: Option<Problem>,
    /// When work on it began.
    pub started_at: Option<i64>,
    /// When it ended.
    pub finished_at: Option<i64>,
}
