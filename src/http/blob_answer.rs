//! Stored files as answers: with an entity tag, in ranges, and never changing.

use std::ops::Range;

use axum::body::Body;
use axum::http::header::{
    ACCEPT_RANGES, CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_LENGTH, CONTENT_RANGE, CONTENT_TYPE, ETAG,
    IF_NONE_MATCH, IF_RANGE, RANGE,
};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::response::{IntoResponse, Response};

use super::problem::{Kind, Problem};
use crate::job::blobs::{BlobInfo, Blobs};

/// For what has its content's digest for a tag and is never another.
const IMMUTABLE: &str = "private, max-age=31536000, immutable";
/// For what may be put anew.
const CHANGING: &str = "private, no-cache";

/// A stored file to be answered with.
#[derive(Debug, Clone, Copy)]
pub struct BlobAnswer<'a> {
    /// The file.
    pub blob: BlobInfo,
    /// Its media type.
    pub media_type: &'static str,
    /// The name to save it by.
    pub file_name: &'a str,
    /// Whether the path never leads to another file.
    pub immutable: bool,
}

impl BlobAnswer<'_> {
    /// The answer to a request with these headers.
    ///
    /// # Errors
    /// [`Kind::RangeNotSatisfiable`]; [`Kind::Damaged`] if the file's bytes are not those that were kept: they are looked at
    /// before the first of them is sent.
    pub async fn respond(
        &self,
        blobs: &Blobs,
        method: &Method,
        request: &HeaderMap,
    ) -> Result<Response, Problem> {
        let tag = format!("\"{}\"", self.blob.digest);
        if is_known(request, &tag) {
            return Ok((StatusCode::NOT_MODIFIED, self.headers(&tag)).into_response());
        }
        let range = match asked_range(request, &tag, self.blob.size) {
            Asked::Whole => None,
            Asked::Part(range) => Some(range),
            Asked::Nothing => {
                return Err(unsatisfiable(self.blob.size));
            }
        };
        let mut headers = self.headers(&tag);
        let length = range.as_ref().map_or(self.blob.size, |range| range.end - range.start);
        headers.insert(CONTENT_LENGTH, length.into());
        let status = match &range {
            Some(Range { start, end }) => {
                headers.insert(CONTENT_RANGE, text(format!("bytes {start}-{}/{}", end - 1, self.blob.size)));
                StatusCode::PARTIAL_CONTENT
            }
            None => StatusCode::OK,
        };
        if method == Method::HEAD {
            return Ok((status, headers).into_response());
        }
        blobs.verify(self.blob.digest).await?;
        let stream = blobs.open_range(self.blob.digest, range).await?;
        Ok((status, headers, Body::from_stream(stream.bytes)).into_response())
    }

    fn headers(&self, tag: &str) -> HeaderMap {
        let mut headers = file_headers(self.media_type, self.file_name, tag);
        let cache = if self.immutable { IMMUTABLE } else { CHANGING };
        headers.insert(CACHE_CONTROL, HeaderValue::from_static(cache));
        headers
    }
}

/// The headers of a file that comes in ranges and has a tag.
pub fn file_headers(media_type: &'static str, file_name: &str, tag: &str) -> HeaderMap {
    let plain: String = file_name
        .chars()
        .map(|c| if c.is_ascii_graphic() && !"\"\\".contains(c) { c } else { '_' })
        .collect();
    HeaderMap::from_iter([
        (CONTENT_TYPE, HeaderValue::from_static(media_type)),
        (CONTENT_DISPOSITION, text(format!("attachment; filename=\"{plain}\""))),
        (ETAG, text(tag.to_owned())),
        (ACCEPT_RANGES, HeaderValue::from_static("bytes")),
        (CACHE_CONTROL, HeaderValue::from_static(IMMUTABLE)),
    ])
}

/// The part of a file that is asked for.
#[derive(Debug, PartialEq, Eq)]
pub enum Asked {
    /// All of it.
    Whole,
    /// Some of its bytes.
    Part(Range<u64>),
    /// What it does not have.
    Nothing,
}

/// Whether the client says that it has what has this tag.
pub fn is_known(request: &HeaderMap, tag: &str) -> bool {
    let given = request.get_all(IF_NONE_MATCH).iter().filter_map(|value| value.to_str().ok());
    given.flat_map(|value| value.split(',')).map(str::trim).any(|given| {
        // A weak comparison, as the header is defined.
        given == "*" || given.strip_prefix("W/").unwrap_or(given) == tag
    })
}

/// The part that `Range` asks for; several parts, and units other than bytes, are answered by the whole, as may be.
pub fn asked_range(request: &HeaderMap, tag: &str, size: u64) -> Asked {
    let if_range = request.get(IF_RANGE);
    if if_range.is_some_and(|value| value.as_bytes() != tag.as_bytes()) {
        return Asked::Whole;
    }
    let header = request.get(RANGE).and_then(|value| value.to_str().ok());
    let Some((first, last)) = header.and_then(|value| value.strip_prefix("bytes=")?.split_once('-')) else {
        return Asked::Whole;
    };
    let range = match (first.trim().parse::<u64>(), last.trim().parse::<u64>()) {
        (Ok(first), Ok(last)) if first <= last => first..last.saturating_add(1).min(size),
        (Ok(first), Err(_)) if last.trim().is_empty() => first..size,
        (Err(_), Ok(last)) if first.trim().is_empty() => size.saturating_sub(last)..size,
        _ => return Asked::Whole,
    };
    if range.start < range.end { Asked::Part(range) } else { Asked::Nothing }
}

/// The answer to [`Asked::Nothing`].
pub fn unsatisfiable(size: u64) -> Problem {
    let finding = format!("asks for bytes that are not among the file's {size}");
    Problem::of_field(Kind::RangeNotSatisfiable, "Range", finding, "ask for `bytes=0-`")
}

fn text(value: String) -> HeaderValue {
    HeaderValue::try_from(value).unwrap_or(HeaderValue::from_static("_"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(range: &str) -> Asked {
        let request = HeaderMap::from_iter([(RANGE, text(range.to_owned()))]);
        asked_range(&request, "\"tag\"", 100)
    }

    #[test]
    fn ranges_as_they_are_written() {
        assert_eq!(asked("bytes=0-0"), Asked::Part(0..1));
        assert_eq!(asked("bytes=90-200"), Asked::Part(90..100));
        assert_eq!(asked("bytes=90-"), Asked::Part(90..100));
        assert_eq!(asked("bytes=-7"), Asked::Part(93..100));
        assert_eq!(asked("bytes=-700"), Asked::Part(0..100));
        assert_eq!(asked("bytes=100-"), Asked::Nothing);
        assert_eq!(asked("bytes=-0"), Asked::Nothing);
        for odd in ["bytes=0-1,5-6", "lines=0-1", "bytes=7-3", "bytes=-", "bytes=a-b", "bytes"] {
            assert_eq!(asked(odd), Asked::Whole, "{odd}");
        }
    }

    #[test]
    fn a_range_of_another_version_is_the_whole() {
        let tagged = |tag: &str| {
            let pairs = [(RANGE, text("bytes=0-0".into())), (IF_RANGE, text(tag.into()))];
            asked_range(&HeaderMap::from_iter(pairs), "\"tag\"", 100)
        };
        assert_eq!(tagged("\"tag\""), Asked::Part(0..1));
        assert_eq!(tagged("\"other\""), Asked::Whole);
    }

    #[test]
    fn known_tags() {
        let known =
            |value: &str| is_known(&HeaderMap::from_iter([(IF_NONE_MATCH, text(value.into()))]), "\"a\"");
        assert!(known("\"a\"") && known("\"b\", W/\"a\"") && known("*"));
        assert!(!known("\"b\"") && !is_known(&HeaderMap::new(), "\"a\""));
    }
}
