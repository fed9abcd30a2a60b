use std::ops::Range;

use glam::Vec3A;
use multiversion::multiversion;

use super::Dissection;

/// Rows handled at once: one AVX register, two SSE registers; fixed, so that sums do not depend on the processor.
const LANES: usize = 8;

/// A lower-triangular factor L by columns, row indices ascending, the diagonal first.
pub struct ColumnFactor<'a> {
    /// Where each column begins `[N + 1]`.
    pub starts: &'a [usize],
    /// Row index of each entry.
    pub rows: &'a [usize],
    /// Value of each entry.
    pub values: &'a [f64],
}

/// Memory for solves, kept from one to the next.
#[derive(Debug, Clone, Default)]
pub struct SolveBuffer {
    first: PartBuffer,
    second: PartBuffer,
    top: PartBuffer,
}

#[derive(Debug, Clone, Default)]
struct PartBuffer {
    /// The part's own unknowns, then the separator's, then one slot that padding rows write to.
    x: Vec<Vec3A>,
    dense: Vec<f32>,
}

/// L as dense blocks of columns that share their rows, stored as G = [D; B D], where D is the inverse of a block's
/// triangle and B what lies below it: then a solve is matrix products only.
#[derive(Debug, Clone)]
pub struct SupernodalFactor {
    first: Part,
    second: Part,
    top: Part,
}

/// The blocks of one half of the dissection, or of its separator.
#[derive(Debug, Clone)]
struct Part {
    /// Places of the order that this part solves for.
    own: Range<usize>,
    /// Unknowns of the separator behind the own ones.
    ext: usize,
    blocks: Vec<Block>,
    rows: Vec<u32>,
    values: Vec<f32>,
}

#[derive(Debug, Clone, Copy)]
struct Block {
    column: u32,
    width: u32,
    /// Rows including the block's own, padded to a multiple of [`LANES`].
    height: u32,
    rows_start: u32,
    values_start: u32,
}

/// Columns `column..column + width` and the rows below them that any of the columns touches.
struct ColumnGroup {
    column: usize,
    width: usize,
    below: Vec<usize>,
}

impl ColumnGroup {
    /// Cost of a solve with this block, in units of one multiplied entry.
    fn cost(width: usize, below: usize) -> f64 {
        let height = (width + below).next_multiple_of(LANES);
        6.0 * height as f64 + (width * height) as f64 + 40.0
    }
}

impl SupernodalFactor {
    /// Packs the columns of a factor made in the order of `dissection`.
    pub fn new(columns: &ColumnFactor, dissection: &Dissection) -> Self {
        let [first, second, top] =
            dissection.parts().map(|own| Part::new(columns, own, dissection.separator));
        Self { first, second, top }
    }

    /// Solves L L^T x = b in place, b `[N, 3]` in the mesh's order; the two halves run in parallel.
    pub fn solve(&self, order: &[u32], b: &mut [Vec3A], buffer: &mut SolveBuffer) {
        let SolveBuffer { first, second, top } = buffer;
        self.first.load(order, b, first);
        self.second.load(order, b, second);
        self.top.load(order, b, top);
        rayon::join(|| self.first.forward(first), || self.second.forward(second));
        for k in 0..self.top.own.len() {
            top.x[k] += first.x[self.first.own.len() + k] + second.x[self.second.own.len() + k];
        }
        self.top.forward(top);
        self.top.backward(top);
        for k in 0..self.top.own.len() {
            first.x[self.first.own.len() + k] = top.x[k];
            second.x[self.second.own.len() + k] = top.x[k];
        }
        rayon::join(|| self.first.backward(first), || self.second.backward(second));
        self.first.store(order, b, first);
        self.second.store(order, b, second);
        self.top.store(order, b, top);
    }
}

impl Part {
    fn new(columns: &ColumnFactor, own: Range<usize>, separator: usize) -> Self {
        let total = columns.starts.len() - 1;
        let ext = if own.start == separator { 0 } else { total - separator };
        let mut part =
            Self { own: own.clone(), ext, blocks: Vec::new(), rows: Vec::new(), values: Vec::new() };
        for group in column_groups(columns, own) {
            part.push(columns, &group, separator);
        }
        part
    }

    /// Index of an unknown in the part's buffer.
    fn local(&self, row: usize, separator: usize) -> usize {
        if self.own.contains(&row) { row - self.own.start } else { self.own.len() + row - separator }
    }

    fn push(&mut self, columns: &ColumnFactor, group: &ColumnGroup, separator: usize) {
        let (width, used) = (group.width, group.width + group.below.len());
        let height = used.next_multiple_of(LANES);
        self.blocks.push(Block {
            column: (group.column - self.own.start) as u32,
            width: width as u32,
            height: height as u32,
            rows_start: self.rows.len() as u32,
            values_start: self.values.len() as u32,
        });
        let rows = (group.column..group.column + width).chain(group.below.iter().copied());
        for row in rows {
            self.rows.push(self.local(row, separator) as u32);
        }
        let padding = (self.own.len() + self.ext) as u32;
        self.rows.extend(std::iter::repeat_n(padding, height - used));
        self.values.extend(solved_block(&dense_block(columns, group, height), width, height));
    }

    fn load(&self, order: &[u32], b: &[Vec3A], buffer: &mut PartBuffer) {
        let tallest = self.blocks.iter().map(|block| block.height).max().unwrap_or(0) as usize;
        buffer.dense.resize(4 * tallest, 0.0);
        buffer.x.clear();
        buffer.x.extend(order[self.own.clone()].iter().map(|&v| b[v as usize]));
        buffer.x.resize(self.own.len() + self.ext + 1, Vec3A::ZERO);
    }

    fn store(&self, order: &[u32], b: &mut [Vec3A], buffer: &PartBuffer) {
        for (&v, &x) in order[self.own.clone()].iter().zip(&buffer.x) {
            b[v as usize] = x;
        }
    }

    fn forward(&self, buffer: &mut PartBuffer) {
        forward(&self.blocks, &self.rows, &self.values, &mut buffer.x, &mut buffer.dense);
    }

    fn backward(&self, buffer: &mut PartBuffer) {
        if let Some(padding) = buffer.x.last_mut() {
            *padding = Vec3A::ZERO;
        }
        backward(&self.blocks, &self.rows, &self.values, &mut buffer.x, &mut buffer.dense);
    }
}

/// Columns with the same rows below, joined further where padding them to a common shape costs less than it saves.
fn column_groups(columns: &ColumnFactor, own: Range<usize>) -> Vec<ColumnGroup> {
    let mut groups: Vec<ColumnGroup> = Vec::new();
    for column in own {
        let below = &columns.rows[columns.starts[column] + 1..columns.starts[column + 1]];
        groups.push(ColumnGroup { column, width: 1, below: below.to_vec() });
        while let [.., child, parent] = &groups[..] {
            let mut below: Vec<usize> =
                child.below.iter().copied().filter(|&r| r >= parent.column + parent.width).collect();
            below.extend(&parent.below);
            below.sort_unstable();
            below.dedup();
            let joined = ColumnGroup::cost(child.width + parent.width, below.len());
            let apart = ColumnGroup::cost(child.width, child.below.len())
                + ColumnGroup::cost(parent.width, parent.below.len());
            if joined > apart {
                break;
            }
            let merged = ColumnGroup { column: child.column, width: child.width + parent.width, below };
            groups.truncate(groups.len() - 2);
            groups.push(merged);
        }
    }
    groups
}

/// The columns of a group as a dense matrix, column after column of `height`.
fn dense_block(columns: &ColumnFactor, group: &ColumnGroup, height: usize) -> Vec<f64> {
    let mut dense = vec![0.0; group.width * height];
    for k in 0..group.width {
        let column = group.column + k;
        for entry in columns.starts[column]..columns.starts[column + 1] {
            let row = columns.rows[entry];
            let at = if row < group.column + group.width {
                row - group.column
            } else {
                group.width + group.below.partition_point(|&r| r < row)
            };
            dense[k * height + at] = columns.values[entry];
        }
    }
    dense
}

/// [T; B] to [T^-1; B T^-1] for a lower triangle T.
fn solved_block(dense: &[f64], width: usize, height: usize) -> Vec<f32> {
    let mut inverse = vec![0.0; width * width];
    for k in 0..width {
        inverse[k * width + k] = 1.0 / dense[k * height + k];
        for i in k + 1..width {
            let sum: f64 = (k..i).map(|m| dense[m * height + i] * inverse[k * width + m]).sum();
            inverse[k * width + i] = -sum / dense[i * height + i];
        }
    }
    let mut solved = vec![0.0; width * height];
    for k in 0..width {
        for i in 0..height {
            solved[k * height + i] = if i < width {
                inverse[k * width + i] as f32
            } else {
                (k..width).map(|m| dense[m * height + i] * inverse[k * width + m]).sum::<f64>() as f32
            };
        }
    }
    solved
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
