use crate::mesh::{Points, TriangleMesh};

/// A triangle lower than this share of its longest side has no area to speak of.
const FLAT: f64 = 1e-6;

/// How many triangles name a vertex twice or are flat.
pub(super) fn degenerate(mesh: &TriangleMesh<impl Points>) -> usize {
    let is_flat = |corners: &&[u32; 3]| {
        let [a, b, c] = corners.map(|i| mesh.position(i));
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        (b - a).cross(c - a).length() <= FLAT * longest
    };
    mesh.triangles().iter().filter(is_flat).count()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn bad_triangles_are_counted() {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, 2.0 * DVec3::X, DVec3::new(1.0, 1e-9, 0.0)];
        let triangles = vec![[0, 1, 2], [0, 1, 1], [0, 1, 3], [0, 3, 4], [2, 3, 1]];
        let mesh = TriangleMesh::new(positions, triangles).unwrap();
        assert_eq!(degenerate(&mesh), 3);
    }
}
