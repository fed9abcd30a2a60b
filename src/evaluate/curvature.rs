use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::Rows;

/// Where the conjugate gradient stops: the residual over the right-hand side, in the preconditioner's norm.
const TOLERANCE: f64 = 1e-7;
/// A bound on its steps; a scan takes some tens.
const MOST_STEPS: usize = 1000;
/// Twice a triangle's area below which it has no angles and is passed over.
const DEGENERATE: f64 = 1e-16;
/// Rows that are worked on by one thread: however many there are, the same are added up together.
const BLOCK: usize = 1 << 14;

/// Magnitude of the mean curvature at each vertex `[N]`, felt at a scale of about `sqrt(2 step)`: how far the second of
/// two implicit smoothing steps moves the vertex, divided by `step`.
///
/// A step solves `(M - step L) v' = M v` with the cotangent Laplacian L and the barycentric mass M.
pub(super) fn curvature(positions: &[DVec3], triangles: &[[u32; 3]], step: f64) -> Vec<f64> {
    let smoothing = Smoothing::new(positions, triangles, step);
    let once = smoothing.apply(positions);
    let twice = smoothing.apply(&once);
    once.iter().zip(&twice).map(|(a, b)| a.distance(*b) / step).collect()
}

/// One implicit smoothing step.
struct Smoothing {
    /// What `M - step L` has beside its diagonal, `[N, N]`, columns rising; rounded, which the diagonal takes into account.
    beside: Rows<(u32, f32)>,
    /// Its diagonal.
    diagonal: Vec<f64>,
    /// The diagonal of M: a third of the area around each vertex.
    mass: Vec<f64>,
}

impl Smoothing {
    fn new(positions: &[DVec3], triangles: &[[u32; 3]], step: f64) -> Self {
        let count = positions.len();
        let place = |v: u32| positions[v as usize];
        let (weights, areas): (Vec<[f64; 3]>, Vec<f64>) =
            triangles.par_iter().map(|corners| angles(corners.map(place), step / 2.0)).unzip();
        let mut mass = vec![0.0; count];
        for (corners, area) in triangles.iter().zip(areas) {
            corners.iter().for_each(|&corner| mass[corner as usize] += area / 3.0);
        }
        let beside = beside(count, triangles, &weights);
        let around = |row| -beside.row(row).iter().map(|&(_, value)| f64::from(value)).sum::<f64>();
        let mut diagonal: Vec<f64> = (0..count).map(around).collect();
        for (d, mass) in diagonal.iter_mut().zip(&mut mass) {
            // A vertex without area would be undetermined, and one in bad slivers may come out negative by rounding.
            if *d + *mass <= 0.0 {
                *mass += 1.0 - *d;
            }
            *d += *mass;
        }
        Self { beside, diagonal, mass }
    }

    /// Solves for the smoothed positions by conjugate gradients started at `v`; the three coordinates run side by side.
    fn apply(&self, v: &[DVec3]) -> Vec<DVec3> {
        let mut x = v.to_vec();
        let mut residual: Vec<DVec3> = v.iter().zip(&self.mass).map(|(&v, &m)| m * v).collect();
        let [mut conditioned, mut image] = [vec![DVec3::ZERO; v.len()], vec![DVec3::ZERO; v.len()]];
        let enough = self.precondition(&residual, &mut conditioned) * TOLERANCE * TOLERANCE;
        self.product(v, &mut image);
        each(&mut residual, |i, r| *r -= image[i]);
        let mut left = self.precondition(&residual, &mut conditioned);
        let mut direction = conditioned.clone();
        for _ in 0..MOST_STEPS {
            if left.cmple(enough).all() {
                break;
            }
            let length = ratio(left, self.product(&direction, &mut image));
            each(&mut x, |i, x| *x += length * direction[i]);
            each(&mut residual, |i, r| *r -= length * image[i]);
            let remaining = self.precondition(&residual, &mut conditioned);
            let keep = ratio(remaining, left);
            each(&mut direction, |i, d| *d = conditioned[i] + keep * *d);
            left = remaining;
        }
        x
    }

    /// The matrix times `x`, and that times `x`.
    fn product(&self, x: &[DVec3], image: &mut [DVec3]) -> DVec3 {
        blocks(image, |begin, image| {
            let mut sum = DVec3::ZERO;
            for (row, image) in (begin..).zip(image) {
                let beside = |&(at, value): &(u32, f32)| f64::from(value) * x[at as usize];
                *image = self.diagonal[row] * x[row] + self.beside.row(row).iter().map(beside).sum::<DVec3>();
                sum += x[row] * *image;
            }
            sum
        })
    }

    /// One sweep of Gauss-Seidel down the rows of each block and one up, from zero: symmetric, as conjugate gradients
    /// ask. Returns the result times `r`.
    fn precondition(&self, r: &[DVec3], result: &mut [DVec3]) -> DVec3 {
        blocks(result, |begin, z| {
            for k in 0..z.len() {
                let mut sum = r[begin + k];
                for &(at, value) in self.beside.row(begin + k) {
                    let at = at as usize;
                    if at >= begin + k {
                        break;
                    }
                    if at >= begin {
                        sum -= f64::from(value) * z[at - begin];
                    }
                }
                z[k] = sum / self.diagonal[begin + k];
            }
            let mut product = DVec3::ZERO;
            for k in (0..z.len()).rev() {
                let mut sum = DVec3::ZERO;
                for &(at, value) in self.beside.row(begin + k).iter().rev() {
                    let at = at as usize;
                    if at <= begin + k {
                        break;
                    }
                    if at < begin + z.len() {
                        sum += f64::from(value) * z[at - begin];
                    }
                }
                z[k] -= sum / self.diagonal[begin + k];
                product += z[k] * r[begin + k];
            }
            product
        })
    }
}

/// Works on the blocks of a vector, each with where it begins, and adds up what comes of them, in their order.
fn blocks(vector: &mut [DVec3], work: impl Fn(usize, &mut [DVec3]) -> DVec3 + Sync) -> DVec3 {
    let numbered = vector.par_chunks_mut(BLOCK).enumerate();
    let sums: Vec<DVec3> = numbered.map(|(block, part)| work(block * BLOCK, part)).collect();
    sums.into_iter().sum()
}

fn each(vector: &mut [DVec3], change: impl Fn(usize, &mut DVec3) + Sync) {
    vector.par_iter_mut().with_min_len(BLOCK).enumerate().for_each(|(i, value)| change(i, value));
}

/// The rows of the symmetric matrix that has minus each triangle's weights at its sides, those opposite its corners;
/// columns rising, those of one place added up.
fn beside(count: usize, triangles: &[[u32; 3]], weights: &[[f64; 3]]) -> Rows<(u32, f32)> {
    let sides = triangles.iter().zip(weights).flat_map(|(&[a, b, c], &[of_a, of_b, of_c])| {
        let sides = [(b, c, of_a), (c, b, of_a), (c, a, of_b), (a, c, of_b), (a, b, of_c), (b, a, of_c)];
        sides.map(|(row, column, weight)| (row, (column, weight)))
    });
    let sides = sides.filter(|&(row, (column, _))| row != column);
    let by_row = Rows::from_pairs(count, sides);
    let mut own = Vec::new();
    let mut merged: Vec<(u32, (u32, f32))> = Vec::with_capacity(3 * triangles.len() + count);
    for row in 0..count {
        own.clear();
        own.extend_from_slice(by_row.row(row));
        // Stable, so that what adds up does so in one order.
        own.sort_by_key(|&(column, _)| column);
        for one in own.chunk_by(|one, next| one.0 == next.0) {
            let sum: f64 = one.iter().map(|&(_, weight)| weight).sum();
            merged.push((row as u32, (one[0].0, -sum as f32)));
        }
    }
    Rows::from_pairs(count, merged.iter().copied())
}

/// The cotangents of a triangle's angles, each times `factor`, and its area; zeros if it is degenerate.
fn angles([a, b, c]: [DVec3; 3], factor: f64) -> ([f64; 3], f64) {
    let twice_area = (b - a).cross(c - a).length();
    if twice_area < DEGENERATE {
        return ([0.0; 3], 0.0);
    }
    let cotangents = [(b - a).dot(c - a), (c - b).dot(a - b), (a - c).dot(b - c)];
    (cotangents.map(|d| factor * d / twice_area), twice_area / 2.0)
}

/// `a / b` per coordinate, and zero where a coordinate is already solved.
fn ratio(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::select(b.cmpeq(DVec3::ZERO), DVec3::ZERO, a / b)
}
