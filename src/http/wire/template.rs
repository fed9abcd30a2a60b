use serde::Serialize;
use utoipa::ToSchema;

use super::rfc3339;
use crate::job::template::StoredTemplate;

/// What results take their triangles from.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Template, example = json!({
    "id": "5e884898da28047151d0e56f8dc62927",
    "name": "studio head",
    "built_in": false,
    "frozen": false,
    "masked": false,
    "vertices": 8210,
    "triangles": 16416,
    "scheme": "multipie68",
    "landmarks": ["0", "1", "2"],
    "created_at": "2026-03-01T12:00:00Z"
}))]
pub struct TemplateView {
    /// What a registration names it by: `default`, or the id of an uploaded one.
    #[schema(pattern = "^(default|[0-9a-f]{32})$")]
    pub id: String,
    /// What people call it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub name: Option<String>,
    /// Whether it comes with the program.
    pub built_in: bool,
    /// Whether it is what a finished collection left: results then share that collection's landmarks and settings.
    pub frozen: bool,
    /// Whether it was uploaded with a mask.
    pub masked: bool,
    /// Number of vertices; of the built-in one, what it has unless `vertices` says otherwise.
    pub vertices: u64,
    /// Number of triangles.
    pub triangles: u64,
    /// The scheme of its landmarks.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub scheme: Option<String>,
    /// The names of its landmarks; the built-in one has those that the scans have in common.
    pub landmarks: Vec<String>,
    /// When it was uploaded.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, format = DateTime)]
    pub created_at: Option<String>,
}

impl TemplateView {
    /// The name of the one that comes with the program.
    pub const DEFAULT: &str = "default";

    /// The one that comes with the program.
    pub fn built_in() -> Self {
        let vertices = super::capabilities::USUAL_VERTICES;
        Self {
            id: Self::DEFAULT.to_owned(),
            name: Some("sphere, from the program's head where landmarks allow".to_owned()),
            built_in: true,
            frozen: false,
            masked: false,
            vertices: vertices as u64,
            triangles: 2 * (vertices as u64 - 2),
            scheme: None,
            landmarks: Vec::new(),
            created_at: None,
        }
    }
}

impl From<StoredTemplate> for TemplateView {
    fn from(template: StoredTemplate) -> Self {
        let figures = template.figures;
        Self {
            id: template.id.to_string(),
            name: template.name,
            built_in: false,
            frozen: figures.frozen,
            masked: template.parts.mask.is_some(),
            vertices: figures.vertices as u64,
            triangles: figures.triangles as u64,
            scheme: figures.scheme,
            landmarks: figures.landmarks,
            created_at: Some(rfc3339(template.created_at)),
        }
    }
}
