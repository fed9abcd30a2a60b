use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::mesh::{Points, Rows, TriangleMesh, components};

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
    /// Triangles with the corners of one before them, in whatever order.
    pub duplicate_triangles: usize,
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

impl Connectivity {
    /// Of a mesh; sides of triangles that name a vertex twice are left out.
    pub fn of(mesh: &TriangleMesh<impl Points>) -> Self {
        // As many as have their corners listed at a time: the list of all would be as large as the mesh.
        const LISTED: usize = 1 << 15;
        const VERTICES: usize = 4096;
        let (triangles, vertices) = (mesh.triangles(), mesh.points().count());
        let (mut found, mut rim) = (Self::default(), Vec::new());
        let in_largest = found.add_components(mesh);
        for first in (0..vertices).step_by(LISTED) {
            let listed = first..(first + LISTED).min(vertices);
            let corners = Corners::of(triangles, listed.clone());
            let starts: Vec<usize> = listed.clone().step_by(VERTICES).collect();
            let part = |&start: &usize| Fans::of(&corners, start..(start + VERTICES).min(listed.end));
            for part in starts.par_iter().map(part).collect::<Vec<Fans>>() {
                found.add_fans(&part);
                rim.extend(part.rim);
            }
        }
        found.add_loops(mesh, &rim, &in_largest);
        found
    }

    fn add_fans(&mut self, fans: &Fans) {
        self.non_manifold_edges += fans.non_manifold_edges;
        self.non_manifold_vertices += fans.non_manifold_vertices;
        self.opposed_edges += fans.opposed_edges;
        self.unreferenced_vertices += fans.unreferenced_vertices;
        self.duplicate_triangles += fans.duplicate_triangles;
    }

    /// Collects the parts, and the largest part's volume without its rims' fans; returns which vertices that part has.
    fn add_components(&mut self, mesh: &TriangleMesh<impl Points>) -> Vec<bool> {
        let part_of = components(mesh.points().count(), mesh.triangles());
        // Parts are called by their first vertices, which are few.
        let firsts: Vec<u32> = (0..part_of.len() as u32).filter(|&v| part_of[v as usize] == v).collect();
        let place = |v: u32| firsts.partition_point(|&first| first < part_of[v as usize]);
        let none = Component { triangles: 0, vertices: 0, area: 0.0 };
        let mut parts = vec![none; firsts.len()];
        let mut volumes = vec![0.0; firsts.len()];
        let origin = mesh.centroid();
        for corners in mesh.triangles() {
            let part = place(corners[0]);
            let [a, b, c] = corners.map(|i| mesh.position(i) - origin);
            parts[part].triangles += 1;
            parts[part].area += (b - a).cross(c - a).length() / 2.0;
            volumes[part] += a.dot(b.cross(c));
        }
        (0..part_of.len() as u32).for_each(|v| parts[place(v)].vertices += 1);
        let there = |at: &usize| parts[*at].triangles > 0;
        let area = |at: usize| parts[at].area;
        let largest = (0..parts.len()).filter(there).reduce(|a, b| if area(b) > area(a) { b } else { a });
        // A mesh has triangles.
        let Some(largest) = largest else { return vec![false; part_of.len()] };
        self.largest_volume = volumes[largest];
        self.components = parts.into_iter().filter(|part| part.triangles > 0).collect();
        self.components.sort_by(|a, b| b.area.total_cmp(&a.area));
        part_of.iter().map(|&part| part == firsts[largest]).collect()
    }

    /// Chains rim edges to loops, and closes those of the largest part for its volume.
    fn add_loops(&mut self, mesh: &TriangleMesh<impl Points>, rim: &[[u32; 2]], in_largest: &[bool]) {
        let place = |v: u32| mesh.position(v);
        let origin = mesh.centroid();
        for edges in chains(rim) {
            let count = edges.len() as f64;
            let centre = edges.iter().map(|&[from, _]| place(from)).sum::<DVec3>() / count;
            let length = edges.iter().map(|&[from, to]| place(from).distance(place(to))).sum();
            self.loops.push(BoundaryLoop { vertices: edges.len(), length, centre: centre.to_array() });
            if in_largest[edges[0][0] as usize] {
                let fan = |&[from, to]: &[u32; 2]| {
                    (place(to) - origin).dot((place(from) - origin).cross(centre - origin))
                };
                self.largest_volume += edges.iter().map(fan).sum::<f64>();
            }
        }
        self.loops.sort_by(|a, b| b.length.total_cmp(&a.length));
    }
}

/// The triangles around some vertices.
#[derive(Default)]
struct Fans {
    /// Edges of one triangle only, as it runs along them.
    rim: Vec<[u32; 2]>,
    non_manifold_edges: usize,
    non_manifold_vertices: usize,
    opposed_edges: usize,
    unreferenced_vertices: usize,
    duplicate_triangles: usize,
}

/// The corners of triangles at some vertices, `3 f + k` the k-th of triangle f.
struct Corners<'a> {
    triangles: &'a [[u32; 3]],
    first: usize,
    rows: Rows<u32>,
}

impl<'a> Corners<'a> {
    fn of(triangles: &'a [[u32; 3]], vertices: Range<usize>) -> Self {
        let corners = triangles.as_flattened().iter().copied().zip(0..);
        let own = corners.filter(|(vertex, _)| vertices.contains(&(*vertex as usize)));
        let own = own.map(|(vertex, corner)| (vertex - vertices.start as u32, corner));
        Self { triangles, first: vertices.start, rows: Rows::from_pairs(vertices.len(), own) }
    }

    fn at(&self, vertex: usize) -> &[u32] {
        self.rows.row(vertex - self.first)
    }

    /// The vertices of a corner's triangle from the corner on, in the triangle's direction.
    fn from(&self, corner: u32) -> [u32; 3] {
        let mut triangle = self.triangles[corner as usize / 3];
        triangle.rotate_left(corner as usize % 3);
        triangle
    }
}

/// A triangle's side at one of its ends.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Spoke {
    /// The other end.
    to: u32,
    /// The triangle's corner here, by its place among those of this end.
    corner: u32,
    /// Whether the triangle runs from here to there.
    leaves: bool,
}

impl Fans {
    /// Every edge counts at its smaller vertex.
    fn of(corners: &Corners, vertices: Range<usize>) -> Self {
        let (mut found, mut spokes, mut sets) = (Self::default(), Vec::new(), Sets::default());
        for vertex in vertices {
            let own = corners.at(vertex);
            spokes.clear();
            for (place, &corner) in own.iter().enumerate() {
                let [here, next, last] = corners.from(corner);
                if here != next && next != last && last != here {
                    let spoke = |to, leaves| Spoke { to, corner: place as u32, leaves };
                    spokes.extend([spoke(next, true), spoke(last, false)]);
                }
            }
            spokes.sort_unstable();
            sets.reset(own.len());
            for edge in spokes.chunk_by(|one, next| one.to == next.to) {
                found.add_edge(vertex as u32, edge, &mut sets);
            }
            // A vertex has as many fans as its corners have sets.
            found.non_manifold_vertices += usize::from(sets.count() > 1);
            found.unreferenced_vertices += usize::from(own.is_empty());
            found.duplicate_triangles += duplicates(corners, own);
        }
        found
    }

    fn add_edge(&mut self, from: u32, edge: &[Spoke], sets: &mut Sets) {
        let counts = from < edge[0].to;
        match edge {
            [one] if counts => self.rim.push(if one.leaves { [from, one.to] } else { [one.to, from] }),
            [_] => {}
            [one, other] => {
                sets.join(one.corner, other.corner);
                self.opposed_edges += usize::from(counts && one.leaves == other.leaves);
            }
            _ => self.non_manifold_edges += usize::from(counts),
        }
    }
}

/// How many triangles have the corners of one before them, of those whose smallest vertex is that of the `own` corners.
fn duplicates(corners: &Corners, own: &[u32]) -> usize {
    let sorted = |&corner: &u32| {
        let [here, next, last] = corners.from(corner);
        // Of a vertex that a triangle names twice its first corner stands for it.
        let again = [next, last].iter().zip([1, 2]).any(|(&v, step)| v == here && corner % 3 + step > 2);
        (here <= next && here <= last && !again).then_some([next.min(last), next.max(last)])
    };
    let mut others: Vec<[u32; 2]> = own.iter().filter_map(sorted).collect();
    others.sort_unstable();
    others.array_windows().filter(|[one, next]| one == next).count()
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
#[derive(Default)]
struct Sets(Vec<u32>);

impl Sets {
    /// Each number below `count` alone.
    fn reset(&mut self, count: usize) {
        self.0.clear();
        self.0.extend(0..count as u32);
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

    fn count(&self) -> usize {
        self.0.iter().enumerate().filter(|&(member, &above)| member as u32 == above).count()
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

    #[test]
    fn triangles_that_are_there_again_are_counted() {
        let positions = (0..8).map(|i| DVec3::new(f64::from(i), f64::from(i * i), 0.0)).collect();
        let distinct = [[0, 1, 2], [0, 1, 1], [0, 1, 3], [0, 3, 4], [5, 5, 6], [7, 7, 7]];
        let again = [[2, 1, 0], [1, 2, 0], [1, 0, 1], [4, 0, 3], [6, 5, 5], [7, 7, 7]];
        assert_eq!(of(positions, [distinct, again].concat()).duplicate_triangles, again.len());
    }

    #[test]
    fn vertices_are_listed_in_parts_that_change_nothing() {
        // 163842 vertices.
        let Icosphere { positions, mut triangles } = Icosphere::new(7);
        triangles.swap_remove(100_000);
        let found = of(positions, triangles);
        assert_eq!((found.components.len(), found.loops.len(), found.loops[0].vertices), (1, 1, 3));
        let faults = [found.non_manifold_edges, found.non_manifold_vertices, found.opposed_edges];
        assert_eq!((faults, found.unreferenced_vertices), ([0; 3], 0));
    }
}
