//! Uploaded templates: a mesh with landmarks, or what a finished collection left.

use std::fmt;
use std::fs::File;
use std::path::PathBuf;
use std::str::FromStr;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use sha2::Digest;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;

use super::blobs::{Blobs, Kept};
use super::clock::now;
use super::database::Database;
use super::scan::{BadId, MeshKind, ScanFault, ScanFiles, ScanLimits};
use super::scan::{Part, checked_id, digest_id, kind_of};
use super::store_error::StoreError;
use super::sweep::collect_soon;
use crate::formats::{FormatError, Sha256};
use crate::pipeline::{FrozenCollection, FrozenError, LEAST_LANDMARKS, MaskError, Settings, Template};

/// Version of the stored record.
const RECORD: i64 = 1;

/// Names a template by what was uploaded.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct TemplateId(String);

/// A template in the store.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredTemplate {
    /// Its id.
    pub id: TemplateId,
    /// Its place in the order of uploads.
    pub sequence: i64,
    /// What people call it.
    pub name: Option<String>,
    /// Its files.
    pub parts: TemplateParts,
    /// Bytes of the mesh's file.
    pub size: u64,
    /// What is in it.
    pub figures: TemplateFigures,
    /// Milliseconds since 1970 when it was uploaded.
    pub created_at: i64,
}

/// A template's files in the store.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TemplateParts {
    /// What the mesh's bytes are.
    pub kind: MeshKind,
    /// The mesh.
    pub mesh: Sha256,
    /// Its landmarks; a frozen collection holds its own.
    pub landmarks: Option<Sha256>,
    /// Its mask, as its landmarks.
    pub mask: Option<Sha256>,
}

/// What is in a template.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct TemplateFigures {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
    /// The scheme of its landmarks.
    pub scheme: Option<String>,
    /// Their names.
    pub landmarks: Vec<String>,
    /// It is what a finished collection left, and brings its settings.
    pub frozen: bool,
}

/// A template whose files are in the store and that nobody has looked at yet.
#[derive(Debug)]
pub struct NewTemplate {
    /// What people call it.
    pub name: Option<String>,
    /// What the mesh's bytes are.
    pub kind: MeshKind,
    /// The mesh.
    pub mesh: Kept,
    /// Its landmarks.
    pub landmarks: Option<Kept>,
    /// How much each of its vertices takes of the scans' data.
    pub mask: Option<Kept>,
}

/// A template's files: the mesh to be read, the others as bytes.
#[derive(Debug)]
pub struct TemplateFiles {
    kind: MeshKind,
    mesh: File,
    landmarks: Option<Bytes>,
    mask: Option<Bytes>,
}

/// Why a template cannot be kept or found.
#[derive(Debug, thiserror::Error)]
pub enum TemplateError {
    /// A file of it is wrong.
    #[error(transparent)]
    Fault(#[from] ScanFault),
    /// There is none of that id.
    #[error("there is no template {0}")]
    NotFound(TemplateId),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The reader crashed, which is a fault of ours.
    #[error("reading the template crashed; please report it with the file")]
    Crashed,
}

impl From<sqlx::Error> for TemplateError {
    fn from(error: sqlx::Error) -> Self {
        Self::Store(error.into())
    }
}

/// The templates of a data folder; cheap to clone.
#[derive(Debug, Clone)]
pub struct Templates {
    database: Database,
    blobs: Blobs,
    scratch: PathBuf,
    limits: ScanLimits,
}

impl Templates {
    /// The templates of a database and blob store, that may be as large as scans.
    pub fn new(database: Database, blobs: Blobs, scratch: PathBuf, limits: ScanLimits) -> Self {
        Self { database, blobs, scratch, limits }
    }

    /// Reads an uploaded template and keeps it; says whether it is new. The same files under the same name are the same.
    ///
    /// # Errors
    /// [`TemplateError::Fault`] if a file is wrong: nothing is kept then.
    pub async fn add(&self, new: NewTemplate) -> Result<(StoredTemplate, bool), TemplateError> {
        let id = id_of(&new);
        match self.get(&id).await {
            Err(TemplateError::NotFound(_)) => {}
            known => return Ok((known?, false)),
        }
        let parts = parts_of(&new);
        let files = TemplateFiles::fetch(&self.blobs, &parts).await?;
        let (limits, scratch) = (self.limits, self.scratch.clone());
        let work = move || files.read(&limits, &scratch).map(|(template, _)| TemplateFigures::of(&template));
        let figures = tokio::task::spawn_blocking(work).await.map_err(|_| TemplateError::Crashed)??;
        let figures = serde_json::to_string(&figures).unwrap_or_default();
        let insert = "INSERT INTO template (id, record, name, format, mesh, landmarks, mask, size, figures, created_at) \
            VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (id) DO NOTHING";
        let inserted = sqlx::query(insert)
            .bind(&id.0)
            .bind(RECORD)
            .bind(&new.name)
            .bind(parts.kind.extension())
            .bind(parts.mesh.to_string())
            .bind(parts.landmarks.map(|digest| digest.to_string()))
            .bind(parts.mask.map(|digest| digest.to_string()))
            .bind(new.mesh.info.size.cast_signed())
            .bind(figures)
            .bind(now())
            .execute(self.database.writer())
            .await?;
        Ok((self.get(&id).await?, inserted.rows_affected() > 0))
    }

    /// A template.
    ///
    /// # Errors
    /// [`TemplateError::NotFound`].
    pub async fn get(&self, id: &TemplateId) -> Result<StoredTemplate, TemplateError> {
        let query = sqlx::query("SELECT * FROM template WHERE id = ?").bind(&id.0);
        match query.fetch_optional(self.database.reader()).await? {
            Some(row) => Ok(row.try_into()?),
            None => Err(TemplateError::NotFound(id.clone())),
        }
    }

    /// At most `limit` templates, the latest first, all from before `before`, a template's `sequence`.
    ///
    /// # Errors
    /// [`TemplateError::Store`].
    pub async fn list(&self, limit: u32, before: Option<i64>) -> Result<Vec<StoredTemplate>, TemplateError> {
        let query = "SELECT * FROM template WHERE sequence < ? ORDER BY sequence DESC LIMIT ?";
        let query = sqlx::query(query).bind(before.unwrap_or(i64::MAX)).bind(limit);
        let rows = query.fetch_all(self.database.reader()).await?;
        Ok(rows.into_iter().map(StoredTemplate::try_from).collect::<Result<_, _>>()?)
    }

    /// Deletes a template. Registrations that were asked for keep its files as long as they need them.
    ///
    /// # Errors
    /// [`TemplateError::NotFound`].
    pub async fn delete(&self, id: &TemplateId) -> Result<(), TemplateError> {
        let query = sqlx::query("DELETE FROM template WHERE id = ? RETURNING *").bind(&id.0);
        let row = query.fetch_optional(self.database.writer()).await?;
        let row = row.ok_or_else(|| TemplateError::NotFound(id.clone()))?;
        let parts = StoredTemplate::try_from(row)?.parts;
        collect_soon(&self.database, &self.blobs, parts.digests().collect()).await;
        Ok(())
    }
}

impl TemplateParts {
    fn digests(&self) -> impl Iterator<Item = Sha256> {
        [Some(self.mesh), self.landmarks, self.mask].into_iter().flatten()
    }
}

impl TemplateFiles {
    /// The files of a template out of the store.
    ///
    /// # Errors
    /// As [`Blobs::read`].
    pub async fn fetch(blobs: &Blobs, parts: &TemplateParts) -> Result<Self, StoreError> {
        let mut others = [None, None];
        for (other, digest) in others.iter_mut().zip([parts.landmarks, parts.mask]) {
            if let Some(digest) = digest {
                *other = Some(blobs.read(digest).await?);
            }
        }
        let [landmarks, mask] = others;
        Ok(Self { kind: parts.kind, mesh: blobs.open_file(parts.mesh).await?, landmarks, mask })
    }

    /// Reads them, which takes long: not on an async thread. A frozen collection brings its settings. `scratch` is a
    /// folder that a zip is unpacked in.
    ///
    /// # Errors
    /// [`ScanFault`] says which file is wrong, where, and what to do.
    pub fn read(
        self,
        limits: &ScanLimits,
        scratch: &std::path::Path,
    ) -> Result<(Template, Option<Settings>), ScanFault> {
        let Self { kind, mesh, landmarks, mask } = self;
        let files = ScanFiles { kind, mesh, landmarks, mask, texture: None };
        // The limits hold for frozen collections too, before their records are looked at.
        let read = files.read(limits, scratch)?;
        match FrozenCollection::parse(&files.mesh_bytes()?).map_err(frozen_fault)? {
            Some(_) if read.mask.is_some() => {
                let problem = "goes with no frozen collection, which keeps its own: leave it out";
                Err(ScanFault::Unfit { part: Part::Mask, problem: problem.to_owned() })
            }
            Some(FrozenCollection { template, settings }) => Ok((template, Some(settings))),
            None => match &read.landmarks {
                Some(landmarks) if landmarks.present().count() >= LEAST_LANDMARKS => {
                    let template = Template::of_file(&read.file, landmarks);
                    let template = Template { mask: read.mask, ..template };
                    let unfit =
                        |error: MaskError| ScanFault::Unfit { part: Part::Mask, problem: error.to_string() };
                    template.check_mask().map_err(unfit)?;
                    Ok((template, None))
                }
                given => {
                    let found = given.as_ref().map_or(0, |landmarks| landmarks.present().count());
                    let problem = format!(
                        "are {found}; a template needs at least {LEAST_LANDMARKS}, in its own space: send them in the field `landmarks`"
                    );
                    Err(ScanFault::Unfit { part: Part::Landmarks, problem })
                }
            },
        }
    }
}

impl TemplateFigures {
    /// Those of a template.
    pub fn of(template: &Template) -> Self {
        Self {
            vertices: template.positions.len(),
            triangles: template.triangles.len(),
            scheme: template.scheme.clone(),
            landmarks: template.landmarks.keys().cloned().collect(),
            frozen: template.frozen,
        }
    }
}

impl TemplateId {
    /// Its digits.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for TemplateId {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(&self.0)
    }
}

impl FromStr for TemplateId {
    type Err = BadId;

    fn from_str(text: &str) -> Result<Self, BadId> {
        checked_id(text).map(Self)
    }
}

impl TryFrom<SqliteRow> for StoredTemplate {
    type Error = StoreError;

    fn try_from(row: SqliteRow) -> Result<Self, StoreError> {
        let record: i64 = row.try_get("record")?;
        if record != RECORD {
            return Err(broken(format!("it is of version {record}")));
        }
        let digest = |column| {
            let text: Option<&str> = row.try_get(column)?;
            text.map(|text| text.parse().map_err(broken)).transpose()
        };
        Ok(Self {
            id: TemplateId(row.try_get("id")?),
            sequence: row.try_get("sequence")?,
            name: row.try_get("name")?,
            parts: TemplateParts {
                kind: kind_of(row.try_get("format")?)?,
                mesh: row.try_get::<&str, _>("mesh")?.parse().map_err(broken)?,
                landmarks: digest("landmarks")?,
                mask: digest("mask")?,
            },
            size: u64::try_from(row.try_get::<i64, _>("size")?).map_err(broken)?,
            figures: serde_json::from_str(row.try_get("figures")?).map_err(broken)?,
            created_at: row.try_get("created_at")?,
        })
    }
}

fn parts_of(new: &NewTemplate) -> TemplateParts {
    let digest = |kept: &Option<Kept>| kept.as_ref().map(|kept| kept.info.digest);
    let (landmarks, mask) = (digest(&new.landmarks), digest(&new.mask));
    TemplateParts { kind: new.kind, mesh: new.mesh.info.digest, landmarks, mask }
}

fn id_of(new: &NewTemplate) -> TemplateId {
    let mut hasher = sha2::Sha256::new();
    let digest = |kept: &Kept| kept.info.digest.to_string();
    let landmarks = new.landmarks.as_ref().map(digest);
    let name = new.name.as_ref().map(|name| format!("={name}"));
    let parts = [landmarks, name].map(Option::unwrap_or_default);
    hasher.update(format!("template {}\n{}\n{}\n{}", new.kind, new.mesh.info.digest, parts[0], parts[1]));
    if let Some(mask) = &new.mask {
        hasher.update(format!("\nmask {}", digest(mask)));
    }
    TemplateId(digest_id(hasher.into()))
}

fn frozen_fault(error: FrozenError) -> ScanFault {
    match error {
        FrozenError::Mesh(error) => unreadable(error),
        error @ FrozenError::Record(_) => ScanFault::Unfit { part: Part::Mesh, problem: error.to_string() },
    }
}

fn unreadable(error: FormatError) -> ScanFault {
    ScanFault::Unreadable { part: Part::Mesh, error }
}

fn broken(problem: impl fmt::Display) -> StoreError {
    StoreError::Record { what: "a template", problem: problem.to_string() }
}
