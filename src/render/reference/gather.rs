//! The sum over the views, per vertex, in the order of the views.

use rayon::prelude::*;

use super::backward::VertexGradient;
use crate::render::RenderGradient;

/// Sets `gradient` to the sum of the views' gradients `[V, N]`; albedo only where there is any.
pub fn gather(views: &[Vec<VertexGradient>], with_albedo: bool, gradient: &mut RenderGradient) {
    let RenderGradient { positions, normals, albedo } = gradient;
    let sum_of = |vertex: usize| {
        let mut sum = VertexGradient::default();
        for view in views {
            sum += view[vertex];
        }
        sum
    };
    (positions.par_iter_mut(), normals).into_par_iter().enumerate().with_min_len(1024).for_each(
        |(vertex, (position, normal))| {
            let sum = sum_of(vertex);
            (*position, *normal) = (sum.position, sum.normal);
        },
    );
    if with_albedo {
        albedo.par_iter_mut().enumerate().with_min_len(1024).for_each(|(vertex, albedo)| {
            *albedo = sum_of(vertex).albedo.to_array();
        });
    }
}
