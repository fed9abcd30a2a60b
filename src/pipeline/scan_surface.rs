use glam::{DMat3, DVec3, Vec3A};
use rayon::prelude::*;

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
    /// Unit normals per vertex, interpolated by [`ScanSurface::normal_at`].
    normals: Vec<Vec3A>,
    rim: Rim,
}

impl ScanSurface {
    /// Prepares a scan as it lies in its own space, with this many samples.
    pub fn new(mesh: &TriangleMesh, samples: usize) -> Self {
        Self::turned(mesh, DMat3::IDENTITY, samples)
    }

    /// Prepares a scan and turns it.
    pub fn turned(mesh: &TriangleMesh, rotation: DMat3, samples: usize) -> Self {
        let centre = mesh.centroid();
        let radius = mesh.radius_about(centre);
        let positions: Vec<Vec3A> =
            mesh.positions().iter().map(|p| (rotation * (*p - centre) / radius).as_vec3a()).collect();
        let (index, (topology, normals, samples)) = rayon::join(
            || SurfaceIndex::new(&positions, mesh.triangles()),
            || {
                let topology = Topology::of(mesh);
                let normals = Normals::new(&topology, &positions);
                let curvatures = curvatures(&topology, &positions, &normals.vertices);
                let samples = sample(mesh.triangles(), &positions, &normals, &curvatures, samples);
                (topology, normals, samples)
            },
        );
        Self {
            centre,
            radius,
            rotation,
            index,
            walk: SurfaceWalk::new(&topology),
            positions,
            samples,
            normals: normals.vertices,
            rim: Rim::of(&topology),
        }
    }

    /// From the scan's space to unit space.
    pub fn to_unit(&self, point: DVec3) -> Vec3A {
        (self.rotation * (point - self.centre) / self.radius).as_vec3a()
    }

    /// From unit space to the scan's.
    pub fn to_scan(&self, point: Vec3A) -> DVec3 {
        self.rotation.transpose() * point.as_dvec3() * self.radius + self.centre
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

    /// Whether a point of the scan lies on its rim: there the data ends.
    pub fn on_rim(&self, hit: &Hit) -> bool {
        self.rim.contains(hit.triangle, hit.weights)
    }
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

/// Samples spread evenly by area: one in each of `count` equal stretches of the triangles laid end to end.
fn sample(
    triangles: &[[u32; 3]],
    positions: &[Vec3A],
    normals: &Normals,
    curvatures: &[f32],
    count: usize,
) -> Vec<SurfaceSample> {
    let mut random = Random::new(1);
    let areas = normals.area_vectors.iter().map(|e| f64::from(e.length()));
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
                point: at(positions),
                normal: at(&normals.vertices).normalize_or_zero(),
                curvature: corners.iter().zip(weights).map(|(&i, w)| curvatures[i as usize] * w).sum(),
            });
            next = samples.len() as f64 + random.unit();
        }
    }
    for i in (1..samples.len()).rev() {
        samples.swap(i, random.below(i + 1));
    }
    samples
}
