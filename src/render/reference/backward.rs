//! What the pixels of a triangle, and the crossings of an edge, ask of their corners.

use glam::{Vec2, Vec3A};

use super::corner::{Corner, doubled_area};
use super::lamp::Lamp;
use super::patch::{Patch, Weights};
use super::raster::Raster;
use super::shade::Looks;
use super::silhouette::{Crossing, Silhouette};

/// The gradient with respect to one vertex.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct VertexGradient {
    pub position: Vec3A,
    pub normal: Vec3A,
    pub albedo: Vec3A,
}

impl std::ops::AddAssign for VertexGradient {
    fn add_assign(&mut self, other: Self) {
        self.position += other.position;
        self.normal += other.normal;
        self.albedo += other.albedo;
    }
}

/// A picture seen through a camera: the rows of H, what each pixel sees, and the gradient with respect to its colours.
#[derive(Debug, Clone, Copy)]
pub struct Pulled<'a> {
    pub projection: &'a [[f32; 4]; 3],
    pub lamp: &'a Lamp,
    pub raster: &'a Raster,
    /// `[H * W]`.
    pub gradient: &'a [Vec3A],
}

impl Pulled<'_> {
    /// The gradient with respect to the corners of the triangle of an id, by the pixels that see it; `None` if there
    /// cannot be any.
    pub fn triangle(
        &self,
        id: u32,
        corners: [&Corner; 3],
        looks: &Looks,
        closed: bool,
    ) -> Option<[VertexGradient; 3]> {
        let pixels = corners.map(|corner| corner.pixel);
        if !corners.iter().all(|corner| corner.is_before()) || (closed && doubled_area(pixels) > 0.0) {
            return None;
        }
        let [columns, rows] = bounds(pixels, [self.raster.width, self.raster.height])?;
        let patch = Patch::new([columns[0] as i32, rows[0] as i32], corners);
        let mut sums = Sums::default();
        for y in rows[0]..=rows[1] {
            let at = y * self.raster.width;
            for x in columns[0]..=columns[1] {
                if self.raster.ids[at + x] == id {
                    sums.add(&patch, x as i32, y as i32, looks, self.lamp, self.gradient[at + x]);
                }
            }
        }
        Some(sums.finish(&patch, self.projection))
    }

    /// Its ends' share of what a crossing of a silhouette asks: the gradient with respect to its place. `gradient` is
    /// with respect to blended colours, of which a silhouette moves the share.
    pub fn place(crossing: &Crossing, colours: &[Vec3A], gradient: &[Vec3A]) -> f32 {
        let (pixel, ..) = crossing.blend();
        gradient[pixel].dot(colours[crossing.first] - colours[crossing.second])
    }

    /// The gradient with respect to the positions of an edge's ends, from the sums of [`Silhouette::pull_back`].
    pub fn edge(&self, silhouette: &Silhouette, sum: f32, sum_along: f32) -> [Vec3A; 2] {
        let pixels = silhouette.pull_back(sum, sum_along);
        let mut pulled = [Vec3A::ZERO; 2];
        for ((position, pixel), corner) in pulled.iter_mut().zip(pixels).zip(silhouette.ends()) {
            let pixel = pixel * corner.nearness;
            let h = Vec3A::new(pixel.x, pixel.y, -pixel.dot(corner.pixel));
            *position = pull_back_projection(self.projection, h);
        }
        pulled
    }
}

/// The columns and the rows, first and last, of the pixels that a triangle may cover; `None` if there are none.
pub fn bounds(pixels: [Vec2; 3], size: [usize; 2]) -> Option<[[usize; 2]; 2]> {
    let low = pixels[0].min(pixels[1]).min(pixels[2]);
    let high = pixels[0].max(pixels[1]).max(pixels[2]);
    let along = |axis: usize| {
        // Corners are rounded before they are drawn, by less than this.
        let rounded = 1.0 / 128.0;
        let first = (low[axis] - 0.5 - rounded).ceil().max(0.0);
        let last = (high[axis] - 0.5 + rounded).floor().min(size[axis] as f32 - 1.0);
        (first <= last).then_some([first as usize, last as usize])
    };
    Some([along(0)?, along(1)?])
}

/// What a triangle's pixels sum up.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    normals: [Vec3A; 3],
    albedo: [Vec3A; 3],
    /// sum dE/da_k X: see [`Patch`].
    moments: [Vec3A; 3],
}

impl Sums {
    #[inline]
    fn add(&mut self, patch: &Patch, x: i32, y: i32, looks: &Looks, lamp: &Lamp, upstream: Vec3A) {
        let weights = patch.at(x, y);
        let (normal, inverse_length) = looks.normal(&weights);
        let mut by_weight = [0.0; 3];
        let mut lit = upstream;
        if let Some(albedo) = looks.albedo {
            let of_albedo = upstream * lamp.colour(normal);
            add_weighted(&mut self.albedo, of_albedo, &weights);
            by_weight = albedo.map(|corner| of_albedo.dot(corner));
            lit *= weights.mean(albedo);
        }
        let of_unit = lamp.pull_back(normal, lit);
        let of_normal = (of_unit - normal * normal.dot(of_unit)) * inverse_length;
        add_weighted(&mut self.normals, of_normal, &weights);
        if patch.is_wide {
            let by_weight = Vec3A::from_array(by_weight)
                + Vec3A::from_array(looks.normals.map(|corner| of_normal.dot(corner)));
            let mean = by_weight.dot(Vec3A::from_array(weights.corners));
            let of_a = (by_weight - mean) * weights.inverse_sum;
            for (moment, of_a) in self.moments.iter_mut().zip(of_a.to_array()) {
                *moment += weights.from * of_a;
            }
        }
    }

    fn finish(&self, patch: &Patch, projection: &[[f32; 4]; 3]) -> [VertexGradient; 3] {
        let [x, y] = patch.origin.map(|place| place as f32 + 0.5);
        [0, 1, 2].map(|k| {
            let [next, previous] = [(k + 1) % 3, (k + 2) % 3];
            // a_next = h_k . (X x h_previous), a_previous = h_k . (h_next x X).
            let h = self.moments[next].cross(patch.corners[previous])
                + patch.corners[next].cross(self.moments[previous]);
            let h = Vec3A::new(h.x, h.y, h.z - x * h.x - y * h.y);
            let position = pull_back_projection(projection, h);
            VertexGradient { position, normal: self.normals[k], albedo: self.albedo[k] }
        })
    }
}

/// Adds a gradient with respect to a weighted mean to those with respect to what the corners have.
#[inline]
fn add_weighted(sums: &mut [Vec3A; 3], upstream: Vec3A, weights: &Weights) {
    for (sum, weight) in sums.iter_mut().zip(weights.corners) {
        *sum += upstream * weight;
    }
}

/// The gradient with respect to a position from that with respect to (u w, v w, w).
fn pull_back_projection(projection: &[[f32; 4]; 3], h: Vec3A) -> Vec3A {
    let [u, v, w] = projection.map(|[x, y, z, _]| Vec3A::new(x, y, z));
    u * h.x + v * h.y + w * h.z
}
