use super::MeshLayout;
use crate::mesh::{Rows, Topology};

/// Instead of a second triangle's corner, on an edge with one triangle.
pub(super) const RIM: u32 = u32::MAX;

/// What the passes need to know of a mesh's triangles.
#[derive(Debug, Clone)]
pub(super) struct Connectivity {
    /// Vertex indices of each triangle `[F, 3]`.
    pub triangles: Vec<[u32; 3]>,
    /// For each edge its two ends, and the third corners of its two triangles, or [`RIM`] `[E, 4]`.
    pub edges: Vec<[u32; 4]>,
    /// For each vertex the corners at it: three times the triangle, plus which of its corners.
    pub corners: Rows<u32>,
    /// For each vertex the ends at it: two times the edge, plus which of its ends.
    pub ends: Rows<u32>,
    /// Number of vertices N.
    pub vertices: usize,
    /// Whether back faces are left out.
    pub closed: bool,
}

impl Connectivity {
    pub fn new(layout: MeshLayout<'_>) -> Self {
        let MeshLayout { triangles, vertices, closed } = layout;
        let topology = Topology::new(vertices, triangles);
        let third = |triangle: u32, [a, b]: [u32; 2]| {
            let corners = triangles[triangle as usize];
            corners.into_iter().find(|&corner| corner != a && corner != b).unwrap_or(a)
        };
        let edges = (topology.edges.iter().zip(&topology.edge_triangles))
            .map(|(&[a, b], &[one, other])| {
                let second = if one == other { RIM } else { third(other, [a, b]) };
                [a, b, third(one, [a, b]), second]
            })
            .collect::<Vec<_>>();
        let corners = rows(vertices, triangles);
        let ends = rows(vertices, &topology.edges);
        Self { triangles: topology.triangles, edges, corners, ends, vertices, closed }
    }
}

/// For each vertex the places at which it stands in a flattened list.
fn rows<const K: usize>(vertices: usize, list: &[[u32; K]]) -> Rows<u32> {
    let pairs: Vec<(u32, u32)> = list.as_flattened().iter().copied().zip(0..).collect();
    Rows::from_pairs(vertices, pairs.iter().copied())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_of_two_triangles() {
        let triangles = [[0, 1, 2], [0, 2, 3]];
        let layout = MeshLayout { triangles: &triangles, vertices: 4, closed: false };
        let connectivity = Connectivity::new(layout);
        assert_eq!(
            connectivity.edges,
            [[0, 1, 2, RIM], [0, 2, 1, 3], [0, 3, 2, RIM], [1, 2, 0, RIM], [2, 3, 0, RIM]]
        );
        assert_eq!(connectivity.corners.row(2), [2, 4]);
        assert_eq!(connectivity.ends.row(3), [5, 9]);
    }
}
