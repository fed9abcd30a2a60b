//! Zips, unpacked without belief in what they say of themselves.

use std::fs::{self, File};
use std::io::{self, Read, Seek};
use std::path::{Path, PathBuf};

use zip::ZipArchive;
use zip::result::ZipError;

/// How much a zip may hold.
#[derive(Debug, Clone, Copy)]
pub(super) struct ArchiveLimits {
    /// Files.
    pub files: usize,
    /// Bytes of all of them, counted as they come out.
    pub bytes: u64,
}

/// Why a zip is not unpacked.
#[derive(Debug)]
pub(super) enum ArchiveFault {
    /// What was found.
    Damaged(String),
    /// It has more files than it may.
    TooMany(u64),
    /// It has more bytes than it may.
    TooLong,
    /// The folder failed.
    Folder(io::Error),
}

impl From<ZipError> for ArchiveFault {
    fn from(error: ZipError) -> Self {
        Self::Damaged(format!("is a zip that cannot be read: {error}; pack it again"))
    }
}

/// Unpacks what is wanted of a zip into a folder; gives the files, by the names that they have in it.
///
/// Hidden files, and those that would leave the folder, are left packed.
pub(super) fn unpack(
    zip: impl Read + Seek,
    folder: &Path,
    limits: ArchiveLimits,
    wanted: impl Fn(&Path) -> bool,
) -> Result<Vec<PathBuf>, ArchiveFault> {
    let mut archive = ZipArchive::new(zip)?;
    if archive.len() > limits.files {
        return Err(ArchiveFault::TooMany(archive.len() as u64));
    }
    let mut left = limits.bytes;
    let mut names = Vec::new();
    for at in 0..archive.len() {
        let entry = archive.by_index(at)?;
        let name = entry.enclosed_name().filter(|name| entry.is_file() && !hidden(name) && wanted(name));
        let Some(name) = name else { continue };
        left -= extract(entry, &folder.join(&name), left)?;
        names.push(name);
    }
    Ok(names)
}

/// Writes a packed file out and counts its bytes.
fn extract(entry: impl Read, path: &Path, left: u64) -> Result<u64, ArchiveFault> {
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent).map_err(ArchiveFault::Folder)?;
    }
    let mut file = File::create(path).map_err(ArchiveFault::Folder)?;
    let size = io::copy(&mut entry.take(left + 1), &mut file).map_err(|error| match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => ArchiveFault::Folder(error),
        _ => ArchiveFault::Damaged(format!("the zip cannot be unpacked: {error}")),
    })?;
    if size > left { Err(ArchiveFault::TooLong) } else { Ok(size) }
}

fn hidden(name: &Path) -> bool {
    name.components().any(|part| {
        let part = part.as_os_str().to_string_lossy();
        part.starts_with('.') || part == "__MACOSX"
    })
}

/// Whether a file's name ends in one of these, in either case.
pub(super) fn ends_in(name: &Path, extensions: &[&str]) -> bool {
    let own = name.extension().and_then(|own| own.to_str());
    own.is_some_and(|own| extensions.iter().any(|known| known.eq_ignore_ascii_case(own)))
}
