//! What a registration leaves behind: each scan's result, the manifest, the report and the comparison sheet.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;
use serde_json::{Value, json};

use super::comparison::comparison_sheet;
use super::frozen::{FrozenCollection, FrozenError};
use super::manifest::{InputEntry, Manifest, OutputEntry, ScanEntry, TemplateEntry};
use super::membership::FailedScan;
use super::output::{OutputFormat, Outputs, ResultMesh};
use super::precheck::Precheck;
use super::register::{Registration, Subject};
use super::report::{Report, ScanReport, position};
use super::settings::Settings;
use crate::formats::{FormatError, InputFile, Sha256, write_whole};
use crate::mesh::{MeshError, TriangleMesh};
use crate::picture::PictureError;

/// Version of manifest and report.
const RECORD: u32 = 2;
const MANIFEST: &str = "manifest.json";
const REPORT: &str = "report.json";
const SHEET: &str = "sheet.png";
const TEMPLATE: &str = "template.frozen.glb";
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
        let results = self.results()?;
        let scans = self
            .subjects
            .par_iter()
            .zip(self.prechecks)
            .zip(&results)
            .zip(&self.registration.confidence)
            .map(|(((subject, precheck), result), confidence)| {
                let report =
                    ScanReport::of(subject, precheck, result, confidence, &self.registration.template);
                let outputs = self.write_outputs(folder, subject, result, &report, confidence)?;
                Ok((report, outputs))
            })
            .collect::<Result<Vec<_>, PackageError>>()?;
        self.copy_companions(folder)?;
        let Registration { template, .. } = self.registration;
        let frozen = FrozenCollection { template: template.clone(), settings: self.settings.clone() };
        write_whole(folder.join(TEMPLATE), &frozen.glb_bytes()?)?;
        write_whole(folder.join(SHEET), &comparison_sheet(self.subjects, &results).png_bytes()?)?;
        let (scans, outputs): (Vec<_>, Vec<_>) = scans.into_iter().unzip();
        let seconds = self.seconds(start.elapsed().as_secs_f64());
        let failed = self.failed.to_vec();
        let report = Report { record: RECORD, program: program(), seconds, scans, failed };
        write_json(&folder.join(REPORT), &report)?;
        write_json(&folder.join(MANIFEST), &self.manifest(outputs))?;
        Ok(report)
    }

    fn results(&self) -> Result<Vec<TriangleMesh>, PackageError> {
        let Registration { template, members, .. } = self.registration;
        let result = |(subject, positions): (&Subject, &Vec<DVec3>)| {
            TriangleMesh::new(positions.clone(), template.triangles.clone())
                .map_err(|error| PackageError::Result { name: subject.name.clone(), error })
        };
        self.subjects.iter().zip(members).map(result).collect()
    }

    fn write_outputs(
        &self,
        folder: &Path,
        subject: &Subject,
        result: &TriangleMesh,
        report: &ScanReport,
        confidence: &[f32],
    ) -> Result<Vec<OutputEntry>, FormatError> {
        let confidence: Vec<f64> = confidence.iter().copied().map(f64::from).collect();
        let mesh = ResultMesh {
            name: &subject.name,
            mesh: result,
            texture_coordinates: self.registration.template.texture_coordinates.as_deref(),
            figures: vec![("residual", &report.fidelity.residuals), ("confidence", &confidence)],
            extras: self.extras(result),
        };
        let write = |(format, file): (OutputFormat, String)| {
            let bytes = mesh.bytes(format, self.outputs.source).map_err(|error| error.in_file(&file))?;
            write_whole(folder.join(&file), &bytes)?;
            Ok(OutputEntry { file, sha256: Sha256::of(&bytes) })
        };
        self.outputs.files(&subject.name).into_iter().map(write).collect()
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

    /// The template's landmarks on a result, as landmark files have them and with their places on the triangles.
    fn extras(&self, result: &TriangleMesh) -> Value {
        let landmarks = self.registration.template.landmarks.iter().map(|(name, at)| {
            let on_result = position(result, at).to_array();
            json!({ "name": name, "position": on_result, "triangle": at.triangle.0, "weights": at.weights })
        });
        let landmarks: Vec<Value> = landmarks.collect();
        match &self.registration.template.scheme {
            Some(scheme) => json!({ "scheme": scheme, "landmarks": landmarks }),
            None => json!({ "landmarks": landmarks }),
        }
    }

    fn seconds(&self, writing: f64) -> BTreeMap<String, f64> {
        let stages = self.registration.seconds.iter().map(|(stage, &seconds)| (stage.to_string(), seconds));
        let around = [("read", self.reading), ("write", writing)];
        stages.chain(around.map(|(name, seconds)| (name.to_owned(), seconds))).collect()
    }

    fn manifest(&self, outputs: Vec<Vec<OutputEntry>>) -> Manifest {
        let entry = |((subject, inputs), outputs): ((&Subject, &Vec<InputFile>), _)| ScanEntry {
            name: subject.name.clone(),
            inputs: inputs.iter().map(|input| InputEntry::of(input, self.root)).collect(),
            outputs,
        };
        Manifest {
            record: RECORD,
            program: program(),
            settings: self.settings.clone(),
            template: TemplateEntry::of(&self.registration.template),
            scans: self.subjects.iter().zip(self.inputs).zip(outputs).map(entry).collect(),
            report: REPORT.to_owned(),
            sheet: SHEET.to_owned(),
        }
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

fn program() -> String {
    format!("onemesh {}", env!("CARGO_PKG_VERSION"))
}

fn write_json(path: &Path, record: &impl serde::Serialize) -> Result<(), FormatError> {
    let mut text = serde_json::to_string_pretty(record).expect("records are plain numbers and names");
    text.push('\n');
    write_whole(path, text.as_bytes())
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
