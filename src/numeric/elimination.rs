use std::ops::Range;

use glam::Vec3A;
use nalgebra_sparse::factorization::CscSymbolicCholesky;
use nalgebra_sparse::pattern::SparsityPattern;

use super::Dissection;
use super::cholesky::SymmetricMatrix;
use crate::mesh::Topology;

/// Rows handled at once: one AVX register, two SSE registers; fixed, so that sums do not depend on the processor.
pub(super) const LANES: usize = 8;

/// The row of a block that has no such row: nothing is ever added there.
pub(super) const NO_ROW: u32 = u32::MAX;

/// How the unknowns of a mesh are eliminated: their order, and the dense blocks that a Cholesky factor of any matrix
/// with the mesh's sparsity consists of. Made once, then factored with many values.
#[derive(Debug, Clone)]
pub struct Elimination {
    /// The two halves of the dissection, then its separator.
    pub(super) parts: [Part; 3],
    /// The vertex at each place of the order `[N]`.
    pub order: Vec<u32>,
}

/// The blocks of one half of the dissection, or of its separator.
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// Places of the order that this part solves for.
    pub own: Range<usize>,
    /// Unknowns of the separator behind the own ones.
    pub ext: usize,
    pub blocks: Vec<Block>,
    /// Of each block, where its rows are among the own unknowns, then the separator's, then one that padding names.
    pub rows: Vec<u32>,
    /// Entries of all blocks.
    pub values: usize,
    /// Where values of the matrix go: the place among the diagonal's, then the edges', and that among the entries.
    pub entries: Vec<[u32; 2]>,
    pub updates: Updates,
}

/// Columns that share their rows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub column: u32,
    pub width: u32,
    /// Rows including the block's own.
    pub used: u32,
    /// The same padded to a multiple of [`LANES`].
    pub height: u32,
    pub rows_start: u32,
    pub values_start: u32,
}

/// What the blocks of a part change once their columns are done.
#[derive(Debug, Clone, Default)]
pub(super) struct Updates {
    all: Vec<Update>,
    /// Where those of each block begin `[blocks + 1]`.
    starts: Vec<u32>,
    places: Vec<u32>,
}

/// Rows of a block that are columns of another, or of the separator: their products with all the rows after them are
/// taken from it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Update {
    /// The other block of the part; none for the separator.
    pub block: Option<u32>,
    /// The first of the rows.
    pub first: u32,
    /// How many.
    pub count: u32,
    /// Where the places begin.
    places_start: u32,
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

    fn rows(&self) -> impl Iterator<Item = usize> {
        (self.column..self.column + self.width).chain(self.below.iter().copied())
    }
}

impl Elimination {
    /// The elimination for triangles whose positions `[N, 3]` show which vertices are near each other.
    pub fn new(topology: &Topology, positions: &[Vec3A]) -> Self {
        let dissection = Dissection::new(topology, positions);
        let mut place = vec![0; dissection.order.len()];
        for (i, &v) in dissection.order.iter().enumerate() {
            place[v as usize] = i;
        }
        let ones =
            SymmetricMatrix { diagonal: vec![1.0; place.len()], edges: vec![1.0; topology.edges.len()] };
        let symbolic =
            CscSymbolicCholesky::factor(ones.in_order(topology, &dissection.order).pattern().clone());
        let parts = dissection.parts().map(|own| {
            let groups = column_groups(symbolic.l_pattern(), own.clone());
            let mut part = Part::new(&groups, own, dissection.separator, place.len());
            part.entries = part.entries(topology, &place, dissection.separator);
            part.updates = Updates::of(&part);
            part
        });
        Self { parts, order: dissection.order }
    }
}

impl Part {
    fn new(groups: &[ColumnGroup], own: Range<usize>, separator: usize, total: usize) -> Self {
        let ext = if own.start == separator { 0 } else { total - separator };
        let (mut blocks, mut rows, mut values) = (Vec::new(), Vec::new(), 0);
        for group in groups {
            let used = group.width + group.below.len();
            let height = used.next_multiple_of(LANES);
            blocks.push(Block {
                column: (group.column - own.start) as u32,
                width: group.width as u32,
                used: used as u32,
                height: height as u32,
                rows_start: rows.len() as u32,
                values_start: values as u32,
            });
            rows.extend(group.rows().map(|row| local(&own, separator, row) as u32));
            rows.extend(std::iter::repeat_n((own.len() + ext) as u32, height - used));
            values += group.width * height;
        }
        Self { own, ext, blocks, rows, values, entries: Vec::new(), updates: Updates::default() }
    }

    /// The rows of a block, without its padding.
    pub fn rows(&self, block: &Block) -> &[u32] {
        &self.rows[block.rows_start as usize..][..block.used as usize]
    }

    /// For each own column its block.
    fn block_of_column(&self) -> Vec<u32> {
        let of_block = |(at, block): (usize, &Block)| std::iter::repeat_n(at as u32, block.width as usize);
        self.blocks.iter().enumerate().flat_map(of_block).collect()
    }

    fn entries(&self, topology: &Topology, place: &[usize], separator: usize) -> Vec<[u32; 2]> {
        let block_of_column = self.block_of_column();
        let mut entries = Vec::new();
        let mut add = |source: usize, a: usize, b: usize| {
            let (column, row) = (a.min(b), a.max(b));
            if !self.own.contains(&column) {
                return;
            }
            let row = local(&self.own, separator, row);
            let column = column - self.own.start;
            let block = &self.blocks[block_of_column[column] as usize];
            let at = self.rows(block).partition_point(|&other| (other as usize) < row);
            let value =
                block.values_start as usize + (column - block.column as usize) * block.height as usize;
            entries.push([source as u32, (value + at) as u32]);
        };
        for (v, &at) in place.iter().enumerate() {
            add(v, at, at);
        }
        for (e, &[a, b]) in topology.edges.iter().enumerate() {
            add(place.len() + e, place[a as usize], place[b as usize]);
        }
        entries.sort_unstable_by_key(|&[_, value]| value);
        entries
    }
}

/// Where a part has an unknown of the order: its own first, then the separator's.
fn local(own: &Range<usize>, separator: usize, row: usize) -> usize {
    if own.contains(&row) { row - own.start } else { own.len() + row - separator }
}

impl Updates {
    fn of(part: &Part) -> Self {
        let block_of_column = part.block_of_column();
        let block_of = |row: u32| block_of_column.get(row as usize).copied();
        let mut updates = Self::default();
        for block in &part.blocks {
            updates.starts.push(updates.all.len() as u32);
            let mut rows = &part.rows(block)[block.width as usize..];
            let mut first = block.width;
            while let Some(&row) = rows.first() {
                let block = block_of(row);
                let count = rows.iter().take_while(|&&row| block_of(row) == block).count();
                let places_start = updates.places.len() as u32;
                updates.all.push(Update { block, first, count: count as u32, places_start });
                match block.map(|block| part.rows(&part.blocks[block as usize])) {
                    Some(theirs) => {
                        let place = |row| theirs.binary_search(row).map_or(NO_ROW, |at| at as u32);
                        updates.places.extend(rows.iter().map(place));
                    }
                    None => updates.places.extend(rows.iter().map(|row| row - part.own.len() as u32)),
                }
                (rows, first) = (&rows[count..], first + count as u32);
            }
        }
        updates.starts.push(updates.all.len() as u32);
        updates
    }

    /// What a block changes.
    pub fn of_block(&self, block: usize) -> &[Update] {
        &self.all[self.starts[block] as usize..self.starts[block + 1] as usize]
    }

    /// For the rows of an update and all rows of its block after them, their places in the target's rows.
    pub fn places(&self, update: &Update) -> &[u32] {
        &self.places[update.places_start as usize..]
    }
}

/// Columns with the same rows below, joined further where padding them to a common shape costs less than it saves.
fn column_groups(factor: &SparsityPattern, own: Range<usize>) -> Vec<ColumnGroup> {
    let mut groups: Vec<ColumnGroup> = Vec::new();
    for column in own {
        groups.push(ColumnGroup { column, width: 1, below: factor.lane(column)[1..].to_vec() });
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
