//! Cheap assignment: a large (not yet maximum) matching in linear time, the start of [`crate::maximum_matching()`].
//!
//! An equation with one free unknown must take it, and an unknown that occurs in one free equation must be taken by
//! it; such forced pairs are matched first and lose nothing (Karp & Sipser 1981, *Maximum matchings in sparse random
//! graphs*).  When none is left, the first free equation takes its rarest free unknown.  On patterns without cycles
//! the result is already maximum.

use crate::graph::{Column, Entry, Incidence, Row, Transpose};
use crate::matching::Matching;
use hyd_index::IndexVec;
use std::collections::VecDeque;

/// Which entries may be used: all, or those whose class is at most `limit`.
#[derive(Clone, Copy)]
pub(crate) struct EntryFilter<'a> {
    pub classes: Option<&'a IndexVec<Entry, u8>>,
    pub limit: u8,
}

impl EntryFilter<'_> {
    #[inline]
    pub(crate) fn admits(&self, entry: Entry) -> bool {
        self.classes.is_none_or(|classes| classes[entry] <= self.limit)
    }
}

enum Vertex {
    Row(Row),
    Column(Column),
}

struct CheapAssignment<'a> {
    incidence: &'a Incidence,
    transpose: &'a Transpose,
    filter: EntryFilter<'a>,
    matching: &'a mut Matching,
    /// Admitted free columns of each free row.
    row_degree: IndexVec<Row, u32>,
    /// Admitted free rows of each free column.
    column_degree: IndexVec<Column, u32>,
    forced: VecDeque<Vertex>,
}

/// Extends `matching` by admitted entries between free equations and free unknowns until no such entry is left.
pub(crate) fn extend_cheaply(
    incidence: &Incidence,
    transpose: &Transpose,
    filter: EntryFilter<'_>,
    matching: &mut Matching,
) {
    let mut state = CheapAssignment {
        incidence,
        transpose,
        filter,
        matching,
        row_degree: IndexVec::filled(0, incidence.row_count()),
        column_degree: IndexVec::filled(0, incidence.column_count()),
        forced: VecDeque::new(),
    };
    state.count();
    for row in incidence.rows() {
        state.match_forced();
        if state.matching.column_of_row[row].is_none()
            && let Some(column) = state.rarest_column(row)
        {
            state.take(row, column);
        }
    }
    state.match_forced();
}

impl CheapAssignment<'_> {
    fn count(&mut self) {
        for row in self.incidence.rows() {
            if self.matching.column_of_row[row].is_some() {
                continue;
            }
            for (entry, column) in self.incidence.entries(row) {
                if self.filter.admits(entry) && self.matching.row_of_column[column].is_none() {
                    self.row_degree[row] += 1;
                    self.column_degree[column] += 1;
                }
            }
            if self.row_degree[row] == 1 {
                self.forced.push_back(Vertex::Row(row));
            }
        }
        for (column, &degree) in self.column_degree.iter_enumerated() {
            if degree == 1 {
                self.forced.push_back(Vertex::Column(column));
            }
        }
    }

    fn match_forced(&mut self) {
        while let Some(vertex) = self.forced.pop_front() {
            let pair = match vertex {
                Vertex::Row(row) if self.matching.column_of_row[row].is_none() => {
                    self.rarest_column(row).map(|column| (row, column))
                }
                Vertex::Column(column) if self.matching.row_of_column[column].is_none() => {
                    self.free_row(column).map(|row| (row, column))
                }
                _ => None,
            };
            if let Some((row, column)) = pair {
                self.take(row, column);
            }
        }
    }

    fn rarest_column(&self, row: Row) -> Option<Column> {
        let admitted = self
            .incidence
            .entries(row)
            .filter(|&(entry, column)| self.filter.admits(entry) && self.matching.row_of_column[column].is_none());
        admitted.map(|(_, column)| column).min_by_key(|&column| (self.column_degree[column], column))
    }

    fn free_row(&self, column: Column) -> Option<Row> {
        let rows = self.transpose.rows(column).iter();
        let mut pairs = rows.zip(self.transpose.entries(column));
        pairs
            .find(|&(&row, &entry)| self.filter.admits(entry) && self.matching.column_of_row[row].is_none())
            .map(|(&row, _)| row)
    }

    /// Matches the pair and lowers the degrees of its free neighbours.
    fn take(&mut self, row: Row, column: Column) {
        self.matching.assign(row, column);
        for (entry, other) in self.incidence.entries(row) {
            if self.filter.admits(entry) && self.matching.row_of_column[other].is_none() {
                self.column_degree[other] -= 1;
                if self.column_degree[other] == 1 {
                    self.forced.push_back(Vertex::Column(other));
                }
            }
        }
        let rows = self.transpose.rows(column).iter();
        for (&other, &entry) in rows.zip(self.transpose.entries(column)) {
            if self.filter.admits(entry) && self.matching.column_of_row[other].is_none() {
                self.row_degree[other] -= 1;
                if self.row_degree[other] == 1 {
                    self.forced.push_back(Vertex::Row(other));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brute_force::{any_incidence, maximum_size};
    use proptest::prelude::*;

    proptest! {
        /// A maximal matching has at least half the size of a maximum one, and no free admitted entry is left.
        #[test]
        fn result_is_maximal(incidence in any_incidence(7, 7)) {
            let mut matching = Matching::empty(&incidence);
            let filter = EntryFilter { classes: None, limit: 0 };
            extend_cheaply(&incidence, &incidence.transpose(), filter, &mut matching);
            for row in incidence.rows().filter(|&row| matching.column_of_row[row].is_none()) {
                let free = |column: &Column| matching.row_of_column[*column].is_none();
                prop_assert!(!incidence.row(row).iter().any(free));
            }
            prop_assert!(2 * matching.size() >= maximum_size(&incidence));
        }
    }

    /// Equation k holds v(k-1) and v(k) in scrambled order: a tree, so forced pairs alone reach the maximum.
    #[test]
    fn trees_are_matched_completely() {
        let n = 1000_u32;
        let scrambled = |k: u32| Column(k * 371 % n);
        let rows = (0..n).map(|k| {
            let mut row = vec![scrambled(k)];
            row.extend((k > 0).then(|| scrambled(k - 1)));
            row.sort();
            row
        });
        let incidence = Incidence::from_rows(n as usize, rows).expect("sorted");
        let mut matching = Matching::empty(&incidence);
        let filter = EntryFilter { classes: None, limit: 0 };
        extend_cheaply(&incidence, &incidence.transpose(), filter, &mut matching);
        assert!(matching.is_perfect());
    }
}
