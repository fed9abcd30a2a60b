use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::scan::ScanId;
use super::template::TemplateId;
use crate::pipeline::{MANIFEST, Preset, REPORT, SHEET, TEMPLATE, Verdict};

/// Names a registration; sorts by the time it was asked for.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct RegistrationId(String);

/// Not the name of a registration.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` names no registration: it is 32 hexadecimal digits")]
pub struct BadRegistrationId(String);

impl RegistrationId {
    /// A new one.
    pub fn new() -> Self {
        Self(uuid::Uuid::now_v7().simple().to_string())
    }

    /// Its digits.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl Default for RegistrationId {
    fn default() -> Self {
        Self::new()
    }
}

impl fmt::Display for RegistrationId {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(&self.0)
    }
}

impl FromStr for RegistrationId {
    type Err = BadRegistrationId;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let digit = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
        match text.len() == 32 && text.bytes().all(digit) {
            true => Ok(Self(text.to_owned())),
            false => Err(BadRegistrationId(text.chars().take(64).collect())),
        }
    }
}

/// Which registrations go first; within one, scans take turns between registrations.
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

/// What scans are registered from.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TemplateChoice {
    /// The sphere, or the head that comes with the program.
    #[default]
    Default,
    /// A mesh of the user's, or a frozen collection that was uploaded.
    Stored(TemplateId),
    /// What an earlier registration left.
    Of(RegistrationId),
}

/// A scan to be registered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewMember {
    /// The scan.
    pub scan: ScanId,
    /// What it is called in the results; its own name if it is not said.
    pub name: Option<String>,
}

/// A registration that is asked for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NewRegistration {
    /// What people call it.
    pub name: Option<String>,
    /// The scans, each once.
    pub scans: Vec<NewMember>,
    /// What they are registered from.
    pub template: TemplateChoice,
    /// Where parameters begin; not with a frozen template, which brings its own.
    pub preset: Option<Preset>,
    /// Vertices of the template; not with a template.
    pub vertices: Option<usize>,
    /// Parameters by their dotted names, as `groupwise.rounds`.
    pub parameters: BTreeMap<String, serde_json::Value>,
    /// Weights of landmarks in the mean, by name.
    pub landmark_weights: BTreeMap<String, f64>,
    /// Which goes first.
    pub priority: Priority,
    /// Where the end is told.
    pub webhook: Option<String>,
    /// Whose it is: the API key's id.
    pub owner: Option<String>,
    /// Asked for again with the same key, the registration of the first time is given.
    pub dedupe_key: Option<String>,
}

/// How far a registration, or one of its scans, has come.
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

/// Why a scan or a registration failed: a stable code, what was found and what to do.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Problem {
    /// A name that stays: `unusable_scan`, `crashed`, `too_slow`, `engine`, `storage`, `too_few_landmarks`.
    pub code: String,
    /// What was found and what to do.
    pub detail: String,
}

/// A registration as it stands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Registration {
    /// Its id.
    pub id: RegistrationId,
    /// What people call it.
    pub name: Option<String>,
    /// How far it is.
    pub status: Status,
    /// While it is queued: how many are before it.
    pub queue_position: Option<u64>,
    /// What is done to the scans now.
    pub stage: Option<String>,
    /// Share of the work done, 0 to 1.
    pub progress: f64,
    /// Which goes first.
    pub priority: Priority,
    /// What the scans are registered from.
    pub template: TemplateChoice,
    /// Every parameter that is used.
    pub settings: serde_json::Value,
    /// Where the end is told.
    pub webhook: Option<String>,
    /// Whose it is.
    pub owner: Option<String>,
    /// Why there is no result.
    pub problem: Option<Problem>,
    /// The scans in the order of their names.
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
#[derive(Debug, Clone, PartialEq, Serialize)]
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

/// A file of results; it never changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ResultFile {
    /// The shared triangles on a scan, `meshes/{scan}.glb`.
    Mesh(ScanId),
    /// `manifest.json`.
    Manifest,
    /// `report.json`.
    Report,
    /// `landmarks.json`: the landmarks on every result, and the audit.
    Landmarks,
    /// `template.frozen.glb`.
    Template,
    /// `sheet.png`.
    Sheet,
}

impl ResultFile {
    /// Where it is beneath the registration: `meshes/{scan}.glb`, `manifest.json`, ...
    pub fn path(&self) -> String {
        match self {
            Self::Mesh(scan) => format!("meshes/{scan}.glb"),
            Self::Manifest => MANIFEST.to_owned(),
            Self::Report => REPORT.to_owned(),
            Self::Landmarks => "landmarks.json".to_owned(),
            Self::Template => TEMPLATE.to_owned(),
            Self::Sheet => SHEET.to_owned(),
        }
    }
}
