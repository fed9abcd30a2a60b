use std::collections::BTreeMap;

use super::capture::NewCapture;
use super::job_id::{JobId, JobKind, OfKind};
use super::state::{Job, Priority};
use crate::pipeline::InvertPreset;

/// Jobs that make a mesh from pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Inverting;

impl OfKind for Inverting {
    const KIND: JobKind = JobKind::InverseRendering;
}

/// Names an inverse rendering.
pub type InverseRenderingId = JobId<Inverting>;

/// An inverse rendering as it stands.
pub type InverseRendering = Job<Inverting>;

/// An inverse rendering that is asked for.
#[derive(Debug, Default)]
pub struct NewInverseRendering {
    /// What people call it.
    pub name: Option<String>,
    /// The pictures and cameras.
    pub capture: NewCapture,
    /// Where parameters begin.
    pub preset: Option<InvertPreset>,
    /// Vertices of the result.
    pub vertices: Option<usize>,
    /// Parameters by their dotted names, as `levels.0.iterations`.
    pub parameters: BTreeMap<String, serde_json::Value>,
    /// Which goes first.
    pub priority: Priority,
    /// Where the end is told.
    pub webhook: Option<String>,
    /// Whose it is: the API key's id.
    pub owner: Option<String>,
    /// Asked for again with the same key, the job of the first time is given.
    pub dedupe_key: Option<String>,
}
