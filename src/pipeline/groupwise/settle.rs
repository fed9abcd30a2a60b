use glam::{Mat3A, Vec3, Vec3A};
use rayon::prelude::*;

use super::RestShape;
use crate::mesh::{Normals, Topology};
use crate::numeric::{BlockMatrix, SolveBuffer, SparseCholesky, SymmetricMatrix, squared};
use crate::pipeline::{Connectivity, ScanSurface, SettleSettings, SurfaceSample};
use crate::spatial::{Hit, SurfaceIndex};

/// Samples farther than this from the template, in unit space, belong to what it has not entered.
const REACH: f32 = 0.02;

/// Cosine between the normals of sample and template below which they do not belong together.
const LEAST_COSINE: f32 = 0.3;

/// The farthest that a vertex moves, as a share of its shortest edge: a mesh that follows its scan needs less, and where it
/// lies in a tangle, of edges both long and short, it stays there rather than being drawn through itself.
const FARTHEST: f32 = 0.5;

/// Weight of a step against the data, so that vertices without any stay.
const INERTIA: f32 = 1e-3;

/// Weight of a step along the surface against the data, so that what corresponds stays where it is; less of it brings lids and
/// lips nearer to their creases, and corresponding points apart.
const SLIDING: f32 = 0.2;

/// Residual of a step, as a share of its forces, and the most that is spent on it.
const ACCURACY: (f64, usize) = (1e-2, 30);

/// Moves a registered shape `[N, 3]` to where its triangles, not its vertices, lie closest to the scan.
///
/// A mesh whose vertices lie on a round surface runs below it everywhere between them. Here all samples x_s of the scan
/// pull the triangles that they lie nearest to, along their own normals n_s, and turn them:
/// E(d) = sum_s (n_s . (x_s - B_s p))^2 + l_t^2 |n_s - n_t(p)|^2 + mu sum_edges |d_i - d_j|^2, d the step from p and l_t a
/// share of the triangle's size.
/// Steps of Gauss and Newton, held back along the surface. `index` is of the triangles, wherever they were last.
pub fn settle(
    rest: &RestShape,
    scan: &ScanSurface,
    settings: &SettleSettings,
    index: &mut SurfaceIndex,
    p: &mut [Vec3A],
) {
    if settings.iterations == 0 {
        return;
    }
    let topology = &rest.connectivity.topology;
    index.refit(p);
    let mut last = nearest(scan, index);
    let mut buffer = SolveBuffer::default();
    let before = p.to_vec();
    let farthest = farthest(topology, p);
    for _ in 0..settings.iterations {
        let settling = Settling { rest, settings, p, normals: &Normals::new(topology, p) };
        let matches = settling.matches(scan, &mut last);
        let Some(step) = settling.step(&matches, &mut buffer) else { return };
        for (i, p) in p.iter_mut().enumerate() {
            *p = before[i] + (*p + step[i] - before[i]).clamp_length_max(farthest[i]);
        }
    }
}

/// How far each vertex may move `[N]`.
fn farthest(topology: &Topology, p: &[Vec3A]) -> Vec<f32> {
    let shortest = |i: usize| {
        let ring = topology.neighbours.row(i).iter();
        ring.map(|&j| p[i].distance(p[j as usize])).reduce(f32::min).unwrap_or(0.0)
    };
    (0..p.len()).map(|i| FARTHEST * shortest(i)).collect()
}

/// The triangle that each sample `[S]` lies nearest to, or [`NOWHERE`].
fn nearest(scan: &ScanSurface, index: &SurfaceIndex) -> Vec<u32> {
    let nearest = |sample: &SurfaceSample| {
        let hit = index.closest_oriented(sample.point, sample.normal, 0.0, LEAST_COSINE, REACH * REACH, None);
        hit.filter(|_| sample.weight > 0.0).map_or(NOWHERE, |hit| hit.triangle)
    };
    scan.samples.par_iter().with_min_len(256).map(nearest).collect()
}

const NOWHERE: u32 = u32::MAX;

/// A sample and the template point it lies nearest to.
struct Match {
    sample: SurfaceSample,
    hit: Hit,
    weight: f32,
}

struct Settling<'a> {
    rest: &'a RestShape,
    settings: &'a SettleSettings,
    p: &'a [Vec3A],
    normals: &'a Normals,
}

impl Settling<'_> {
    /// What the samples lie nearest to, from the last triangles on: the shape moves little from step to step.
    fn matches(&self, scan: &ScanSurface, last: &mut [u32]) -> Vec<Match> {
        let (rim, walk) = (&self.rest.connectivity.rim, self.rest.connectivity.walk());
        let per_sample = self.p.len() as f32 / scan.samples.len().max(1) as f32;
        let nearest = |(sample, last): (&SurfaceSample, &mut u32)| {
            if *last == NOWHERE {
                return None;
            }
            let hit = walk.closest_oriented(self.p, sample.point, sample.normal, 0.0, LEAST_COSINE, *last)?;
            *last = hit.triangle;
            let weight = per_sample * sample.weight * self.rest.takes_at(hit.triangle, hit.weights);
            let counts = weight > 0.0
                && hit.distance_squared < REACH * REACH
                && !rim.contains(hit.triangle, hit.weights);
            counts.then_some(Match { sample: *sample, hit, weight })
        };
        scan.samples.par_iter().zip(last).with_min_len(256).filter_map(nearest).collect()
    }

    fn step(&self, matches: &[Match], buffer: &mut SolveBuffer) -> Option<Vec<Vec3A>> {
        let Settling { rest, settings, p, normals } = self;
        let mut system = System::new(&rest.connectivity, settings.stiffness);
        for (i, normal) in normals.vertices.iter().enumerate() {
            system.hold(i, *normal);
        }
        let mut force = vec![Vec3A::ZERO; p.len()];
        self.add_distances(matches, &mut force, &mut system);
        self.add_turns(matches, &mut force, &mut system);
        // Triangles that are only partly for the scan do not take the rest of them along.
        force.iter_mut().enumerate().for_each(|(i, force)| *force *= rest.takes(i));
        system.solve(&mut force, buffer)?;
        Some(force)
    }

    /// The first term: its negative half gradient and its half Hessian.
    fn add_distances(&self, matches: &[Match], force: &mut [Vec3A], system: &mut System) {
        let triangles = &self.rest.connectivity.topology.triangles;
        for Match { sample, hit, weight } in matches {
            let off = sample.normal * (sample.normal.dot(sample.point - hit.point) * weight);
            let w = hit.weights;
            for (&i, w) in triangles[hit.triangle as usize].iter().zip(w) {
                force[i as usize] += off * w;
            }
            system.add(hit.triangle, sample.normal, |j, k| weight * w[j] * w[k]);
        }
    }

    /// The same of the second.
    fn add_turns(&self, matches: &[Match], force: &mut [Vec3A], system: &mut System) {
        // How the normals of each triangle's samples differ from its own, and how much they weigh.
        let mut turns = vec![(Vec3A::ZERO, 0f32); self.rest.connectivity.topology.triangles.len()];
        for Match { sample, hit, weight } in matches {
            let (turn, sum) = &mut turns[hit.triangle as usize];
            *turn += (sample.normal - self.normals.triangle(hit.triangle as usize)) * *weight;
            *sum += weight;
        }
        for (triangle, (turn, weight)) in
            turns.into_iter().enumerate().filter(|(_, (_, weight))| *weight > 0.0)
        {
            self.add_turn(triangle as u32, turn, weight, force, system);
        }
    }

    /// One triangle's part: a step d turns it by -sum_j g_j (d_j . n), g_j the gradients of its barycentric
    /// coordinates.
    fn add_turn(&self, triangle: u32, turn: Vec3A, weight: f32, force: &mut [Vec3A], system: &mut System) {
        let corners = self.rest.connectivity.topology.triangles[triangle as usize];
        let [a, b, c] = corners.map(|i| self.p[i as usize]);
        let area = (b - a).cross(c - a);
        let normal = area.normalize_or_zero();
        let gradients = [c - b, a - c, b - a].map(|side| normal.cross(side) / area.length().max(1e-9));
        let share = self.settings.normals * self.settings.normals * area.length();
        for (i, gradient) in corners.into_iter().zip(gradients) {
            force[i as usize] -= normal * (share * turn.dot(gradient));
        }
        system.add(triangle, normal, |j, k| share * weight * gradients[j].dot(gradients[k]));
    }
}

/// The matrix of a step, and one that is no smaller and alike in x, y and z, whose factor is soon made and leads to it.
struct System<'a> {
    connectivity: &'a Connectivity,
    blocks: BlockMatrix,
    bound: SymmetricMatrix,
}

impl<'a> System<'a> {
    fn new(connectivity: &'a Connectivity, stiffness: f32) -> Self {
        let topology = &connectivity.topology;
        let degree = |i: usize| topology.neighbours.row(i).len() as f32;
        let diagonal: Vec<f32> =
            (0..topology.vertex_count()).map(|i| INERTIA + stiffness * degree(i)).collect();
        let edges = vec![-stiffness; topology.edges.len()];
        let alike = |values: &[f32]| -> Vec<Mat3A> {
            values.iter().map(|&value| Mat3A::from_diagonal(Vec3::splat(value))).collect()
        };
        let double = |values: Vec<f32>| values.into_iter().map(f64::from).collect();
        Self {
            connectivity,
            blocks: BlockMatrix { diagonal: alike(&diagonal), edges: alike(&edges) },
            bound: SymmetricMatrix { diagonal: double(diagonal), edges: double(edges) },
        }
    }

    /// Holds a vertex of unit normal n back along the surface.
    fn hold(&mut self, vertex: usize, n: Vec3A) {
        self.blocks.diagonal[vertex] += (Mat3A::IDENTITY - squared(n)) * SLIDING;
        self.bound.diagonal[vertex] += f64::from(SLIDING);
    }

    /// Adds a symmetric matrix of three rows, given by its entries, for what a triangle's corners do along a unit vector.
    fn add(&mut self, triangle: u32, along: Vec3A, entry: impl Fn(usize, usize) -> f32) {
        self.connectivity.add_blocks(&mut self.blocks, triangle, squared(along), &entry);
        self.connectivity.add_products(&mut self.bound, triangle, |j, k| f64::from(entry(j, k)));
    }

    /// Forces become the step they lead to, `[N, 3]`.
    fn solve(&self, force: &mut [Vec3A], buffer: &mut SolveBuffer) -> Option<()> {
        let near = SparseCholesky::new(self.connectivity.elimination(), &self.bound).ok()?;
        self.blocks.solve(&self.connectivity.topology, &near, force, ACCURACY, buffer);
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Icosphere, TriangleMesh, interpolate};
    use crate::numeric::finite_difference::directional_error;
    use crate::pipeline::Sphere;

    const SETTINGS: SettleSettings = SettleSettings { iterations: 6, normals: 0.25, stiffness: 0.003 };

    fn bumpy(p: Vec3A) -> Vec3A {
        p * (1.0 + 0.1 * (4.0 * p.x).sin() * (3.0 * p.y).cos())
    }

    /// A scan, and a shape whose vertices lie on it.
    fn inscribed() -> (ScanSurface, RestShape, Vec<Vec3A>) {
        let fine = Icosphere::new(6);
        let positions = fine.positions.iter().map(|p| bumpy(p.as_vec3a()).as_dvec3()).collect();
        let scan = ScanSurface::new(&TriangleMesh::new(positions, fine.triangles).unwrap(), 20_000);
        let sphere = Sphere::of_level(3);
        let p: Vec<Vec3A> = sphere.rest.iter().map(|p| scan.to_unit(bumpy(*p).as_dvec3())).collect();
        (scan, RestShape::new(sphere.connectivity.clone(), p.clone()), p)
    }

    fn settle_all(rest: &RestShape, scan: &ScanSurface, settings: &SettleSettings, p: &mut [Vec3A]) {
        let mut index = SurfaceIndex::new(p, &rest.connectivity.topology.triangles);
        settle(rest, scan, settings, &mut index, p);
    }

    fn mean_squared_distance(scan: &ScanSurface, rest: &RestShape, p: &[Vec3A]) -> f32 {
        let index = SurfaceIndex::new(p, &rest.connectivity.topology.triangles);
        let sum: f32 = scan.samples.iter().map(|s| index.closest(s.point).distance_squared).sum();
        sum / scan.samples.len() as f32
    }

    #[test]
    fn triangles_come_to_lie_on_the_scan_and_vertices_stay_in_their_places() {
        let (scan, rest, before) = inscribed();
        let mut p = before.clone();
        settle_all(&rest, &scan, &SettleSettings { normals: 0.0, ..SETTINGS }, &mut p);
        let [on_vertices, on_triangles] = [&before, &p].map(|p| mean_squared_distance(&scan, &rest, p));
        assert!(on_triangles < 0.35 * on_vertices, "{on_triangles} {on_vertices}");
        let edge = before[0].distance(before[rest.connectivity.topology.neighbours.row(0)[0] as usize]);
        let normals = Normals::new(&rest.connectivity.topology, &before).vertices;
        for ((before, after), normal) in before.iter().zip(&p).zip(&normals) {
            let step = *after - *before;
            let slide = step - *normal * normal.dot(step);
            assert!(slide.length() < 0.05 * edge, "{slide} of {edge}");
        }
    }

    #[test]
    fn forces_are_gradients() {
        let (scan, rest, mut p) = inscribed();
        for (i, p) in p.iter_mut().enumerate() {
            *p *= 1.0 + 0.01 * (i as f32).sin();
        }
        let topology = &rest.connectivity.topology;
        let last = nearest(&scan, &SurfaceIndex::new(&p, &topology.triangles));
        let normals = Normals::new(topology, &p);
        let settling = Settling { rest: &rest, settings: &SETTINGS, p: &p, normals: &normals };
        let matches = settling.matches(&scan, &mut last.clone());
        assert!(matches.len() > 10_000);
        let mut system = System::new(&rest.connectivity, 0.0);
        let mut force = vec![Vec3A::ZERO; p.len()];
        settling.add_distances(&matches, &mut force, &mut system);
        settling.add_turns(&matches, &mut force, &mut system);
        let half_gradient: Vec<Vec3A> = force.iter().map(|f| -*f).collect();
        let error = directional_error(&p, &half_gradient, 1e-4, 5, |p| {
            let normals = Normals::new(topology, p);
            // The size of a triangle is that of before the step.
            let size = |t: u32| settling.normals.area_vectors[t as usize].length();
            let energy = |Match { sample, hit, weight }: &Match| {
                let at = interpolate(p, topology.triangles[hit.triangle as usize], hit.weights);
                let off = sample.normal.dot(sample.point - at);
                let turn = sample.normal - normals.triangle(hit.triangle as usize);
                let share = SETTINGS.normals.powi(2) * size(hit.triangle);
                f64::from(weight * (off * off + share * turn.length_squared()))
            };
            0.5 * matches.iter().map(energy).sum::<f64>()
        });
        assert!(error < 1e-2, "{error}");
    }

    #[test]
    fn what_has_no_data_stays() {
        let (scan, rest, before) = inscribed();
        let nothing = vec![0.0; before.len()];
        let mut p = before.clone();
        settle_all(&rest.masked(Some(&nothing)), &scan, &SETTINGS, &mut p);
        assert_eq!(p, before);
    }
}
