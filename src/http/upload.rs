//! Files as they come in: straight to the store, a piece at a time.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::time::Duration;

use axum::body::Body;
use axum::extract::multipart::Field;
use axum::extract::{FromRequest, Multipart, Request};
use bytes::Bytes;
use futures_util::{Stream, StreamExt, TryStreamExt};

use super::app::App;
use super::extract::{media_type, unsupported};
use super::problem::{Kind, Problem};
use super::wire::scan::Name;
use crate::formats::MeshFormat;
use crate::job::blobs::Kept;
use crate::job::scan::{MeshKind, NewScan, Part};

/// Bytes of a file's beginning that tell what it is.
const BEGINNING: u64 = 4096;
/// Bytes of a name in a form, at most.
const NAME_BYTES: usize = 4096;
/// For bytes that say of themselves what they are.
const ANY: &str = "application/octet-stream";

/// Stores a mesh and what belongs to it: a body that is one file, or a form with one field for each of `parts`.
///
/// # Errors
/// A [`Problem`]; nothing is kept then.
pub async fn receive(app: &App, request: Request, parts: &[Part]) -> Result<NewScan, Problem> {
    check_room(app)?;
    let alone = |kind, mesh| NewScan { name: None, kind, mesh, landmarks: None, mask: None, texture: None };
    match media_type(request.headers()).as_deref() {
        Some("multipart/form-data") => receive_form(app, request, parts).await,
        Some(ANY) => {
            let mesh = receive_body(app, request.into_body()).await?;
            let kind = sniff(app, &mesh, None).await?.ok_or_else(|| unknown_content("body"))?;
            Ok(alone(kind, mesh))
        }
        found => {
            let kind = found.and_then(kind_of).ok_or_else(|| unknown_mesh(found))?;
            Ok(alone(kind, receive_body(app, request.into_body()).await?))
        }
    }
}

/// Stores a body that is one file.
///
/// # Errors
/// A [`Problem`]; nothing is kept then.
pub async fn receive_body(app: &App, body: Body) -> Result<Kept, Problem> {
    receive_file(app, body, app.config.limits.scan.upload_bytes).await
}

/// Stores a body that is one file of at most `limit` bytes.
///
/// # Errors
/// A [`Problem`]; nothing is kept then.
pub async fn receive_file(app: &App, body: Body, limit: u64) -> Result<Kept, Problem> {
    check_room(app)?;
    store(app, "body", pieces(app, body), limit).await
}

/// A form's request, whose pieces have to come in time.
pub fn form_body(app: &App, request: Request) -> Request {
    let (head, body) = request.into_parts();
    let body = Body::from_stream(pieces(app, body).map_err(std::io::Error::other));
    Request::from_parts(head, body)
}

/// Stores a file of at most `limit` bytes that comes as a field or as the body.
///
/// # Errors
/// A [`Problem`]; nothing is kept then.
pub async fn store<E: Display>(
    app: &App,
    field: &str,
    pieces: impl Stream<Item = Result<Bytes, E>>,
    limit: u64,
) -> Result<Kept, Problem> {
    let kept = app.blobs.put(pieces, limit).await?;
    if kept.info.size == 0 {
        return Err(Problem::of_field(Kind::UnreadableFile, field, "is empty", "send the file's bytes"));
    }
    Ok(kept)
}

async fn receive_form(app: &App, request: Request, parts: &[Part]) -> Result<NewScan, Problem> {
    let form = Multipart::from_request(form_body(app, request), app).await;
    let mut form = form.map_err(|error| malformed(error.body_text()))?;
    let (mut name, mut kind, mut files) = (None, None, BTreeMap::new());
    while let Some(field) = form.next_field().await.map_err(|error| malformed(error.body_text()))? {
        let called = field.name().unwrap_or_default().to_owned();
        if called == "name" {
            name = Some(name_of(field).await?);
            continue;
        }
        let Some(part) = parts.iter().find(|part| part.name() == called) else {
            let known: Vec<&str> = parts.iter().map(|part| part.name()).chain(["name"]).collect();
            let remedy = format!("send {}", known.join(", "));
            return Err(Problem::of_field(Kind::InvalidField, called, "is no field of this form", &remedy));
        };
        let said = (field.content_type().map(str::to_ascii_lowercase), field.file_name().map(str::to_owned));
        let kept = store(app, part.name(), field, app.config.limits.scan.upload_bytes).await?;
        if *part == Part::Mesh {
            kind = said.0.as_deref().and_then(kind_of);
            if kind.is_none() {
                kind = sniff(app, &kept, said.1.as_deref()).await?;
            }
        }
        if files.insert(part.name(), kept).is_some() {
            return Err(Problem::of_field(Kind::InvalidField, called, "is there twice", "send it once"));
        }
    }
    let Some(mesh) = files.remove(Part::Mesh.name()) else {
        return Err(Problem::of_field(
            Kind::InvalidField,
            "mesh",
            "is missing",
            "send the mesh's file in it",
        ));
    };
    let kind = kind.ok_or_else(|| unknown_content("mesh"))?;
    let mut file = |part: Part| files.remove(part.name());
    let (landmarks, mask, texture) = (file(Part::Landmarks), file(Part::Mask), file(Part::Texture));
    Ok(NewScan { name, kind, mesh, landmarks, mask, texture })
}

/// A body's pieces, as long as each comes in time.
fn pieces(app: &App, body: Body) -> impl Stream<Item = Result<Bytes, String>> + Send + 'static {
    let patience = Duration::from_secs(app.config.server.body_idle_seconds.max(1));
    futures_util::stream::unfold(Some(body.into_data_stream()), move |stream| async move {
        let mut stream = stream?;
        match tokio::time::timeout(patience, stream.next()).await {
            Ok(Some(Ok(piece))) => Some((Ok(piece), Some(stream))),
            Ok(Some(Err(error))) => Some((Err(error.to_string()), None)),
            Ok(None) => None,
            Err(_) => Some((Err(format!("nothing came for {} seconds", patience.as_secs())), None)),
        }
    })
}

async fn name_of(mut field: Field<'_>) -> Result<String, Problem> {
    let mut bytes = Vec::new();
    while let Some(piece) = field.chunk().await.map_err(|error| malformed(error.body_text()))? {
        bytes.extend_from_slice(&piece);
        if bytes.len() > NAME_BYTES {
            break;
        }
    }
    let name = String::from_utf8(bytes).map_err(|_| "a name is UTF-8").and_then(Name::try_from);
    name.map(String::from)
        .map_err(|error| Problem::of_field(Kind::InvalidField, "name", error, "choose another"))
}

/// Refuses what would fill the disk.
///
/// # Errors
/// [`Kind::StorageUnavailable`].
pub fn check_room(app: &App) -> Result<(), Problem> {
    let (free, keep) = (app.folder.free_bytes()?, app.config.data.keep_free_bytes);
    if free >= keep {
        return Ok(());
    }
    let detail = format!("the server's disk has {free} bytes left, of which {keep} are kept free");
    let remedy = "try again later, or delete what is no longer needed";
    Err(Problem::new(Kind::StorageUnavailable, detail).remedied(remedy).retry_after(60))
}

/// What a mesh's bytes are, by a media type.
fn kind_of(media_type: &str) -> Option<MeshKind> {
    let plain = media_type.split(';').next().unwrap_or_default().trim();
    match plain {
        "application/x-zip-compressed" => Some(MeshKind::Zip),
        "application/sla" | "application/vnd.ms-pki.stl" => Some(MeshKind::Stl),
        _ => MeshKind::ALL.into_iter().find(|kind| kind.media_type() == plain),
    }
}

/// What a mesh's bytes are, by the end of its file's name or by its first bytes.
async fn sniff(app: &App, mesh: &Kept, file_name: Option<&str>) -> Result<Option<MeshKind>, Problem> {
    let extension = file_name.and_then(|name| name.rsplit_once('.')).map(|(_, end)| end.to_ascii_lowercase());
    if let Some(kind) = MeshKind::ALL.into_iter().find(|kind| Some(kind.extension()) == extension.as_deref())
    {
        return Ok(Some(kind));
    }
    let beginning = app.blobs.open_range(mesh.info.digest, Some(0..BEGINNING.min(mesh.info.size))).await?;
    let beginning: Vec<Bytes> = beginning
        .bytes
        .try_collect()
        .await
        .map_err(|error| Problem::from(crate::job::StoreError::from(error)))?;
    let beginning = beginning.concat();
    if beginning.starts_with(b"PK\x03\x04") {
        return Ok(Some(MeshKind::Zip));
    }
    Ok(MeshFormat::sniff(&beginning, mesh.info.size, None).map(|format| match format {
        MeshFormat::Gltf if beginning.starts_with(b"glTF") => MeshKind::Glb,
        MeshFormat::Gltf => MeshKind::Gltf,
        MeshFormat::Obj => MeshKind::Obj,
        MeshFormat::Ply => MeshKind::Ply,
        MeshFormat::Stl => MeshKind::Stl,
    }))
}

fn unknown_mesh(found: Option<&str>) -> Problem {
    let mut known: Vec<&str> = MeshKind::ALL.map(MeshKind::media_type).to_vec();
    known.extend([ANY, "multipart/form-data"]);
    unsupported(found, &known)
}

fn unknown_content(field: &str) -> Problem {
    let remedy = "say what it is by its Content-Type, or by the end of its file name in a form";
    Problem::of_field(Kind::UnreadableFile, field, "is of no format that is known", remedy)
}

fn malformed(error: String) -> Problem {
    Problem::of_field(Kind::BadRequest, "body", error, "send a well-formed multipart/form-data body")
}
