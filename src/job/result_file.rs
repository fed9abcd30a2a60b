use super::scan::ScanId;
use crate::pipeline::{MANIFEST, REPORT, SHEET, TEMPLATE};

/// A file of results; it never changes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ResultFile {
    /// The shared triangles on a scan, `meshes/{scan}.glb`.
    Mesh(ScanId),
    /// `manifest.json`.
    Manifest,
    /// `report.json`.
    Report,
    /// `landmarks.json`: the landmarks on every result, and the audit.
    Landmarks,
    /// `template.frozen.glb`.
    Template,
    /// `sheet.png`.
    Sheet,
    /// `mesh.glb`: the mesh from pictures.
    Object,
}

impl ResultFile {
    /// Where it is beneath the job: `meshes/{scan}.glb`, `manifest.json`, ...
    pub fn path(&self) -> String {
        match self {
            Self::Mesh(scan) => format!("meshes/{scan}.glb"),
            Self::Manifest => MANIFEST.to_owned(),
            Self::Report => REPORT.to_owned(),
            Self::Landmarks => "landmarks.json".to_owned(),
            Self::Template => TEMPLATE.to_owned(),
            Self::Sheet => SHEET.to_owned(),
            Self::Object => "mesh.glb".to_owned(),
        }
    }
}
