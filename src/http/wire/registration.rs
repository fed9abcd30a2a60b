use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::rfc3339;
use super::scan::Name;
use super::template::TemplateView;
use crate::http::problem::{Kind, Problem};
use crate::job::event::Event;
use crate::job::registration::{NewMember, NewRegistration, Registration, TemplateChoice};
use crate::job::state::{Child, Priority, Status};
use crate::pipeline::{Preset, Verdict};

/// Scans to be registered onto one template.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({
    "name": "session 7",
    "scans": [
        { "id": "0a4d55a8d778e5022fab701977c5d840", "name": "anna" },
        { "id": "61be55a8e2f6b4e172338bddf184d6db", "name": "ben" }
    ],
    "preset": "default",
    "parameters": { "groupwise.rounds": 3 },
    "landmark_weights": { "30": 10.0 },
    "priority": "normal"
}))]
pub struct RegistrationRequest {
    /// What people call it.
    #[schema(nullable = false)]
    name: Option<Name>,
    /// The scans, each once and under its own name; all with landmarks.
    #[schema(min_items = 1, max_items = 100_000)]
    scans: Vec<Member>,
    /// What they are registered from: `default`, or the id of an uploaded template.
    #[schema(nullable = false, pattern = "^(default|[0-9a-f]{32})$")]
    template: Option<String>,
    /// Where parameters begin; not with a frozen template, which brings its own.
    #[schema(nullable = false)]
    preset: Option<PresetName>,
    /// Vertices of the built-in template: 642, 2562, 10242 or 40962.
    #[schema(nullable = false, minimum = 642, maximum = 40962)]
    vertices: Option<usize>,
    /// Parameters by their dotted names, as `groupwise.rounds`; GET of a registration shows all.
    #[serde(default)]
    parameters: BTreeMap<String, serde_json::Value>,
    /// How much landmarks count where the template's are averaged, by name; 1 unless said.
    #[serde(default)]
    landmark_weights: BTreeMap<String, f64>,
    /// Which goes first.
    #[serde(default)]
    priority: PriorityName,
    /// An address that is told of the end, by POST, signed as Standard Webhooks are.
    #[schema(
        nullable = false,
        pattern = "^https?://",
        max_length = 2000,
        example = "https://pipeline.example/hooks/onemesh"
    )]
    pub webhook: Option<String>,
}

/// Scans to be added to a finished registration.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(example = json!({ "scans": [{ "id": "61be55a8e2f6b4e172338bddf184d6db", "name": "carla" }] }))]
pub struct AddedScans {
    /// The scans, each once and under its own name.
    #[schema(min_items = 1, max_items = 100_000)]
    scans: Vec<Member>,
}

/// A scan to be registered.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Member {
    /// The scan's id.
    #[schema(pattern = "^[0-9a-f]{32}$")]
    id: String,
    /// What it is called in the results; its own name, or else its id, if it is not said.
    #[schema(nullable = false)]
    name: Option<Name>,
}

/// Where parameters begin.
#[derive(Debug, Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
#[schema(as = Preset)]
pub enum PresetName {
    /// Ours.
    Default,
    /// The published method to the letter.
    Paper,
}

/// Which registrations go first; scans of equal ones take turns.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
#[schema(as = Priority)]
pub enum PriorityName {
    /// When nothing else is to be done.
    Low,
    /// As most.
    #[default]
    Normal,
    /// Somebody waits for it.
    High,
}

/// How far something has come; all but `queued` and `running` stay.
#[derive(Debug, Clone, Copy, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = Status)]
pub enum StatusName {
    /// Nothing has begun.
    Queued,
    /// Work is being done, or waits for a free thread.
    Running,
    /// All results are there.
    Succeeded,
    /// Some scans failed; the results of the others are there.
    PartiallySucceeded,
    /// There is no result.
    Failed,
    /// It was stopped on request.
    Canceled,
}

/// A registration without its scans and settings.
#[derive(Debug, Serialize, ToSchema)]
#[schema(example = json!({
    "id": "0195a1b2c3d47e5f8a6b7c8d9e0f1a2b",
    "name": "session 7",
    "status": "running",
    "stage": "register",
    "progress": 0.4,
    "priority": "normal",
    "template": "default",
    "created_at": "2026-03-01T12:00:00Z",
    "started_at": "2026-03-01T12:00:01Z"
}))]
pub struct RegistrationSummary {
    /// Its id.
    #[schema(pattern = "^[0-9a-f]{32}$")]
    id: String,
    /// What people call it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    name: Option<String>,
    /// How far it is.
    status: StatusName,
    /// While it is queued: how many are before it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    queue_position: Option<u64>,
    /// What is done to the scans now.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    stage: Option<String>,
    /// Share of the work done.
    #[schema(minimum = 0, maximum = 1)]
    progress: f64,
    /// Which goes first.
    priority: PriorityName,
    /// What the scans are registered from: `default`, the id of a template, or `registration:` and an id.
    template: String,
    /// Why there is no result.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    problem: Option<Failure>,
    /// When it was asked for.
    #[schema(format = DateTime)]
    created_at: String,
    /// When work began.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, format = DateTime)]
    started_at: Option<String>,
    /// When it ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, format = DateTime)]
    finished_at: Option<String>,
    /// When it and its results will be deleted, if they will.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, format = DateTime)]
    expires_at: Option<String>,
}

/// A registration.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Registration)]
pub struct RegistrationView {
    #[serde(flatten)]
    summary: RegistrationSummary,
    /// The scans in the order of their names.
    children: Vec<ChildView>,
    /// Every parameter that is used.
    settings: serde_json::Map<String, serde_json::Value>,
    /// Who is told of the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    webhook: Option<String>,
    /// Where its results are, once there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    results: Option<Results>,
}

/// Paths of the results.
#[derive(Debug, Serialize, ToSchema)]
pub struct Results {
    /// What was used for what.
    manifest: String,
    /// How well it went.
    report: String,
    /// The landmarks on every result, and the audit of those that were given.
    landmarks: String,
    /// All of it in one file.
    set: String,
    /// The template with its landmarks, for further scans.
    template: String,
    /// A picture of all results.
    sheet: String,
}

/// One scan of a registration.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Child, example = json!({
    "scan": "0a4d55a8d778e5022fab701977c5d840",
    "name": "anna",
    "status": "succeeded",
    "stage": "package",
    "progress": 1.0,
    "verdict": "pass",
    "mesh": "/v1/registrations/0195a1b2c3d47e5f8a6b7c8d9e0f1a2b/meshes/0a4d55a8d778e5022fab701977c5d840.glb"
}))]
pub struct ChildView {
    /// The scan's id.
    #[schema(pattern = "^[0-9a-f]{32}$")]
    scan: String,
    /// What it is called in the results.
    name: String,
    /// How far it is.
    status: StatusName,
    /// What is done to it, or was last.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    stage: Option<String>,
    /// Share of its work done.
    #[schema(minimum = 0, maximum = 1)]
    progress: f64,
    /// Whether its result can be used.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    verdict: Option<VerdictName>,
    /// Why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    problem: Option<Failure>,
    /// The path of its result, once it is there.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    mesh: Option<String>,
}

/// Whether a result can be used.
#[derive(Debug, Clone, Copy, Serialize, ToSchema)]
#[serde(rename_all = "lowercase")]
#[schema(as = Verdict)]
pub enum VerdictName {
    /// It can.
    Pass,
    /// Somebody should look at it.
    Review,
    /// It cannot.
    Fail,
}

/// Why a scan or a registration failed.
#[derive(Debug, Serialize, ToSchema)]
pub struct Failure {
    /// A name for it, which stays.
    code: String,
    /// What was found and what to do.
    detail: String,
}

/// The data of an event; its name is the event's, its number the event's id.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Event, example = json!({
    "event": "child", "at": "2026-03-01T12:00:09Z",
    "scan": "0a4d55a8d778e5022fab701977c5d840", "status": "succeeded", "verdict": "pass"
}))]
pub struct EventView {
    /// When it happened.
    #[schema(format = DateTime)]
    at: String,
    /// `event` and what comes with it: `status` {status}; `stage` {stage}; `progress` {progress, scan, stage,
    /// stage_progress}; `child` {scan, status, verdict, problem}.
    #[serde(flatten)]
    #[schema(value_type = Object)]
    kind: serde_json::Value,
}

impl RegistrationRequest {
    /// What is asked for, by an owner.
    ///
    /// # Errors
    /// A [`Problem`] that names the field.
    pub fn into_new(
        self,
        owner: Option<String>,
        dedupe_key: Option<String>,
    ) -> Result<NewRegistration, Problem> {
        let template = match self.template.as_deref() {
            None | Some(TemplateView::DEFAULT) => TemplateChoice::Default,
            Some(id) => TemplateChoice::Stored(id.parse().map_err(|error| {
                let remedy = "name one of GET /v1/templates";
                Problem::of_field(Kind::InvalidField, "template", error, remedy)
            })?),
        };
        Ok(NewRegistration {
            name: self.name.map(Into::into),
            scans: members(self.scans)?,
            template,
            preset: self.preset.map(Into::into),
            vertices: self.vertices,
            parameters: self.parameters,
            landmark_weights: self.landmark_weights,
            priority: self.priority.into(),
            webhook: self.webhook,
            owner,
            dedupe_key,
        })
    }
}

impl AddedScans {
    /// The scans.
    ///
    /// # Errors
    /// A [`Problem`] that names the field.
    pub fn into_members(self) -> Result<Vec<NewMember>, Problem> {
        members(self.scans)
    }
}

fn members(scans: Vec<Member>) -> Result<Vec<NewMember>, Problem> {
    let member = |(k, Member { id, name }): (usize, Member)| {
        let scan = id.parse().map_err(|error| {
            let remedy = "name scans by the ids that POST /v1/scans gives";
            Problem::of_field(Kind::InvalidField, format!("scans[{k}].id"), error, remedy)
        })?;
        Ok(NewMember { scan, name: name.map(Into::into) })
    };
    scans.into_iter().enumerate().map(member).collect()
}

impl From<Registration> for RegistrationSummary {
    fn from(own: Registration) -> Self {
        Self {
            id: own.id.to_string(),
            name: own.name,
            status: own.status.into(),
            queue_position: own.queue_position,
            stage: own.stage,
            progress: own.progress,
            priority: own.priority.into(),
            template: match own.template {
                TemplateChoice::Default => TemplateView::DEFAULT.to_owned(),
                TemplateChoice::Stored(id) => id.to_string(),
                TemplateChoice::Of(id) => format!("registration:{id}"),
            },
            problem: own.problem.map(Into::into),
            created_at: rfc3339(own.created_at),
            started_at: own.started_at.map(rfc3339),
            finished_at: own.finished_at.map(rfc3339),
            expires_at: own.expires_at.map(rfc3339),
        }
    }
}

impl From<Registration> for RegistrationView {
    fn from(mut own: Registration) -> Self {
        let there = matches!(own.status, Status::Succeeded | Status::PartiallySucceeded);
        let root = format!("/v1/registrations/{}", own.id);
        let children = std::mem::take(&mut own.children);
        let child = |child: Child| ChildView {
            mesh: (there && child.status == Status::Succeeded)
                .then(|| format!("{root}/meshes/{}.glb", child.scan)),
            scan: child.scan.to_string(),
            name: child.name,
            status: child.status.into(),
            stage: child.stage,
            progress: child.progress,
            verdict: child.verdict.map(Into::into),
            problem: child.problem.map(Into::into),
        };
        Self {
            children: children.into_iter().map(child).collect(),
            settings: match own.settings.take() {
                serde_json::Value::Object(settings) => settings,
                _ => serde_json::Map::new(),
            },
            webhook: own.webhook.take(),
            results: there.then(|| Results {
                manifest: format!("{root}/manifest.json"),
                report: format!("{root}/report.json"),
                landmarks: format!("{root}/landmarks.json"),
                set: format!("{root}/set.zip"),
                template: format!("{root}/template.frozen.glb"),
                sheet: format!("{root}/sheet.png"),
            }),
            summary: own.into(),
        }
    }
}

impl From<Event> for EventView {
    fn from(event: Event) -> Self {
        Self { at: rfc3339(event.at), kind: serde_json::to_value(event.kind).unwrap_or_default() }
    }
}

impl From<crate::job::state::Problem> for Failure {
    fn from(problem: crate::job::state::Problem) -> Self {
        Self { code: problem.code, detail: problem.detail }
    }
}

macro_rules! same {
    ($wire:ident, $domain:ident: $($name:ident),*) => {
        impl From<$wire> for $domain {
            fn from(name: $wire) -> Self {
                match name { $($wire::$name => Self::$name,)* }
            }
        }
        impl From<$domain> for $wire {
            fn from(name: $domain) -> Self {
                match name { $($domain::$name => Self::$name,)* }
            }
        }
    };
}

same!(PresetName, Preset: Default, Paper);
same!(PriorityName, Priority: Low, Normal, High);
same!(StatusName, Status: Queued, Running, Succeeded, PartiallySucceeded, Failed, Canceled);
same!(VerdictName, Verdict: Pass, Review, Fail);
