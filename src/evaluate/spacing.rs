use serde::{Deserialize, Serialize};

use super::statistics::quantile;
use crate::mesh::{Topology, TriangleMesh};

/// Neighbouring triangles whose normals turn by more than this, as a cosine (60 degrees), are too few for the surface.
const BENT: f64 = 0.5;

/// Whether a mesh has its vertices where the surface needs them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spacing {
    /// The median edge length.
    pub edge: f64,
    /// The length that one edge in a thousand exceeds, over the median.
    pub longest: f64,
    /// Share of edges at which the surface turns by more than 60 degrees: curvature that the triangles are too large for.
    pub bent: f64,
}

impl Spacing {
    /// Measures a mesh of this topology.
    pub fn of(mesh: &TriangleMesh, topology: &Topology) -> Self {
        let p = mesh.positions();
        let lengths: Vec<f64> =
            topology.edges.iter().map(|e| p[e[0] as usize].distance(p[e[1] as usize])).collect();
        let normal = |t: u32| {
            let [a, b, c] = topology.triangles[t as usize].map(|i| p[i as usize]);
            (b - a).cross(c - a).normalize_or_zero()
        };
        let bent = |sides: &&[u32; 2]| normal(sides[0]).dot(normal(sides[1])) < BENT;
        let bent = topology.edge_triangles.iter().filter(bent).count();
        let edge = quantile(&lengths, 0.5);
        Self {
            edge,
            longest: quantile(&lengths, 0.999) / edge.max(f64::MIN_POSITIVE),
            bent: bent as f64 / lengths.len() as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::mesh::Icosphere;

    fn measured(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Spacing {
        let mesh = TriangleMesh::new(positions, triangles).unwrap();
        Spacing::of(&mesh, &Topology::of(&mesh))
    }

    #[test]
    fn a_sphere_is_even_and_a_box_of_few_triangles_is_bent() {
        let Icosphere { positions, triangles } = Icosphere::new(4);
        let even = measured(positions.clone(), triangles.clone());
        assert!(even.longest < 1.3 && even.bent == 0.0, "{even:?}");
        let long = |p: &DVec3| if p.z > 0.99 { *p * 9.0 } else { *p };
        let spiked = positions.iter().map(long).collect();
        let spiked = measured(spiked, triangles);
        assert!(spiked.longest > 10.0 && spiked.bent > 0.001, "{spiked:?}");
        let corners = (0..8).map(|k| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)));
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let halves = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let cube = measured(corners.collect(), halves);
        assert!((cube.bent - 12.0 / 18.0).abs() < 1e-9, "{cube:?}");
    }
}
