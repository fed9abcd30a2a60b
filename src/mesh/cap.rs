use glam::DVec3;

use super::{MeshError, Topology, TriangleMesh, components};

/// The mesh with a fan over each of its rims, so that it has an outside only.
///
/// The fans have vertices of their own on the rims `[R, 3]`, and one each at the mean of the rim's edges, which follow those
/// of the mesh: its normals stay. A closed mesh comes back as it is.
///
/// # Errors
/// As [`TriangleMesh::new`]: more vertices than can be numbered.
pub fn capped(mesh: &TriangleMesh, topology: &Topology) -> Result<TriangleMesh, MeshError> {
    let rim = directed_rim(topology);
    let mut positions = mesh.positions().to_vec();
    let mut triangles = mesh.triangles().to_vec();
    let joined: Vec<[u32; 3]> = rim.iter().map(|&[a, b]| [a, b, b]).collect();
    let rim_of = components(positions.len(), &joined);
    let mut on_cap = vec![None; positions.len()];
    let mut double = |positions: &mut Vec<DVec3>, i: u32| {
        *on_cap[i as usize].get_or_insert_with(|| {
            positions.push(mesh.position(i));
            positions.len() as u32 - 1
        })
    };
    let centres = centres(mesh, &rim, &rim_of);
    let mut centre_of = vec![None; rim_of.len()];
    for [a, b] in rim {
        let [on_a, on_b] = [a, b].map(|i| double(&mut positions, i));
        let name = rim_of[a as usize] as usize;
        let centre = *centre_of[name].get_or_insert_with(|| {
            positions.push(centres[name]);
            positions.len() as u32 - 1
        });
        triangles.push([on_b, on_a, centre]);
    }
    TriangleMesh::new(positions, triangles)
}

/// The edges with one triangle, in its order of corners `[R, 2]`.
fn directed_rim(topology: &Topology) -> Vec<[u32; 2]> {
    let directed = topology.rim_edges().map(|([a, b], triangle)| {
        let [i, j, k] = topology.triangles[triangle as usize];
        if [[i, j], [j, k], [k, i]].contains(&[a, b]) { [a, b] } else { [b, a] }
    });
    directed.collect()
}

/// The mean of each rim's edges by their lengths, `[N, 3]` at the vertex that the rim is called by.
fn centres(mesh: &TriangleMesh, rim: &[[u32; 2]], rim_of: &[u32]) -> Vec<DVec3> {
    let mut sums = vec![(DVec3::ZERO, 0.0); rim_of.len()];
    for &[a, b] in rim {
        let (sum, weights) = &mut sums[rim_of[a as usize] as usize];
        let [p, q] = [a, b].map(|i| mesh.position(i));
        // Edges without length count a little, so that a rim of nothing else has a centre too.
        let weight = p.distance(q).max(f64::MIN_POSITIVE);
        *sum += weight * 0.5 * (p + q);
        *weights += weight;
    }
    sums.into_iter().map(|(sum, weights)| sum / weights).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Icosphere;

    /// A sphere without what is above `height`, and below its negative.
    fn band(height: f64) -> TriangleMesh {
        let sphere = Icosphere::new(3);
        let positions = sphere.positions;
        let within = |corners: &[u32; 3]| corners.iter().all(|&i| positions[i as usize].y.abs() < height);
        let triangles = sphere.triangles.iter().copied().filter(within).collect();
        TriangleMesh::new(positions, triangles).unwrap()
    }

    fn volume(mesh: &TriangleMesh) -> f64 {
        let corners = |t: &[u32; 3]| t.map(|i| mesh.position(i));
        mesh.triangles().iter().map(corners).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    #[test]
    fn a_band_becomes_solid() {
        let height = 0.7f64;
        let open = band(height);
        let topology = Topology::of(&open);
        let solid = capped(&open, &topology).unwrap();
        let pushed = solid.positions().len() - open.positions().len();
        let rim = topology.on_rim.iter().filter(|&&on_rim| on_rim).count();
        assert_eq!(pushed, rim + 2, "the rims once more, and two centres");
        // What bounds a volume bounds the same elsewhere.
        let moved = |mesh: &TriangleMesh| {
            let by = DVec3::new(3.0, -2.0, 5.0);
            mesh.with_positions(mesh.positions().iter().map(|p| p + by).collect()).unwrap()
        };
        let whole = volume(&solid);
        assert!((volume(&moved(&solid)) - whole).abs() < 1e-9);
        let segment = std::f64::consts::TAU * (height - height.powi(3) / 3.0);
        assert!(whole > 0.75 * segment && whole < segment, "{whole} of {segment}");
        let centres: Vec<f64> = solid.positions()[open.positions().len()..]
            .iter()
            .filter(|p| p.x.hypot(p.z) < 0.2)
            .map(|p| p.y.abs())
            .collect();
        assert_eq!(centres.len(), 2);
        assert!(centres.iter().all(|y| (y - height).abs() < 0.15), "{centres:?}");
    }

    #[test]
    fn what_is_closed_stays_as_it_is() {
        let closed = band(2.0);
        assert_eq!(capped(&closed, &Topology::of(&closed)).unwrap(), closed);
    }

    #[test]
    fn a_single_triangle_gets_a_back() {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let single = TriangleMesh::new(positions, vec![[0, 1, 2]]).unwrap();
        let solid = capped(&single, &Topology::of(&single)).unwrap();
        assert_eq!(solid.triangles().len(), 4);
        let normal = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(|i| solid.position(i));
            (b - a).cross(c - a).z
        };
        assert!(solid.triangles()[1..].iter().all(|t| normal(t) < 0.0));
    }
}
