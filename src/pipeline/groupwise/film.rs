use glam::Vec3A;

use super::vertex_areas;
use crate::numeric::{SolveBuffer, SparseCholesky, SymmetricMatrix};
use crate::pipeline::{GroupwiseSettings, ScanSurface, Sphere};

/// Weight that holds the vertices around a film, and one that no film feels.
const FIXED: f64 = 1e5;
const FREE: f64 = 1e-4;

/// Diffusion of films per vertex of the sphere, so that it reaches as far on coarse ones as on fine ones.
const SMOOTHING: f64 = 16.0 / 2562.0;

/// Steps after which a fall is taken to miss the scan.
const MOST_STEPS: usize = 20;

/// How far a vertex at `p` that hangs in the air falls along the unit vector `inwards`, if it would come down on the
/// scan's front: as far as it is from the scan, so that the scan cannot be in the way.
///
/// A shape that has not entered a cavity of the scan, as an open mouth, closes it with a film of vertices that lie
/// nowhere on the scan. Their closest points are the cavity's lips, which would hold them; falling, they go in.
/// A vertex within `slack` of the scan, behind its surface, over its rim or over what is no data does not fall.
pub fn fall(scan: &ScanSurface, p: Vec3A, inwards: Vec3A, slack: f32) -> Option<Vec3A> {
    let near = scan.index.closest(p);
    let distance = near.distance_squared.sqrt();
    let outside = (p - near.point).dot(scan.normal_at(&near)) > 0.0;
    if distance <= slack || !outside || scan.weight_at(&near) == 0.0 {
        return None;
    }
    let mut at = p + inwards * distance;
    for _ in 0..MOST_STEPS {
        let near = scan.index.closest(at);
        let ahead = near.distance_squared.sqrt();
        let facing = -scan.normal_at(&near).dot(inwards);
        if ahead < 0.2 * slack || (ahead < slack && facing > 0.5) {
            return (facing > 0.0 && scan.weight_at(&near) > 0.0).then_some(inwards * distance);
        }
        at += inwards * ahead;
    }
    None
}

/// Draws the mean flat where some member's area is more than `film_stretch` times its own: there the members do not agree
/// on a shape, and a tangle of the mean would hold a film that is to fall.
///
/// Solves L p = 0 on those vertices and what is around them, the others held. The film's edge is the line where its diffused
/// indicator is `film_share`: a ragged one would leave shreds of lips hanging, which stay shreds on every open mouth.
pub fn flatten_films(
    sphere: &Sphere,
    mean: &mut [Vec3A],
    members: &[Vec<Vec3A>],
    settings: &GroupwiseSettings,
) {
    let film = film(sphere, mean, members, settings);
    if film.contains(&true) && film.contains(&false) {
        flatten(sphere, mean, &film);
    }
}

/// The vertices of films `[N]`.
fn film(sphere: &Sphere, mean: &[Vec3A], members: &[Vec<Vec3A>], settings: &GroupwiseSettings) -> Vec<bool> {
    let own = vertex_areas(&sphere.connectivity.topology, mean);
    let mut stretched = vec![false; mean.len()];
    for member in members {
        let areas = vertex_areas(&sphere.connectivity.topology, member);
        for ((stretched, area), own) in stretched.iter_mut().zip(areas).zip(&own) {
            *stretched |= area > settings.film_stretch * own;
        }
    }
    let around =
        |i: usize| sphere.connectivity.topology.neighbours.row(i).iter().any(|&j| stretched[j as usize]);
    let film = (0..mean.len()).map(|i| stretched[i] || around(i));
    if settings.film_share <= 0.0 || !stretched.contains(&true) {
        return film.collect();
    }
    let mut share: Vec<f32> = film.map(|film| f32::from(u8::from(film))).collect();
    let lambda = SMOOTHING * mean.len() as f64;
    sphere.connectivity.diffusion(lambda).solve_scalar(&mut share, &mut SolveBuffer::default());
    share.into_iter().map(|share| share > settings.film_share).collect()
}

fn flatten(sphere: &Sphere, p: &mut [Vec3A], film: &[bool]) {
    let mut matrix = SymmetricMatrix::diffusion(&sphere.connectivity.topology, 1.0);
    let mut drawn = p.to_vec();
    for ((diagonal, drawn), &film) in matrix.diagonal.iter_mut().zip(&mut drawn).zip(film) {
        // The diffusion's own weight is one.
        let weight = if film { FREE } else { FIXED };
        *diagonal += weight - 1.0;
        *drawn *= weight as f32;
    }
    let Ok(system) = SparseCholesky::new(sphere.connectivity.elimination(), &matrix) else {
        return;
    };
    system.solve(&mut drawn, &mut SolveBuffer::default());
    for ((p, drawn), _) in p.iter_mut().zip(drawn).zip(film).filter(|(_, film)| **film) {
        *p = drawn;
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::mesh::{Icosphere, TriangleMesh};
    use crate::pipeline::{Preset, Settings};

    /// A sphere pushed in from above: a bowl of depth 1.2.
    fn bowl() -> ScanSurface {
        let sphere = Icosphere::new(4);
        let push = |p: &DVec3| if p.z > 0.5 { DVec3::new(p.x, p.y, 0.5 - 1.2 * (p.z - 0.5)) } else { *p };
        let mesh = TriangleMesh::new(sphere.positions.iter().map(push).collect(), sphere.triangles).unwrap();
        ScanSurface::new(&mesh, 100)
    }

    #[test]
    fn what_hangs_over_a_bowl_falls_into_it_and_nowhere_else() {
        let scan = bowl();
        let over = scan.to_unit(DVec3::new(0.05, 0.0, 0.5));
        let mut p = over;
        let mut falls = 0;
        while let Some(step) = fall(&scan, p, -Vec3A::Z, 0.01) {
            p += step;
            falls += 1;
            assert!(falls < 100, "it never comes down");
        }
        assert!(falls > 0, "it does not fall");
        let bottom = scan.index.closest(p);
        assert!(bottom.distance_squared.sqrt() < 0.02 && p.z < over.z - 0.3, "{p} of {over}");
        assert_eq!(fall(&scan, over, Vec3A::Z, 0.01), None, "there is nothing above");
        let inside = scan.to_unit(DVec3::new(0.0, 0.0, -0.5));
        assert_eq!(fall(&scan, inside, -Vec3A::Z, 0.01), None, "the inside is no air");
    }

    fn settings(film_share: f32) -> GroupwiseSettings {
        let settings = Settings::preset(Preset::Default, 2562).unwrap().groupwise;
        GroupwiseSettings { film_stretch: 4.0, film_share, ..settings }
    }

    #[test]
    fn a_ragged_edge_of_a_film_is_drawn_straight() {
        let sphere = Sphere::of_level(4);
        let teeth = |p: &Vec3A| 0.75 + 0.15 * (5.0 * p.y.atan2(p.x)).sin().signum();
        let member: Vec<Vec3A> =
            sphere.rest.iter().map(|p| if p.z > teeth(p) { *p * 4.0 } else { *p }).collect();
        let [ragged, straight] = [0.0, 0.3]
            .map(|share| film(&sphere, &sphere.rest, std::slice::from_ref(&member), &settings(share)));
        // How much the height of its edge varies.
        let spread = |film: &[bool]| {
            let edges = sphere.connectivity.topology.edges.iter().map(|edge| edge.map(|i| i as usize));
            let crossing = edges.filter(|[a, b]| film[*a] != film[*b]);
            let heights: Vec<f32> =
                crossing.map(|[a, b]| (sphere.rest[a].z + sphere.rest[b].z) / 2.0).collect();
            let mean = heights.iter().sum::<f32>() / heights.len() as f32;
            (heights.iter().map(|z| (z - mean) * (z - mean)).sum::<f32>() / heights.len() as f32).sqrt()
        };
        let (before, after) = (spread(&ragged), spread(&straight));
        assert!(before > 0.05 && after < 0.4 * before, "{after} of {before}");
        assert!((0..straight.len()).all(|i| straight[i] || sphere.rest[i].z < 0.9));
        assert!((0..straight.len()).all(|i| !straight[i] || sphere.rest[i].z > 0.3));
    }

    #[test]
    fn a_crumpled_film_becomes_flat_and_its_surroundings_stay() {
        let sphere = Sphere::of_level(3);
        let mut mean = sphere.rest.clone();
        let mut member = sphere.rest.clone();
        for (mean, member) in mean.iter_mut().zip(&mut member) {
            if mean.z > 0.8 {
                *member *= 4.0;
                // A zigzag between 0.7 and 0.9 of the radius.
                *mean *= if (17.0 * mean.x).sin() > 0.0 { 0.9 } else { 0.7 };
            }
        }
        let before = mean.clone();
        flatten_films(&sphere, &mut mean, &[member], &settings(0.3));
        let cap: Vec<usize> = (0..mean.len()).filter(|&i| sphere.rest[i].z > 0.9).collect();
        assert!(cap.len() > 10);
        for &i in &cap {
            let ring = sphere.connectivity.topology.neighbours.row(i);
            let average = ring.iter().map(|&j| mean[j as usize]).sum::<Vec3A>() / ring.len() as f32;
            assert!(mean[i].distance(average) < 1e-3, "{} {average}", mean[i]);
        }
        for i in (0..mean.len()).filter(|&i| sphere.rest[i].z < 0.5) {
            assert_eq!(mean[i], before[i]);
        }
    }
}
