use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::package::{REPORT, SHEET, program};
use super::settings::Settings;
use super::template::Template;
use crate::formats::{InputFile, Sha256};
use crate::mesh::SurfacePoint;

/// Version of this record.
const RECORD: u32 = 2;

/// What a folder of results was made from and holds; the same inputs and settings give the same manifest.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Manifest {
    /// Version of this record.
    pub record: u32,
    /// The program and its version.
    pub program: String,
    /// Every parameter that was used.
    pub settings: Settings,
    /// What all results share.
    pub template: TemplateEntry,
    /// The scans in their order.
    pub scans: Vec<ScanEntry>,
    /// The report's file.
    pub report: String,
    /// The comparison sheet's file.
    pub sheet: String,
}

/// The template, as a manifest tells of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TemplateEntry {
    /// Vertices of every result.
    pub vertices: usize,
    /// Triangles of every result.
    pub triangles: usize,
    /// Digest of the triangles' indices, as little-endian 32-bit numbers in their order.
    pub triangles_sha256: Sha256,
    /// Where each landmark lies on the shared triangles.
    pub landmarks: BTreeMap<String, LandmarkEntry>,
}

/// A landmark on the shared triangles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LandmarkEntry {
    /// Its triangle.
    pub triangle: u32,
    /// Barycentric weights of the triangle's corners.
    pub weights: [f64; 3],
}

/// One scan and its result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScanEntry {
    /// The scan's name.
    pub name: String,
    /// Every file it was read from.
    pub inputs: Vec<InputEntry>,
    /// Every file of its result.
    pub outputs: Vec<OutputEntry>,
}

/// A file that was written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutputEntry {
    /// Its name.
    pub file: String,
    /// The digest of its bytes.
    pub sha256: Sha256,
}

/// A file that was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InputEntry {
    /// Its path, from the collection's folder where it lies within.
    pub file: String,
    /// Its size in bytes.
    pub size: u64,
    /// The digest of its bytes.
    pub sha256: Sha256,
}

impl Manifest {
    /// What is told of scans that were registered with these settings.
    pub fn of(settings: &Settings, template: &Template, scans: Vec<ScanEntry>) -> Self {
        Self {
            record: RECORD,
            program: program(),
            settings: settings.clone(),
            template: TemplateEntry::of(template),
            scans,
            report: REPORT.to_owned(),
            sheet: SHEET.to_owned(),
        }
    }
}

impl TemplateEntry {
    /// What is told of a template.
    pub fn of(template: &Template) -> Self {
        let indices: Vec<u8> = template.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
        Self {
            vertices: template.positions.len(),
            triangles: template.triangles.len(),
            triangles_sha256: Sha256::of(&indices),
            landmarks: template.landmarks.iter().map(|(name, at)| (name.clone(), at.into())).collect(),
        }
    }
}

impl From<&SurfacePoint> for LandmarkEntry {
    fn from(point: &SurfacePoint) -> Self {
        Self { triangle: point.triangle.0, weights: point.weights }
    }
}

impl InputEntry {
    /// What is told of a file of the collection in the folder `root`.
    pub fn of(input: &InputFile, root: &Path) -> Self {
        let within = input.path.strip_prefix(root).unwrap_or(&input.path);
        Self { file: within.display().to_string(), size: input.size, sha256: input.sha256 }
    }
}
