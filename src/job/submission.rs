//! What is asked for, checked and made into records.

use std::collections::HashSet;
use std::path::Path;

use super::blobs::Blobs;
use super::error::JobError;
use super::registration::{NewMember, NewRegistration};
use super::scan::{ScanError, ScanId, ScanLimits, ScanParts, Scans};
use super::settings::JobSettings;
use super::template::{TemplateFiles, TemplateParts};
use crate::pipeline::{Preset, Settings};

/// Vertices of the template where nothing is said.
const VERTICES: usize = 10242;

/// A scan of a registration, its files as they are now: what is put later changes nothing.
#[derive(Debug, Clone)]
pub(super) struct Member {
    pub scan: ScanId,
    pub name: String,
    pub parts: ScanParts,
}

/// The scans that are asked for, in the order of their names.
///
/// # Errors
/// [`JobError::Invalid`] names the scan.
pub(super) async fn members(
    scans: &Scans,
    asked: &[NewMember],
    settings: &JobSettings,
) -> Result<Vec<Member>, JobError> {
    let count = asked.len();
    if count == 0 || count > settings.scans {
        let problem = format!("are {count}; a registration has 1 to {} scans", settings.scans);
        return Err(JobError::invalid("scans", problem));
    }
    let mut members = Vec::with_capacity(count);
    for (at, NewMember { scan, name }) in asked.iter().enumerate() {
        let field = || format!("scans[{at}]");
        let stored = scans.get(scan).await.map_err(|error| match error {
            ScanError::Store(error) => error.into(),
            error => JobError::invalid(field(), error),
        })?;
        if stored.parts.landmarks.is_none() {
            let problem = format!("scan {scan} has no landmarks: put them first, at its `landmarks`");
            return Err(JobError::invalid(field(), problem));
        }
        let name = name.clone().or(stored.name).unwrap_or_else(|| format!("scan-{scan}"));
        if let Some(problem) = unfit(&name) {
            return Err(JobError::invalid(field(), problem));
        }
        members.push(Member { scan: scan.clone(), name, parts: stored.parts });
    }
    members.sort_by(|a, b| a.name.cmp(&b.name));
    if let Some(pair) = members.array_windows().find(|[a, b]| a.name == b.name) {
        let problem = format!("two are called {:?}: give one of them another `name`", pair[0].name);
        return Err(JobError::invalid("scans", problem));
    }
    let mut seen = HashSet::new();
    if let Some(twice) = members.iter().find(|member| !seen.insert(&member.scan)) {
        return Err(JobError::invalid("scans", format!("scan {} is there twice: give it once", twice.scan)));
    }
    Ok(members)
}

/// What is wrong with a name that is to name a file.
fn unfit(name: &str) -> Option<String> {
    const LONGEST: usize = 120;
    let wrong = name.is_empty()
        || name.len() > LONGEST
        || name.starts_with('.')
        || name.contains(|c: char| c.is_control() || "/\\:".contains(c));
    wrong.then(|| {
        format!("{name:?} cannot name a file: use 1 to {LONGEST} bytes without / \\ : and control characters, not beginning with a dot")
    })
}

/// Every parameter, from what is said of them and what the template brings.
///
/// # Errors
/// [`JobError::Invalid`] names the parameter.
pub(super) async fn settings(
    blobs: &Blobs,
    new: &NewRegistration,
    template: Option<&TemplateParts>,
    limits: ScanLimits,
    scratch: &Path,
) -> Result<Settings, JobError> {
    let brought = match template {
        Some(parts) => {
            let files = TemplateFiles::fetch(blobs, parts).await?;
            let scratch = scratch.to_owned();
            let read = tokio::task::spawn_blocking(move || files.read(&limits, &scratch)).await;
            let read =
                read.map_err(|_| JobError::invalid("template", "cannot be read: the reader crashed on it"))?;
            read.map_err(|fault| JobError::invalid("template", fault))?.1
        }
        None => None,
    };
    let mut settings = match brought {
        Some(_) if new.preset.is_some() => {
            return Err(JobError::invalid("preset", "goes with no frozen template, which brings its own"));
        }
        Some(settings) => settings,
        None => {
            let (preset, vertices) =
                (new.preset.unwrap_or(Preset::Default), new.vertices.unwrap_or(VERTICES));
            Settings::preset(preset, vertices).map_err(|error| JobError::invalid("vertices", error))?
        }
    };
    for (name, value) in &new.parameters {
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        settings.set(name, &text).map_err(|error| JobError::invalid(format!("parameters.{name}"), error))?;
    }
    for (name, &weight) in &new.landmark_weights {
        if !(weight.is_finite() && (0.0..=1e9).contains(&weight)) {
            let problem = format!("is {weight}: give a number from 0 to 1e9");
            return Err(JobError::invalid(format!("landmark_weights.{name}"), problem));
        }
        settings.resample.weights.insert(name.clone(), weight);
    }
    check_bounds(&settings)?;
    Ok(settings)
}

/// Whether the parameters ask for no more memory and time than a server can give to one.
fn check_bounds(settings: &Settings) -> Result<(), JobError> {
    let mut counts: Vec<(String, usize, usize)> = Vec::new();
    for (stage, fit) in [("fit", &settings.fit), ("register", &settings.register)] {
        for (at, level) in fit.levels.iter().enumerate() {
            counts.push((format!("{stage}.levels.{at}.iterations"), level.iterations, 20_000));
            counts.push((format!("{stage}.levels.{at}.samples"), level.samples, 200_000));
        }
    }
    for (stage, own) in [("groupwise", &settings.groupwise), ("transfer", &settings.transfer)] {
        counts.push((format!("{stage}.rounds"), own.rounds, 16));
        counts.push((format!("{stage}.phases"), own.phases, 1000));
        counts.push((format!("{stage}.iterations"), own.iterations, 1000));
        counts.push((format!("{stage}.samples"), own.samples, 200_000));
    }
    match counts.into_iter().find(|(_, found, most)| found > most) {
        Some((name, found, most)) => {
            Err(JobError::invalid(format!("parameters.{name}"), format!("is {found}: give at most {most}")))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_must_name_files() {
        assert_eq!(unfit("head-01 ä"), None);
        for name in ["", ".hidden", "a/b", "a\\b", "C:x", "a\nb", &"x".repeat(121)] {
            assert!(unfit(name).is_some(), "{name:?}");
        }
    }

    #[test]
    fn the_presets_are_within_bounds_and_a_million_iterations_are_not() {
        for preset in [Preset::Default, Preset::Paper] {
            let mut settings = Settings::preset(preset, VERTICES).unwrap();
            check_bounds(&settings).unwrap();
            settings.fit.levels[0].iterations = 1_000_000;
            let error = check_bounds(&settings).unwrap_err().to_string();
            assert!(error.contains("parameters.fit.levels.0.iterations: is 1000000"), "{error}");
        }
    }
}
