//! Whole registrations.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3A};

use super::fit::fit;
use super::landmark_weights::LandmarkWeights;
use super::mask::{MaskError, check_mask};
use super::observer::{Canceled, Observer, Stage, Watch};
use super::plan::Plan;
use super::precheck::audit_landmarks;
use super::scan_surface::ScanSurface;
use super::settings::{FitSettings, Settings};
use super::sphere::Sphere;
use super::template::Template;
use crate::mesh::{LandmarkSet, TriangleMesh};
use crate::numeric::Similarity;
use crate::spatial::SurfaceIndex;

/// Samples of a scan that fits draw from.
pub(super) const SAMPLES: usize = 120_000;

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
    /// How far each vertex of each member is known from its scan's data `[M][N]`, from 0 to 1; see [`confidence`](super::confidence()).
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
    /// Intermediate results of another plan or version.
    #[error("an intermediate result is not what the step needs: register the scans again")]
    State,
    /// Stopped on request.
    #[error(transparent)]
    Canceled(#[from] Canceled),
}

/// Fewer common landmarks than these do not fix a rotation of the sphere.
pub const LEAST_LANDMARKS: usize = 3;

/// Fits the sphere to one scan, stage 1 alone; returns positions `[N, 3]` in the scan's space, and the scan as it was made
/// ready.
///
/// # Errors
/// [`Canceled`] if the observer asked to stop.
pub fn fit_scan(
    name: &str,
    mesh: &TriangleMesh,
    settings: &FitSettings,
    observer: &dyn Observer,
) -> Result<(Vec<DVec3>, ScanSurface), Canceled> {
    let scan = ScanSurface::new(mesh, SAMPLES);
    let iterations = settings.levels.iter().map(|level| level.iterations).sum();
    let watch = Watch { observer, stage: Stage::Fit, scan: name, iterations };
    let positions = fit(&scan, settings, &[], &watch)?;
    Ok((positions.into_iter().map(|p| scan.to_scan(p)).collect(), scan))
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
    let landmarks: Vec<&LandmarkSet> = subjects.iter().map(|subject| &subject.landmarks).collect();
    let weights = LandmarkWeights::of(|| audit_landmarks(subjects), settings);
    Plan::new(&landmarks, settings)?.weighing(weights).run(subjects, observer)
}

/// Registers every scan from the template, by the landmarks that it has in common with the template.
///
/// The template is laid on each scan by the similarity of those landmarks and then deformed by the energies of the
/// groupwise stage, from stiff to soft. In further rounds the mean of the results takes the template's place; not if the
/// template is frozen: then a scan's result is the same whatever else is registered.
///
/// Components of the template that carry no landmark, eyeballs for instance, are matched to nothing: each follows the
/// others around it and keeps its shape.
///
/// # Errors
/// [`RegisterError`] for an empty collection, a scan with too few of the template's landmarks, or a request to stop.
pub fn register_to(
    template: &Template,
    subjects: &[Subject],
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<Registration, RegisterError> {
    let weights = LandmarkWeights::of(|| audit_landmarks(subjects), settings);
    Plan::from_template(template, subjects.len(), settings)?.weighing(weights).run(subjects, observer)
}

impl Subject {
    /// Whether its mask, if it has one, is one of its scan.
    pub(super) fn check_mask(&self) -> Result<(), RegisterError> {
        let checked = self.mask.as_ref().map_or(Ok(()), |mask| check_mask(mask, self.mesh.positions().len()));
        checked.map_err(|error| RegisterError::Mask { name: self.name.clone(), error })
    }
}

/// A shape moved onto another of the same vertices by a similarity, with a weight for each vertex.
pub(super) fn moved_onto(shape: &[Vec3A], other: &[Vec3A], weights: &[f64]) -> Vec<Vec3A> {
    let from: Vec<DVec3> = shape.iter().map(|p| p.as_dvec3()).collect();
    let to: Vec<DVec3> = other.iter().map(|p| p.as_dvec3()).collect();
    let similarity = Similarity::between(&from, &to, weights);
    from.iter().map(|p| similarity.apply(*p).as_vec3a()).collect()
}

/// A scan's weight in the mean: the inverse of its mean squared distance from its shape, so that one that was missed does
/// not spoil the mean.
pub(super) fn trust(sphere: &Sphere, scan: &ScanSurface, shape: &[Vec3A]) -> f64 {
    let index = SurfaceIndex::new(shape, &sphere.connectivity.topology.triangles);
    let (mut sum, mut count) = (0.0, 0.0);
    for sample in (0..JUDGED).map(|k| scan.sample(k)).filter(|sample| sample.weight > 0.0) {
        let weight = f64::from(sample.weight);
        sum += weight * f64::from(index.closest(sample.point).distance_squared);
        count += weight;
    }
    1.0 / (sum / f64::max(count, 1.0) + 1e-6)
}
