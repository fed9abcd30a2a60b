//! `/v1/inverse-renderings/{id}/events`, `…/mesh.glb`, `…/report.json`, `…/sheet.png`

use axum::extract::State;
use axum::http::{HeaderMap, Method};
use axum::response::Response;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::http::app::App;
use crate::http::event_stream::{ServerSentEvent, stream};
use crate::http::extract::Id;
use crate::http::job_answer::give;
use crate::http::problem::Problem;
use crate::http::wire::Binary;
use crate::job::inverse_rendering::InverseRenderingId;
use crate::job::result_file::ResultFile;

pub fn router() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(events))
        .routes(routes!(mesh))
        .routes(routes!(report))
        .routes(routes!(sheet))
}

/// Tells what happens to an inverse rendering
///
/// As server-sent events, `status`, `stage` and `progress`, from the first on or after `Last-Event-ID`; the data of each is
/// an `Event` in JSON. The stream ends after the last.
#[utoipa::path(
    get, path = "/v1/inverse-renderings/{id}/events", operation_id = "get_inverse_rendering_events", tag = "inverse renderings",
    params(
        ("id" = String, Path, description = "The inverse rendering's id.", pattern = "^[0-9a-f]{32}$"),
        ("Last-Event-ID" = Option<u64>, Header, description = "The id of the last event that the client has.", minimum = 0, nullable = false),
    ),
    responses((status = 200, description = "Events, each as it happens.", body = ServerSentEvent, content_type = "text/event-stream",
        example = "event: stage\nid: 3\ndata: {\"at\":\"2026-03-01T12:00:01Z\",\"event\":\"stage\",\"stage\":\"invert\"}\n\n")),
)]
async fn events(
    State(app): State<App>,
    Id(id): Id<InverseRenderingId>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    stream(&app, &id, &headers).await
}

/// Gives the mesh
///
/// In the world of the cameras and its units.
#[utoipa::path(
    get, path = "/v1/inverse-renderings/{id}/mesh.glb", operation_id = "get_inverse_rendering_mesh", tag = "results",
    params(("id" = String, Path, description = "The inverse rendering's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "Binary glTF.", body = Binary, content_type = "model/gltf-binary", headers(("ETag" = String)))),
)]
async fn mesh(
    state: State<App>,
    id: Id<InverseRenderingId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    give(state.0, id.0, ResultFile::Object, "model/gltf-binary", "mesh.glb", &method, &headers).await
}

/// Gives the report
///
/// How well the mesh looks like each picture, which pictures disagree with the rest, what was used and what drew.
#[utoipa::path(
    get, path = "/v1/inverse-renderings/{id}/report.json", operation_id = "get_inverse_rendering_report", tag = "results",
    params(("id" = String, Path, description = "The inverse rendering's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "The report.", body = serde_json::Value, content_type = "application/json", headers(("ETag" = String)),
        example = json!({ "version": "0.1.0", "mae": 0.004, "overlap": 0.997, "views": [] }))),
)]
async fn report(
    state: State<App>,
    id: Id<InverseRenderingId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    give(state.0, id.0, ResultFile::Report, "application/json", "report.json", &method, &headers).await
}

/// Gives the pictures beside those of the mesh
#[utoipa::path(
    get, path = "/v1/inverse-renderings/{id}/sheet.png", operation_id = "get_inverse_rendering_sheet", tag = "results",
    params(("id" = String, Path, description = "The inverse rendering's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "A picture.", body = Binary, content_type = "image/png", headers(("ETag" = String)))),
)]
async fn sheet(
    state: State<App>,
    id: Id<InverseRenderingId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    give(state.0, id.0, ResultFile::Sheet, "image/png", "sheet.png", &method, &headers).await
}
