use glam::Vec3A;

use crate::mesh::Topology;
use crate::numeric::{SolveBuffer, SparseCholesky, SymmetricMatrix};
use crate::pipeline::connectivity::Connectivity;

/// Weight that holds what is known, and one that nothing feels.
const FIXED: f64 = 1e5;
const FREE: f64 = 1e-4;

/// Diffusion of the known part's bend before it goes on: that of a rim is half noise.
const BEND_SMOOTHING: f64 = 30.0;

/// Draws a shape `[N, 3]` anew where nothing is known of it: it goes on from what is known, bending on as it did there,
/// ever less, until it closes.
///
/// Two harmonic problems on the unknown vertices, with L the combinatorial Laplacian: L q = 0, where q is the known
/// part's L p, and then L p = q.
pub fn close_smoothly(connectivity: &Connectivity, p: &mut [Vec3A], unknown: &[bool]) {
    if !unknown.contains(&true) || !unknown.contains(&false) {
        return;
    }
    let topology = &connectivity.topology;
    let mut matrix = SymmetricMatrix::diffusion(topology, 1.0);
    for (diagonal, &unknown) in matrix.diagonal.iter_mut().zip(unknown) {
        // The diffusion's own weight is one.
        *diagonal += if unknown { FREE } else { FIXED } - 1.0;
    }
    let Ok(system) = SparseCholesky::new(topology, &matrix, connectivity.dissection()) else { return };
    let mut buffer = SolveBuffer::default();
    let bend = smooth_bend(connectivity, p, unknown, &mut buffer);
    let held = |values: &[Vec3A], free: &dyn Fn(usize) -> Vec3A| -> Vec<Vec3A> {
        let at = |i: usize| if unknown[i] { free(i) } else { values[i] * FIXED as f32 };
        (0..values.len()).map(at).collect()
    };
    let mut q = held(&bend, &|_| Vec3A::ZERO);
    system.solve(&mut q, &mut buffer);
    let mut drawn = held(p, &|i| q[i] + p[i] * FREE as f32);
    system.solve(&mut drawn, &mut buffer);
    for (i, drawn) in drawn.into_iter().enumerate().filter(|(i, _)| unknown[*i]) {
        p[i] = drawn;
    }
}

/// L p `[N, 3]` of the known part, averaged over vertices all of whose neighbours are known.
fn smooth_bend(
    connectivity: &Connectivity,
    p: &[Vec3A],
    unknown: &[bool],
    buffer: &mut SolveBuffer,
) -> Vec<Vec3A> {
    let topology = &connectivity.topology;
    let inner = |i: usize| !unknown[i] && topology.neighbours.row(i).iter().all(|&j| !unknown[j as usize]);
    let mut share: Vec<f32> = (0..p.len()).map(|i| f32::from(u8::from(inner(i)))).collect();
    let mut bend = laplacian(topology, p);
    bend.iter_mut().zip(&share).for_each(|(bend, share)| *bend *= *share);
    let smoother = connectivity.diffusion(BEND_SMOOTHING);
    smoother.solve(&mut bend, buffer);
    smoother.solve_scalar(&mut share, buffer);
    bend.iter().zip(share).map(|(bend, share)| *bend / share.max(1e-3)).collect()
}

/// L p `[N, 3]`: how far each vertex stands out from its neighbours, times their number.
fn laplacian(topology: &Topology, p: &[Vec3A]) -> Vec<Vec3A> {
    let at = |i: usize| topology.neighbours.row(i).iter().map(|&j| p[i] - p[j as usize]).sum();
    (0..p.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::Sphere;

    #[test]
    fn a_cut_sphere_is_closed_without_an_edge() {
        let sphere = Sphere::of_level(4);
        let unknown: Vec<bool> = sphere.rest.iter().map(|p| p.z < -0.3).collect();
        // What is not known lies crumpled in the plane of the cut.
        let mut p: Vec<Vec3A> = sphere
            .rest
            .iter()
            .map(|p| if p.z < -0.3 { *p * Vec3A::new(0.5, 0.9, 0.0) } else { *p })
            .collect();
        let before = p.clone();
        close_smoothly(&sphere.connectivity, &mut p, &unknown);
        let normals = crate::mesh::Normals::new(&sphere.connectivity.topology, &p).vertices;
        for (i, rest) in sphere.rest.iter().enumerate() {
            if !unknown[i] {
                assert_eq!(p[i], before[i]);
            } else {
                assert!(p[i].z < -0.25 && p[i].length() < 1.5, "{rest} to {}", p[i]);
                for &j in sphere.connectivity.topology.neighbours.row(i) {
                    let turn = normals[i].dot(normals[j as usize]);
                    assert!(turn > 0.8, "{rest}: {turn}");
                }
            }
        }
    }
}
