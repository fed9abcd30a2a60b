//! `/v1/registrations/{id}/events`

use std::convert::Infallible;
use std::time::Duration;

use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::sse::{Event as ServerEvent, KeepAlive, Sse};
use futures_util::{Stream, StreamExt};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::http::app::App;
use crate::http::extract::Id;
use crate::http::problem::{Kind, Problem};
use crate::http::wire::registration::EventView;
use crate::job::event::Event;
use crate::job::registration::RegistrationId;

/// How often something is sent when nothing happens, so that nobody on the way hangs up.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

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
    responses((status = 200, description = "Events, each as it happens.", body = EventView, content_type = "text/event-stream",
        example = "event: stage\nid: 3\ndata: {\"at\":\"2026-03-01T12:00:01Z\",\"event\":\"stage\",\"stage\":\"fit\"}\n\n")),
)]
async fn events(
    State(app): State<App>,
    Id(id): Id<RegistrationId>,
    headers: HeaderMap,
) -> Result<Sse<impl Stream<Item = Result<ServerEvent, Infallible>>>, Problem> {
    let after = match headers.get("last-event-id") {
        None => 0,
        Some(value) => value.to_str().ok().and_then(|text| text.trim().parse().ok()).ok_or_else(|| {
            let remedy = "give the id of an event, or leave it out for all";
            Problem::of_field(Kind::BadRequest, "Last-Event-ID", "is no number", remedy)
        })?,
    };
    let feed = app.jobs.events_after(&id, after).await?;
    let ending = app.ending.clone();
    let stream = futures_util::stream::unfold(feed, |mut feed| async move {
        // A client that misses events for a failure comes back with the last that it has.
        let event = feed.next().await.ok().flatten()?;
        Some((Ok(server_event(event)), feed))
    });
    let stream = stream.take_until(ending.cancelled_owned());
    Ok(Sse::new(stream).keep_alive(KeepAlive::new().interval(KEEP_ALIVE)))
}

fn server_event(event: Event) -> ServerEvent {
    let (id, name) = (event.sequence.to_string(), event.kind.name());
    let data = serde_json::to_string(&EventView::from(event)).unwrap_or_default();
    ServerEvent::default().id(id).event(name).data(data)
}
