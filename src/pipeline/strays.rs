use glam::{DVec3, Vec3A};

use crate::mesh::{MeshError, TriangleMesh, components};
use crate::spatial::SurfaceIndex;

/// Pieces at least this large, of the largest one's area, are parts of the scan wherever they lie.
const PART: f64 = 0.2;

/// Smaller pieces are parts of the scan within this distance of its large ones, in their radius: eyeballs, flakes of a
/// broken surface.
const NEAR: f32 = 0.05;

/// A scan without the small pieces that lie away from it, as a background or a turntable leaves them, and for each of
/// its vertices the number that it has in the whole scan; `None` where nothing is left out.
///
/// # Errors
/// [`MeshError`] where what is left is no mesh.
pub fn without_strays(mesh: &TriangleMesh) -> Result<Option<(TriangleMesh, Vec<u32>)>, MeshError> {
    let pieces = components(mesh.positions().len(), mesh.triangles());
    let areas = areas(mesh, &pieces);
    let largest = areas.iter().copied().fold(0.0, f64::max);
    let is_part = |t: usize| areas[pieces[mesh.triangles()[t][0] as usize] as usize] >= PART * largest;
    if (0..mesh.triangles().len()).all(is_part) {
        return Ok(None);
    }
    let (parts, small): (Vec<usize>, Vec<usize>) = (0..mesh.triangles().len()).partition(|&t| is_part(t));
    let near = near_pieces(mesh, &pieces, &parts, &small);
    let kept: Vec<[u32; 3]> = mesh
        .triangles()
        .iter()
        .filter(|corners| near[pieces[corners[0] as usize] as usize])
        .copied()
        .collect();
    if kept.len() == mesh.triangles().len() { Ok(None) } else { compact(mesh, &kept).map(Some) }
}

/// The area of each piece, at its name.
fn areas(mesh: &TriangleMesh, pieces: &[u32]) -> Vec<f64> {
    let mut areas = vec![0.0; pieces.len()];
    for corners in mesh.triangles() {
        let [a, b, c] = corners.map(|i| mesh.positions()[i as usize]);
        areas[pieces[corners[0] as usize] as usize] += (b - a).cross(c - a).length() / 2.0;
    }
    areas
}

/// Whether each piece, at its name, is a large part or comes near one.
fn near_pieces(mesh: &TriangleMesh, pieces: &[u32], parts: &[usize], small: &[usize]) -> Vec<bool> {
    let parts: Vec<[u32; 3]> = parts.iter().map(|&t| mesh.triangles()[t]).collect();
    let corners = || parts.iter().flatten().map(|&i| mesh.positions()[i as usize]);
    let centre = corners().sum::<DVec3>() / (3 * parts.len()) as f64;
    let radius = corners().map(|p| p.distance(centre)).fold(f64::MIN_POSITIVE, f64::max);
    let positions: Vec<Vec3A> =
        mesh.positions().iter().map(|p| ((*p - centre) / radius).as_vec3a()).collect();
    let index = SurfaceIndex::new(&positions, &parts);
    let mut near = vec![false; pieces.len()];
    for &[corner, ..] in &parts {
        near[pieces[corner as usize] as usize] = true;
    }
    for &i in small.iter().flat_map(|&t| &mesh.triangles()[t]) {
        let near = &mut near[pieces[i as usize] as usize];
        *near = *near || index.closest(positions[i as usize]).distance_squared <= NEAR * NEAR;
    }
    near
}

/// A mesh of some of another's triangles and the vertices that these name.
fn compact(mesh: &TriangleMesh, triangles: &[[u32; 3]]) -> Result<(TriangleMesh, Vec<u32>), MeshError> {
    let mut used = vec![false; mesh.positions().len()];
    triangles.iter().flatten().for_each(|&i| used[i as usize] = true);
    let vertices: Vec<u32> = (0..used.len() as u32).filter(|&i| used[i as usize]).collect();
    let mut number = vec![0; used.len()];
    vertices.iter().zip(0..).for_each(|(&i, new)| number[i as usize] = new);
    let positions = vertices.iter().map(|&i| mesh.positions()[i as usize]).collect();
    let triangles = triangles.iter().map(|corners| corners.map(|i| number[i as usize])).collect();
    Ok((TriangleMesh::new(positions, triangles)?, vertices))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Icosphere;

    /// A sphere of radius 10 and a small one beside it, whose surfaces are `gap` apart.
    fn with_a_small_one(gap: f64, radius: f64) -> TriangleMesh {
        let [large, small] = [Icosphere::new(3), Icosphere::new(2)];
        let mut positions: Vec<DVec3> = small.positions.iter().map(|p| *p * radius).collect();
        positions.iter_mut().for_each(|p| p.x += 10.0 + radius + gap);
        let count = positions.len() as u32;
        positions.extend(large.positions.iter().map(|p| *p * 10.0));
        let shifted = large.triangles.iter().map(|corners| corners.map(|i| i + count));
        TriangleMesh::new(positions, small.triangles.iter().copied().chain(shifted).collect()).unwrap()
    }

    #[test]
    fn what_is_small_and_far_is_left_out() {
        let mesh = with_a_small_one(3.0, 1.0);
        let (rest, vertices) = without_strays(&mesh).unwrap().expect("the small sphere is a stray");
        assert_eq!((rest.positions().len(), rest.triangles().len()), (642, 1280));
        for (position, &i) in rest.positions().iter().zip(&vertices) {
            assert_eq!(*position, mesh.positions()[i as usize]);
            assert!(position.length() < 10.1);
        }
    }

    #[test]
    fn what_is_near_or_large_stays() {
        assert_eq!(without_strays(&with_a_small_one(0.2, 1.0)).unwrap(), None);
        assert_eq!(without_strays(&with_a_small_one(3.0, 8.0)).unwrap(), None);
    }
}
