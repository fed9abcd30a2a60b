use std::collections::HashMap;

use glam::Vec3A;

use super::surface_index::Hit;
use super::triangle::{Feature, closest_on_triangle};

/// Nearest points by walking over the surface from the last answer, while the distance falls.
///
/// Far cheaper than [`SurfaceIndex`](super::SurfaceIndex) and not exact: it ends in the local minimum it comes to.
/// It holds who neighbours whom; positions are passed in, so that they may move.
#[derive(Debug, Clone)]
pub struct SurfaceWalk {
    triangles: Vec<[u32; 3]>,
    /// The triangle across each edge (from corner k to the next); the triangle itself where there is none.
    across: Vec<[u32; 3]>,
    /// Where the triangles of each vertex start in `around`, and one end more.
    fans: Vec<u32>,
    /// The triangles of each vertex in turn.
    around: Vec<u32>,
}

impl SurfaceWalk {
    /// Learns the neighbours among `triangles` `[F, 3]` on `vertices` vertices.
    ///
    /// # Panics
    /// With an index out of range.
    pub fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let (fans, around) = vertex_fans(vertices, triangles);
        Self { triangles: triangles.to_vec(), across: across_edges(triangles), fans, around }
    }

    /// The nearest point to `p` that is reached from the triangle `from`; positions `[N]`.
    pub fn closest(&self, positions: &[Vec3A], p: Vec3A, from: u32) -> Hit {
        let mut best = self.closest_on(positions, p, from);
        loop {
            let here = best.triangle;
            match Feature::of(best.weights) {
                Feature::Face => return best,
                Feature::Edge(edge) => {
                    self.improve(&mut best, positions, p, self.across[here as usize][edge]);
                }
                Feature::Vertex(corner) => {
                    for &triangle in self.fan(self.triangles[here as usize][corner]) {
                        self.improve(&mut best, positions, p, triangle);
                    }
                }
            }
            if best.triangle == here {
                return best;
            }
        }
    }

    #[inline]
    fn improve(&self, best: &mut Hit, positions: &[Vec3A], p: Vec3A, triangle: u32) {
        if triangle == best.triangle {
            return;
        }
        let hit = self.closest_on(positions, p, triangle);
        if hit.distance_squared < best.distance_squared {
            *best = hit;
        }
    }

    #[inline]
    fn closest_on(&self, positions: &[Vec3A], p: Vec3A, triangle: u32) -> Hit {
        let corners = self.triangles[triangle as usize].map(|v| positions[v as usize]);
        Hit::new(triangle, closest_on_triangle(p, corners))
    }

    fn fan(&self, vertex: u32) -> &[u32] {
        let at = vertex as usize;
        &self.around[self.fans[at] as usize..self.fans[at + 1] as usize]
    }
}

fn vertex_fans(vertices: usize, triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<u32>) {
    let mut fans = vec![0; vertices + 1];
    for &vertex in triangles.iter().flatten() {
        fans[vertex as usize + 1] += 1;
    }
    for vertex in 0..vertices {
        fans[vertex + 1] += fans[vertex];
    }
    let mut around = vec![0; 3 * triangles.len()];
    let mut next = fans.clone();
    for (triangle, corners) in triangles.iter().enumerate() {
        for &vertex in corners {
            around[next[vertex as usize] as usize] = triangle as u32;
            next[vertex as usize] += 1;
        }
    }
    (fans, around)
}

/// Pairs the triangles at each edge in the order they come, whatever their orientation.
fn across_edges(triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut across: Vec<[u32; 3]> = (0..triangles.len() as u32).map(|t| [t; 3]).collect();
    let mut open: HashMap<[u32; 2], (usize, usize)> = HashMap::with_capacity(2 * triangles.len());
    for (triangle, corners) in triangles.iter().enumerate() {
        for edge in 0..3 {
            let (a, b) = (corners[edge], corners[(edge + 1) % 3]);
            let key = [a.min(b), a.max(b)];
            if let Some((other, other_edge)) = open.remove(&key) {
                across[triangle][edge] = other as u32;
                across[other][other_edge] = triangle as u32;
            } else {
                open.insert(key, (triangle, edge));
            }
        }
    }
    across
}
