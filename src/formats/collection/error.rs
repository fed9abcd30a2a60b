use std::io;
use std::path::PathBuf;

use crate::formats::error::FormatError;
use crate::formats::landmarks::LandmarkFile;

/// Why a folder or manifest makes no collection.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CollectionError {
    /// The folder cannot be listed, or neither folder nor manifest is there.
    #[error("{}: cannot be read: {error}", path.display())]
    Unreadable {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// The manifest is malformed.
    #[error("{}: is no manifest {{\"scans\": [{{\"name\", \"mesh\", \"landmarks\"}}, ...]}}: {problem}", path.display())]
    Manifest {
        /// The manifest.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// No scan is there.
    #[error("{}: holds no scan: expected NAME/scan.ply with NAME/landmarks.json, or NAME.ply with NAME.landmarks.json \
             (ply, obj, stl, glb or gltf; json, ljson, pp, txt or mrk.json)", path.display())]
    Empty {
        /// The folder or manifest.
        path: PathBuf,
    },
    /// A folder holds several meshes and does not say which is the scan.
    #[error("{}: holds several meshes ({}): name the one to use `scan`", path.display(), meshes.join(", "))]
    Ambiguous {
        /// The scan's folder.
        path: PathBuf,
        /// The meshes' file names.
        meshes: Vec<String>,
    },
    /// A scan has no landmarks.
    #[error("scan `{name}` has no landmarks: expected {} (or {})", expected.display(), LandmarkFile::EXTENSIONS[1..].join(", "))]
    MissingLandmarks {
        /// The scan.
        name: String,
        /// Where they should be.
        expected: PathBuf,
    },
    /// A scan has several files of landmarks.
    #[error("scan `{name}` has several files of landmarks ({}): keep one", files.join(", "))]
    SeveralLandmarks {
        /// The scan.
        name: String,
        /// The files' names.
        files: Vec<String>,
    },
    /// A scan has several masks.
    #[error("scan `{name}` has several masks ({}): keep one", files.join(", "))]
    SeveralMasks {
        /// The scan.
        name: String,
        /// The files' names.
        files: Vec<String>,
    },
    /// The mask that a manifest names is not there.
    #[error("scan `{name}` has no mask: {} does not exist", path.display())]
    MissingMask {
        /// The scan.
        name: String,
        /// Where it should be.
        path: PathBuf,
    },
    /// The mesh that a manifest names is not there.
    #[error("scan `{name}` has no mesh: {} does not exist", path.display())]
    MissingMesh {
        /// The scan.
        name: String,
        /// Where it should be.
        path: PathBuf,
    },
    /// A name cannot name a result's file.
    #[error("the scan name `{}` must not be empty, begin with a dot, or contain /, \\, : or control characters", name.escape_default())]
    BadName {
        /// The name.
        name: String,
    },
    /// Two scans have one name.
    #[error("two scans are named `{name}`: {} and {}", first.display(), second.display())]
    DuplicateName {
        /// The name.
        name: String,
        /// The first scan's mesh.
        first: PathBuf,
        /// The second scan's mesh.
        second: PathBuf,
    },
    /// Two scans' landmarks are named by different schemes, so that equal names mean different points.
    #[error(
        "the landmarks of `{first}` are of the scheme `{first_scheme}`, those of `{second}` of `{second_scheme}`: use one"
    )]
    SchemesDiffer {
        /// A scan.
        first: String,
        /// Its scheme.
        first_scheme: String,
        /// Another scan.
        second: String,
        /// Its scheme.
        second_scheme: String,
    },
    /// The scans share no landmark.
    #[error(
        "no landmark is present on every scan: `{name}` has {there}, none of which all scans before it have ({before})"
    )]
    NoCommonLandmark {
        /// The first scan, by name, that shares none with those before it.
        name: String,
        /// Some of its landmarks.
        there: String,
        /// Some that the scans before it share.
        before: String,
    },
    /// A file of a scan cannot be read.
    #[error("scan `{name}`: {error}")]
    Scan {
        /// The scan.
        name: String,
        /// What is wrong, and in which file.
        error: FormatError,
    },
}
