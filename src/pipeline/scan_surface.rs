use glam::{DMat3, DVec3, Vec3A};
use rayon::prelude::*;

use super::strays::without_strays;
use crate::mesh::{Normals, Rim, Topology, TriangleMesh, interpolate};
use crate::numeric::Random;
use crate::spatial::{Hit, SurfaceIndex, SurfaceWalk};

/// A point of the scan and its unit normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceSample {
    /// Position in unit space.
    pub point: Vec3A,
    /// Unit normal of the scan there.
    pub normal: Vec3A,
    /// How much that normal turns over a unit of length.
    pub curvature: f32,
    /// The scan's weight there.
    pub weight: f32,
}

/// A scan made ready to be fitted: in unit space (its vertices' mean at the origin, the farthest at distance one, and
/// perhaps turned), with an index of its triangles, its rim and samples of its surface.
pub struct ScanSurface {
    /// The vertices' mean, in the scan's own space.
    pub centre: DVec3,
    /// The largest distance of a vertex from it, in the scan's units.
    pub radius: f64,
    /// How it is turned from its own space to unit space.
    pub rotation: DMat3,
    /// Vertex positions in unit space.
    pub positions: Vec<Vec3A>,
    /// Nearest points, in unit space.
    pub index: SurfaceIndex,
    /// Nearest points from the last answer on.
    pub walk: SurfaceWalk,
    /// Evenly spread samples in random order, so that any stretch of them covers the surface.
    pub samples: Vec<SurfaceSample>,
    /// Whether it is a patch, as a face without the back of its head, and not a closed surface but for holes.
    pub open: bool,
    /// Unit normals per vertex, interpolated by [`ScanSurface::normal_at`].
    normals: Vec<Vec3A>,
    rim: Rim,
    /// How much each vertex counts as data, 0 to 1; `None` where all count alike.
    weights: Option<Vec<f32>>,
}

impl ScanSurface {
    /// Prepares a scan as it lies in its own space, with this many samples.
    pub fn new(mesh: &TriangleMesh, samples: usize) -> Self {
        Self::turned(mesh, DMat3::IDENTITY, samples)
    }

    /// Prepares a scan and turns it.
    pub fn turned(mesh: &TriangleMesh, rotation: DMat3, samples: usize) -> Self {
        Self::weighted(mesh, None, rotation, samples)
    }

    /// Prepares a scan whose vertices count as data as much as `weights` `[N]` say, 0 to 1, and turns it. Small pieces
    /// that lie away from it are left out.
    pub fn weighted(mesh: &TriangleMesh, weights: Option<&[f32]>, rotation: DMat3, samples: usize) -> Self {
        let weights = weights.filter(|weights| weights.iter().any(|w| *w != 1.0)).map(<[f32]>::to_vec);
        match without_strays(mesh) {
            Ok(Some((rest, vertices))) => {
                let kept = |weights: Vec<f32>| vertices.iter().map(|&i| weights[i as usize]).collect();
                Self::of(&rest, weights.map(kept), rotation, samples)
            }
            _ => Self::of(mesh, weights, rotation, samples),
        }
    }

    fn of(mesh: &TriangleMesh, weights: Option<Vec<f32>>, rotation: DMat3, samples: usize) -> Self {
        let (centre, radius) = frame(mesh, weights.as_deref());
        let positions: Vec<Vec3A> =
            mesh.positions().iter().map(|p| (rotation * (*p - centre) / radius).as_vec3a()).collect();
        let (index, (walk, rim, normals, samples, open)) = rayon::join(
            || SurfaceIndex::new(&positions, mesh.triangles()),
            || {
                let topology = Topology::of(mesh);
                let normals = Normals::new(&topology, &positions);
                let curvatures = curvatures(&topology, &positions, &normals.vertices);
                let open = is_open(mesh.triangles(), &normals.area_vectors, weights.as_deref());
                let weights =
                    if open { Some(off_the_rim(&topology, weights.as_deref())) } else { weights.clone() };
                let surface = Sampled { positions: &positions, normals: &normals, curvatures: &curvatures };
                let samples = surface.samples(mesh.triangles(), weights.as_deref(), samples);
                (SurfaceWalk::new(&topology), Rim::of(&topology), normals, samples, open)
            },
        );
        Self {
            centre,
            radius,
            rotation,
            index,
            walk,
            positions,
            samples,
            open,
            normals: normals.vertices,
            rim,
            weights,
        }
    }

    /// About as many bytes as it takes: positions, normals, samples, and an index of the triangles.
    pub fn bytes(&self) -> usize {
        let triangles = self.index.triangles().len();
        36 * self.positions.len() + 160 * triangles + size_of::<SurfaceSample>() * self.samples.len()
    }

    /// From the scan's space to unit space.
    pub fn to_unit(&self, point: DVec3) -> Vec3A {
        (self.rotation * (point - self.centre) / self.radius).as_vec3a()
    }

    /// From unit space to the scan's.
    pub fn to_scan(&self, point: Vec3A) -> DVec3 {
        self.rotation.transpose() * point.as_dvec3() * self.radius + self.centre
    }

    /// How far points `[N]` in unit space lie from it, in the scan's units.
    pub fn distances(&self, points: &[Vec3A]) -> Vec<f64> {
        let distance = |p: &Vec3A| self.radius * f64::from(self.index.closest(*p).distance_squared).sqrt();
        points.par_iter().map(distance).collect()
    }

    /// Sample number `k`, counted round.
    pub fn sample(&self, k: usize) -> SurfaceSample {
        self.samples[k % self.samples.len()]
    }

    /// The scan's smooth unit normal at a point of it.
    pub fn normal_at(&self, hit: &Hit) -> Vec3A {
        let corners = self.index.triangles()[hit.triangle as usize];
        interpolate(&self.normals, corners, hit.weights).normalize_or_zero()
    }

    /// How much a point of the scan counts as data, 0 to 1; nothing on its rim, where the data ends.
    pub fn weight_at(&self, hit: &Hit) -> f32 {
        if self.on_rim(hit) {
            return 0.0;
        }
        let corners = self.index.triangles()[hit.triangle as usize];
        self.weights.as_ref().map_or(1.0, |weights| interpolate(weights, corners, hit.weights))
    }

    /// Whether it says what is on every side, so that whatever surrounds it can be held against it.
    pub fn whole(&self) -> bool {
        !self.open && self.weights.is_none()
    }

    fn on_rim(&self, hit: &Hit) -> bool {
        self.rim.contains(hit.triangle, hit.weights)
    }
}

/// The largest opening of a closed surface, seen as its area's share of the surface's: a head's neck is 0.12, what is
/// open behind a face 0.45 and more.
const LARGEST_OPENING: f32 = 0.2;

/// The area vectors of a closed surface add up to zero, those of an open one to its opening's.
fn is_open(triangles: &[[u32; 3]], area_vectors: &[Vec3A], weights: Option<&[f32]>) -> bool {
    let weight = |t: usize| {
        weights.map_or(1.0, |weights| triangles[t].iter().map(|&i| weights[i as usize]).sum::<f32>() / 3.0)
    };
    let weighed = || area_vectors.iter().enumerate().map(|(t, area)| *area * weight(t));
    let area: f32 = weighed().map(|e| e.length()).sum();
    weighed().sum::<Vec3A>().length() > LARGEST_OPENING * area
}

/// The weights with which a patch's samples pull: its rim is cut rather than seen, and frayed.
fn off_the_rim(topology: &Topology, weights: Option<&[f32]>) -> Vec<f32> {
    let weight = |i: usize| weights.map_or(1.0, |weights| weights[i]);
    topology.on_rim.iter().enumerate().map(|(i, &on_rim)| if on_rim { 0.0 } else { weight(i) }).collect()
}

/// The mean and the largest distance from it of the vertices that count as data.
fn frame(mesh: &TriangleMesh, weights: Option<&[f32]>) -> (DVec3, f64) {
    let counts = |i: usize| weights.is_none_or(|weights| weights[i] > 0.0);
    let data = || mesh.positions().iter().enumerate().filter(|(i, _)| counts(*i)).map(|(_, p)| *p);
    let centre = data().sum::<DVec3>() / data().count().max(1) as f64;
    let radius = data().map(|p| p.distance_squared(centre)).fold(0.0, f64::max).sqrt();
    if radius > 0.0 { (centre, radius) } else { (mesh.centroid(), mesh.radius_about(mesh.centroid())) }
}

/// Rounds of averaging the normals before their turning is taken for the shape's and not the noise's.
const NORMAL_ROUNDS: usize = 4;

/// How much the smoothed normal turns from a vertex to its neighbours, over the distance, `[N]`.
fn curvatures(topology: &Topology, positions: &[Vec3A], normals: &[Vec3A]) -> Vec<f32> {
    let ring = |i: usize| topology.neighbours.row(i).iter().map(|&j| j as usize);
    let mut smooth = normals.to_vec();
    for _ in 0..NORMAL_ROUNDS {
        smooth = (0..smooth.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| ring(i).fold(smooth[i], |sum, j| sum + smooth[j]).normalize_or_zero())
            .collect();
    }
    let turn = |i: usize| {
        let (turned, length) = ring(i).fold((0.0, 0.0), |(turned, length), j| {
            (turned + smooth[i].distance(smooth[j]), length + positions[i].distance(positions[j]))
        });
        if length > 0.0 { turned / length } else { 0.0 }
    };
    (0..positions.len()).into_par_iter().with_min_len(1024).map(turn).collect()
}

/// What samples are drawn from.
struct Sampled<'a> {
    positions: &'a [Vec3A],
    normals: &'a Normals,
    curvatures: &'a [f32],
}

impl Sampled<'_> {
    /// Samples spread evenly by area: one in each of `count` equal stretches of the triangles laid end to end.
    fn samples(
        &self,
        triangles: &[[u32; 3]],
        vertex_weights: Option<&[f32]>,
        count: usize,
    ) -> Vec<SurfaceSample> {
        let mut random = Random::new(1);
        let areas = self.normals.area_vectors.iter().map(|e| f64::from(e.length()));
        let total: f64 = areas.clone().sum();
        let mut samples = Vec::with_capacity(count);
        let (mut passed, mut next) = (0.0, random.unit());
        for (t, area) in areas.enumerate() {
            passed += area / total * count as f64;
            while next < passed && samples.len() < count {
                let (root, along) = (random.unit().sqrt(), random.unit());
                let weights = [1.0 - root, root * (1.0 - along), root * along].map(|w| w as f32);
                let corners = triangles[t];
                let at = |values: &[Vec3A]| interpolate(values, corners, weights);
                samples.push(SurfaceSample {
                    point: at(self.positions),
                    normal: at(&self.normals.vertices).normalize_or_zero(),
                    curvature: interpolate(self.curvatures, corners, weights),
                    weight: vertex_weights.map_or(1.0, |values| interpolate(values, corners, weights)),
                });
                next = samples.len() as f64 + random.unit();
            }
        }
        for i in (1..samples.len()).rev() {
            samples.swap(i, random.below(i + 1));
        }
        samples
    }
}
