use glam::Vec3A;
use rayon::prelude::*;

use super::scan_surface::ScanSurface;
use crate::energy::{SampleMatch, VertexMatch};
use crate::mesh::{Normals, Topology};
use crate::spatial::{Hit, SurfaceIndex, SurfaceWalk};

/// Rounds after which the same samples come again, where there are as many.
const CYCLE: usize = 4;
/// Search trees of a deforming template are rebuilt after this many refits.
const REFITS: usize = 40;
/// The last answer of a query that has none.
const NOWHERE: u32 = u32::MAX;
/// Fewest queries that are worth a thread.
const MIN_QUERIES: usize = 128;

/// How each round of a matcher searches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Weight of normals against positions, a length in unit space.
    pub normal_search: f32,
    /// Cosine between the normals below which there is no match.
    pub least_cosine: f32,
    /// One query in this many seeks its point anew each time; the others walk from their last answer.
    pub fresh: usize,
}

/// A surface on which the same queries are repeated while it or they move.
struct Followed<'a> {
    index: &'a SurfaceIndex,
    walk: &'a SurfaceWalk,
    positions: &'a [Vec3A],
    search: Search,
}

impl Followed<'_> {
    /// The closest point to a point and normal; `last` is the triangle of the last answer, and becomes this one's.
    fn closest(&self, p: Vec3A, n: Vec3A, last: &mut u32, fresh: bool) -> Option<Hit> {
        let Search { normal_search, least_cosine, .. } = self.search;
        let weight = normal_search * normal_search;
        let known = (*last != NOWHERE).then_some(*last);
        let walked = known
            .filter(|_| !fresh)
            .and_then(|from| self.walk.closest_oriented(self.positions, p, n, weight, least_cosine, from));
        let hit =
            walked.or_else(|| self.index.closest_oriented(p, n, weight, least_cosine, f32::INFINITY, known));
        *last = hit.map_or(NOWHERE, |hit| hit.triangle);
        hit
    }
}

/// The closest scan point of every template vertex, in position and normal together.
pub struct VertexMatcher {
    /// A match for each vertex `[N]`, of the last round.
    pub matches: Vec<VertexMatch>,
    last: Vec<u32>,
}

impl VertexMatcher {
    /// No match yet for any of `vertices` vertices.
    pub fn new(vertices: usize) -> Self {
        Self { matches: vec![VertexMatch::default(); vertices], last: vec![NOWHERE; vertices] }
    }

    /// Matches vertices at `positions` `[N, 3]` with the scan; rounds are counted from 0.
    pub fn update(
        &mut self,
        scan: &ScanSurface,
        positions: &[Vec3A],
        normals: &Normals,
        search: Search,
        round: usize,
    ) {
        let ScanSurface { index, walk, .. } = scan;
        let surface = Followed { index, walk, positions: &scan.positions, search };
        let matched = |(i, last): (usize, &mut u32)| {
            let fresh = (i + round).is_multiple_of(search.fresh.max(1));
            let hit = surface.closest(positions[i], normals.vertices[i], last, fresh);
            hit.map_or(VertexMatch::default(), |hit| VertexMatch {
                point: hit.point,
                normal: scan.normal_at(&hit),
                weight: scan.weight_at(&hit),
            })
        };
        let queries = self.last.par_iter_mut().enumerate().with_min_len(MIN_QUERIES);
        queries.map(matched).collect_into_vec(&mut self.matches);
    }
}

/// The closest template point of scan samples, other ones each round.
pub struct SampleMatcher {
    /// A match for each sample of the last round `[S]`.
    pub matches: Vec<SampleMatch>,
    /// For each batch of S samples, the last answers.
    last: Vec<Vec<u32>>,
    index: SurfaceIndex,
    walk: SurfaceWalk,
}

impl SampleMatcher {
    /// Makes ready for rounds of `count` samples of a scan, against a template at `positions` `[N, 3]`.
    pub fn new(scan: &ScanSurface, count: usize, topology: &Topology, positions: &[Vec3A]) -> Self {
        let batches = (scan.samples.len() / count).clamp(1, CYCLE);
        Self {
            matches: vec![SampleMatch::default(); count],
            last: vec![vec![NOWHERE; count]; batches],
            index: SurfaceIndex::new(positions, &topology.triangles),
            walk: SurfaceWalk::new(topology),
        }
    }

    /// Matches the next samples with the template at `positions` `[N, 3]`; rounds are counted from 0.
    pub fn update(&mut self, scan: &ScanSurface, positions: &[Vec3A], search: Search, round: usize) {
        if (round + 1).is_multiple_of(REFITS) {
            self.index = SurfaceIndex::new(positions, self.index.triangles());
        } else {
            self.index.refit(positions);
        }
        let surface = Followed { index: &self.index, walk: &self.walk, positions, search };
        let (visit, batch) = (round / self.last.len(), round % self.last.len());
        let last = &mut self.last[batch];
        let first = batch * last.len();
        let matched = |(i, last): (usize, &mut u32)| {
            let sample = scan.sample(first + i);
            let fresh = (i + visit).is_multiple_of(search.fresh.max(1));
            let hit = surface.closest(sample.point, sample.normal, last, fresh);
            hit.map_or(SampleMatch::default(), |hit| SampleMatch {
                triangle: hit.triangle,
                weight: sample.weight,
                weights: hit.weights,
                point: sample.point,
                normal: sample.normal,
            })
        };
        let queries = last.par_iter_mut().enumerate().with_min_len(MIN_QUERIES);
        queries.map(matched).collect_into_vec(&mut self.matches);
    }
}
