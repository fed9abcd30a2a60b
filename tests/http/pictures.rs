//! A small capture that a mesh comes of within seconds.

use std::io::Write;
use std::path::{Path, PathBuf};

use onemesh::demo::{Sculptor, Settings};
use onemesh::formats::{Encoding, write_capture};
use onemesh::pipeline::{CaptureSettings, Shown, capture};
use onemesh::render::{AdapterChoice, open};

/// Parameters that make an inverse rendering take a second.
pub const QUICK: &str = "vertices=642&parameters=%7B%22hull_cells%22%3A24%2C%22levels.0.iterations%22%3A8%7D";

/// A capture's folder: `transforms.json` and eight silhouettes of a head in `images/`.
pub fn folder(views: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let small = Settings { triangles: 3000, ..Settings::default() };
    let mesh = Sculptor::new(7).with(small).collection(1, &[1.0]).remove(0).mesh;
    let mut renderer = open(&AdapterChoice::Reference).unwrap();
    let settings = CaptureSettings { views, size: 48, shown: Shown::Silhouette, samples: 1 };
    let photographs = capture(&mesh, &settings, &mut *renderer, &()).unwrap();
    write_capture(folder.path(), &photographs, Encoding::Linear).unwrap();
    folder
}

/// The files of a folder, by their paths in it.
pub fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut files = Vec::new();
    let mut waiting = vec![folder.to_owned()];
    while let Some(path) = waiting.pop() {
        if path.is_dir() {
            waiting.extend(std::fs::read_dir(&path).unwrap().map(|entry| entry.unwrap().path()));
        } else {
            files.push((path.strip_prefix(folder).unwrap().to_owned(), std::fs::read(&path).unwrap()));
        }
    }
    files.sort();
    files
}

/// A zip of files.
pub fn zip(files: &[(PathBuf, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (path, bytes) in files {
        let name = path.to_string_lossy();
        zip.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// The same as a form, whose boundary is `b`.
pub fn form(files: &[(PathBuf, Vec<u8>)]) -> Vec<u8> {
    let mut form = Vec::new();
    for (path, bytes) in files {
        let field = if path.starts_with("images") { "images" } else { "cameras" };
        let name = path.file_name().unwrap().to_string_lossy();
        let head =
            format!("--b\r\nContent-Disposition: form-data; name=\"{field}\"; filename=\"{name}\"\r\n\r\n");
        form.extend_from_slice(head.as_bytes());
        form.extend_from_slice(bytes);
        form.extend_from_slice(b"\r\n");
    }
    form.extend_from_slice(b"--b--\r\n");
    form
}
