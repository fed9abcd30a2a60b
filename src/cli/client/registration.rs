use std::collections::BTreeMap;
use std::io::Cursor;

use onemesh::formats::Sha256;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use ureq::SendBody;

use super::failure::Failure;
use super::request::{Client, header_of, json};

/// Registrations with the same request that may have failed or gone before a new one is asked for.
const MOST_BEFORE: usize = 64;

/// What is asked for.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Asked {
    /// What people call it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The scans.
    pub scans: Vec<AskedScan>,
    /// The id of a template.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub template: Option<String>,
    /// Where parameters begin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// Vertices of the built-in template.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertices: Option<usize>,
    /// Other parameters by their dotted names.
    pub parameters: BTreeMap<String, Value>,
    /// How much landmarks count in the template's mean, by name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub landmark_weights: BTreeMap<String, f64>,
}

/// A scan of what is asked for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct AskedScan {
    /// Its id.
    pub id: String,
    /// What it is called in the results.
    pub name: String,
}

/// A scan that the server has.
#[derive(Debug, Deserialize)]
pub struct Scan {
    /// Its id.
    pub id: String,
    /// The digest of its landmarks' file.
    pub landmarks: Option<String>,
    /// The digest of its mask's file.
    pub mask: Option<String>,
    /// What was found in it.
    pub report: Preflight,
}

/// What was found in a scan.
#[derive(Debug, Deserialize)]
pub struct Preflight {
    /// The worst first.
    pub findings: Vec<Finding>,
}

/// One thing that was found.
#[derive(Debug, Deserialize)]
pub struct Finding {
    code: String,
    severity: String,
    found: String,
    advice: String,
}

impl Finding {
    /// Whether it may spoil a registration.
    pub fn warns(&self) -> bool {
        self.severity != "info"
    }
}

impl std::fmt::Display for Finding {
    fn fmt(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Self { code, severity, found, advice } = self;
        write!(out, "{severity}: {code}: {found}; {advice}")
    }
}

/// A registration as it stands.
#[derive(Debug, Clone, Deserialize)]
pub struct Registration {
    /// Its id.
    pub id: String,
    /// How far it is.
    pub status: Status,
    /// While it is queued: how many are before it.
    pub queue_position: Option<u64>,
    /// What is done to the scans.
    pub stage: Option<String>,
    /// Share of the work done.
    pub progress: f64,
    /// Why there is no result.
    pub problem: Option<Reason>,
    /// The scans.
    pub children: Vec<Child>,
}

/// One scan of a registration.
#[derive(Debug, Clone, Deserialize)]
pub struct Child {
    /// What it is called.
    pub name: String,
    /// The path of its result.
    pub mesh: Option<String>,
}

/// Why something failed.
#[derive(Debug, Clone, Deserialize)]
pub struct Reason {
    /// What was found and what to do.
    pub detail: String,
}

/// How far something has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Nothing has begun.
    Queued,
    /// It is worked on.
    Running,
    /// All results are there.
    Succeeded,
    /// Some are.
    PartiallySucceeded,
    /// There is none.
    Failed,
    /// It was stopped.
    Canceled,
}

impl Status {
    /// Whether it stays so.
    pub fn is_final(self) -> bool {
        !matches!(self, Self::Queued | Self::Running)
    }

    /// Whether there are results.
    pub fn has_results(self) -> bool {
        matches!(self, Self::Succeeded | Self::PartiallySucceeded)
    }
}

/// The path of a registration.
pub fn path_of(id: &str) -> String {
    format!("/v1/registrations/{id}")
}

/// Asks for a registration, or finds the one that was asked for in the same words before; says whether it is new.
///
/// One that failed, was stopped or is gone does not count.
///
/// # Errors
/// [`Failure`].
pub fn ask_for(client: &Client, asked: &Asked) -> Result<(Registration, bool), Failure> {
    let body = serde_json::to_vec(asked).map_err(|error| Failure::Odd(error.to_string()))?;
    let digest = Sha256::of(&body);
    for attempt in 0..MOST_BEFORE {
        let key = format!("submit-{digest}-{attempt}");
        let headers = [("content-type", "application/json"), ("idempotency-key", key.as_str())];
        let (answer, replayed) = client.patience.persist(|| {
            let body = SendBody::from_owned_reader(Cursor::new(body.clone()));
            let answer = client.post("/v1/registrations", &headers, body)?;
            let replayed = header_of(&answer, "idempotency-replayed").is_some();
            Ok((json::<Registration>(answer)?, replayed))
        })?;
        // What has just been asked for has not ended.
        let is_new = !replayed && !answer.status.is_final();
        let registration = match client.get_json::<Registration>(&path_of(&answer.id)) {
            Err(failure) if !is_new && failure.status() == Some(404) => continue,
            found => found?,
        };
        let lost = registration.status.is_final() && !registration.status.has_results();
        if is_new || !lost {
            return Ok((registration, is_new));
        }
    }
    Err(Failure::Odd(format!("{MOST_BEFORE} registrations of the same scans and parameters failed before")))
}
