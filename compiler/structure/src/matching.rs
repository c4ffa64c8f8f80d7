//! A matching: which equation determines which unknown, each at most once.

use crate::graph::{Column, Incidence, Row};
use hyd_index::IndexVec;
use std::fmt;

/// A set of pairs (equation, unknown) in which no equation and no unknown occurs twice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Matching {
    /// The unknown each equation determines.
    pub column_of_row: IndexVec<Row, Option<Column>>,
    /// The equation that determines each unknown; the inverse of `column_of_row`.
    pub row_of_column: IndexVec<Column, Option<Row>>,
}

impl Matching {
    /// No pairs, sized for the incidence.
    pub fn empty(incidence: &Incidence) -> Self {
        Self {
            column_of_row: IndexVec::filled(None, incidence.row_count()),
            row_of_column: IndexVec::filled(None, incidence.column_count()),
        }
    }

    /// Grows both tables to an incidence that has gained rows or columns; the new ones are unmatched.
    pub fn grow(&mut self, incidence: &Incidence) {
        let rows = incidence.row_count().max(self.column_of_row.len());
        let columns = incidence.column_count().max(self.row_of_column.len());
        self.column_of_row.raw.resize(rows, None);
        self.row_of_column.raw.resize(columns, None);
    }

    /// Pairs `row` with `column`, releasing the previous partners of both.
    pub fn assign(&mut self, row: Row, column: Column) {
        if let Some(old) = self.row_of_column[column].replace(row) {
            self.column_of_row[old] = None;
        }
        if let Some(old) = self.column_of_row[row].replace(column)
            && old != column
        {
            self.row_of_column[old] = None;
        }
    }

    /// Releases an equation from its unknown, if it has one.
    pub fn release(&mut self, row: Row) {
        if let Some(column) = self.column_of_row[row].take() {
            self.row_of_column[column] = None;
        }
    }

    /// Number of pairs.
    pub fn size(&self) -> usize {
        self.column_of_row.iter().flatten().count()
    }

    /// True if every equation and every unknown is matched.
    pub fn is_perfect(&self) -> bool {
        self.unmatched_rows().next().is_none() && self.unmatched_columns().next().is_none()
    }

    /// The equations without an unknown, ascending.
    pub fn unmatched_rows(&self) -> impl Iterator<Item = Row> + '_ {
        let pairs = self.column_of_row.iter_enumerated();
        pairs.filter(|(_, column)| column.is_none()).map(|(row, _)| row)
    }

    /// The unknowns without an equation, ascending.
    pub fn unmatched_columns(&self) -> impl Iterator<Item = Column> + '_ {
        let pairs = self.row_of_column.iter_enumerated();
        pairs.filter(|(_, row)| row.is_none()).map(|(column, _)| column)
    }
}

/// One line `eq0 -> v3` per equation (`eq1 -> none`), then the unmatched unknowns `none -> v4`.
impl fmt::Display for Matching {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (row, column) in self.column_of_row.iter_enumerated() {
            match column {
                Some(column) => writeln!(f, "{row} -> {column}")?,
                None => writeln!(f, "{row} -> none")?,
            }
        }
        for column in self.unmatched_columns() {
            writeln!(f, "none -> {column}")?;
        }
        Ok(())
    }
}
