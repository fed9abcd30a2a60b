use glam::Vec3A;

use super::backward::{Pulled, VertexGradient};
use super::corner::{Corner, project};
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
    /// The same blended along silhouettes; after the loss its gradient.
    pub picture: Vec<Vec3A>,
    /// The gradient with respect to `colours`.
    pub unblended: Vec<Vec3A>,
}

impl Frame {
    /// Draws a surface as a target's camera sees it.
    pub fn draw(&mut self, mesh: &Connectivity, surface: &Surface<'_>, target: &Target) {
        let Self { corners, raster, colours, marks, crossings, picture, .. } = self;
        project(&target.view.projection(), surface.positions, corners);
        raster.draw(target.view.size(), corners, &mesh.triangles, mesh.closed);
        shade(raster, corners, &mesh.triangles, surface, &target.light, target.background, colours);
        mark(raster, corners, &mesh.edges, marks, crossings);
        loss::blend(colours, crossings, picture);
    }

    /// Draws, compares, and sets `gradient` `[N]`, scaled. Returns sum w |R - I|.
    pub fn loss(
        &mut self,
        mesh: &Connectivity,
        surface: &Surface<'_>,
        target: &Target,
        scale: f32,
        gradient: &mut Vec<VertexGradient>,
    ) -> f64 {
        self.draw(mesh, surface, target);
        let value = loss::loss(&mut self.picture, &target.colours, target.weights.as_deref(), scale);
        loss::unblend(&self.picture, &self.crossings, &mut self.unblended);
        gradient.clear();
        gradient.resize(mesh.vertices, VertexGradient::default());
        let projection = target.view.projection();
        let pulled = Pulled {
            projection: &projection,
            light: &target.light,
            raster: &self.raster,
            gradient: &self.unblended,
        };
        self.pull_triangles(mesh, surface, &pulled, gradient);
        self.pull_edges(mesh, &pulled, gradient);
        value
    }

    fn pull_triangles(
        &self,
        mesh: &Connectivity,
        surface: &Surface<'_>,
        pulled: &Pulled<'_>,
        gradient: &mut [VertexGradient],
    ) {
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

    fn pull_edges(&self, mesh: &Connectivity, pulled: &Pulled<'_>, gradient: &mut [VertexGradient]) {
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
