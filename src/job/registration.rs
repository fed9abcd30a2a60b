use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::job_id::{JobId, JobKind, OfKind};
use super::scan::ScanId;
use super::state::{Job, Priority};
use super::template::TemplateId;
use crate::pipeline::Preset;

/// Jobs that register scans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Registering;

impl OfKind for Registering {
    const KIND: JobKind = JobKind::Registration;
}

/// Names a registration.
pub type RegistrationId = JobId<Registering>;

/// A registration as it stands.
pub type Registration = Job<Registering>;

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
