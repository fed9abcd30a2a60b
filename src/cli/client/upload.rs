use std::fs::File;
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};

use onemesh::formats::{Fault, FormatError, MeshFile, MeshSource, Sha256, TextureImage};
use onemesh::job::scan::MeshKind;
use ureq::SendBody;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::failure::Failure;

/// A mesh as one file to send: its own, or a zip of it with what it names.
#[derive(Debug)]
pub struct MeshUpload {
    /// What the bytes are.
    pub kind: MeshKind,
    /// The digest of the bytes.
    pub sha256: Sha256,
    bytes: Bytes,
}

#[derive(Debug)]
enum Bytes {
    File(PathBuf),
    Zip(Vec<u8>),
}

/// A form of files as the service takes it, written by hand: it is sent without ever being whole in memory.
#[derive(Debug)]
pub struct Form {
    boundary: String,
    fields: Vec<Field>,
}

/// A field: what comes before its content, and the content.
struct Field {
    head: String,
    content: Box<dyn Read + Send>,
}

impl std::fmt::Debug for Field {
    fn fmt(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
        out.write_str(&self.head)
    }
}

/// A file that is small enough to be held, with its digest.
#[derive(Debug, Clone)]
pub struct Uploaded {
    /// The bytes.
    pub bytes: Vec<u8>,
    /// Their digest.
    pub sha256: Sha256,
}

impl From<Vec<u8>> for Uploaded {
    fn from(bytes: Vec<u8>) -> Self {
        Self { sha256: Sha256::of(&bytes), bytes }
    }
}

impl MeshUpload {
    /// Reads a mesh, and finds what it names.
    ///
    /// # Errors
    /// As [`MeshSource::read`]; [`FormatError`] too where what it names cannot be read.
    pub fn read(path: &Path) -> Result<(Self, MeshFile), FormatError> {
        let source = MeshSource::read(path)?;
        let kind = MeshKind::ALL.into_iter().find(|kind| kind.extension() == source.extension());
        let own = source.inputs[0].sha256;
        let mut named: Vec<PathBuf> = source.inputs[1..].iter().map(|input| input.path.clone()).collect();
        let images = source.file.texture.iter().flat_map(|texture| &texture.images);
        named.extend(images.filter_map(|image| match image {
            TextureImage::File(path) => Some(path.clone()),
            TextureImage::Embedded { .. } => None,
        }));
        named.sort();
        named.dedup();
        let upload = if named.is_empty() {
            let kind = kind.unwrap_or(MeshKind::Ply);
            Self { kind, sha256: own, bytes: Bytes::File(path.to_owned()) }
        } else {
            let zip = zip_of(path, &named).map_err(|error| unreadable(path, error))?;
            Self { kind: MeshKind::Zip, sha256: Sha256::of(&zip), bytes: Bytes::Zip(zip) }
        };
        Ok((upload, source.file))
    }

    /// Its bytes, to be read while they are sent.
    ///
    /// # Errors
    /// [`Failure::File`].
    pub fn open(&self) -> Result<Box<dyn Read + Send>, Failure> {
        Ok(match &self.bytes {
            Bytes::File(path) => Box::new(File::open(path).map_err(|error| Failure::file(path, error))?),
            Bytes::Zip(bytes) => Box::new(Cursor::new(bytes.clone())),
        })
    }
}

/// A file that cannot be read.
pub fn unreadable(path: &Path, error: std::io::Error) -> FormatError {
    FormatError::from(Fault::Unreadable(error)).in_file(path)
}

/// A zip of a mesh and files beneath its folder, the same bytes every time.
fn zip_of(mesh: &Path, named: &[PathBuf]) -> std::io::Result<Vec<u8>> {
    let folder = mesh.parent().unwrap_or(Path::new(""));
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    // Pictures are packed already.
    let options = SimpleFileOptions::DEFAULT.compression_method(CompressionMethod::Stored);
    for path in std::iter::once(mesh).chain(named.iter().map(PathBuf::as_path)) {
        let name = path.strip_prefix(folder).unwrap_or(path).to_string_lossy().replace('\\', "/");
        zip.start_file(name, options)?;
        std::io::copy(&mut File::open(path)?, &mut zip)?;
    }
    zip.flush()?;
    Ok(zip.finish()?.into_inner())
}

impl Form {
    /// One without fields.
    pub fn new() -> Self {
        Self { boundary: format!("onemesh-{}", uuid::Uuid::new_v4().simple()), fields: Vec::new() }
    }

    /// What `Content-Type` has to say.
    pub fn content_type(&self) -> String {
        format!("multipart/form-data; boundary={}", self.boundary)
    }

    /// With a text.
    pub fn text(self, name: &str, text: &str) -> Self {
        let head = format!("Content-Disposition: form-data; name=\"{name}\"");
        self.field(head, Box::new(Cursor::new(text.to_owned())))
    }

    /// With a mesh.
    ///
    /// # Errors
    /// [`Failure::File`] if it is no longer there.
    pub fn mesh(self, mesh: &MeshUpload) -> Result<Self, Failure> {
        let (extension, media_type) = (mesh.kind.extension(), mesh.kind.media_type());
        let head = format!(
            "Content-Disposition: form-data; name=\"mesh\"; filename=\"mesh.{extension}\"\r\nContent-Type: {media_type}"
        );
        Ok(self.field(head, mesh.open()?))
    }

    /// With the bytes of a file.
    pub fn file(self, name: &str, bytes: &[u8]) -> Self {
        let head = format!(
            "Content-Disposition: form-data; name=\"{name}\"; filename=\"{name}\"\r\nContent-Type: application/octet-stream"
        );
        self.field(head, Box::new(Cursor::new(bytes.to_vec())))
    }

    fn field(mut self, head: String, content: Box<dyn Read + Send>) -> Self {
        let head = format!("--{}\r\n{head}\r\n\r\n", self.boundary);
        self.fields.push(Field { head, content });
        self
    }

    /// The whole as a body to be sent.
    pub fn into_body(self) -> SendBody<'static> {
        let end: Box<dyn Read + Send> = Box::new(Cursor::new(format!("--{}--\r\n", self.boundary)));
        let body = self.fields.into_iter().rev().fold(end, |rest, Field { head, content }| {
            Box::new(Cursor::new(head).chain(content).chain(Cursor::new("\r\n")).chain(rest))
        });
        SendBody::from_owned_reader(body)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn forms_are_as_multipart_has_them() {
        let form = Form::new().text("name", "amy").file("landmarks", b"{}");
        let boundary = form.boundary.clone();
        assert!(form.content_type().ends_with(&boundary));
        let mut text = String::new();
        form.into_body().into_reader().read_to_string(&mut text).unwrap();
        let expected = format!(
            "--{boundary}\r\nContent-Disposition: form-data; name=\"name\"\r\n\r\namy\r\n\
             --{boundary}\r\nContent-Disposition: form-data; name=\"landmarks\"; filename=\"landmarks\"\r\n\
             Content-Type: application/octet-stream\r\n\r\n{{}}\r\n--{boundary}--\r\n"
        );
        assert_eq!(text, expected);
    }

    #[test]
    fn what_a_mesh_names_goes_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let mesh = folder.path().join("a.obj");
        let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n";
        fs::write(&mesh, format!("{triangle}f 1/1 2/2 3/3\n")).unwrap();
        let (alone, _) = MeshUpload::read(&mesh).unwrap();
        assert_eq!((alone.kind, alone.sha256), (MeshKind::Obj, Sha256::of(&fs::read(&mesh).unwrap())));

        fs::create_dir(folder.path().join("maps")).unwrap();
        fs::write(folder.path().join("maps/skin.png"), "picture").unwrap();
        fs::write(folder.path().join("a.mtl"), "newmtl skin\nmap_Kd maps/skin.png\n").unwrap();
        fs::write(&mesh, format!("mtllib a.mtl\n{triangle}usemtl skin\nf 1/1 2/2 3/3\n")).unwrap();
        let (packed, _) = MeshUpload::read(&mesh).unwrap();
        assert_eq!(packed.kind, MeshKind::Zip);
        assert_eq!(packed.sha256, MeshUpload::read(&mesh).unwrap().0.sha256);
        let mut bytes = Vec::new();
        packed.open().unwrap().read_to_end(&mut bytes).unwrap();
        let zip = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
        let mut names: Vec<_> = zip.file_names().map(Result::unwrap).collect();
        names.sort_unstable();
        assert_eq!(names, ["a.mtl", "a.obj", "maps/skin.png"]);
    }
}
