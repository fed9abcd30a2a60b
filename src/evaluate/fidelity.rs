use std::borrow::Cow;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::scan_quality::ScanQuality;
use super::spacing::Spacing;
use super::statistics::{maximum, mean, quantile};
use super::surface::{Surface, UnitSpace};
use super::surface_figures::{Pairs, SEEDS, flipped_share, sliver_share};
use crate::mesh::{Rim, Topology, TriangleMesh};
use crate::spatial::{Hit, self_intersections};

/// Samples drawn from each surface: enough for the 99th percentile, and quick.
const SAMPLES: usize = 50_000;
/// Surfaces closer than this share of the scan's radius are one: about a millimetre and a half on a head.
pub const TOLERANCE: f64 = 0.01;
/// Or closer than so many deviations of the scan's noise.
pub const NOISE_TOLERANCE: f64 = 3.0;

/// The largest opening of a surface that is no patch, of its area.
const LARGEST_OPENING: f64 = 0.2;
/// Points of the scan farther than this from a patch, in the scan's radius, lie beyond it.
const PATCH_REACH: f32 = 0.05;

/// How closely a mesh lies on its scan, in the scan's units; quicker and coarser than
/// [`SurfaceFigures`](super::SurfaceFigures).
///
/// Samples whose nearest point lies on the other surface's rim or the edge of a hole of it do not count: there is no
/// data for the mesh, and the mesh is not for what lies beyond its own rim. Of a mesh that is a patch, as a face without
/// the back of the head, neither count points of the scan farther than 5 % of its radius: they may lie behind an ear.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fidelity {
    /// What the scan can be held to.
    pub scan: ScanQuality,
    /// From points of the scan to the mesh.
    pub scan_to_mesh: Option<Distances>,
    /// From points of the mesh to the scan.
    pub mesh_to_scan: Option<Distances>,
    /// How much of either surface the other has.
    pub overlap: Overlap,
    /// Mean squared difference of unit normals at those pairs, the mean of the two ways.
    pub normal: Option<f64>,
    /// Share of mesh triangles that face away from the scan's surface at their centre.
    pub flipped: f64,
    /// Share of mesh triangles with a quality under 0.1 (1 equilateral, 0 degenerate).
    pub sliver: f64,
    /// Share of mesh triangles that meet another one where they should not.
    pub self_intersecting: f64,
    /// Pairs of mesh triangles that do.
    pub self_intersections: usize,
    /// Where the mesh has its vertices.
    pub spacing: Spacing,
    /// Distance of each mesh vertex from the scan `[N]`.
    #[serde(skip)]
    pub residuals: Vec<f64>,
}

/// How much of either surface the other has.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Overlap {
    /// The distance up to which surfaces count as one: 1 % of the scan's radius, or three deviations of its noise if
    /// these are more.
    pub tolerance: f64,
    /// Share of the scan's area that is over the mesh, and not beyond its rim or over a hole of it.
    pub scan_over_mesh: f64,
    /// Share of that area within the tolerance of the mesh.
    pub scan: f64,
    /// Share of the mesh's area that is over the scan, and not beyond its rim or over a hole of it.
    pub mesh_over_scan: f64,
    /// Share of that area within the tolerance of the scan.
    pub mesh: f64,
}

/// How distances are spread.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Distances {
    /// Mean.
    pub mean: f64,
    /// Median.
    pub p50: f64,
    /// 90th percentile.
    pub p90: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Largest.
    pub max: f64,
}

impl Fidelity {
    /// Measures `mesh` against `scan`.
    pub fn of(scan: &TriangleMesh, mesh: &TriangleMesh) -> Self {
        Self::of_part(scan, |_| true, mesh)
    }

    /// Measures `mesh` against the triangles of `scan` that are data. What of the mesh lies nearest to the others is not over
    /// the scan. If none are, all are.
    pub fn of_part(scan: &TriangleMesh, is_data: impl Fn(&[u32; 3]) -> bool, mesh: &TriangleMesh) -> Self {
        let whole = scan;
        let scan = whole.only(whole.triangles().iter().copied().filter(&is_data).collect());
        let space = UnitSpace::of(&scan);
        let is_whole = matches!(scan, Cow::Borrowed(_));
        let ((quality, rim), scan) = rayon::join(
            || {
                let topology = Topology::of(&scan);
                let rim = if is_whole { Rim::of(&topology) } else { Rim::of(&Topology::of(whole)) };
                (ScanQuality::of(&scan, &topology), rim)
            },
            || Surface::new(&scan, &space),
        );
        let masked = (!is_whole).then(|| Surface::new(whole, &space));
        let whole = masked.as_ref().unwrap_or(&scan);
        let topology = Topology::of(mesh);
        let (spacing, end) = (Spacing::of(mesh, &topology), Rim::of(&topology));
        let meeting = self_intersections(mesh.positions(), mesh.triangles());
        let mesh = Surface::new(mesh, &space);
        let is_inside = |rim: &Rim, hit: &Hit| !rim.contains(hit.triangle, hit.weights);
        let counts = |hit: &Hit| {
            (is_whole || is_data(&whole.triangles[hit.triangle as usize])) && is_inside(&rim, hit)
        };
        let reach = if is_patch(&mesh) { PATCH_REACH * PATCH_REACH } else { f32::INFINITY };
        let is_over = |hit: &Hit| is_inside(&end, hit) && hit.distance_squared <= reach;
        let onto_mesh = Pairs::between(&scan, &mesh, SAMPLES, SEEDS[0], is_over);
        let onto_scan = Pairs::between(&mesh, whole, SAMPLES, SEEDS[1], counts);
        let normal = (mean(&onto_mesh.turns) + mean(&onto_scan.turns)) / 2.0;
        let residual = |squared: f32| f64::from(squared).sqrt() * space.radius;
        let tolerance = (TOLERANCE * quality.radius).max(NOISE_TOLERANCE * quality.noise);
        let within = |squares: &[f64]| {
            let near = squares.iter().filter(|square| square.sqrt() * space.radius <= tolerance).count();
            near as f64 / squares.len().max(1) as f64
        };
        Self {
            scan: quality,
            overlap: Overlap {
                tolerance,
                scan_over_mesh: onto_mesh.distances.len() as f64 / SAMPLES as f64,
                scan: within(&onto_mesh.distances),
                mesh_over_scan: onto_scan.distances.len() as f64 / SAMPLES as f64,
                mesh: within(&onto_scan.distances),
            },
            scan_to_mesh: Distances::of_squares(&onto_mesh.distances, space.radius),
            mesh_to_scan: Distances::of_squares(&onto_scan.distances, space.radius),
            normal: normal.is_finite().then_some(normal),
            flipped: flipped_share(&mesh, whole, counts),
            sliver: sliver_share(&mesh),
            self_intersecting: meeting.triangles.len() as f64 / mesh.triangles.len() as f64,
            self_intersections: meeting.pairs,
            spacing,
            residuals: scan
                .closest(&mesh.positions)
                .iter()
                .map(|hit| residual(hit.distance_squared))
                .collect(),
        }
    }
}

/// Whether a surface's opening is more than a fifth of it, as its area vectors say, which those of a closed one balance:
/// a head's neck is 0.12, what is open behind a face 0.45 and more.
fn is_patch(surface: &Surface) -> bool {
    let area: f64 = surface.crosses.iter().map(|cross| cross.length()).sum();
    surface.crosses.iter().sum::<DVec3>().length() > LARGEST_OPENING * area
}

impl Distances {
    /// Of squared distances in a unit of this length; `None` without any.
    fn of_squares(squares: &[f64], unit: f64) -> Option<Self> {
        if squares.is_empty() {
            return None;
        }
        let distances: Vec<f64> = squares.iter().map(|square| square.sqrt() * unit).collect();
        let [p50, p90, p99] = [0.5, 0.9, 0.99].map(|at| quantile(&distances, at));
        Some(Self { mean: mean(&distances), p50, p90, p99, max: maximum(&distances) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Icosphere;

    fn sphere(radius: f64) -> TriangleMesh {
        let Icosphere { positions, triangles } = Icosphere::new(5);
        TriangleMesh::new(positions.into_iter().map(|p| p * radius).collect(), triangles).unwrap()
    }

    #[test]
    fn a_larger_sphere_is_its_gap_away_in_the_scans_units() {
        let fidelity = Fidelity::of(&sphere(10.0), &sphere(10.5));
        let ways = [fidelity.scan_to_mesh.unwrap(), fidelity.mesh_to_scan.unwrap()];
        for distances in ways {
            let Distances { mean, p50, p90, p99, max } = distances;
            assert!([mean, p50, p90, p99, max].iter().all(|d| (d - 0.5).abs() < 0.02), "{distances:?}");
            assert!(p50 <= p90 && p90 <= p99 && p99 <= max);
        }
        assert_eq!((fidelity.flipped, fidelity.sliver), (0.0, 0.0));
        assert_eq!((fidelity.self_intersecting, fidelity.self_intersections), (0.0, 0));
        assert_eq!((fidelity.overlap.scan, fidelity.overlap.mesh), (0.0, 0.0));
        assert_eq!(fidelity.residuals.len(), 10242);
        assert!(fidelity.residuals.iter().all(|d| (d - 0.5).abs() < 0.02));
    }

    #[test]
    fn what_lies_nearest_to_what_is_no_data_is_not_over_the_scan() {
        // A shell within another, of which the outer one is data.
        let (outer, inner) = (sphere(10.0), sphere(5.0));
        let count = outer.positions().len() as u32;
        let positions = [outer.positions(), inner.positions()].concat();
        let further = inner.triangles().iter().map(|corners| corners.map(|corner| corner + count));
        let triangles: Vec<[u32; 3]> = outer.triangles().iter().copied().chain(further).collect();
        let scan = TriangleMesh::new(positions, triangles).unwrap();
        let outside = |corners: &[u32; 3]| corners[0] < count;
        let fidelity = Fidelity::of_part(&scan, outside, &scan);
        assert!((fidelity.overlap.mesh_over_scan - 0.8).abs() < 0.01, "{:?}", fidelity.overlap);
        assert!(fidelity.mesh_to_scan.unwrap().max < 1e-3 && fidelity.flipped == 0.0);
        let nothing = Fidelity::of_part(&scan, |_| false, &scan);
        assert_eq!(nothing.overlap.mesh_over_scan, 1.0);
    }

    #[test]
    fn half_a_sphere_is_covered_and_covers_half() {
        let whole = sphere(10.0);
        let upper = |t: &&[u32; 3]| t.iter().all(|&i| whole.positions()[i as usize].y > 0.0);
        let triangles = whole.triangles().iter().filter(upper).copied().collect();
        let half = TriangleMesh::new(whole.positions().to_vec(), triangles).unwrap();
        let Overlap { tolerance, scan_over_mesh, scan, mesh_over_scan, mesh } =
            Fidelity::of(&half, &whole).overlap;
        assert!((tolerance - 0.1).abs() < 0.01 && scan == 1.0 && mesh == 1.0, "{tolerance} {scan} {mesh}");
        assert!((mesh_over_scan - 0.5).abs() < 0.02 && scan_over_mesh == 1.0, "{mesh_over_scan}");
        let other_way = Fidelity::of(&whole, &half).overlap;
        assert!((other_way.scan_over_mesh - 0.5).abs() < 0.02, "{other_way:?}");
        assert!(other_way.scan == 1.0 && other_way.mesh == 1.0, "{other_way:?}");
    }
}
