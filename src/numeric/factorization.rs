use multiversion::multiversion;

use super::cholesky::{NotPositiveDefinite, SymmetricMatrix};
use super::elimination::{Block, Elimination, NO_ROW, Part};

/// A Cholesky factor L by blocks of columns that share their rows, stored as G = [D; B D], where D is the inverse of a
/// block's triangle and B what lies below it: then a solve is matrix products only. Found in double precision, right-looking:
/// what a block takes from later columns is subtracted from them once its own are done. The two halves run in parallel.
pub(super) fn factor(
    elimination: &Elimination,
    matrix: &SymmetricMatrix,
) -> Result<[Vec<f32>; 3], NotPositiveDefinite> {
    let [first, second, top] = &elimination.parts;
    let (a, b) = rayon::join(|| factor_half(first, matrix), || factor_half(second, matrix));
    let ((a, of_a), (b, of_b)) = (a?, b?);
    let mut values = scattered(top, matrix);
    for block in &top.blocks {
        for k in 0..block.width as usize {
            let column = &mut values[block.values_start as usize + k * block.height as usize..];
            let taken = (block.column as usize + k) * top.own.len();
            for (value, &row) in column.iter_mut().zip(top.rows(block)).skip(k) {
                *value += of_a[taken + row as usize] + of_b[taken + row as usize];
            }
        }
    }
    Ok([a, b, finish(top, values, &mut [])?])
}

/// The blocks of a half, and what it adds to the separator's columns.
fn factor_half(part: &Part, matrix: &SymmetricMatrix) -> Result<(Vec<f32>, Vec<f64>), NotPositiveDefinite> {
    let mut added = vec![0.0; part.ext * part.ext];
    Ok((finish(part, scattered(part, matrix), &mut added)?, added))
}

/// The entries of a part's blocks before anything is eliminated.
fn scattered(part: &Part, matrix: &SymmetricMatrix) -> Vec<f64> {
    let mut values = vec![0.0; part.values];
    for &[source, value] in &part.entries {
        let (source, n) = (source as usize, matrix.diagonal.len());
        values[value as usize] = if source < n { matrix.diagonal[source] } else { matrix.edges[source - n] };
    }
    values
}

fn finish(part: &Part, mut values: Vec<f64>, added: &mut [f64]) -> Result<Vec<f32>, NotPositiveDefinite> {
    let mut solved = vec![0.0; values.len()];
    if !eliminate(part, &mut values, added, &mut solved) {
        return Err(NotPositiveDefinite);
    }
    Ok(solved)
}

/// Factors a part; `added` gets what it adds to the separator's columns. Says whether there is a factor.
#[multiversion(targets("x86_64+avx2"))]
fn eliminate(part: &Part, values: &mut [f64], added: &mut [f64], solved: &mut [f32]) -> bool {
    let (mut product, mut inverse) = (Vec::new(), Vec::new());
    for (at, block) in part.blocks.iter().enumerate() {
        let start = block.values_start as usize;
        let end = start + (block.width * block.height) as usize;
        let (done, later) = values.split_at_mut(end);
        let (own, rows) = (&mut done[start..], block.used as usize);
        if !factor_block(own, block, rows) {
            return false;
        }
        for update in part.updates.of_block(at) {
            let first = update.first as usize;
            let places = &part.updates.places(update)[..rows - first];
            for c in 0..update.count as usize {
                multiply(own, block, first + c, rows, &mut product);
                let (column, places) = (places[c] as usize, &places[c..]);
                let target = match update.block.map(|other| &part.blocks[other as usize]) {
                    Some(other) => {
                        let height = other.height as usize;
                        &mut later[other.values_start as usize + column * height - end..][..height]
                    }
                    None => &mut added[column * part.ext..][..part.ext],
                };
                for (product, &place) in product.iter().zip(places) {
                    if place != NO_ROW {
                        target[place as usize] -= product;
                    }
                }
            }
        }
        solve_block(own, block, &mut inverse, &mut solved[start..end]);
    }
    true
}

/// The factor of a block's columns; says whether there is one.
#[inline(always)]
fn factor_block(values: &mut [f64], block: &Block, rows: usize) -> bool {
    let (width, height) = (block.width as usize, block.height as usize);
    for k in 0..width {
        let (done, later) = values.split_at_mut((k + 1) * height);
        let column = &mut done[k * height..][..rows];
        let root = column[k].sqrt();
        if root.is_nan() || root <= 0.0 {
            return false;
        }
        column[k] = root;
        column[k + 1..].iter_mut().for_each(|value| *value /= root);
        for (j, other) in (k + 1..width).zip(later.chunks_exact_mut(height)) {
            add_scaled(&mut other[j..rows], &column[j..], -column[j]);
        }
    }
    true
}

/// The products of one row of a block with itself and all rows after it.
#[inline(always)]
fn multiply(values: &[f64], block: &Block, row: usize, rows: usize, product: &mut Vec<f64>) {
    let height = block.height as usize;
    product.clear();
    product.resize(rows - row, 0.0);
    let mut fours = values.chunks_exact(4 * height);
    for columns in &mut fours {
        let column = |k: usize| &columns[k * height + row..][..product.len()];
        let (a, b, c, d) = (column(0), column(1), column(2), column(3));
        let (a0, b0, c0, d0) = (a[0], b[0], c[0], d[0]);
        for (i, product) in product.iter_mut().enumerate() {
            *product += (a0 * a[i] + b0 * b[i]) + (c0 * c[i] + d0 * d[i]);
        }
    }
    for column in fours.remainder().chunks_exact(height) {
        let column = &column[row..rows];
        add_scaled(product, column, column[0]);
    }
}

/// [T; B] to [T^-1; B T^-1] for a block's lower triangle T.
#[inline(always)]
fn solve_block(values: &[f64], block: &Block, inverse: &mut Vec<f64>, solved: &mut [f32]) {
    let (width, height) = (block.width as usize, block.height as usize);
    // Column k solves T x = e_k as far as the triangle goes; below it, the same steps leave -B x.
    for k in 0..width {
        inverse.clear();
        inverse.resize(height, 0.0);
        inverse[k] = 1.0;
        for (m, column) in values.chunks_exact(height).enumerate().skip(k) {
            let x = inverse[m] / column[m];
            inverse[m] = x;
            add_scaled(&mut inverse[m + 1..], &column[m + 1..], -x);
        }
        for (i, (solved, &x)) in solved[k * height..][..height].iter_mut().zip(&*inverse).enumerate() {
            *solved = if i < width { x } else { -x } as f32;
        }
    }
}

#[inline(always)]
fn add_scaled(sum: &mut [f64], values: &[f64], scale: f64) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += value * scale;
    }
}
