//! A POST that is sent again with the same `Idempotency-Key` gets the answer of the first time.

use std::sync::{Arc, Mutex, PoisonError};

use axum::body::Body;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use http_body_util::BodyExt;
use sha2::Digest;

use super::app::App;
use super::auth::Client;
use super::extract::{media_type, whole};
use super::problem::{Kind, Problem};
use crate::formats::Sha256;
use crate::job::idempotency::{Answer, Known};

const KEY: &str = "idempotency-key";
/// Says that an answer was given before.
const REPLAYED: HeaderName = HeaderName::from_static("idempotency-replayed");
/// Headers that are part of an answer.
const KEPT: [&str; 3] = ["content-type", "location", "preference-applied"];
/// Bytes of an answer at most; none is as long.
const LONGEST_ANSWER: usize = 32 << 20;

/// The request's key, if it has one.
///
/// # Errors
/// [`Kind::BadRequest`] if it is none.
pub fn key_of(headers: &HeaderMap) -> Result<Option<String>, Problem> {
    let Some(value) = headers.get(KEY) else { return Ok(None) };
    let text = value.to_str().unwrap_or_default();
    if (1..=255).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_graphic()) {
        return Ok(Some(text.to_owned()));
    }
    let finding = "is not 1 to 255 printable ASCII characters without spaces";
    Err(Problem::of_field(Kind::BadRequest, "Idempotency-Key", finding, "use a UUID"))
}

/// Answers as before where the key was seen before.
///
/// # Errors
/// A [`Problem`] where the key is no key, was used for another request or is being worked on.
pub async fn replay(State(app): State<App>, request: Request, next: Next) -> Result<Response, Problem> {
    if request.method() != Method::POST {
        return Ok(next.run(request).await);
    }
    let Some(key) = key_of(request.headers())? else { return Ok(next.run(request).await) };
    let client = request.extensions().get::<Client>().cloned().unwrap_or_default();
    let owner = client.key.unwrap_or_default();
    let media_type = media_type(request.headers()).unwrap_or_default();
    let said = format!("{} {} {media_type}", request.method(), request.uri());
    match app.idempotency.begin(&owner, &key, &said).await? {
        Known::New => {
            // A client that hangs up does not stop the work, whose answer it may come back for.
            let work = tokio::spawn(first(app.clone(), owner.clone(), key.clone(), request, next));
            match work.await {
                Ok(answer) => answer,
                Err(_) => {
                    app.idempotency.release(&owner, &key).await?;
                    Err(Problem::new(Kind::Internal, "the request crashed, which is a fault of ours"))
                }
            }
        }
        Known::UnderWay => {
            Err(Problem::new(Kind::IdempotencyUnderWay, format!("key `{key}`")).retry_after(1))
        }
        Known::OtherRequest => Err(mismatch(&key)),
        Known::Answered(answer) => again(request, &key, answer).await,
    }
}

/// Works on a request and keeps the answer if it is a success: what failed may be tried again.
async fn first(
    app: App,
    owner: String,
    key: String,
    request: Request,
    next: Next,
) -> Result<Response, Problem> {
    let (request, body) = hashed(request);
    let (head, answer) = next.run(request).await.into_parts();
    let answer = answer.collect().await.map(|collected| collected.to_bytes());
    let answer = answer.map_err(|error| Problem::new(Kind::Internal, error))?;
    if head.status.is_success() {
        let named =
            |name: &&str| Some(((*name).to_owned(), head.headers.get(*name)?.to_str().ok()?.to_owned()));
        let kept = Answer {
            request_body: body.digest(),
            status: head.status.as_u16(),
            headers: KEPT.iter().filter_map(named).collect(),
            body: answer.to_vec(),
        };
        app.idempotency.finish(&owner, &key, &kept).await?;
    } else {
        app.idempotency.release(&owner, &key).await?;
    }
    Ok(Response::from_parts(head, Body::from(answer)))
}

/// Answers as before, if the body is the same.
async fn again(request: Request, key: &str, answer: Answer) -> Result<Response, Problem> {
    if answer.request_body.is_some() {
        let (request, body) = hashed(request);
        // It is read to the end, a piece at a time, and forgotten.
        let mut pieces = request.into_body().into_data_stream();
        while let Some(piece) = pieces.next().await {
            piece.map_err(|error| Problem::new(Kind::BrokenOff, error))?;
        }
        if body.digest() != answer.request_body {
            return Err(mismatch(key));
        }
    } else {
        // A form's boundary is another each time, so that bytes tell nothing.
        let _ = whole(request.into_body(), LONGEST_ANSWER).await;
    }
    let status = StatusCode::from_u16(answer.status).unwrap_or(StatusCode::OK);
    let mut response = (status, answer.body).into_response();
    for (name, value) in &answer.headers {
        if let (Ok(name), Ok(value)) = (HeaderName::try_from(name), HeaderValue::try_from(value)) {
            response.headers_mut().insert(name, value);
        }
    }
    response.headers_mut().insert(REPLAYED, HeaderValue::from_static("true"));
    Ok(response)
}

fn mismatch(key: &str) -> Problem {
    let finding = format!("`{key}` was used for another request");
    Problem::of_field(
        Kind::IdempotencyMismatch,
        "Idempotency-Key",
        finding,
        "use a new key for a new request",
    )
}

/// What went by of a body.
#[derive(Clone)]
struct Passed(Option<Arc<Mutex<sha2::Sha256>>>);

impl Passed {
    fn digest(&self) -> Option<String> {
        let hasher = self.0.as_ref()?.lock().unwrap_or_else(PoisonError::into_inner).clone();
        Some(Sha256::from(hasher).to_string())
    }
}

/// The request, whose body is hashed while it is read; a form's is not.
fn hashed(request: Request) -> (Request, Passed) {
    if media_type(request.headers()).is_some_and(|found| found == "multipart/form-data") {
        return (request, Passed(None));
    }
    let hasher = Arc::new(Mutex::new(sha2::Sha256::new()));
    let passed = Passed(Some(hasher.clone()));
    let request = request.map(|body| {
        Body::new(body.map_frame(move |frame| {
            if let Some(data) = frame.data_ref() {
                hasher.lock().unwrap_or_else(PoisonError::into_inner).update(data);
            }
            frame
        }))
    });
    (request, passed)
}
