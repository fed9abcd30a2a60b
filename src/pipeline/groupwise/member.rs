use std::sync::Arc;

use glam::{Mat3A, Vec3A};
use rayon::prelude::*;

use super::RestShape;
use super::film::fall;
use super::settle::settle;
use super::unfold::unfold;
use crate::energy::LandmarkPull;
use crate::mesh::{Normals, interpolate};
use crate::numeric::{SolveBuffer, SparseCholesky, SymmetricMatrix};
use crate::pipeline::observer::{Canceled, Watch};
use crate::pipeline::{GroupwiseSettings, ScanSurface, SurfaceSample};
use crate::spatial::{Hit, SurfaceIndex};

/// The system is factored anew after this many iterations; in between it is a good preconditioner.
const FACTOR_EVERY: usize = 8;

/// One vertex in this many seeks its closest point among all in each iteration, before and after the shape has settled;
/// the others walk to it from their last. Twelve scans came out alike with all of them searching, in a third more time.
const FRESH: [usize; 2] = [8, 4];

/// Samples come in so many batches a phase, in turn.
const BATCHES: usize = 2;

/// One sample in this many seeks its closest point among all each time it comes; the others walk from their last.
const FRESH_SAMPLES: usize = 4;

/// The last answer of a sample that has none.
const NOWHERE: u32 = u32::MAX;

/// Weight that keeps a vertex without data where it is.
const INERTIA: f64 = 0.1;

/// Matches farther than this pull towards the sample itself; nearer ones more and more only along its normal.
const FAR: f32 = 0.03;

/// Cosine between normals of surfaces that do not belong together.
const TURNED: f32 = 0.5;

/// Share of the phases after which far samples no longer lead: the template lies on the scan, follows what is near, and
/// every vertex is held by some point of it.
const SETTLED: f64 = 0.65;

/// Diffusion of the normals along which films fall, so that all of one falls together.
const FALL_SMOOTHING: f64 = 16.0;

/// Iterations of a round before the last, as shares of the last one's: before and after the shape has settled. Members that are
/// drawn all the way to their scans before there is a common shape slide on them, each its own way; but an open mouth is
/// entered in these rounds or never.
const SHARES: [(usize, usize); 2] = [(1, 3), (2, 3)];

/// Share of the phases after which films fall: while the shape is stiff enough to fall in one piece.
const FALLING: f64 = 0.4;

/// Distortion at which a match of a template with a rim counts a quarter (Geman and McClure's weight).
const TORN: f32 = 0.6;

/// One scan of the collection, and where its registration begins.
pub struct Member<'a> {
    /// The scan.
    pub scan: &'a ScanSurface,
    /// Its landmarks and where they lie on the rest shape.
    pub landmarks: &'a [LandmarkPull],
    /// The rest shape in the scan's unit space `[N, 3]`.
    pub start: Vec<Vec3A>,
}

/// Which of a member's registrations it is. In the last the shape settles on the scan and is unfolded there; from the others
/// only a mean is taken.
#[derive(Debug, Clone, Copy)]
pub struct Turn {
    /// Those before.
    pub round: usize,
    /// All of them.
    pub rounds: usize,
}

impl Turn {
    fn is_last(self) -> bool {
        self.round + 1 >= self.rounds
    }

    /// Iterations of a phase.
    fn iterations(self, phase: usize, settings: &GroupwiseSettings) -> usize {
        let (share, of) = SHARES[usize::from(has_settled(phase, settings))];
        if self.is_last() { settings.iterations } else { (share * settings.iterations).div_ceil(of) }
    }

    /// Iterations of the round.
    fn own(self, settings: &GroupwiseSettings) -> usize {
        (0..settings.phases).map(|phase| self.iterations(phase, settings)).sum()
    }

    /// Iterations of the rounds before it, which are all alike.
    fn done(self, settings: &GroupwiseSettings) -> usize {
        self.round * Self { round: 0, ..self }.own(settings)
    }

    /// Iterations of all rounds.
    pub fn total(self, settings: &GroupwiseSettings) -> usize {
        let last = Self { round: self.rounds.saturating_sub(1), ..self };
        last.done(settings) + last.own(settings)
    }
}

/// How far a round is.
fn share_of(phase: usize, settings: &GroupwiseSettings) -> f64 {
    phase as f64 / (settings.phases - 1).max(1) as f64
}

fn has_settled(phase: usize, settings: &GroupwiseSettings) -> bool {
    share_of(phase, settings) >= SETTLED
}

/// Deforms the rest shape to a member, stiff to soft; returns positions `[N, 3]` in the scan's unit space.
///
/// # Errors
/// [`Canceled`] if the observer asked to stop.
pub fn register_member(
    rest: &RestShape,
    member: Member,
    settings: &GroupwiseSettings,
    watch: &Watch,
    turn: Turn,
) -> Result<Vec<Vec3A>, Canceled> {
    let (scan, landmarks) = (member.scan, member.landmarks);
    let mut registration = Registration::new(rest, member, settings);
    let mut done = turn.done(settings);
    for phase in 0..settings.phases {
        registration.enter(phase);
        for iteration in 0..turn.iterations(phase, settings) {
            let distance = registration.step(iteration);
            done += 1;
            watch.step(done, distance)?;
        }
    }
    let Registration { mut p, mut index, .. } = registration;
    if turn.is_last() {
        // What settles on a fold keeps it, and settling may fold what was thin.
        unfold(&rest.connectivity, scan, landmarks, &mut index, &mut p);
        settle(rest, scan, &settings.settle, &mut index, &mut p);
        unfold(&rest.connectivity, scan, landmarks, &mut index, &mut p);
    }
    Ok(p)
}

/// A parameter that changes by the same factor from phase to phase; evenly where an end is zero and there is no factor.
fn geometric([first, last]: [f64; 2], x: f64) -> f64 {
    if first > 0.0 && last > 0.0 { first * (last / first).powf(x) } else { first + (last - first) * x }
}

struct Registration<'a> {
    rest: &'a RestShape,
    scan: &'a ScanSurface,
    landmarks: &'a [LandmarkPull],
    /// The rest shape has a rim.
    ends: bool,
    settings: &'a GroupwiseSettings,
    phase: Phase,
    smoother: Option<Arc<SparseCholesky>>,
    system: Option<SparseCholesky>,
    factored_weights: Vec<f32>,
    p: Vec<Vec3A>,
    normals: Normals,
    /// Of the shape; built once, since what lies together stays together.
    index: SurfaceIndex,
    hints: Vec<u32>,
    samples_taken: usize,
    /// For each of a phase's batches of samples, the last answers.
    sample_hints: Vec<Vec<u32>>,
    buffer: SolveBuffer,
}

/// The closest scan point of a vertex, and how much it counts as data.
#[derive(Clone, Copy)]
struct VertexHit {
    hit: Hit,
    weight: f32,
}

/// A scan sample, the template point it pulls, and how firmly: far samples pull no harder than [`FAR`] away.
struct SampleHit {
    sample: SurfaceSample,
    hit: Hit,
    weight: f32,
}

/// The parameters of a phase.
#[derive(Debug, Clone, Copy, Default)]
struct Phase {
    stiffness: f64,
    landmark_weight: f64,
    normal_search: f32,
    reach: f32,
    sample_reach: f32,
    least_cosine: f32,
    samples: usize,
    fall_beyond: f32,
    /// One vertex in this many seeks its closest point anew each time; the others walk from their last.
    fresh: usize,
}

impl<'a> Registration<'a> {
    fn new(rest: &'a RestShape, member: Member<'a>, settings: &'a GroupwiseSettings) -> Self {
        let topology = &rest.connectivity.topology;
        Self {
            rest,
            scan: member.scan,
            landmarks: member.landmarks,
            ends: topology.on_rim.contains(&true),
            settings,
            phase: Phase::default(),
            smoother: None,
            system: None,
            factored_weights: Vec::new(),
            normals: Normals::new(topology, &member.start),
            index: SurfaceIndex::new(&member.start, &topology.triangles),
            hints: vec![0; member.start.len()],
            p: member.start,
            samples_taken: 0,
            sample_hints: Vec::new(),
            buffer: SolveBuffer::default(),
        }
    }

    fn enter(&mut self, phase: usize) {
        let settings = self.settings;
        let x = share_of(phase, settings);
        let ramp = |ramp: [f32; 2]| geometric(ramp.map(f64::from), x) as f32;
        let stiffness = geometric(settings.stiffness, x);
        let settled = has_settled(phase, settings);
        // What hangs behind an open scan is held by nothing: the sheet in front turns its back on it.
        let held = settled && !self.scan.open;
        self.phase = Phase {
            stiffness,
            // As firm as the shape is stiff, so that landmarks lead from the beginning.
            landmark_weight: settings.landmark_weight * stiffness.max(1.0),
            normal_search: ramp(settings.normal_search),
            reach: if held { f32::INFINITY } else { ramp(settings.reach) },
            sample_reach: if settled { settings.sample_reach } else { ramp(settings.reach) },
            // Stiff, the shape has few ways to move and few samples show them all.
            samples: if settled { settings.samples } else { settings.samples / 4 },
            // Settled, every vertex is held by the scan, whichever way it looks: none is left to stick out.
            least_cosine: if held { -1.0 } else { settings.least_cosine },
            fresh: if settled { FRESH[1] } else { FRESH[0] },
            fall_beyond: if x >= FALLING { settings.fall_beyond } else { 0.0 },
        };
        self.samples_taken += self.sample_hints.iter().map(Vec::len).sum::<usize>();
        self.sample_hints = vec![vec![NOWHERE; self.phase.samples]; BATCHES];
        self.smoother = Some(self.rest.connectivity.diffusion(geometric(settings.smoothing, x)));
    }

    /// One step of Gauss and Newton with a lagging matrix; returns the mean distance of the matches.
    fn step(&mut self, iteration: usize) -> f64 {
        let connectivity = &self.rest.connectivity;
        self.normals.update(&connectivity.topology, &self.p);
        self.index.refit(&self.p);
        let mut vertices = self.match_vertices(iteration);
        let mut samples = self.match_samples(&vertices, iteration);
        let gradients =
            self.smoother.clone().map(|smoother| self.rest.gradients(&self.p, &smoother, &mut self.buffer));
        if let (true, Some(gradients)) = (self.ends, &gradients) {
            self.distrust_what_tears(gradients, &mut vertices, &mut samples);
        }
        let falls = self.falls(&vertices);
        let mut force = vec![Vec3A::ZERO; self.p.len()];
        let distance = self.add_vertex_forces(&vertices, &falls, &mut force)
            + self.add_sample_forces(&samples, &mut force);
        self.add_landmark_forces(&mut force);
        if let Some(gradients) = gradients {
            self.rest.add_force(&self.p, &gradients, self.phase.stiffness as f32, &mut force);
        }
        let weights = self.data_weights(&vertices, &samples);
        if iteration.is_multiple_of(FACTOR_EVERY) {
            self.system = self.factor(&vertices, &samples).or(self.system.take());
            self.factored_weights = weights;
        } else {
            // Matches that the factored matrix does not know of would overshoot.
            for ((force, now), factored) in force.iter_mut().zip(weights).zip(&self.factored_weights) {
                *force *= (factored / now).min(1.0);
            }
        }
        if let Some(system) = &self.system {
            system.solve(&mut force, &mut self.buffer);
            self.p.iter_mut().zip(&force).for_each(|(p, step)| *p += *step);
        }
        distance
    }

    /// Weakens matches where the template is torn apart. The scan goes on where a template ends, behind its ears for
    /// instance, and there what lies nearest is not what belongs together.
    fn distrust_what_tears(
        &self,
        gradients: &[Mat3A],
        vertices: &mut [Option<VertexHit>],
        samples: &mut [Option<SampleHit>],
    ) {
        let trust = |distortion: f32| (1.0 + (distortion / TORN).powi(2)).powi(-2);
        let trust: Vec<f32> = self.rest.distortion(&self.p, gradients).into_iter().map(trust).collect();
        for (found, trust) in vertices.iter_mut().zip(&trust) {
            found.iter_mut().for_each(|found| found.weight *= trust);
        }
        for found in samples.iter_mut().flatten() {
            let corners = self.rest.connectivity.topology.triangles[found.hit.triangle as usize];
            found.weight *= corners.iter().map(|&i| trust[i as usize]).fold(1.0, f32::min);
        }
    }

    /// How firmly data holds each vertex `[N]`.
    fn data_weights(&self, vertices: &[Option<VertexHit>], samples: &[Option<SampleHit>]) -> Vec<f32> {
        let mut weights: Vec<f32> = vertices.iter().map(|hit| INERTIA as f32 + weight_of(hit)).collect();
        for SampleHit { hit, weight, .. } in samples.iter().flatten() {
            let corners = self.rest.connectivity.topology.triangles[hit.triangle as usize];
            for (&i, w) in corners.iter().zip(hit.weights) {
                weights[i as usize] += weight * w;
            }
        }
        weights
    }

    fn match_vertices(&mut self, iteration: usize) -> Vec<Option<VertexHit>> {
        let (p, normals, scan, rest) = (&self.p, &self.normals.vertices, self.scan, self.rest);
        let fresh = self.phase.fresh;
        let (search, reach) = (self.phase.normal_search, self.phase.reach);
        let least_cosine = self.phase.least_cosine;
        let closest = |(i, hint): (usize, &mut u32)| {
            let (normal_weight, bound) = (search * search, reach * reach);
            let walked = (iteration > 0 && !(i + iteration).is_multiple_of(fresh)).then(|| {
                let walked = &scan.walk;
                walked.closest_oriented(&scan.positions, p[i], normals[i], normal_weight, least_cosine, *hint)
            });
            let hit = walked.flatten().filter(|hit| hit.distance_squared < bound).or_else(|| {
                let index = &scan.index;
                index.closest_oriented(p[i], normals[i], normal_weight, least_cosine, bound, Some(*hint))
            })?;
            *hint = hit.triangle;
            // What closes an open scan from within hangs between its walls, which are not for it.
            let (normal, difference) = (scan.normal_at(&hit), p[i] - hit.point);
            let within = difference.dot(normal) < -FAR && normals[i].dot(normal) < TURNED;
            let weight = scan.weight_at(&hit) * rest.takes(i);
            (!within && weight > 0.0).then_some(VertexHit { hit, weight })
        };
        self.hints.par_iter_mut().enumerate().with_min_len(128).map(closest).collect()
    }

    /// Which matched vertices fall instead, and how far.
    fn falls(&mut self, matches: &[Option<VertexHit>]) -> Vec<Option<Vec3A>> {
        let beyond = self.phase.fall_beyond;
        let far = |found: &Option<VertexHit>| found.is_some_and(|f| f.hit.distance_squared > beyond * beyond);
        if beyond <= 0.0 || !matches.iter().any(far) {
            return vec![None; matches.len()];
        }
        let mut normals = self.normals.vertices.clone();
        self.rest.connectivity.diffusion(FALL_SMOOTHING).solve(&mut normals, &mut self.buffer);
        let (scan, p) = (self.scan, &self.p);
        let one = |i: usize| {
            let falls = far(&matches[i]).then(|| fall(scan, p[i], -normals[i].normalize_or_zero(), beyond));
            falls.flatten()
        };
        (0..p.len()).into_par_iter().with_min_len(128).map(one).collect()
    }

    fn match_samples(&mut self, vertices: &[Option<VertexHit>], iteration: usize) -> Vec<Option<SampleHit>> {
        let (scan, rest, index, settings) = (self.scan, self.rest, &self.index, self.settings);
        let off: Vec<f32> =
            vertices.iter().map(|found| found.map_or(f32::MAX, |f| f.hit.distance_squared)).collect();
        let (triangles, rim) = (&self.rest.connectivity.topology.triangles, &self.rest.connectivity.rim);
        let free = |sample: &SurfaceSample, hit: &Hit| {
            let difference = sample.point - hit.point;
            let distance = difference.length();
            // A template point that already lies on the scan is not for far samples to pull: they belong to a part of
            // the scan that the template has yet to enter elsewhere, as an open mouth.
            let own =
                triangles[hit.triangle as usize].iter().map(|&i| off[i as usize]).fold(0.0, f32::max).sqrt();
            // Nor are two sheets a match that turn their backs on each other, as a cheek and the mouth behind it.
            let facing =
                difference.dot(index.triangle_normal(hit.triangle)) * difference.dot(sample.normal) >= 0.0;
            distance < settings.slack || (facing && own + settings.slack > settings.own_share * distance)
        };
        let (batch, visit) = (iteration % BATCHES, iteration / BATCHES);
        let first = self.samples_taken + batch * self.phase.samples;
        let (p, walk, search) = (&self.p, self.rest.connectivity.walk(), self.phase.normal_search);
        let (sample_reach, per_sample) = (self.phase.sample_reach, self.sample_weight());
        let closest = |(k, last): (usize, &mut u32)| {
            let sample = scan.sample(first + k);
            let (point, normal, normal_weight) = (sample.point, sample.normal, search * search);
            let (least_cosine, bound) = (settings.sample_least_cosine, sample_reach * sample_reach);
            let walks = *last != NOWHERE && !(k + visit).is_multiple_of(FRESH_SAMPLES);
            let walked =
                walks.then(|| walk.closest_oriented(p, point, normal, normal_weight, least_cosine, *last));
            let hit = walked
                .flatten()
                .filter(|hit| hit.distance_squared < bound)
                .or_else(|| index.closest_oriented(point, normal, normal_weight, least_cosine, bound, None));
            *last = hit.map_or(NOWHERE, |hit| hit.triangle);
            // What lies beyond the template's rim is not for it.
            let is_for = |hit: &Hit| sample.weight > 0.0 && !rim.contains(hit.triangle, hit.weights);
            let hit = hit.filter(|hit| is_for(hit) && free(&sample, hit))?;
            let weight = (FAR / hit.distance_squared.sqrt().max(FAR)).min(1.0) * per_sample * sample.weight;
            let weight = weight * rest.takes_at(hit.triangle, hit.weights);
            (weight > 0.0).then_some(SampleHit { sample, hit, weight })
        };
        self.sample_hints[batch].par_iter_mut().enumerate().with_min_len(128).map(closest).collect()
    }

    /// Pull of each matched vertex to its closest point, mostly along the scan's normal, or along its fall.
    fn add_vertex_forces(
        &self,
        matches: &[Option<VertexHit>],
        falls: &[Option<Vec3A>],
        force: &mut [Vec3A],
    ) -> f64 {
        let mut sum = 0.0;
        for (i, (found, fall)) in matches.iter().zip(falls).enumerate() {
            if let Some(VertexHit { hit, weight }) = found {
                let difference = hit.point - self.p[i];
                sum += f64::from(difference.length());
                let pull = || along(difference, self.scan.normal_at(hit), self.settings.plane);
                force[i] += fall.unwrap_or_else(pull) * *weight;
            }
        }
        sum / matches.len() as f64
    }

    /// One sample weighs as many vertices as there are to a sample.
    fn sample_weight(&self) -> f32 {
        self.p.len() as f32 / self.phase.samples.max(1) as f32
    }

    fn add_sample_forces(&self, matches: &[Option<SampleHit>], force: &mut [Vec3A]) -> f64 {
        let mut sum = 0.0;
        for SampleHit { sample, hit, weight } in matches.iter().flatten() {
            let difference = sample.point - hit.point;
            let distance = difference.length();
            sum += f64::from(distance);
            let plane = self.settings.plane * (1.0 - (distance / FAR).min(1.0));
            let pull = along(difference, sample.normal, plane) * *weight;
            let corners = self.rest.connectivity.topology.triangles[hit.triangle as usize];
            for (&i, w) in corners.iter().zip(hit.weights) {
                force[i as usize] += pull * w;
            }
        }
        sum / matches.len().max(1) as f64
    }

    fn add_landmark_forces(&self, force: &mut [Vec3A]) {
        for landmark in self.landmarks {
            let corners = self.rest.connectivity.topology.triangles[landmark.triangle as usize];
            let now = interpolate(&self.p, corners, landmark.weights);
            let pull = (landmark.target - now) * (self.phase.landmark_weight as f32 * landmark.weight);
            for (&i, w) in corners.iter().zip(landmark.weights) {
                force[i as usize] += pull * w;
            }
        }
    }

    /// The half Hessian of everything but the planes' freedom, which it bounds from above.
    fn factor(
        &self,
        vertices: &[Option<VertexHit>],
        samples: &[Option<SampleHit>],
    ) -> Option<SparseCholesky> {
        let connectivity = &self.rest.connectivity;
        let diagonal = vertices.iter().map(|hit| INERTIA + f64::from(weight_of(hit))).collect();
        let mut matrix = SymmetricMatrix { diagonal, edges: vec![0.0; connectivity.topology.edges.len()] };
        for SampleHit { hit, weight, .. } in samples.iter().flatten() {
            connectivity.add_point(&mut matrix, hit.triangle, hit.weights, f64::from(*weight));
        }
        for landmark in self.landmarks {
            let weight = self.phase.landmark_weight * f64::from(landmark.weight);
            connectivity.add_point(&mut matrix, landmark.triangle, landmark.weights, weight);
        }
        self.rest.add_stiffness(self.phase.stiffness, &mut matrix);
        SparseCholesky::new(connectivity.elimination(), &matrix).ok()
    }
}

fn weight_of(found: &Option<VertexHit>) -> f32 {
    found.map_or(0.0, |found| found.weight)
}

/// A difference with this share of its part across the normal left out.
fn along(difference: Vec3A, normal: Vec3A, plane: f32) -> Vec3A {
    normal * normal.dot(difference) * plane + difference * (1.0 - plane)
}
