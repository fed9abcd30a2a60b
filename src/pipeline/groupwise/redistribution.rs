use glam::Vec3A;
use rayon::prelude::*;

use super::vertex_areas;
use crate::mesh::{Topology, interpolate};
use crate::numeric::SolveBuffer;
use crate::pipeline::{GroupwiseSettings, ScanSurface, Sphere};
use crate::spatial::{Hit, SurfaceIndex};

/// Steps of the flow, and the share of the remaining density error that each removes.
const STEPS: usize = 80;
const SHARE: f32 = 0.2;
const STRIDE: f32 = 0.2;

/// Share of the way to the middle of its neighbours that a vertex goes with each step: the flow stops at the first triangle that
/// grows thin, and without this it does so while half of the density error is left.
const RELAXATION: f32 = 0.1;

/// How many times as much is asked at a landmark, and how far around it, in unit space: people put landmarks where they look.
const LANDMARK_NEED: f32 = 4.0;
const LANDMARK_REACH: f32 = 0.1;

/// Density adaptation of the shared template: vertices flow over the sphere to where the members need them.
///
/// A vertex's need n_i is the most that any member asks of it, by its [`need`] `[N]`. The flow moves vertices along the gradient of psi, with
/// L psi = log(A_i n_i) - mean, until their areas A on the sphere are inverse to the need. On the sphere nothing is in
/// the way, so no triangle folds.
///
/// Returns the point of the old sphere that each vertex `[N]` moves to.
pub fn redistribute(sphere: &Sphere, needs: &[impl AsRef<[f32]>], settings: &GroupwiseSettings) -> Vec<Hit> {
    let need = most_needed(sphere, needs, settings);
    let topology = &sphere.connectivity.topology;
    let index = SurfaceIndex::new(&sphere.rest, &topology.triangles);
    let solver = sphere.connectivity.diffusion(FLOW_LAMBDA);
    let mut buffer = SolveBuffer::default();
    let mut x = sphere.rest.clone();
    for _ in 0..STEPS {
        let needed = locate(&index, &x)
            .par_iter()
            .map(|hit| interpolate(&need, topology.triangles[hit.triangle as usize], hit.weights))
            .collect::<Vec<_>>();
        let areas = vertex_areas(topology, &x);
        let mut psi: Vec<f32> = areas.iter().zip(&needed).map(|(a, n)| (a * n).max(1e-20).ln()).collect();
        let average = psi.iter().sum::<f32>() / psi.len() as f32;
        psi.iter_mut().for_each(|r| *r = 1.5 * FLOW_LAMBDA as f32 * (*r - average));
        solver.solve_scalar(&mut psi, &mut buffer);
        x = flow(topology, &x, &psi);
    }
    locate(&index, &x)
}

/// Diffusion so strong that (I + lambda L) / lambda is the Laplacian but for the constant.
const FLOW_LAMBDA: f64 = 1e4;

fn locate(index: &SurfaceIndex, x: &[Vec3A]) -> Vec<Hit> {
    x.par_iter().with_min_len(256).map(|p| index.closest(*p)).collect()
}

/// One step of the flow along the gradient of psi, kept on the sphere; no vertex moves more than [`STRIDE`] of the
/// edges around it, and all are held back alike, so that the step stays smooth.
fn flow(topology: &Topology, x: &[Vec3A], psi: &[f32]) -> Vec<Vec3A> {
    let step = |i: usize| {
        let ring = topology.neighbours.row(i);
        let (mut gradient, mut squared, mut shortest) = (Vec3A::ZERO, 0.0, f32::MAX);
        for &j in ring {
            let edge = x[j as usize] - x[i];
            let length = edge.length_squared().max(1e-12);
            gradient += edge * ((psi[j as usize] - psi[i]) / length);
            squared += length;
            shortest = shortest.min(length);
        }
        let count = ring.len().max(1) as f32;
        // psi was solved with a unit grid spacing; the gradient per true length brings the spacing back in.
        let step = gradient * (2.0 / count * squared / count);
        (step, step.length() / shortest.sqrt())
    };
    let steps: Vec<(Vec3A, f32)> = (0..x.len()).into_par_iter().with_min_len(512).map(step).collect();
    let longest = steps.iter().map(|(_, stride)| *stride).fold(0.0, f32::max);
    let share = SHARE.min(STRIDE / longest.max(f32::MIN_POSITIVE));
    let moved = |(i, (step, _)): (usize, (Vec3A, f32))| {
        let ring = topology.neighbours.row(i);
        let middle = ring.iter().map(|&j| x[j as usize]).sum::<Vec3A>() / ring.len().max(1) as f32;
        (x[i] + step * share + (middle - x[i]) * RELAXATION).normalize()
    };
    steps.into_iter().enumerate().map(moved).collect()
}

/// What one member needs around each vertex `[N]`, on the sphere, smoothed.
///
/// Every sample of its scan asks for kappa^p at the point of the member that lies nearest in position and normal, kappa
/// the scan's own curvature there, so that what the member has yet to enter counts as well; and for more of it near one of the
/// `landmarks`, in the scan's unit space.
pub fn need(
    sphere: &Sphere,
    scan: &ScanSurface,
    landmarks: &[Vec3A],
    shape: &[Vec3A],
    settings: &GroupwiseSettings,
) -> Vec<f32> {
    let index = SurfaceIndex::new(shape, &sphere.connectivity.topology.triangles);
    let search = settings.normal_search[1] * settings.normal_search[1];
    let mut need = vec![0f32; shape.len()];
    for k in 0..settings.samples {
        let sample = scan.sample(k);
        let Some(hit) =
            index.closest_oriented(sample.point, sample.normal, search, -1.0, f32::INFINITY, None)
        else {
            continue;
        };
        let curvature = sample.curvature.clamp(1.0, 60.0).powf(settings.curvature_power);
        let asked = curvature * nearness(sample.point, landmarks);
        let corners = sphere.connectivity.topology.triangles[hit.triangle as usize];
        for (&i, w) in corners.iter().zip(hit.weights) {
            need[i as usize] += w * asked * sample.weight;
        }
    }
    let smoother = sphere.connectivity.diffusion(settings.need_smoothing);
    smoother.solve_scalar(&mut need, &mut SolveBuffer::default());
    need
}

/// How many times as much a point counts for the landmarks near it.
fn nearness(point: Vec3A, landmarks: &[Vec3A]) -> f32 {
    let nearest = landmarks.iter().map(|landmark| landmark.distance_squared(point)).fold(f32::MAX, f32::min);
    1.0 + (LANDMARK_NEED - 1.0) * (-nearest / (LANDMARK_REACH * LANDMARK_REACH)).exp()
}

/// n_i per vertex `[N]`: the most that any member needs, within limits.
fn most_needed(sphere: &Sphere, needs: &[impl AsRef<[f32]>], settings: &GroupwiseSettings) -> Vec<f32> {
    let mut need = vec![0f32; sphere.rest.len()];
    for own in needs {
        need.iter_mut().zip(own.as_ref()).for_each(|(need, own)| *need = need.max(*own));
    }
    let mut sorted = need.clone();
    sorted.sort_by(f32::total_cmp);
    let median = sorted[sorted.len() / 2].max(f32::MIN_POSITIVE);
    need.iter_mut().for_each(|n| *n = (*n / median).clamp(0.2, settings.most_need));
    need
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Icosphere, Normals, TriangleMesh};

    #[test]
    fn vertices_gather_where_a_member_is_stretched() {
        let sphere = Sphere::of_level(4);
        let mut member = sphere.rest.clone();
        for p in &mut member {
            // A cap pulled out to a horn.
            if p.z > 0.9 {
                p.z += 8.0 * (p.z - 0.9);
            }
        }
        let settings =
            crate::pipeline::Settings::preset(crate::pipeline::Preset::Default, 2562).unwrap().groupwise;
        let settings = GroupwiseSettings { most_need: 10.0, ..settings };
        let positions = member.iter().map(|p| p.as_dvec3()).collect();
        let mesh = TriangleMesh::new(positions, Icosphere::new(4).triangles).unwrap();
        let scan = ScanSurface::new(&mesh, 20_000);
        let member: Vec<Vec3A> = member.iter().map(|p| scan.to_unit(p.as_dvec3())).collect();
        let hits = redistribute(&sphere, &[need(&sphere, &scan, &[], &member, &settings)], &settings);
        let moved: Vec<Vec3A> = hits.iter().map(|h| h.point).collect();
        let inside = |p: &[Vec3A]| p.iter().filter(|p| p.z > 0.9).count();
        assert!(inside(&moved) > 2 * inside(&sphere.rest), "{} {}", inside(&moved), inside(&sphere.rest));
        let normals = Normals::new(&sphere.connectivity.topology, &moved);
        let folded = (0..sphere.connectivity.topology.triangles.len()).filter(|&t| {
            normals.triangle(t).dot(moved[sphere.connectivity.topology.triangles[t][0] as usize]) <= 0.0
        });
        assert_eq!(folded.count(), 0);
    }
}
