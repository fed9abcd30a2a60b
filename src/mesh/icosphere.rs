use std::collections::HashMap;

use glam::{DVec3, Vec3A};

use super::Topology;

/// A geodesic sphere: an icosahedron whose triangles are quartered `level` times, on the unit sphere.
///
/// Level k has 10 * 4^k + 2 vertices: 642, 2562, 10242, 40962 at 3, 4, 5, 6. The numbering is nested: the vertices of
/// a level are the first ones of the next, followed by one vertex for each of its edges.
#[derive(Debug, Clone)]
pub struct Icosphere {
    /// Vertex positions `[N, 3]` of length one.
    pub positions: Vec<DVec3>,
    /// Triangles `[F, 3]`, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Icosphere {
    /// The sphere of a level.
    pub fn new(level: u32) -> Self {
        let mut sphere = icosahedron();
        for _ in 0..level {
            let midpoints = Midpoints::of(sphere.positions.len(), &sphere.triangles);
            sphere.positions = midpoints.interpolate(&sphere.positions, |a, b| (a + b).normalize());
            sphere.triangles = midpoints.triangles;
        }
        sphere
    }

    /// The level with exactly `vertices` vertices, if there is one up to 163842.
    pub fn level_of(vertices: usize) -> Option<u32> {
        (0..8).find(|&level| 10 * 4usize.pow(level) + 2 == vertices)
    }
}

/// One step of midpoint subdivision: each triangle becomes four, each edge a new vertex.
#[derive(Debug, Clone)]
pub struct Midpoints {
    /// The two old vertices between which each new one lies.
    pub parents: Vec<[u32; 2]>,
    /// The new triangles; old vertices keep their index.
    pub triangles: Vec<[u32; 3]>,
}

impl Midpoints {
    /// Subdivides triangles over `vertices` vertices.
    pub fn of(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let edges = Topology::new(vertices, triangles).edges;
        let index: HashMap<[u32; 2], u32> =
            edges.iter().enumerate().map(|(i, &e)| (e, (vertices + i) as u32)).collect();
        let middle = |a: u32, b: u32| index[&[a.min(b), a.max(b)]];
        let mut finer = Vec::with_capacity(4 * triangles.len());
        for &[a, b, c] in triangles {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        Self { parents: edges, triangles: finer }
    }

    /// Carries one value per old vertex to the new ones: old values first, then `between` for each edge.
    pub fn interpolate<T: Copy>(&self, values: &[T], between: impl Fn(T, T) -> T) -> Vec<T> {
        let mut finer = values.to_vec();
        finer.extend(self.parents.iter().map(|&[a, b]| between(values[a as usize], values[b as usize])));
        finer
    }

    /// Carries positions `[N, 3]` to the finer mesh, new ones in the middle of their edges.
    pub fn subdivide(&self, positions: &[Vec3A]) -> Vec<Vec3A> {
        self.interpolate(positions, |a, b| 0.5 * (a + b))
    }
}

fn icosahedron() -> Icosphere {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let mut positions = Vec::with_capacity(12);
    for (one, phi) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        positions.push(DVec3::new(one, phi, 0.0).normalize());
        positions.push(DVec3::new(0.0, one, phi).normalize());
        positions.push(DVec3::new(phi, 0.0, one).normalize());
    }
    Icosphere { triangles: triangles_of_icosahedron(&positions), positions }
}

/// Every three mutually nearest vertices, turned outwards.
fn triangles_of_icosahedron(positions: &[DVec3]) -> Vec<[u32; 3]> {
    let near = |a: usize, b: usize| positions[a].dot(positions[b]) > 0.4;
    let mut triangles = Vec::with_capacity(20);
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = positions[a].cross(positions[b]).dot(positions[c]) > 0.0;
                    let (b, c) = if outward { (b, c) } else { (c, b) };
                    triangles.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_orientation() {
        for level in 0..5 {
            let sphere = Icosphere::new(level);
            assert_eq!(sphere.positions.len(), 10 * 4usize.pow(level) + 2);
            assert_eq!(sphere.triangles.len(), 20 * 4usize.pow(level));
            assert_eq!(Icosphere::level_of(sphere.positions.len()), Some(level));
            for corners in &sphere.triangles {
                let [a, b, c] = corners.map(|i| sphere.positions[i as usize]);
                assert!((b - a).cross(c - a).dot(a + b + c) > 0.0);
            }
        }
    }

    #[test]
    fn levels_are_nested() {
        let (coarse, fine) = (Icosphere::new(2), Icosphere::new(3));
        assert_eq!(coarse.positions[..], fine.positions[..coarse.positions.len()]);
    }
}
