//! Where the choice of dummy derivatives must be left open for the run.
//!
//! A pivot that is a number holds for the whole run; one that varies may vanish (a pendulum that turns over).  Per level of
//! differentiation and connected part, columns are eliminated by constant pivots first (Gaussian elimination, the
//! least wanted as states first); what is left, more columns than rows, is a [`CandidateSet`]: which of its columns are
//! dummies is decided during the run (dynamic dummy derivatives, Mattsson, Olsson, Elmqvist 2000, *Dynamic selection of
//! states in Dymola*).  Parts without varying entries, and large ones, have no sets; nothing is chosen for them here.

use crate::graph::{Column, Row};
use crate::independent::{Columns, independent_columns};
use hyd_index::IndexVec;
use std::collections::BTreeMap;

/// Parts with more columns have a choice made once and for all.
const LARGEST: usize = 200;
/// A constant pivot must be at least this part of the largest entry of its row.
const LEAST_PIVOT: f64 = 1e-3;

/// Sweeps of the scaling; each halves the powers of two that are left.
const SWEEPS: usize = 8;

/// A part of a level whose dummies are chosen during the run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CandidateSet {
    /// The level, from 1: a dummy is derivative `order - level + 1`, a state derivative `order - level`.
    pub level: u32,
    /// Equations of the part.
    pub rows: Vec<Row>,
    /// Pivots that hold for the whole run, in the order of elimination.
    pub pivots: Vec<(Row, Column)>,
    /// Equations left after elimination.
    pub open: Vec<Row>,
    /// Columns left, more than `open`: of these as many as `open` are dummies at any time.
    pub candidates: Vec<Column>,
}

/// An entry of the matrix of a level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coefficient {
    /// Value at a typical point.
    pub value: f64,
    /// It is the same during the whole run.
    pub constant: bool,
}

/// One level: rows with their entries.
pub(crate) struct Level<'a> {
    pub level: u32,
    pub rows: Vec<(Row, BTreeMap<Column, Coefficient>)>,
    /// For columns that may be dummies their position in the order of preference.
    pub rank: &'a IndexVec<Column, Option<u32>>,
}

/// What a part of a level comes to.
pub(crate) enum Verdict {
    /// Nothing varies, or the part is too large: a choice made once will do.
    Fixed,
    /// Dummies by constant pivots and by lack of choice, and sets for the rest; rows for which there is no choice although the values are
    /// singular.
    Open { dummies: Vec<Column>, sets: Vec<CandidateSet>, doubtful: Vec<Row> },
    /// More equations than columns that may be dummies.
    Short,
}

impl Level<'_> {
    /// The connected parts, in the order of their first rows.
    pub(crate) fn parts(&self) -> Vec<Level<'_>> {
        let groups = connected(self.rows.iter().map(|(_, entries)| entries));
        let mut parts: Vec<Level<'_>> = Vec::new();
        for (group, row) in groups.into_iter().zip(&self.rows) {
            if group == parts.len() {
                parts.push(Level { level: self.level, rows: Vec::new(), rank: self.rank });
            }
            parts[group].rows.push(row.clone());
        }
        parts
    }

    /// Judges a connected part.
    pub(crate) fn judge(&self) -> Verdict {
        let varies = self.rows.iter().flat_map(|(_, entries)| entries.values()).any(|entry| !entry.constant);
        let mut occurring: Vec<Column> = self.rows.iter().flat_map(|(_, entries)| entries.keys().copied()).collect();
        occurring.sort_unstable();
        occurring.dedup();
        if !varies || occurring.len() > LARGEST {
            return Verdict::Fixed;
        }
        let mut rows: Vec<Option<BTreeMap<Column, Coefficient>>> =
            self.rows.iter().map(|(_, entries)| Some(entries.clone())).collect();
        equilibrate(&mut rows);
        let mut pivots = Vec::new();
        for column in self.by_preference(occurring) {
            if let Some(row) = constant_pivot(&rows, column) {
                eliminate(&mut rows, row, column);
                pivots.push((row, column));
            }
        }
        self.rest(&rows, &pivots)
    }

    /// Those of the columns that may be dummies, the best first.
    fn by_preference(&self, columns: impl IntoIterator<Item = Column>) -> Vec<Column> {
        let ranked = columns.into_iter().filter_map(|column| self.rank[column].map(|rank| (rank, column)));
        let mut ranked: Vec<(u32, Column)> = ranked.collect();
        ranked.sort_unstable();
        ranked.dedup();
        ranked.into_iter().map(|(_, column)| column).collect()
    }

    /// What is left after elimination.
    fn rest(&self, rows: &[Option<BTreeMap<Column, Coefficient>>], pivots: &[(usize, Column)]) -> Verdict {
        let left: Vec<usize> = (0..rows.len()).filter(|&k| rows[k].is_some()).collect();
        let groups = connected(left.iter().filter_map(|&k| rows[k].as_ref()));
        let mut dummies: Vec<Column> = pivots.iter().map(|pivot| pivot.1).collect();
        let (mut sets, mut doubtful) = (Vec::new(), Vec::new());
        for group in 0..groups.iter().max().map_or(0, |most| most + 1) {
            let open: Vec<usize> = (0..left.len()).filter(|&k| groups[k] == group).map(|k| left[k]).collect();
            let occurring = open.iter().filter_map(|&k| rows[k].as_ref()).flat_map(|row| row.keys().copied());
            let candidates = self.by_preference(occurring);
            match candidates.len().cmp(&open.len()) {
                std::cmp::Ordering::Less => return Verdict::Short,
                std::cmp::Ordering::Equal => {
                    if !is_regular(open.iter().filter_map(|&k| rows[k].as_ref()), &candidates) {
                        doubtful.extend(open.iter().map(|&k| self.rows[k].0));
                    }
                    dummies.extend(candidates);
                }
                std::cmp::Ordering::Greater => sets.push(CandidateSet {
                    level: self.level,
                    rows: self.rows.iter().map(|row| row.0).collect(),
                    pivots: pivots.iter().map(|&(k, column)| (self.rows[k].0, column)).collect(),
                    open: open.iter().map(|&k| self.rows[k].0).collect(),
                    candidates,
                }),
            }
        }
        Verdict::Open { dummies, sets, doubtful }
    }
}

/// True if a square part of the rows has independent columns at the values given.
fn is_regular<'a>(rows: impl Iterator<Item = &'a BTreeMap<Column, Coefficient>>, candidates: &[Column]) -> bool {
    let mut matrix = Columns { rows: candidates.len(), columns: vec![Vec::new(); candidates.len()] };
    for (position, row) in rows.enumerate() {
        for (column, candidate) in matrix.columns.iter_mut().zip(candidates) {
            column.extend(row.get(candidate).map(|entry| (position as u32, entry.value)));
        }
    }
    independent_columns(&matrix).len() == candidates.len()
}

/// Scales rows and columns by powers of two until the largest entry of each is near 1, so that units do not decide which pivots are
/// small (the square roots of the largest entries in turn, as Ruiz 2001, *A scaling algorithm to equilibrate both rows and columns norms in
/// matrices*).
fn equilibrate(rows: &mut [Option<BTreeMap<Column, Coefficient>>]) {
    let factor = |largest: f64| match largest > 0.0 && largest.is_finite() {
        true => f64::from_bits(((1023 - exponent(largest) / 2) as u64) << 52),
        false => 1.0,
    };
    for _ in 0..SWEEPS {
        let mut columns: BTreeMap<Column, f64> = BTreeMap::new();
        for row in rows.iter_mut().flatten() {
            let largest = row.values().map(|entry| entry.value.abs()).fold(0.0, f64::max);
            let own = factor(largest);
            for (&column, entry) in row.iter_mut() {
                let most = columns.entry(column).or_insert(0.0);
                *most = most.max(entry.value.abs());
                entry.value *= own;
            }
        }
        for (column, entry) in rows.iter_mut().flatten().flatten() {
            entry.value *= factor(columns[column]);
        }
    }
}

/// The power of two below a positive number.
fn exponent(x: f64) -> i32 {
    ((x.to_bits() >> 52) & 0x7ff) as i32 - 1023
}

/// The shortest row in which a column has a pivot that cannot vanish.
fn constant_pivot(rows: &[Option<BTreeMap<Column, Coefficient>>], column: Column) -> Option<usize> {
    let usable = |entries: &BTreeMap<Column, Coefficient>| {
        let largest = entries.values().map(|entry| entry.value.abs()).fold(0.0, f64::max);
        entries
            .get(&column)
            .is_some_and(|entry| entry.constant && entry.value != 0.0 && entry.value.abs() >= LEAST_PIVOT * largest)
    };
    let found = rows.iter().enumerate().filter_map(|(k, row)| row.as_ref().map(|row| (k, row)));
    found.filter(|(_, row)| usable(row)).min_by_key(|(k, row)| (row.len(), *k)).map(|(k, _)| k)
}

/// Subtracts multiples of the pivot row, which leaves the matrix.
fn eliminate(rows: &mut [Option<BTreeMap<Column, Coefficient>>], pivot: usize, column: Column) {
    let Some(source) = rows[pivot].take() else { return };
    let Some(&head) = source.get(&column) else { return };
    for row in rows.iter_mut().flatten() {
        let Some(own) = row.remove(&column) else { continue };
        let factor = own.value / head.value;
        for (&other, entry) in source.iter().filter(|(other, _)| **other != column) {
            let sum = row.entry(other).or_insert(Coefficient { value: 0.0, constant: true });
            sum.value -= factor * entry.value;
            sum.constant &= own.constant && entry.constant;
            if sum.constant && sum.value == 0.0 {
                row.remove(&other);
            }
        }
    }
}

/// The part each row belongs to, numbered in the order of first rows (union-find over rows and columns).
fn connected<'a>(rows: impl Iterator<Item = &'a BTreeMap<Column, Coefficient>>) -> Vec<usize> {
    fn find(parent: &mut [usize], mut at: usize) -> usize {
        while parent[at] != at {
            parent[at] = parent[parent[at]];
            at = parent[at];
        }
        at
    }
    let mut parent: Vec<usize> = Vec::new();
    let mut place: BTreeMap<Column, usize> = BTreeMap::new();
    let mut of_row = Vec::new();
    for entries in rows {
        let own = parent.len();
        parent.push(own);
        of_row.push(own);
        for &column in entries.keys() {
            let other = *place.entry(column).or_insert(parent.len());
            if other == parent.len() {
                parent.push(other);
            }
            let (a, b) = (find(&mut parent, own), find(&mut parent, other));
            parent[a] = b;
        }
    }
    let mut number: BTreeMap<usize, usize> = BTreeMap::new();
    let mut groups = Vec::with_capacity(of_row.len());
    for own in of_row {
        let next = number.len();
        groups.push(*number.entry(find(&mut parent, own)).or_insert(next));
    }
    groups
}
