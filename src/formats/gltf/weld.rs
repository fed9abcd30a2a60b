use std::collections::HashMap;

use glam::DVec3;

use crate::formats::geometry::Geometry;

/// Closes the seams that glTF cuts where normals or texture coordinates differ: of vertices on open edges that are in
/// exactly the same place, all become the first.
///
/// Triangles that have two corners in one vertex are dropped, then vertices that no triangle names. The others keep
/// their order; vertices with triangles all around them are left alone even where two meet.
pub(super) fn weld(geometry: Geometry) -> Geometry {
    let open = open_vertices(&geometry);
    let mut first_at: HashMap<[u64; 3], u32> = HashMap::new();
    let joined: Vec<u32> = (0..geometry.positions.len())
        .map(|i| {
            if open[i] { *first_at.entry(place(geometry.positions[i])).or_insert(i as u32) } else { i as u32 }
        })
        .collect();
    let triangles = geometry.triangles.into_iter().map(|corners| corners.map(|index| joined[index as usize]));
    let triangles = triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    without_unnamed(Geometry { triangles, ..geometry })
}

/// A position as it can be compared exactly; zero has one sign.
fn place(position: DVec3) -> [u64; 3] {
    position.to_array().map(|coordinate| (coordinate + 0.0).to_bits())
}

/// Which vertices `[N]` lie on an open edge.
///
/// Around a vertex that triangles enclose, each neighbour follows one edge and leads another, so that a sum over the
/// neighbours' marks, added where leading and subtracted where following, comes to zero; no edge need be looked up.
fn open_vertices(geometry: &Geometry) -> Vec<bool> {
    let mut sums = vec![0u64; geometry.positions.len()];
    for &[a, b, c] in &geometry.triangles {
        for (corner, next, previous) in [(a, b, c), (b, c, a), (c, a, b)] {
            let sum = &mut sums[corner as usize];
            *sum = sum.wrapping_add(mark(next)).wrapping_sub(mark(previous));
        }
    }
    sums.into_iter().map(|sum| sum != 0).collect()
}

/// A number for each index such that sums of different indices differ (the finalizer of SplitMix64).
fn mark(index: u32) -> u64 {
    let mut x = (u64::from(index) + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

fn without_unnamed(geometry: Geometry) -> Geometry {
    const UNNAMED: u32 = u32::MAX;
    let mut renamed = vec![UNNAMED; geometry.positions.len()];
    for &index in geometry.triangles.iter().flatten() {
        renamed[index as usize] = index;
    }
    let mut positions = Vec::new();
    for (name, &position) in renamed.iter_mut().zip(&geometry.positions) {
        if *name != UNNAMED {
            *name = positions.len() as u32;
            positions.push(position);
        }
    }
    let triangles =
        geometry.triangles.iter().map(|corners| corners.map(|index| renamed[index as usize])).collect();
    Geometry { positions, triangles }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron whose four triangles have corners of their own.
    fn cut_tetrahedron() -> Geometry {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let positions = faces.iter().flatten().map(|&i: &usize| corners[i]).collect();
        Geometry { positions, triangles: (0..4).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect() }
    }

    #[test]
    fn seams_close_and_vertices_keep_their_order() {
        let welded = weld(cut_tetrahedron());
        assert_eq!(welded.positions, [DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::Z]);
        assert_eq!(welded.triangles, [[0, 1, 2], [0, 2, 3], [2, 1, 3], [1, 0, 3]]);
        assert!(open_vertices(&welded).iter().all(|open| !open));
    }

    #[test]
    fn enclosed_vertices_in_the_same_place_stay_two() {
        let mut twice = weld(cut_tetrahedron());
        twice.positions.extend_from_within(..);
        twice.triangles.extend(twice.triangles.clone().iter().map(|corners| corners.map(|i| i + 4)));
        let (positions, triangles) = (twice.positions.clone(), twice.triangles.clone());
        let welded = weld(twice);
        assert_eq!((welded.positions, welded.triangles), (positions, triangles));
    }

    #[test]
    fn what_no_triangle_names_goes() {
        let mut geometry = cut_tetrahedron();
        geometry.positions.insert(0, DVec3::splat(9.0));
        for corners in &mut geometry.triangles {
            *corners = corners.map(|i| i + 1);
        }
        geometry.triangles.push([1, 1, 2]);
        let welded = weld(geometry);
        assert_eq!((welded.positions.len(), welded.triangles.len()), (4, 4));
    }
}
