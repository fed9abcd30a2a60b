use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use indicatif::{ProgressBar, ProgressStyle};
use onemesh::formats::{Collection, Member};
use onemesh::pipeline::Settings;
use rayon::prelude::*;
use serde::Deserialize;
use serde_json::Value;
use std::time::Instant;

use super::client::{
    Asked, AskedScan, Client, Form, KnownScans, MeshUpload, Registration, Scan, ScanUpload, ServerOptions,
    WatchedBars, ask_for, download, json, watch,
};
use super::difference::difference;
use super::parameters::Parameters;
use super::summary::Summary;
use super::template::{SentTemplate, TemplateFiles};

/// Scans that are sent at the same time.
const AT_ONCE: usize = 4;
/// Bytes of a name at the server, at most.
const NAME: usize = 200;

/// Registers a collection on a server: sends it, waits, and downloads the results.
///
/// Scans are found and left out as `register` does. What the server has is not sent again, and the same command goes on
/// where an earlier one was broken off; the server goes on meanwhile. The exit codes are those of `register`.
#[derive(Debug, clap::Args)]
pub struct Submit {
    /// A folder of `NAME/scan.ply` with `NAME/landmarks.json`, or of `NAME.ply` with `NAME.landmarks.json`; or a JSON
    /// manifest that names them
    collection: PathBuf,
    /// The folder to write to: `NAME.glb` for each scan, manifest.json, report.json, landmarks.json, sheet.png
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    #[command(flatten)]
    server: ServerOptions,
    #[command(flatten)]
    template: TemplateFiles,
    #[command(flatten)]
    parameters: Parameters,
}

impl Submit {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        let start = Instant::now();
        let parameters = self.asked()?;
        let template = self.template.files()?;
        let (collection, refused) = Collection::open_usable(&self.collection)?;
        refused.iter().for_each(|refused| remark!("{}: left out: {}", refused.name, refused.error));
        spare_inputs(&self.output, collection.members())?;
        let client = self.server.reach()?;
        let template = template.map(|template| send_template(&client, &template)).transpose()?;
        let scans = send_scans(&client, collection.members())?;
        ensure!(!scans.is_empty(), "{}: no scan is left to register", self.collection.display());
        let left_out = refused.len() + collection.members().len() - scans.len();
        let asked = Asked { name: name_of(&self.collection), scans, template, ..parameters };
        let registration = register(&client, &asked)?;
        save(&client, &registration, &self.output)?;
        let summary = Summary::of(&self.output)?;
        summary.print(&self.output, start.elapsed());
        summary.conclude(&self.collection, left_out)
    }

    /// The parameters, as far as they are not those that a server begins with.
    fn asked(&self) -> anyhow::Result<Asked> {
        let document = |settings: &Settings| serde_json::to_value(settings);
        if let Some(frozen) = self.template.read()?.settings {
            let wanted = self.parameters.over_frozen(frozen.clone())?;
            let (base, landmark_weights) = with_weights(frozen, &wanted);
            let parameters = difference(&document(&base)?, &document(&wanted)?);
            return Ok(Asked { parameters, landmark_weights, ..Asked::default() });
        }
        let wanted = self.parameters.for_registration()?;
        let base = Settings::preset(wanted.preset, wanted.vertices)?;
        let (base, landmark_weights) = with_weights(base, &wanted);
        let preset = document(&wanted)?["preset"].as_str().map(str::to_owned);
        let parameters = difference(&document(&base)?, &document(&wanted)?);
        let vertices = Some(wanted.vertices);
        Ok(Asked { preset, vertices, parameters, landmark_weights, ..Asked::default() })
    }
}

/// Settings that weigh landmarks as those that are wanted, and the weights that make the difference.
fn with_weights(mut base: Settings, wanted: &Settings) -> (Settings, BTreeMap<String, f64>) {
    let known = std::mem::replace(&mut base.resample.weights, wanted.resample.weights.clone());
    let differ = |(name, weight): &(&String, &f64)| known.get(*name) != Some(weight);
    let weights = wanted.resample.weights.iter().filter(differ);
    (base, weights.map(|(name, weight)| (name.clone(), *weight)).collect())
}

/// Sends a template of the user's, and gives its id.
fn send_template(client: &Client, files: &SentTemplate) -> anyhow::Result<String> {
    #[derive(Deserialize)]
    struct Template {
        id: String,
    }
    let (mesh, _) = MeshUpload::read(&files.mesh)?;
    let read = |path: &PathBuf| fs::read(path).with_context(|| path.display().to_string());
    let landmarks = files.landmarks.as_ref().map(read).transpose()?;
    let mask = files.mask.as_ref().map(read).transpose()?;
    let template: Result<Template, _> = client.patience.persist(|| {
        let mut form = Form::new().mesh(&mesh)?;
        if let Some(landmarks) = &landmarks {
            form = form.file("landmarks", landmarks);
        }
        if let Some(mask) = &mask {
            form = form.file("mask", mask);
        }
        let content_type = form.content_type();
        json(client.post("/v1/templates", &[("content-type", &content_type)], form.into_body())?)
    });
    Ok(template.with_context(|| files.mesh.display().to_string())?.id)
}

/// Refuses an output folder in which results would take the place of scans.
fn spare_inputs(output: &Path, members: &[Member]) -> anyhow::Result<()> {
    let others = ["manifest.json", "report.json", "landmarks.json", "sheet.png", "template.frozen.glb"];
    let results =
        members.iter().map(|member| format!("{}.glb", member.name)).chain(others.map(str::to_owned));
    let results: Vec<PathBuf> = results.filter_map(|name| output.join(name).canonicalize().ok()).collect();
    let inputs = members.iter().flat_map(|member| {
        [Some(&member.mesh), Some(&member.landmarks_file.path), member.mask.as_ref()].into_iter().flatten()
    });
    for input in inputs {
        ensure!(
            !input.canonicalize().is_ok_and(|input| results.contains(&input)),
            "{}: is a file of the collection and would be overwritten: choose another folder",
            input.display()
        );
    }
    Ok(())
}

/// What the registration is called: as the collection, if the server may.
fn name_of(collection: &Path) -> Option<String> {
    let name = collection.file_stem()?.to_str()?;
    (name.len() <= NAME && !name.contains(char::is_control)).then(|| name.to_owned())
}

/// Sends scans that the server does not have; those that cannot be used are named and left out.
fn send_scans(client: &Client, members: &[Member]) -> anyhow::Result<Vec<AskedScan>> {
    let known = KnownScans::of(client)?;
    let bar = counting_bar("sending", members.len());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(AT_ONCE).build()?;
    let send = |member: &Member| {
        let name = &member.name;
        let sent = send_scan(client, &known, member).with_context(|| name.clone())?;
        bar.inc(1);
        match &sent {
            Ok(scan) => scan.report.findings.iter().filter(|finding| finding.warns()).for_each(|finding| {
                bar.suspend(|| remark!("{name}: {finding}"));
            }),
            Err(problem) => bar.suspend(|| remark!("{name}: left out: {problem}")),
        }
        Ok(sent.ok().map(|scan| AskedScan { id: scan.id, name: name.clone() }))
    };
    let sent: anyhow::Result<Vec<Option<AskedScan>>> =
        pool.install(|| members.par_iter().map(send).collect());
    bar.finish_and_clear();
    Ok(sent?.into_iter().flatten().collect())
}

/// Sends one scan; the inner error is what the reader here or the server has against it.
fn send_scan(client: &Client, known: &KnownScans, member: &Member) -> anyhow::Result<Result<Scan, String>> {
    /// What the server says of a file that it cannot use or that is too large.
    const UNUSABLE: [u16; 2] = [413, 422];
    let upload = match ScanUpload::read(member) {
        Ok(upload) => upload,
        Err(error) => return Ok(Err(error.to_string())),
    };
    match upload.send(client, known) {
        Ok(scan) => Ok(Ok(scan)),
        Err(failure) if failure.status().is_some_and(|status| UNUSABLE.contains(&status)) => {
            Ok(Err(failure.to_string()))
        }
        Err(failure) => Err(failure.into()),
    }
}

/// A bar on standard error that counts to `length`.
fn counting_bar(doing: &'static str, length: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix:<23} {bar:30} {pos:>5} of {len}");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(length as u64).with_prefix(doing).with_style(style)
}

/// Asks for the registration, and waits for its end.
fn register(client: &Client, asked: &Asked) -> anyhow::Result<Registration> {
    let (begun, is_new) = ask_for(client, asked)?;
    let word = if is_new { "asked for" } else { "found as it was asked for before" };
    remark!("registration {} is {word}: {}/v1/registrations/{0}", begun.id, client.server());
    let names = asked.scans.iter().map(|scan| (scan.id.clone(), scan.name.clone())).collect();
    let mut bars = WatchedBars::new(names);
    let ended = watch(client, &begun.id, &mut bars);
    bars.finish();
    let ended = ended?;
    if !ended.status.has_results() {
        let problem =
            ended.problem.map_or_else(|| "it was stopped at the server".to_owned(), |why| why.detail);
        bail!("registration {}: {problem}", ended.id);
    }
    Ok(ended)
}

/// Downloads the results, last the manifest, and holds them against it.
fn save(client: &Client, registration: &Registration, output: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(output).with_context(|| format!("{}: cannot be made a folder", output.display()))?;
    let meshes = registration
        .children
        .iter()
        .filter_map(|child| Some((child.mesh.clone()?, format!("{}.glb", child.name))));
    let others = ["template.frozen.glb", "sheet.png", "landmarks.json", "report.json", "manifest.json"];
    let root = format!("/v1/registrations/{}", registration.id);
    let others = others.map(|name| (format!("{root}/{name}"), name.to_owned()));
    let files: Vec<(String, String)> = meshes.chain(others).collect();
    let bar = counting_bar("downloading", files.len());
    let mut digests = BTreeMap::new();
    for (path, name) in files {
        ensure!(
            !name.starts_with('.') && !name.contains(['/', '\\', ':']),
            "the server calls a result {name:?}, which names no file"
        );
        let digest = download(client, &path, &output.join(&name))?;
        digests.insert(name, digest.to_string());
        bar.inc(1);
    }
    bar.finish_and_clear();
    check(&output.join("manifest.json"), &digests)
}

/// Whether the meshes are those of the manifest.
fn check(manifest: &Path, digests: &BTreeMap<String, String>) -> anyhow::Result<()> {
    let shown = || manifest.display().to_string();
    let document: Value = serde_json::from_slice(&fs::read(manifest)?).with_context(shown)?;
    let scans = document["scans"].as_array().map_or(&[][..], Vec::as_slice);
    for output in scans.iter().filter_map(|scan| scan["outputs"].as_array()).flatten() {
        let (file, digest) = (output["file"].as_str(), output["sha256"].as_str());
        let own = file.and_then(|file| digests.get(file)).map(String::as_str);
        ensure!(own == digest, "{}: is not what manifest.json states", file.unwrap_or_default());
    }
    Ok(())
}
