//! A registration as a graph of steps: what is done to each scan by itself, and what to all of them in between. Every
//! step is a pure function of stored values, so that one may run anywhere and again.

use std::collections::BTreeMap;
use std::time::Instant;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::landmark_weights::LandmarkWeights;
use super::observer::{Observer, Stage};
use super::register::{RegisterError, Registration, Subject};
use super::settings::Settings;
use super::sphere_course::{Aligned, SphereCourse};
use super::state::{Placed, ScanState, SharedState};
use super::template::Template;
use super::transfer::{Laid, TemplateCourse};
use crate::mesh::LandmarkSet;

/// How a collection is registered; what all of its steps know.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum Plan {
    /// From the sphere, or from the head that comes with the program, all scans together.
    Sphere(SphereCourse),
    /// From a given template.
    Template(TemplateCourse),
}

/// What is done next, to each scan or to all together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum PlanStage {
    /// The sphere to each scan, without landmarks.
    Fit,
    /// Where the landmarks of all lie on the sphere.
    Resample,
    /// The sphere to each scan, with landmarks.
    Register,
    /// The head that comes with the program laid on each scan.
    Lay,
    /// The mean of all, before a round.
    Mean(usize),
    /// Each scan from the mean, or from the given template.
    Round(usize),
}

impl PlanStage {
    /// Whether it is one step for all scans.
    pub fn is_shared(self) -> bool {
        matches!(self, Self::Resample | Self::Mean(_))
    }
}

/// A scan made ready for the steps of a plan; it costs a moment and may be kept between them.
pub enum Prepared {
    /// For a plan from the sphere.
    Aligned(Aligned),
    /// For one from a template.
    Laid(Laid),
}

impl Prepared {
    /// About as many bytes as it takes.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Aligned(scan) => scan.scan.bytes(),
            Self::Laid(scan) => scan.scan.bytes() + 16 * scan.start.len(),
        }
    }
}

impl Plan {
    /// The plan for scans with these landmarks, from the sphere or the head.
    ///
    /// # Errors
    /// [`RegisterError::Empty`], [`RegisterError::TooFewLandmarks`].
    pub fn new(landmarks: &[&LandmarkSet], settings: &Settings) -> Result<Self, RegisterError> {
        let course = SphereCourse::new(landmarks, settings)?;
        Ok(match course.as_transfer(landmarks.len()) {
            Some(transfer) => Self::Template(transfer),
            None => Self::Sphere(course),
        })
    }

    /// The plan for so many scans, from a template.
    ///
    /// # Errors
    /// [`RegisterError::Empty`], [`RegisterError::TemplateMask`].
    pub fn from_template(
        template: &Template,
        scans: usize,
        settings: &Settings,
    ) -> Result<Self, RegisterError> {
        if scans == 0 {
            return Err(RegisterError::Empty);
        }
        template.check_mask().map_err(RegisterError::TemplateMask)?;
        Ok(Self::Template(TemplateCourse::new(template, scans, settings)))
    }

    /// The same with landmarks that count more or less.
    pub fn weighing(mut self, landmarks: LandmarkWeights) -> Self {
        match &mut self {
            Self::Sphere(course) => course.weights = landmarks,
            Self::Template(course) => course.weights = landmarks,
        }
        self
    }

    /// What is done, in this order.
    pub fn stages(&self) -> Vec<PlanStage> {
        match self {
            Self::Sphere(course) => course.stages(),
            Self::Template(course) => course.stages(),
        }
    }

    /// What an observer and a report call a stage.
    pub fn stage_of(&self, stage: PlanStage) -> Stage {
        match (self, stage) {
            (Self::Template(_), _) => Stage::Register,
            (_, PlanStage::Lay) => Stage::Prepare,
            (_, PlanStage::Fit) => Stage::Fit,
            (_, PlanStage::Resample) => Stage::Resample,
            (_, PlanStage::Register) => Stage::Register,
            (_, PlanStage::Mean(_) | PlanStage::Round(_)) => Stage::Groupwise,
        }
    }

    /// Every parameter.
    pub fn settings(&self) -> &Settings {
        match self {
            Self::Sphere(course) => &course.settings,
            Self::Template(course) => &course.settings,
        }
    }

    /// Makes a scan ready.
    ///
    /// # Errors
    /// [`RegisterError::Mask`], [`RegisterError::TooFewForTemplate`].
    pub fn prepare(&self, subject: &Subject) -> Result<Prepared, RegisterError> {
        subject.check_mask()?;
        Ok(match self {
            Self::Sphere(course) => Prepared::Aligned(course.prepare(subject)),
            Self::Template(course) => Prepared::Laid(course.prepare(subject)?),
        })
    }

    /// A stage on one scan: from its own state after the stage before, and the last that all share.
    ///
    /// # Errors
    /// [`RegisterError::Canceled`] if the observer asked to stop; [`RegisterError::State`] for states that are not those
    /// of the stages before.
    pub fn scan_step(
        &self,
        stage: PlanStage,
        scan: &Prepared,
        own: Option<&ScanState>,
        shared: Option<&SharedState>,
        observer: &dyn Observer,
    ) -> Result<ScanState, RegisterError> {
        match (self, scan) {
            (Self::Sphere(course), Prepared::Aligned(scan)) => {
                course.scan_step(stage, scan, own, shared, observer)
            }
            (Self::Template(course), Prepared::Laid(scan)) => {
                course.scan_step(stage, scan, own, shared, observer)
            }
            _ => Err(RegisterError::State),
        }
    }

    /// A stage of all together: from the states of all after the stage before, and the last that all share.
    ///
    /// # Errors
    /// [`RegisterError::State`] for states that are not those of the stages before.
    pub fn shared_step(
        &self,
        stage: PlanStage,
        scans: &[ScanState],
        shared: Option<&SharedState>,
    ) -> Result<SharedState, RegisterError> {
        match self {
            Self::Sphere(course) => course.shared_step(stage, scans, shared),
            Self::Template(course) => course.shared_step(stage, scans),
        }
    }

    /// What the results share, by the last state that all share.
    ///
    /// # Errors
    /// [`RegisterError::State`] for a state that is not one of this plan.
    pub fn template(&self, shared: Option<&SharedState>) -> Result<Template, RegisterError> {
        match self {
            Self::Sphere(course) => course.template(shared),
            Self::Template(course) => course.template(shared),
        }
    }

    /// All stages one after another, on all scans at once.
    pub(super) fn run(
        &self,
        subjects: &[Subject],
        observer: &dyn Observer,
    ) -> Result<Registration, RegisterError> {
        let mut seconds = BTreeMap::new();
        let mut timed = |stage: Stage, start: Instant| {
            // A stage may have several parts.
            *seconds.entry(stage).or_default() += start.elapsed().as_secs_f64();
        };
        let start = Instant::now();
        let scans: Vec<Prepared> =
            subjects.par_iter().map(|subject| self.prepare(subject)).collect::<Result<_, _>>()?;
        timed(Stage::Prepare, start);
        let (mut states, mut shared): (Vec<ScanState>, _) = (Vec::new(), None);
        for stage in self.stages() {
            let start = Instant::now();
            if stage.is_shared() {
                shared = Some(self.shared_step(stage, &states, shared.as_ref())?);
            } else {
                let step =
                    |(at, scan)| self.scan_step(stage, scan, states.get(at), shared.as_ref(), observer);
                states = scans.par_iter().enumerate().map(step).collect::<Result<_, _>>()?;
            }
            timed(self.stage_of(stage), start);
        }
        let placed = states.into_iter().map(Placed::try_from).collect::<Result<Vec<_>, _>>()?;
        let (members, confidence) =
            placed.into_iter().map(|placed| (placed.positions, placed.confidence)).unzip();
        Ok(Registration { template: self.template(shared.as_ref())?, members, confidence, seconds })
    }
}

impl TryFrom<ScanState> for Placed {
    type Error = RegisterError;

    fn try_from(state: ScanState) -> Result<Self, RegisterError> {
        match state {
            ScanState::Placed(placed) => Ok(placed),
            _ => Err(RegisterError::State),
        }
    }
}
