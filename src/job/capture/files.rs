use std::fs::{self, File};
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};

use super::fault::CaptureFault;
use super::limits::CaptureLimits;
use super::new_capture::CaptureParts;
use crate::formats::Capture;
use crate::job::archive::{ArchiveFault, ArchiveLimits, ends_in, unpack};
use crate::job::blobs::Blobs;
use crate::job::store_error::StoreError;

/// Ends of the names of files that belong to a capture; all others are left packed.
const USEFUL: [&str; 7] = ["json", "xml", "txt", "bin", "png", "jpg", "jpeg"];

/// The files of a capture, where the store has them.
#[derive(Debug)]
pub(in crate::job) struct CaptureFiles {
    zip: Option<PathBuf>,
    files: Vec<(String, PathBuf)>,
}

impl CaptureFiles {
    /// Finds them, and holds each against its digest.
    ///
    /// # Errors
    /// As [`Blobs::verify`].
    pub async fn find(blobs: &Blobs, parts: &CaptureParts) -> Result<Self, StoreError> {
        for digest in parts.digests() {
            blobs.verify(digest).await?;
        }
        let files = parts.files.iter().map(|(place, digest)| (place.clone(), blobs.path(*digest)));
        Ok(Self { zip: parts.zip.map(|digest| blobs.path(digest)), files: files.collect() })
    }

    /// Lays them out in a folder and reads the cameras, which takes long: not on an async thread.
    ///
    /// # Errors
    /// [`CaptureFault`] says which file is wrong and what to do.
    pub fn lay_out(&self, folder: &Path, limits: &CaptureLimits) -> Result<Capture, CaptureFault> {
        if let Some(zip) = &self.zip {
            let most = ArchiveLimits { files: limits.files, bytes: limits.bytes };
            let zip = BufReader::new(File::open(zip)?);
            unpack(zip, folder, most, |name| ends_in(name, &USEFUL))
                .map_err(|fault| fault_of(fault, limits))?;
        }
        for (place, file) in &self.files {
            let path = folder.join(place);
            fs::create_dir_all(path.parent().unwrap_or(folder))?;
            put(file, &path)?;
        }
        let capture = Capture::open(root(folder)?).map_err(|error| unfit(&error, folder))?;
        check(&capture, folder, limits)?;
        Ok(capture)
    }
}

/// A name for a stored file; a copy where the disk has no second names.
fn put(file: &Path, path: &Path) -> io::Result<()> {
    fs::hard_link(file, path).or_else(|_| fs::copy(file, path).map(drop))
}

/// The folder itself, or the one in it where it holds nothing else, as zips of a folder do.
fn root(folder: &Path) -> io::Result<PathBuf> {
    let entries: Vec<PathBuf> =
        fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<io::Result<_>>()?;
    match entries.as_slice() {
        [one] if one.is_dir() && !one.ends_with("sparse") => Ok(one.clone()),
        _ => Ok(folder.to_owned()),
    }
}

/// Whether there are no more views and pixels than may be; nothing is decoded.
fn check(capture: &Capture, folder: &Path, limits: &CaptureLimits) -> Result<(), CaptureFault> {
    let views = capture.views.len();
    if views > limits.views {
        let (what, remedy) = ("has views:".to_owned(), "leave out those that show nothing new");
        let (found, limit) = (views as u64, limits.views as u64);
        return Err(CaptureFault::TooLarge { what, found, limit, remedy });
    }
    for path in capture.views.iter().flat_map(|view| [Some(&view.image), view.mask.as_ref()]).flatten() {
        let shown = path.strip_prefix(folder).unwrap_or(path).display();
        let size = imagesize::size(path).map_err(|error| CaptureFault::Unfit {
            problem: format!("{shown}: is no picture that is known ({error}): send PNG or JPEG"),
        })?;
        let found = (size.width as u64).saturating_mul(size.height as u64);
        if found > limits.picture_pixels {
            let (what, remedy) = (format!("{shown}: has pixels:"), "send smaller pictures");
            return Err(CaptureFault::TooLarge { what, found, limit: limits.picture_pixels, remedy });
        }
    }
    Ok(())
}

/// A reader's error without the path of the folder, which means nothing to whoever sent the files.
fn unfit(error: &dyn std::error::Error, folder: &Path) -> CaptureFault {
    let path = format!("{}/", folder.display());
    CaptureFault::Unfit { problem: error.to_string().replace(&path, "") }
}

fn fault_of(fault: ArchiveFault, limits: &CaptureLimits) -> CaptureFault {
    let too_large = |what: &str, found, limit, remedy| CaptureFault::TooLarge {
        what: what.to_owned(),
        found,
        limit,
        remedy,
    };
    match fault {
        ArchiveFault::Damaged(problem) => CaptureFault::Unfit { problem },
        ArchiveFault::TooMany(found) => too_large(
            "its zip has files:",
            found,
            limits.files as u64,
            "zip the pictures and cameras, nothing else",
        ),
        ArchiveFault::TooLong => too_large(
            "unpacked it has bytes:",
            limits.bytes + 1,
            limits.bytes,
            "send fewer or smaller pictures",
        ),
        ArchiveFault::Folder(error) => CaptureFault::Scratch(error),
    }
}
