//! Tangents of rows as lists of multiply-adds over blocks of directions.
//!
//! A row is `d[to] = sum c[k] d[from_k]` with `c` the partial derivatives that code has computed.  Blocks of all areas
//! stand in one array ([`Spaces`]); simulation and initial system have their own places for what they assign.  Before a
//! run the lists are cut down to the rows that some direction can reach (activity analysis, Griewank and Walther 2008,
//! section 6.2).

use std::ops::Range;

use crate::program::Area;
use hyd_system::wide;

/// Sign bit of `Term::coefficient`: the product is subtracted.
pub const MINUS: u32 = 1 << 31;

/// Where the blocks of each area begin.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Spaces {
    pub(crate) starts: [u32; 5],
    pub(crate) initial_unknown: u32,
    pub(crate) initial_work: u32,
    /// Number of blocks.
    pub length: u32,
}

impl Spaces {
    /// Lengths of data, unknowns, assigned variables, results; then unknowns and assigned variables of the initial system.
    pub fn new([data, unknowns, work, out, initial_unknowns, initial_work]: [u32; 6]) -> Self {
        let rate = data + unknowns;
        let assigned = rate + unknowns;
        let results = assigned + work;
        let initial_unknown = results + out;
        let initial = initial_unknown + initial_unknowns;
        Self {
            starts: [0, data, rate, assigned, results],
            initial_unknown,
            initial_work: initial,
            length: initial + initial_work,
        }
    }

    /// First block of an area.
    pub fn start(&self, area: Area, initial: bool) -> u32 {
        match area {
            Area::Unknown if initial => self.initial_unknown,
            Area::Work if initial => self.initial_work,
            Area::Out2 => self.starts[Area::Out as usize],
            area => self.starts[area as usize],
        }
    }
}

/// `c * d[from]`
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Term {
    /// Position of `c`, with [`MINUS`].
    pub coefficient: u32,
    /// Block.
    pub from: u32,
}

/// Rows in the order of computation.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Rows {
    pub(crate) to: Vec<u32>,
    pub(crate) ends: Vec<u32>,
    pub(crate) terms: Vec<Term>,
}

impl Rows {
    /// Appends a row.
    pub fn push(&mut self, to: u32, terms: impl IntoIterator<Item = Term>) {
        self.terms.extend(terms);
        self.to.push(to);
        self.ends.push(self.terms.len() as u32);
    }

    fn range(&self, row: usize) -> Range<usize> {
        let start = if row == 0 { 0 } else { self.ends[row - 1] };
        start as usize..self.ends[row] as usize
    }

    /// The rows that an active block reaches; their results become active.
    pub(super) fn active(&self, active: &mut [bool]) -> Rows {
        let mut kept = Rows::default();
        for (row, &to) in self.to.iter().enumerate() {
            let terms = self.terms[self.range(row)].iter().filter(|term| active[term.from as usize]);
            let before = kept.terms.len();
            kept.terms.extend(terms);
            // A place once written is written always: what it held before may have had a derivative.
            if kept.terms.len() > before || active[to as usize] {
                kept.to.push(to);
                kept.ends.push(kept.terms.len() as u32);
                active[to as usize] = true;
            }
        }
        kept
    }

    /// All rows, without the terms that are not active.
    pub(super) fn filtered(&self, active: &[bool]) -> Rows {
        let mut kept = Rows::default();
        for (row, &to) in self.to.iter().enumerate() {
            let terms = self.terms[self.range(row)].iter().filter(|term| active[term.from as usize]);
            kept.push(to, terms.copied());
        }
        kept
    }

    /// The rows that are needed for the marked blocks; what they read becomes marked.
    pub(super) fn needed(&self, marked: &mut [bool]) -> Rows {
        let mut keep = vec![false; self.to.len()];
        for row in (0..self.to.len()).rev() {
            keep[row] = marked[self.to[row] as usize];
            if keep[row] {
                self.terms[self.range(row)].iter().for_each(|term| marked[term.from as usize] = true);
            }
        }
        let mut kept = Rows::default();
        for (row, _) in keep.iter().enumerate().filter(|(_, keep)| **keep) {
            kept.push(self.to[row], self.terms[self.range(row)].iter().copied());
        }
        kept
    }

    /// Marks what the rows read.
    pub(super) fn mark_read(&self, marked: &mut [bool]) {
        self.terms.iter().for_each(|term| marked[term.from as usize] = true);
    }

    /// Computes the rows in order over blocks of `width`, behind which [`CHUNK`] further places stand.  `seed` may add
    /// to a finished row (block, first direction, values).
    pub(super) fn apply(
        &self,
        coefficients: &[f64],
        blocks: &mut [f64],
        width: usize,
        mut seed: impl FnMut(u32, usize, &mut [f64]),
    ) {
        wide(
            #[inline(always)]
            || self.apply_here(coefficients, blocks, width, &mut seed),
        );
    }

    #[inline(always)]
    fn apply_here(
        &self,
        coefficients: &[f64],
        blocks: &mut [f64],
        width: usize,
        seed: &mut impl FnMut(u32, usize, &mut [f64]),
    ) {
        let mut start = 0;
        for (&to, &end) in self.to.iter().zip(&self.ends) {
            let terms = &self.terms[start..end as usize];
            start = end as usize;
            for first in (0..width).step_by(CHUNK) {
                // Directions beyond the last one are the block behind, and are computed in vain.
                let mut sum = [0.0; CHUNK];
                for term in terms {
                    let c = coefficients[(term.coefficient & !MINUS) as usize];
                    let c = if term.coefficient & MINUS == 0 { c } else { -c };
                    let from = term.from as usize * width + first;
                    add(&mut sum, c, &blocks[from..from + CHUNK]);
                }
                let lanes = CHUNK.min(width - first);
                seed(to, first, &mut sum[..lanes]);
                let to = to as usize * width + first;
                blocks[to..to + lanes].copy_from_slice(&sum[..lanes]);
            }
        }
    }
}

/// Directions that are handled together.
pub(super) const CHUNK: usize = 12;

/// `sum += c * values`; where `c` is not finite only derivatives other than zero count.
#[inline(always)]
fn add(sum: &mut [f64; CHUNK], c: f64, values: &[f64]) {
    if c == 0.0 {
        return;
    }
    let Some(values) = values.first_chunk::<CHUNK>() else { return };
    if c.is_finite() {
        for (sum, value) in sum.iter_mut().zip(values) {
            *sum += c * value;
        }
    } else {
        for (sum, value) in sum.iter_mut().zip(values).filter(|(_, value)| **value != 0.0) {
            *sum += c * value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_chain_and_inactive_ones_are_left_out() {
        // b2 = 2 b0 - b1, b3 = 5 b2, b4 = b5: with b0 active alone, b4 falls away.
        let mut rows = Rows::default();
        let term = |coefficient, from| Term { coefficient, from };
        rows.push(2, [term(0, 0), term(1 | MINUS, 1)]);
        rows.push(3, [term(2, 2)]);
        rows.push(4, [term(1, 5)]);
        let mut active = vec![true, false, false, false, false, false];
        let kept = rows.active(&mut active);
        assert_eq!((kept.to.as_slice(), active[3], active[4]), (&[2, 3][..], true, false));
        let mut blocks = vec![1.0, 10.0, 7.0, 7.0, 0.0, 0.0, 9.0, 9.0, 0.0, 0.0, 0.0, 0.0];
        blocks.resize(blocks.len() + CHUNK, f64::NAN);
        rows.apply(&[2.0, 1.0, 5.0], &mut blocks, 2, |_, _, _| {});
        assert_eq!(blocks[4..10], [-5.0, 13.0, -25.0, 65.0, 0.0, 0.0]);
        // More directions than are handled together.
        let width = CHUNK + 2;
        let mut blocks: Vec<f64> = (0..6 * width).map(|k| if k < 2 * width { k as f64 } else { 0.0 }).collect();
        blocks.resize(blocks.len() + CHUNK, f64::NAN);
        rows.apply(&[2.0, 1.0, 5.0], &mut blocks, width, |_, _, _| {});
        assert!((0..width).all(|k| blocks[3 * width + k] == 5.0 * (2.0 * k as f64 - (width + k) as f64)));
        let mut marked = vec![false, false, true, false, false, false];
        assert_eq!(rows.needed(&mut marked).to, [2]);
        assert!(marked[0] && marked[1]);
    }

    #[test]
    fn an_infinite_slope_times_nothing_is_nothing() {
        let (mut sum, mut values) = ([1.0; CHUNK], [0.0; CHUNK]);
        values[1] = 2.0;
        add(&mut sum, f64::INFINITY, &values);
        assert_eq!(sum[..3], [1.0, f64::INFINITY, 1.0]);
    }
}
