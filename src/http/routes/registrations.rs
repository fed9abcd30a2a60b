//! `/v1/registrations`

use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use axum::{Extension, Json};
use serde::Deserialize;
use utoipa::IntoParams;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::http::app::App;
use crate::http::auth::Client;
use crate::http::extract::{Id, JsonBody, QueryOf};
use crate::http::job_answer::{answer, dedupe_key, standing};
use crate::http::page::{Page, limit, usual};
use crate::http::problem::{Kind, Problem};
use crate::http::upload::check_room;
use crate::http::webhook::check_address;
use crate::http::wire::registration::{
    AddedScans, RegistrationRequest, RegistrationSummary, RegistrationView, StatusName,
};
use crate::job::jobs::Page as JobPage;
use crate::job::registration::RegistrationId;

pub fn router() -> OpenApiRouter<App> {
    OpenApiRouter::new()
        .routes(routes!(create, list))
        .routes(routes!(get, delete))
        .routes(routes!(cancel))
        .routes(routes!(add_scans))
}

/// Which registrations to list.
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

/// Asks for a registration
///
/// The work is done later: GET of the path in `Location` tells how far it is, its events tell more. With `Prefer: wait=N` the
/// answer comes after up to N seconds, at most 60, and with status 200 if the registration has ended by then.
#[utoipa::path(
    post, path = "/v1/registrations", operation_id = "create_registration", tag = "registrations",
    params(("Prefer" = Option<String>, Header, description = "`wait=N` waits up to N seconds for the end.", example = "wait=10", nullable = false)),
    request_body = RegistrationRequest,
    responses(
        (status = 202, description = "It is kept and will be worked on.", body = RegistrationView, headers(("Location" = String, description = "Its path."))),
        (status = 200, description = "It ended while the client waited.", body = RegistrationView, headers(("Location" = String, description = "Its path."))),
    ),
)]
async fn create(
    State(app): State<App>,
    Extension(client): Extension<Client>,
    headers: HeaderMap,
    JsonBody { value: request, digest }: JsonBody<RegistrationRequest>,
) -> Result<Response, Problem> {
    check_room(&app)?;
    if let Some(webhook) = &request.webhook {
        check_address(webhook, &app.config.webhooks)?;
    }
    let dedupe_key = dedupe_key(&client, &headers, &digest)?;
    let new = request.into_new(client.key, dedupe_key)?;
    let registration = app.jobs.submit(new).await?;
    answer::<_, RegistrationView>(&app, &headers, "registrations", registration).await
}

/// Lists registrations
///
/// The latest first, without their scans.
#[utoipa::path(
    get, path = "/v1/registrations", operation_id = "list_registrations", tag = "registrations",
    params(ListQuery),
    responses((status = 200, description = "A part of the list.", body = Page<RegistrationSummary>)),
)]
async fn list(
    State(app): State<App>,
    QueryOf(query): QueryOf<ListQuery>,
) -> Result<Json<Page<RegistrationSummary>>, Problem> {
    let before: Result<Option<RegistrationId>, _> = query.after.map(|after| after.parse()).transpose();
    let before = before.map_err(|error| {
        Problem::of_field(Kind::BadRequest, "after", error, "give the `next` of an earlier page")
    })?;
    let status = query.status.map(Into::into);
    let page = JobPage { limit: query.limit as usize + 1, before, status, owner: None };
    let rows = app.jobs.list(page).await?;
    let rows = rows.into_iter().map(|registration| (registration.id.clone(), registration.into())).collect();
    Ok(Json(Page::of(query.limit, rows)))
}

/// Tells of a registration
///
/// How far it is, what becomes of each scan, and where the results are.
#[utoipa::path(
    get, path = "/v1/registrations/{id}", operation_id = "get_registration", tag = "registrations",
    params(("id" = String, Path, description = "The registration's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "How it stands.", body = RegistrationView)),
)]
async fn get(State(app): State<App>, Id(id): Id<RegistrationId>) -> Result<Response, Problem> {
    standing::<_, RegistrationView>(&app, &id).await
}

/// Stops a registration
///
/// Within a second; one that has ended stays as it is.
#[utoipa::path(
    post, path = "/v1/registrations/{id}/cancel", operation_id = "cancel_registration", tag = "registrations",
    params(("id" = String, Path, description = "The registration's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 200, description = "How it stands.", body = RegistrationView)),
)]
async fn cancel(
    State(app): State<App>,
    Id(id): Id<RegistrationId>,
) -> Result<Json<RegistrationView>, Problem> {
    Ok(Json(app.jobs.cancel(&id).await?.into()))
}

/// Deletes a registration and its results
///
/// One that is not at its end is stopped.
#[utoipa::path(
    delete, path = "/v1/registrations/{id}", operation_id = "delete_registration", tag = "registrations",
    params(("id" = String, Path, description = "The registration's id.", pattern = "^[0-9a-f]{32}$")),
    responses((status = 204, description = "It is gone.")),
)]
async fn delete(State(app): State<App>, Id(id): Id<RegistrationId>) -> Result<StatusCode, Problem> {
    app.jobs.delete(&id).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Adds scans to a finished registration
///
/// They are registered from the template that it left, with its landmarks and settings, so that all results share their
/// triangles. What it has stays as it is: the answer is a registration of its own.
#[utoipa::path(
    post, path = "/v1/registrations/{id}/scans", operation_id = "add_scans", tag = "registrations",
    params(
        ("id" = String, Path, description = "The finished registration's id.", pattern = "^[0-9a-f]{32}$"),
        ("Prefer" = Option<String>, Header, description = "`wait=N` waits up to N seconds for the end.", example = "wait=10", nullable = false),
    ),
    request_body = AddedScans,
    responses(
        (status = 202, description = "It is kept and will be worked on.", body = RegistrationView, headers(("Location" = String, description = "Its path."))),
        (status = 200, description = "It ended while the client waited.", body = RegistrationView, headers(("Location" = String, description = "Its path."))),
    ),
)]
async fn add_scans(
    State(app): State<App>,
    Extension(client): Extension<Client>,
    Id(id): Id<RegistrationId>,
    headers: HeaderMap,
    JsonBody { value: added, digest }: JsonBody<AddedScans>,
) -> Result<Response, Problem> {
    check_room(&app)?;
    let dedupe_key = dedupe_key(&client, &headers, &format!("{id}/{digest}"))?;
    let registration = app.jobs.add_scans(&id, added.into_members()?, client.key, dedupe_key).await?;
    answer::<_, RegistrationView>(&app, &headers, "registrations", registration).await
}
