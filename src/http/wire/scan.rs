use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use super::rfc3339;
use crate::job::StoreError;
use crate::job::scan::Scan;

/// An uploaded scan, without its report.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = ScanSummary, example = json!({
    "id": "0a4d55a8d778e5022fab701977c5d840",
    "name": "anna",
    "media_type": "model/ply",
    "size": 3811402,
    "sha256": "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08",
    "landmarks": "2c26b46b68ffc68ff99b453c1d30413413422d706483bfa0f98a5e886266e7ae",
    "created_at": "2026-03-01T12:00:00Z",
    "expires_at": "2026-03-31T12:00:00Z"
}))]
pub struct ScanSummary {
    /// Its id: the same files under the same name have the same.
    #[schema(pattern = "^[0-9a-f]{32}$")]
    pub id: String,
    /// What people call it.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub name: Option<String>,
    /// The media type of its mesh.
    pub media_type: &'static str,
    /// Bytes of the mesh's file.
    pub size: u64,
    /// The SHA-256 of the mesh's file.
    pub sha256: String,
    /// The SHA-256 of its landmarks' file, if it has landmarks.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub landmarks: Option<String>,
    /// The SHA-256 of its mask's file, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub mask: Option<String>,
    /// The SHA-256 of its texture's file, if it has one of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub texture: Option<String>,
    /// When it was uploaded.
    #[schema(format = DateTime)]
    pub created_at: String,
    /// When it will be deleted, if it will.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false, format = DateTime)]
    pub expires_at: Option<String>,
}

/// An uploaded scan and what is known of it.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Scan)]
pub struct ScanView {
    #[serde(flatten)]
    summary: ScanSummary,
    /// What was found when it was looked at.
    report: PreflightReport,
}

/// What is known of a scan before it is registered. Lengths are in scan units; `null` is a length beyond all numbers.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
#[schema(example = json!({
    "findings": [{
        "code": "open_boundary", "severity": "info", "found": "1 rims, the longest of 96 vertices and 42.0000 units",
        "advice": "nothing, if the scan is meant to be open there"
    }],
    "vertices": 20000, "triangles": 39900, "min": [-8.1, -12.0, -9.5], "max": [8.2, 13.1, 10.2], "area": 1641.2,
    "unit": { "unit": "cm", "clear": true, "basis": "landmarks", "length": 6.3 },
    "axes": { "up": [0.0, 1.0, 0.0], "facing": [0.0, 0.0, 1.0], "basis": "landmarks" },
    "component_count": 1, "components": [{ "triangles": 39900, "vertices": 20000, "area": 1641.2 }],
    "boundary_loop_count": 1, "boundary_loops": [{ "vertices": 96, "length": 42.0, "centre": [0.0, -12.0, 0.0] }],
    "non_manifold_edges": 0, "non_manifold_vertices": 0, "degenerate_triangles": 0, "duplicate_triangles": 0,
    "opposed_edges": 0, "unreferenced_vertices": 0, "outward": true,
    "landmarks": { "scheme": "multipie68", "named": 68, "present": 68, "farthest_from_surface": 0.08, "farthest_relative": 0.01 },
    "warnings": []
}))]
pub struct PreflightReport {
    /// What is wrong or worth knowing, the worst first.
    findings: Vec<Finding>,
    /// Number of vertices.
    vertices: u64,
    /// Number of triangles.
    triangles: u64,
    /// The smallest coordinates of the vertices that triangles name.
    min: [f64; 3],
    /// The largest.
    max: [f64; 3],
    /// The surface's area.
    area: Option<f64>,
    /// In which unit it seems to be.
    unit: UnitGuess,
    /// How the face is turned.
    axes: Axes,
    /// How many parts share no vertex.
    component_count: u64,
    /// The largest of them by area, at most 16.
    components: Vec<Component>,
    /// How many rims there are.
    boundary_loop_count: u64,
    /// The longest of them, at most 16.
    boundary_loops: Vec<BoundaryLoop>,
    /// Edges of three and more triangles.
    non_manifold_edges: u64,
    /// Vertices whose triangles are not one fan.
    non_manifold_vertices: u64,
    /// Triangles that name a vertex twice or are flat.
    degenerate_triangles: u64,
    /// Triangles with the corners of one before them.
    duplicate_triangles: u64,
    /// Edges between triangles with opposed normals.
    opposed_edges: u64,
    /// Vertices of no triangle.
    unreferenced_vertices: u64,
    /// Whether the normals point outwards; `null` where the surface has no clear inside.
    outward: Option<bool>,
    /// The landmarks, if the scan has any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    landmarks: Option<LandmarkFigures>,
    /// Parts of the file that are wrong or missing and that the mesh does without.
    warnings: Vec<String>,
}

/// One thing that is worth knowing.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub struct Finding {
    /// A name for it, which stays.
    code: String,
    /// How much it matters.
    #[schema(pattern = "^(info|warning|error)$")]
    severity: String,
    /// What was found.
    found: String,
    /// What to do about it.
    advice: String,
    /// The landmarks that it is about.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false)]
    landmarks: Vec<String>,
}

/// In which unit a scan seems to be.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub struct UnitGuess {
    /// The unit in which the face comes closest to natural size.
    #[schema(pattern = "^(m|cm|mm)$")]
    unit: String,
    /// Whether it is then of natural size.
    clear: bool,
    /// What it is concluded from: `landmarks`, or `extent`, a guess.
    #[schema(pattern = "^(landmarks|extent)$")]
    basis: String,
    /// The length that was looked at: between the eyes, or the box's longest side.
    length: Option<f64>,
}

/// How a face is turned in its scan's space.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub struct Axes {
    /// Unit vector from the chin to the crown; zero if it cannot be told.
    #[serde(deserialize_with = "direction")]
    up: [f64; 3],
    /// Unit vector in which the face looks.
    #[serde(deserialize_with = "direction")]
    facing: [f64; 3],
    /// What it is concluded from: `landmarks`, or `extent`, a guess.
    #[schema(pattern = "^(landmarks|extent)$")]
    basis: String,
}

/// A part of a surface.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub struct Component {
    /// Its triangles.
    triangles: u64,
    /// Its vertices.
    vertices: u64,
    /// Its area.
    area: Option<f64>,
}

/// A rim of a surface.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub struct BoundaryLoop {
    /// Its vertices.
    vertices: u64,
    /// Its length.
    length: Option<f64>,
    /// The mean of its vertices.
    #[serde(deserialize_with = "direction")]
    centre: [f64; 3],
}

/// A scan's landmarks.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
pub struct LandmarkFigures {
    /// The scheme that they state.
    scheme: Option<String>,
    /// How many names there are.
    named: u64,
    /// How many of them have a position.
    present: u64,
    /// The largest distance of a landmark from the surface.
    farthest_from_surface: Option<f64>,
    /// The same, in units of the landmarks' spread.
    farthest_relative: Option<f64>,
}

impl From<Scan> for ScanSummary {
    fn from(scan: Scan) -> Self {
        Self {
            id: scan.id.to_string(),
            name: scan.name,
            media_type: scan.parts.kind.media_type(),
            size: scan.size,
            sha256: scan.parts.mesh.to_string(),
            landmarks: scan.parts.landmarks.map(|digest| digest.to_string()),
            mask: scan.parts.mask.map(|digest| digest.to_string()),
            texture: scan.parts.texture.map(|digest| digest.to_string()),
            created_at: rfc3339(scan.created_at),
            expires_at: scan.expires_at.map(rfc3339),
        }
    }
}

impl TryFrom<Scan> for ScanView {
    type Error = StoreError;

    fn try_from(mut scan: Scan) -> Result<Self, StoreError> {
        let report = serde_json::from_value(scan.report.take());
        let report = report
            .map_err(|error| StoreError::Record { what: "a scan's report", problem: error.to_string() })?;
        Ok(Self { summary: scan.into(), report })
    }
}

/// A name that people give to something: printable and not long.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(try_from = "String")]
#[schema(value_type = String, min_length = 1, max_length = 200, pattern = r"^[^\x00-\x1F\x7F-\x9F]+$", example = "anna")]
pub struct Name(String);

impl From<Name> for String {
    fn from(name: Name) -> Self {
        name.0
    }
}

impl TryFrom<String> for Name {
    type Error = &'static str;

    fn try_from(name: String) -> Result<Self, Self::Error> {
        if (1..=200).contains(&name.chars().count()) && !name.contains(char::is_control) {
            Ok(Self(name))
        } else {
            Err("a name has 1 to 200 characters, none of them a control character")
        }
    }
}

impl FromStr for Name {
    type Err = &'static str;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        name.to_owned().try_into()
    }
}

/// Numbers of which those beyond all bounds were stored as nothing.
fn direction<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 3], D::Error> {
    <[Option<f64>; 3]>::deserialize(deserializer).map(|numbers| numbers.map(Option::unwrap_or_default))
}
