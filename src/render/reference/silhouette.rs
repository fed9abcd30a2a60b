//! Where the edges between what is seen and what is not cross the lines between neighbouring pixels' centres.

use glam::Vec2;

use super::corner::{Corner, doubled_area};
use super::raster::Raster;
use crate::render::connectivity::RIM;

/// Edges of a mesh that crossings tell apart: the upper bits of a mark are for how far out it is.
pub(in crate::render) const MOST_EDGES: usize = (1 << 24) - 1;

/// For each pixel the mark of the edge that crosses to the one on its right and to the one below; 0 for none `[H * W, 2]`.
pub type Marks = Vec<[u32; 2]>;

/// A silhouette between two pixels' centres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// The edge.
    pub edge: u32,
    /// The left or upper pixel.
    pub first: usize,
    /// The right or lower one.
    pub second: usize,
    /// 0 if the second is on the right, 1 if it is below.
    pub axis: usize,
    /// From the first pixel's centre, in pixels.
    pub place: f32,
    /// Where on the edge, from its first end to its second.
    pub along: f32,
    /// Whether the first pixel is on the surface's side.
    pub first_is_inner: bool,
}

impl Crossing {
    /// What is compared where several edges cross the same line: that which is farthest out is the outline.
    pub fn mark(&self) -> u32 {
        let out = if self.first_is_inner { self.place } else { 1.0 - self.place };
        let step = (out * 254.0) as u32 + 1;
        (step.min(255) << 24) | (self.edge + 1)
    }

    /// The pixel that the silhouette crosses, the one on the other side, and how much of the other's colour it has.
    pub fn blend(&self) -> (usize, usize, f32) {
        if self.place < 0.5 {
            (self.first, self.second, 0.5 - self.place)
        } else {
            (self.second, self.first, self.place - 0.5)
        }
    }
}

/// An edge of which both triangles are on one side as a camera sees it.
#[derive(Debug, Clone, Copy)]
pub struct Silhouette {
    edge: u32,
    ends: [Corner; 2],
    /// 0 if it is steep, so that it crosses rows of pixels; 1 if it crosses columns.
    axis: usize,
    /// Whether its triangles are on the left of it or above.
    first_is_inner: bool,
}

impl Silhouette {
    /// The edge `[4]` as [`super::super::connectivity::Connectivity`] has it, if it is a silhouette.
    #[inline]
    pub fn new(edge: u32, [a, b, c, d]: [u32; 4], corners: &[Corner]) -> Option<Self> {
        let [a, b, c] = [a, b, c].map(|corner| corners[corner as usize]);
        let side = doubled_area([a.pixel, b.pixel, c.pixel]);
        if d != RIM {
            let d = corners[d as usize];
            let other = doubled_area([a.pixel, b.pixel, d.pixel]);
            if (side < 0.0) != (other < 0.0) || !d.is_before() {
                return None;
            }
        }
        if ![a, b, c].iter().all(Corner::is_before) {
            return None;
        }
        let run = b.pixel - a.pixel;
        let axis = usize::from(run.y.abs() < run.x.abs());
        // The side of what is on the right of a steep edge, or below a flat one.
        let second = if axis == 0 { -run.y } else { run.x };
        Some(Self { edge, ends: [a, b], axis, first_is_inner: (side < 0.0) != (second < 0.0) })
    }

    /// The ends' places (across, along) the rows or columns that are crossed, from the first pixel's centre.
    #[inline]
    pub fn places(&self) -> [Vec2; 2] {
        self.ends.map(|end| {
            let place = end.pixel - 0.5;
            if self.axis == 0 { place } else { Vec2::new(place.y, place.x) }
        })
    }

    /// What it crosses on a picture of a size, hidden or not.
    pub fn crossings(&self, size: [usize; 2]) -> impl Iterator<Item = Crossing> + use<> {
        let Self { edge, axis, first_is_inner, .. } = *self;
        let [a, b] = self.places();
        let [across, lines] = if axis == 0 { size } else { [size[1], size[0]] };
        let step = if axis == 0 { [1, size[0]] } else { [size[0], 1] };
        let first = a.y.min(b.y).max(0.0).ceil() as usize;
        // Without the upper end itself: there the next edge begins.
        let end = a.y.max(b.y).ceil().clamp(0.0, lines as f32) as usize;
        (first..end).filter_map(move |line| {
            let along = (line as f32 - a.y) / (b.y - a.y);
            let at = a.x + (b.x - a.x) * along;
            let before = at.floor();
            if !(before >= 0.0 && before + 1.0 < across as f32) {
                return None;
            }
            let first = before as usize * step[0] + line * step[1];
            let place = at - before;
            Some(Crossing { edge, first, second: first + step[0], axis, place, along, first_is_inner })
        })
    }

    /// Whether a crossing is seen: the surface on its one side, and nothing nearer than the edge on the other.
    #[inline]
    pub fn is_seen(&self, crossing: &Crossing, raster: &Raster) -> bool {
        let Crossing { first, second, along, .. } = *crossing;
        let [inner, outer] = if self.first_is_inner { [first, second] } else { [second, first] };
        let ids = [raster.ids[inner], raster.ids[outer]];
        let [a, b] = self.ends.map(|end| end.nearness);
        ids[0] != 0 && ids[0] != ids[1] && raster.nearness[outer] < a + (b - a) * along
    }

    /// The gradient with respect to the ends' pixels (u, v), from that with respect to the places of its crossings:
    /// the sums of it times one and times the share of the way along.
    #[inline]
    pub fn pull_back(&self, sum: f32, sum_along: f32) -> [Vec2; 2] {
        let [a, b] = self.places();
        let slope = (b.x - a.x) / (b.y - a.y);
        [sum - sum_along, sum_along].map(|across| {
            if self.axis == 0 {
                Vec2::new(across, -across * slope)
            } else {
                Vec2::new(-across * slope, across)
            }
        })
    }

    /// Its ends.
    pub fn ends(&self) -> &[Corner; 2] {
        &self.ends
    }
}

/// Marks every silhouette that is seen, and lists the crossings that prevailed, in the order of edges.
pub fn mark(
    raster: &Raster,
    corners: &[Corner],
    edges: &[[u32; 4]],
    marks: &mut Marks,
    crossings: &mut Vec<(Silhouette, Crossing)>,
) {
    marks.clear();
    marks.resize(raster.ids.len(), [0; 2]);
    crossings.clear();
    let size = [raster.width, raster.height];
    for (edge, &ends) in (0..).zip(edges) {
        let Some(silhouette) = Silhouette::new(edge, ends, corners) else { continue };
        for crossing in silhouette.crossings(size).filter(|crossing| silhouette.is_seen(crossing, raster)) {
            let mark = &mut marks[crossing.first][crossing.axis];
            *mark = crossing.mark().max(*mark);
            crossings.push((silhouette, crossing));
        }
    }
    crossings.retain(|(_, crossing)| marks[crossing.first][crossing.axis] == crossing.mark());
}
