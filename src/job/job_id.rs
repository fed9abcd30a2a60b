use std::fmt;
use std::hash::Hash;
use std::marker::PhantomData;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// What is done in a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum JobKind {
    /// Scans are registered.
    Registration,
    /// A mesh is made from pictures.
    InverseRendering,
}

impl JobKind {
    /// Every kind.
    pub const ALL: [Self; 2] = [Self::Registration, Self::InverseRendering];

    /// Its name, as it is stored.
    pub fn name(self) -> &'static str {
        match self {
            Self::Registration => "registration",
            Self::InverseRendering => "inverse_rendering",
        }
    }
}

impl fmt::Display for JobKind {
    /// As people read it.
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(match self {
            Self::Registration => "registration",
            Self::InverseRendering => "inverse rendering",
        })
    }
}

/// A kind of job as a type: by the id of one kind no job of another is found.
pub trait OfKind: Copy + Ord + Hash + fmt::Debug + Send + Sync + 'static {
    /// The kind.
    const KIND: JobKind;
}

/// Names a job of a kind; sorts by the time it was asked for.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct JobId<K>(String, PhantomData<K>);

/// Not the name of a job.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` names nothing that was asked for: ids are 32 hexadecimal digits")]
pub struct BadJobId(String);

impl<K> JobId<K> {
    /// A new one.
    pub fn new() -> Self {
        Self(uuid::Uuid::now_v7().simple().to_string(), PhantomData)
    }

    /// Its digits.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl<K> Default for JobId<K> {
    fn default() -> Self {
        Self::new()
    }
}

impl<K> fmt::Display for JobId<K> {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(&self.0)
    }
}

impl<K> FromStr for JobId<K> {
    type Err = BadJobId;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let digit = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
        match text.len() == 32 && text.bytes().all(digit) {
            true => Ok(Self(text.to_owned(), PhantomData)),
            false => Err(BadJobId(text.chars().take(64).collect())),
        }
    }
}
