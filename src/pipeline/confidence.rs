use glam::Vec3A;
use rayon::prelude::*;

use super::scan_surface::ScanSurface;
use crate::mesh::{Normals, Topology};

/// Weight of normals against positions in the search for what a vertex was matched with, a length in unit space.
const NORMAL_SEARCH: f32 = 0.02;

/// The distance that counts as close on a scan without noise, in unit space.
const CLOSE: f32 = 0.01;

/// On a noisy scan this many times the median distance counts as close.
const MEDIANS: f32 = 3.0;

/// How far each vertex of a result `[N, 3]` is known from the scan's data `[N]`, from 0 to 1; both in unit space.
///
/// c = w max(0, n . n^) / (1 + (d / s)^2)^2, with d the distance of the closest scan point, n . n^ the cosine between
/// the normals, w the scan's weight there, zero on a rim, and s what counts as close (Geman and McClure's weight, with
/// its scale from the median distance). Half of c is the vertex's own, half its neighbours' mean.
pub fn confidence(scan: &ScanSurface, topology: &Topology, positions: &[Vec3A]) -> Vec<f32> {
    let normals = Normals::new(topology, positions).vertices;
    let found: Vec<Option<Found>> = (0..positions.len())
        .into_par_iter()
        .with_min_len(128)
        .map(|i| find(scan, positions[i], normals[i]))
        .collect();
    let mut distances: Vec<f32> = found.iter().flatten().map(|found| found.distance).collect();
    distances.sort_by(f32::total_cmp);
    let median = distances.get(distances.len() / 2).copied().unwrap_or(0.0);
    let scale = (MEDIANS * median).max(CLOSE);
    let own: Vec<f32> =
        found.iter().map(|found| found.map_or(0.0, |found| found.confidence(scale))).collect();
    let around = |i: usize| {
        let ring = topology.neighbours.row(i);
        let sum: f32 = ring.iter().map(|&j| own[j as usize]).sum();
        0.5 * (own[i] + sum / ring.len().max(1) as f32)
    };
    (0..own.len()).map(around).collect()
}

/// The scan's data at a vertex.
#[derive(Clone, Copy)]
struct Found {
    distance: f32,
    cosine: f32,
    weight: f32,
}

fn find(scan: &ScanSurface, p: Vec3A, n: Vec3A) -> Option<Found> {
    let hit = scan.index.closest_oriented(p, n, NORMAL_SEARCH * NORMAL_SEARCH, 0.0, f32::INFINITY, None)?;
    let weight = scan.weight_at(&hit);
    let found = Found { distance: hit.distance_squared.sqrt(), cosine: n.dot(scan.normal_at(&hit)), weight };
    (weight > 0.0).then_some(found)
}

impl Found {
    fn confidence(self, scale: f32) -> f32 {
        let x = self.distance / scale;
        (self.weight * self.cosine.max(0.0) / ((1.0 + x * x) * (1.0 + x * x))).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Icosphere, TriangleMesh};

    /// The upper half of a sphere, its centre and radius its own.
    fn half() -> ScanSurface {
        let Icosphere { positions, triangles } = Icosphere::new(5);
        let upper = |corners: &&[u32; 3]| corners.iter().all(|&i| positions[i as usize].z > 0.0);
        let triangles = triangles.iter().filter(upper).copied().collect();
        ScanSurface::new(&TriangleMesh::new(positions.clone(), triangles).unwrap(), 10)
    }

    #[test]
    fn only_what_lies_on_data_and_faces_its_way_is_known() {
        let scan = half();
        let sphere = Icosphere::new(4);
        let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
        let on: Vec<Vec3A> = sphere.positions.iter().map(|p| scan.to_unit(*p)).collect();
        let known = confidence(&scan, &topology, &on);
        for (p, &known) in sphere.positions.iter().zip(&known) {
            match p.z {
                z if z > 0.15 => assert!(known > 0.95, "{p} {known}"),
                z if z < -0.15 => assert!(known == 0.0, "{p} {known}"),
                _ => assert!((0.0..=1.0).contains(&known)),
            }
        }
        let off: Vec<Vec3A> = on.iter().map(|p| *p * if p.x > 0.5 { 1.1 } else { 1.0 }).collect();
        let known = confidence(&scan, &topology, &off);
        for (p, known) in sphere.positions.iter().zip(known) {
            if p.z > 0.15 && (p.x - 0.5).abs() > 0.15 {
                assert!(if p.x > 0.5 { known < 0.05 } else { known > 0.9 }, "{p} {known}");
            }
        }
    }
}
