use std::fs::File;
use std::io::{self, Read, Seek};
use std::path::Path;

use bytes::Bytes;

use super::archive::unpack;
use super::fault::{Part, ScanFault};
use super::limits::ScanLimits;
use super::picture::check_picture;
use super::record::{MeshKind, ScanParts};
use crate::formats::{Fault, FormatError, LandmarkFile, MaskFile, MeshFile};
use crate::job::blobs::Blobs;
use crate::job::store_error::StoreError;
use crate::mesh::{FilePoints, LandmarkSet, Points};
use crate::pipeline::Subject;
use crate::preflight::Inspection;

/// A scan's files: the mesh to be read a piece at a time, the others as bytes.
#[derive(Debug)]
pub struct ScanFiles {
    /// What the mesh's bytes are.
    pub kind: MeshKind,
    /// The mesh, or the zip that holds it.
    pub mesh: File,
    /// The landmarks.
    pub landmarks: Option<Bytes>,
    /// The mask.
    pub mask: Option<Bytes>,
    /// The texture.
    pub texture: Option<Bytes>,
}

/// A scan's files as they were understood.
#[derive(Debug, Clone)]
pub struct ReadScan {
    /// The mesh and all that its file says.
    pub file: MeshFile<FilePoints>,
    /// The landmarks, in the mesh's space.
    pub landmarks: Option<LandmarkSet>,
    /// How much each vertex counts as data `[N]`, 0 to 1.
    pub mask: Option<Vec<f32>>,
}

impl ScanFiles {
    /// The files of a scan out of the store.
    ///
    /// # Errors
    /// As [`Blobs::read`].
    pub async fn fetch(blobs: &Blobs, parts: &ScanParts) -> Result<Self, StoreError> {
        let mut others = [None, None, None];
        for (other, digest) in others.iter_mut().zip([parts.landmarks, parts.mask, parts.texture]) {
            if let Some(digest) = digest {
                *other = Some(blobs.read(digest).await?);
            }
        }
        let [landmarks, mask, texture] = others;
        Ok(Self { kind: parts.kind, mesh: blobs.open_file(parts.mesh).await?, landmarks, mask, texture })
    }

    /// Reads all of them, which takes long: not on an async thread. `scratch` is a folder that a zip is unpacked in.
    ///
    /// # Errors
    /// [`ScanFault`] says which file is wrong, where, and what to do.
    pub fn read(&self, limits: &ScanLimits, scratch: &Path) -> Result<ReadScan, ScanFault> {
        if let Some(texture) = &self.texture {
            check_picture(texture, Part::Texture, limits.texture_pixels)?;
        }
        let file = self.mesh_file(limits, scratch)?;
        check_count(file.mesh.points().count(), "vertices", limits.vertices)?;
        check_count(file.mesh.triangles().len(), "triangles", limits.triangles)?;
        let unreadable = |part| move |error| ScanFault::Unreadable { part, error };
        let landmarks = self.landmarks.as_deref();
        let landmarks = landmarks.map(|bytes| LandmarkFile::parse(bytes).and_then(|marks| marks.on(&file)));
        let landmarks = landmarks.transpose().map_err(unreadable(Part::Landmarks))?;
        let mask = self.mask.as_deref().map(|bytes| {
            if imagesize::image_type(bytes).is_ok() {
                check_picture(bytes, Part::Mask, limits.texture_pixels)?;
            }
            let none = LandmarkSet::default();
            let mask =
                MaskFile::parse(bytes).and_then(|mask| mask.on(&file, landmarks.as_ref().unwrap_or(&none)));
            mask.map_err(unreadable(Part::Mask))
        });
        let mask = mask.transpose()?;
        Ok(ReadScan { file, landmarks, mask })
    }

    /// All bytes of the mesh, or of the zip that holds it.
    ///
    /// # Errors
    /// [`ScanFault::Scratch`].
    pub fn mesh_bytes(&self) -> Result<Vec<u8>, ScanFault> {
        let mut bytes = Vec::new();
        self.mesh_start().and_then(|mut mesh| mesh.read_to_end(&mut bytes)).map_err(ScanFault::Scratch)?;
        Ok(bytes)
    }

    fn mesh_start(&self) -> io::Result<&File> {
        (&self.mesh).rewind()?;
        Ok(&self.mesh)
    }

    fn mesh_file(&self, limits: &ScanLimits, scratch: &Path) -> Result<MeshFile<FilePoints>, ScanFault> {
        let unreadable = |error: FormatError| match error.fault() {
            Fault::Unreadable(_) => ScanFault::Scratch(io::Error::other(error)),
            _ => ScanFault::Unreadable { part: Part::Mesh, error },
        };
        let mesh = self.mesh_start().map_err(ScanFault::Scratch)?;
        let extension = match self.kind {
            MeshKind::Zip => {
                let folder = tempfile::tempdir_in(scratch).map_err(ScanFault::Scratch)?;
                let mesh = unpack(mesh, folder.path(), limits)?;
                let name = mesh.file_name().unwrap_or_default().to_owned();
                let mut file = MeshFile::look_at(&mesh).map_err(|error| unreadable(error.of_file(name)))?;
                // The folder's path means nothing to whoever sent the zip.
                let path = format!("{}/", folder.path().display());
                file.warnings.iter_mut().for_each(|warning| *warning = warning.replace(&path, ""));
                return Ok(file);
            }
            kind => kind.extension(),
        };
        let length = mesh.metadata().map_err(ScanFault::Scratch)?.len();
        MeshFile::look_into(mesh, length, Some(extension)).map_err(unreadable)
    }
}

impl ReadScan {
    /// What is known of it before it is registered.
    pub fn inspect(&self) -> Inspection {
        Inspection::new(&self.file.mesh, self.landmarks.as_ref())
    }

    /// The scan to be registered, by the name that it has in the collection; without landmarks it has none.
    pub fn into_subject(self, name: String) -> Subject {
        let Self { file, landmarks, mask } = self;
        Subject { name, mesh: file.mesh.into(), landmarks: landmarks.unwrap_or_default(), mask }
    }
}

fn check_count(found: usize, what: &'static str, limit: usize) -> Result<(), ScanFault> {
    if found <= limit {
        return Ok(());
    }
    let (found, limit) = (found as u64, limit as u64);
    Err(ScanFault::TooLarge { part: Part::Mesh, what, found, limit, remedy: "decimate the mesh" })
}
