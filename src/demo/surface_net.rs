use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::TriangleMesh;

/// Steps of Newton's method that bring vertices onto the surface.
const STEPS: usize = 4;

/// The surface where a distance is zero, negative inside, within a box: a vertex in each cell of a grid that it crosses,
/// a square for each edge that it crosses (Gibson 1998, "Constrained Elastic Surface Nets"), vertices then moved onto it.
///
/// # Panics
/// If no cell is crossed.
pub(super) fn surface_net(
    distance: impl Fn(DVec3) -> f64 + Sync,
    [low, high]: [DVec3; 2],
    cells: usize,
) -> TriangleMesh {
    let side = (high - low).max_element() / cells as f64;
    let count = ((high - low) / side).ceil().as_uvec3() + 1;
    let [wide, tall, deep] = count.to_array().map(|n| n as usize);
    let corner = |[x, y, z]: [usize; 3]| low + DVec3::new(x as f64, y as f64, z as f64) * side;
    let layer = |z: usize| (0..wide * tall).map(|at| distance(corner([at % wide, at / wide, z]))).collect();
    let layers: Vec<Vec<f64>> = (0..deep).into_par_iter().map(layer).collect();
    let inside = |[x, y, z]: [usize; 3]| layers[z][y * wide + x] < 0.0;

    let mut positions = Vec::new();
    let mut vertex = HashMap::new();
    let mut vertex_of = |cell: [usize; 3]| {
        *vertex.entry(cell).or_insert_with(|| {
            positions.push(corner(cell) + DVec3::splat(0.5 * side));
            positions.len() as u32 - 1
        })
    };
    let mut triangles = Vec::new();
    for at in 0..wide * tall * deep {
        let from = [at % wide, at / wide % tall, at / (wide * tall)];
        for axis in 0..3 {
            let mut to = from;
            to[axis] += 1;
            let (across, up) = ((axis + 1) % 3, (axis + 2) % 3);
            let on_the_rim = from[across] == 0 || from[up] == 0 || to[axis] >= [wide, tall, deep][axis];
            if on_the_rim || inside(from) == inside(to) {
                continue;
            }
            // The four cells about the edge, counter-clockwise as seen from its end.
            let around = [(1, 1), (0, 1), (0, 0), (1, 0)].map(|(back, down)| {
                let mut cell = from;
                cell[across] -= back;
                cell[up] -= down;
                vertex_of(cell)
            });
            let [a, b, c, d] =
                if inside(from) { around } else { [around[0], around[3], around[2], around[1]] };
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    positions.par_iter_mut().for_each(|position| *position = settled(*position, side, &distance));
    TriangleMesh::new(positions, triangles).expect("the surface crosses the box")
}

/// A point moved onto the surface, by no more than a cell.
fn settled(start: DVec3, side: f64, distance: &impl Fn(DVec3) -> f64) -> DVec3 {
    let mut point = start;
    for _ in 0..STEPS {
        let h = 1e-4 * side;
        let slope = |axis: DVec3| (distance(point + axis * h) - distance(point - axis * h)) / (2.0 * h);
        let gradient = DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z));
        let step = gradient * (distance(point) / gradient.length_squared().max(1e-3));
        point -= step.clamp_length_max(0.5 * side);
    }
    start + (point - start).clamp_length_max(side)
}
