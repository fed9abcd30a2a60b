//! A job's events as server-sent events.

use std::convert::Infallible;
use std::time::Duration;

use axum::http::HeaderMap;
use axum::response::sse::{Event as ServerEvent, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use utoipa::ToSchema;

use super::app::App;
use super::problem::{Kind, Problem};
use super::wire::registration::EventView;
use crate::job::event::Event;
use crate::job::{JobId, OfKind, Told};

/// How often something is sent when nothing happens, so that nobody on the way hangs up.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// One event of a stream, by its lines.
#[derive(ToSchema)]
#[allow(dead_code, reason = "it describes what `server_event` writes")]
pub struct ServerSentEvent {
    /// The event's number, for `Last-Event-ID`.
    id: String,
    /// `status`, `stage`, `progress` or `child`.
    event: String,
    /// An `Event` in JSON.
    data: String,
}

/// The events after the one that `Last-Event-ID` names, as they happen; ends after the last.
///
/// # Errors
/// A [`Problem`].
pub async fn stream<K: OfKind>(app: &App, id: &JobId<K>, headers: &HeaderMap) -> Result<Response, Problem> {
    let after = match headers.get("last-event-id") {
        None => 0,
        Some(value) => value.to_str().ok().and_then(event_number).ok_or_else(|| {
            let remedy = "give the id of an event, or leave it out for all";
            Problem::of_field(Kind::BadRequest, "Last-Event-ID", "is no event's number", remedy)
        })?,
    };
    let feed = app.jobs.events_after(id, after).await?;
    let ending = app.ending.clone();
    let stream = futures_util::stream::unfold(feed, |mut feed| async move {
        // A client that misses events for a failure comes back with the last that it has.
        let event = feed.next().await.ok().flatten()?;
        Some((Ok::<_, Infallible>(server_event(&event)), feed))
    });
    let stream = stream.take_until(ending.cancelled_owned());
    Ok(Sse::new(stream).keep_alive(KeepAlive::new().interval(KEEP_ALIVE)).into_response())
}

/// Numbers are those that a database holds: whole, not negative, below 2^63.
fn event_number(text: &str) -> Option<u64> {
    text.trim().parse().ok().filter(|&number| i64::try_from(number).is_ok())
}

fn server_event(event: &Told<Event>) -> ServerEvent {
    let (id, name) = (event.sequence.to_string(), event.kind.name());
    let data = event.words(|event| serde_json::to_vec(&EventView::from(event.clone())).unwrap_or_default());
    ServerEvent::default().id(id).event(name).data(String::from_utf8_lossy(&data))
}
