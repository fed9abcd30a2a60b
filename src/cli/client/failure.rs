use std::fmt;
use std::io;
use std::time::Duration;

use serde::Deserialize;

/// Why a request brought nothing.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// Nobody answered, or the connection broke.
    #[error("{0}")]
    Connection(String),
    /// The server said why not.
    #[error("{0}")]
    Refused(Box<Refusal>),
    /// The answer is none of the service's.
    #[error("the answer is not one of a onemesh server: {0}; look what answers at --server")]
    Odd(String),
    /// A file on this side cannot be read or written.
    #[error("{0}")]
    File(String),
}

/// A server's answer that says why not.
#[derive(Debug)]
pub struct Refusal {
    /// The status.
    pub status: u16,
    /// When it is worth trying again, as the server says.
    pub retry_after: Option<Duration>,
    /// What it says.
    pub problem: Problem,
}

/// What went wrong, after RFC 9457, as the service has it.
#[derive(Debug, Default, Deserialize)]
#[serde(default)]
pub struct Problem {
    /// A name for it, which stays.
    pub r#type: String,
    /// What kind it is.
    pub title: String,
    /// What was found.
    pub detail: String,
    /// What to do.
    pub remedy: Option<String>,
}

impl fmt::Display for Refusal {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        let Problem { title, detail, remedy, .. } = &self.problem;
        match (title.is_empty(), detail.is_empty()) {
            (true, _) => write!(out, "the server answered with status {}", self.status)?,
            (false, true) => write!(out, "{title}")?,
            (false, false) => write!(out, "{title}: {detail}")?,
        }
        remedy.as_ref().map_or(Ok(()), |remedy| write!(out, "; {remedy}"))
    }
}

impl Failure {
    /// A file on this side that fails.
    pub fn file(path: &std::path::Path, error: io::Error) -> Self {
        Self::File(format!("{}: {error}", path.display()))
    }

    /// The status of the server's answer, if it answered.
    pub fn status(&self) -> Option<u16> {
        match self {
            Self::Refused(refusal) => Some(refusal.status),
            _ => None,
        }
    }

    /// Whether the same request may do later.
    pub fn passes(&self) -> bool {
        match self {
            Self::Connection(_) => true,
            Self::Refused(refusal) => match refusal.status {
                429 | 502 | 503 | 504 => true,
                // Another request with the same Idempotency-Key is being worked on.
                409 => refusal.problem.r#type.ends_with(":idempotency-key-under-way"),
                // An upload that broke off on its way.
                400 => refusal.problem.r#type.ends_with(":broken-off"),
                _ => false,
            },
            Self::Odd(_) | Self::File(_) => false,
        }
    }

    /// How long the server asks to wait.
    pub fn retry_after(&self) -> Option<Duration> {
        match self {
            Self::Refused(refusal) => refusal.retry_after,
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(status: u16, problem: &str) -> Failure {
        let problem = serde_json::from_str(problem).unwrap();
        Failure::Refused(Box::new(Refusal { status, retry_after: None, problem }))
    }

    #[test]
    fn problems_are_told_with_their_remedy() {
        let problem = r#"{"type": "urn:onemesh:problem:unauthorized", "title": "An API key is needed", "status": 401,
            "detail": "Authorization: the key is not known", "remedy": "send another"}"#;
        let failure = refused(401, problem);
        let said = "An API key is needed: Authorization: the key is not known; send another";
        assert_eq!((failure.to_string().as_str(), failure.passes()), (said, false));
        assert_eq!(refused(502, "{}").to_string(), "the server answered with status 502");
    }

    #[test]
    fn what_passes_is_tried_again() {
        assert!(refused(503, "{}").passes() && refused(429, "{}").passes());
        assert!(refused(409, r#"{"type": "urn:onemesh:problem:idempotency-key-under-way"}"#).passes());
        assert!(!refused(409, r#"{"type": "urn:onemesh:problem:conflict"}"#).passes());
        assert!(!refused(500, "{}").passes() && !Failure::Odd(String::new()).passes());
        assert!(Failure::Connection(String::new()).passes());
    }
}
