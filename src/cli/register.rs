use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, ensure};
use onemesh::formats::{Collection, InputFile, Scan};
use onemesh::pipeline::{
    Package, Registration, Report, Settings, Subject, Template, Verdict, precheck, register, register_to,
    spare_inputs,
};
use rayon::prelude::*;

use super::findings::warn;
use super::parameters::Parameters;
use super::progress::ProgressBars;
use super::template::TemplateFiles;

/// Registers a collection: the same triangles on every scan.
#[derive(Debug, clap::Args)]
pub struct Register {
    /// A folder of `NAME/scan.ply` with `NAME/landmarks.json`, or of `NAME.ply` with `NAME.landmarks.json`; or a JSON
    /// manifest that names them
    collection: PathBuf,
    /// The folder to write to: `NAME.glb` for each scan, manifest.json, report.json, sheet.png
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    #[command(flatten)]
    template: TemplateFiles,
    #[command(flatten)]
    parameters: Parameters,
}

impl Register {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        let (template, frozen) = self.template.read()?.unzip();
        let settings = match frozen.flatten() {
            Some(settings) => self.parameters.over_frozen(settings)?,
            None => self.parameters.for_registration()?,
        };
        let outcome = register_collection(&self.collection, &self.output, template.as_ref(), &settings)?;
        outcome.print(&self.output);
        let failed = outcome.report.count(Verdict::Fail);
        ensure!(
            failed < outcome.report.scans.len(),
            "{}: no result can be used: {}",
            self.collection.display(),
            if failed == 1 { "the only one failed".to_owned() } else { format!("all {failed} failed") }
        );
        Ok(())
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
    settings: &Settings,
) -> anyhow::Result<Outcome> {
    let start = Instant::now();
    let bars = ProgressBars::new();
    let spinner = bars.spinner("reading");
    let (subjects, inputs) = read(collection)?;
    let reading = start.elapsed().as_secs_f64();
    spinner.finish_and_clear();
    spare_inputs(output, &subjects, &inputs)?;
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
        reading,
    };
    let report = package.write(output)?;
    spinner.finish_and_clear();
    Ok(Outcome { subjects, registration, report })
}

/// The scans of a collection and the files they were read from.
pub fn read(collection: &Path) -> anyhow::Result<(Vec<Subject>, Vec<Vec<InputFile>>)> {
    let collection = Collection::open(collection)?;
    let scans: Result<Vec<Scan>, _> = collection.members().par_iter().map(|member| member.read()).collect();
    let split = |scan: Scan| {
        let Scan { name, mesh, landmarks, mask, inputs } = scan;
        (Subject { name, mesh, landmarks, mask }, inputs)
    };
    Ok(scans?.into_iter().map(split).unzip())
}

impl Outcome {
    /// Says how it went and where the results are.
    pub fn print(&self, output: &Path) {
        let widest = self.report.scans.iter().map(|scan| scan.name.len()).max().unwrap_or(0);
        for scan in &self.report.scans {
            let fidelity = &scan.fidelity;
            let median = fidelity.scan_to_mesh.map_or(f64::NAN, |distances| distances.p50);
            let worst = fidelity.scan_to_mesh.map_or(f64::NAN, |distances| distances.p99);
            println!(
                "{:widest$}  {:6}  distance median {median:.3e}, 99 % {worst:.3e}; landmarks {:.3e}; flipped {:.2} %, sliver {:.2} %",
                scan.name,
                scan.verdict,
                scan.landmark_mean,
                100.0 * fidelity.flipped,
                100.0 * fidelity.sliver,
            );
            for reason in &scan.reasons {
                println!("{:widest$}  - {}: {reason}", "", reason.verdict);
            }
        }
        let seconds: f64 = self.report.seconds.values().sum();
        let [pass, review, fail] =
            [Verdict::Pass, Verdict::Review, Verdict::Fail].map(|verdict| self.report.count(verdict));
        println!("{pass} pass, {review} to review, {fail} failed");
        println!("{} scans in {seconds:.1} s: {}", self.report.scans.len(), output.display());
        println!("look at {}", output.join("sheet.png").display());
    }
}
