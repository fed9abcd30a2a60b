use glam::DVec3;

use crate::mesh::Rows;

/// Where the conjugate gradient stops: the residual over the right-hand side, in the preconditioner's norm.
const TOLERANCE: f64 = 1e-7;
/// A bound on its steps; a scan takes some tens.
const MOST_STEPS: usize = 1000;
/// Twice a triangle's area below which it has no angles and is passed over.
const DEGENERATE: f64 = 1e-16;

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
    /// `M - step L`, `[N, N]`, with the columns of each row in rising order.
    matrix: Rows<(u32, f64)>,
    /// One over its diagonal.
    inverse: Vec<f64>,
    /// The diagonal of M: a third of the area around each vertex.
    mass: Vec<f64>,
}

impl Smoothing {
    fn new(positions: &[DVec3], triangles: &[[u32; 3]], step: f64) -> Self {
        let count = positions.len();
        let mut entries = Vec::with_capacity(6 * triangles.len() + count);
        let mut mass = vec![0.0; count];
        let mut diagonal = vec![0.0; count];
        for corners in triangles {
            let (cotangents, area) = angles(corners.map(|v| positions[v as usize]));
            for k in 0..3 {
                let [at, from, to] = [0, 1, 2].map(|turn| corners[(k + turn) % 3] as usize);
                let weight = step / 2.0 * cotangents[k];
                entries.push(([from as u32, to as u32], -weight));
                entries.push(([to as u32, from as u32], -weight));
                diagonal[from] += weight;
                diagonal[to] += weight;
                mass[at] += area / 3.0;
            }
        }
        for (d, mass) in diagonal.iter_mut().zip(&mut mass) {
            // A vertex without area would be undetermined, and one in bad slivers may come out negative by rounding.
            if *d + *mass <= 0.0 {
                *mass += 1.0 - *d;
            }
            *d += *mass;
        }
        for (at, &d) in diagonal.iter().enumerate() {
            entries.push(([at as u32; 2], d));
        }
        let inverse = diagonal.iter().map(|d| 1.0 / d).collect();
        Self { matrix: rows(count, entries), inverse, mass }
    }

    /// Solves for the smoothed positions by conjugate gradients started at `v`; the three coordinates run side by side.
    fn apply(&self, v: &[DVec3]) -> Vec<DVec3> {
        let wanted: Vec<DVec3> = v.iter().zip(&self.mass).map(|(&v, &m)| m * v).collect();
        let enough = dot(&wanted, &self.preconditioned(&wanted)) * TOLERANCE * TOLERANCE;

        let mut x = v.to_vec();
        let mut residual: Vec<DVec3> = wanted.iter().zip(self.product(&x)).map(|(&b, y)| b - y).collect();
        let mut direction = self.preconditioned(&residual);
        let mut left = dot(&residual, &direction);
        for _ in 0..MOST_STEPS {
            if left.cmple(enough).all() {
                break;
            }
            let image = self.product(&direction);
            let length = ratio(left, dot(&direction, &image));
            for (k, x) in x.iter_mut().enumerate() {
                *x += length * direction[k];
                residual[k] -= length * image[k];
            }
            let conditioned = self.preconditioned(&residual);
            let remaining = dot(&residual, &conditioned);
            let keep = ratio(remaining, left);
            direction.iter_mut().zip(conditioned).for_each(|(d, z)| *d = z + keep * *d);
            left = remaining;
        }
        x
    }

    /// The matrix times `x`.
    fn product(&self, x: &[DVec3]) -> Vec<DVec3> {
        let row = |row| self.matrix.row(row).iter().map(|&(at, value)| value * x[at as usize]).sum();
        (0..self.matrix.len()).map(row).collect()
    }

    /// One sweep of Gauss-Seidel down the rows and one up, from zero: symmetric, as conjugate gradients ask.
    fn preconditioned(&self, r: &[DVec3]) -> Vec<DVec3> {
        let mut z = r.to_vec();
        for row in 0..z.len() {
            let mut sum = r[row];
            for &(at, value) in self.matrix.row(row) {
                if at as usize >= row {
                    break;
                }
                sum -= value * z[at as usize];
            }
            z[row] = sum * self.inverse[row];
        }
        for row in (0..z.len()).rev() {
            let mut sum = DVec3::ZERO;
            for &(at, value) in self.matrix.row(row).iter().rev() {
                if at as usize <= row {
                    break;
                }
                sum += value * z[at as usize];
            }
            z[row] -= sum * self.inverse[row];
        }
        z
    }
}

/// The rows of a square matrix, columns rising, from entries `([row, column], value)`; those of one place add up.
fn rows(count: usize, mut entries: Vec<([u32; 2], f64)>) -> Rows<(u32, f64)> {
    // Stable, so that what adds up does so in one order.
    entries.sort_by_key(|&(place, _)| place);
    entries.dedup_by(|next, sum| {
        let same = next.0 == sum.0;
        sum.1 += if same { next.1 } else { 0.0 };
        same
    });
    let pairs: Vec<_> = entries.into_iter().map(|([row, column], value)| (row, (column, value))).collect();
    Rows::from_pairs(count, pairs.iter().copied())
}

/// The cotangents of a triangle's angles and its area; zeros if it is degenerate.
fn angles([a, b, c]: [DVec3; 3]) -> ([f64; 3], f64) {
    let twice_area = (b - a).cross(c - a).length();
    if twice_area < DEGENERATE {
        return ([0.0; 3], 0.0);
    }
    let cotangents = [(b - a).dot(c - a), (c - b).dot(a - b), (a - c).dot(b - c)];
    (cotangents.map(|d| d / twice_area), twice_area / 2.0)
}

fn dot(a: &[DVec3], b: &[DVec3]) -> DVec3 {
    a.iter().zip(b).map(|(&a, &b)| a * b).sum()
}

/// `a / b` per coordinate, and zero where a coordinate is already solved.
fn ratio(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::select(b.cmpeq(DVec3::ZERO), DVec3::ZERO, a / b)
}
