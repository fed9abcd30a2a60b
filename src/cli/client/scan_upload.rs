use std::fs;

use onemesh::formats::{CollectionError, FormatError, LandmarkFile, MaskFile, Member, landmarks_json};
use serde::Deserialize;

use super::failure::Failure;
use super::registration::Scan;
use super::request::{Client, json};
use super::upload::{Form, MeshUpload, Uploaded, unreadable};

/// Scans that are looked for among the latest of the server, at most: more are uploaded again, which changes nothing.
const LOOKED_AT: usize = 5000;
/// Scans of a page.
const PAGE: usize = 200;

/// A scan's files, ready to be sent.
#[derive(Debug)]
pub struct ScanUpload {
    name: String,
    mesh: MeshUpload,
    landmarks: Uploaded,
    mask: Option<Uploaded>,
}

/// The scans that the server has.
#[derive(Debug, Default)]
pub struct KnownScans(Vec<KnownScan>);

/// What tells whether a scan is the same.
#[derive(Debug, Deserialize)]
struct KnownScan {
    id: String,
    name: Option<String>,
    media_type: String,
    sha256: String,
    landmarks: Option<String>,
    mask: Option<String>,
    texture: Option<String>,
}

#[derive(Deserialize)]
struct Page {
    items: Vec<KnownScan>,
    next: Option<serde_json::Value>,
}

impl KnownScans {
    /// The latest of the server's.
    ///
    /// # Errors
    /// [`Failure`].
    pub fn of(client: &Client) -> Result<Self, Failure> {
        let mut known = Vec::new();
        let mut path = format!("/v1/scans?limit={PAGE}");
        while known.len() < LOOKED_AT {
            let page: Page = client.get_json(&path)?;
            known.extend(page.items);
            let Some(next) = page.next else { break };
            let next = next.as_str().map_or_else(|| next.to_string(), str::to_owned);
            path = format!("/v1/scans?limit={PAGE}&after={next}");
        }
        Ok(Self(known))
    }
}

impl ScanUpload {
    /// Reads a scan's files, and looks whether they belong together.
    ///
    /// # Errors
    /// [`CollectionError::Scan`] with the file and what is wrong in it.
    pub fn read(member: &Member) -> Result<Self, CollectionError> {
        let read = || {
            let (mesh, file) = MeshUpload::read(&member.mesh)?;
            let path = &member.landmarks_file.path;
            let set = member.landmarks.on(&file).map_err(|error| error.in_file(path))?;
            let mut landmarks = fs::read(path).map_err(|error| unreadable(path, error))?;
            // The server knows no manifest: what that says of the scheme goes into the file.
            if LandmarkFile::parse(&landmarks)?.scheme() != member.landmarks.scheme() {
                landmarks = landmarks_json(&set).to_string().into_bytes();
            }
            let mask = member.mask.as_ref().map(|path| {
                let bytes = fs::read(path).map_err(|error| unreadable(path, error))?;
                MaskFile::parse(&bytes)
                    .and_then(|mask| mask.on(&file, &set))
                    .map_err(|error| error.in_file(path))?;
                Ok::<_, FormatError>(bytes.into())
            });
            let mask = mask.transpose()?;
            Ok(Self { name: member.name.clone(), mesh, landmarks: landmarks.into(), mask })
        };
        read().map_err(|error| CollectionError::Scan { name: member.name.clone(), error })
    }

    /// Sends it, unless the server has it.
    ///
    /// # Errors
    /// [`Failure`].
    pub fn send(&self, client: &Client, known: &KnownScans) -> Result<Scan, Failure> {
        if let Some(same) = known.0.iter().find(|scan| self.is(scan)) {
            match client.get_json(&format!("/v1/scans/{}", same.id)) {
                Err(failure) if failure.status() == Some(404) => {}
                found => return found,
            }
        }
        let scan: Scan = client.patience.persist(|| {
            let form = Form::new().text("name", &self.name).mesh(&self.mesh)?;
            let mut form = form.file("landmarks", &self.landmarks.bytes);
            if let Some(mask) = &self.mask {
                form = form.file("mask", &mask.bytes);
            }
            let content_type = form.content_type();
            json(client.post("/v1/scans", &[("content-type", &content_type)], form.into_body())?)
        })?;
        let text = |file: &Uploaded| file.sha256.to_string();
        let same =
            (&scan.landmarks, &scan.mask) == (&Some(text(&self.landmarks)), &self.mask.as_ref().map(text));
        if !same {
            return Err(Failure::Odd(format!(
                "scan {} of the same files has got other landmarks or another mask since; delete it there",
                scan.id
            )));
        }
        Ok(scan)
    }

    fn is(&self, known: &KnownScan) -> bool {
        let text = |file: &Uploaded| file.sha256.to_string();
        known.name.as_deref() == Some(&self.name)
            && known.media_type == self.mesh.kind.media_type()
            && known.sha256 == self.mesh.sha256.to_string()
            && known.landmarks == Some(text(&self.landmarks))
            && known.mask == self.mask.as_ref().map(text)
            && known.texture.is_none()
    }
}
