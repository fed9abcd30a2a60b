use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, ensure};
use onemesh::formats::{Collection, CollectionError, InputFile, Refused, Scan};
use onemesh::pipeline::{
    FailedScan, Outputs, Package, Registration, Report, Settings, Subject, Template, leave_out, precheck,
    register, register_to, spare_inputs,
};
use rayon::prelude::*;

use super::findings::warn;
use super::formats::Formats;
use super::parameters::Parameters;
use super::progress::ProgressBars;
use super::summary::Summary;
use super::template::{GivenTemplate, TemplateFiles};

/// Registers a collection: the same triangles on every scan.
///
/// A scan that cannot be read, or has too few landmarks in common with the others or with the template, is left out: it
/// is named on the error stream and under `failed` in report.json, the others are delivered, and the exit code is 3. It
/// is 1 where nothing is delivered.
#[derive(Debug, clap::Args)]
pub struct Register {
    /// A folder of `NAME/scan.ply` with `NAME/landmarks.json`, or of `NAME.ply` with `NAME.landmarks.json`; or a JSON
    /// manifest that names them
    collection: PathBuf,
    /// The folder to write to: `NAME.glb`, or as --format says, for each scan, manifest.json, report.json, sheet.png
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    #[command(flatten)]
    template: TemplateFiles,
    #[command(flatten)]
    formats: Formats,
    #[command(flatten)]
    parameters: Parameters,
}

impl Register {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        let start = Instant::now();
        let GivenTemplate { template, settings, source } = self.template.read()?;
        let settings = match settings {
            Some(settings) => self.parameters.over_frozen(settings)?,
            None => self.parameters.for_registration()?,
        };
        let formats = self.formats.of_registration(source.as_ref())?;
        let outputs = Outputs { formats: &formats, source: source.as_ref() };
        register_collection(&self.collection, &self.output, template.as_ref(), outputs, &settings)?;
        let summary = Summary::of(&self.output)?;
        summary.print(&self.output, start.elapsed());
        summary.conclude(&self.collection, 0)
    }
}

/// A registered collection that has been written.
pub struct Outcome {
    /// The scans.
    pub subjects: Vec<Subject>,
    /// Their results.
    pub registration: Registration,
    /// How well it went.
    pub report: Report,
}

/// Reads a collection, registers it and writes the results to a folder.
pub fn register_collection(
    collection: &Path,
    output: &Path,
    template: Option<&Template>,
    outputs: Outputs,
    settings: &Settings,
) -> anyhow::Result<Outcome> {
    let start = Instant::now();
    let bars = ProgressBars::new();
    let spinner = bars.spinner("reading");
    let reading = read(collection)?;
    let Reading { subjects, inputs, failed } = reading.registrable(template);
    let seconds = start.elapsed().as_secs_f64();
    spinner.finish_and_clear();
    failed.iter().for_each(|FailedScan { name, problem }| remark!("{name}: left out: {problem}"));
    ensure!(!subjects.is_empty(), "{}: no scan is left to register", collection.display());
    spare_inputs(output, &subjects, &inputs, &outputs)?;
    let prechecks = precheck(&subjects);
    for (subject, precheck) in subjects.iter().zip(&prechecks) {
        warn(&subject.name, &precheck.findings);
    }
    let registration = match template {
        Some(template) => register_to(template, &subjects, settings, &bars),
        None => register(&subjects, settings, &bars),
    };
    let registration = registration.with_context(|| collection.display().to_string())?;
    let spinner = bars.spinner("writing");
    let root = if collection.is_dir() { collection } else { collection.parent().unwrap_or(Path::new("")) };
    let package = Package {
        subjects: &subjects,
        inputs: &inputs,
        prechecks: &prechecks,
        root,
        settings,
        registration: &registration,
        outputs,
        failed: &failed,
        reading: seconds,
    };
    let report = package.write(output)?;
    spinner.finish_and_clear();
    Ok(Outcome { subjects, registration, report })
}

/// A collection that has been read.
pub struct Reading {
    /// The scans.
    pub subjects: Vec<Subject>,
    /// The files each was read from.
    pub inputs: Vec<Vec<InputFile>>,
    /// The scans that cannot be used.
    pub failed: Vec<FailedScan>,
}

/// Reads the scans of a collection as far as they can be read.
pub fn read(collection: &Path) -> anyhow::Result<Reading> {
    let (collection, refused) = Collection::open_usable(collection)?;
    let failed = |name: &str, error: &CollectionError| FailedScan {
        name: name.to_owned(),
        problem: error.to_string(),
    };
    let mut reading = Reading { subjects: Vec::new(), inputs: Vec::new(), failed: Vec::new() };
    reading.failed.extend(refused.into_iter().map(|Refused { name, error }| failed(&name, &error)));
    let scans: Vec<_> = collection.members().par_iter().map(|member| (&member.name, member.read())).collect();
    for (name, scan) in scans {
        match scan {
            Ok(Scan { name, mesh, landmarks, mask, inputs }) => {
                reading.subjects.push(Subject { name, mesh, landmarks, mask });
                reading.inputs.push(inputs);
            }
            Err(error) => reading.failed.push(failed(name, &error)),
        }
    }
    Ok(reading)
}

impl Reading {
    /// Without the scans that cannot be registered with the others, or from the template.
    fn registrable(mut self, template: Option<&Template>) -> Self {
        let scans: Vec<_> = self.subjects.iter().map(|s| (s.name.as_str(), &s.landmarks)).collect();
        let left_out = leave_out(&scans, template);
        let stays = |subject: &Subject| left_out.iter().all(|failed| failed.name != subject.name);
        let (subjects, inputs) =
            self.subjects.into_iter().zip(self.inputs).filter(|(subject, _)| stays(subject)).unzip();
        self.failed.extend(left_out);
        self.failed.sort_by(|a, b| a.name.cmp(&b.name));
        Self { subjects, inputs, failed: self.failed }
    }
}
