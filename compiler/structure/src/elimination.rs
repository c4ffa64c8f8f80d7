//! The elimination behind [`crate::tearing`]: orders one block, choosing what to tear.
//!
//! Works on positions within the block.  A row is *open* until it is assigned or given up as a residual, a column
//! until it is assigned or torn.  Per open row the open columns are counted, per open column the open rows, each also
//! restricted to solvable entries; a count that drops to one or a solvable count that drops to none makes the vertex
//! *ready*.  Every entry is touched a bounded number of times.  Scores and a heap of candidates decide what is torn
//! when nothing is ready.

use crate::graph::{Column, Entry, Incidence, Row};
use hyd_index::IndexVec;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

/// The position of a column that is not in the block.
pub(crate) const OUTSIDE: u32 = u32::MAX;

/// One side of the block's pattern: neighbours of each vertex with the solvability of the entry.
struct Neighbours {
    starts: Vec<u32>,
    targets: Vec<u32>,
    solvable: Vec<bool>,
}

impl Neighbours {
    fn of(&self, vertex: u32) -> impl Iterator<Item = (u32, bool)> + '_ {
        let range = self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize;
        let targets = self.targets[range.clone()].iter().copied();
        targets.zip(self.solvable[range].iter().copied())
    }

    fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The same pattern from the other side, which has `count` vertices.
    fn transposed(&self, count: usize) -> Self {
        let mut starts = vec![0_u32; count + 1];
        for &target in &self.targets {
            starts[target as usize + 1] += 1;
        }
        for k in 0..count {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut targets = vec![0; self.targets.len()];
        let mut solvable = vec![false; self.targets.len()];
        for vertex in 0..self.count() as u32 {
            for (target, is_solvable) in self.of(vertex) {
                let slot = &mut next[target as usize];
                targets[*slot as usize] = vertex;
                solvable[*slot as usize] = is_solvable;
                *slot += 1;
            }
        }
        Self { starts, targets, solvable }
    }
}

/// The pattern of one block in positions within it.
pub(crate) struct LocalBlock {
    by_row: Neighbours,
    by_column: Neighbours,
}

impl LocalBlock {
    /// The entries of `rows` whose column has a `position` in the block.
    pub(crate) fn new(
        incidence: &Incidence,
        solvable: &IndexVec<Entry, bool>,
        position: &IndexVec<Column, u32>,
        rows: &[Row],
        column_count: usize,
    ) -> Self {
        let mut by_row = Neighbours { starts: vec![0], targets: Vec::new(), solvable: Vec::new() };
        for &row in rows {
            for (entry, column) in incidence.entries(row) {
                if position[column] != OUTSIDE {
                    by_row.targets.push(position[column]);
                    by_row.solvable.push(solvable[entry]);
                }
            }
            by_row.starts.push(by_row.targets.len() as u32);
        }
        let by_column = by_row.transposed(column_count);
        Self { by_row, by_column }
    }

    /// Number of columns in the block.
    pub(crate) fn column_count(&self) -> usize {
        self.by_column.count()
    }

    /// The columns of a row.
    pub(crate) fn columns(&self, row: u32) -> &[u32] {
        let rows = &self.by_row;
        &rows.targets[rows.starts[row as usize] as usize..rows.starts[row as usize + 1] as usize]
    }
}

/// State of one side of the block.
struct Side {
    open: Vec<bool>,
    /// Open neighbours.
    degree: Vec<u32>,
    /// Open neighbours over solvable entries.
    solvable: Vec<u32>,
    ready: VecDeque<u32>,
}

impl Side {
    fn new(neighbours: &Neighbours) -> Self {
        let count = neighbours.count() as u32;
        let solvable = |k| neighbours.of(k).filter(|(_, solvable)| *solvable).count() as u32;
        let mut side = Self {
            open: vec![true; count as usize],
            degree: (0..count).map(|k| neighbours.of(k).count() as u32).collect(),
            solvable: (0..count).map(solvable).collect(),
            ready: VecDeque::new(),
        };
        for k in 0..count {
            side.queue_if_ready(k);
        }
        side
    }

    fn queue_if_ready(&mut self, vertex: u32) {
        if self.degree[vertex as usize] == 1 || self.solvable[vertex as usize] == 0 {
            self.ready.push_back(vertex);
        }
    }

    /// One neighbour has been closed.
    fn lose(&mut self, vertex: u32, over_solvable: bool) {
        self.degree[vertex as usize] -= 1;
        self.solvable[vertex as usize] -= u32::from(over_solvable);
        self.queue_if_ready(vertex);
    }

    fn contribution(&self, row: u32) -> Contribution {
        let shortness = LONG_ROW.saturating_sub(self.degree[row as usize]);
        Contribution { weight: 1 << (WEIGHT_STEP_BITS * shortness), single: self.solvable[row as usize] == 1 }
    }

    fn next_ready(&mut self) -> Option<u32> {
        while let Some(vertex) = self.ready.pop_front() {
            if self.open[vertex as usize] {
                return Some(vertex);
            }
        }
        None
    }
}

/// Rows with more open columns than this all count alike.
const LONG_ROW: u32 = 8;

/// Each open column less multiplies what a row adds by 2 to this power, so that a row nearer to being explicit
/// outweighs several others.
const WEIGHT_STEP_BITS: u32 = 2;

/// What an open row adds to the scores of its open columns.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Contribution {
    weight: u64,
    /// Only one solvable column is left: tearing that one brings the row nothing.
    single: bool,
}

impl Contribution {
    /// To a column in which the row can be solved (`solvable`) or not.
    fn to(self, solvable: bool) -> u64 {
        if self.single && solvable { 0 } else { self.weight }
    }
}

/// A candidate for tearing; the largest is torn first.
type Candidate = (i8, u64, Reverse<u32>);

/// The elimination of one block.
pub(crate) struct Elimination<'a, W> {
    block: &'a LocalBlock,
    wish: W,
    rows: Side,
    columns: Side,
    score: Vec<u64>,
    /// Every open column is here with a score not below its current one, or in `raised`.
    candidates: BinaryHeap<Candidate>,
    /// Columns whose score has risen since the last choice, each once.
    raised: Vec<u32>,
    is_raised: Vec<bool>,
    front: Vec<(u32, u32)>,
    back: Vec<(u32, u32)>,
}

impl<'a, W: Fn(u32) -> i8> Elimination<'a, W> {
    /// Everything open; `wish` as in [`crate::tearing::TearingOptions`].
    pub(crate) fn new(block: &'a LocalBlock, wish: W) -> Self {
        let columns = Side::new(&block.by_column);
        let row_side = Side::new(&block.by_row);
        let score: Vec<u64> = (0..block.column_count() as u32)
            .map(|k| {
                let rows = block.by_column.of(k);
                rows.map(|(row, solvable)| row_side.contribution(row).to(solvable)).sum()
            })
            .collect();
        let candidates = (0..).zip(&score);
        let candidates = candidates.map(|(k, &score)| (wish(k), score, Reverse(k)));
        Self {
            candidates: candidates.collect(),
            block,
            wish,
            rows: row_side,
            columns,
            score,
            raised: Vec::new(),
            is_raised: vec![false; block.column_count()],
            front: Vec::new(),
            back: Vec::new(),
        }
    }

    /// The assignments (row, column) in order of evaluation; columns not assigned are torn.
    pub(crate) fn run(mut self) -> Vec<(u32, u32)> {
        loop {
            if let Some(row) = self.rows.next_ready() {
                self.settle_row(row);
            } else if let Some(column) = self.columns.next_ready() {
                self.settle_column(column);
            } else if let Some(column) = self.best_candidate() {
                self.close_column(column);
            } else {
                break;
            }
        }
        self.front.extend(self.back.iter().rev());
        self.front
    }

    /// A row that cannot be solved for anything is a residual; one with a single column is solved for it.
    fn settle_row(&mut self, row: u32) {
        if self.rows.solvable[row as usize] == 0 {
            self.close_row(row);
            return;
        }
        let mut columns = self.block.by_row.of(row);
        if let Some((column, _)) = columns.find(|&(k, _)| self.columns.open[k as usize]) {
            self.front.push((row, column));
            self.close_row(row);
            self.close_column(column);
        }
    }

    /// A column no row can be solved for is torn; one in a single row is solved from it, after everything else.
    fn settle_column(&mut self, column: u32) {
        if self.columns.solvable[column as usize] == 0 {
            self.close_column(column);
            return;
        }
        let mut rows = self.block.by_column.of(column);
        if let Some((row, _)) = rows.find(|&(k, _)| self.rows.open[k as usize]) {
            self.back.push((row, column));
            self.columns.open[column as usize] = false;
            self.close_row(row);
        }
    }

    /// The row takes no further part: its columns lose it and what it added to their scores.
    fn close_row(&mut self, row: u32) {
        self.rows.open[row as usize] = false;
        let last = self.rows.contribution(row);
        for (column, solvable) in self.block.by_row.of(row) {
            if self.columns.open[column as usize] {
                self.columns.lose(column, solvable);
                self.score[column as usize] -= last.to(solvable);
            }
        }
    }

    /// The column is known: its open rows have one column less, and the others in them gain weight.
    fn close_column(&mut self, column: u32) {
        self.columns.open[column as usize] = false;
        for (row, solvable) in self.block.by_column.of(column) {
            if self.rows.open[row as usize] {
                let before = self.rows.contribution(row);
                self.rows.lose(row, solvable);
                let after = self.rows.contribution(row);
                if before != after {
                    self.change_scores(row, before, after);
                }
            }
        }
    }

    fn change_scores(&mut self, row: u32, before: Contribution, after: Contribution) {
        for (column, solvable) in self.block.by_row.of(row) {
            if self.columns.open[column as usize] {
                let score = &mut self.score[column as usize];
                *score = *score - before.to(solvable) + after.to(solvable);
                if after.to(solvable) > before.to(solvable) && !self.is_raised[column as usize] {
                    self.is_raised[column as usize] = true;
                    self.raised.push(column);
                }
            }
        }
    }

    /// The open column with the largest wish and score.  Scores that have fallen since they were queued are queued
    /// again with their present value.
    fn best_candidate(&mut self) -> Option<u32> {
        while let Some(column) = self.raised.pop() {
            self.is_raised[column as usize] = false;
            if self.columns.open[column as usize] {
                let score = self.score[column as usize];
                let candidate = ((self.wish)(column), score, Reverse(column));
                self.candidates.push(candidate);
            }
        }
        while let Some((wish, queued, Reverse(column))) = self.candidates.pop() {
            if !self.columns.open[column as usize] {
                continue;
            }
            let score = self.score[column as usize];
            if queued == score {
                return Some(column);
            }
            if queued > score {
                self.candidates.push((wish, score, Reverse(column)));
            }
        }
        None
    }
}
