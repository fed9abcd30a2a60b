//! Whether two triangles meet, decided by the exact signs of determinants (Shewchuk 1997) alone.

use glam::DVec3;
use robust::{Coord, Coord3D, orient2d, orient3d};

type Triangle = [DVec3; 3];

/// Whether the corners span a plane.
pub(super) fn has_area(triangle: Triangle) -> bool {
    flattening(triangle).is_some()
}

/// Whether two triangles have a point in common beside the corner or the edge that they share. Both have an area.
pub(super) fn intersect(one: Triangle, other: Triangle) -> bool {
    let place = |corner: DVec3| other.iter().position(|&o| o == corner);
    match one.map(place) {
        [None, None, None] => meet(one, other),
        [Some(_), Some(_), Some(_)] => true,
        [Some(at), None, None] => meet_beyond(one, 0, other, at),
        [None, Some(at), None] => meet_beyond(one, 1, other, at),
        [None, None, Some(at)] => meet_beyond(one, 2, other, at),
        [None, Some(b), Some(c)] => folded(one, 0, other[3 - b - c]),
        [Some(a), None, Some(c)] => folded(one, 1, other[3 - a - c]),
        [Some(a), Some(b), None] => folded(one, 2, other[3 - a - b]),
    }
}

fn meet(one: Triangle, other: Triangle) -> bool {
    // What two triangles share is convex and has an extreme point, which lies on an edge of one of them.
    let sides = |of: Triangle, plane: Triangle| of.map(|p| side(plane, p));
    let (ones, others) = (sides(one, other), sides(other, one));
    let apart = |sides: [f64; 3]| sides.iter().all(|&s| s > 0.0) || sides.iter().all(|&s| s < 0.0);
    if apart(ones) || apart(others) {
        return false;
    }
    let edges = |of: Triangle, sides: [f64; 3], to: Triangle| {
        (0..3).any(|k| {
            let next = (k + 1) % 3;
            edge_meets([of[k], of[next]], [sides[k], sides[next]], to)
        })
    };
    edges(one, ones, other) || edges(other, others, one)
}

/// Whether triangles that share the corner number `at` of one and `on` of the other meet elsewhere too: then one's edge
/// opposite that corner meets the other.
fn meet_beyond(one: Triangle, at: usize, other: Triangle, on: usize) -> bool {
    let opposite = |of: Triangle, at: usize| [of[(at + 1) % 3], of[(at + 2) % 3]];
    let meets = |edge: [DVec3; 2], triangle| edge_meets(edge, edge.map(|p| side(triangle, p)), triangle);
    meets(opposite(one, at), other) || meets(opposite(other, on), one)
}

/// Whether a triangle and another on its edge opposite the corner `at` lie on each other; `apex` is the other's third
/// corner.
fn folded(triangle: Triangle, at: usize, apex: DVec3) -> bool {
    let axis = flattening(triangle).filter(|_| side(triangle, apex) == 0.0);
    axis.is_some_and(|axis| {
        let [a, b, own, other] =
            [triangle[(at + 1) % 3], triangle[(at + 2) % 3], triangle[at], apex].map(|p| flat(p, axis));
        (orient2d(a, b, own) > 0.0) == (orient2d(a, b, other) > 0.0)
    })
}

/// Whether an edge, whose ends lie on these `sides` of the triangle's plane, meets the triangle.
fn edge_meets([p, q]: [DVec3; 2], sides: [f64; 2], triangle: Triangle) -> bool {
    if sides == [0.0; 2] {
        return flat_edge_meets([p, q], triangle);
    }
    if (sides[0] > 0.0 && sides[1] > 0.0) || (sides[0] < 0.0 && sides[1] < 0.0) {
        return false;
    }
    let around = |k: usize| orient3d(exact(p), exact(q), exact(triangle[k]), exact(triangle[(k + 1) % 3]));
    let turns = [around(0), around(1), around(2)];
    turns.iter().all(|&t| t >= 0.0) || turns.iter().all(|&t| t <= 0.0)
}

/// Whether an edge in a triangle's plane meets it.
fn flat_edge_meets(edge: [DVec3; 2], triangle: Triangle) -> bool {
    let Some(axis) = flattening(triangle) else {
        return false;
    };
    let [p, q] = edge.map(|p| flat(p, axis));
    let corners = triangle.map(|p| flat(p, axis));
    let inside = |p: Coord<f64>| {
        let turns = [0, 1, 2].map(|k| orient2d(corners[k], corners[(k + 1) % 3], p));
        turns.iter().all(|&t| t >= 0.0) || turns.iter().all(|&t| t <= 0.0)
    };
    inside(p) || inside(q) || (0..3).any(|k| segments_meet([p, q], [corners[k], corners[(k + 1) % 3]]))
}

/// Whether two segments cross. That an end of the first lies on the second is found by the caller; the other way round,
/// here.
fn segments_meet([p, q]: [Coord<f64>; 2], [a, b]: [Coord<f64>; 2]) -> bool {
    let straddle = |s: f64, t: f64| (s >= 0.0 && t <= 0.0) || (s <= 0.0 && t >= 0.0);
    let (to_a, to_b) = (orient2d(p, q, a), orient2d(p, q, b));
    // On one line, they meet if an end of one lies on the other; the triangle's other edges see that.
    let aligned = to_a == 0.0 && to_b == 0.0;
    !aligned && straddle(to_a, to_b) && straddle(orient2d(a, b, p), orient2d(a, b, q))
}

/// An axis along which the triangle can be flattened and keeps an area.
fn flattening(triangle: Triangle) -> Option<usize> {
    (0..3).find(|&axis| {
        let [a, b, c] = triangle.map(|p| flat(p, axis));
        orient2d(a, b, c) != 0.0
    })
}

fn flat(p: DVec3, axis: usize) -> Coord<f64> {
    Coord { x: p[(axis + 1) % 3], y: p[(axis + 2) % 3] }
}

fn exact(p: DVec3) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}

/// Positive, negative or zero, as `p` lies on one side of the plane, on the other or in it.
fn side([a, b, c]: Triangle, p: DVec3) -> f64 {
    orient3d(exact(a), exact(b), exact(c), exact(p))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::Random;

    fn triangle(corners: [[f64; 3]; 3]) -> Triangle {
        corners.map(DVec3::from_array)
    }

    const BASE: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    fn meets_base(other: [[f64; 3]; 3]) -> bool {
        let (one, other) = (triangle(BASE), triangle(other));
        let turn = |t: Triangle| [t[1], t[2], t[0]];
        let answers = [
            intersect(one, other),
            intersect(other, one),
            intersect(turn(one), other),
            intersect(one, turn(other)),
            intersect(one, [other[0], other[2], other[1]]),
        ];
        assert_eq!(answers, [answers[0]; 5], "the order of corners counts");
        answers[0]
    }

    #[test]
    fn triangles_apart() {
        assert!(meets_base([[1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [2.0, 9.0, 1.0]]), "pierces");
        assert!(!meets_base([[5.0, 5.0, -1.0], [5.0, 5.0, 1.0], [9.0, 9.0, 0.0]]), "passes by");
        assert!(!meets_base([[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 4.0, 1.0]]), "is parallel");
        assert!(!meets_base([[1.0, 1.0, 1e-300], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]]), "stands just above");
        assert!(meets_base([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]]), "touches with a corner");
        assert!(meets_base([[2.0, 2.0, -1.0], [2.0, 2.0, 1.0], [9.0, 9.0, 0.0]]), "touches an edge");
    }

    #[test]
    fn triangles_of_one_plane() {
        assert!(meets_base([[1.0, 1.0, 0.0], [1.5, 1.0, 0.0], [1.0, 1.5, 0.0]]), "lies inside");
        assert!(meets_base([[-9.0, -9.0, 0.0], [30.0, -9.0, 0.0], [-9.0, 30.0, 0.0]]), "lies around");
        assert!(meets_base([[-1.0, 1.0, 0.0], [9.0, 1.0, 0.0], [9.0, 1.5, 0.0]]), "crosses");
        assert!(meets_base([[1.0, 0.0, 0.0], [9.0, 0.0, 0.0], [9.0, -2.0, 0.0]]), "shares a line");
        assert!(meets_base([[2.0, -2.0, 0.0], [2.0, 0.0, 0.0], [3.0, -2.0, 0.0]]), "touches");
        assert!(!meets_base([[3.0, 3.0, 0.0], [9.0, 3.0, 0.0], [3.0, 9.0, 0.0]]), "lies beside");
    }

    #[test]
    fn neighbours_at_a_corner() {
        assert!(!meets_base([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 1.0, 1.0]]), "leaves");
        assert!(!meets_base([[0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), "lies opposite");
        assert!(meets_base([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [2.0, 1.0, -1.0]]), "pierces");
        assert!(meets_base([[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [2.0, 1.0, 1.0]]), "lies on it with an edge");
        assert!(meets_base([[0.0, 0.0, 0.0], [9.0, 1.0, 0.0], [9.0, 2.0, 0.0]]), "overlaps flat");
        assert!(meets_base([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [9.0, -2.0, 0.0]]), "shares a line");
    }

    #[test]
    fn neighbours_at_an_edge() {
        let apex = |apex| meets_base([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], apex]);
        assert!(!apex([1.0, -3.0, 0.0]), "is flat");
        assert!(!apex([1.0, 3.0, 1e-300]), "is nearly folded");
        assert!(apex([1.0, 3.0, 0.0]), "is folded");
        assert!(meets_base(BASE), "is the same");
    }

    /// Meshes of small whole numbers, where i128 arithmetic is exact, against a search that is written otherwise: a point
    /// of both triangles found by clipping one against the other in fractions.
    #[test]
    fn agrees_with_clipping_in_whole_numbers() {
        let mut random = Random::new(11);
        let mut met = 0;
        for _ in 0..20_000 {
            let mut corner = || DVec3::from_array([0; 3].map(|_| random.below(5) as f64));
            let (one, other) = ([corner(), corner(), corner()], [corner(), corner(), corner()]);
            let shares = one.iter().any(|p| other.contains(p));
            if shares || !has_area(one) || !has_area(other) {
                continue;
            }
            assert_eq!(intersect(one, other), clipped(one, other), "{one:?} {other:?}");
            met += usize::from(clipped(one, other));
        }
        assert!(met > 1000);
    }

    /// Whether anything of `one` is left when it is clipped to the prism over `other`, within its plane.
    fn clipped(one: Triangle, other: Triangle) -> bool {
        let normal = (other[1] - other[0]).cross(other[2] - other[0]);
        let mut left: Vec<DVec3> = one.to_vec();
        let mut clip = |towards: DVec3, from: DVec3| {
            let heights: Vec<f64> = left.iter().map(|p| (*p - from).dot(towards)).collect();
            let mut kept = Vec::new();
            for (k, (&p, &height)) in left.iter().zip(&heights).enumerate() {
                let next = (k + 1) % left.len();
                let tolerance = 1e-9;
                if height >= -tolerance {
                    kept.push(p);
                }
                if (height < -tolerance && heights[next] > tolerance)
                    || (height > tolerance && heights[next] < -tolerance)
                {
                    kept.push(p.lerp(left[next], height / (height - heights[next])));
                }
            }
            left = kept;
        };
        clip(normal, other[0]);
        clip(-normal, other[0]);
        for k in 0..3 {
            clip(normal.cross(other[(k + 1) % 3] - other[k]), other[k]);
        }
        !left.is_empty()
    }
}
