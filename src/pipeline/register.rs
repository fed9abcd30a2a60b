//! All stages over a collection.

use std::collections::BTreeMap;
use std::time::Instant;

use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use super::confidence::confidence;
use super::fit::{SphereLandmark, fit};
use super::groupwise::{Member, RestShape, SharedMesh, close_smoothly, mean_shape, register_member};
use super::head::{self, head};
use super::known::{known, unknown};
use super::landmark_weights::LandmarkWeights;
use super::laying::laid;
use super::mask::{MaskError, check_mask};
use super::observer::{Canceled, Observer, Stage, Watch};
use super::resample;
use super::scan_surface::ScanSurface;
use super::settings::{FitSettings, Settings};
use super::sphere::Sphere;
use super::template::Template;
use super::transfer::register_to;
use crate::energy::LandmarkPull;
use crate::mesh::{Icosphere, LandmarkSet, SurfacePoint, TriangleMesh, interpolate};
use crate::numeric::Similarity;
use crate::spatial::SurfaceIndex;

/// Samples of a scan that fits draw from.
pub(super) const SAMPLES: usize = 120_000;

/// The finest level of the head that comes with the program.
const HEAD_LEVEL: u32 = 5;

/// Samples a registration is judged by when the mean is taken.
const JUDGED: usize = 10_000;

/// One scan to be registered.
#[derive(Debug, Clone)]
pub struct Subject {
    /// Its name, unique in the collection.
    pub name: String,
    /// The surface, in its own space.
    pub mesh: TriangleMesh,
    /// Its landmarks, in the same space.
    pub landmarks: LandmarkSet,
    /// How much each vertex counts as data `[N]`, 0 to 1; without it all do.
    pub mask: Option<Vec<f32>>,
}

/// A registered collection.
#[derive(Debug, Clone)]
pub struct Registration {
    /// What the members share.
    pub template: Template,
    /// Vertex positions `[N, 3]` of each member, in its own space, in the order of the subjects.
    pub members: Vec<Vec<DVec3>>,
    /// How far each vertex of each member is known from its scan's data `[M][N]`, from 0 to 1; see [`confidence`].
    pub confidence: Vec<Vec<f32>>,
    /// Wall-clock seconds of each stage.
    pub seconds: BTreeMap<Stage, f64>,
}

/// Why a collection cannot be registered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RegisterError {
    /// No scan.
    #[error("there is no scan to register")]
    Empty,
    /// Too few landmarks in common.
    #[error(
        "only {found} landmarks are known on every scan ({names}); at least {LEAST_LANDMARKS} are needed: \
         give the scans landmarks of the same scheme"
    )]
    TooFewLandmarks {
        /// How many.
        found: usize,
        /// Which.
        names: String,
    },
    /// Too few landmarks in common with the template.
    #[error(
        "scan `{scan}` has {found} of the template's landmarks; at least {LEAST_LANDMARKS} are needed: \
         give both landmarks of the same scheme"
    )]
    TooFewForTemplate {
        /// The scan.
        scan: String,
        /// How many.
        found: usize,
    },
    /// A mask that is none for its scan.
    #[error("the mask of scan `{name}` {error}")]
    Mask {
        /// The scan.
        name: String,
        /// What is wrong with it.
        error: MaskError,
    },
    /// A mask of the template that is none.
    #[error("the template's mask {0}")]
    TemplateMask(MaskError),
    /// Stopped on request.
    #[error(transparent)]
    Canceled(#[from] Canceled),
}

/// Fewer common landmarks than these do not fix a rotation of the sphere.
pub const LEAST_LANDMARKS: usize = 3;

/// Fits the sphere to one scan, stage 1 alone; returns positions `[N, 3]` in the scan's space.
///
/// # Errors
/// [`Canceled`] if the observer asked to stop.
pub fn fit_scan(
    name: &str,
    mesh: &TriangleMesh,
    settings: &FitSettings,
    observer: &dyn Observer,
) -> Result<Vec<DVec3>, Canceled> {
    let scan = ScanSurface::new(mesh, SAMPLES);
    let iterations = settings.levels.iter().map(|level| level.iterations).sum();
    let watch = Watch { observer, stage: Stage::Fit, scan: name, iterations };
    let positions = fit(&scan, settings, &[], &watch)?;
    Ok(positions.into_iter().map(|p| scan.to_scan(p)).collect())
}

/// Registers a collection: fit, resample, register, and rounds of the groupwise stage.
///
/// # Errors
/// [`RegisterError`] for an empty collection, too few common landmarks, a mask that does not fit its scan, or a request
/// to stop.
pub fn register(
    subjects: &[Subject],
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<Registration, RegisterError> {
    let names = common_landmarks(subjects)?;
    check_masks(subjects)?;
    let mut run = Run { settings, observer, names, seconds: BTreeMap::new() };
    if subjects.len() == 1 && run.starts_from_head(subjects) && settings.vertices == head().positions.len() {
        return register_to(head(), subjects, settings, observer);
    }
    let members = run.timed(Stage::Prepare, |run| run.prepare(subjects));
    let mut shared = if run.starts_from_head(subjects) {
        run.timed(Stage::Prepare, |run| run.lay_head(&members))
    } else {
        run.deform_sphere(&members)?
    };
    if settings.groupwise.rounds > 0 {
        shared = run.timed(Stage::Groupwise, |run| run.groupwise(&members, shared))?;
    }
    let SharedMesh { sphere, points, shapes, mean } = shared;
    let back =
        |(member, shape): (&Prepared, &Vec<Vec3A>)| shape.iter().map(|p| member.scan.to_scan(*p)).collect();
    Ok(Registration {
        template: Template::of_sphere(
            &sphere,
            run.names.iter().cloned().zip(points),
            &mean,
            scheme(subjects),
        ),
        members: members.iter().zip(&shapes).map(back).collect(),
        confidence: (members.iter().zip(&shapes))
            .map(|(member, shape)| confidence(&member.scan, &sphere.connectivity.topology, shape))
            .collect(),
        seconds: run.seconds,
    })
}

/// Whether every mask is one of its scan.
pub(super) fn check_masks(subjects: &[Subject]) -> Result<(), RegisterError> {
    for Subject { name, mesh, mask, .. } in subjects {
        let checked = mask.as_ref().map_or(Ok(()), |mask| check_mask(mask, mesh.positions().len()));
        checked.map_err(|error| RegisterError::Mask { name: name.clone(), error })?;
    }
    Ok(())
}

/// The scheme of the landmarks, where a scan names one.
fn scheme(subjects: &[Subject]) -> Option<&str> {
    subjects.iter().find_map(|subject| subject.landmarks.scheme.as_deref())
}

/// The landmarks that every scan has, in the first one's order.
fn common_landmarks(subjects: &[Subject]) -> Result<Vec<String>, RegisterError> {
    let first = subjects.first().ok_or(RegisterError::Empty)?;
    let everywhere = |name: &str| subjects.iter().all(|s| s.landmarks.get(name).is_some());
    let names: Vec<String> =
        first.landmarks.present().map(|(name, _)| name.to_owned()).filter(|name| everywhere(name)).collect();
    if names.len() < LEAST_LANDMARKS {
        return Err(RegisterError::TooFewLandmarks { found: names.len(), names: names.join(", ") });
    }
    Ok(names)
}

fn last_level(settings: &FitSettings) -> u32 {
    settings.levels.last().map_or(0, |level| level.level)
}

/// A scan in unit space, turned as the collection's first one, with its landmarks.
struct Prepared<'a> {
    name: &'a str,
    scan: ScanSurface,
    landmarks: Vec<Vec3A>,
    /// How much each of them counts.
    weights: Vec<f64>,
}

struct Run<'a> {
    settings: &'a Settings,
    observer: &'a dyn Observer,
    /// The landmarks in use.
    names: Vec<String>,
    seconds: BTreeMap<Stage, f64>,
}

impl Run<'_> {
    fn timed<T>(&mut self, stage: Stage, work: impl FnOnce(&Self) -> T) -> T {
        let start = Instant::now();
        let result = work(self);
        // A stage may have several parts.
        *self.seconds.entry(stage).or_default() += start.elapsed().as_secs_f64();
        result
    }

    fn starts_from_head(&self, subjects: &[Subject]) -> bool {
        let settings = self.settings;
        settings.from_head
            && settings.groupwise.rounds > 0
            && last_level(&settings.register) <= HEAD_LEVEL
            && head::has_landmarks(&self.names, scheme(subjects))
    }

    /// The head that comes with the program, laid on every member by the landmarks.
    fn lay_head(&self, members: &[Prepared]) -> SharedMesh {
        let sphere = Sphere::of_level(last_level(&self.settings.register));
        let points = sphere.surface_points(head::directions(&self.names));
        let head = head::positions(sphere.level);
        let on_head: Vec<DVec3> = points
            .iter()
            .map(|at| {
                let corners = sphere.connectivity.topology.triangles[at.triangle.0 as usize];
                interpolate(&head, corners, at.weights.map(|w| w as f32)).as_dvec3()
            })
            .collect();
        let head: Vec<DVec3> = head.iter().map(|p| p.as_dvec3()).collect();
        let lay = |member: &Prepared| {
            let targets: Vec<DVec3> = member.landmarks.iter().map(|p| p.as_dvec3()).collect();
            laid(&head, &on_head, &targets, &member.weights)
        };
        SharedMesh { shapes: members.iter().map(lay).collect(), sphere, points, mean: Vec::new() }
    }

    /// The paper's stages: fit, resample, register.
    fn deform_sphere(&mut self, members: &[Prepared]) -> Result<SharedMesh, Canceled> {
        let fits = self.timed(Stage::Fit, |run| run.fit_all(Stage::Fit, members, &run.settings.fit, &[]))?;
        let on_sphere = self.timed(Stage::Resample, |run| run.resample(members, &fits));
        let shapes = self.timed(Stage::Register, |run| {
            run.fit_all(Stage::Register, members, &run.settings.register, &on_sphere)
        })?;
        let sphere = Sphere::of_level(last_level(&self.settings.register));
        let points = sphere.surface_points(on_sphere);
        Ok(SharedMesh { sphere, points, shapes, mean: Vec::new() })
    }

    fn prepare<'s>(&self, subjects: &'s [Subject]) -> Vec<Prepared<'s>> {
        let landmarks = |subject: &Subject| -> Vec<DVec3> {
            self.names.iter().filter_map(|name| subject.landmarks.get(name)).collect()
        };
        let Some(first) = subjects.first().map(landmarks) else { return Vec::new() };
        let counted = LandmarkWeights::of(subjects, self.settings);
        let prepare = |(number, subject): (usize, &'s Subject)| {
            let own = landmarks(subject);
            let weights = counted.on(number, &self.names);
            let rotation = Similarity::between(&own, &first, &weights).rotation;
            let scan = ScanSurface::weighted(&subject.mesh, subject.mask.as_deref(), rotation, SAMPLES);
            let landmarks = own.iter().map(|&p| scan.to_unit(p)).collect();
            Prepared { name: &subject.name, scan, landmarks, weights }
        };
        subjects.par_iter().enumerate().map(prepare).collect()
    }

    fn fit_all(
        &self,
        stage: Stage,
        members: &[Prepared],
        settings: &FitSettings,
        on_sphere: &[DVec3],
    ) -> Result<Vec<Vec<Vec3A>>, Canceled> {
        let iterations = settings.levels.iter().map(|level| level.iterations).sum();
        let one = |member: &Prepared| {
            let landmarks: Vec<SphereLandmark> = on_sphere
                .iter()
                .zip(member.landmarks.iter().zip(&member.weights))
                .map(|(&on_sphere, (&target, &weight))| SphereLandmark { on_sphere, target, weight })
                .collect();
            let watch = Watch { observer: self.observer, stage, scan: member.name, iterations };
            fit(&member.scan, settings, &landmarks, &watch)
        };
        members.par_iter().map(one).collect()
    }

    /// Where the landmarks lie on the sphere, averaged over the members.
    fn resample(&self, members: &[Prepared], fits: &[Vec<Vec3A>]) -> Vec<DVec3> {
        let sphere = Sphere::of_level(last_level(&self.settings.fit));
        let carried: Vec<Vec<DVec3>> = members
            .par_iter()
            .zip(fits)
            .map(|(member, fitted)| resample::landmarks_on_sphere(&sphere, fitted, &member.landmarks))
            .collect();
        resample::average(&carried, &self.landmark_weights())
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

    /// Rounds of taking the mean and registering it to every member; the last is on the template's own level.
    fn groupwise(&self, members: &[Prepared], mut shared: SharedMesh) -> Result<SharedMesh, Canceled> {
        let settings = &self.settings.groupwise;
        let per_round = settings.phases * settings.iterations;
        for round in 0..settings.rounds {
            if round + 1 == settings.rounds {
                shared.refine_to(Icosphere::level_of(self.settings.vertices).unwrap_or(0));
            }
            let scans: Vec<&ScanSurface> = members.iter().map(|member| &member.scan).collect();
            let known = known(&shared.sphere.connectivity, &scans, &shared.shapes);
            let trust = trust(&shared.sphere, members, &shared.shapes);
            shared.mean = mean_shape(&shared.shapes, &trust, &known);
            close_smoothly(&shared.sphere.connectivity, &mut shared.mean, &unknown(&known));
            if round > 0 {
                shared.redistribute(&scans, settings);
            }
            let rest = RestShape::new(shared.sphere.connectivity.clone(), shared.mean.clone());
            let one = |((member, shape), known): ((&Prepared, &Vec<Vec3A>), &Vec<f64>)| {
                let watch = Watch {
                    observer: self.observer,
                    stage: Stage::Groupwise,
                    scan: member.name,
                    iterations: per_round * settings.rounds,
                };
                let pulls = pulls(&shared.points, member);
                let start = moved_onto(&rest.positions, shape, known);
                let member = Member { scan: &member.scan, landmarks: &pulls, start };
                register_member(&rest, member, settings, &watch, round * per_round)
            };
            shared.shapes =
                members.par_iter().zip(&shared.shapes).zip(&known).map(one).collect::<Result<_, _>>()?;
        }
        Ok(shared)
    }
}

fn pulls(points: &[SurfacePoint], member: &Prepared) -> Vec<LandmarkPull> {
    let targets = member.landmarks.iter().zip(&member.weights);
    let pull = |(point, (&target, &weight))| LandmarkPull {
        weight: weight as f32,
        ..LandmarkPull::new(point, target)
    };
    points.iter().zip(targets).map(pull).collect()
}

/// A shape moved onto another of the same vertices by a similarity, with a weight for each vertex.
pub(super) fn moved_onto(shape: &[Vec3A], other: &[Vec3A], weights: &[f64]) -> Vec<Vec3A> {
    let from: Vec<DVec3> = shape.iter().map(|p| p.as_dvec3()).collect();
    let to: Vec<DVec3> = other.iter().map(|p| p.as_dvec3()).collect();
    let similarity = Similarity::between(&from, &to, weights);
    from.iter().map(|p| similarity.apply(*p).as_vec3a()).collect()
}

/// A weight for each member in the mean: the inverse of its mean squared distance, so that a shape that missed its scan
/// does not spoil the mean.
fn trust(sphere: &Sphere, members: &[Prepared], shapes: &[Vec<Vec3A>]) -> Vec<f64> {
    let one = |(member, shape): (&Prepared, &Vec<Vec3A>)| {
        let index = SurfaceIndex::new(shape, &sphere.connectivity.topology.triangles);
        let (mut sum, mut count) = (0.0, 0.0);
        for sample in (0..JUDGED).map(|k| member.scan.sample(k)).filter(|sample| sample.weight > 0.0) {
            let weight = f64::from(sample.weight);
            sum += weight * f64::from(index.closest(sample.point).distance_squared);
            count += weight;
        }
        1.0 / (sum / f64::max(count, 1.0) + 1e-6)
    };
    members.par_iter().zip(shapes).map(one).collect()
}
