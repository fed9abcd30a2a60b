//! The index and the walk against brute force over [`closest_on_triangle`], itself held against a dense search in f64.

use glam::Vec3A;

use super::{Hit, SurfaceIndex, SurfaceWalk, closest_on_triangle};
use crate::mesh::Topology;

/// A small generator (splitmix64), so that the tests need no crate for it.
struct Random(u64);

impl Random {
    /// Uniform in -1 to 1.
    fn signed(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    fn point(&mut self) -> Vec3A {
        Vec3A::new(self.signed(), self.signed(), self.signed())
    }
}

/// A soup of triangles of about this edge length, a tenth of them degenerate in one way or another.
fn soup(random: &mut Random, count: usize, edge: f32) -> (Vec<Vec3A>, Vec<[u32; 3]>) {
    let mut positions = Vec::new();
    for triangle in 0..count {
        let a = random.point();
        let (b, c) = (a + edge * random.point(), a + edge * random.point());
        positions.extend(match triangle % 40 {
            0 => [a, a, a],
            1 => [a, b, b],
            2 => [a, b, a.midpoint(b)],
            3 => [a, b, a + 1e-7 * random.point()],
            _ => [a, b, c],
        });
    }
    let triangles = (0..count as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    (positions, triangles)
}

/// A bumpy sphere of 2 x `rings` x `rings` quads cut in two.
fn bumpy_sphere(rings: u32) -> (Vec<Vec3A>, Vec<[u32; 3]>) {
    let around = 2 * rings;
    let mut positions = Vec::new();
    for i in 0..=rings {
        for j in 0..around {
            let (theta, phi) = (
                std::f32::consts::PI * i as f32 / rings as f32,
                std::f32::consts::TAU * j as f32 / around as f32,
            );
            let q = Vec3A::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
            let bump = 1.0
                + 0.06 * (5.0 * q.x).sin() * (4.0 * q.y + 1.0).cos()
                + 0.02 * (17.0 * q.z).sin() * (13.0 * q.x).cos();
            positions.push(0.9 * bump * q);
        }
    }
    let mut triangles = Vec::new();
    for i in 0..rings {
        for j in 0..around {
            let at = |i: u32, j: u32| i * around + j % around;
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (positions, triangles)
}

fn corners(positions: &[Vec3A], triangle: [u32; 3]) -> [Vec3A; 3] {
    triangle.map(|v| positions[v as usize])
}

fn brute_distance(positions: &[Vec3A], triangles: &[[u32; 3]], p: Vec3A) -> f32 {
    let distance = |&t: &[u32; 3]| closest_on_triangle(p, corners(positions, t)).distance_squared;
    triangles.iter().map(distance).fold(f32::INFINITY, f32::min)
}

/// Checks that a hit says the same thing four ways.
fn assert_coherent(hit: &Hit, positions: &[Vec3A], triangles: &[[u32; 3]], p: Vec3A) {
    let [a, b, c] = corners(positions, triangles[hit.triangle as usize]);
    let [u, v, w] = hit.weights;
    assert!(u >= 0.0 && v >= 0.0 && w >= 0.0 && (u + v + w - 1.0).abs() < 1e-6, "{hit:?}");
    assert!((a * u + b * v + c * w).distance(hit.point) < 1e-6, "{hit:?}");
    assert!((hit.point.distance(p) - hit.distance_squared.sqrt()).abs() < 1e-6, "{hit:?}");
}

#[test]
fn triangle_agrees_with_dense_search() {
    let mut random = Random(1);
    for _ in 0..300 {
        let corners = [random.point(), random.point(), random.point()];
        let p = 2.0 * random.point();
        let found = closest_on_triangle(p, corners);
        let [a, b, c] = corners.map(|q| q.as_dvec3());
        let steps = 60;
        let mut least = f64::INFINITY;
        for i in 0..=steps {
            for j in 0..=steps - i {
                let (v, w) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                least = least.min((a + (b - a) * v + (c - a) * w).distance(p.as_dvec3()));
            }
        }
        let distance = f64::from(found.distance_squared.sqrt());
        assert!(distance < least + 1e-6 && least < distance + 0.04, "{distance} {least}");
    }
}

#[test]
fn weights_are_zero_away_from_the_side_or_corner_that_is_hit() {
    let corners = [Vec3A::ZERO, Vec3A::X, Vec3A::Y];
    let hit = |x: f32, y: f32| {
        closest_on_triangle(Vec3A::new(x, y, 3.0), corners).weights.map(|weight| i32::from(weight != 0.0))
    };
    assert_eq!(hit(0.2, 0.3), [1, 1, 1]);
    assert_eq!(hit(0.4, -0.1), [1, 1, 0]);
    assert_eq!(hit(0.8, 0.9), [0, 1, 1]);
    assert_eq!(hit(-0.1, 0.4), [1, 0, 1]);
    assert_eq!(hit(-0.1, -0.4), [1, 0, 0]);
    assert_eq!(hit(3.0, -0.4), [0, 1, 0]);
    assert_eq!(hit(-0.4, 2.0), [0, 0, 1]);
}

#[test]
fn a_surface_whose_tree_is_built_in_parts_agrees_with_brute_force() {
    // More triangles than are built into one tree, and so are those of its quarters.
    let (positions, triangles) = bumpy_sphere(520);
    let index = SurfaceIndex::new(&positions, &triangles);
    let mut random = Random(11);
    for _ in 0..24 {
        let p = 1.2 * random.point();
        let hit = index.closest(p);
        assert_coherent(&hit, &positions, &triangles, p);
        let least = brute_distance(&positions, &triangles, p);
        assert!(
            (hit.distance_squared - least).abs() <= 1e-6 * least.max(1e-6),
            "{} {least}",
            hit.distance_squared
        );
    }
    // Every triangle has its place.
    for triangle in (0..triangles.len() as u32).step_by(997) {
        let [a, b, c] = corners(&positions, triangles[triangle as usize]);
        let centre = (a + b + c) / 3.0;
        assert!(index.closest_on(centre, triangle).distance_squared < 1e-12);
        assert!(index.closest(centre).distance_squared < 1e-12);
    }
}

#[test]
fn far_point_keeps_its_weights() {
    let a = Vec3A::new(0.3, 0.2, 0.1);
    let corners = [a, a + Vec3A::new(0.01, 0.0, 0.001), a + Vec3A::new(0.002, 0.008, 0.0)];
    let normal = (corners[1] - a).cross(corners[2] - a).normalize();
    let inside = (corners[0] + corners[1] + corners[2]) / 3.0;
    let found = closest_on_triangle(inside + normal, corners);
    assert!(found.weights.iter().all(|w| (w - 1.0 / 3.0).abs() < 1e-4), "{found:?}");
}

#[test]
fn index_agrees_with_brute_force() {
    let mut random = Random(2);
    for (count, edge) in [(1, 0.5), (3, 0.5), (5, 0.5), (60, 0.8), (3000, 0.1)] {
        let (positions, triangles) = soup(&mut random, count, edge);
        let index = SurfaceIndex::new(&positions, &triangles);
        for k in 0..400 {
            let reach = [0.01, 1.0, 30.0][k % 3];
            let p = positions[k % positions.len()] + reach * random.point();
            let hit = index.closest(p);
            assert_coherent_far(&hit, &positions, &triangles, p);
            let least = brute_distance(&positions, &triangles, p);
            assert!(close(hit.distance_squared, least), "{} {least}", hit.distance_squared);
            let hinted = index.closest_below(p, f32::INFINITY, (k % count) as u32);
            assert!(close(hinted.distance_squared, least));
        }
    }
}

fn close(a: f32, b: f32) -> bool {
    (a.sqrt() - b.sqrt()).abs() < 1e-6 * (1.0 + b.sqrt())
}

fn assert_coherent_far(hit: &Hit, positions: &[Vec3A], triangles: &[[u32; 3]], p: Vec3A) {
    if hit.distance_squared < 4.0 {
        assert_coherent(hit, positions, triangles, p);
    }
}

#[test]
fn bound_hides_what_is_beyond_it() {
    let mut random = Random(3);
    let (positions, triangles) = soup(&mut random, 500, 0.1);
    let index = SurfaceIndex::new(&positions, &triangles);
    for _ in 0..200 {
        let p = random.point();
        let nearest = index.closest(p);
        let hinted = index.closest_below(p, 0.5 * nearest.distance_squared, 7);
        assert_eq!(hinted.triangle, 7);
        let found = index.closest_below(p, 1.01 * nearest.distance_squared, 7);
        assert_eq!(found.distance_squared, nearest.distance_squared);
    }
}

#[test]
fn oriented_search_agrees_with_brute_force() {
    let mut random = Random(4);
    let (positions, triangles) = soup(&mut random, 2000, 0.1);
    let index = SurfaceIndex::new(&positions, &triangles);
    let mut missed = 0;
    for k in 0..600 {
        let (p, n) = (random.point(), random.point().normalize());
        let (weight, min_cosine, bound) =
            ([0.0, 0.02, 0.5][k % 3], [0.0, 0.9, -0.5][k / 3 % 3], [0.003, 0.1, 1e9][k / 9 % 3]);
        let cost = |t: u32| {
            let distance = index.closest_on(p, t).distance_squared;
            let cosine = index.triangle_normal(t).dot(n);
            let qualifies = distance <= bound && cosine > min_cosine;
            if qualifies { distance + weight * (2.0 - 2.0 * cosine) } else { f32::INFINITY }
        };
        let least = (0..2000).map(cost).fold(f32::INFINITY, f32::min);
        for hint in [None, Some(k as u32)] {
            match index.closest_oriented(p, n, weight, min_cosine, bound, hint) {
                Some(hit) => assert!((cost(hit.triangle) - least).abs() < 1e-5, "{hit:?} {least}"),
                None => {
                    assert_eq!(least, f32::INFINITY);
                    missed += 1;
                }
            }
        }
    }
    assert!(missed > 10 && missed < 600, "{missed}");
}

#[test]
fn refit_agrees_with_rebuilding() {
    let mut random = Random(5);
    let (mut positions, triangles) = soup(&mut random, 1000, 0.1);
    let mut index = SurfaceIndex::new(&positions, &triangles);
    for p in &mut positions {
        *p = Vec3A::new(1.3 * p.y, 0.7 * p.x + 0.2 * p.z * p.z, p.z - 0.4);
    }
    index.refit(&positions);
    let rebuilt = SurfaceIndex::new(&positions, &triangles);
    for triangle in 0..1000 {
        assert_eq!(index.triangle_normal(triangle), rebuilt.triangle_normal(triangle));
    }
    for _ in 0..300 {
        let (p, n) = (random.point(), random.point().normalize());
        assert_eq!(index.closest(p).distance_squared, rebuilt.closest(p).distance_squared);
        let found =
            [&index, &rebuilt].map(|i| i.closest_oriented(p, n, 0.1, 0.2, 1.0, None).map(|h| h.triangle));
        assert_eq!(found[0], found[1]);
    }
}

#[test]
fn coincident_triangles_end() {
    let positions = [Vec3A::ZERO, Vec3A::X, Vec3A::Y];
    let triangles = vec![[0, 1, 2]; 3000];
    let index = SurfaceIndex::new(&positions, &triangles);
    let hit = index.closest(Vec3A::new(0.25, 0.25, 1.0));
    assert_eq!(hit.weights, [0.5, 0.25, 0.25]);
    assert_eq!(hit.distance_squared, 1.0);
}

#[test]
fn lopsided_trees_are_searched_whole() {
    // Each triangle is a little smaller and farther in than the last, so that grouping neighbours makes a long chain.
    let mut positions = Vec::new();
    for k in 0..600 {
        let at = 0.93_f32.powi(k);
        positions.extend([
            Vec3A::new(at, 0.0, 0.0),
            Vec3A::new(at, 0.01 * at, 0.0),
            Vec3A::new(at, 0.0, 0.01 * at),
        ]);
    }
    let triangles: Vec<[u32; 3]> = (0..600).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let index = SurfaceIndex::new(&positions, &triangles);
    let mut random = Random(8);
    for k in 0..300 {
        let p = 0.95_f32.powi(k) * random.point();
        let least = brute_distance(&positions, &triangles, p);
        assert!((index.closest(p).distance_squared - least).abs() <= 1e-5 * least);
    }
}

#[test]
fn query_that_is_no_number_ends() {
    let (positions, triangles) = soup(&mut Random(6), 100, 0.1);
    let index = SurfaceIndex::new(&positions, &triangles);
    index.closest(Vec3A::NAN);
    assert_eq!(index.closest_oriented(Vec3A::NAN, Vec3A::X, 0.1, 0.0, 1.0, None), None);
}

#[test]
fn walk_reaches_the_nearest_point_on_a_smooth_surface() {
    let (positions, triangles) = bumpy_sphere(40);
    let index = SurfaceIndex::new(&positions, &triangles);
    let walk = SurfaceWalk::new(&Topology::new(positions.len(), &triangles));
    let mut random = Random(7);
    for (normal_weight, least) in [(0.0, 980), (0.01, 900)] {
        let mut reached = 0;
        for _ in 0..1000 {
            let near = index.closest(random.point());
            let (p, n) = (near.point + 0.02 * random.point(), index.triangle_normal(near.triangle));
            let from = index.closest(p + 0.05 * random.point()).triangle;
            let walked = walk.closest_oriented(&positions, p, n, normal_weight, -1.0, from).unwrap();
            let exact = index.closest_oriented(p, n, normal_weight, -1.0, f32::INFINITY, None).unwrap();
            assert_coherent(&walked, &positions, &triangles, p);
            let [walked, exact] = [walked, exact].map(|hit| {
                let turn = n.distance_squared(index.triangle_normal(hit.triangle));
                hit.distance_squared + normal_weight * turn
            });
            assert!(walked >= exact - 1e-7);
            reached += usize::from(close(walked, exact));
        }
        assert!(reached > least, "{reached} with {normal_weight}");
    }
}

#[test]
fn walk_stops_at_a_rim() {
    let (mut positions, triangles) = bumpy_sphere(10);
    positions.push(Vec3A::ZERO);
    let half = &triangles[..200];
    let walk = SurfaceWalk::new(&Topology::new(positions.len(), half));
    let p = Vec3A::new(0.1, 0.2, -5.0);
    let hit = walk.closest_oriented(&positions, p, Vec3A::Z, 0.0, -1.0, 3).unwrap();
    assert_coherent_far(&hit, &positions, half, p);
    assert!(hit.weights.contains(&0.0));
}

#[test]
fn walk_keeps_to_triangles_that_qualify() {
    let (positions, triangles) = bumpy_sphere(40);
    let walk = SurfaceWalk::new(&Topology::new(positions.len(), &triangles));
    let outward = closest_on_triangle(2.0 * Vec3A::X, corners(&positions, triangles[0])).point.normalize();
    for (n, qualifies) in [(outward, true), (-outward, false)] {
        let hit = walk.closest_oriented(&positions, outward, n, 0.0, 0.5, 0);
        assert_eq!(hit.is_some(), qualifies);
    }
    assert_eq!(walk.closest_oriented(&positions, Vec3A::NAN, Vec3A::X, 0.1, 0.0, 0), None);
}
