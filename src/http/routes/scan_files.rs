//! `/v1/scans/{id}/landmarks`, `…/mask`, `…/texture`, `…/mesh`

use axum::Json;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, Method};
use axum::response::Response;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::formats::Sha256;
use crate::http::app::App;
use crate::http::blob_answer::BlobAnswer;
use crate::http::extract::Id;
use crate::http::problem::Problem;
use crate::http::upload::receive_body;
use crate::http::wire::Binary;
use crate::http::wire::scan::ScanView;
use crate::job::StoreError;
use crate::job::blobs::BlobInfo;
use crate::job::scan::{Part, ScanId};

pub fn router() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(get_mesh))
        .routes(routes!(put_landmarks, get_landmarks))
        .routes(routes!(put_mask, get_mask))
        .routes(routes!(put_texture, get_texture))
}

/// Gives a scan its landmarks
///
/// In any form that is read, told from the content; they take the place of those it had.
#[utoipa::path(
    put, path = "/v1/scans/{id}/landmarks", operation_id = "put_scan_landmarks", tag = "scans",
    params(("id" = String, Path, description = "The scan's id.", pattern = "^[0-9a-f]{32}$")),
    request_body(description = "A landmark file.", content(
        (Binary = "application/octet-stream"), (serde_json::Value = "application/json", example = json!({"scheme": "multipie68", "landmarks": {"30": [0.0, 1.5, 11.0], "36": [-4.5, 4.0, 7.5], "45": [4.5, 4.0, 7.5]}})),
        (String = "text/plain"), (Binary = "application/xml"),
    )),
    responses((status = 200, description = "The scan, looked at again.", body = ScanView)),
)]
async fn put_landmarks(
    state: State<App>,
    id: Id<ScanId>,
    request: Request,
) -> Result<Json<ScanView>, Problem> {
    put(state, id, Part::Landmarks, request).await
}

/// Gives a scan its mask
///
/// How much each vertex counts as data: a JSON file or a painted PNG; it takes the place of the one it had.
#[utoipa::path(
    put, path = "/v1/scans/{id}/mask", operation_id = "put_scan_mask", tag = "scans",
    params(("id" = String, Path, description = "The scan's id.", pattern = "^[0-9a-f]{32}$")),
    request_body(description = "A mask file.", content(
        (serde_json::Value = "application/json", example = json!({"spheres": [{"landmark": "30", "radius": 2.0, "weight": 0.0}]})), (Binary = "image/png"), (Binary = "application/octet-stream"),
    )),
    responses((status = 200, description = "The scan, looked at again.", body = ScanView)),
)]
async fn put_mask(state: State<App>, id: Id<ScanId>, request: Request) -> Result<Json<ScanView>, Problem> {
    put(state, id, Part::Mask, request).await
}

/// Gives a scan its texture
///
/// In place of the one it had.
#[utoipa::path(
    put, path = "/v1/scans/{id}/texture", operation_id = "put_scan_texture", tag = "scans",
    params(("id" = String, Path, description = "The scan's id.", pattern = "^[0-9a-f]{32}$")),
    request_body(description = "A picture.", content(
        (Binary = "image/png"), (Binary = "image/jpeg"), (Binary = "application/octet-stream"),
    )),
    responses((status = 200, description = "The scan, looked at again.", body = ScanView)),
)]
async fn put_texture(state: State<App>, id: Id<ScanId>, request: Request) -> Result<Json<ScanView>, Problem> {
    put(state, id, Part::Texture, request).await
}

/// Gives a scan's mesh back, as it was sent
#[utoipa::path(
    get, path = "/v1/scans/{id}/mesh", operation_id = "get_scan_mesh", tag = "scans",
    params(("id" = String, Path, description = "The scan's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "The file.", body = Binary, content_type = "application/octet-stream", headers(("ETag" = String)))),
)]
async fn get_mesh(
    state: State<App>,
    id: Id<ScanId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    file(state, id, Part::Mesh, method, headers).await
}

/// Gives a scan's landmarks back, as they were sent
#[utoipa::path(
    get, path = "/v1/scans/{id}/landmarks", operation_id = "get_scan_landmarks", tag = "scans",
    params(("id" = String, Path, description = "The scan's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "The file.", body = Binary, content_type = "application/octet-stream", headers(("ETag" = String)))),
)]
async fn get_landmarks(
    state: State<App>,
    id: Id<ScanId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    file(state, id, Part::Landmarks, method, headers).await
}

/// Gives a scan's mask back, as it was sent
#[utoipa::path(
    get, path = "/v1/scans/{id}/mask", operation_id = "get_scan_mask", tag = "scans",
    params(("id" = String, Path, description = "The scan's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "The file.", body = Binary, content_type = "application/octet-stream", headers(("ETag" = String)))),
)]
async fn get_mask(
    state: State<App>,
    id: Id<ScanId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    file(state, id, Part::Mask, method, headers).await
}

/// Gives a scan's texture back, as it was sent
#[utoipa::path(
    get, path = "/v1/scans/{id}/texture", operation_id = "get_scan_texture", tag = "scans",
    params(("id" = String, Path, description = "The scan's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "The file.", body = Binary, content_type = "application/octet-stream", headers(("ETag" = String)))),
)]
async fn get_texture(
    state: State<App>,
    id: Id<ScanId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    file(state, id, Part::Texture, method, headers).await
}

async fn put(
    State(app): State<App>,
    Id(id): Id<ScanId>,
    part: Part,
    request: Request,
) -> Result<Json<ScanView>, Problem> {
    app.scans.get(&id).await?;
    let file = receive_body(&app, request.into_body()).await?;
    Ok(Json(app.scans.set(&id, part, file).await?.try_into()?))
}

async fn file(
    State(app): State<App>,
    Id(id): Id<ScanId>,
    part: Part,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let scan = app.scans.get(&id).await?;
    let digest: Option<Sha256> = match part {
        Part::Mesh => Some(scan.parts.mesh),
        Part::Landmarks => scan.parts.landmarks,
        Part::Mask => scan.parts.mask,
        Part::Texture => scan.parts.texture,
    };
    let Some(digest) = digest else {
        return Err(Problem::not_found(format!("scan {id} has no {part}")));
    };
    let size = app.blobs.size(digest).await?.ok_or(StoreError::Missing { digest })?;
    let (file_name, media_type) = match part {
        Part::Mesh => (format!("{id}.{}", scan.parts.kind), "application/octet-stream"),
        part => (format!("{id}.{part}"), "application/octet-stream"),
    };
    let blob = BlobInfo { digest, size };
    let answer = BlobAnswer { blob, media_type, file_name: &file_name, immutable: part == Part::Mesh };
    answer.respond(&app.blobs, &method, &headers).await
}
