use super::{MeshError, TriangleMesh};

/// A list of lists in two flat arrays: list `i` is `items[starts[i]..starts[i + 1]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows<T> {
    starts: Vec<u32>,
    items: Vec<T>,
}

impl<T: Copy> Rows<T> {
    /// Collects `(row, item)` pairs into `rows` lists; within a row the pairs' order is kept.
    pub fn from_pairs(rows: usize, pairs: impl Iterator<Item = (u32, T)> + Clone) -> Self {
        let mut starts = vec![0u32; rows + 1];
        for (row, _) in pairs.clone() {
            starts[row as usize + 1] += 1;
        }
        for row in 0..rows {
            starts[row + 1] += starts[row];
        }
        let Some((_, filler)) = pairs.clone().next() else {
            return Self { starts, items: Vec::new() };
        };
        let mut items = vec![filler; starts[rows] as usize];
        let mut next = starts.clone();
        for (row, item) in pairs {
            items[next[row as usize] as usize] = item;
            next[row as usize] += 1;
        }
        Self { starts, items }
    }

    /// The items of list `row`.
    #[inline]
    pub fn row(&self, row: usize) -> &[T] {
        &self.items[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    fn row_mut(&mut self, row: usize) -> &mut [T] {
        &mut self.items[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    /// Number of lists.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Whether there is no list at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// What stays fixed while a template deforms: triangles, edges, one-rings and fans.
#[derive(Debug, Clone)]
pub struct Topology {
    /// Vertex indices of each triangle `[F, 3]`.
    pub triangles: Vec<[u32; 3]>,
    /// Each undirected edge once, smaller vertex first, sorted `[E, 2]`.
    pub edges: Vec<[u32; 2]>,
    /// The triangles on both sides of each edge `[E, 2]`; on a rim both entries are the one triangle.
    pub edge_triangles: Vec<[u32; 2]>,
    /// Neighbours of each vertex, ascending.
    pub neighbours: Rows<u32>,
    /// For each vertex its fan: a triangle, and that triangle's next and previous vertex seen from this one.
    pub fans: Rows<[u32; 3]>,
    /// Whether each vertex lies on a rim: on an edge with one triangle only.
    pub on_rim: Vec<bool>,
}

impl Topology {
    /// The topology of `vertices` vertices under `triangles`; isolated vertices have empty rows.
    pub fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let (edges, edge_triangles) = edges_of(vertices, triangles);
        let mut on_rim = vec![false; vertices];
        for (edge, _) in rim_edges(&edges, &edge_triangles) {
            edge.iter().for_each(|&i| on_rim[i as usize] = true);
        }
        // Edges are sorted: with smaller neighbours before larger ones, rows come out ascending.
        let smaller = edges.iter().map(|&[a, b]| (b, a));
        let larger = edges.iter().map(|&[a, b]| (a, b));
        let neighbours = Rows::from_pairs(vertices, smaller.chain(larger));
        let corners =
            (0..).zip(triangles).flat_map(|(t, &[a, b, c])| [(a, [t, b, c]), (b, [t, c, a]), (c, [t, a, b])]);
        let fans = Rows::from_pairs(vertices, corners);
        Self { triangles: triangles.to_vec(), edges, edge_triangles, neighbours, fans, on_rim }
    }

    /// The topology of a mesh.
    pub fn of(mesh: &TriangleMesh) -> Self {
        Self::new(mesh.positions().len(), mesh.triangles())
    }

    /// Number of vertices N.
    pub fn vertex_count(&self) -> usize {
        self.neighbours.len()
    }

    /// The edges with one triangle, each with that triangle.
    pub fn rim_edges(&self) -> impl Iterator<Item = ([u32; 2], u32)> {
        rim_edges(&self.edges, &self.edge_triangles)
    }

    /// The mesh of these triangles on positions `[N, 3]`.
    ///
    /// # Errors
    /// As [`TriangleMesh::new`].
    pub fn mesh(&self, positions: Vec<glam::DVec3>) -> Result<TriangleMesh, MeshError> {
        TriangleMesh::new(positions, self.triangles.clone())
    }
}

fn rim_edges(edges: &[[u32; 2]], edge_triangles: &[[u32; 2]]) -> impl Iterator<Item = ([u32; 2], u32)> {
    let on_rim = edges.iter().zip(edge_triangles).filter(|(_, [left, right])| left == right);
    on_rim.map(|(&edge, &[triangle, _])| (edge, triangle))
}

/// Undirected edges, sorted, with the first and last triangle at each.
fn edges_of(vertices: usize, triangles: &[[u32; 3]]) -> (Vec<[u32; 2]>, Vec<[u32; 2]>) {
    let sides = (0..).zip(triangles).flat_map(|(t, &[a, b, c])| {
        [(a, b), (b, c), (c, a)].map(|(a, b): (u32, u32)| (a.min(b), [a.max(b), t]))
    });
    // By the smaller vertex first: many small sorts take a fraction of a large one.
    let mut sides = Rows::from_pairs(vertices, sides.filter(|&(smaller, [larger, _])| smaller != larger));
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(sides.items.len() / 2);
    let mut edge_triangles: Vec<[u32; 2]> = Vec::with_capacity(sides.items.len() / 2);
    for smaller in 0..vertices {
        let row = sides.row_mut(smaller);
        row.sort_unstable();
        for &[larger, triangle] in &*row {
            let edge = [smaller as u32, larger];
            match edge_triangles.last_mut() {
                Some(last) if edges.last() == Some(&edge) => last[1] = triangle,
                _ => {
                    edges.push(edge);
                    edge_triangles.push([triangle; 2]);
                }
            }
        }
    }
    (edges, edge_triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_of_two_triangles() {
        let topology = Topology::new(5, &[[0, 1, 2], [0, 2, 3]]);
        assert_eq!(topology.edges, [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]);
        assert_eq!(topology.edge_triangles, [[0, 0], [0, 1], [1, 1], [0, 0], [1, 1]]);
        assert_eq!(topology.neighbours.row(0), [1, 2, 3]);
        assert_eq!(topology.neighbours.row(4), [] as [u32; 0]);
        assert_eq!(topology.fans.row(2), [[0, 0, 1], [1, 3, 0]]);
        assert_eq!(topology.on_rim, [true, true, true, true, false]);
    }
}
