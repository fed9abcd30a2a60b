/// A stage of the pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// Reading and indexing the scans.
    Prepare,
    /// The sphere to every scan, without landmarks.
    Fit,
    /// The template's landmarks.
    Resample,
    /// The sphere to every scan, with landmarks.
    Register,
    /// Every scan again from the collection's mean.
    Groupwise,
    /// The sphere to pictures.
    Invert,
    /// Pictures of a mesh.
    Capture,
}

impl std::fmt::Display for Stage {
    fn fmt(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
        // Padded where it is asked for, as the names in a table are.
        out.pad(match self {
            Self::Prepare => "prepare",
            Self::Fit => "fit",
            Self::Resample => "resample",
            Self::Register => "register",
            Self::Groupwise => "groupwise",
            Self::Invert => "invert",
            Self::Capture => "capture",
        })
    }
}

/// How far a stage has come on one scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress<'a> {
    /// The stage.
    pub stage: Stage,
    /// The scan's name.
    pub scan: &'a str,
    /// Iterations done.
    pub iteration: usize,
    /// Iterations this stage takes on this scan.
    pub iterations: usize,
    /// The energy, or the mean distance where the stage has no single one.
    pub energy: f64,
}

/// Hears of progress and may ask to stop; called from many threads.
pub trait Observer: Sync {
    /// Something moved on.
    fn progress(&self, _progress: Progress) {}

    /// Whether to stop as soon as possible.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Watches nothing.
impl Observer for () {}

/// The observer asked to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("canceled")]
pub struct Canceled;

/// One stage on one scan, as an observer sees it.
pub struct Watch<'a> {
    /// Who is told.
    pub observer: &'a dyn Observer,
    /// The stage.
    pub stage: Stage,
    /// The scan's name.
    pub scan: &'a str,
    /// Iterations this stage takes on this scan.
    pub iterations: usize,
}

impl Watch<'_> {
    /// Reports `iteration` iterations done.
    ///
    /// # Errors
    /// [`Canceled`] if the observer asked to stop.
    pub fn step(&self, iteration: usize, energy: f64) -> Result<(), Canceled> {
        if self.observer.cancelled() {
            return Err(Canceled);
        }
        let (stage, scan, iterations) = (self.stage, self.scan, self.iterations);
        self.observer.progress(Progress { stage, scan, iteration, iterations, energy });
        Ok(())
    }
}
