//! What every collection of heads holds to.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DQuat, DVec3};

use super::clay::Clay;
use super::spacing::Spacing;
use super::tessellation::tessellate;
use super::{Expression, Head, Identity, Random, SculptedHead, Sculptor, Settings};
use crate::mesh::{TriangleId, TriangleMesh};

fn corners(mesh: &TriangleMesh) -> Vec<[DVec3; 3]> {
    (0..mesh.triangles().len()).map(|index| mesh.corners(TriangleId(index as u32))).collect()
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

fn distance(point: DVec3, triangle: [DVec3; 3]) -> f64 {
    let upright = normal(triangle).normalize();
    let sides = [0, 1, 2].map(|i| [triangle[i], triangle[(i + 1) % 3]]);
    if sides.iter().all(|[a, b]| (b - a).cross(point - a).dot(upright) >= 0.0) {
        return (point - triangle[0]).dot(upright).abs();
    }
    let to_side = |[a, b]: [DVec3; 2]| {
        let along = ((point - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        point.distance(a.lerp(b, along))
    };
    sides.map(to_side).into_iter().fold(f64::INFINITY, f64::min)
}

fn farthest(points: impl Iterator<Item = DVec3>, mesh: &TriangleMesh) -> f64 {
    let triangles = corners(mesh);
    let nearest = |point| triangles.iter().map(|&t| distance(point, t)).fold(f64::INFINITY, f64::min);
    points.map(nearest).fold(0.0, f64::max)
}

/// Pairs of triangles that cut through each other without sharing a vertex.
fn crossings(mesh: &TriangleMesh) -> usize {
    const CELL: f64 = 0.5;
    let triangles = corners(mesh);
    let mut cells: BTreeMap<[i32; 3], Vec<usize>> = BTreeMap::new();
    for (index, &[a, b, c]) in triangles.iter().enumerate() {
        let [low, high] = [a.min(b).min(c), a.max(b).max(c)].map(|p| (p / CELL).floor().as_ivec3());
        for x in low.x..=high.x {
            for y in low.y..=high.y {
                (low.z..=high.z).for_each(|z| cells.entry([x, y, z]).or_default().push(index));
            }
        }
    }
    let apart = |i: usize, j: usize| mesh.triangles()[i].iter().all(|v| !mesh.triangles()[j].contains(v));
    let mut found = BTreeSet::new();
    for cell in cells.values() {
        for (at, &i) in cell.iter().enumerate() {
            let crossed =
                cell[at + 1..].iter().filter(|&&j| apart(i, j) && cross(triangles[i], triangles[j]));
            found.extend(crossed.map(|&j| (i, j)));
        }
    }
    found.len()
}

fn cross(one: [DVec3; 3], other: [DVec3; 3]) -> bool {
    let pierces = |a: DVec3, b: DVec3, t: [DVec3; 3]| {
        let upright = normal(t);
        let [over, under] = [a, b].map(|end| (end - t[0]).dot(upright));
        let at = a + (b - a) * (over / (over - under));
        over * under < 0.0 && (0..3).all(|i| (t[(i + 1) % 3] - t[i]).cross(at - t[i]).dot(upright) > 0.0)
    };
    (0..3).any(|i| pierces(one[i], one[(i + 1) % 3], other) || pierces(other[i], other[(i + 1) % 3], one))
}

/// How many triangles each edge has.
fn edges(mesh: &TriangleMesh) -> BTreeMap<[u32; 2], usize> {
    let mut edges = BTreeMap::new();
    for &[a, b, c] in mesh.triangles() {
        for [a, b] in [[a, b], [b, c], [c, a]] {
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    edges
}

fn heads(strength: f64) -> Vec<SculptedHead> {
    Sculptor::new(4).collection(2, &[strength])
}

#[test]
fn landmarks_and_truth_lie_on_the_surface() {
    for head in heads(1.5) {
        assert_eq!(head.landmarks.points.len(), 68);
        assert!((2000..6000).contains(&head.truth.len()));
        assert!(farthest(head.landmarks.present().map(|(_, p)| p), &head.mesh) < 0.05);
        assert!(farthest(head.truth.iter().copied().step_by(13), &head.mesh) < 0.1);
    }
}

#[test]
fn the_same_seed_makes_the_same_heads_one_by_one_or_together() {
    let sculptor = Sculptor::new(4);
    let alone: Vec<_> = (0..2).map(|index| sculptor.head(index, 1.5)).collect();
    assert!(alone == heads(1.5));
    assert!(alone[0] != Sculptor::new(5).head(0, 1.5));
}

#[test]
fn every_head_is_triangulated_its_own_way() {
    let counts: BTreeSet<_> = heads(0.0).iter().map(|head| head.mesh.triangles().len()).collect();
    assert_eq!(counts.len(), 2);
    assert!(counts.iter().all(|count| (18_000..48_000).contains(count)), "{counts:?}");
}

#[test]
fn strong_heads_neither_fold_nor_cut_through_themselves() {
    for head in heads(2.0) {
        assert_eq!(crossings(&head.mesh), 0, "{}", head.name);
        let thinnest = |[a, b, c]: [DVec3; 3]| {
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            normal([a, b, c]).length() / (longest * longest)
        };
        assert!(
            corners(&head.mesh).into_iter().map(thinnest).fold(1.0, f64::min) > 1e-3,
            "no degenerate triangle"
        );
    }
}

#[test]
fn triangles_face_the_way_the_surface_does() {
    let sculptor = Sculptor::new(4);
    let identity = Identity::random(&mut Random::new(1), 2.0);
    let head = Head { anatomy: sculptor.anatomy(), identity, expression: Expression::default() };
    let clay = Clay { head: &head, spacing: Spacing::random(&mut Random::new(2)) }.with_triangles(30_000.0);
    let skin = tessellate(&clay, DQuat::from_rotation_x(0.7));
    for triangle in &skin.triangles {
        let direction = triangle.map(|i| skin.directions[i as usize]).into_iter().sum::<DVec3>().normalize();
        let (right, up) = direction.any_orthonormal_pair();
        let slope =
            |aside: DVec3| head.point(direction + 1e-4 * aside) - head.point(direction - 1e-4 * aside);
        let surface = slope(right).cross(slope(up)) * right.cross(up).dot(direction);
        let here = normal(triangle.map(|i| skin.positions[i as usize]));
        assert!(here.dot(surface) > 0.0, "turned over at {}", head.point(direction));
    }
}

#[test]
fn the_neck_is_open_at_one_even_rim_or_closed() {
    let made = |open_neck| {
        let settings = Settings { triangles: 8000, open_neck, posed: false, expressive: false };
        Sculptor::new(4).with(settings).head(0, 0.0).mesh
    };
    assert!(edges(&made(false)).values().all(|&count| count == 2), "closed");
    let open = made(true);
    let rim: Vec<_> =
        edges(&open).into_iter().filter(|&(_, count)| count == 1).map(|(ends, _)| ends).collect();
    let ends: BTreeSet<_> = rim.iter().flatten().copied().collect();
    assert!(!rim.is_empty() && ends.len() == rim.len(), "every rim vertex has two rim edges");
    let heights = ends.iter().map(|&end| open.positions()[end as usize].y);
    assert!(heights.clone().fold(f64::INFINITY, f64::min) > -17.0);
    assert!(heights.fold(f64::NEG_INFINITY, f64::max) < -14.0);
}

#[test]
fn strength_scales_what_makes_a_head() {
    let settings = Settings { triangles: 4000, posed: false, expressive: false, ..Settings::default() };
    let sculptor = Sculptor::new(9).with(settings);
    let [mean, one, three] = [0.0, 1.0, 3.0].map(|strength| sculptor.head(2, strength).truth);
    for ((mean, one), three) in mean.iter().zip(&one).zip(&three) {
        assert!((*three - *mean).distance(3.0 * (*one - *mean)) < 1e-9);
    }
}
