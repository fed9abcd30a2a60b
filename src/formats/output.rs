use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

use super::error::{Fault, FormatError};

/// Writes a file whole or not at all: under another name beside it, then renamed. What was there before stays until then.
///
/// # Errors
/// [`FormatError`] where the file cannot be written; nothing is left of it.
pub fn write_whole(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), FormatError> {
    let path = path.as_ref();
    write(path, bytes).map_err(|error| FormatError::from(Fault::Unwritable(error)).in_file(path))
}

fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let name = path.file_name().ok_or_else(|| io::Error::other("it does not name a file"))?;
    // Named by the process, so that two of them do not write into one file.
    let unfinished = path.with_file_name(format!(".{}.{}.part", name.to_string_lossy(), std::process::id()));
    let written = write_through(&unfinished, bytes).and_then(|()| fs::rename(&unfinished, path));
    if written.is_err() {
        // The first error is the one to tell.
        let _ = fs::remove_file(&unfinished);
    }
    written
}

fn write_through(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn replaces_a_file_and_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_whole(&path, b"one").unwrap();
        write_whole(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        fs::create_dir(folder.path().join("b.txt")).unwrap();
        let error = write_whole(folder.path().join("b.txt"), b"three").unwrap_err();
        assert!(error.to_string().contains("b.txt: cannot be written"), "{error}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    }
}
