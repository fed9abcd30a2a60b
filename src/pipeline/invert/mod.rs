//! A mesh from several pictures with cameras: section 4 of the paper, and what is needed before and after it.
//!
//! The silhouettes' visual hull says where the object is and how large ([`UnitSpace`]); a sphere placed there is deformed
//! until it looks like the pictures, level after level.

mod cameras;
mod descent;
mod error;
mod files;
mod hull;
mod light;
mod pictures;
mod presets;
mod report;
mod setting_check;
mod settings;
mod shown;
mod silhouette;
mod targets;
#[cfg(test)]
mod tests;
mod unit_space;
mod views;

use std::time::Instant;

use glam::{DVec3, Vec3A};

pub use error::InvertError;
pub use pictures::ViewPictures;
pub use report::{AdapterEntry, HullReport, InversionReport, ViewReport};
pub use settings::{Albedo, InvertLevel, InvertPreset, InvertSettings, Smooth, What};
pub use shown::Shown;
pub use unit_space::UnitSpace;
pub use views::Views;

use super::observer::{Observer, Stage, Watch};
use super::register::fit_scan;
use super::settings::{Preset, Settings};
use super::sphere::Sphere;
use crate::formats::Photograph;
use crate::mesh::{Normals, TriangleMesh};
use crate::numeric::SolveBuffer;
use crate::render::{Light, MeshLayout, Renderer, Surface};
use cameras::Agreement;
use descent::{Descent, Matched, State};
use silhouette::Silhouette;
use targets::{Source, background};

/// What came of the pictures.
#[derive(Debug, Clone)]
pub struct Inversion {
    /// The mesh in the cameras' world, on the last level's sphere.
    pub mesh: TriangleMesh,
    /// The sphere's vertices that it came from `[N, 3]`, for texture coordinates.
    pub sphere: Vec<DVec3>,
    /// Colours of the vertices `[N, 3]`, where they were estimated.
    pub albedo: Option<Vec<[f32; 3]>>,
    /// What is behind it.
    pub report: InversionReport,
    /// Every view beside its picture.
    pub pictures: Vec<ViewPictures>,
}

/// Deforms a sphere until it looks like the pictures.
///
/// # Errors
/// [`InvertError`].
pub fn invert(
    views: &Views,
    settings: &InvertSettings,
    renderer: &mut dyn Renderer,
    observer: &dyn Observer,
) -> Result<Inversion, InvertError> {
    settings.check()?;
    let start = Instant::now();
    let scene = Scene::of(views, settings)?;
    let hull_seconds = start.elapsed().as_secs_f64();
    let watch = Watch { observer, stage: Stage::Invert, scan: "object", iterations: settings.iterations() };
    let start = Instant::now();
    let (sphere, state) = scene.descend(settings, renderer, &watch)?;
    let fit_seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let (mut reports, pictures) = scene.measure(&sphere, &state, settings, renderer)?;
    let mut warnings = report::camera_warnings(&scene.agreement, views);
    warnings.extend(report::disagreements(&mut reports));
    let mean =
        |figure: fn(&ViewReport) -> f64| reports.iter().map(figure).sum::<f64>() / reports.len() as f64;
    let report = InversionReport {
        version: env!("CARGO_PKG_VERSION"),
        settings: settings.clone(),
        adapter: renderer.adapter().into(),
        shown: views.shown,
        mae: mean(|view| view.mae),
        overlap: mean(|view| view.overlap),
        hull: HullReport::of(&scene.agreement, &scene.space),
        light: state.light.map(|light| light.0),
        views: reports,
        warnings,
        seconds: [("hull", hull_seconds), ("fit", fit_seconds), ("measure", start.elapsed().as_secs_f64())]
            .into(),
    };
    let positions = state.positions.iter().map(|p| scene.space.to_world(*p)).collect();
    Ok(Inversion {
        mesh: TriangleMesh::new(positions, sphere.connectivity.topology.triangles.clone())?,
        sphere: sphere.rest.iter().map(|p| p.as_dvec3()).collect(),
        albedo: state.albedo,
        report,
        pictures,
    })
}

/// The pictures in unit space.
struct Scene<'a> {
    views: &'a Views,
    agreement: Agreement,
    space: UnitSpace,
    /// In unit space.
    start_radius: f64,
    sources: Vec<Source<'a>>,
}

impl<'a> Scene<'a> {
    fn of(views: &'a Views, settings: &InvertSettings) -> Result<Self, InvertError> {
        let silhouettes: Vec<Silhouette> = views.photographs.iter().map(Silhouette::of).collect();
        let agreement = Agreement::of(&silhouettes, settings.hull_cells)?;
        let hull = &agreement.hull;
        let inside = |photograph: &&Photograph| hull.holds(photograph.pose.centre());
        if let Some(photograph) = views.photographs.iter().find(inside) {
            return Err(InvertError::Inside { view: photograph.name.clone() });
        }
        let centre = hull.centre();
        let space = UnitSpace { centre, radius: hull.radius_about(centre) };
        let start_radius = hull.ball_radius() / space.radius * f64::from(settings.start_radius);
        let background = background(&views.photographs, views.shown);
        let source = |photograph| Source::new(photograph, views.shown, background, &space);
        let sources = views.photographs.iter().map(source).collect();
        Ok(Self { views, agreement, space, start_radius, sources })
    }

    /// The levels one after another.
    fn descend(
        &self,
        settings: &InvertSettings,
        renderer: &mut dyn Renderer,
        watch: &Watch,
    ) -> Result<(std::sync::Arc<Sphere>, State), InvertError> {
        let shaded = self.views.shown == Shown::Shaded;
        let light = given_light(settings).filter(|_| shaded);
        let mut state = State { positions: Vec::new(), albedo: None, light };
        let mut sphere = Sphere::of_level(settings.levels.first().map_or(0, |level| level.level));
        let mut done = 0;
        for level in &settings.levels {
            if state.positions.is_empty() {
                state.positions = self.start(&sphere, settings, watch.observer)?;
                let painted = settings.albedo == Albedo::Vertex && shaded;
                state.albedo = painted.then(|| vec![[1.0; 3]; state.positions.len()]);
            } else if level.level != sphere.level {
                smooth(&sphere, settings.level_diffusion, &mut state.positions);
                sphere = Sphere::of_level(level.level);
                state = subdivided(&sphere, state);
            }
            let matched = self.matched(level.size, settings);
            let mut descent = Descent::new(&sphere, settings, level, &matched, state, renderer)?;
            for iteration in 0..level.iterations {
                let energy = descent.step(iteration, renderer)?;
                watch.step(done + iteration + 1, energy)?;
            }
            done += level.iterations;
            state = descent.finish();
        }
        Ok((sphere, state))
    }

    /// The shape before the first level.
    fn start(
        &self,
        sphere: &Sphere,
        settings: &InvertSettings,
        observer: &dyn Observer,
    ) -> Result<Vec<Vec3A>, InvertError> {
        let surface = self.agreement.hull.surface().filter(|_| settings.hull_fit);
        let Some(surface) = surface else {
            return Ok(sphere.rest.iter().map(|p| *p * self.start_radius as f32).collect());
        };
        let fit = Settings::for_fit(Preset::Default, sphere.rest.len())?.fit;
        let (fitted, _) = fit_scan("hull", &surface, &fit, observer)?;
        let mut positions: Vec<Vec3A> = fitted.into_iter().map(|p| self.space.to_unit(p)).collect();
        // The hull's cells leave steps that only many iterations would wear off.
        smooth(sphere, settings.hull_diffusion, &mut positions);
        Ok(positions)
    }

    /// The views that agree, at a level's size.
    fn matched(&self, size: u32, settings: &InvertSettings) -> Matched {
        let used = || self.sources.iter().enumerate().filter(|(at, _)| !self.agreement.strays.contains(at));
        let estimated = self.views.shown == Shown::Shaded && settings.light.is_empty();
        Matched {
            targets: used().map(|(_, source)| source.target(size)).collect(),
            solid: estimated.then(|| used().map(|(_, source)| source.object(size, 0.99)).collect()),
        }
    }

    /// The figures and pictures of all views at the last level's size.
    fn measure(
        &self,
        sphere: &Sphere,
        state: &State,
        settings: &InvertSettings,
        renderer: &mut dyn Renderer,
    ) -> Result<(Vec<ViewReport>, Vec<ViewPictures>), InvertError> {
        let topology = &sphere.connectivity.topology;
        let size = settings.levels.last().map_or(1, |level| level.size);
        let normals = Normals::new(topology, &state.positions).vertices;
        let albedo = state.albedo.as_deref();
        let surface = Surface { positions: &state.positions, normals: &normals, albedo };
        let (mut reports, mut pictures) = (Vec::new(), Vec::new());
        for (at, source) in self.sources.iter().enumerate() {
            // One at a time: they need not fit together.
            let mut target = source.target(size);
            target.light = state.light.unwrap_or(target.light);
            renderer.prepare(MeshLayout::of(topology), std::slice::from_ref(&target))?;
            let rendering = renderer.picture(&surface, 0)?;
            let name = &self.views.photographs[at].name;
            let used = !self.agreement.strays.contains(&at);
            let object = source.object(size, 0.5);
            reports.push(ViewReport::of(name, used, &target, &object, &rendering));
            pictures.push(ViewPictures::of(name, self.views.shown, &target, &rendering));
        }
        Ok((reports, pictures))
    }
}

fn given_light(settings: &InvertSettings) -> Option<Light> {
    (settings.light.len() == 9).then(|| Light(std::array::from_fn(|j| settings.light[j])))
}

/// p = (I + lambda L)^-1 p.
fn smooth(sphere: &Sphere, lambda: f64, positions: &mut [Vec3A]) {
    if lambda > 0.0 {
        sphere.reparameterization(lambda).to_positions(positions, &mut SolveBuffer::default());
    }
}

fn subdivided(sphere: &Sphere, state: State) -> State {
    let albedo = state.albedo.map(|albedo| {
        let coarse: Vec<Vec3A> = albedo.iter().map(|a| Vec3A::from_array(*a)).collect();
        sphere.subdivide(&coarse).into_iter().map(|a| a.to_array()).collect()
    });
    State { positions: sphere.subdivide(&state.positions), albedo, light: state.light }
}
