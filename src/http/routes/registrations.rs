//! `/v1/registrations`

use std::fmt::Display;
use std::time::Duration;

use axum::extract::State;
use axum::http::header::LOCATION;
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use serde::Deserialize;
use utoipa::IntoParams;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::http::app::App;
use crate::http::auth::Client;
use crate::http::extract::{Id, JsonBody, QueryOf};
use crate::http::idempotency::key_of;
use crate::http::page::{Page, limit, usual};
use crate::http::problem::{Kind, Problem};
use crate::http::upload::check_room;
use crate::http::webhook::check_address;
use crate::http::wire::registration::{
    AddedScans, RegistrationRequest, RegistrationSummary, RegistrationView, StatusName,
};
use crate::job::JobError;
use crate::job::event::EventKind;
use crate::job::jobs::Page as JobPage;
use crate::job::registration::{Registration, RegistrationId};

/// Seconds that a client may ask to wait.
const LONGEST_WAIT: u64 = 60;

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
    answer(&app, &headers, registration).await
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
async fn get(State(app): State<App>, Id(id): Id<RegistrationId>) -> Result<Json<RegistrationView>, Problem> {
    Ok(Json(app.jobs.get(&id).await?.into()))
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
    answer(&app, &headers, registration).await
}

/// What a registration is known by when it is asked for again, also where the server ended before it answered.
fn dedupe_key(
    client: &Client,
    headers: &HeaderMap,
    request: &dyn Display,
) -> Result<Option<String>, Problem> {
    let owner = client.key.as_deref().unwrap_or_default();
    Ok(key_of(headers)?.map(|key| format!("{owner}/{key}/{request}")))
}

/// Tells of a new registration, after waiting for its end as long as the client likes.
async fn answer(app: &App, headers: &HeaderMap, registration: Registration) -> Result<Response, Problem> {
    let id = registration.id.clone();
    let preferred = headers.get_all("prefer").iter().filter_map(|value| value.to_str().ok()).find_map(wait);
    let registration = match preferred {
        Some(seconds) => {
            // The time may be up, or the server about to end: it is then told as it stands.
            let wait = Duration::from_secs(seconds.min(LONGEST_WAIT));
            tokio::select! {
                ended = tokio::time::timeout(wait, ended(app, &id)) => { let _ = ended; }
                () = app.ending.cancelled() => {}
            }
            app.jobs.get(&id).await?
        }
        None => registration,
    };
    let status = if registration.status.is_final() { StatusCode::OK } else { StatusCode::ACCEPTED };
    let view = Json(RegistrationView::from(registration));
    let mut response = (status, [(LOCATION, format!("/v1/registrations/{id}"))], view).into_response();
    if preferred.is_some() {
        response.headers_mut().insert("preference-applied", HeaderValue::from_static("wait"));
    }
    Ok(response)
}

async fn ended(app: &App, id: &RegistrationId) -> Result<(), JobError> {
    let mut events = app.jobs.events_after(id, 0).await?;
    while let Some(event) = events.next().await? {
        if EventKind::is_last(&event.kind) {
            break;
        }
    }
    Ok(())
}

/// The seconds of `wait=N` in a `Prefer` header.
fn wait(header: &str) -> Option<u64> {
    let wishes = header.split([',', ';']).map(str::trim);
    wishes
        .filter_map(|wish| wish.split_once('='))
        .find(|(name, _)| name.trim() == "wait")?
        .1
        .trim()
        .parse()
        .ok()
}
