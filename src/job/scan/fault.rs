use std::fmt;

use crate::formats::FormatError;

/// What was uploaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The mesh, or the zip that holds it.
    Mesh,
    /// The landmarks.
    Landmarks,
    /// The mask.
    Mask,
    /// The texture.
    Texture,
}

impl Part {
    /// Its name, as fields of an upload have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Landmarks => "landmarks",
            Self::Mask => "mask",
            Self::Texture => "texture",
        }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        out.write_str(self.name())
    }
}

/// What is wrong with an uploaded file.
#[derive(Debug, thiserror::Error)]
pub enum ScanFault {
    /// It cannot be understood.
    #[error("{part}: {error}")]
    Unreadable {
        /// Which file.
        part: Part,
        /// Where in it, what was found and what to do.
        error: FormatError,
    },
    /// It is larger than is taken.
    #[error("{part}: has {found} {what}; at most {limit} are taken: {remedy}")]
    TooLarge {
        /// Which file.
        part: Part,
        /// Of what there is too much.
        what: &'static str,
        /// How much there is, at least.
        found: u64,
        /// How much may be.
        limit: u64,
        /// What to do.
        remedy: &'static str,
    },
    /// It is not what the field is for.
    #[error("{part}: {problem}")]
    Unfit {
        /// Which file.
        part: Part,
        /// What was found and what to do.
        problem: String,
    },
    /// The server's disk failed.
    #[error("cannot be unpacked or read: {0}")]
    Scratch(std::io::Error),
}

impl ScanFault {
    /// The file that it is about.
    pub fn part(&self) -> Part {
        match self {
            Self::Unreadable { part, .. } | Self::TooLarge { part, .. } | Self::Unfit { part, .. } => *part,
            Self::Scratch(_) => Part::Mesh,
        }
    }
}
