//! Scans registered from a given template: a user's own mesh, or that of an earlier collection.

use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3A};
use serde::{Deserialize, Serialize};

use super::carried::Parts;
use super::confidence::confidence;
use super::connectivity::Connectivity;
use super::groupwise::{Member, RestShape, Turn, mean_shape, register_member};
use super::known::known;
use super::landmark_weights::LandmarkWeights;
use super::laying::laid;
use super::observer::{Observer, Stage, Watch};
use super::plan::PlanStage;
use super::register::{LEAST_LANDMARKS, RegisterError, SAMPLES, Subject, moved_onto};
use super::scan_surface::ScanSurface;
use super::settings::{GroupwiseSettings, Settings};
use super::sphere_course::contributions;
use super::state::{Contribution, Mean, Placed, ScanState, SharedState};
use super::template::Template;
use crate::energy::LandmarkPull;
use crate::mesh::SurfacePoint;
use crate::numeric::{Similarity, once};

/// How scans are registered from a template.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct TemplateCourse {
    /// Every parameter.
    pub(super) settings: Settings,
    template: Template,
    /// How often scans are registered; each time but the first from the mean of the time before.
    rounds: usize,
    /// How much each landmark counts.
    pub(super) weights: LandmarkWeights,
    #[serde(skip)]
    matched: OnceLock<Arc<Matched>>,
}

/// What of a template is matched to scans.
struct Matched {
    parts: Parts,
    connectivity: Arc<Connectivity>,
}

impl std::fmt::Debug for Matched {
    fn fmt(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
        out.debug_struct("Matched").finish_non_exhaustive()
    }
}

/// A scan with the template laid on it.
pub struct Laid {
    name: String,
    pub(super) scan: ScanSurface,
    pulls: Vec<LandmarkPull>,
    /// The template in the scan's unit space `[N, 3]`.
    pub(super) start: Vec<Vec3A>,
}

impl TemplateCourse {
    pub(super) fn new(template: &Template, scans: usize, settings: &Settings) -> Self {
        let rounds = if template.frozen || scans == 1 { 1 } else { settings.transfer.rounds.max(1) };
        let (settings, template) = (settings.clone(), template.clone());
        let weights = LandmarkWeights::default();
        Self { settings, template, rounds, weights, matched: OnceLock::new() }
    }

    pub(super) fn stages(&self) -> Vec<PlanStage> {
        let rounds = (1..self.rounds).flat_map(|round| [PlanStage::Mean(round), PlanStage::Round(round)]);
        std::iter::once(PlanStage::Round(0)).chain(rounds).collect()
    }

    fn matched(&self) -> &Matched {
        once::<Arc<_>>(&self.matched, || {
            let parts = Parts::of(&self.template);
            let rest: Vec<Vec3A> = parts.main.positions.iter().map(|p| p.as_vec3a()).collect();
            let connectivity = Arc::new(Connectivity::new(&rest, &parts.main.triangles));
            Arc::new(Matched { parts, connectivity })
        })
    }

    pub(super) fn prepare(&self, subject: &Subject) -> Result<Laid, RegisterError> {
        Laid::of(&self.matched().parts.main, subject, &self.weights)
    }

    pub(super) fn scan_step(
        &self,
        stage: PlanStage,
        scan: &Laid,
        own: Option<&ScanState>,
        shared: Option<&SharedState>,
        observer: &dyn Observer,
    ) -> Result<ScanState, RegisterError> {
        let (round, start) = match (stage, own, shared) {
            (PlanStage::Round(0), None, None) => (0, scan.start.clone()),
            (PlanStage::Round(round), Some(ScanState::Shaped(own)), Some(SharedState::Mean(mean))) => {
                (round, moved_onto(&mean.positions, &own.shape, &own.known))
            }
            _ => return Err(RegisterError::State),
        };
        let turn = Turn { round, rounds: self.rounds };
        // A single round takes the time of two, and has nothing but its own to come near the scan by.
        let transfer = &self.settings.transfer;
        let iterations = transfer.iterations * if self.rounds == 1 { 2 } else { 1 };
        let settings = &GroupwiseSettings { iterations, ..transfer.clone() };
        let iterations = turn.total(settings);
        let watch = Watch { observer, stage: Stage::Register, scan: &scan.name, iterations };
        let Matched { parts, connectivity } = self.matched();
        let mask = parts.main.mask.as_deref();
        let rest = RestShape::new(connectivity.clone(), start.clone()).masked(mask);
        let member = Member { scan: &scan.scan, landmarks: &scan.pulls, start };
        let shape = register_member(&rest, member, settings, &watch, turn)?;
        Ok(self.after(round + 1, &scan.scan, shape))
    }

    /// The state of a scan before a round, or when all are over, from its shape in unit space.
    fn after(&self, round: usize, scan: &ScanSurface, shape: Vec<Vec3A>) -> ScanState {
        let Matched { parts, connectivity } = self.matched();
        if round < self.rounds {
            let known = known(connectivity, scan, &shape);
            return ScanState::Shaped(Contribution { shape, known, weight: 1.0, need: Vec::new() });
        }
        let mut confidence = confidence(scan, &connectivity.topology, &shape);
        for (confidence, taken) in confidence.iter_mut().zip(parts.main.mask.iter().flatten()) {
            *confidence *= taken;
        }
        let main: Vec<DVec3> = shape.into_iter().map(|p| scan.to_scan(p)).collect();
        ScanState::Placed(Placed { positions: parts.carry(&main), confidence: parts.confidence(&confidence) })
    }

    pub(super) fn shared_step(
        &self,
        stage: PlanStage,
        scans: &[ScanState],
    ) -> Result<SharedState, RegisterError> {
        let members = contributions(scans)?;
        if !matches!(stage, PlanStage::Mean(_)) {
            return Err(RegisterError::State);
        }
        let shapes: Vec<&[Vec3A]> = members.iter().map(|member| &member.shape[..]).collect();
        let known: Vec<&[f64]> = members.iter().map(|member| &member.known[..]).collect();
        let weights: Vec<f64> = members.iter().map(|member| member.weight).collect();
        let positions = mean_shape(&shapes, &weights, &known);
        Ok(SharedState::Mean(Mean { level: 0, positions, points: Vec::new(), moved: Vec::new() }))
    }

    pub(super) fn template(&self, shared: Option<&SharedState>) -> Result<Template, RegisterError> {
        let parts = &self.matched().parts;
        let main: Vec<DVec3> = match shared {
            None => parts.main.positions.clone(),
            Some(SharedState::Mean(mean)) => mean.positions.iter().map(|p| p.as_dvec3()).collect(),
            Some(SharedState::OnSphere(_)) => return Err(RegisterError::State),
        };
        Ok(Template { positions: parts.carry(&main), ..self.template.clone() })
    }
}

impl Laid {
    /// Lays the template on a scan by the landmarks that both have, which count as `weights` says of their names.
    fn of(template: &Template, subject: &Subject, weights: &LandmarkWeights) -> Result<Self, RegisterError> {
        let common = common_landmarks(template, subject)?;
        let names: Vec<&str> = common.iter().map(|common| common.name).collect();
        let weights = weights.on(&subject.name, &names);
        let own: Vec<DVec3> =
            common.iter().map(|common| template.point(&template.positions, common.at)).collect();
        let theirs: Vec<DVec3> = common.iter().map(|common| common.target).collect();
        let rotation = Similarity::between(&theirs, &own, &weights).rotation;
        let scan = ScanSurface::weighted(&subject.mesh, subject.mask.as_deref(), rotation, SAMPLES);
        let targets: Vec<DVec3> = theirs.iter().map(|&p| scan.to_unit(p).as_dvec3()).collect();
        let start = laid(&template.positions, &own, &targets, &weights);
        let pull = |((common, target), &weight): ((&Common, &DVec3), &f64)| LandmarkPull {
            weight: weight as f32,
            ..LandmarkPull::new(common.at, target.as_vec3a())
        };
        let pulls = common.iter().zip(&targets).zip(&weights).map(pull).collect();
        Ok(Self { name: subject.name.clone(), scan, pulls, start })
    }
}

/// A landmark that template and scan have.
struct Common<'t> {
    name: &'t str,
    /// Its place on the template.
    at: &'t SurfacePoint,
    /// Its position on the scan, in the scan's space.
    target: DVec3,
}

fn common_landmarks<'t>(template: &'t Template, subject: &Subject) -> Result<Vec<Common<'t>>, RegisterError> {
    let on_both = |(name, at): (&'t String, &'t SurfacePoint)| {
        Some(Common { name, at, target: subject.landmarks.get(name)? })
    };
    let common: Vec<_> = template.landmarks.iter().filter_map(on_both).collect();
    if common.len() < LEAST_LANDMARKS {
        return Err(RegisterError::TooFewForTemplate { scan: subject.name.clone(), found: common.len() });
    }
    Ok(common)
}
