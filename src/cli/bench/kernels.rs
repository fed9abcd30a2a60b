use std::hint::black_box;
use std::sync::Arc;

use glam::Vec3A;
use nalgebra_sparse::factorization::CscCholesky;
use onemesh::mesh::{Icosphere, LandmarkSet, Normals, Topology, TriangleMesh, mean_edge_lengths};
use onemesh::numeric::{Elimination, SolveBuffer, SparseCholesky, SymmetricMatrix};
use onemesh::pipeline::ScanSurface;
use onemesh::preflight::Inspection;
use onemesh::spatial::{SurfaceIndex, self_intersections};

use super::clock::Clock;

/// The paper's lambda.
const LAMBDA: f64 = 19.0;
/// Queries in a run.
const QUERIES: u32 = 10_000;

fn sphere(vertices: usize) -> (Topology, Vec<Vec3A>) {
    let sphere = Icosphere::new(Icosphere::level_of(vertices).unwrap_or(0));
    let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
    (topology, sphere.positions.iter().map(|p| p.as_vec3a()).collect())
}

/// Ordering, factor and solve on each template.
pub fn solves(clock: &Clock, finest: usize) {
    for vertices in [2562, 10242, 40962].into_iter().filter(|&vertices| vertices <= finest) {
        let (topology, positions) = sphere(vertices);
        let matrix = SymmetricMatrix::diffusion(&topology, LAMBDA);
        let elimination = Arc::new(Elimination::new(&topology, &positions));
        clock.kernel(&format!("ordering, {vertices} vertices"), || {
            black_box(Elimination::new(&topology, &positions));
        });
        let factor = || SparseCholesky::new(&elimination, &matrix);
        clock.kernel(&format!("factor, {vertices} vertices"), || drop(black_box(factor())));
        let library = matrix.in_order(&topology, &elimination.order);
        clock.kernel(&format!("factor by nalgebra-sparse, {vertices} vertices"), || {
            drop(black_box(CscCholesky::factor(&library)));
        });
        let Ok(cholesky) = factor() else { continue };
        let (mut x, mut buffer) = (positions.clone(), SolveBuffer::default());
        clock.kernel_each(&format!("solve of three right-hand sides, {vertices} vertices"), 20, &mut || {
            for _ in 0..20 {
                x.copy_from_slice(&positions);
                cholesky.solve(&mut x, &mut buffer);
            }
        });
    }
}

/// Nearest points of a scan, on one thread, from near and from far.
pub fn nearest_points(clock: &Clock, name: &str, mesh: &TriangleMesh) {
    let scan = ScanSurface::new(mesh, QUERIES as usize);
    clock.kernel(&format!("scan made ready ({name})"), || {
        black_box(ScanSurface::new(mesh, QUERIES as usize));
    });
    for (from, distance) in [("near", 0.01), ("far", 0.3)] {
        let mut all = || {
            for sample in &scan.samples {
                black_box(scan.index.closest(sample.point + distance * sample.normal));
            }
        };
        clock.kernel_each(&format!("nearest point, {from}, a query ({name})"), QUERIES, &mut all);
    }
}

/// What an iteration does beside its solves and searches on the scan, at 10242 vertices.
pub fn iteration(clock: &Clock) {
    let (topology, positions) = sphere(10242);
    let mut normals = Normals::new(&topology, &positions);
    clock.kernel("iteration: normals", || normals.update(&topology, &positions));
    let mut gradient = vec![Vec3A::ZERO; positions.len()];
    clock.kernel("iteration: pull-back of the normals", || {
        normals.pull_back(&topology, &positions, &positions, &mut gradient);
    });
    clock.kernel("iteration: mean edge lengths", || {
        black_box(mean_edge_lengths(&topology, &positions));
    });
    let mut index = SurfaceIndex::new(&positions, &topology.triangles);
    clock.kernel("iteration: search tree rebuilt", || {
        black_box(SurfaceIndex::new(&positions, &topology.triangles));
    });
    clock.kernel("iteration: search tree refitted", || index.refit(&positions));
}

/// What is looked at before a registration, and where a surface passes through itself.
pub fn inspection(clock: &Clock, name: &str, mesh: &TriangleMesh, landmarks: Option<&LandmarkSet>) {
    let with = landmarks.map_or(String::new(), |set| format!(" and {} landmarks", set.names.len()));
    clock.kernel(&format!("inspection of the scan{with} ({name})"), || {
        black_box(Inspection::new(mesh, landmarks));
    });
    clock.kernel(&format!("self-intersections ({name})"), || {
        black_box(self_intersections(mesh.positions(), mesh.triangles()));
    });
}

/// Self-intersections of a template as large as results are.
pub fn self_intersection(clock: &Clock) {
    let (topology, positions) = sphere(10242);
    let positions: Vec<_> = positions.iter().map(|p| p.as_dvec3()).collect();
    clock.kernel("self-intersections, 20480 triangles", || {
        black_box(self_intersections(&positions, &topology.triangles));
    });
}
