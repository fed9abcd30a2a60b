use glam::Vec3A;
use rayon::prelude::*;

use super::Topology;

/// Mean edge length per vertex `[N]`, equation (1): l_i = mean over the one-ring of |p_i - p_j|.
pub fn mean_edge_lengths(topology: &Topology, positions: &[Vec3A]) -> Vec<f32> {
    (0..positions.len())
        .into_par_iter()
        .with_min_len(1024)
        .map(|i| {
            let ring = topology.neighbours.row(i);
            let sum: f32 = ring.iter().map(|&j| positions[i].distance(positions[j as usize])).sum();
            sum / ring.len().max(1) as f32
        })
        .collect()
}

/// Adds to `gradient` `[N, 3]` the pull-back of `upstream` `[N]`, a gradient with respect to the mean edge lengths.
///
/// An edge (i, j) with unit direction d from j to i adds (g_i / |N_i| + g_j / |N_j|) d to dE/dp_i.
pub fn pull_back_mean_edge_lengths(
    topology: &Topology,
    positions: &[Vec3A],
    upstream: &[f32],
    gradient: &mut [Vec3A],
) {
    let share = |i: usize| upstream[i] / topology.neighbours.row(i).len().max(1) as f32;
    gradient.par_iter_mut().enumerate().with_min_len(1024).for_each(|(i, gradient)| {
        let own = share(i);
        for &j in topology.neighbours.row(i) {
            let direction = (positions[i] - positions[j as usize]).normalize_or_zero();
            *gradient += direction * (own + share(j as usize));
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Icosphere;
    use crate::numeric::Random;
    use crate::numeric::finite_difference::directional_error;

    #[test]
    fn pull_back() {
        let sphere = Icosphere::new(2);
        let topology = Topology::new(sphere.positions.len(), &sphere.triangles);
        let mut random = Random::new(6);
        let mut number = || random.signed() as f32;
        let positions: Vec<Vec3A> =
            sphere.positions.iter().map(|p| p.as_vec3a() * (1.0 + 0.3 * number())).collect();
        let upstream: Vec<f32> = positions.iter().map(|_| number()).collect();
        let mut gradient = vec![Vec3A::ZERO; positions.len()];
        pull_back_mean_edge_lengths(&topology, &positions, &upstream, &mut gradient);
        let error = directional_error(&positions, &gradient, 1e-3, 8, |p| {
            mean_edge_lengths(&topology, p).iter().zip(&upstream).map(|(l, g)| f64::from(l * g)).sum()
        });
        assert!(error < 2e-3, "{error}");
    }
}
