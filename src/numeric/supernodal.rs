use glam::Vec3A;
use multiversion::multiversion;

use super::elimination::{Block, Elimination, LANES, Part};

/// Memory for solves, kept from one to the next.
#[derive(Debug, Clone, Default)]
pub struct SolveBuffer {
    parts: [PartBuffer; 3],
}

#[derive(Debug, Clone, Default)]
struct PartBuffer {
    /// The part's own unknowns, then the separator's, then one slot that padding rows write to.
    x: Vec<Vec3A>,
    dense: Vec<f32>,
}

/// Solves L L^T x = b in place, b `[N, 3]` in the mesh's order, with the blocks that [`super::factorization`] leaves of
/// each part; the two halves run in parallel.
pub(super) fn solve(
    elimination: &Elimination,
    values: &[Vec<f32>; 3],
    b: &mut [Vec3A],
    buffer: &mut SolveBuffer,
) {
    let Elimination { order, parts } = elimination;
    let SolveBuffer { parts: buffers } = buffer;
    for (part, buffer) in parts.iter().zip(&mut *buffers) {
        buffer.load(part, order, b);
    }
    let [first, second, top] = buffers;
    rayon::join(|| first.forward(&parts[0], &values[0]), || second.forward(&parts[1], &values[1]));
    let ends = parts.each_ref().map(|part| part.own.len());
    for k in 0..ends[2] {
        top.x[k] += first.x[ends[0] + k] + second.x[ends[1] + k];
    }
    top.forward(&parts[2], &values[2]);
    top.backward(&parts[2], &values[2]);
    for k in 0..ends[2] {
        first.x[ends[0] + k] = top.x[k];
        second.x[ends[1] + k] = top.x[k];
    }
    rayon::join(|| first.backward(&parts[0], &values[0]), || second.backward(&parts[1], &values[1]));
    for (part, buffer) in parts.iter().zip(&*buffers) {
        for (&v, &x) in order[part.own.clone()].iter().zip(&buffer.x) {
            b[v as usize] = x;
        }
    }
}

impl PartBuffer {
    fn load(&mut self, part: &Part, order: &[u32], b: &[Vec3A]) {
        let tallest = part.blocks.iter().map(|block| block.height).max().unwrap_or(0) as usize;
        self.dense.resize(4 * tallest, 0.0);
        self.x.clear();
        self.x.extend(order[part.own.clone()].iter().map(|&v| b[v as usize]));
        self.x.resize(part.own.len() + part.ext + 1, Vec3A::ZERO);
    }

    fn forward(&mut self, part: &Part, values: &[f32]) {
        forward(&part.blocks, &part.rows, values, &mut self.x, &mut self.dense);
    }

    fn backward(&mut self, part: &Part, values: &[f32]) {
        if let Some(padding) = self.x.last_mut() {
            *padding = Vec3A::ZERO;
        }
        backward(&part.blocks, &part.rows, values, &mut self.x, &mut self.dense);
    }
}

type Lanes = [f32; LANES];

#[inline(always)]
fn lanes(values: &[f32]) -> &Lanes {
    values.first_chunk().expect("blocks are padded to whole lanes")
}

#[inline(always)]
fn add_scaled(sum: &mut Lanes, values: &Lanes, scale: f32) {
    for lane in 0..LANES {
        sum[lane] += values[lane] * scale;
    }
}

#[inline(always)]
fn add_product(sum: &mut Lanes, a: &Lanes, b: &Lanes) {
    for lane in 0..LANES {
        sum[lane] += a[lane] * b[lane];
    }
}

/// L y = b, block after block: y_J = D b_J, then b -= (B D) b_J below.
#[multiversion(targets("x86_64+avx2"))]
fn forward(blocks: &[Block], rows: &[u32], values: &[f32], x: &mut [Vec3A], dense: &mut [f32]) {
    for block in blocks {
        let (width, height) = (block.width as usize, block.height as usize);
        let column = block.column as usize;
        let rows = &rows[block.rows_start as usize..][..height];
        let values = &values[block.values_start as usize..][..width * height];
        let own = &mut dense[..4 * width];
        for (own, x) in own.chunks_exact_mut(4).zip(&x[column..column + width]) {
            own.copy_from_slice(&[x.x, x.y, x.z, 0.0]);
        }
        for start in (0..height).step_by(LANES) {
            let mut sum = [[0.0; LANES]; 3];
            let filled = width.min(start + LANES);
            for (own, values) in own.chunks_exact(4).zip(values.chunks_exact(height)).take(filled) {
                let values = lanes(&values[start..]);
                add_scaled(&mut sum[0], values, own[0]);
                add_scaled(&mut sum[1], values, own[1]);
                add_scaled(&mut sum[2], values, own[2]);
            }
            for lane in 0..LANES {
                let value = Vec3A::new(sum[0][lane], sum[1][lane], sum[2][lane]);
                let target = &mut x[rows[start + lane] as usize];
                *target = if start + lane < width { value } else { *target - value };
            }
        }
    }
}

/// L^T x = y, block after block from the last: x_J = G^T [y_J; -x below].
#[multiversion(targets("x86_64+avx2"))]
fn backward(blocks: &[Block], rows: &[u32], values: &[f32], x: &mut [Vec3A], dense: &mut [f32]) {
    for block in blocks.iter().rev() {
        let (width, height) = (block.width as usize, block.height as usize);
        let column = block.column as usize;
        let rows = &rows[block.rows_start as usize..][..height];
        let values = &values[block.values_start as usize..][..width * height];
        let (dense_x, rest) = dense.split_at_mut(height);
        let (dense_y, rest) = rest.split_at_mut(height);
        let dense_z = &mut rest[..height];
        for (i, &row) in rows.iter().enumerate() {
            let value = if i < width { x[row as usize] } else { -x[row as usize] };
            dense_x[i] = value.x;
            dense_y[i] = value.y;
            dense_z[i] = value.z;
        }
        for (k, values) in values.chunks_exact(height).enumerate() {
            let mut sum = [[0.0; LANES]; 3];
            for start in (k / LANES * LANES..height).step_by(LANES) {
                let values = lanes(&values[start..]);
                add_product(&mut sum[0], values, lanes(&dense_x[start..]));
                add_product(&mut sum[1], values, lanes(&dense_y[start..]));
                add_product(&mut sum[2], values, lanes(&dense_z[start..]));
            }
            x[column + k] = Vec3A::from_array(sum.map(|sum| sum.iter().sum()));
        }
    }
}
