use glam::Vec3A;

use super::backward::{Pulled, VertexGradient};
use super::corner::{Corner, project};
use super::lamp::Lamp;
use super::loss;
use super::raster::Raster;
use super::shade::{Looks, shade};
use super::silhouette::{Crossing, Marks, Silhouette, mark};
use crate::render::connectivity::Connectivity;
use crate::render::{Surface, Target};

/// What the passes over one view leave for each other; kept, so that the memory is asked for once.
#[derive(Debug, Clone, Default)]
pub struct Frame {
    pub corners: Vec<Corner>,
    pub raster: Raster,
    /// What the pixels' centres see `[H * W, 3]`.
    pub colours: Vec<Vec3A>,
    pub marks: Marks,
    pub crossings: Vec<(Silhouette, Crossing)>,
    /// The same colours blended along silhouettes; after the loss its gradient with respect to them.
    pub picture: Vec<Vec3A>,
    /// The gradient with respect to `colours`.
    pub unblended: Vec<Vec3A>,
    /// sum w |R - I|.
    pub value: f64,
}

/// What every pass over a view is given.
#[derive(Debug, Clone, Copy)]
pub struct Job<'a> {
    pub mesh: &'a Connectivity,
    pub surface: &'a Surface<'a>,
    pub target: &'a Target,
    /// 1 / (3 sum w).
    pub scale: f32,
}

/// One pass over a view, which may add to the gradient `[N]`.
type Pass = fn(&mut Frame, Job<'_>, &mut Vec<VertexGradient>);

impl Frame {
    /// The passes of a loss in their order.
    pub const PASSES: [(&'static str, Pass); 7] = [
        ("project", |frame, job, _| frame.project(job)),
        ("raster", |frame, job, _| frame.raster(job)),
        ("shade", |frame, job, _| frame.shade(job)),
        ("silhouette", |frame, job, _| frame.silhouette(job)),
        ("loss", |frame, job, _| frame.loss(job)),
        ("backward", Self::backward),
        ("silhouette_backward", |frame, job, gradient| frame.silhouette_backward(job, gradient)),
    ];

    /// Draws a surface as a target's camera sees it.
    pub fn draw(&mut self, job: Job<'_>) {
        self.project(job);
        self.raster(job);
        self.shade(job);
        self.silhouette(job);
    }

    fn project(&mut self, Job { target, surface, .. }: Job<'_>) {
        project(&target.view.projection(), surface.positions, &mut self.corners);
    }

    fn raster(&mut self, Job { mesh, target, .. }: Job<'_>) {
        self.raster.draw(target.view.size(), &self.corners, &mesh.triangles, mesh.closed);
    }

    fn shade(&mut self, Job { mesh, surface, target, .. }: Job<'_>) {
        let Self { corners, raster, colours, .. } = self;
        shade(raster, corners, &mesh.triangles, surface, &target.light, target.background, colours);
    }

    fn silhouette(&mut self, Job { mesh, .. }: Job<'_>) {
        mark(&self.raster, &self.corners, &mesh.edges, &mut self.marks, &mut self.crossings);
        loss::blend(&self.colours, &self.crossings, &mut self.picture);
    }

    fn loss(&mut self, Job { target, scale, .. }: Job<'_>) {
        self.value = loss::loss(&mut self.picture, &target.colours, target.weights.as_deref(), scale);
        loss::unblend(&self.picture, &self.crossings, &mut self.unblended);
    }

    fn pulled<'a>(&'a self, lamp: &'a Lamp, projection: &'a [[f32; 4]; 3]) -> Pulled<'a> {
        Pulled { projection, lamp, raster: &self.raster, gradient: &self.unblended }
    }

    fn backward(&mut self, job: Job<'_>, gradient: &mut Vec<VertexGradient>) {
        let Job { mesh, surface, target, .. } = job;
        gradient.clear();
        gradient.resize(mesh.vertices, VertexGradient::default());
        let (lamp, projection) = (Lamp::new(&target.light), target.view.projection());
        let pulled = self.pulled(&lamp, &projection);
        for (id, &ends) in (1..).zip(&mesh.triangles) {
            let corners = ends.map(|end| &self.corners[end as usize]);
            let looks = Looks::new(surface, ends);
            if let Some(parts) = pulled.triangle(id, corners, &looks, mesh.closed) {
                for (end, part) in ends.into_iter().zip(parts) {
                    gradient[end as usize] += part;
                }
            }
        }
    }

    fn silhouette_backward(&self, Job { mesh, target, .. }: Job<'_>, gradient: &mut [VertexGradient]) {
        let (lamp, projection) = (Lamp::new(&target.light), target.view.projection());
        let pulled = self.pulled(&lamp, &projection);
        for crossings in self.crossings.chunk_by(|(_, one), (_, next)| one.edge == next.edge) {
            let (mut sum, mut sum_along) = (0.0, 0.0);
            for (_, crossing) in crossings {
                let place = Pulled::place(crossing, &self.colours, &self.picture);
                sum += place;
                sum_along += place * crossing.along;
            }
            let (silhouette, Crossing { edge, .. }) = crossings[0];
            let [a, b, ..] = mesh.edges[edge as usize];
            for (end, part) in [a, b].into_iter().zip(pulled.edge(&silhouette, sum, sum_along)) {
                gradient[end as usize].position += part;
            }
        }
    }
}
