use glam::Vec3A;
use rayon::prelude::*;

use crate::energy::LandmarkPull;
use crate::mesh::{Normals, components, interpolate};
use crate::pipeline::{Connectivity, ScanSurface};
use crate::spatial::SurfaceIndex;

/// What is tried in turn: rings of vertices around a folded triangle that move, and iterations of their smoothing; as
/// little as unfolds it, so that what corresponds stays where it is.
const ATTEMPTS: [(usize, usize); 6] = [(0, 4), (0, 8), (1, 4), (1, 8), (2, 9), (3, 12)];

/// Triangles farther than this from the scan, in unit space, lie on nothing that they could be folded on, and samples
/// farther than this from the shape are of what it has not entered: they would hide what is lost beside them.
const NEAR: f32 = 0.02;

/// Scan samples that watch over what the smoothing takes away.
const SAMPLES: usize = 20_000;

/// Growth of a fold's mean squared distance from its samples that is no loss, and what it may grow by in any case: the
/// square of half a thousandth of the radius.
const GROWTH: f32 = 1.2;
const SLACK: f32 = 2e-7;

/// How far landmarks may drift from their places on the scan, about a millimetre on a head, and the share of it to which
/// smoothing takes them back.
const DRIFT: f32 = 5e-3;
const HELD: f32 = 0.8;

/// Rounds of averaging the normals that tell one sheet of the scan from the one behind it.
const NORMAL_ROUNDS: usize = 2;

/// Unfolds triangles of a registered shape `[N, 3]` that lie on the scan and face away from it.
///
/// The vertices around each fold slide over the scan to the mean of their neighbours: a flat patch whose vertices all
/// lie there has no folds (Tutte 1963). Landmarks that drift take the corners between them back. A fold keeps its new
/// positions if fewer of its triangles are folded in them, the scan's samples there are no farther from it than they were,
/// and no landmark drifts; otherwise its old ones. `index` is of its triangles, wherever they were last.
pub fn unfold(
    connectivity: &Connectivity,
    scan: &ScanSurface,
    landmarks: &[LandmarkPull],
    index: &mut SurfaceIndex,
    p: &mut [Vec3A],
) {
    let folds = Folds { connectivity, scan, landmarks };
    let mut folded = folds.among(p, 0..connectivity.topology.triangles.len() as u32);
    if folded.is_empty() {
        return;
    }
    index.refit(p);
    let samples = folds.samples(index);
    for (rings, iterations) in ATTEMPTS {
        let patches = folds.patches(&folded, rings);
        let smoothed = folds.smooth(p, &patches, iterations);
        folds.keep_better(p, &smoothed, &patches, &samples, index);
        folded = folds.among(p, folded.into_iter().chain(patches.triangles));
        if folded.is_empty() {
            return;
        }
    }
}

struct Folds<'a> {
    connectivity: &'a Connectivity,
    scan: &'a ScanSurface,
    landmarks: &'a [LandmarkPull],
}

/// What may move around the folds.
struct Patches {
    /// The patch of each vertex `[N]`, or [`NONE`].
    of_vertex: Vec<u32>,
    /// The vertices of all.
    vertices: Vec<u32>,
    /// The triangles with a vertex in one, ascending.
    triangles: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Patches {
    /// The patch that a triangle touches; of several, the last.
    fn of(&self, corners: [u32; 3]) -> Option<usize> {
        let patches = corners.iter().map(|&i| self.of_vertex[i as usize]);
        patches.filter(|&patch| patch != NONE).max().map(|patch| patch as usize)
    }
}

/// How a patch does: its folded triangles, its samples and the sum of their squared distances, and how far the worst of
/// its landmarks is off.
#[derive(Debug, Clone, Copy, Default)]
struct Standing {
    folded: usize,
    samples: usize,
    distance: f32,
    drift: f32,
}

impl Standing {
    fn is_better_than(&self, other: &Self) -> bool {
        let allowed = other.distance * GROWTH + SLACK * other.samples as f32;
        self.folded < other.folded && self.distance <= allowed && self.drift <= other.drift.max(DRIFT)
    }
}

impl Folds<'_> {
    fn corners(&self, triangle: u32) -> [u32; 3] {
        self.connectivity.topology.triangles[triangle as usize]
    }

    /// The folded ones among some triangles, ascending.
    fn among(&self, p: &[Vec3A], triangles: impl Iterator<Item = u32>) -> Vec<u32> {
        let mut triangles: Vec<u32> = triangles.collect();
        triangles.sort_unstable();
        triangles.dedup();
        triangles.into_par_iter().with_min_len(256).filter(|&t| self.is_folded(p, t)).collect()
    }

    fn is_folded(&self, p: &[Vec3A], triangle: u32) -> bool {
        let [a, b, c] = self.corners(triangle).map(|i| p[i as usize]);
        let hit = self.scan.index.closest((a + b + c) / 3.0);
        hit.distance_squared < NEAR * NEAR
            && (b - a).cross(c - a).dot(self.scan.index.triangle_normal(hit.triangle)) < 0.0
            && self.scan.weight_at(&hit) > 0.0
    }

    /// The scan's samples near the shape, each with the triangle that it lies nearest to.
    fn samples(&self, index: &SurfaceIndex) -> Vec<(Vec3A, u32)> {
        let nearest = |k: usize| {
            let sample = self.scan.sample(k);
            let hit = (sample.weight > 0.0).then(|| index.closest(sample.point))?;
            (hit.distance_squared < NEAR * NEAR).then_some((sample.point, hit.triangle))
        };
        (0..SAMPLES).into_par_iter().with_min_len(256).filter_map(nearest).collect()
    }

    fn patches(&self, folded: &[u32], rings: usize) -> Patches {
        let topology = &self.connectivity.topology;
        let mut inside = vec![false; topology.on_rim.len()];
        let mut vertices: Vec<u32> = folded.iter().flat_map(|&t| self.corners(t)).collect();
        for ring in 0..=rings {
            if ring > 0 {
                vertices =
                    vertices.iter().flat_map(|&i| topology.neighbours.row(i as usize)).copied().collect();
            }
            // A rim would shrink.
            vertices.retain(|&i| !topology.on_rim[i as usize] && !inside[i as usize]);
            vertices.iter().for_each(|&i| inside[i as usize] = true);
        }
        let is_inside = |i: &u32| inside[*i as usize];
        let joined: Vec<[u32; 3]> =
            topology.triangles.iter().filter(|corners| corners.iter().all(is_inside)).copied().collect();
        let labels = components(inside.len(), &joined);
        let of_vertex =
            labels.into_iter().zip(&inside).map(|(label, &in_one)| if in_one { label } else { NONE });
        let touched = |&t: &u32| self.corners(t).iter().any(is_inside);
        Patches {
            of_vertex: of_vertex.collect(),
            vertices: (0..inside.len() as u32).filter(is_inside).collect(),
            triangles: (0..topology.triangles.len() as u32).filter(touched).collect(),
        }
    }

    /// The shape with the patches' vertices at their neighbours' means, on the scan.
    fn smooth(&self, p: &[Vec3A], patches: &Patches, iterations: usize) -> Vec<Vec3A> {
        let topology = &self.connectivity.topology;
        let mut p = p.to_vec();
        let mut normals = Normals::new(topology, &p);
        for _ in 0..iterations {
            normals.update(topology, &p);
            let moved = patches.vertices.par_iter().with_min_len(64).map(|&i| {
                let ring = topology.neighbours.row(i as usize);
                let mean = ring.iter().map(|&j| p[j as usize]).sum::<Vec3A>() / ring.len() as f32;
                let hit = self.scan.index.closest(mean);
                let facing = self.scan.index.triangle_normal(hit.triangle);
                if facing.dot(self.normal_around(&normals.vertices, i)) > 0.0 { hit.point } else { mean }
            });
            let moved: Vec<Vec3A> = moved.collect();
            patches.vertices.iter().zip(moved).for_each(|(&i, at)| p[i as usize] = at);
            self.hold_landmarks(&mut p, patches);
        }
        p
    }

    /// Takes landmarks that have drifted back, by the least step of those corners around them that move.
    fn hold_landmarks(&self, p: &mut [Vec3A], patches: &Patches) {
        for landmark in self.landmarks {
            let corners = self.corners(landmark.triangle);
            let off = landmark.target - interpolate(p, corners, landmark.weights);
            let beyond = off - off.clamp_length_max(HELD * DRIFT);
            let moving = || {
                let corners = corners.into_iter().zip(landmark.weights);
                corners.filter(|(i, _)| patches.of_vertex[*i as usize] != NONE)
            };
            // One that hangs on a corner it hardly touches does not throw that about.
            let share = moving().map(|(_, w)| w * w).sum::<f32>().max(1.0 / 3.0);
            moving().for_each(|(i, w)| p[i as usize] += beyond * (w / share));
        }
    }

    /// A vertex's normal averaged over its rings.
    fn normal_around(&self, normals: &[Vec3A], vertex: u32) -> Vec3A {
        fn averaged(folds: &Folds, normals: &[Vec3A], vertex: u32, rounds: usize) -> Vec3A {
            if rounds == 0 {
                return normals[vertex as usize];
            }
            let ring = folds.connectivity.topology.neighbours.row(vertex as usize);
            let around = ring.iter().map(|&j| averaged(folds, normals, j, rounds - 1)).sum::<Vec3A>();
            averaged(folds, normals, vertex, rounds - 1) + around / ring.len() as f32
        }
        averaged(self, normals, vertex, NORMAL_ROUNDS)
    }

    /// Gives each patch that is better off the new positions.
    fn keep_better(
        &self,
        p: &mut [Vec3A],
        smoothed: &[Vec3A],
        patches: &Patches,
        samples: &[(Vec3A, u32)],
        index: &mut SurfaceIndex,
    ) {
        let near: Vec<(Vec3A, u32)> =
            samples.iter().filter(|(_, t)| patches.of(self.corners(*t)).is_some()).copied().collect();
        let [before, after] = [&*p, smoothed].map(|p| self.standings(p, patches, &near, index));
        for &i in &patches.vertices {
            let patch = patches.of_vertex[i as usize] as usize;
            if after[patch].is_better_than(&before[patch]) {
                p[i as usize] = smoothed[i as usize];
            }
        }
    }

    /// How each patch does, by its number.
    fn standings(
        &self,
        p: &[Vec3A],
        patches: &Patches,
        near: &[(Vec3A, u32)],
        index: &mut SurfaceIndex,
    ) -> Vec<Standing> {
        let mut standings = vec![Standing::default(); p.len()];
        for t in self.among(p, patches.triangles.iter().copied()) {
            if let Some(patch) = patches.of(self.corners(t)) {
                standings[patch].folded += 1;
            }
        }
        index.refit(p);
        let distance = |&(point, triangle): &(Vec3A, u32)| {
            index.closest_below(point, f32::INFINITY, triangle).distance_squared
        };
        let distances: Vec<f32> = near.par_iter().with_min_len(64).map(distance).collect();
        for ((_, triangle), distance) in near.iter().zip(distances) {
            if let Some(patch) = patches.of(self.corners(*triangle)) {
                standings[patch].samples += 1;
                standings[patch].distance += distance;
            }
        }
        for landmark in self.landmarks {
            let corners = self.corners(landmark.triangle);
            if let Some(patch) = patches.of(corners) {
                let drift = landmark.target.distance(interpolate(p, corners, landmark.weights));
                standings[patch].drift = standings[patch].drift.max(drift);
            }
        }
        standings
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Icosphere, Topology, TriangleMesh};
    use crate::pipeline::Sphere;

    fn bumpy(p: Vec3A) -> Vec3A {
        p * (1.0 + 0.1 * (4.0 * p.x).sin() * (3.0 * p.y).cos())
    }

    fn scan() -> ScanSurface {
        let sphere = Icosphere::new(5);
        let positions = sphere.positions.iter().map(|p| bumpy(p.as_vec3a()).as_dvec3()).collect();
        ScanSurface::new(&TriangleMesh::new(positions, sphere.triangles).unwrap(), SAMPLES)
    }

    fn unfold_all(sphere: &Sphere, scan: &ScanSurface, landmarks: &[LandmarkPull], p: &mut [Vec3A]) {
        let mut index = SurfaceIndex::new(p, &sphere.connectivity.topology.triangles);
        unfold(&sphere.connectivity, scan, landmarks, &mut index, p);
    }

    fn on_scan(scan: &ScanSurface, sphere: &Sphere) -> Vec<Vec3A> {
        sphere.rest.iter().map(|p| scan.to_unit(bumpy(*p).as_dvec3())).collect()
    }

    #[test]
    fn a_fold_is_unfolded_and_the_rest_stays() {
        let (scan, sphere) = (scan(), Sphere::of_level(4));
        let topology = &sphere.connectivity.topology;
        let flat = on_scan(&scan, &sphere);
        let mut p = flat.clone();
        // Two neighbours that changed places fold the triangles around them.
        let [a, b] = topology.edges[700];
        p.swap(a as usize, b as usize);
        let folds = Folds { connectivity: &sphere.connectivity, scan: &scan, landmarks: &[] };
        let all = || 0..topology.triangles.len() as u32;
        assert!(folds.among(&p, all()).len() >= 2);
        unfold_all(&sphere, &scan, &[], &mut p);
        assert_eq!(folds.among(&p, all()), [0; 0]);
        let moved = (0..p.len()).filter(|&i| p[i] != flat[i]).count();
        assert!((1..60).contains(&moved), "{moved} moved");
        let off = p.iter().map(|p| scan.index.closest(*p).distance_squared.sqrt()).fold(0.0, f32::max);
        assert!(off < 0.01, "{off}");
    }

    /// Swaps neighbours, so that the triangles around them fold, and unfolds them with a landmark in `triangle_of`'s choice of
    /// them; returns the folded triangles before and after, and how far the landmark drifts, unfolded and where all is flat.
    fn unfolded_around(
        triangle_of: impl Fn(&Topology, [u32; 2]) -> (u32, [f32; 3]),
    ) -> ([usize; 2], [f32; 2]) {
        let (scan, sphere) = (scan(), Sphere::of_level(4));
        let topology = &sphere.connectivity.topology;
        let flat = on_scan(&scan, &sphere);
        let mut p = flat.clone();
        let [a, b] = topology.edges[700];
        p.swap(a as usize, b as usize);
        let (triangle, weights) = triangle_of(topology, [a, b]);
        let place = |p: &[Vec3A]| interpolate(p, topology.triangles[triangle as usize], weights);
        let target = place(&p);
        let folds = Folds { connectivity: &sphere.connectivity, scan: &scan, landmarks: &[] };
        let folded = |p: &[Vec3A]| folds.among(p, 0..topology.triangles.len() as u32).len();
        let before = folded(&p);
        unfold_all(&sphere, &scan, &[LandmarkPull { triangle, weights, target, weight: 1.0 }], &mut p);
        ([before, folded(&p)], [&p, &flat].map(|p| target.distance(place(p))))
    }

    #[test]
    fn a_landmark_on_what_is_folded_stays_in_its_place() {
        // On a vertex, as far from where it would be unfolded as an edge is long.
        let on_vertex = |topology: &Topology, [a, _]: [u32; 2]| {
            let triangle = topology.fans.row(a as usize)[0][0];
            (triangle, topology.triangles[triangle as usize].map(|i| if i == a { 1.0 } else { 0.0 }))
        };
        let ([before, after], [drift, flat]) = unfolded_around(on_vertex);
        assert!(flat > 10.0 * DRIFT, "{flat}");
        assert!(drift <= DRIFT && after < before, "{drift}, {after} of {before}");
    }

    #[test]
    fn what_is_folded_beside_a_landmark_is_unfolded_and_the_landmark_stays_in_its_place() {
        let beside = |topology: &Topology, [a, b]: [u32; 2]| {
            let without = |t: &&[u32; 3]| !topology.triangles[t[0] as usize].contains(&b);
            let triangle = topology.fans.row(a as usize).iter().find(without).unwrap()[0];
            (triangle, topology.triangles[triangle as usize].map(|i| if i == a { 0.2 } else { 0.4 }))
        };
        let ([before, after], [drift, flat]) = unfolded_around(beside);
        assert!(flat > 2.0 * DRIFT && before >= 2, "{flat} {before}");
        assert!(drift <= DRIFT && after == 0, "{drift} {after}");
    }

    #[test]
    fn what_has_no_fold_stays_to_the_bit() {
        let (scan, sphere) = (scan(), Sphere::of_level(4));
        let before = on_scan(&scan, &sphere);
        let mut p = before.clone();
        unfold_all(&sphere, &scan, &[], &mut p);
        assert_eq!(p, before);
    }

    #[test]
    fn what_smoothing_does_not_unfold_stays() {
        // All of the shape faces inwards.
        let (scan, sphere) = (scan(), Sphere::of_level(3));
        let mirrored = |p: &Vec3A| scan.to_unit(bumpy(Vec3A::new(-p.x, p.y, p.z)).as_dvec3());
        let before: Vec<Vec3A> = sphere.rest.iter().map(mirrored).collect();
        let mut p = before.clone();
        unfold_all(&sphere, &scan, &[], &mut p);
        assert_eq!(p, before);
    }
}
