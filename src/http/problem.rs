use std::fmt;

use axum::Json;
use axum::http::header::{CONTENT_TYPE, RETRY_AFTER, WWW_AUTHENTICATE};
use axum::http::{HeaderValue, StatusCode};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

/// The media type of problems.
pub const PROBLEM_JSON: &str = "application/problem+json";

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident = $slug:literal, $status:ident, $title:literal;)*) => {
        /// What went wrong, by a name that stays.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Kind {
            $($(#[$doc])* $kind,)*
        }

        impl Kind {
            /// Every kind.
            pub const ALL: &'static [Self] = &[$(Self::$kind,)*];

            /// The end of its `type`.
            pub fn slug(self) -> &'static str {
                match self { $(Self::$kind => $slug,)* }
            }

            /// The status of answers.
            pub fn status(self) -> StatusCode {
                match self { $(Self::$kind => StatusCode::$status,)* }
            }

            /// What it is, the same for all of the kind.
            pub fn title(self) -> &'static str {
                match self { $(Self::$kind => $title,)* }
            }
        }
    };
}

kinds! {
    /// The request itself cannot be understood.
    BadRequest = "bad-request", BAD_REQUEST, "The request cannot be understood";
    /// The body ended early.
    BrokenOff = "broken-off", BAD_REQUEST, "The upload broke off";
    /// No key, or one that is not known.
    Unauthorized = "unauthorized", UNAUTHORIZED, "An API key is needed";
    /// The key does not allow it.
    Forbidden = "forbidden", FORBIDDEN, "The API key does not allow this";
    /// Nothing is there.
    NotFound = "not-found", NOT_FOUND, "There is no such thing";
    /// Not this method.
    MethodNotAllowed = "method-not-allowed", METHOD_NOT_ALLOWED, "The method is not for this path";
    /// Not in this state.
    Conflict = "conflict", CONFLICT, "Not in this state";
    /// The first request with this key is still being worked on.
    IdempotencyUnderWay = "idempotency-key-under-way", CONFLICT, "A request with this Idempotency-Key is under way";
    /// Too large.
    LimitExceeded = "limit-exceeded", PAYLOAD_TOO_LARGE, "More was sent than is taken";
    /// Not a media type that is read.
    UnsupportedMediaType = "unsupported-media-type", UNSUPPORTED_MEDIA_TYPE, "The media type is not one that is read here";
    /// Not a range of the file.
    RangeNotSatisfiable = "range-not-satisfiable", RANGE_NOT_SATISFIABLE, "The range is not within the file";
    /// A field has a value that it cannot have.
    InvalidField = "invalid-field", UNPROCESSABLE_ENTITY, "A field has a value that it cannot have";
    /// A file cannot be understood.
    UnreadableFile = "unreadable-file", UNPROCESSABLE_ENTITY, "A file cannot be used";
    /// The key was used for another request.
    IdempotencyMismatch = "idempotency-key-reused", UNPROCESSABLE_ENTITY, "The Idempotency-Key was used for another request";
    /// Too many requests.
    TooManyRequests = "too-many-requests", TOO_MANY_REQUESTS, "Too many requests";
    /// Too many registrations at once.
    TooManyJobs = "too-many-registrations", TOO_MANY_REQUESTS, "Too many registrations at once";
    /// A stored file is damaged.
    Damaged = "damaged-file", INTERNAL_SERVER_ERROR, "A stored file is damaged";
    /// A fault of ours.
    Internal = "internal-error", INTERNAL_SERVER_ERROR, "The server failed";
    /// Nothing can be kept for now.
    StorageUnavailable = "storage-unavailable", SERVICE_UNAVAILABLE, "Nothing can be kept for now";
    /// Nothing draws pictures.
    NoAdapter = "no-adapter", SERVICE_UNAVAILABLE, "No graphics adapter was found";
    /// The server is about to end.
    ShuttingDown = "shutting-down", SERVICE_UNAVAILABLE, "The server is about to end";
}

/// An answer that says what went wrong, after RFC 9457.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    kind: Kind,
    detail: String,
    field: Option<String>,
    finding: Option<String>,
    remedy: Option<String>,
    retry_after: Option<u64>,
}

/// What went wrong, after RFC 9457.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Problem, example = json!({
    "type": "urn:onemesh:problem:unreadable-file",
    "title": "A file cannot be used",
    "status": 422,
    "detail": "mesh: line 7: vertex 9 is named, but there are 8",
    "field": "mesh",
    "finding": "line 7: vertex 9 is named, but there are 8",
    "remedy": "correct the file, or export it again"
}))]
pub struct ProblemBody {
    /// A name for the kind of problem, which stays: `urn:onemesh:problem:` and what docs/service.md lists.
    #[schema(value_type = String)]
    r#type: String,
    /// What kind it is, in a sentence.
    title: &'static str,
    /// The status of the answer.
    #[schema(minimum = 400, maximum = 599)]
    status: u16,
    /// What was found, in sentences.
    detail: String,
    /// The field of the request that it is about: a part of the body as `scans[2].id`, a parameter or a header.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    field: Option<String>,
    /// What was found there.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    finding: Option<String>,
    /// What to do.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    remedy: Option<String>,
}

impl Problem {
    /// A problem of this kind.
    pub fn new(kind: Kind, detail: impl fmt::Display) -> Self {
        Self { kind, detail: detail.to_string(), field: None, finding: None, remedy: None, retry_after: None }
    }

    /// A field of the request with something wrong: what was found there and what to do.
    pub fn of_field(kind: Kind, field: impl fmt::Display, finding: impl fmt::Display, remedy: &str) -> Self {
        let (field, finding) = (field.to_string(), finding.to_string());
        Self {
            detail: format!("{field}: {finding}"),
            field: Some(field),
            finding: Some(finding),
            ..Self::new(kind, "").remedied(remedy)
        }
    }

    /// There is no such thing.
    pub fn not_found(what: impl fmt::Display) -> Self {
        Self::new(Kind::NotFound, what)
    }

    /// The same, and what to do.
    pub fn remedied(mut self, remedy: &str) -> Self {
        self.remedy = (!remedy.is_empty()).then(|| remedy.to_owned());
        self
    }

    /// The same, worth trying again after so many seconds.
    pub fn retry_after(mut self, seconds: u64) -> Self {
        self.retry_after = Some(seconds);
        self
    }

    /// What kind it is.
    pub fn kind(&self) -> Kind {
        self.kind
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let Self { kind, detail, field, finding, remedy, retry_after } = self;
        let status = kind.status();
        let body = ProblemBody {
            r#type: format!("urn:onemesh:problem:{}", kind.slug()),
            title: kind.title(),
            status: status.as_u16(),
            detail,
            field,
            finding,
            remedy,
        };
        let mut response = (status, Json(body)).into_response();
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static(PROBLEM_JSON));
        if let Some(seconds) = retry_after {
            headers.insert(RETRY_AFTER, seconds.into());
        }
        if status == StatusCode::UNAUTHORIZED {
            headers.insert(WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response
    }
}
