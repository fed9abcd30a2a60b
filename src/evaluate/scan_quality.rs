use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::statistics::quantile;
use crate::mesh::{Topology, TriangleMesh};

/// A vertex with independent noise of deviation one lies this far from the mean of its six neighbours, in the median.
const NOISE_TO_OFFSET: f64 = 0.73;
/// Vertices that are looked at: enough for a median.
const MOST: usize = 50_000;
/// A vertex farther off than this share of the radius, and this many times the noise, is a spike.
const SPIKE: [f64; 2] = [0.01, 10.0];

/// What a scan can be held to, in its own units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScanQuality {
    /// The largest distance of a vertex from the mean of the vertices.
    pub radius: f64,
    /// The median edge length.
    pub edge: f64,
    /// How far a vertex lies off the surface that its neighbours suggest: the standard deviation of its noise along the
    /// normal, or the height of the surface over its edges where these are too long for its curvature.
    pub noise: f64,
    /// Share of vertices that lie far off that surface: by more than 1 % of the radius and ten times the noise.
    pub spikes: f64,
    /// Share of edges with one triangle only: a whole surface has few, at its rim.
    pub rim: f64,
}

impl ScanQuality {
    /// Measures a scan of this topology.
    pub fn of(scan: &TriangleMesh, topology: &Topology) -> Self {
        let p = scan.positions();
        let lengths: Vec<f64> =
            topology.edges.iter().map(|e| p[e[0] as usize].distance(p[e[1] as usize])).collect();
        let step = p.len().div_ceil(MOST);
        let looked_at = (0..p.len()).into_par_iter().step_by(step);
        let offsets: Vec<f64> = looked_at.filter_map(|i| offset(topology, p, i)).collect();
        let median = |values: &[f64]| if values.is_empty() { 0.0 } else { quantile(values, 0.5) };
        let radius = scan.radius_about(scan.centroid());
        let noise = median(&offsets) / NOISE_TO_OFFSET;
        let far = (SPIKE[0] * radius).max(SPIKE[1] * noise);
        let spikes = offsets.iter().filter(|&&offset| offset > far).count();
        let single = topology.rim_edges().count();
        Self {
            radius,
            edge: median(&lengths),
            noise,
            spikes: spikes as f64 / offsets.len().max(1) as f64,
            rim: single as f64 / lengths.len().max(1) as f64,
        }
    }
}

/// How far a vertex lies from the mean of its neighbours, along the normal; `None` on a rim.
fn offset(topology: &Topology, p: &[DVec3], i: usize) -> Option<f64> {
    let ring = topology.neighbours.row(i);
    if topology.on_rim[i] || ring.len() < 3 {
        return None;
    }
    let mean = ring.iter().map(|&j| p[j as usize]).sum::<DVec3>() / ring.len() as f64;
    let areas = topology
        .fans
        .row(i)
        .iter()
        .map(|&[_, next, previous]| (p[next as usize] - p[i]).cross(p[previous as usize] - p[i]));
    let normal = areas.sum::<DVec3>().try_normalize()?;
    Some(normal.dot(mean - p[i]).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Icosphere;
    use crate::numeric::Random;

    fn measured(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> ScanQuality {
        let mesh = TriangleMesh::new(positions, triangles).unwrap();
        ScanQuality::of(&mesh, &Topology::of(&mesh))
    }

    #[test]
    fn noise_along_the_normal_is_found_again() {
        let Icosphere { positions, triangles } = Icosphere::new(5);
        let mut random = Random::new(4);
        // The sum of twelve uniform numbers is nearly normal, of deviation one in each of these units.
        let mut normal = || (0..12).map(|_| random.unit()).sum::<f64>() - 6.0;
        for noise in [0.05, 0.2] {
            let noisy = positions.iter().map(|&p| p * (10.0 + noise * normal())).collect();
            let found = measured(noisy, triangles.clone());
            assert!((found.noise / noise - 1.0).abs() < 0.1, "{noise} {found:?}");
        }
        let smooth = positions.iter().map(|&p| p * 10.0).collect();
        let found = measured(smooth, triangles.clone());
        assert!((found.radius - 10.0).abs() < 1e-9 && (found.edge - 0.36).abs() < 0.03, "{found:?}");
        assert!(found.noise < 0.01 && (found.spikes, found.rim) == (0.0, 0.0), "{found:?}");
        let spiked =
            positions.iter().enumerate().map(|(i, &p)| if i % 100 == 0 { p * 13.0 } else { p * 10.0 });
        let found = measured(spiked.collect(), triangles);
        // A spike's six neighbours are off the surface that it pulls at.
        assert!(found.noise < 0.02 && (found.spikes - 0.07).abs() < 0.01, "{found:?}");
    }
}
