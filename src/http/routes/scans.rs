//! `/v1/scans`

use axum::Json;
use axum::extract::{Request, State};
use axum::http::header::LOCATION;
use axum::http::{HeaderName, StatusCode};
use serde::Deserialize;
use utoipa::IntoParams;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::http::app::App;
use crate::http::extract::{Id, QueryOf};
use crate::http::page::{Page, PageQuery};
use crate::http::problem::Problem;
use crate::http::upload::receive;
use crate::http::wire::Binary;
use crate::http::wire::form::ScanForm;
use crate::http::wire::scan::{Name, ScanSummary, ScanView};
use crate::job::scan::{NewScan, Part, ScanId};

pub fn router() -> OpenApiRouter<App> {
    OpenApiRouter::new().routes(routes!(create, list)).routes(routes!(get, delete))
}

/// What is said of an uploaded scan beside its bytes.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct ScanQuery {
    /// What people call it.
    #[param(nullable = false)]
    name: Option<Name>,
}

/// Uploads a scan
///
/// Its mesh as the body, or its files as a form. It is read and looked at before the answer. The same files under the same
/// name again give the same scan, with status 200.
#[utoipa::path(
    post, path = "/v1/scans", operation_id = "create_scan", tag = "scans",
    params(ScanQuery),
    request_body(description = "The mesh, or a form with it.", content(
        (Binary = "model/ply"), (Binary = "model/obj"), (Binary = "model/stl"), (Binary = "model/gltf-binary"),
        (Binary = "model/gltf+json"), (Binary = "application/zip"), (Binary = "application/octet-stream"),
        (ScanForm = "multipart/form-data"),
    )),
    responses(
        (status = 201, description = "It is kept.", body = ScanView, headers(("Location" = String, description = "Its path."))),
        (status = 200, description = "It was there already.", body = ScanView, headers(("Location" = String, description = "Its path."))),
    ),
)]
async fn create(
    State(app): State<App>,
    QueryOf(query): QueryOf<ScanQuery>,
    request: Request,
) -> Result<(StatusCode, [(HeaderName, String); 1], Json<ScanView>), Problem> {
    let parts = [Part::Mesh, Part::Landmarks, Part::Mask, Part::Texture];
    let sent = receive(&app, request, &parts).await?;
    let name = sent.name.or(query.name.map(Into::into));
    let (scan, new) = app.scans.add(NewScan { name, ..sent }).await?;
    let status = if new { StatusCode::CREATED } else { StatusCode::OK };
    Ok((status, [(LOCATION, format!("/v1/scans/{}", scan.id))], Json(scan.try_into()?)))
}

/// Lists scans
///
/// The latest first, without their reports.
#[utoipa::path(
    get, path = "/v1/scans", operation_id = "list_scans", tag = "scans",
    params(PageQuery),
    responses((status = 200, description = "A part of the list.", body = Page<ScanSummary>)),
)]
async fn list(
    State(app): State<App>,
    QueryOf(query): QueryOf<PageQuery>,
) -> Result<Json<Page<ScanSummary>>, Problem> {
    let scans = app.scans.list(query.limit + 1, query.after).await?;
    let rows = scans.into_iter().map(|scan| (scan.sequence, scan.into())).collect();
    Ok(Json(Page::of(query.limit, rows)))
}

/// Tells of a scan
#[utoipa::path(
    get, path = "/v1/scans/{id}", operation_id = "get_scan", tag = "scans",
    params(("id" = String, Path, description = "The scan's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "What is known of it.", body = ScanView)),
)]
async fn get(State(app): State<App>, Id(id): Id<ScanId>) -> Result<Json<ScanView>, Problem> {
    Ok(Json(app.scans.get(&id).await?.try_into()?))
}

/// Deletes a scan
///
/// Registrations that were asked for before are not disturbed.
#[utoipa::path(
    delete, path = "/v1/scans/{id}", operation_id = "delete_scan", tag = "scans",
    params(("id" = String, Path, description = "The scan's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 204, description = "It is gone.")),
)]
async fn delete(State(app): State<App>, Id(id): Id<ScanId>) -> Result<StatusCode, Problem> {
    app.scans.delete(&id).await?;
    Ok(StatusCode::NO_CONTENT)
}
