use glam::Vec3A;

/// Squared sine of the corner angle below which a triangle has no usable plane and only its edges count.
pub(super) const DEGENERATE: f32 = 1e-12;
/// Smallest squared length that is divided by: under it, products of its kind leave the range of f32.
pub(super) const TINY: f32 = 1e-36;

/// The nearest point of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrianglePoint {
    /// Barycentric weights of the corners: none negative, sum 1, exactly 0 away from the edge or vertex hit.
    pub weights: [f32; 3],
    /// The point itself.
    pub point: Vec3A,
    /// Its squared distance from the query.
    pub distance_squared: f32,
}

/// The point of the triangle `corners` nearest to `p`; on a degenerate triangle, of its edges.
///
/// Projects with cross products where Ericson (Real-Time Collision Detection, 5.1.5) subtracts products of dot
/// products: those lose all digits in f32 when `p` is many edge lengths away.
#[inline]
pub fn closest_on_triangle(p: Vec3A, corners: [Vec3A; 3]) -> TrianglePoint {
    let [a, b, c] = corners;
    let (first, second, to_p) = (b - a, c - a, p - a);
    let normal = first.cross(second);
    let area = normal.length_squared();
    if area <= DEGENERATE * first.length_squared() * second.length_squared() || area < TINY {
        return nearest_edge(p, corners, [true; 3]);
    }
    let turned = normal.cross(to_p) / area;
    let (v, w) = (second.dot(turned), -first.dot(turned));
    let u = 1.0 - v - w;
    if u < 0.0 || v < 0.0 || w < 0.0 {
        // The nearest point lies on an edge that the projection is beyond.
        return nearest_edge(p, corners, [w < 0.0, u < 0.0, v < 0.0]);
    }
    let offset = first * v + second * w;
    TrianglePoint {
        weights: [u, v, w],
        point: a + offset,
        distance_squared: (to_p - offset).length_squared(),
    }
}

/// The nearest point on those edges (from corner k to the next) that are to be tried.
fn nearest_edge(p: Vec3A, corners: [Vec3A; 3], tried: [bool; 3]) -> TrianglePoint {
    let mut best =
        TrianglePoint { weights: [1.0, 0.0, 0.0], point: corners[0], distance_squared: f32::INFINITY };
    for (from, to) in [(0, 1), (1, 2), (2, 0)] {
        if !tried[from] {
            continue;
        }
        let (edge, to_p) = (corners[to] - corners[from], p - corners[from]);
        let length = edge.length_squared();
        let t = if length > TINY { (to_p.dot(edge) / length).clamp(0.0, 1.0) } else { 0.0 };
        let distance_squared = (to_p - edge * t).length_squared();
        if distance_squared < best.distance_squared {
            let mut weights = [0.0; 3];
            (weights[from], weights[to]) = (1.0 - t, t);
            best = TrianglePoint { weights, point: corners[from] + edge * t, distance_squared };
        }
    }
    best
}
