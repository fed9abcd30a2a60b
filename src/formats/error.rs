use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use crate::mesh::MeshError;

/// Why a file cannot be read or written, and which file.
#[derive(Debug)]
pub struct FormatError {
    file: Option<PathBuf>,
    fault: Fault,
}

/// What is wrong with a file, and where in it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The file cannot be opened or read.
    #[error("cannot be read: {0}")]
    Unreadable(io::Error),
    /// The file cannot be written.
    #[error("cannot be written: {0}")]
    Unwritable(io::Error),
    /// Neither content nor extension tell a mesh format.
    #[error(
        "is neither OBJ, PLY, STL, glTF nor GLB (it begins with `{start}`): convert the mesh to one of them, \
         or correct the file's extension"
    )]
    UnknownFormat {
        /// The first bytes, as text.
        start: String,
    },
    /// The content breaks its format, or uses a part of it that is not supported.
    #[error("{place}: {problem}")]
    Malformed {
        /// Line, element or field.
        place: String,
        /// What was found there, and what to do.
        problem: String,
    },
    /// Well-formed, but no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// What is to be written does not fit the format.
    #[error("{0}")]
    DoesNotFit(String),
}

impl Fault {
    pub(super) fn at(place: impl fmt::Display, problem: impl Into<String>) -> Self {
        Self::Malformed { place: place.to_string(), problem: problem.into() }
    }
}

impl FormatError {
    /// The same fault, said of `file`; a file named before is kept.
    pub fn in_file(mut self, file: impl AsRef<Path>) -> Self {
        self.file.get_or_insert_with(|| file.as_ref().to_owned());
        self
    }

    /// The same fault, said of `file` in place of any named before: for files whose path means nothing to the reader.
    pub fn of_file(mut self, file: impl AsRef<Path>) -> Self {
        self.file = Some(file.as_ref().to_owned());
        self
    }

    /// The file it is about; `None` for bytes that came without one.
    pub fn file(&self) -> Option<&Path> {
        self.file.as_deref()
    }

    /// What is wrong.
    pub fn fault(&self) -> &Fault {
        &self.fault
    }
}

impl From<Fault> for FormatError {
    fn from(fault: Fault) -> Self {
        Self { file: None, fault }
    }
}

impl fmt::Display for FormatError {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(out, "{}: ", file.display())?;
        }
        self.fault.fmt(out)
    }
}

impl std::error::Error for FormatError {}
