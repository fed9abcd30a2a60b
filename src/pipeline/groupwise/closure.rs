use glam::Vec3A;

use crate::numeric::{SolveBuffer, SparseCholesky, SymmetricMatrix};
use crate::pipeline::connectivity::Connectivity;

/// Weight that holds what is known, and one that nothing feels.
const FIXED: f64 = 1e5;
const FREE: f64 = 1e-4;

/// Steps of conjugate gradients, and the share of the residual at which they have come far enough.
const STEPS: usize = 200;
const ENOUGH: f32 = 1e-4;

/// Draws a shape `[N, 3]` anew where nothing is known of it: as a thin plate that goes on from what is known without an
/// edge, and closes.
///
/// Minimises |L p|^2 with L the combinatorial Laplacian and the known vertices held, by conjugate gradients; what would
/// solve the problem but for its boundary, L^-1 L^-1, is the preconditioner.
pub fn close_smoothly(connectivity: &Connectivity, p: &mut [Vec3A], unknown: &[bool]) {
    if !unknown.contains(&true) || !unknown.contains(&false) {
        return;
    }
    let Some(mut plate) = Plate::new(connectivity, unknown) else { return };
    let mut residual = plate.bend(p);
    residual.iter_mut().for_each(|r| *r = -*r);
    let target = ENOUGH * ENOUGH * dot(&residual, &residual);
    let mut along = plate.precondition(&residual);
    let mut size = dot(&residual, &along);
    for _ in 0..STEPS {
        if size <= 0.0 || dot(&residual, &residual) <= target {
            break;
        }
        let bent = plate.bend(&along);
        let step = size / dot(&along, &bent).max(f32::MIN_POSITIVE);
        add(p, step, &along);
        add(&mut residual, -step, &bent);
        let next = plate.precondition(&residual);
        let grown = dot(&residual, &next);
        along.iter_mut().zip(next).for_each(|(along, next)| *along = next + *along * (grown / size));
        size = grown;
    }
}

/// The problem on the unknown vertices.
struct Plate<'a> {
    connectivity: &'a Connectivity,
    unknown: &'a [bool],
    laplacian: SymmetricMatrix,
    system: SparseCholesky,
    buffer: SolveBuffer,
}

impl<'a> Plate<'a> {
    fn new(connectivity: &'a Connectivity, unknown: &'a [bool]) -> Option<Self> {
        let topology = &connectivity.topology;
        let mut laplacian = SymmetricMatrix::diffusion(topology, 1.0);
        // The diffusion's own weight is one.
        laplacian.diagonal.iter_mut().for_each(|diagonal| *diagonal -= 1.0);
        let diagonal = laplacian.diagonal.iter().zip(unknown);
        let diagonal = diagonal.map(|(d, &unknown)| d + if unknown { FREE } else { FIXED }).collect();
        let held = SymmetricMatrix { diagonal, edges: laplacian.edges.clone() };
        let system = SparseCholesky::new(connectivity.elimination(), &held).ok()?;
        Some(Self { connectivity, unknown, laplacian, system, buffer: SolveBuffer::default() })
    }

    /// Half the gradient of |L x|^2 in the unknown vertices.
    fn bend(&self, x: &[Vec3A]) -> Vec<Vec3A> {
        let topology = &self.connectivity.topology;
        let once = self.laplacian.multiply(topology, x);
        self.of_unknown(self.laplacian.multiply(topology, &once))
    }

    fn precondition(&mut self, x: &[Vec3A]) -> Vec<Vec3A> {
        let mut solved = x.to_vec();
        self.system.solve(&mut solved, &mut self.buffer);
        let mut solved = self.of_unknown(solved);
        self.system.solve(&mut solved, &mut self.buffer);
        self.of_unknown(solved)
    }

    fn of_unknown(&self, mut x: Vec<Vec3A>) -> Vec<Vec3A> {
        x.iter_mut().zip(self.unknown).filter(|(_, unknown)| !**unknown).for_each(|(x, _)| *x = Vec3A::ZERO);
        x
    }
}

fn dot(a: &[Vec3A], b: &[Vec3A]) -> f32 {
    a.iter().zip(b).map(|(a, b)| f64::from(a.dot(*b))).sum::<f64>() as f32
}

fn add(x: &mut [Vec3A], factor: f32, other: &[Vec3A]) {
    x.iter_mut().zip(other).for_each(|(x, other)| *x += *other * factor);
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
