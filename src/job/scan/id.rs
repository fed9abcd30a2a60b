use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::formats::Sha256;

/// Names a scan by what was uploaded: the same files under the same name are the same scan.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ScanId(String);

/// Not the name of anything that was uploaded.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no id: ids are {DIGITS} hexadecimal digits")]
pub struct BadId(String);

const DIGITS: usize = 32;

impl ScanId {
    /// The id of what has this digest.
    pub(in crate::job) fn of(digest: Sha256) -> Self {
        Self(digest_id(digest))
    }

    /// Its digits.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for ScanId {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(&self.0)
    }
}

impl FromStr for ScanId {
    type Err = BadId;

    fn from_str(text: &str) -> Result<Self, BadId> {
        checked_id(text).map(Self)
    }
}

/// The first half of a digest.
pub(in crate::job) fn digest_id(digest: Sha256) -> String {
    digest.to_string()[..DIGITS].to_owned()
}

/// The text, if it looks like an id.
pub(in crate::job) fn checked_id(text: &str) -> Result<String, BadId> {
    let digit = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
    match text.len() == DIGITS && text.bytes().all(digit) {
        true => Ok(text.to_owned()),
        false => Err(BadId(text.chars().take(2 * DIGITS).collect())),
    }
}
