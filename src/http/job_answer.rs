//! What is answered to who asks for a job, of any kind.

use std::fmt::Display;
use std::time::Duration;

use axum::Json;
use axum::http::header::{CONTENT_TYPE, LOCATION};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::response::{IntoResponse, Response};
use serde::Serialize;

use super::app::App;
use super::auth::Client;
use super::blob_answer::BlobAnswer;
use super::idempotency::key_of;
use super::problem::Problem;
use crate::job::result_file::ResultFile;
use crate::job::state::Job;
use crate::job::{JobError, JobId, OfKind};

/// Seconds that a client may ask to wait.
const LONGEST_WAIT: u64 = 60;

/// What a job is known by when it is asked for again, also where the server ended before it answered.
///
/// # Errors
/// [`Kind::BadRequest`](super::problem::Kind::BadRequest) if the key is none.
pub fn dedupe_key(
    client: &Client,
    headers: &HeaderMap,
    request: &dyn Display,
) -> Result<Option<String>, Problem> {
    let owner = client.key.as_deref().unwrap_or_default();
    Ok(key_of(headers)?.map(|key| format!("{owner}/{key}/{request}")))
}

/// Tells of a new job, after waiting for its end as long as the client likes. `resource` is the first part of its path.
///
/// # Errors
/// A [`Problem`].
pub async fn answer<K: OfKind, V: From<Job<K>> + Serialize>(
    app: &App,
    headers: &HeaderMap,
    resource: &str,
    job: Job<K>,
) -> Result<Response, Problem> {
    let id = job.id.clone();
    let preferred = headers.get_all("prefer").iter().filter_map(|value| value.to_str().ok()).find_map(wait);
    let job = match preferred {
        Some(seconds) => {
            // The time may be up, or the server about to end: it is then told as it stands.
            let wait = Duration::from_secs(seconds.min(LONGEST_WAIT));
            tokio::select! {
                ended = tokio::time::timeout(wait, ended(app, &id)) => { let _ = ended; }
                () = app.ending.cancelled() => {}
            }
            app.jobs.get(&id).await?
        }
        None => job,
    };
    let status = if job.status.is_final() { StatusCode::OK } else { StatusCode::ACCEPTED };
    let view = Json(V::from(job));
    let mut response = (status, [(LOCATION, format!("/v1/{resource}/{id}"))], view).into_response();
    if preferred.is_some() {
        response.headers_mut().insert("preference-applied", HeaderValue::from_static("wait"));
    }
    Ok(response)
}

/// Tells how a job stands.
///
/// # Errors
/// A [`Problem`].
pub async fn standing<K: OfKind, V: From<Job<K>> + Serialize>(
    app: &App,
    id: &JobId<K>,
) -> Result<Response, Problem> {
    let job = app.jobs.snapshot(id).await?;
    let words = job.words(|job| serde_json::to_vec(&V::from(job.clone())).unwrap_or_default());
    Ok(([(CONTENT_TYPE, "application/json")], words).into_response())
}

/// Answers with a file that a job left, which never changes.
///
/// # Errors
/// A [`Problem`].
pub async fn give<K: OfKind>(
    app: App,
    id: JobId<K>,
    file: ResultFile,
    media_type: &'static str,
    file_name: &str,
    method: &Method,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let blob = app.jobs.result(&id, &file).await?;
    let answer = BlobAnswer { blob, media_type, file_name, immutable: true };
    answer.respond(&app.blobs, method, headers).await
}

async fn ended<K: OfKind>(app: &App, id: &JobId<K>) -> Result<(), JobError> {
    let mut events = app.jobs.events_after(id, 0).await?;
    while let Some(event) = events.next().await? {
        if event.kind.is_last() {
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
