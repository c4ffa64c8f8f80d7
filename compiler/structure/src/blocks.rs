//! The plan for solving a system block by block: plain data with a stable text form.
//!
//! A block is a set of equations together with the unknowns they determine; blocks stand in solution order, so that
//! each needs only unknowns of itself and of earlier blocks.  Made by [`crate::components::block_order`], stored flat
//! because most blocks of a large model hold one equation.

use crate::graph::{Column, Row};
use hyd_index::{IndexVec, TypedIndex, typed_index};
use std::fmt;
use std::ops::Range;

typed_index!(
    /// A block of the block lower triangular form, numbered in solution order.
    Block,
    "block"
);

/// Blocks in solution order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BlockPlan {
    /// Block `k` covers the positions `starts[k]..starts[k + 1]` of `rows` and `columns`; one longer than blocks.
    pub starts: Vec<u32>,
    /// The equations, block by block, ascending within each.
    pub rows: Vec<Row>,
    /// The unknown matched to the equation at the same position.
    pub columns: Vec<Column>,
}

impl BlockPlan {
    /// Number of blocks.
    pub fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// True without blocks.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All blocks in solution order.
    pub fn blocks(&self) -> impl DoubleEndedIterator<Item = Block> + use<> {
        (0..self.len()).map(Block::new)
    }

    /// The equations of a block and, position by position, the unknowns they are matched to.
    pub fn block(&self, block: Block) -> (&[Row], &[Column]) {
        let range = self.range(block);
        (&self.rows[range.clone()], &self.columns[range])
    }

    /// The block of each equation (for a plan over all rows `0..n`).
    pub fn block_of_row(&self) -> IndexVec<Row, Block> {
        let mut table = IndexVec::filled(Block(0), self.rows.len());
        for block in self.blocks() {
            for &row in self.block(block).0 {
                table[row] = block;
            }
        }
        table
    }

    fn range(&self, block: Block) -> Range<usize> {
        self.starts[block.index()] as usize..self.starts[block.index() + 1] as usize
    }
}

/// One line `block0: eq2=v2 eq5=v1` per block.
impl fmt::Display for BlockPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for block in self.blocks() {
            write!(f, "{block}:")?;
            let (rows, columns) = self.block(block);
            for (row, column) in rows.iter().zip(columns) {
                write!(f, " {row}={column}")?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}
