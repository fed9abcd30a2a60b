use std::cell::RefCell;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};

use sha2::Digest;

use super::digest::Sha256;
use super::error::{Fault, FormatError};

/// A file that was read, with the digest of the very bytes that were used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputFile {
    /// Where it was read from.
    pub path: PathBuf,
    /// Its size in bytes.
    pub size: u64,
    /// The digest of its bytes.
    pub sha256: Sha256,
}

impl InputFile {
    pub(super) fn of(path: &Path, bytes: &[u8]) -> Self {
        Self { path: path.to_owned(), size: bytes.len() as u64, sha256: Sha256::of(bytes) }
    }
}

/// The whole of a regular file; pipes and devices, which may have no end, are refused.
pub(super) fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    check_regular(path)?;
    fs::read(path)
}

pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, FormatError> {
    read_regular(path).map_err(|error| unreadable(path, error))
}

fn check_regular(path: &Path) -> io::Result<()> {
    if fs::metadata(path)?.is_file() {
        return Ok(());
    }
    Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a regular file"))
}

fn unreadable(path: &Path, error: io::Error) -> FormatError {
    FormatError::from(Fault::Unreadable(error)).in_file(path)
}

/// A regular file that is read a piece at a time, its digest taken on the way.
pub(super) struct HashedFile {
    path: PathBuf,
    file: File,
    /// Its size when it was opened, in bytes.
    pub length: u64,
    size: u64,
    hasher: sha2::Sha256,
}

impl HashedFile {
    pub fn open(path: &Path) -> Result<Self, FormatError> {
        let open = || {
            // Before it is opened: that of a pipe may wait for ever.
            check_regular(path)?;
            let file = File::open(path)?;
            Ok((file.metadata()?.len(), file))
        };
        let (length, file) = open().map_err(|error| unreadable(path, error))?;
        Ok(Self { path: path.to_owned(), file, length, size: 0, hasher: sha2::Sha256::new() })
    }

    /// What was read, with all of the file that was not.
    pub fn finish(mut self) -> Result<InputFile, FormatError> {
        io::copy(&mut self, &mut io::sink()).map_err(|error| unreadable(&self.path, error))?;
        Ok(InputFile { path: self.path, size: self.size, sha256: self.hasher.into() })
    }
}

impl Read for HashedFile {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(out)?;
        self.hasher.update(&out[..count]);
        self.size += count as u64;
        Ok(count)
    }
}

/// The files beside the one being read, which it may name.
pub(super) struct Siblings {
    folder: Option<PathBuf>,
    read: RefCell<Vec<InputFile>>,
}

impl Siblings {
    /// Those in the folder of `path` and beneath it.
    pub fn of(path: &Path) -> Self {
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        Self { folder: Some(folder), read: RefCell::default() }
    }

    /// None: the bytes being read came without a folder.
    pub fn none() -> Self {
        Self { folder: None, read: RefCell::default() }
    }

    /// Where the file called `name` would be, a path relative to the folder that stays within it.
    pub fn path(&self, name: &str) -> Result<PathBuf, String> {
        let Some(folder) = &self.folder else {
            return Err(format!("names the file `{name}`, which is not here: embed it, or send a GLB"));
        };
        let parts = Path::new(name).components().filter(|part| *part != Component::CurDir);
        let inside: Option<PathBuf> =
            parts.map(|part| matches!(part, Component::Normal(_)).then_some(part)).collect();
        match inside {
            Some(inside) if !name.contains(':') && inside != Path::new("") => Ok(folder.join(inside)),
            _ => Err(format!("names `{name}`: only files in the same folder or beneath it are read")),
        }
    }

    /// Where the file called `name` is, which must be there.
    pub fn find(&self, name: &str) -> Result<PathBuf, String> {
        let path = self.path(name)?;
        if path.is_file() {
            return Ok(path);
        }
        Err(format!("names `{name}`, which is not there: put it beside the mesh"))
    }

    /// Reads the file called `name`.
    pub fn read(&self, name: &str) -> Result<Vec<u8>, String> {
        let path = self.path(name)?;
        let bytes = read_file(&path).map_err(|error| format!("names a file that fails: {error}"))?;
        self.read.borrow_mut().push(InputFile::of(&path, &bytes));
        Ok(bytes)
    }

    /// What was read, in that order.
    pub fn into_read(self) -> Vec<InputFile> {
        self.read.into_inner()
    }
}
