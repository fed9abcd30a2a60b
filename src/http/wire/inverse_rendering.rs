use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Binary;
use super::registration::{Failure, PriorityName, StatusName};
use super::rfc3339;
use crate::job::inverse_rendering::InverseRendering;
use crate::job::state::Status;
use crate::pipeline::InvertPreset;

/// Pictures with cameras as a form; the fields may be repeated.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[allow(dead_code)]
pub struct CaptureForm {
    /// A zip of the whole folder, in place of the others.
    #[schema(value_type = Binary, nullable = false)]
    capture: Option<Binary>,
    /// The cameras' files under their names: transforms.json, a Metashape XML, or COLMAP's cameras and images, as text or
    /// binary.
    #[schema(value_type = Binary, nullable = false)]
    cameras: Option<Binary>,
    /// The pictures under the names that the cameras' file has.
    #[schema(value_type = Binary, nullable = false)]
    images: Option<Binary>,
    /// The silhouettes, white on black, under the pictures' names; where a picture has an opacity that is its silhouette.
    #[schema(value_type = Binary, nullable = false)]
    masks: Option<Binary>,
}

/// Where an inverse rendering's parameters begin.
#[derive(Debug, Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "kebab-case")]
#[schema(as = InversePreset)]
pub enum InversePresetName {
    /// Ours: coarse to fine.
    Default,
    /// The published method, with the middle of its table.
    Paper,
    /// The published one for its scene of that name, as are the following.
    TShirt,
    /// A monkey's head.
    Suzanne,
    /// A bunny.
    Bunny,
    /// A skull.
    Cranium,
    /// A bent board.
    Plank,
    /// A rubber ring with a duck's head.
    Bob,
}

impl From<InversePresetName> for InvertPreset {
    fn from(name: InversePresetName) -> Self {
        match name {
            InversePresetName::Default => Self::Default,
            InversePresetName::Paper => Self::Paper,
            InversePresetName::TShirt => Self::TShirt,
            InversePresetName::Suzanne => Self::Suzanne,
            InversePresetName::Bunny => Self::Bunny,
            InversePresetName::Cranium => Self::Cranium,
            InversePresetName::Plank => Self::Plank,
            InversePresetName::Bob => Self::Bob,
        }
    }
}

/// An inverse rendering without its settings.
#[derive(Debug, Serialize, ToSchema)]
#[schema(example = json!({
    "id": "0195a1b2c3d47e5f8a6b7c8d9e0f1a2b",
    "name": "vase",
    "status": "running",
    "stage": "invert",
    "progress": 0.4,
    "priority": "normal",
    "created_at": "2026-03-01T12:00:00Z",
    "started_at": "2026-03-01T12:00:01Z"
}))]
pub struct InverseRenderingSummary {
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
    /// What is done now.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    stage: Option<String>,
    /// Share of the work done.
    #[schema(minimum = 0, maximum = 1)]
    progress: f64,
    /// Which goes first.
    priority: PriorityName,
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

/// An inverse rendering.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = InverseRendering)]
pub struct InverseRenderingView {
    #[serde(flatten)]
    summary: InverseRenderingSummary,
    /// Every parameter that is used.
    settings: serde_json::Map<String, serde_json::Value>,
    /// Who is told of the end.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    webhook: Option<String>,
    /// Where its results are, once there are any.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    results: Option<InverseResults>,
}

/// Paths of the results.
#[derive(Debug, Serialize, ToSchema)]
pub struct InverseResults {
    /// The mesh, in the cameras' world.
    mesh: String,
    /// How well it looks like each picture.
    report: String,
    /// The pictures beside those of the mesh.
    sheet: String,
    /// POST makes a scan of the mesh.
    scan: String,
}

impl From<InverseRendering> for InverseRenderingSummary {
    fn from(own: InverseRendering) -> Self {
        Self {
            id: own.id.to_string(),
            name: own.name,
            status: own.status.into(),
            queue_position: own.queue_position,
            stage: own.stage,
            progress: own.progress,
            priority: own.priority.into(),
            problem: own.problem.map(Into::into),
            created_at: rfc3339(own.created_at),
            started_at: own.started_at.map(rfc3339),
            finished_at: own.finished_at.map(rfc3339),
            expires_at: own.expires_at.map(rfc3339),
        }
    }
}

impl From<InverseRendering> for InverseRenderingView {
    fn from(mut own: InverseRendering) -> Self {
        let root = format!("/v1/inverse-renderings/{}", own.id);
        let there = own.status == Status::Succeeded;
        Self {
            settings: match own.settings.take() {
                serde_json::Value::Object(settings) => settings,
                _ => serde_json::Map::new(),
            },
            webhook: own.webhook.take(),
            results: there.then(|| InverseResults {
                mesh: format!("{root}/mesh.glb"),
                report: format!("{root}/report.json"),
                sheet: format!("{root}/sheet.png"),
                scan: format!("{root}/scan"),
            }),
            summary: own.into(),
        }
    }
}
