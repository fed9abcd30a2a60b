use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::{CollectionError, Refused, Source};
use crate::formats::{LandmarkFile, MaskFile, MeshFormat};

/// The scans in a folder, in folders of their own or side by side.
pub(super) fn sources(folder: &Path) -> Result<Vec<Result<Source, Refused>>, CollectionError> {
    let mut sources = Vec::new();
    for path in entries(folder)? {
        if path.is_dir() {
            if let Some(mesh) = scan_in(&path).transpose() {
                let name = file_name(&path)?;
                let source = mesh.and_then(|mesh| source(&name, mesh, |kind| path.join(kind)));
                sources.push(source.map_err(|error| Refused::new(name, error)));
            }
        } else if is_mesh(&path) {
            let name = stem(&path)?;
            let beside = |kind: &str| folder.join(format!("{name}.{kind}"));
            let source = source(&name, path, beside);
            sources.push(source.map_err(|error| Refused::new(name, error)));
        }
    }
    Ok(sources)
}

/// A scan whose files of landmarks and mask are called as `beside` says, with an extension; where there are no
/// landmarks, the first are missed.
fn source(name: &str, mesh: PathBuf, beside: impl Fn(&str) -> PathBuf) -> Result<Source, CollectionError> {
    let [landmarks, mask] = ["landmarks", "mask"].map(beside);
    let name = name.to_owned();
    let names = |paths: &[PathBuf]| paths.iter().map(|path| file_name(path)).collect::<Result<Vec<_>, _>>();
    let mut there = existing(&landmarks, &LandmarkFile::EXTENSIONS);
    if there.len() > 1 {
        return Err(CollectionError::SeveralLandmarks { name, files: names(&there)? });
    }
    let mut masks = existing(&mask, &MaskFile::EXTENSIONS);
    if masks.len() > 1 {
        return Err(CollectionError::SeveralMasks { name, files: names(&masks)? });
    }
    let landmarks = there.pop().unwrap_or_else(|| with(&landmarks, LandmarkFile::EXTENSIONS[0]));
    Ok(Source { name, mesh, landmarks, mask: masks.pop(), scheme: None })
}

fn with(path: &Path, extension: &str) -> PathBuf {
    let mut path = path.as_os_str().to_owned();
    path.push(".");
    path.push(extension);
    PathBuf::from(path)
}

fn existing(path: &Path, extensions: &[&str]) -> Vec<PathBuf> {
    extensions.iter().map(|extension| with(path, extension)).filter(|path| path.exists()).collect()
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
