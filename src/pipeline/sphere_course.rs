//! From the sphere, or from the head that comes with the program: fit, resample, register, and rounds of the groupwise
//! stage.

use std::iter::zip;

use glam::{DVec3, Vec3A};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::confidence::confidence;
use super::fit::{SphereLandmark, fit};
use super::groupwise::{
    Member, RestShape, SharedMesh, Turn, carried, close_smoothly, mean_shape, need, register_member,
};
use super::head::{self, head};
use super::known::{known, unknown};
use super::landmark_weights::LandmarkWeights;
use super::laying::laid;
use super::observer::{Observer, Stage, Watch};
use super::plan::PlanStage;
use super::register::{LEAST_LANDMARKS, RegisterError, SAMPLES, Subject, moved_onto, trust};
use super::resample;
use super::scan_surface::ScanSurface;
use super::settings::{FitSettings, Settings};
use super::sphere::Sphere;
use super::state::{Contribution, Mean, Placed, ScanState, SharedState};
use super::template::Template;
use super::transfer::TemplateCourse;
use crate::energy::LandmarkPull;
use crate::mesh::{Icosphere, LandmarkSet, SurfacePoint, interpolate};
use crate::numeric::Similarity;

/// The finest level of the head that comes with the program.
const HEAD_LEVEL: u32 = 5;

/// How a collection is registered from the sphere.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SphereCourse {
    /// Every parameter.
    pub(super) settings: Settings,
    /// The landmarks in use: those that every scan has, in the first one's order.
    names: Vec<String>,
    /// Where they are on the first scan, as which all are turned `[B, 3]`.
    first: Vec<DVec3>,
    /// The scheme of the landmarks, where a scan names one.
    scheme: Option<String>,
    /// The head takes the place of fit, resample and register.
    from_head: bool,
    /// How much each landmark counts.
    pub(super) weights: LandmarkWeights,
}

/// A scan in unit space, turned as the collection's first one, with its landmarks.
pub struct Aligned {
    name: String,
    pub(super) scan: ScanSurface,
    landmarks: Vec<Vec3A>,
    /// How much each of them counts.
    weights: Vec<f64>,
}

fn last_level(settings: &FitSettings) -> u32 {
    settings.levels.last().map_or(0, |level| level.level)
}

impl SphereCourse {
    pub(super) fn new(landmarks: &[&LandmarkSet], settings: &Settings) -> Result<Self, RegisterError> {
        let names = common_landmarks(landmarks)?;
        let scheme = landmarks.iter().find_map(|own| own.scheme.clone());
        let first = landmarks.first().map(|own| names.iter().filter_map(|name| own.get(name)).collect());
        let from_head = settings.from_head
            && settings.groupwise.rounds > 0
            && last_level(&settings.register) <= HEAD_LEVEL
            && head::has_landmarks(&names, scheme.as_deref());
        let (settings, first) = (settings.clone(), first.unwrap_or_default());
        Ok(Self { settings, names, first, scheme, from_head, weights: LandmarkWeights::default() })
    }

    /// A scan alone is registered to the head itself, where that has the vertices that are asked for.
    pub(super) fn as_transfer(&self, scans: usize) -> Option<TemplateCourse> {
        let alone = scans == 1 && self.from_head && self.settings.vertices == head().positions.len();
        alone.then(|| TemplateCourse::new(head(), scans, &self.settings))
    }

    pub(super) fn stages(&self) -> Vec<PlanStage> {
        use PlanStage::{Fit, Lay, Mean, Register, Resample, Round};
        let start = if self.from_head { vec![Lay] } else { vec![Fit, Resample, Register] };
        let rounds = (0..self.settings.groupwise.rounds).flat_map(|round| [Mean(round), Round(round)]);
        start.into_iter().chain(rounds).collect()
    }

    pub(super) fn prepare(&self, subject: &Subject) -> Aligned {
        let own: Vec<DVec3> = self.names.iter().filter_map(|name| subject.landmarks.get(name)).collect();
        let weights = self.weights.on(&subject.name, &self.names);
        let rotation = Similarity::between(&own, &self.first, &weights).rotation;
        let scan = ScanSurface::weighted(&subject.mesh, subject.mask.as_deref(), rotation, SAMPLES);
        let landmarks = own.iter().map(|&p| scan.to_unit(p)).collect();
        Aligned { name: subject.name.clone(), scan, landmarks, weights }
    }

    pub(super) fn scan_step(
        &self,
        stage: PlanStage,
        scan: &Aligned,
        own: Option<&ScanState>,
        shared: Option<&SharedState>,
        observer: &dyn Observer,
    ) -> Result<ScanState, RegisterError> {
        match (stage, own, shared) {
            (PlanStage::Fit, ..) => self.fit(scan, observer),
            (PlanStage::Lay, ..) => Ok(self.after(0, scan, self.lay_head(scan))),
            (PlanStage::Register, _, Some(SharedState::OnSphere(on_sphere))) => {
                self.register(scan, on_sphere, observer)
            }
            (PlanStage::Round(round), Some(ScanState::Shaped(own)), Some(SharedState::Mean(mean))) => {
                self.round(round, scan, own, mean, observer)
            }
            _ => Err(RegisterError::State),
        }
    }

    pub(super) fn shared_step(
        &self,
        stage: PlanStage,
        scans: &[ScanState],
        shared: Option<&SharedState>,
    ) -> Result<SharedState, RegisterError> {
        match stage {
            PlanStage::Resample => self.resample(scans),
            PlanStage::Mean(round) => self.mean(round, scans, shared),
            _ => Err(RegisterError::State),
        }
    }

    pub(super) fn template(&self, shared: Option<&SharedState>) -> Result<Template, RegisterError> {
        let SharedMesh { sphere, points, mean } = self.shared_mesh(shared)?;
        let landmarks = self.names.iter().cloned().zip(points);
        Ok(Template::of_sphere(&sphere, landmarks, &mean, self.scheme.as_deref()))
    }

    /// Stage 1, and where the landmarks are on the sphere by it.
    fn fit(&self, scan: &Aligned, observer: &dyn Observer) -> Result<ScanState, RegisterError> {
        let settings = &self.settings.fit;
        let fitted = fit(&scan.scan, settings, &[], &watch(observer, Stage::Fit, scan, settings))?;
        let sphere = Sphere::of_level(last_level(settings));
        Ok(ScanState::OnSphere(resample::landmarks_on_sphere(&sphere, &fitted, &scan.landmarks)))
    }

    /// Stage 2: where the landmarks lie on the sphere, averaged over the scans.
    fn resample(&self, scans: &[ScanState]) -> Result<SharedState, RegisterError> {
        let on_sphere = |state: &ScanState| match state {
            ScanState::OnSphere(own) => Ok(own.clone()),
            _ => Err(RegisterError::State),
        };
        let on_sphere: Vec<Vec<DVec3>> = scans.iter().map(on_sphere).collect::<Result<_, _>>()?;
        Ok(SharedState::OnSphere(resample::average(&on_sphere, &self.landmark_weights())))
    }

    fn landmark_weights(&self) -> Vec<f64> {
        let settings = &self.settings.resample;
        let nose_tips = ["30", "nose_tip", "nose tip", "pronasale"];
        let weight = |name: &String| match settings.weights.get(name) {
            Some(&weight) => weight,
            None if nose_tips.contains(&name.as_str()) => settings.nose_tip_weight,
            None => 1.0,
        };
        self.names.iter().map(weight).collect()
    }

    /// Stage 3.
    fn register(
        &self,
        scan: &Aligned,
        on_sphere: &[DVec3],
        observer: &dyn Observer,
    ) -> Result<ScanState, RegisterError> {
        let settings = &self.settings.register;
        let landmarks: Vec<SphereLandmark> = zip(on_sphere, zip(&scan.landmarks, &scan.weights))
            .map(|(&on_sphere, (&target, &weight))| SphereLandmark { on_sphere, target, weight })
            .collect();
        let shape = fit(&scan.scan, settings, &landmarks, &watch(observer, Stage::Register, scan, settings))?;
        Ok(self.after(0, scan, shape))
    }

    /// The head that comes with the program, laid on a scan by the landmarks.
    fn lay_head(&self, scan: &Aligned) -> Vec<Vec3A> {
        let SharedMesh { sphere, points, .. } = self.head_mesh();
        let head = head::positions(sphere.level);
        let on_head: Vec<DVec3> = points
            .iter()
            .map(|at| {
                let corners = sphere.connectivity.topology.triangles[at.triangle.0 as usize];
                interpolate(&head, corners, at.weights.map(|w| w as f32)).as_dvec3()
            })
            .collect();
        let targets: Vec<DVec3> = scan.landmarks.iter().map(|p| p.as_dvec3()).collect();
        let head: Vec<DVec3> = head.iter().map(|p| p.as_dvec3()).collect();
        laid(&head, &on_head, &targets, &scan.weights)
    }

    fn head_mesh(&self) -> SharedMesh {
        let sphere = Sphere::of_level(last_level(&self.settings.register));
        let points = sphere.surface_points(head::directions(&self.names));
        SharedMesh { sphere, points, mean: Vec::new() }
    }

    /// What all share before the next stage.
    fn shared_mesh(&self, shared: Option<&SharedState>) -> Result<SharedMesh, RegisterError> {
        Ok(match shared {
            None if self.from_head => self.head_mesh(),
            None => return Err(RegisterError::State),
            Some(SharedState::OnSphere(on_sphere)) => {
                let sphere = Sphere::of_level(last_level(&self.settings.register));
                let points = sphere.surface_points(on_sphere.iter().copied());
                SharedMesh { sphere, points, mean: Vec::new() }
            }
            Some(SharedState::Mean(mean)) => {
                let sphere = Sphere::of_level(mean.level);
                SharedMesh { sphere, points: mean.points.clone(), mean: mean.positions.clone() }
            }
        })
    }

    /// The level of the shared mesh in a round: the last is on the template's own, those before it on that of stage 3.
    fn level_in(&self, round: usize) -> u32 {
        let start = last_level(&self.settings.register);
        match Icosphere::level_of(self.settings.vertices) {
            Some(level) if round + 1 == self.settings.groupwise.rounds => start.max(level),
            _ => start,
        }
    }

    /// The state of a scan before a round, or when all are over, from its shape in unit space.
    fn after(&self, round: usize, scan: &Aligned, mut shape: Vec<Vec3A>) -> ScanState {
        let Aligned { scan, landmarks, .. } = scan;
        let settings = &self.settings.groupwise;
        if round == settings.rounds {
            let sphere = Sphere::of_level(Icosphere::level_of(shape.len()).unwrap_or(0));
            return ScanState::Placed(Placed {
                confidence: confidence(scan, &sphere.connectivity.topology, &shape),
                positions: shape.into_iter().map(|p| scan.to_scan(p)).collect(),
            });
        }
        let level = self.level_in(round);
        for finer in Icosphere::level_of(shape.len()).unwrap_or(level)..level {
            shape = Sphere::of_level(finer + 1).subdivide(&shape);
        }
        let sphere = Sphere::of_level(level);
        ScanState::Shaped(Contribution {
            known: known(&sphere.connectivity, scan, &shape),
            weight: trust(&sphere, scan, &shape),
            need: if round > 0 { need(&sphere, scan, landmarks, &shape, settings) } else { Vec::new() },
            shape,
        })
    }

    /// The mean that a round begins from.
    fn mean(
        &self,
        round: usize,
        scans: &[ScanState],
        shared: Option<&SharedState>,
    ) -> Result<SharedState, RegisterError> {
        let members = contributions(scans)?;
        let mut shared = self.shared_mesh(shared)?;
        shared.refine_to(self.level_in(round));
        let shapes: Vec<&[Vec3A]> = members.iter().map(|member| &member.shape[..]).collect();
        let known: Vec<&[f64]> = members.iter().map(|member| &member.known[..]).collect();
        let weights: Vec<f64> = members.iter().map(|member| member.weight).collect();
        shared.mean = mean_shape(&shapes, &weights, &known);
        close_smoothly(&shared.sphere.connectivity, &mut shared.mean, &unknown(&known));
        let mut moved = Vec::new();
        if round > 0 {
            let needs: Vec<&[f32]> = members.iter().map(|member| &member.need[..]).collect();
            let hits = shared.redistribute(&shapes, &needs, &self.settings.groupwise);
            moved = hits.into_iter().map(|hit| (hit.triangle, hit.weights)).collect();
        }
        let SharedMesh { sphere, points, mean: positions } = shared;
        Ok(SharedState::Mean(Mean { level: sphere.level, positions, points, moved }))
    }

    /// A round on one scan, from the mean.
    fn round(
        &self,
        round: usize,
        scan: &Aligned,
        own: &Contribution,
        mean: &Mean,
        observer: &dyn Observer,
    ) -> Result<ScanState, RegisterError> {
        let sphere = Sphere::of_level(mean.level);
        let shape = match &mean.moved[..] {
            [] => own.shape.clone(),
            moved => carried(&sphere, &own.shape, moved.iter().copied()),
        };
        let settings = &self.settings.groupwise;
        let turn = Turn { round, rounds: settings.rounds };
        let iterations = turn.total(settings);
        let watch = Watch { observer, stage: Stage::Groupwise, scan: &scan.name, iterations };
        let rest = RestShape::new(sphere.connectivity.clone(), mean.positions.clone());
        let start = moved_onto(&rest.positions, &shape, &own.known);
        let pulls = pulls(&mean.points, scan);
        let member = Member { scan: &scan.scan, landmarks: &pulls, start };
        let shape = register_member(&rest, member, settings, &watch, turn)?;
        Ok(self.after(round + 1, scan, shape))
    }
}

fn watch<'a>(
    observer: &'a dyn Observer,
    stage: Stage,
    scan: &'a Aligned,
    settings: &FitSettings,
) -> Watch<'a> {
    let iterations = settings.levels.iter().map(|level| level.iterations).sum();
    Watch { observer, stage, scan: &scan.name, iterations }
}

fn pulls(points: &[SurfacePoint], scan: &Aligned) -> Vec<LandmarkPull> {
    let pull = |(point, (&target, &weight))| LandmarkPull {
        weight: weight as f32,
        ..LandmarkPull::new(point, target)
    };
    zip(points, zip(&scan.landmarks, &scan.weights)).map(pull).collect()
}

/// What the scans bring to a mean.
pub(super) fn contributions(scans: &[ScanState]) -> Result<Vec<&Contribution>, RegisterError> {
    let own = |state: &'_ ScanState| matches!(state, ScanState::Shaped(_));
    if scans.is_empty() || !scans.iter().all(own) {
        return Err(RegisterError::State);
    }
    Ok(scans
        .iter()
        .filter_map(|state| if let ScanState::Shaped(own) = state { Some(own) } else { None })
        .collect())
}

/// The landmarks that every scan has, in the first one's order.
fn common_landmarks(scans: &[&LandmarkSet]) -> Result<Vec<String>, RegisterError> {
    let first = scans.first().ok_or(RegisterError::Empty)?;
    let everywhere = |name: &str| scans.par_iter().all(|own| own.get(name).is_some());
    let names: Vec<String> =
        first.present().map(|(name, _)| name.to_owned()).filter(|name| everywhere(name)).collect();
    if names.len() < LEAST_LANDMARKS {
        return Err(RegisterError::TooFewLandmarks { found: names.len(), names: names.join(", ") });
    }
    Ok(names)
}
