use serde::{Deserialize, Serialize};

use super::border::Border;
use super::statistics::{maximum, mean, quantile};
use super::surface::{Surface, UnitSpace};
use super::surface_figures::{Pairs, SEEDS, flipped_share, sliver_share};
use crate::mesh::TriangleMesh;

/// Samples drawn from each surface: enough for the 99th percentile, and quick.
const SAMPLES: usize = 50_000;

/// How closely a mesh lies on its scan, in the scan's units; quicker and coarser than
/// [`SurfaceFigures`](super::SurfaceFigures).
///
/// Mesh samples whose nearest scan point lies on the scan's rim or the edge of a hole do not count: no data there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fidelity {
    /// From points of the scan to the mesh.
    pub scan_to_mesh: Option<Distances>,
    /// From points of the mesh to the scan.
    pub mesh_to_scan: Option<Distances>,
    /// Mean squared difference of unit normals at those pairs, the mean of the two ways.
    pub normal: Option<f64>,
    /// Share of mesh triangles that face away from the scan's surface at their centre.
    pub flipped: f64,
    /// Share of mesh triangles with a quality under 0.1 (1 equilateral, 0 degenerate).
    pub sliver: f64,
    /// Distance of each mesh vertex from the scan `[N]`.
    #[serde(skip)]
    pub residuals: Vec<f64>,
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
        let space = UnitSpace::of(scan);
        let (scan, mesh) = (Surface::new(scan, &space), Surface::new(mesh, &space));
        let border = Border::of(scan.positions.len(), scan.triangles);
        let onto_mesh = Pairs::between(&scan, &mesh, SAMPLES, SEEDS[0], |_| true);
        let onto_scan = Pairs::between(&mesh, &scan, SAMPLES, SEEDS[1], |hit| !border.holds(hit));
        let normal = (mean(&onto_mesh.turns) + mean(&onto_scan.turns)) / 2.0;
        let residual = |squared: f32| f64::from(squared).sqrt() * space.radius;
        Self {
            scan_to_mesh: Distances::of_squares(&onto_mesh.distances, space.radius),
            mesh_to_scan: Distances::of_squares(&onto_scan.distances, space.radius),
            normal: normal.is_finite().then_some(normal),
            flipped: flipped_share(&mesh, &scan, &border),
            sliver: sliver_share(&mesh),
            residuals: scan
                .closest(&mesh.positions)
                .iter()
                .map(|hit| residual(hit.distance_squared))
                .collect(),
        }
    }
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
        assert_eq!(fidelity.residuals.len(), 10242);
        assert!(fidelity.residuals.iter().all(|d| (d - 0.5).abs() < 0.02));
    }
}
