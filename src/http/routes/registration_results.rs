//! `/v1/registrations/{id}/meshes/…`, `…/manifest.json`, `…/report.json`, `…/landmarks.json`, `…/set.zip`

use axum::body::Body;
use axum::extract::State;
use axum::http::header::{CONTENT_LENGTH, CONTENT_RANGE};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::response::{IntoResponse, Response};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::http::app::App;
use crate::http::blob_answer::{Asked, asked_range, file_headers, is_known, unsatisfiable};
use crate::http::extract::{Id, Ids};
use crate::http::job_answer::give;
use crate::http::problem::{Kind, Problem};
use crate::http::wire::Binary;
use crate::http::zip_stream::ZipStream;
use crate::job::registration::RegistrationId;
use crate::job::result_file::ResultFile;

pub fn router() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(mesh))
        .routes(routes!(manifest))
        .routes(routes!(report))
        .routes(routes!(landmarks))
        .routes(routes!(template))
        .routes(routes!(sheet))
        .routes(routes!(set))
}

/// Gives a scan's result
///
/// The shared triangles on the scan, in the scan's own space and units.
#[utoipa::path(
    get, path = "/v1/registrations/{id}/meshes/{file}", operation_id = "get_mesh", tag = "results",
    params(
        ("id" = String, Path, description = "The registration's id.", pattern = "^[0-9a-f]{32}$"),
        ("file" = String, Path, description = "The scan's id and `.glb`.", pattern = r"^[0-9a-f]{32}\.glb$"),
    ),
    responses((status = 200, description = "Binary glTF.", body = Binary, content_type = "model/gltf-binary", headers(("ETag" = String)))),
)]
async fn mesh(
    State(app): State<App>,
    Ids(id, file): Ids<RegistrationId, String>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let scan = file.strip_suffix(".glb").and_then(|scan| scan.parse().ok());
    let Some(scan) = scan else {
        let detail = "a result's name is its scan's id and `.glb`";
        return Err(Problem::not_found(detail));
    };
    give(app, id, ResultFile::Mesh(scan), "model/gltf-binary", &file, &method, &headers).await
}

/// Gives the manifest
///
/// What was used for what: scans with their digests, settings, template, results with theirs.
#[utoipa::path(
    get, path = "/v1/registrations/{id}/manifest.json", operation_id = "get_manifest", tag = "results",
    params(("id" = String, Path, description = "The registration's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "The manifest.", body = serde_json::Value, content_type = "application/json", headers(("ETag" = String)),
        example = json!({ "record": 1, "program": "onemesh 0.1.0", "scans": [] }))),
)]
async fn manifest(
    state: State<App>,
    id: Id<RegistrationId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    give(state.0, id.0, ResultFile::Manifest, "application/json", "manifest.json", &method, &headers).await
}

/// Gives the report
///
/// How well it went, by scan: the verdict, its reasons and the figures behind it.
#[utoipa::path(
    get, path = "/v1/registrations/{id}/report.json", operation_id = "get_report", tag = "results",
    params(("id" = String, Path, description = "The registration's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "The report.", body = serde_json::Value, content_type = "application/json", headers(("ETag" = String)),
        example = json!({ "record": 1, "program": "onemesh 0.1.0", "scans": [] }))),
)]
async fn report(
    state: State<App>,
    id: Id<RegistrationId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    give(state.0, id.0, ResultFile::Report, "application/json", "report.json", &method, &headers).await
}

/// Gives the landmarks
///
/// Those of the template on every result, and the audit of those that were given.
#[utoipa::path(
    get, path = "/v1/registrations/{id}/landmarks.json", operation_id = "get_landmarks", tag = "results",
    params(("id" = String, Path, description = "The registration's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "The landmarks.", body = serde_json::Value, content_type = "application/json", headers(("ETag" = String)),
        example = json!({ "record": 1, "scheme": "multipie68", "scans": [] }))),
)]
async fn landmarks(
    state: State<App>,
    id: Id<RegistrationId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    give(state.0, id.0, ResultFile::Landmarks, "application/json", "landmarks.json", &method, &headers).await
}

/// Gives the frozen template
///
/// The collection's mean with its landmarks and settings, which POST of /v1/templates takes.
#[utoipa::path(
    get, path = "/v1/registrations/{id}/template.frozen.glb", operation_id = "get_registration_template", tag = "results",
    params(("id" = String, Path, description = "The registration's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "Binary glTF.", body = Binary, content_type = "model/gltf-binary", headers(("ETag" = String)))),
)]
async fn template(
    state: State<App>,
    id: Id<RegistrationId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    give(state.0, id.0, ResultFile::Template, "model/gltf-binary", "template.frozen.glb", &method, &headers)
        .await
}

/// Gives a picture of all results
#[utoipa::path(
    get, path = "/v1/registrations/{id}/sheet.png", operation_id = "get_sheet", tag = "results",
    params(("id" = String, Path, description = "The registration's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "A picture.", body = Binary, content_type = "image/png", headers(("ETag" = String)))),
)]
async fn sheet(
    state: State<App>,
    id: Id<RegistrationId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    give(state.0, id.0, ResultFile::Sheet, "image/png", "sheet.png", &method, &headers).await
}

/// Gives all of it in one file
///
/// A zip of every file, made while it is sent, and the same every time.
#[utoipa::path(
    get, path = "/v1/registrations/{id}/set.zip", operation_id = "get_set", tag = "results",
    params(("id" = String, Path, description = "The registration's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "A zip.", body = Binary, content_type = "application/zip", headers(("ETag" = String)))),
)]
async fn set(
    State(app): State<App>,
    Id(id): Id<RegistrationId>,
    method: Method,
    request: HeaderMap,
) -> Result<Response, Problem> {
    let Some(zip) = ZipStream::new(app.jobs.set(&id).await?) else {
        let detail = "the set has more than 4 GB, which a zip does not hold: download its files one by one";
        return Err(Problem::new(Kind::Conflict, detail));
    };
    let (tag, size) = (zip.tag(), zip.size());
    let mut headers = file_headers("application/zip", &format!("{id}.zip"), &tag);
    if is_known(&request, &tag) {
        return Ok((StatusCode::NOT_MODIFIED, headers).into_response());
    }
    let (status, range) = match asked_range(&request, &tag, size) {
        Asked::Whole => (StatusCode::OK, 0..size),
        Asked::Part(range) => (StatusCode::PARTIAL_CONTENT, range),
        Asked::Nothing => return Err(unsatisfiable(size)),
    };
    headers.insert(CONTENT_LENGTH, (range.end - range.start).into());
    if status == StatusCode::PARTIAL_CONTENT {
        let text = format!("bytes {}-{}/{size}", range.start, range.end - 1);
        headers.insert(CONTENT_RANGE, HeaderValue::try_from(text).unwrap_or(HeaderValue::from_static("_")));
    }
    let body = match method {
        Method::HEAD => Body::empty(),
        _ => Body::from_stream(zip.bytes(app.blobs.clone(), range)),
    };
    Ok((status, headers, body).into_response())
}
