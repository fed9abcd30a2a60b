use std::collections::HashMap;

use glam::DVec3;

use super::geometry::{FileOrder, GONE, Geometry, Numbers};
use super::polygons::Polygons;
use super::texture::Texture;
use crate::mesh::{FilePoints, Points};

/// Closes the seams that formats cut where normals or texture coordinates differ: of vertices on open edges that are in
/// exactly the same place, all become the first. All polygons must be triangles.
///
/// Triangles that have two corners in one vertex are dropped, then vertices that no triangle names. The others keep
/// their order; vertices with triangles all around them are left alone even where two meet.
pub(super) fn weld(geometry: Geometry) -> Geometry {
    let triangles = geometry.polygons.triangles();
    let joined = joined(&geometry.positions, &triangles);
    let welded = |corners: &[u32; 3]| corners.map(|index| joined[index as usize]);
    let stays = |corners: &[u32; 3]| {
        let [a, b, c] = welded(corners);
        a != b && b != c && c != a
    };
    let kept: Vec<bool> = triangles.iter().map(stays).collect();
    let left: Vec<[u32; 3]> = kept_of(triangles.iter(), &kept).map(welded).collect();
    let renamed = renamed(&left, geometry.positions.count());
    let named: Vec<bool> = renamed.iter().map(|&index| index != GONE).collect();
    let mut polygons = Polygons::with_capacity(left.len());
    left.iter().for_each(|corners| polygons.push_triangle(corners.map(|index| renamed[index as usize])));
    Geometry {
        positions: kept_of(geometry.positions.each(), &named).collect(),
        colours: geometry.colours.map(|colours| kept_of(colours.into_iter(), &named).collect()),
        texture: geometry.texture.map(|texture| without(texture, &kept)),
        polygons,
        order: FileOrder {
            vertices: Numbers::Changed(joined.iter().map(|&index| renamed[index as usize]).collect()),
            triangles: numbers(&kept),
        },
        warnings: geometry.warnings,
    }
}

/// The entries that are to be kept.
fn kept_of<T>(values: impl Iterator<Item = T>, kept: &[bool]) -> impl Iterator<Item = T> {
    values.zip(kept).filter(|(_, kept)| **kept).map(|(value, _)| value)
}

/// The texture without the triangles that go.
fn without(texture: Texture, kept: &[bool]) -> Texture {
    let (corners, _) = texture.corners.as_chunks::<3>();
    let corners = kept_of(corners.iter().copied(), kept).collect::<Vec<_>>().into_flattened();
    let polygon_images = kept_of(texture.polygon_images.into_iter(), kept).collect();
    Texture { corners, polygon_images, ..texture }
}

/// The new number of each entry.
fn numbers(kept: &[bool]) -> Numbers {
    if kept.iter().all(|&kept| kept) {
        return Numbers::Kept;
    }
    let number = |next: &mut u32, &kept: &bool| {
        let number = if kept { *next } else { GONE };
        *next += u32::from(kept);
        Some(number)
    };
    Numbers::Changed(kept.iter().scan(0, number).collect())
}

/// For each vertex the one that it becomes.
fn joined(positions: &FilePoints, triangles: &[[u32; 3]]) -> Vec<u32> {
    let open = open_vertices(positions.count(), triangles);
    let mut first_at: HashMap<[u64; 3], u32> = HashMap::new();
    (0..positions.count())
        .map(|i| if open[i] { *first_at.entry(place(positions.at(i))).or_insert(i as u32) } else { i as u32 })
        .collect()
}

/// A position as it can be compared exactly; zero has one sign.
fn place(position: DVec3) -> [u64; 3] {
    position.to_array().map(|coordinate| (coordinate + 0.0).to_bits())
}

/// Which vertices `[N]` lie on an open edge.
///
/// Around a vertex that triangles enclose, each neighbour follows one edge and leads another, so that a sum over the
/// neighbours' marks, added where leading and subtracted where following, comes to zero; no edge need be looked up.
fn open_vertices(vertices: usize, triangles: &[[u32; 3]]) -> Vec<bool> {
    let mut sums = vec![0u64; vertices];
    for &[a, b, c] in triangles {
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

/// The numbers of the vertices that triangles name, counted without the others, which are [`GONE`].
fn renamed(triangles: &[[u32; 3]], vertices: usize) -> Vec<u32> {
    let mut renamed = vec![GONE; vertices];
    for &index in triangles.iter().flatten() {
        renamed[index as usize] = 0;
    }
    for (number, name) in renamed.iter_mut().filter(|name| **name != GONE).enumerate() {
        *name = number as u32;
    }
    renamed
}

#[cfg(test)]
mod tests {
    use super::*;

    fn geometry(positions: &[DVec3], triangles: &[[u32; 3]]) -> Geometry {
        let mut polygons = Polygons::default();
        triangles.iter().for_each(|&corners| polygons.push_triangle(corners));
        let positions = positions.iter().copied().collect();
        Geometry { positions, polygons, ..Geometry::default() }
    }

    /// A tetrahedron whose four triangles have corners of their own.
    fn cut_tetrahedron() -> Geometry {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let positions: Vec<DVec3> = faces.iter().flatten().map(|&i: &usize| corners[i]).collect();
        geometry(&positions, &[0, 1, 2, 3].map(|t| [3 * t, 3 * t + 1, 3 * t + 2]))
    }

    #[test]
    fn seams_close_and_vertices_keep_their_order() {
        let welded = weld(cut_tetrahedron());
        assert_eq!(Vec::from(welded.positions), [DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::Z]);
        let triangles = welded.polygons.triangles();
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3], [2, 1, 3], [1, 0, 3]]);
        assert!(open_vertices(4, &triangles).iter().all(|open| !open));
        assert_eq!(welded.order.vertices, Numbers::Changed(vec![0, 1, 2, 0, 2, 3, 2, 1, 3, 1, 0, 3]));
        assert_eq!(welded.order.triangles, Numbers::Kept);
    }

    #[test]
    fn enclosed_vertices_in_the_same_place_stay_two() {
        let once = weld(cut_tetrahedron());
        let (mut positions, mut triangles) = (Vec::from(once.positions), once.polygons.triangles());
        positions.extend_from_within(..);
        triangles.extend(triangles.clone().iter().map(|corners| corners.map(|i| i + 4)));
        let welded = weld(geometry(&positions, &triangles));
        assert_eq!((Vec::from(welded.positions), welded.polygons.triangles()), (positions, triangles));
    }

    #[test]
    fn what_no_triangle_names_goes_with_all_that_belongs_to_it() {
        let cut = cut_tetrahedron();
        let mut positions = Vec::from(cut.positions);
        positions.insert(0, DVec3::splat(9.0));
        let mut triangles = vec![[1, 1, 2]];
        triangles.extend(cut.polygons.triangles().iter().map(|corners| corners.map(|i| i + 1)));
        let mut before = geometry(&positions, &triangles);
        before.colours = Some((0..13).map(|i| [i, 0, 0, 255]).collect());
        before.texture = Some(Texture {
            coordinates: Vec::new(),
            corners: (0..15).collect(),
            polygon_images: (0..5).collect(),
            images: Vec::new(),
            origin: crate::formats::ImageOrigin::UpperLeft,
        });
        let welded = weld(before);
        assert_eq!((welded.positions.count(), welded.polygons.len()), (4, 4));
        assert_eq!(welded.colours.unwrap(), [1, 2, 3, 6].map(|red| [red, 0, 0, 255]));
        let texture = welded.texture.unwrap();
        assert_eq!(texture.corners, (3..15).collect::<Vec<_>>());
        assert_eq!(texture.polygon_images, [1, 2, 3, 4]);
        assert_eq!(welded.order.triangles, Numbers::Changed(vec![GONE, 0, 1, 2, 3]));
        let Numbers::Changed(vertices) = welded.order.vertices else { panic!("vertices were welded") };
        assert_eq!(vertices[..3], [GONE, 0, 1]);
    }
}
