//! Scans registered from a given template: a user's own mesh, or that of an earlier collection.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use glam::{DVec3, Vec3A};
use rayon::prelude::*;

use super::carried::Parts;
use super::confidence::confidence;
use super::connectivity::Connectivity;
use super::groupwise::{Member, RestShape, mean_shape, register_member};
use super::known::known;
use super::landmark_weights::LandmarkWeights;
use super::laying::laid;
use super::mask::check_mask;
use super::observer::{Observer, Stage, Watch};
use super::register::{
    LEAST_LANDMARKS, RegisterError, Registration, SAMPLES, Subject, check_masks, moved_onto,
};
use super::scan_surface::ScanSurface;
use super::settings::Settings;
use super::template::Template;
use crate::energy::LandmarkPull;
use crate::mesh::SurfacePoint;
use crate::numeric::Similarity;

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
    if subjects.is_empty() {
        return Err(RegisterError::Empty);
    }
    check_masks(subjects)?;
    let mask = template.mask.as_ref().map_or(Ok(()), |mask| check_mask(mask, template.positions.len()));
    mask.map_err(RegisterError::TemplateMask)?;
    let start = Instant::now();
    let parts = Parts::of(template);
    let mut registration = register_main(&parts.main, subjects, settings, observer)?;
    registration.members = registration.members.iter().map(|member| parts.carry(member)).collect();
    registration.confidence = registration.confidence.iter().map(|main| parts.confidence(main)).collect();
    let positions = parts.carry(&registration.template.positions);
    registration.template = Template { positions, ..template.clone() };
    registration.seconds = BTreeMap::from([(Stage::Register, start.elapsed().as_secs_f64())]);
    Ok(registration)
}

/// Registers what is matched to the scans.
fn register_main(
    template: &Template,
    subjects: &[Subject],
    settings: &Settings,
    observer: &dyn Observer,
) -> Result<Registration, RegisterError> {
    let rest: Vec<Vec3A> = template.positions.iter().map(|p| p.as_vec3a()).collect();
    let connectivity = Arc::new(Connectivity::new(&rest, &template.triangles));
    let weights = LandmarkWeights::of(subjects, settings);
    let lay = |(number, subject)| Laid::of(template, subject, |names: &[&str]| weights.on(number, names));
    let members: Vec<Laid> = subjects.par_iter().enumerate().map(lay).collect::<Result<_, _>>()?;
    let scans: Vec<&ScanSurface> = members.iter().map(|member| &member.scan).collect();
    let settings = &settings.transfer;
    let rounds = if template.frozen || subjects.len() == 1 { 1 } else { settings.rounds.max(1) };
    let per_round = settings.phases * settings.iterations;
    let mut template = template.clone();
    let mut shapes: Vec<Vec<Vec3A>> = members.iter().map(|member| member.start.clone()).collect();
    for round in 0..rounds {
        if round > 0 {
            let known = known(&connectivity, &scans, &shapes);
            let mean = mean_shape(&shapes, &vec![1.0; shapes.len()], &known);
            shapes =
                shapes.iter().zip(&known).map(|(shape, known)| moved_onto(&mean, shape, known)).collect();
            template.positions = mean.iter().map(|p| p.as_dvec3()).collect();
        }
        let one = |(member, start): (&Laid, Vec<Vec3A>)| {
            let iterations = per_round * rounds;
            let watch = Watch { observer, stage: Stage::Register, scan: member.name, iterations };
            let rest = RestShape::new(connectivity.clone(), start.clone()).masked(template.mask.as_deref());
            let member = Member { scan: &member.scan, landmarks: &member.pulls, start };
            register_member(&rest, member, settings, &watch, round * per_round)
        };
        shapes = members.par_iter().zip(shapes).map(one).collect::<Result<_, _>>()?;
    }
    let confidence = (scans.par_iter().zip(&shapes))
        .map(|(scan, shape)| {
            let mut confidence = confidence(scan, &connectivity.topology, shape);
            for (confidence, taken) in confidence.iter_mut().zip(template.mask.iter().flatten()) {
                *confidence *= taken;
            }
            confidence
        })
        .collect();
    let back = |(member, shape): (&Laid, Vec<Vec3A>)| shape.iter().map(|p| member.scan.to_scan(*p)).collect();
    let members = members.iter().zip(shapes).map(back).collect();
    Ok(Registration { template, members, confidence, seconds: BTreeMap::new() })
}

/// A scan with the template laid on it.
struct Laid<'a> {
    name: &'a str,
    scan: ScanSurface,
    pulls: Vec<LandmarkPull>,
    /// The template in the scan's unit space `[N, 3]`.
    start: Vec<Vec3A>,
}

impl<'a> Laid<'a> {
    /// Lays the template on a scan by the landmarks that both have, which count as `weights` says of their names.
    fn of(
        template: &Template,
        subject: &'a Subject,
        weights: impl FnOnce(&[&str]) -> Vec<f64>,
    ) -> Result<Self, RegisterError> {
        let common = common_landmarks(template, subject)?;
        let weights = weights(&common.iter().map(|common| common.name).collect::<Vec<_>>());
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
        Ok(Self { name: &subject.name, scan, pulls, start })
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
