//! `/v1/inverse-renderings`

use std::collections::BTreeMap;

use axum::extract::{Request, State};
use axum::http::header::LOCATION;
use axum::http::{HeaderName, StatusCode};
use axum::response::Response;
use axum::{Extension, Json};
use serde::Deserialize;
use sha2::{Digest, Sha256};
use utoipa::IntoParams;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::http::app::App;
use crate::http::auth::Client;
use crate::http::capture_upload::receive_capture;
use crate::http::extract::{Id, QueryOf};
use crate::http::job_answer::{answer, dedupe_key, standing};
use crate::http::page::{Page, limit, usual};
use crate::http::problem::{Kind, Problem};
use crate::http::webhook::check_address;
use crate::http::wire::Binary;
use crate::http::wire::inverse_rendering::{
    CaptureForm, InversePresetName, InverseRenderingSummary, InverseRenderingView,
};
use crate::http::wire::registration::{PriorityName, StatusName};
use crate::http::wire::scan::{Name, ScanView};
use crate::job::capture::NewCapture;
use crate::job::inverse_rendering::{InverseRenderingId, NewInverseRendering};
use crate::job::jobs::Page as JobPage;
use crate::job::result_file::ResultFile;
use crate::job::scan::{MeshKind, NewScan};

pub fn router() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(create, list))
        .routes(routes!(get, delete))
        .routes(routes!(cancel))
        .routes(routes!(make_scan))
}

/// What is asked for beside the pictures.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct InverseQuery {
    /// What people call it.
    #[param(nullable = false)]
    name: Option<Name>,
    /// Where parameters begin.
    #[param(nullable = false, inline)]
    preset: Option<InversePresetName>,
    /// Vertices of the result: 642, 2562, 10242 or 40962.
    #[param(nullable = false, minimum = 642, maximum = 40962)]
    vertices: Option<usize>,
    /// A JSON object of parameters by their dotted names, as `{"albedo": "vertex", "levels.0.iterations": 200}`.
    #[param(nullable = false, example = "{\"what\": \"silhouette\"}")]
    parameters: Option<String>,
    /// Which goes first.
    #[serde(default)]
    #[param(inline)]
    priority: PriorityName,
    /// An address that is told of the end, by POST, signed as Standard Webhooks are.
    #[param(
        nullable = false,
        pattern = "^https?://",
        max_length = 2000,
        example = "https://pipeline.example/hooks/onemesh"
    )]
    webhook: Option<String>,
}

/// The parameters that a query has as JSON.
fn parameters(text: Option<&str>) -> Result<BTreeMap<String, serde_json::Value>, Problem> {
    serde_json::from_str(text.unwrap_or("{}")).map_err(|error| {
        let remedy = "give a JSON object of parameters by their names";
        Problem::of_field(Kind::InvalidField, "parameters", error, remedy)
    })
}

/// Which inverse renderings to list.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct ListQuery {
    /// At most so many.
    #[serde(default = "usual", deserialize_with = "limit")]
    #[param(minimum = 1, maximum = 200, default = 50)]
    limit: u32,
    /// Only what comes after an earlier page: its `next`.
    #[param(nullable = false, pattern = "^[0-9a-f]{32}$", value_type = Option<String>)]
    after: Option<String>,
    /// Only those that have come so far.
    #[param(nullable = false, inline)]
    status: Option<StatusName>,
}

/// Asks for a mesh from pictures with cameras
///
/// The pictures come as a zip of a folder that nerfstudio, instant-ngp, COLMAP or Metashape has written, or as a form with a
/// field for each file. They are looked at before the answer; the work is done later, as that of a registration. With
/// `Prefer: wait=N` the answer comes after up to N seconds, at most 60, and with status 200 if it has ended by then.
#[utoipa::path(
    post, path = "/v1/inverse-renderings", operation_id = "create_inverse_rendering", tag = "inverse renderings",
    params(
        InverseQuery,
        ("Prefer" = Option<String>, Header, description = "`wait=N` waits up to N seconds for the end.", example = "wait=10", nullable = false),
    ),
    request_body(description = "A zip, or a form.", content((Binary = "application/zip"), (CaptureForm = "multipart/form-data"))),
    responses(
        (status = 202, description = "It is kept and will be worked on.", body = InverseRenderingView, headers(("Location" = String, description = "Its path."))),
        (status = 200, description = "It ended while the client waited.", body = InverseRenderingView, headers(("Location" = String, description = "Its path."))),
    ),
)]
async fn create(
    State(app): State<App>,
    Extension(client): Extension<Client>,
    QueryOf(query): QueryOf<InverseQuery>,
    request: Request,
) -> Result<Response, Problem> {
    if let Some(webhook) = &query.webhook {
        check_address(webhook, &app.config.webhooks)?;
    }
    let parameters = parameters(query.parameters.as_deref())?;
    // Before gigabytes are sent for nothing.
    app.jobs.renderer().await?;
    let (headers, uri) = (request.headers().clone(), request.uri().to_string());
    let capture = receive_capture(&app, request).await?;
    let dedupe_key = dedupe_key(&client, &headers, &digest(&uri, &capture))?;
    let new = NewInverseRendering {
        name: query.name.map(Into::into),
        capture,
        preset: query.preset.map(Into::into),
        vertices: query.vertices,
        parameters,
        priority: query.priority.into(),
        webhook: query.webhook,
        owner: client.key,
        dedupe_key,
    };
    let job = app.jobs.invert(new).await?;
    answer::<_, InverseRenderingView>(&app, &headers, "inverse-renderings", job).await
}

/// What makes a request the same one.
fn digest(uri: &str, capture: &NewCapture) -> String {
    let mut hasher = Sha256::new_with_prefix(uri);
    capture.parts().digests().for_each(|digest| hasher.update(format!("\n{digest}")));
    crate::formats::Sha256::from(hasher).to_string()
}

/// Lists inverse renderings
///
/// The latest first.
#[utoipa::path(
    get, path = "/v1/inverse-renderings", operation_id = "list_inverse_renderings", tag = "inverse renderings",
    params(ListQuery),
    responses((status = 200, description = "A part of the list.", body = Page<InverseRenderingSummary>)),
)]
async fn list(
    State(app): State<App>,
    QueryOf(query): QueryOf<ListQuery>,
) -> Result<Json<Page<InverseRenderingSummary>>, Problem> {
    let before: Result<Option<InverseRenderingId>, _> = query.after.map(|after| after.parse()).transpose();
    let before = before.map_err(|error| {
        Problem::of_field(Kind::BadRequest, "after", error, "give the `next` of an earlier page")
    })?;
    let status = query.status.map(Into::into);
    let page = JobPage { limit: query.limit as usize + 1, before, status, owner: None };
    let rows = app.jobs.list(page).await?;
    let rows = rows.into_iter().map(|job| (job.id.clone(), job.into())).collect();
    Ok(Json(Page::of(query.limit, rows)))
}

/// Tells of an inverse rendering
///
/// How far it is, and where the results are.
#[utoipa::path(
    get, path = "/v1/inverse-renderings/{id}", operation_id = "get_inverse_rendering", tag = "inverse renderings",
    params(("id" = String, Path, description = "The inverse rendering's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "How it stands.", body = InverseRenderingView)),
)]
async fn get(State(app): State<App>, Id(id): Id<InverseRenderingId>) -> Result<Response, Problem> {
    standing::<_, InverseRenderingView>(&app, &id).await
}

/// Stops an inverse rendering
///
/// Within a second; one that has ended stays as it is.
#[utoipa::path(
    post, path = "/v1/inverse-renderings/{id}/cancel", operation_id = "cancel_inverse_rendering", tag = "inverse renderings",
    params(("id" = String, Path, description = "The inverse rendering's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "How it stands.", body = InverseRenderingView)),
)]
async fn cancel(
    State(app): State<App>,
    Id(id): Id<InverseRenderingId>,
) -> Result<Json<InverseRenderingView>, Problem> {
    Ok(Json(app.jobs.cancel(&id).await?.into()))
}

/// Deletes an inverse rendering and its results
///
/// One that is not at its end is stopped. A scan that was made of it stays.
#[utoipa::path(
    delete, path = "/v1/inverse-renderings/{id}", operation_id = "delete_inverse_rendering", tag = "inverse renderings",
    params(("id" = String, Path, description = "The inverse rendering's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 204, description = "It is gone.")),
)]
async fn delete(State(app): State<App>, Id(id): Id<InverseRenderingId>) -> Result<StatusCode, Problem> {
    app.jobs.delete(&id).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Makes a scan of the mesh
///
/// Give it landmarks, and it can be registered. Asked for again it is the same scan, with status 200.
#[utoipa::path(
    post, path = "/v1/inverse-renderings/{id}/scan", operation_id = "create_scan_of_inverse_rendering", tag = "inverse renderings",
    params(("id" = String, Path, description = "The inverse rendering's id.", pattern = "^[0-9a-f]{32}$")),
    responses(
        (status = 201, description = "It is kept.", body = ScanView, headers(("Location" = String, description = "Its path."))),
        (status = 200, description = "It was there already.", body = ScanView, headers(("Location" = String, description = "Its path."))),
    ),
)]
async fn make_scan(
    State(app): State<App>,
    Id(id): Id<InverseRenderingId>,
) -> Result<(StatusCode, [(HeaderName, String); 1], Json<ScanView>), Problem> {
    let name = app.jobs.get(&id).await?.name;
    let mesh = app.jobs.result(&id, &ResultFile::Object).await?;
    // Kept anew, so that it cannot go meanwhile.
    let mesh = app.blobs.put_bytes(app.blobs.read(mesh.digest).await?).await?;
    let scan = NewScan { name, kind: MeshKind::Glb, mesh, landmarks: None, mask: None, texture: None };
    let (scan, new) = app.scans.add(scan).await?;
    let status = if new { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, [(LOCATION, format!("/v1/scans/{}", scan.id))], Json(scan.try_into()?)))
}
