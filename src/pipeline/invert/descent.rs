//! One level of an inversion: AdamUniform on u, the photometric loss and the density.

use std::sync::Arc;

use glam::Vec3A;

use super::error::InvertError;
use super::light;
use super::settings::{InvertLevel, InvertSettings, Smooth};
use crate::energy::{Gradient, Shape, Smoothness, laplacian};
use crate::mesh::{Normals, Topology};
use crate::numeric::{AdamUniform, SolveBuffer};
use crate::pipeline::density_term::DensityTerm;
use crate::pipeline::sphere::Sphere;
use crate::render::{Light, MeshLayout, RenderGradient, Renderer, Surface, Target};
use crate::reparam::Reparameterization;

/// The step of the albedo, and the diffusion that keeps it smooth.
const ALBEDO_RATE: f32 = 1e-2;
const ALBEDO_LAMBDA: f64 = 1.0;

/// What a level is matched with.
pub(super) struct Matched {
    pub targets: Vec<Target>,
    /// The pixels that are the object's alone `[V][H * W]`, where the light is to be estimated.
    pub solid: Option<Vec<Vec<bool>>>,
}

/// The shape on its way.
#[derive(Debug, Clone)]
pub(super) struct State {
    /// p `[N, 3]` in unit space.
    pub positions: Vec<Vec3A>,
    /// a `[N, 3]`, where it is estimated.
    pub albedo: Option<Vec<[f32; 3]>>,
    /// The estimated light.
    pub light: Option<Light>,
}

pub(super) struct Descent<'a> {
    sphere: &'a Sphere,
    level: &'a InvertLevel,
    settings: &'a InvertSettings,
    matched: &'a Matched,
    /// The views in an order in which neighbours stand apart.
    order: Vec<usize>,
    reparameterization: Arc<Reparameterization>,
    density: DensityTerm,
    adam: AdamUniform,
    u: Vec<Vec3A>,
    state: State,
    paint: Option<Paint>,
    normals: Normals,
    gradient: Gradient,
    rendered: RenderGradient,
    buffer: SolveBuffer,
}

impl<'a> Descent<'a> {
    /// Takes the state and hands the renderer the mesh and the targets.
    pub fn new(
        sphere: &'a Sphere,
        settings: &'a InvertSettings,
        level: &'a InvertLevel,
        matched: &'a Matched,
        state: State,
        renderer: &mut dyn Renderer,
    ) -> Result<Self, InvertError> {
        let topology = &sphere.connectivity.topology;
        renderer.prepare(MeshLayout::of(topology), &matched.targets)?;
        if let Some(light) = state.light {
            renderer.set_lights(&vec![light; matched.targets.len()])?;
        }
        let reparameterization = sphere.reparameterization(level.lambda);
        Ok(Self {
            order: spread(matched.targets.len()),
            u: reparameterization.parameters(topology, &state.positions),
            density: DensityTerm::new(level.density, sphere),
            adam: AdamUniform::new(state.positions.len()),
            normals: Normals::new(topology, &state.positions),
            gradient: Gradient::zero(topology),
            rendered: RenderGradient::default(),
            buffer: SolveBuffer::default(),
            paint: state.albedo.as_deref().map(|albedo| Paint::new(sphere, albedo)),
            reparameterization,
            sphere,
            level,
            settings,
            matched,
            state,
        })
    }

    /// One iteration; returns the energy before it.
    pub fn step(&mut self, iteration: usize, renderer: &mut dyn Renderer) -> Result<f64, InvertError> {
        let x = iteration as f32 / self.level.iterations as f32;
        self.update_positions();
        if !self.state.positions.iter().all(|p| p.is_finite()) {
            return Err(InvertError::Diverged { iteration });
        }
        if iteration.is_multiple_of(self.settings.light_refresh.max(1)) {
            self.update_light(renderer)?;
        }
        let energy = self.add_energies(x, iteration, renderer)?;
        let topology = &self.sphere.connectivity.topology;
        let shape = Shape { topology, positions: &self.state.positions, normals: &self.normals };
        let gradient = self.gradient.total(shape);
        self.reparameterization.pull_back(gradient, &mut self.buffer);
        let rate = self.level.rate * self.level.rate_end.powf(x);
        self.adam.step(&mut self.u, gradient, rate);
        fair(topology, rate * self.level.fairing, &mut self.u);
        if let (Some(paint), Some(albedo)) = (&mut self.paint, &mut self.state.albedo) {
            paint.step(albedo, &self.rendered.albedo, &mut self.buffer);
        }
        Ok(energy)
    }

    /// The state after the last iteration.
    pub fn finish(mut self) -> State {
        self.update_positions();
        self.state
    }

    fn update_positions(&mut self) {
        self.state.positions.copy_from_slice(&self.u);
        self.reparameterization.to_positions(&mut self.state.positions, &mut self.buffer);
        self.normals.update(&self.sphere.connectivity.topology, &self.state.positions);
    }

    fn update_light(&mut self, renderer: &mut dyn Renderer) -> Result<(), InvertError> {
        let Some(solid) = &self.matched.solid else { return Ok(()) };
        let surface = Surface {
            positions: &self.state.positions,
            normals: &self.normals.vertices,
            albedo: self.state.albedo.as_deref(),
        };
        let found = light::estimate(renderer, &surface, &self.matched.targets, solid)?;
        self.state.light = found.or(self.state.light);
        Ok(())
    }

    /// E = E_p + w_u E_a + w_k E_a, and a smoothness in the ablations.
    fn add_energies(
        &mut self,
        x: f32,
        iteration: usize,
        renderer: &mut dyn Renderer,
    ) -> Result<f64, InvertError> {
        let topology = &self.sphere.connectivity.topology;
        let surface = Surface {
            positions: &self.state.positions,
            normals: &self.normals.vertices,
            albedo: self.state.albedo.as_deref(),
        };
        let views = batch(&self.order, self.level.batch, iteration);
        let mut energy = renderer.loss(&surface, &views, &mut self.rendered)?;
        self.gradient.clear(topology);
        self.gradient.positions.copy_from_slice(&self.rendered.positions);
        self.gradient.vertex_normals.copy_from_slice(&self.rendered.normals);
        let gradient = &mut self.gradient;
        let shape = Shape { topology, positions: &self.state.positions, normals: &self.normals };
        energy += self.density.add(shape, x, gradient, &mut self.buffer);
        let smooth = match self.level.smooth {
            Smooth::Off => None,
            Smooth::Laplacian { weight } => Some((Smoothness::Laplacian, weight)),
            Smooth::BiLaplacian { weight } => Some((Smoothness::BiLaplacian, weight)),
        };
        if let Some((term, weight)) = smooth {
            energy += f64::from(weight) * term.add(shape, weight, gradient);
        }
        Ok(energy)
    }
}

/// u - share L^2 u: bends that no picture asks for wear off, apart from the energies as weights decay in AdamW.
fn fair(topology: &Topology, share: f32, u: &mut [Vec3A]) {
    if share > 0.0 {
        let bends = laplacian(topology, &laplacian(topology, u));
        u.iter_mut().zip(bends).for_each(|(u, bend)| *u -= bend * share);
    }
}

/// Views in an order in which those that follow one another stand apart, where neighbours in the file stand together.
fn spread(views: usize) -> Vec<usize> {
    let gcd = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    // Near the golden section, and without a common divisor, so that each comes once.
    let step = (1..=views).min_by_key(|&step| {
        let off = (step as f64 - 0.618 * views as f64).abs();
        (gcd(step, views.max(1)) != 1, (off * 1000.0) as u64)
    });
    (0..views).map(|i| i * step.unwrap_or(1) % views).collect()
}

/// The views of an iteration, ascending.
fn batch(order: &[usize], size: usize, iteration: usize) -> Vec<usize> {
    let views = order.len();
    let size = if size == 0 { views } else { size.min(views) };
    let mut batch: Vec<usize> = (0..size).map(|i| order[(iteration * size + i) % views]).collect();
    batch.sort_unstable();
    batch
}

/// The albedo's own descent, diffused as positions are so that what no view sees follows what is seen.
struct Paint {
    reparameterization: Arc<Reparameterization>,
    adam: AdamUniform,
    u: Vec<Vec3A>,
}

impl Paint {
    fn new(sphere: &Sphere, albedo: &[[f32; 3]]) -> Self {
        let reparameterization = sphere.reparameterization(ALBEDO_LAMBDA);
        let albedo: Vec<Vec3A> = albedo.iter().map(|a| Vec3A::from_array(*a)).collect();
        let u = reparameterization.parameters(&sphere.connectivity.topology, &albedo);
        Self { reparameterization, adam: AdamUniform::new(albedo.len()), u }
    }

    fn step(&mut self, albedo: &mut [[f32; 3]], gradient: &[[f32; 3]], buffer: &mut SolveBuffer) {
        let mut gradient: Vec<Vec3A> = gradient.iter().map(|g| Vec3A::from_array(*g)).collect();
        self.reparameterization.pull_back(&mut gradient, buffer);
        self.adam.step(&mut self.u, &gradient, ALBEDO_RATE);
        let mut values = self.u.clone();
        self.reparameterization.to_positions(&mut values, buffer);
        // Light times albedo is all that is seen: the mean stays one.
        let mean = values.iter().sum::<Vec3A>() / values.len().max(1) as f32;
        let scale = mean.max(Vec3A::splat(1e-3)).recip();
        for (albedo, value) in albedo.iter_mut().zip(values) {
            *albedo = (value * scale).max(Vec3A::ZERO).to_array();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::setting_check::MOST_FAIRING;
    use super::*;
    use crate::mesh::Icosphere;

    #[test]
    fn bends_wear_off_and_what_is_smooth_stays() {
        let sphere = Icosphere::new(3);
        let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
        let smooth: Vec<Vec3A> = sphere.positions.iter().map(|p| p.as_vec3a()).collect();
        let faired = |mut u: Vec<Vec3A>| {
            (0..50).for_each(|_| fair(&topology, MOST_FAIRING, &mut u));
            u
        };
        let mut spiked = smooth.clone();
        spiked[300] *= 1.5;
        let (spiked, round) = (faired(spiked), faired(smooth.clone()));
        let most = |a: &[Vec3A], b: &[Vec3A], counts: &dyn Fn(usize) -> bool| {
            let counted = (0..a.len()).filter(|&i| counts(i));
            counted.map(|i| a[i].distance(b[i])).fold(0.0, f32::max)
        };
        let spike = most(&spiked, &round, &|i| i == 300);
        assert!(spike < 0.1, "{spike} of 0.5");
        let far = most(&spiked, &round, &|i| smooth[i].dot(smooth[300]) < 0.0);
        assert!(far < 1e-3, "{far}");
        // Its triangles are not all alike, so that L bends a sphere a little.
        let round = most(&round, &smooth, &|_| true);
        assert!(round < 0.04, "{round}");
    }

    #[test]
    fn every_view_has_its_turn() {
        for views in 1..40 {
            let order = spread(views);
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..views).collect::<Vec<_>>());
            let mut counts = vec![0; views];
            (0..views).flat_map(|i| batch(&order, 3, i)).for_each(|view| counts[view] += 1);
            assert!(counts.iter().all(|&count| count == 3.min(views)), "{views}: {counts:?}");
        }
        assert_eq!(batch(&spread(4), 0, 7), [0, 1, 2, 3]);
    }
}
