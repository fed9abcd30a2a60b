//! Bodies, paths and queries, refused with problems where they are wrong.

use std::fmt::Display;
use std::str::FromStr;

use axum::body::Body;
use axum::extract::{FromRequest, FromRequestParts, RawPathParams, Request};
use axum::http::header::CONTENT_TYPE;
use axum::http::request::Parts;
use http_body_util::{BodyExt, LengthLimitError, Limited};
use serde::de::DeserializeOwned;

use super::problem::{Kind, Problem};
use crate::formats::Sha256;

/// Bytes of a JSON body at most; ten thousand scans fit in.
const JSON_BYTES: usize = 4 << 20;

/// A JSON body.
pub struct JsonBody<T> {
    /// What it says.
    pub value: T,
    /// The digest of its bytes.
    pub digest: Sha256,
}

/// The query's parameters.
pub struct QueryOf<T>(pub T);

/// The path's one parameter, or its first; one that cannot be is not found.
pub struct Id<T>(pub T);

/// The path's two parameters.
pub struct Ids<T, U>(pub T, pub U);

impl<T: DeserializeOwned, S: Send + Sync> FromRequest<S> for JsonBody<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, _: &S) -> Result<Self, Problem> {
        let content_type = media_type(request.headers());
        if content_type.as_deref() != Some("application/json") {
            return Err(unsupported(content_type.as_deref(), &["application/json"]));
        }
        let bytes = whole(request.into_body(), JSON_BYTES).await?;
        let mut reader = serde_json::Deserializer::from_slice(&bytes);
        let value = serde_path_to_error::deserialize(&mut reader).map_err(|error| {
            let (path, inner) = (error.path().to_string(), error.inner());
            match inner.classify() {
                serde_json::error::Category::Data => {
                    let field = if path == "." { "body".to_owned() } else { path };
                    Problem::of_field(Kind::InvalidField, field, inner, "see /docs for the request's schema")
                }
                _ => Problem::of_field(Kind::BadRequest, "body", inner, "send well-formed JSON"),
            }
        })?;
        reader
            .end()
            .map_err(|error| Problem::of_field(Kind::BadRequest, "body", error, "send one JSON value"))?;
        Ok(Self { value, digest: Sha256::of(&bytes) })
    }
}

impl<T: DeserializeOwned, S: Send + Sync> FromRequestParts<S> for QueryOf<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        let query = parts.uri.query().unwrap_or_default();
        let reader = serde_urlencoded::Deserializer::new(form_urlencoded::parse(query.as_bytes()));
        serde_path_to_error::deserialize(reader).map(Self).map_err(|error| {
            let (path, inner) = (error.path().to_string(), error.inner());
            let field = if path == "." { "query".to_owned() } else { path };
            Problem::of_field(Kind::BadRequest, field, inner, "see /docs for the parameters")
        })
    }
}

impl<T: FromStr<Err: Display>, S: Send + Sync> FromRequestParts<S> for Id<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let params = path(parts, state).await?;
        Ok(Self(param(&params, 0)?))
    }
}

impl<T: FromStr<Err: Display>, U: FromStr<Err: Display>, S: Send + Sync> FromRequestParts<S> for Ids<T, U> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let params = path(parts, state).await?;
        Ok(Self(param(&params, 0)?, param(&params, 1)?))
    }
}

async fn path<S: Send + Sync>(parts: &mut Parts, state: &S) -> Result<Vec<String>, Problem> {
    let params = RawPathParams::from_request_parts(parts, state).await;
    let params = params.map_err(|error| Problem::not_found(format!("the path cannot be read: {error}")))?;
    Ok(params.iter().map(|(_, value)| value.to_owned()).collect())
}

fn param<T: FromStr<Err: Display>>(params: &[String], at: usize) -> Result<T, Problem> {
    params.get(at).map_or("", String::as_str).parse().map_err(Problem::not_found)
}

/// All of a body, if it is no longer than `limit` bytes.
pub async fn whole(body: Body, limit: usize) -> Result<bytes::Bytes, Problem> {
    match Limited::new(body, limit).collect().await {
        Ok(collected) => Ok(collected.to_bytes()),
        Err(error) if error.is::<LengthLimitError>() => {
            let finding = format!("is longer than {limit} bytes");
            Err(Problem::of_field(Kind::LimitExceeded, "body", finding, "send less"))
        }
        Err(error) => Err(Problem::new(Kind::BrokenOff, error).remedied("send it again")),
    }
}

/// The media type of a body, without its parameters and in lower case.
pub fn media_type(headers: &axum::http::HeaderMap) -> Option<String> {
    let value = headers.get(CONTENT_TYPE)?.to_str().ok()?;
    Some(value.split(';').next().unwrap_or_default().trim().to_ascii_lowercase())
}

/// A body of a media type that is not read here.
pub fn unsupported(found: Option<&str>, known: &[&str]) -> Problem {
    let finding = match found {
        Some(found) => format!("`{found}` is not read here"),
        None => "is missing".to_owned(),
    };
    let remedy = format!("send one of {}", known.join(", "));
    Problem::of_field(Kind::UnsupportedMediaType, "Content-Type", finding, &remedy)
}
