//! What a registration leaves behind: each scan's result, the manifest, the report and the comparison sheet.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;

use super::comparison::{ComparisonRow, MOST_ROWS, comparison_row, comparison_sheet};
use super::frozen::{FrozenCollection, FrozenError};
use super::manifest::{InputEntry, Manifest, OutputEntry, ScanEntry};
use super::membership::FailedScan;
use super::output::{OutputFormat, Outputs};
use super::precheck::Precheck;
use super::register::{Registration, Subject};
use super::report::{Report, ScanReport};
use super::scan_result::ScanResult;
use super::settings::Settings;
use crate::formats::{FormatError, InputFile, Sha256, write_whole};
use crate::mesh::{MeshError, TriangleMesh};
use crate::picture::PictureError;

/// What the files of a set are called, beside those of its scans.
pub const MANIFEST: &str = "manifest.json";
/// How well it went.
pub const REPORT: &str = "report.json";
/// Pictures.
pub const SHEET: &str = "sheet.png";
/// What further scans are registered from.
pub const TEMPLATE: &str = "template.frozen.glb";
/// The files that are not of one scan.
const OWN: [&str; 4] = [MANIFEST, REPORT, SHEET, TEMPLATE];

/// A registered collection on its way to disk.
#[derive(Debug, Clone)]
pub struct Package<'a> {
    /// The scans.
    pub subjects: &'a [Subject],
    /// The files each was read from.
    pub inputs: &'a [Vec<InputFile>],
    /// What was known of each before.
    pub prechecks: &'a [Precheck],
    /// The folder of the collection; the manifest names its files from there.
    pub root: &'a Path,
    /// What was used.
    pub settings: &'a Settings,
    /// The results.
    pub registration: &'a Registration,
    /// What is written for each.
    pub outputs: Outputs<'a>,
    /// The scans that were left out.
    pub failed: &'a [FailedScan],
    /// How long the scans took to read.
    pub reading: f64,
}

/// Why results cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum PackageError {
    /// The folder cannot be made.
    #[error("{}: cannot be made a folder: {error}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// A result would take the place of a scan or of the template.
    #[error("{}: is a file of the collection or the template and would be overwritten: choose another folder", path.display())]
    Overwrites {
        /// The file.
        path: PathBuf,
    },
    /// A file that the template names cannot lie beside the results.
    #[error(
        "{}: is named by the template, and cannot be copied to {}: {problem}; or leave `template` out of --format",
        path.display(), to.display()
    )]
    Companion {
        /// The file.
        path: PathBuf,
        /// Where it should be.
        to: PathBuf,
        /// Why not.
        problem: String,
    },
    /// A result is no mesh.
    #[error("the result of scan `{name}` cannot be kept: {error}")]
    Result {
        /// The scan.
        name: String,
        /// What is wrong with it.
        error: MeshError,
    },
    /// A file cannot be written.
    #[error(transparent)]
    File(#[from] FormatError),
    /// The template cannot be kept.
    #[error(transparent)]
    Frozen(#[from] FrozenError),
    /// The sheet cannot be drawn.
    #[error(transparent)]
    Picture(#[from] PictureError),
}

impl Package<'_> {
    /// Writes everything to `folder`, which is made where it is not there: the outputs for each scan, in the scan's own
    /// space and units, `template.frozen.glb`, `sheet.png`, `report.json`, and last `manifest.json`. Every file is written whole or not at all.
    ///
    /// # Errors
    /// [`PackageError`] names the file or the scan.
    pub fn write(&self, folder: &Path) -> Result<Report, PackageError> {
        let start = Instant::now();
        fs::create_dir_all(folder)
            .map_err(|error| PackageError::Folder { path: folder.to_owned(), error })?;
        spare_inputs(folder, self.subjects, self.inputs, &self.outputs)?;
        let scans = (0..self.subjects.len()).into_par_iter().map(|at| self.write_scan(folder, at));
        let scans = scans.collect::<Result<Vec<_>, PackageError>>()?;
        self.copy_companions(folder)?;
        let Registration { template, .. } = self.registration;
        let frozen = FrozenCollection { template: template.clone(), settings: self.settings.clone() };
        write_whole(folder.join(TEMPLATE), &frozen.glb_bytes()?)?;
        let (mut reports, mut entries, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        for (report, entry, row) in scans {
            reports.push(report);
            entries.push(entry);
            rows.extend(row);
        }
        write_whole(folder.join(SHEET), &comparison_sheet(rows, self.subjects.len()).png_bytes()?)?;
        let report = Report::of(self.seconds(start.elapsed().as_secs_f64()), reports, self.failed.to_vec());
        write_whole(folder.join(REPORT), &record_bytes(&report))?;
        let manifest = Manifest::of(self.settings, template, entries);
        write_whole(folder.join(MANIFEST), &record_bytes(&manifest))?;
        Ok(report)
    }

    fn write_scan(
        &self,
        folder: &Path,
        at: usize,
    ) -> Result<(ScanReport, ScanEntry, Option<ComparisonRow>), PackageError> {
        let Registration { template, members, confidence, .. } = self.registration;
        let (subject, confidence) = (&self.subjects[at], &confidence[at]);
        let result = ScanResult::of(subject, &self.prechecks[at], template, &members[at], confidence)?;
        let write = |(format, file): (OutputFormat, String)| {
            let bytes = result.bytes(format, self.outputs.source).map_err(|error| error.in_file(&file))?;
            write_whole(folder.join(&file), &bytes)?;
            Ok(OutputEntry { file, sha256: Sha256::of(&bytes) })
        };
        let outputs: Result<Vec<OutputEntry>, PackageError> =
            self.outputs.files(&subject.name).into_iter().map(write).collect();
        let entry = ScanEntry {
            name: subject.name.clone(),
            inputs: self.inputs[at].iter().map(|input| InputEntry::of(input, self.root)).collect(),
            outputs: outputs?,
        };
        let row = (at < MOST_ROWS).then(|| comparison_row(subject, &result.mesh));
        Ok((result.report, entry, row))
    }

    /// Copies what results in the template's own format name to where they look for it; what is there already stays.
    fn copy_companions(&self, folder: &Path) -> Result<(), PackageError> {
        for (name, path) in self.outputs.companions() {
            let to = folder.join(&name);
            let failed =
                |problem: String| PackageError::Companion { path: path.clone(), to: to.clone(), problem };
            if is_same(&path, &to) {
                continue;
            }
            let results = self.subjects.iter().flat_map(|subject| self.outputs.files(&subject.name));
            let results = results.map(|(_, file)| file).chain(OWN.map(str::to_owned));
            if results.map(PathBuf::from).any(|file| file == name) {
                return Err(failed("a result has that name: rename it, and in the template".to_owned()));
            }
            let made = to.parent().map_or(Ok(()), fs::create_dir_all);
            let bytes = made.and_then(|()| fs::read(&path)).map_err(|error| failed(error.to_string()))?;
            write_whole(&to, &bytes)?;
        }
        Ok(())
    }

    fn seconds(&self, writing: f64) -> BTreeMap<String, f64> {
        let stages = self.registration.seconds.iter().map(|(stage, &seconds)| (stage.to_string(), seconds));
        let around = [("read", self.reading), ("write", writing)];
        stages.chain(around.map(|(name, seconds)| (name.to_owned(), seconds))).collect()
    }
}

/// Whether results can be written to `folder` and all files of the collection stay: results beside their scans might
/// have the scans' names. Worth asking before the work as well as after it.
///
/// # Errors
/// [`PackageError::Overwrites`] names the file that would not stay.
pub fn spare_inputs(
    folder: &Path,
    subjects: &[Subject],
    inputs: &[Vec<InputFile>],
    outputs: &Outputs,
) -> Result<(), PackageError> {
    let template = outputs.source.map_or(&[][..], |source| &source.inputs);
    let copied = outputs.companions();
    let outputs = subjects.iter().flat_map(|subject| outputs.files(&subject.name)).map(|(_, file)| file);
    let outputs = outputs.chain(OWN.map(str::to_owned)).map(|name| folder.join(name));
    let copies = copied.iter().map(|(name, path)| (folder.join(name), path));
    let copies = copies.filter(|(to, path)| !is_same(path, to)).map(|(to, _)| to);
    let outputs: Vec<PathBuf> =
        outputs.chain(copies).filter_map(|path| fs::canonicalize(path).ok()).collect();
    let is_output = |input: &&InputFile| fs::canonicalize(&input.path).is_ok_and(|at| outputs.contains(&at));
    match inputs.iter().flatten().chain(template).find(is_output) {
        Some(input) => Err(PackageError::Overwrites { path: input.path.clone() }),
        None => Ok(()),
    }
}

fn is_same(one: &Path, other: &Path) -> bool {
    matches!((fs::canonicalize(one), fs::canonicalize(other)), (Ok(one), Ok(other)) if one == other)
}

/// The program and its version, as records state it.
pub(super) fn program() -> String {
    format!("onemesh {}", env!("CARGO_PKG_VERSION"))
}

/// A manifest or report as its file has it.
pub fn record_bytes(record: &impl serde::Serialize) -> Vec<u8> {
    let mut text = serde_json::to_vec_pretty(record).expect("records are plain numbers and names");
    text.push(b'\n');
    text
}

/// Area-weighted vertex normals `[N, 3]`, not of unit length.
pub fn vertex_normals(mesh: &TriangleMesh) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; mesh.positions().len()];
    for corners in mesh.triangles() {
        let [a, b, c] = corners.map(|i| mesh.positions()[i as usize]);
        let normal = (b - a).cross(c - a);
        corners.iter().for_each(|&i| normals[i as usize] += normal);
    }
    normals
}
