use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::curvature::curvature;
use super::samples::Samples;
use super::statistics::{maximum, mean, quantile};
use super::surface::{Surface, UnitSpace};
use crate::mesh::{Rim, Topology, TriangleMesh};
use crate::spatial::Hit;

/// Samples drawn from each surface.
const SAMPLES: usize = 200_000;
/// Seeds of the samples on the scan and on the mesh.
pub(super) const SEEDS: [u64; 2] = [1, 2];
/// Smoothing step at which curvature is felt, in squared radii: a scale of about 3 % of the radius.
const CURVATURE_STEP: f64 = 0.0004;
/// Quality under which a triangle counts as a sliver: 1 is equilateral, 0 degenerate.
const SLIVER: f64 = 0.1;

/// How closely a mesh lies on its scan; every length is divided by the scan's radius, the largest distance of a scan
/// vertex from the mean of its vertices.
///
/// Mesh samples whose nearest scan point lies on the scan's rim or the edge of a hole do not count: no data there.
/// Should none be left, `chamfer` and `normal` are not a number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SurfaceFigures {
    /// Mean squared distance, mesh to scan plus scan to mesh.
    pub chamfer: f64,
    /// Mean squared difference of unit normals at those pairs, the mean of the two ways.
    pub normal: f64,
    /// The same two, scan to mesh alone, over the 20 % of scan samples with the largest curvature.
    pub top20: [f64; 2],
    /// The same over the 5 % with the largest curvature.
    pub top5: [f64; 2],
    /// The largest distance either way.
    pub hausdorff: f64,
    /// Share of mesh triangles that face away from the scan's surface at their centre.
    pub flipped: f64,
    /// Share of mesh triangles with a quality under 0.1 (1 equilateral, 0 degenerate).
    pub sliver: f64,
    /// Number of vertices of the mesh.
    pub vertices: usize,
    /// Number of triangles of the mesh.
    pub triangles: usize,
}

/// Measures `mesh` against `scan`; with `open`, distances and normals count from scan to mesh only, since the mesh may
/// rightly go on past the scan's rim.
pub fn surface_figures(scan: &TriangleMesh, mesh: &TriangleMesh, open: bool) -> SurfaceFigures {
    let space = UnitSpace::of(scan);
    let (rim, (scan, mesh)) = rayon::join(
        || Rim::of(&Topology::of(scan)),
        || (Surface::new(scan, &space), Surface::new(mesh, &space)),
    );
    let is_data = |hit: &Hit| !rim.contains(hit.triangle, hit.weights);

    let onto_mesh = Pairs::between(&scan, &mesh, SAMPLES, SEEDS[0], |_| true);
    let (mut chamfer, mut normal, mut largest) =
        (mean(&onto_mesh.distances), mean(&onto_mesh.turns), maximum(&onto_mesh.distances));
    if !open {
        let onto_scan = Pairs::between(&mesh, &scan, SAMPLES, SEEDS[1], is_data);
        chamfer += mean(&onto_scan.distances);
        normal = (normal + mean(&onto_scan.turns)) / 2.0;
        largest = largest.max(maximum(&onto_scan.distances));
    }
    let curvature = triangle_curvature(&scan);
    let felt: Vec<f64> = onto_mesh.triangles.iter().map(|&t| curvature[t as usize]).collect();
    SurfaceFigures {
        chamfer,
        normal,
        top20: onto_mesh.means_at_the_top(&felt, 0.8),
        top5: onto_mesh.means_at_the_top(&felt, 0.95),
        hausdorff: largest.sqrt(),
        flipped: flipped_share(&mesh, &scan, is_data),
        sliver: sliver_share(&mesh),
        vertices: mesh.positions.len(),
        triangles: mesh.triangles.len(),
    }
}

/// Samples of one surface, each with the nearest point of another.
pub(super) struct Pairs {
    /// The sampled triangles.
    pub triangles: Vec<u32>,
    /// Squared distances.
    pub distances: Vec<f64>,
    /// Squared differences of the unit normals.
    pub turns: Vec<f64>,
}

impl Pairs {
    /// Pairs of `count` samples whose nearest point `counts`.
    pub fn between(
        from: &Surface,
        to: &Surface,
        count: usize,
        seed: u64,
        counts: impl Fn(&Hit) -> bool,
    ) -> Self {
        let samples = Samples::new(from, count, seed);
        let hits = to.closest(&samples.points);
        let mut pairs = Self { triangles: Vec::new(), distances: Vec::new(), turns: Vec::new() };
        for (&triangle, hit) in samples.triangles.iter().zip(&hits).filter(|(_, hit)| counts(hit)) {
            pairs.triangles.push(triangle);
            pairs.distances.push(f64::from(hit.distance_squared));
            pairs.turns.push(from.normal(triangle).distance_squared(to.normal(hit.triangle)));
        }
        pairs
    }

    /// Mean squared distance and normal difference where `felt` is in its upper part, from this quantile on.
    fn means_at_the_top(&self, felt: &[f64], from: f64) -> [f64; 2] {
        let least = quantile(felt, from);
        let top = |values: &[f64]| -> Vec<f64> {
            values.iter().zip(felt).filter(|(_, felt)| **felt >= least).map(|(value, _)| *value).collect()
        };
        [mean(&top(&self.distances)), mean(&top(&self.turns))]
    }
}

/// The mean of the curvature at each triangle's corners.
fn triangle_curvature(surface: &Surface) -> Vec<f64> {
    let at_vertex = curvature(&surface.positions, surface.triangles, CURVATURE_STEP);
    surface.triangles.iter().map(|t| t.iter().map(|&v| at_vertex[v as usize]).sum::<f64>() / 3.0).collect()
}

/// The share of the mesh's triangles that face away from the scan, where the nearest point `counts`.
pub(super) fn flipped_share(mesh: &Surface, scan: &Surface, counts: impl Fn(&Hit) -> bool) -> f64 {
    let count = mesh.triangles.len();
    let centres: Vec<DVec3> =
        (0..count as u32).map(|t| mesh.corners(t).iter().sum::<DVec3>() / 3.0).collect();
    let hits = scan.closest(&centres);
    let flipped = |&(triangle, hit): &(usize, &Hit)| {
        mesh.normal(triangle as u32).dot(scan.normal(hit.triangle)) < 0.0 && counts(hit)
    };
    hits.iter().enumerate().filter(flipped).count() as f64 / count as f64
}

pub(super) fn sliver_share(mesh: &Surface) -> f64 {
    let count = mesh.triangles.len();
    let sliver = |&triangle: &usize| {
        let [a, b, c] = mesh.corners(triangle as u32);
        let edges = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
        2.0 * 3_f64.sqrt() * mesh.crosses[triangle].length() < SLIVER * edges.max(1e-30)
    };
    (0..count).filter(sliver).count() as f64 / count as f64
}
