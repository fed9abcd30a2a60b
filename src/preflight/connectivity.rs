use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::mesh::{TriangleMesh, components};

/// How a surface's triangles hang together.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Connectivity {
    /// Parts that share no vertex, largest area first.
    pub components: Vec<Component>,
    /// Rims, longest first.
    pub loops: Vec<BoundaryLoop>,
    /// Edges of three and more triangles.
    pub non_manifold_edges: usize,
    /// Vertices whose triangles are not one fan.
    pub non_manifold_vertices: usize,
    /// Edges whose two triangles run along them in the same direction.
    pub opposed_edges: usize,
    /// Vertices of no triangle.
    pub unreferenced_vertices: usize,
    /// Six times the volume that the largest part encloses, its rims closed by fans; negative inside out.
    pub largest_volume: f64,
}

/// A part of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Component {
    /// Its triangles.
    pub triangles: usize,
    /// Its vertices.
    pub vertices: usize,
    /// Its area, in square scan units.
    pub area: f64,
}

/// A rim of a surface: a closed chain of edges of one triangle only.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BoundaryLoop {
    /// Its vertices.
    pub vertices: usize,
    /// Its length, in scan units.
    pub length: f64,
    /// The mean of its vertices.
    pub centre: [f64; 3],
}

/// A triangle's side: the edge, smaller vertex first, and the triangle with the corner that the side starts from.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    edge: u64,
    corner: u32,
}

impl Connectivity {
    /// Of a mesh; sides of triangles that name a vertex twice are left out.
    pub fn of(mesh: &TriangleMesh) -> Self {
        let triangles = mesh.triangles();
        let sides = sorted_sides(triangles);
        let mut found = Self::default();
        let mut corners = Sets::new(3 * triangles.len());
        let mut rim = Vec::new();
        for group in sides.chunk_by(|one, next| one.edge == next.edge) {
            match group {
                [one] => rim.push(ends(triangles, one)),
                [one, other] => found.join_fans(triangles, &mut corners, [one, other]),
                _ => found.non_manifold_edges += 1,
            }
        }
        found.count_vertices(triangles, &mut corners, mesh.positions().len());
        let part_of = components(mesh.positions().len(), triangles);
        let largest = found.add_components(mesh, &part_of);
        found.add_loops(mesh, &rim, |v| part_of[v as usize] == largest);
        found
    }

    /// Joins the corners of two triangles at both ends of the edge that they share.
    fn join_fans(&mut self, triangles: &[[u32; 3]], corners: &mut Sets, [one, other]: [&Side; 2]) {
        let [mut from, mut to] = [other.corner, next(other.corner)];
        if ends(triangles, one) == ends(triangles, other) {
            self.opposed_edges += 1;
        } else {
            std::mem::swap(&mut from, &mut to);
        }
        corners.join(one.corner, from);
        corners.join(next(one.corner), to);
    }

    fn count_vertices(&mut self, triangles: &[[u32; 3]], corners: &mut Sets, vertices: usize) {
        // A vertex has as many fans as its corners have sets.
        let mut fans = vec![0_u32; vertices];
        for corner in 0..3 * triangles.len() as u32 {
            let vertex = triangles[corner as usize / 3][corner as usize % 3] as usize;
            if corners.of(corner) == corner {
                fans[vertex] += 1;
            }
        }
        self.non_manifold_vertices = fans.iter().filter(|&&count| count > 1).count();
        self.unreferenced_vertices = fans.iter().filter(|&&count| count == 0).count();
    }

    /// Collects the parts, and the largest part's volume without its rims' fans; returns the largest part.
    fn add_components(&mut self, mesh: &TriangleMesh, part_of: &[u32]) -> u32 {
        let none = Component { triangles: 0, vertices: 0, area: 0.0 };
        let mut parts = vec![none; part_of.len()];
        let mut volumes = vec![0.0; part_of.len()];
        let origin = mesh.centroid();
        for corners in mesh.triangles() {
            let part = part_of[corners[0] as usize] as usize;
            let [a, b, c] = corners.map(|i| mesh.positions()[i as usize] - origin);
            parts[part].triangles += 1;
            parts[part].area += (b - a).cross(c - a).length() / 2.0;
            volumes[part] += a.dot(b.cross(c));
        }
        part_of.iter().for_each(|&part| parts[part as usize].vertices += 1);
        let there = |at: &usize| parts[*at].triangles > 0;
        let area = |at: usize| parts[at].area;
        let largest = (0..parts.len()).filter(there).reduce(|a, b| if area(b) > area(a) { b } else { a });
        let largest = largest.unwrap_or(0);
        self.largest_volume = volumes[largest];
        self.components = parts.into_iter().filter(|part| part.triangles > 0).collect();
        self.components.sort_by(|a, b| b.area.total_cmp(&a.area));
        largest as u32
    }

    /// Chains rim edges to loops, and closes those of the largest part for its volume.
    fn add_loops(&mut self, mesh: &TriangleMesh, rim: &[[u32; 2]], in_largest: impl Fn(u32) -> bool) {
        let place = |v: u32| mesh.positions()[v as usize];
        let origin = mesh.centroid();
        for edges in chains(rim) {
            let count = edges.len() as f64;
            let centre = edges.iter().map(|&[from, _]| place(from)).sum::<DVec3>() / count;
            let length = edges.iter().map(|&[from, to]| place(from).distance(place(to))).sum();
            self.loops.push(BoundaryLoop { vertices: edges.len(), length, centre: centre.to_array() });
            if in_largest(edges[0][0]) {
                let fan = |&[from, to]: &[u32; 2]| {
                    (place(to) - origin).dot((place(from) - origin).cross(centre - origin))
                };
                self.largest_volume += edges.iter().map(fan).sum::<f64>();
            }
        }
        self.loops.sort_by(|a, b| b.length.total_cmp(&a.length));
    }
}

fn sorted_sides(triangles: &[[u32; 3]]) -> Vec<Side> {
    let mut sides: Vec<Side> = (0..3 * triangles.len() as u32)
        .filter_map(|corner| {
            let own = &triangles[corner as usize / 3];
            let whole = own[0] != own[1] && own[1] != own[2] && own[2] != own[0];
            let (from, to) = (own[corner as usize % 3], own[(corner as usize + 1) % 3]);
            let edge = (u64::from(from.min(to)) << 32) | u64::from(from.max(to));
            whole.then_some(Side { edge, corner })
        })
        .collect();
    sides.par_sort_unstable();
    sides
}

/// The corner after one in its triangle.
fn next(corner: u32) -> u32 {
    corner - corner % 3 + (corner + 1) % 3
}

/// The vertices from which and to which a side runs.
fn ends(triangles: &[[u32; 3]], side: &Side) -> [u32; 2] {
    [side.corner, next(side.corner)].map(|corner| triangles[corner as usize / 3][corner as usize % 3])
}

/// Directed edges `[E, 2]`, chained end to end as far as they go; against their direction only where there is no other
/// way on.
fn chains(edges: &[[u32; 2]]) -> Vec<Vec<[u32; 2]>> {
    // The edges at each vertex, those that leave it first.
    let mut ends: Vec<(u32, bool, usize)> = Vec::with_capacity(2 * edges.len());
    for (at, &[from, to]) in edges.iter().enumerate() {
        ends.extend([(from, false, at), (to, true, at)]);
    }
    ends.sort_unstable();
    let mut used = vec![false; edges.len()];
    // Where each vertex's next unused edge is looked for: a vertex of many rims must not be searched again and again.
    let mut looked: Vec<usize> = (0..ends.len()).collect();
    let mut next_at = |vertex: u32, used: &[bool]| {
        let first = ends.partition_point(|end| end.0 < vertex);
        let slot = looked.get_mut(first)?;
        while ends.get(*slot).is_some_and(|end| end.0 == vertex && used[end.2]) {
            *slot += 1;
        }
        ends.get(*slot).filter(|end| end.0 == vertex).map(|end| end.2)
    };
    let mut chains = Vec::new();
    for start in 0..edges.len() {
        let (mut chain, mut way_on) = (Vec::new(), Some(start).filter(|&at| !used[at]));
        let mut vertex = edges[start][0];
        while let Some(at) = way_on {
            used[at] = true;
            chain.push(edges[at]);
            let [from, to] = edges[at];
            vertex = if from == vertex { to } else { from };
            way_on = next_at(vertex, &used);
        }
        if !chain.is_empty() {
            chains.push(chain);
        }
    }
    chains
}

/// Disjoint sets of numbers; a set is known by its smallest.
struct Sets(Vec<u32>);

impl Sets {
    fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    fn of(&mut self, mut member: u32) -> u32 {
        while self.0[member as usize] != member {
            let above = self.0[self.0[member as usize] as usize];
            self.0[member as usize] = above;
            member = above;
        }
        member
    }

    fn join(&mut self, one: u32, other: u32) {
        let (one, other) = (self.of(one), self.of(other));
        self.0[one.max(other) as usize] = one.min(other);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Icosphere;

    fn sphere() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let Icosphere { positions, triangles } = Icosphere::new(2);
        (positions, triangles)
    }

    fn of(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Connectivity {
        Connectivity::of(&TriangleMesh::new(positions, triangles).unwrap())
    }

    #[test]
    fn a_closed_sphere_is_clean() {
        let (positions, triangles) = sphere();
        let (vertices, count) = (positions.len(), triangles.len());
        let found = of(positions, triangles);
        assert_eq!(found.components.len(), 1);
        let Component { triangles, vertices: own, area } = found.components[0];
        assert_eq!((triangles, own), (count, vertices));
        assert!((area / (4.0 * std::f64::consts::PI) - 1.0).abs() < 0.05);
        assert!((found.largest_volume / (8.0 * std::f64::consts::PI) - 1.0).abs() < 0.1);
        assert!(found.loops.is_empty());
        let faults = [
            found.non_manifold_edges,
            found.non_manifold_vertices,
            found.opposed_edges,
            found.unreferenced_vertices,
        ];
        assert_eq!(faults, [0; 4]);
    }

    #[test]
    fn holes_are_loops_and_hardly_change_the_volume() {
        let (positions, mut triangles) = sphere();
        let whole = of(positions.clone(), triangles.clone()).largest_volume;
        triangles.retain(|t| !t.contains(&0) && !t.contains(&40));
        let found = of(positions.clone(), triangles.clone());
        let vertices: Vec<usize> = found.loops.iter().map(|rim| rim.vertices).collect();
        assert_eq!(vertices.len(), 2);
        assert!(vertices.contains(&5) && vertices.contains(&6), "{vertices:?}");
        assert!(found.loops[0].length >= found.loops[1].length);
        assert_eq!(found.unreferenced_vertices, 2);
        assert!((found.largest_volume / whole - 1.0).abs() < 0.05);
        triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert!((of(positions, triangles).largest_volume / -whole - 1.0).abs() < 0.05);
    }

    #[test]
    fn a_mask_bulges_outwards() {
        let (positions, mut triangles) = sphere();
        triangles.retain(|t| t.iter().all(|&i| positions[i as usize].z > 0.5));
        let found = of(positions, triangles);
        assert_eq!(found.loops.len(), 1);
        assert!(found.largest_volume > 0.0);
    }

    #[test]
    fn a_rim_goes_on_past_a_triangle_that_is_turned_round() {
        let (positions, mut triangles) = sphere();
        triangles.retain(|t| !t.contains(&40));
        let rim = of(positions.clone(), triangles.clone()).loops[0];
        let on_rim = |i: &u32| positions[*i as usize].distance(positions[40]) < 0.4;
        let turned = triangles.iter().position(|t| t.iter().filter(|i| on_rim(i)).count() == 2);
        triangles[turned.unwrap()].swap(0, 1);
        let found = of(positions, triangles);
        assert_eq!(found.loops.len(), 1);
        assert_eq!(found.loops[0].vertices, rim.vertices);
        assert!(found.opposed_edges > 0);
    }

    #[test]
    fn what_is_not_manifold_is_counted() {
        let square = || vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE, -DVec3::ONE, -DVec3::X];
        let edge = of(square(), vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]]);
        assert_eq!((edge.non_manifold_edges, edge.opposed_edges), (1, 0));
        let vertex = of(square(), vec![[0, 1, 2], [0, 3, 4]]);
        assert_eq!((vertex.non_manifold_vertices, vertex.components.len()), (1, 1));
        assert_eq!(vertex.unreferenced_vertices, 2);
        let opposed = of(square(), vec![[0, 1, 2], [0, 1, 3]]);
        assert_eq!((opposed.opposed_edges, opposed.non_manifold_vertices), (1, 0));
        let apart = of(square(), vec![[0, 1, 2], [3, 4, 5]]);
        assert_eq!(apart.components.len(), 2);
        let named_twice = of(square(), vec![[0, 1, 2], [0, 0, 1]]);
        assert_eq!(named_twice.loops.len(), 1);
    }
}
