use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::{CollectionError, Refused, Source};
use crate::formats::{LandmarkFile, MeshFormat};

/// The scans in a folder, in folders of their own or side by side.
pub(super) fn sources(folder: &Path) -> Result<Vec<Result<Source, Refused>>, CollectionError> {
    let mut sources = Vec::new();
    for path in entries(folder)? {
        if path.is_dir() {
            if let Some(mesh) = scan_in(&path).transpose() {
                let name = file_name(&path)?;
                let source = mesh.and_then(|mesh| source(&name, mesh, &path.join("landmarks")));
                sources.push(source.map_err(|error| Refused::new(name, error)));
            }
        } else if is_mesh(&path) {
            let name = stem(&path)?;
            let landmarks = folder.join(format!("{name}.landmarks"));
            let source = source(&name, path, &landmarks);
            sources.push(source.map_err(|error| Refused::new(name, error)));
        }
    }
    Ok(sources)
}

/// A scan whose landmarks' file is called as `landmarks`, with an extension; where there is none, the first is missed.
fn source(name: &str, mesh: PathBuf, landmarks: &Path) -> Result<Source, CollectionError> {
    let with = |extension: &str| {
        let mut path = landmarks.as_os_str().to_owned();
        path.push(".");
        path.push(extension);
        PathBuf::from(path)
    };
    let mut there: Vec<_> =
        LandmarkFile::EXTENSIONS.map(with).into_iter().filter(|path| path.exists()).collect();
    if there.len() > 1 {
        let files = there.iter().map(|path| file_name(path)).collect::<Result<_, _>>()?;
        return Err(CollectionError::SeveralLandmarks { name: name.to_owned(), files });
    }
    let landmarks = there.pop().unwrap_or_else(|| with(LandmarkFile::EXTENSIONS[0]));
    Ok(Source { name: name.to_owned(), mesh, landmarks, scheme: None })
}

/// The mesh in a scan's folder: that called `scan`, or the only one.
fn scan_in(folder: &Path) -> Result<Option<PathBuf>, CollectionError> {
    let mut meshes: Vec<_> =
        entries(folder)?.into_iter().filter(|path| !path.is_dir() && is_mesh(path)).collect();
    if meshes.iter().any(|path| is_called_scan(path)) {
        meshes.retain(|path| is_called_scan(path));
    }
    match &meshes[..] {
        [] => Ok(None),
        [mesh] => Ok(Some(mesh.clone())),
        several => Err(CollectionError::Ambiguous {
            path: folder.to_owned(),
            meshes: several.iter().map(|path| file_name(path)).collect::<Result<_, _>>()?,
        }),
    }
}

/// What a folder holds, sorted; names that begin with a dot are left out.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, CollectionError> {
    let list = || -> io::Result<Vec<PathBuf>> {
        let paths = fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
        paths.filter(|path| !matches!(path, Ok(path) if is_hidden(path))).collect()
    };
    let mut paths = list().map_err(|error| CollectionError::Unreadable { path: folder.to_owned(), error })?;
    paths.sort();
    Ok(paths)
}

fn is_hidden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
}

fn is_mesh(path: &Path) -> bool {
    path.extension().and_then(|e| e.to_str()).and_then(MeshFormat::of_extension).is_some()
}

fn is_called_scan(path: &Path) -> bool {
    path.file_stem().is_some_and(|stem| stem == "scan")
}

fn file_name(path: &Path) -> Result<String, CollectionError> {
    text(path, path.file_name())
}

fn stem(path: &Path) -> Result<String, CollectionError> {
    text(path, path.file_stem())
}

fn text(path: &Path, name: Option<&std::ffi::OsStr>) -> Result<String, CollectionError> {
    let name = name.and_then(|name| name.to_str()).map(str::to_owned);
    name.ok_or_else(|| CollectionError::BadName { name: path.to_string_lossy().into_owned() })
}
