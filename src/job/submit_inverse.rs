//! How inverse renderings are asked for.

use super::capture::{CaptureFiles, CaptureParts};
use super::engine::Engine;
use super::error::JobError;
use super::inverse_rendering::{InverseRendering, InverseRenderingId, NewInverseRendering};
use super::jobs::Jobs;
use super::new_job::{Begun, NewJob};
use super::record::{ALL, json};
use super::registration::TemplateChoice;
use super::stage::JobStage;
use crate::pipeline::{InvertPreset, InvertSettings};
use crate::render::{Adapter, RenderError};

/// Vertices of the result where nothing is said.
const VERTICES: usize = 10242;
/// Iterations and pictures' sides that one may ask for, over all levels and in each.
const MOST_ITERATIONS: usize = 50_000;
const LONGEST_SIDE: u32 = 4096;

impl Jobs {
    /// Takes an inverse rendering on: it is kept before this returns.
    ///
    /// # Errors
    /// [`JobError::Invalid`] names the field; [`JobError::Capture`] says what is wrong with the pictures or cameras;
    /// [`JobError::NoAdapter`] where nothing can draw; else as [`submit`](Self::submit).
    pub async fn invert(&self, new: NewInverseRendering) -> Result<InverseRendering, JobError> {
        self.check_running()?;
        if let Some(known) = self.known(new.dedupe_key.as_deref()).await? {
            return Ok(known);
        }
        self.renderer().await?;
        let (parts, settings) = (new.capture.parts(), settings(&new)?);
        self.look_at(&parts).await?;
        let id = InverseRenderingId::new();
        let job = NewJob {
            id: &id,
            name: new.name.as_deref(),
            owner: new.owner.as_deref(),
            dedupe_key: new.dedupe_key.as_deref(),
            priority: new.priority,
            template: &TemplateChoice::Default,
            parts: Some(json(&parts)),
            settings: json(&settings),
            webhook: new.webhook.as_deref(),
            stages: &[JobStage::Invert],
        };
        let (mut tx, sequence, mut changed) = match self.begin(&job).await? {
            Begun::Known(job) => return Ok(job),
            Begun::New(tx, sequence, changed) => (tx, sequence, changed),
        };
        let step = "INSERT INTO step (job, stage, place, state) VALUES (?, 0, ?, 'ready')";
        sqlx::query(step).bind(sequence).bind(ALL).execute(&mut *tx).await?;
        changed.ready = 1;
        self.engine.commit(tx, changed).await?;
        self.get(&id).await
    }

    /// What draws.
    ///
    /// # Errors
    /// [`JobError::NoAdapter`] if nothing can, and what to do; [`JobError::Invalid`] if none is called as is set.
    pub async fn renderer(&self) -> Result<Adapter, JobError> {
        let choice = self.engine.settings.adapter.clone();
        let mut known = self.engine.renderer.lock().await;
        if let Some(adapter) = &*known {
            return Ok(adapter.clone());
        }
        let opened = tokio::task::spawn_blocking(move || {
            crate::render::open(&choice).map(|renderer| renderer.adapter().clone())
        });
        let failed = |error: &dyn std::fmt::Display| JobError::NoAdapter(error.to_string());
        let opened: Result<Adapter, RenderError> = opened.await.map_err(|error| failed(&error))?;
        // What cannot draw now may be installed the next time.
        let adapter = opened.map_err(|error| failed(&error))?;
        *known = Some(adapter.clone());
        Ok(adapter)
    }

    /// Unpacks a capture and looks at it as far as that is quick.
    async fn look_at(&self, parts: &CaptureParts) -> Result<(), JobError> {
        let Engine { blobs, folder, settings, .. } = &*self.engine;
        let (limits, scratch) = (settings.capture_limits, folder.uploads());
        // One after another, which bounds what is unpacked at a time.
        let _turn = self.engine.unpacking.lock().await;
        let files = CaptureFiles::find(blobs, parts).await?;
        let look = move || {
            let folder = tempfile::tempdir_in(scratch)?;
            files.lay_out(folder.path(), &limits).map(drop)
        };
        let looked = tokio::task::spawn_blocking(look).await;
        looked.map_err(|_| JobError::invalid("capture", "cannot be read: the reader crashed on it"))??;
        Ok(())
    }
}

/// Every parameter, from what is said of them.
fn settings(new: &NewInverseRendering) -> Result<InvertSettings, JobError> {
    let (preset, vertices) = (new.preset.unwrap_or(InvertPreset::Default), new.vertices.unwrap_or(VERTICES));
    let settings = InvertSettings::preset(preset, vertices);
    let mut settings = settings.map_err(|error| JobError::invalid("vertices", error))?;
    for (name, value) in &new.parameters {
        let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        settings.set(name, &text).map_err(|error| JobError::invalid(format!("parameters.{name}"), error))?;
    }
    settings.check().map_err(|error| JobError::invalid("parameters", error))?;
    let bounds = [
        ("levels: its iterations are", settings.iterations(), MOST_ITERATIONS),
        ("levels: its longest size is", settings.longest_side() as usize, LONGEST_SIDE as usize),
    ];
    match bounds.into_iter().find(|(_, found, most)| found > most) {
        Some((name, found, most)) => {
            Err(JobError::invalid(format!("parameters.{name}"), format!("{found}: give at most {most}")))
        }
        None => Ok(settings),
    }
}
