use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::{CollectionError, Refused, Source};
use crate::formats::input::read_regular;

#[derive(Deserialize)]
struct Manifest {
    scheme: Option<String>,
    scans: Vec<Entry>,
}

#[derive(Deserialize)]
struct Entry {
    name: String,
    mesh: PathBuf,
    landmarks: PathBuf,
    mask: Option<PathBuf>,
    scheme: Option<String>,
}

/// The scans that a manifest lists.
pub(super) fn sources(path: &Path) -> Result<Vec<Result<Source, Refused>>, CollectionError> {
    let bytes =
        read_regular(path).map_err(|error| CollectionError::Unreadable { path: path.to_owned(), error })?;
    let Manifest { scheme, scans } = serde_json::from_slice(&bytes)
        .map_err(|error| CollectionError::Manifest { path: path.to_owned(), problem: error.to_string() })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let source = |entry: Entry| {
        Ok(Source {
            name: entry.name,
            mesh: folder.join(entry.mesh),
            landmarks: folder.join(entry.landmarks),
            mask: entry.mask.map(|mask| folder.join(mask)),
            scheme: entry.scheme.or_else(|| scheme.clone()),
        })
    };
    Ok(scans.into_iter().map(source).collect())
}
