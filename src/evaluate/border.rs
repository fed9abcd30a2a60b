use std::collections::HashMap;

use crate::spatial::{Feature, Hit};

/// The rim of an open surface and the edges of its holes: edges that only one triangle has.
pub(super) struct Border<'a> {
    triangles: &'a [[u32; 3]],
    /// Whether each edge of a triangle (from corner k to the next) lies on it.
    edges: Vec<[bool; 3]>,
    /// Whether each vertex lies on it.
    vertices: Vec<bool>,
}

impl<'a> Border<'a> {
    /// Finds the border of `triangles` `[F, 3]` on `vertices` vertices.
    pub fn of(vertices: usize, triangles: &'a [[u32; 3]]) -> Self {
        let mut uses: HashMap<[u32; 2], u32> = HashMap::with_capacity(2 * triangles.len());
        for key in triangles.iter().flat_map(edge_keys) {
            *uses.entry(key).or_default() += 1;
        }
        let edges: Vec<[bool; 3]> =
            triangles.iter().map(|t| edge_keys(t).map(|key| uses[&key] == 1)).collect();
        let mut on_border = vec![false; vertices];
        for (corners, single) in triangles.iter().zip(&edges) {
            for k in (0..3).filter(|&k| single[k]) {
                on_border[corners[k] as usize] = true;
                on_border[corners[(k + 1) % 3] as usize] = true;
            }
        }
        Self { triangles, edges, vertices: on_border }
    }

    /// Whether a nearest point lies on the border.
    pub fn holds(&self, hit: &Hit) -> bool {
        let triangle = hit.triangle as usize;
        match Feature::of(hit.weights) {
            Feature::Face => false,
            Feature::Edge(k) => self.edges[triangle][k],
            Feature::Vertex(k) => self.vertices[self.triangles[triangle][k] as usize],
        }
    }
}

fn edge_keys(&[a, b, c]: &[u32; 3]) -> [[u32; 2]; 3] {
    [(a, b), (b, c), (c, a)].map(|(a, b)| [a.min(b), a.max(b)])
}
