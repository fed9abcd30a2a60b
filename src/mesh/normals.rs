use glam::Vec3A;
use rayon::prelude::*;

use super::Topology;

/// Area-weighted vertex normals of a mesh, with what their vector-Jacobian product needs.
///
/// With e_t = (p_b - p_a) x (p_c - p_a) for triangle t = (a, b, c), twice its area long, n_i = s_i / |s_i| where s_i
/// is the sum of e_t over the fan of vertex i.
#[derive(Debug, Clone, Default)]
pub struct Normals {
    /// e_t per triangle `[F, 3]`.
    pub area_vectors: Vec<Vec3A>,
    /// Unit normal per vertex `[N, 3]`; zero where the fan's area vectors cancel.
    pub vertices: Vec<Vec3A>,
    /// 1 / |s_i| per vertex `[N]`; zero where the normal is.
    inverse_lengths: Vec<f32>,
}

impl Normals {
    /// The normals of positions `[N, 3]`.
    pub fn new(topology: &Topology, positions: &[Vec3A]) -> Self {
        let mut normals = Self::default();
        normals.update(topology, positions);
        normals
    }

    /// Recomputes for moved positions, keeping the memory.
    pub fn update(&mut self, topology: &Topology, positions: &[Vec3A]) {
        topology
            .triangles
            .par_iter()
            .with_min_len(2048)
            .map(|&[a, b, c]| {
                let origin = positions[a as usize];
                (positions[b as usize] - origin).cross(positions[c as usize] - origin)
            })
            .collect_into_vec(&mut self.area_vectors);
        let area_vectors = &self.area_vectors;
        (0..positions.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| {
                let sum: Vec3A = topology.fans.row(i).iter().map(|fan| area_vectors[fan[0] as usize]).sum();
                let length = sum.length();
                let inverse = if length > f32::MIN_POSITIVE { 1.0 / length } else { 0.0 };
                (sum * inverse, inverse)
            })
            .unzip_into_vecs(&mut self.vertices, &mut self.inverse_lengths);
    }

    /// Unit normal of a triangle; zero for a degenerate one.
    pub fn triangle(&self, triangle: usize) -> Vec3A {
        self.area_vectors[triangle].normalize_or_zero()
    }

    /// Mean length of the area vectors: twice the mean triangle area.
    pub fn mean_area_vector(&self) -> f32 {
        self.area_vectors.iter().map(|e| e.length()).sum::<f32>() / self.area_vectors.len().max(1) as f32
    }

    /// Adds to `gradient` `[N, 3]` the pull-back of `upstream`, a gradient with respect to the vertex normals `[N, 3]`.
    ///
    /// h_i = (g_i - n_i (n_i . g_i)) / |s_i|, then for each triangle (a, b, c) with H the sum of h over its corners,
    /// dE/dp_a += (p_b - p_c) x H, and cyclically.
    pub fn pull_back(
        &self,
        topology: &Topology,
        positions: &[Vec3A],
        upstream: &[Vec3A],
        gradient: &mut [Vec3A],
    ) {
        let projected: Vec<Vec3A> = (0..positions.len())
            .into_par_iter()
            .with_min_len(1024)
            .map(|i| {
                let normal = self.vertices[i];
                (upstream[i] - normal * normal.dot(upstream[i])) * self.inverse_lengths[i]
            })
            .collect();
        let sums: Vec<Vec3A> = topology
            .triangles
            .par_iter()
            .with_min_len(2048)
            .map(|&[a, b, c]| projected[a as usize] + projected[b as usize] + projected[c as usize])
            .collect();
        pull_back_area_vectors(topology, positions, &sums, gradient);
    }
}

/// Adds to `gradient` `[N, 3]` the pull-back of `upstream`, a gradient with respect to the area vectors `[F, 3]`.
pub fn pull_back_area_vectors(
    topology: &Topology,
    positions: &[Vec3A],
    upstream: &[Vec3A],
    gradient: &mut [Vec3A],
) {
    gradient.par_iter_mut().enumerate().with_min_len(1024).for_each(|(i, gradient)| {
        for &[triangle, next, previous] in topology.fans.row(i) {
            let opposite = positions[next as usize] - positions[previous as usize];
            *gradient += opposite.cross(upstream[triangle as usize]);
        }
    });
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::mesh::Icosphere;
    use crate::numeric::Random;
    use crate::numeric::finite_difference::directional_error;

    fn vectors(random: &mut Random, count: usize) -> Vec<Vec3A> {
        let mut number = || random.signed() as f32;
        (0..count).map(|_| Vec3A::new(number(), number(), number())).collect()
    }

    /// A bumpy sphere with a hole of every third triangle of its first half: rims, and vertices without a triangle.
    fn bumpy() -> (Topology, Vec<Vec3A>) {
        let Icosphere { positions, triangles } = Icosphere::new(2);
        let moves = vectors(&mut Random::new(7), positions.len());
        let moved = positions.iter().zip(moves).map(|(p, m)| p.as_vec3a() + 0.05 * m).collect();
        let half = triangles.len() / 2;
        let kept: Vec<_> = (triangles.into_iter().enumerate())
            .filter(|(t, corners)| (t % 3 > 0 || *t > half) && !corners.contains(&20))
            .map(|(_, corners)| corners)
            .collect();
        (Topology::new(positions.len(), &kept), moved)
    }

    #[test]
    fn agree_with_a_sum_over_all_triangles() {
        let (topology, positions) = bumpy();
        let normals = Normals::new(&topology, &positions);
        for (i, normal) in normals.vertices.iter().enumerate() {
            let mut sum = DVec3::ZERO;
            for corners in topology.triangles.iter().filter(|corners| corners.contains(&(i as u32))) {
                let [a, b, c] = corners.map(|i| positions[i as usize].as_dvec3());
                sum += (b - a).cross(c - a);
            }
            assert!(normal.as_dvec3().distance(sum.normalize_or_zero()) < 1e-6, "vertex {i}");
        }
        assert_eq!(normals.vertices[20], Vec3A::ZERO, "no triangle, no normal");
    }

    #[test]
    fn pull_back_of_vertex_normals() {
        let (topology, positions) = bumpy();
        let upstream = vectors(&mut Random::new(9), positions.len());
        let mut gradient = vec![Vec3A::ZERO; positions.len()];
        Normals::new(&topology, &positions).pull_back(&topology, &positions, &upstream, &mut gradient);
        let error = directional_error(&positions, &gradient, 1e-3, 8, |p| {
            let normals = Normals::new(&topology, p).vertices;
            normals.iter().zip(&upstream).map(|(n, g)| f64::from(n.dot(*g))).sum()
        });
        assert!(error < 2e-3, "{error}");
    }

    #[test]
    fn pull_back_of_area_vectors() {
        let (topology, positions) = bumpy();
        let upstream = vectors(&mut Random::new(10), topology.triangles.len());
        let mut gradient = vec![Vec3A::ZERO; positions.len()];
        pull_back_area_vectors(&topology, &positions, &upstream, &mut gradient);
        let error = directional_error(&positions, &gradient, 1e-3, 8, |p| {
            let normals = Normals::new(&topology, p);
            normals.area_vectors.iter().zip(&upstream).map(|(e, g)| f64::from(e.dot(*g))).sum()
        });
        assert!(error < 2e-3, "{error}");
    }
}
