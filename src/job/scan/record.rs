use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

use super::id::ScanId;
use crate::formats::Sha256;
use crate::job::store_error::StoreError;

/// Version of the stored record.
pub(super) const RECORD: i64 = 1;

/// What the bytes of an uploaded mesh are, as their sender says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MeshKind {
    /// Wavefront OBJ.
    Obj,
    /// PLY.
    Ply,
    /// STL.
    Stl,
    /// Binary glTF.
    Glb,
    /// glTF as JSON, whose buffers are within it.
    Gltf,
    /// A zip that holds one mesh and what it names.
    Zip,
}

impl MeshKind {
    /// Every kind.
    pub const ALL: [Self; 6] = [Self::Obj, Self::Ply, Self::Stl, Self::Glb, Self::Gltf, Self::Zip];

    /// The end of such files' names.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Obj => "obj",
            Self::Ply => "ply",
            Self::Stl => "stl",
            Self::Glb => "glb",
            Self::Gltf => "gltf",
            Self::Zip => "zip",
        }
    }

    /// The media type of such files.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Obj => "model/obj",
            Self::Ply => "model/ply",
            Self::Stl => "model/stl",
            Self::Glb => "model/gltf-binary",
            Self::Gltf => "model/gltf+json",
            Self::Zip => "application/zip",
        }
    }
}

impl fmt::Display for MeshKind {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(self.extension())
    }
}

/// A scan's files in the store.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct ScanParts {
    /// What the mesh's bytes are.
    pub kind: MeshKind,
    /// The mesh, or the zip that holds it.
    pub mesh: Sha256,
    /// The landmarks' file as it was sent.
    pub landmarks: Option<Sha256>,
    /// The mask's file as it was sent.
    pub mask: Option<Sha256>,
    /// The texture's file as it was sent.
    pub texture: Option<Sha256>,
}

impl ScanParts {
    /// The digests of all of them.
    pub fn digests(&self) -> impl Iterator<Item = Sha256> {
        [Some(self.mesh), self.landmarks, self.mask, self.texture].into_iter().flatten()
    }
}

/// An uploaded scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Its id.
    pub id: ScanId,
    /// Its place in the order of uploads.
    pub sequence: i64,
    /// What people call it.
    pub name: Option<String>,
    /// Its files.
    pub parts: ScanParts,
    /// Bytes of the mesh's file.
    pub size: u64,
    /// The preflight report: [`Inspection`](crate::preflight::Inspection), and the file's `warnings`.
    pub report: Value,
    /// Milliseconds since 1970 when it was uploaded.
    pub created_at: i64,
    /// When it goes.
    pub expires_at: Option<i64>,
}

impl TryFrom<SqliteRow> for Scan {
    type Error = StoreError;

    fn try_from(row: SqliteRow) -> Result<Self, StoreError> {
        let record: i64 = row.try_get("record")?;
        if record != RECORD {
            return Err(broken(format!("it is of version {record}")));
        }
        Ok(Self {
            id: parsed(row.try_get("id")?)?,
            sequence: row.try_get("sequence")?,
            name: row.try_get("name")?,
            parts: ScanParts {
                kind: kind_of(row.try_get("format")?)?,
                mesh: parsed(row.try_get("mesh")?)?,
                landmarks: optional(row.try_get("landmarks")?)?,
                mask: optional(row.try_get("mask")?)?,
                texture: optional(row.try_get("texture")?)?,
            },
            size: u64::try_from(row.try_get::<i64, _>("size")?).map_err(broken)?,
            report: serde_json::from_str(row.try_get("report")?).map_err(broken)?,
            created_at: row.try_get("created_at")?,
            expires_at: row.try_get("expires_at")?,
        })
    }
}

pub(in crate::job) fn kind_of(name: &str) -> Result<MeshKind, StoreError> {
    let known = MeshKind::ALL.into_iter().find(|kind| kind.extension() == name);
    known.ok_or_else(|| broken(format!("no mesh is of kind {name:?}")))
}

fn parsed<T: FromStr<Err: fmt::Display>>(text: &str) -> Result<T, StoreError> {
    text.parse().map_err(broken)
}

fn optional(text: Option<&str>) -> Result<Option<Sha256>, StoreError> {
    text.map(parsed).transpose()
}

fn broken(problem: impl fmt::Display) -> StoreError {
    StoreError::Record { what: "a scan", problem: problem.to_string() }
}
