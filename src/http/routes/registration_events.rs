//! `/v1/registrations/{id}/events`

use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::http::app::App;
use crate::http::event_stream::{ServerSentEvent, stream};
use crate::http::extract::Id;
use crate::http::problem::Problem;
use crate::job::registration::RegistrationId;

pub fn router() -> OpenApiRouter<App> {
    OpenApiRouter::new().routes(routes!(events))
}

/// Tells what happens to a registration
///
/// As server-sent events, `status`, `stage`, `progress` and `child`, from the first on or after `Last-Event-ID`; the data of
/// each is an `Event` in JSON. The stream ends after the last.
#[utoipa::path(
    get, path = "/v1/registrations/{id}/events", operation_id = "get_registration_events", tag = "registrations",
    params(
        ("id" = String, Path, description = "The registration's id.", pattern = "^[0-9a-f]{32}$"),
        ("Last-Event-ID" = Option<u64>, Header, description = "The id of the last event that the client has.", minimum = 0, nullable = false),
    ),
    responses((status = 200, description = "Events, each as it happens.", body = ServerSentEvent, content_type = "text/event-stream",
        example = "event: stage\nid: 3\ndata: {\"at\":\"2026-03-01T12:00:01Z\",\"event\":\"stage\",\"stage\":\"fit\"}\n\n")),
)]
async fn events(
    State(app): State<App>,
    Id(id): Id<RegistrationId>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    stream(&app, &id, &headers).await
}
