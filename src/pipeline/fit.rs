//! The sphere template to one scan, without landmarks (fit) or with them (register).

use std::sync::Arc;

use glam::Vec3A;

use super::density_term::DensityTerm;
use super::matching::{SampleMatcher, Search, VertexMatcher};
use super::observer::{Canceled, Watch};
use super::scan_surface::ScanSurface;
use super::settings::{FitSettings, LevelSettings, Ramp};
use super::sphere::Sphere;
use crate::energy::{
    Foldover, Gradient, LandmarkPull, Landmarks, Pull, SampleNormals, ScanToTemplate, Shape, TemplateToScan,
    VertexNormals,
};
use crate::mesh::{Normals, SurfacePoint};
use crate::numeric::{AdamUniform, SolveBuffer};
use crate::reparam::Reparameterization;

/// A landmark for every level to pull: its place on the unit sphere, and on the scan in unit space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphereLandmark {
    /// Direction from the sphere's centre.
    pub on_sphere: glam::DVec3,
    /// The scan's landmark.
    pub target: Vec3A,
    /// How much it counts.
    pub weight: f64,
}

/// Deforms the sphere to a scan, level after level; returns positions `[N, 3]` in unit space on the last level's sphere.
///
/// # Errors
/// [`Canceled`] if the observer asked to stop.
pub fn fit(
    scan: &ScanSurface,
    settings: &FitSettings,
    landmarks: &[SphereLandmark],
    watch: &Watch,
) -> Result<Vec<Vec3A>, Canceled> {
    // On a thread of the pool: from outside, each of the many short parallel loops would wait to be let in.
    rayon::scope(|_| fit_levels(scan, settings, landmarks, watch))
}

fn fit_levels(
    scan: &ScanSurface,
    settings: &FitSettings,
    landmarks: &[SphereLandmark],
    watch: &Watch,
) -> Result<Vec<Vec3A>, Canceled> {
    let mut positions: Vec<Vec3A> = Vec::new();
    let mut done = 0;
    for level in &settings.levels {
        let sphere = Sphere::of_level(level.level);
        positions = if positions.is_empty() {
            sphere.rest.iter().map(|p| *p * settings.start_radius).collect()
        } else {
            sphere.subdivide(&positions)
        };
        let pulls = landmark_pulls(&sphere, landmarks);
        let mut deformation = Deformation::new(scan, &sphere, level, positions, pulls);
        for iteration in 0..level.iterations {
            let energy = deformation.step(iteration);
            watch.step(done + iteration + 1, energy)?;
        }
        done += level.iterations;
        positions = deformation.finish();
    }
    Ok(positions)
}

fn landmark_pulls(sphere: &Sphere, landmarks: &[SphereLandmark]) -> Vec<LandmarkPull> {
    let points: Vec<SurfacePoint> = sphere.surface_points(landmarks.iter().map(|l| l.on_sphere));
    points
        .iter()
        .zip(landmarks)
        .map(|(point, l)| LandmarkPull { weight: l.weight as f32, ..LandmarkPull::new(point, l.target) })
        .collect()
}

/// One level's optimisation: AdamUniform on u, the energies of the paper and ours.
struct Deformation<'a> {
    scan: &'a ScanSurface,
    sphere: &'a Sphere,
    settings: &'a LevelSettings,
    landmarks: Vec<LandmarkPull>,
    reparameterization: Arc<Reparameterization>,
    density: DensityTerm,
    adam: AdamUniform,
    u: Vec<Vec3A>,
    positions: Vec<Vec3A>,
    normals: Normals,
    gradient: Gradient,
    vertices: VertexMatcher,
    samples: Option<SampleMatcher>,
    buffer: SolveBuffer,
}

fn at(ramp: Ramp, x: f32) -> f32 {
    ramp[0] + (ramp[1] - ramp[0]) * x
}

impl<'a> Deformation<'a> {
    fn new(
        scan: &'a ScanSurface,
        sphere: &'a Sphere,
        settings: &'a LevelSettings,
        positions: Vec<Vec3A>,
        landmarks: Vec<LandmarkPull>,
    ) -> Self {
        let reparameterization = sphere.reparameterization(settings.lambda);
        let topology = &sphere.connectivity.topology;
        Self {
            scan,
            sphere,
            settings,
            landmarks,
            u: reparameterization.parameters(topology, &positions),
            reparameterization,
            density: DensityTerm::new(settings.density, sphere),
            adam: AdamUniform::new(positions.len()),
            normals: Normals::new(topology, &positions),
            gradient: Gradient::zero(topology),
            vertices: VertexMatcher::new(positions.len()),
            samples: (settings.samples > 0)
                .then(|| SampleMatcher::new(scan, settings.samples, topology, &positions)),
            positions,
            buffer: SolveBuffer::default(),
        }
    }

    /// One iteration; returns the energy before it.
    fn step(&mut self, iteration: usize) -> f64 {
        let x = iteration as f32 / self.settings.iterations as f32;
        self.update_positions();
        if iteration.is_multiple_of(self.settings.refresh.max(1)) {
            let round = iteration / self.settings.refresh.max(1);
            self.update_matches(x, round);
        }
        let energy = self.add_energies(x);
        let shape = Shape {
            topology: &self.sphere.connectivity.topology,
            positions: &self.positions,
            normals: &self.normals,
        };
        let gradient = self.gradient.total(shape);
        self.reparameterization.pull_back(gradient, &mut self.buffer);
        self.adam.step(&mut self.u, gradient, self.settings.rate * self.settings.rate_end.powf(x));
        energy
    }

    fn finish(mut self) -> Vec<Vec3A> {
        self.update_positions();
        self.positions
    }

    fn update_positions(&mut self) {
        self.positions.copy_from_slice(&self.u);
        self.reparameterization.to_positions(&mut self.positions, &mut self.buffer);
        self.normals.update(&self.sphere.connectivity.topology, &self.positions);
    }

    /// Finds closest points in both directions anew.
    fn update_matches(&mut self, x: f32, round: usize) {
        let Self { scan, settings, positions, normals, .. } = self;
        let normal_search = at(settings.normal_search, x);
        let LevelSettings { least_cosine, vertex_fresh, sample_fresh, .. } = **settings;
        let search = Search { normal_search, least_cosine, fresh: vertex_fresh };
        self.vertices.update(scan, positions, normals, search, round);
        if let Some(samples) = &mut self.samples {
            // Samples see more than vertices do: into folds that the template has yet to enter.
            let search = Search { normal_search, least_cosine: -0.3, fresh: sample_fresh };
            samples.update(scan, positions, search, round);
        }
    }

    /// E = D_c + D_n in both directions + w_u E_a + w_k E_a + foldover + landmarks.
    fn add_energies(&mut self, x: f32) -> f64 {
        let topology = &self.sphere.connectivity.topology;
        let settings = self.settings;
        self.gradient.clear(topology);
        let gradient = &mut self.gradient;
        let shape = Shape { topology, positions: &self.positions, normals: &self.normals };
        let normal = at(settings.normal_weight, x);
        let floor = 0.2 * self.normals.mean_area_vector();
        let vertices = &self.vertices.matches;
        let mut energy = TemplateToScan { matches: vertices, pull: Pull::Distance }.add(shape, 1.0, gradient);
        energy += f64::from(normal) * VertexNormals { matches: vertices }.add(shape, normal, gradient);
        if let Some(SampleMatcher { matches: samples, .. }) = &self.samples {
            energy += ScanToTemplate { matches: samples, pull: Pull::Distance }.add(shape, 1.0, gradient);
            energy +=
                f64::from(normal) * SampleNormals { matches: samples, floor }.add(shape, normal, gradient);
        }
        energy += self.density.add(shape, x, gradient, &mut self.buffer);
        let foldover = at(settings.foldover, x);
        if foldover > 0.0 {
            energy += f64::from(foldover) * Foldover { cosine: 0.0, floor }.add(shape, foldover, gradient);
        }
        if !self.landmarks.is_empty() {
            let weight = at(settings.landmark_weight, x);
            energy += f64::from(weight) * Landmarks { pulls: &self.landmarks }.add(shape, weight, gradient);
        }
        energy
    }
}
