//! Parts of a system, and the three that the decomposition makes of it: plain data with a stable text form.

use crate::graph::{Column, Row};
use std::fmt;

/// A set of equations and a set of unknowns.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Part {
    /// The equations, ascending.
    pub rows: Vec<Row>,
    /// The unknowns, ascending.
    pub columns: Vec<Column>,
}

impl Part {
    /// The part of the given members, each listed once in any order.
    pub fn sorted(mut rows: Vec<Row>, mut columns: Vec<Column>) -> Self {
        rows.sort_unstable();
        columns.sort_unstable();
        Self { rows, columns }
    }
}

/// `eq0 eq3 | v1`.
impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for row in &self.rows {
            write!(f, "{row} ")?;
        }
        write!(f, "|")?;
        for column in &self.columns {
            write!(f, " {column}")?;
        }
        Ok(())
    }
}

/// The coarse decomposition; every equation and every unknown is in exactly one part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Decomposition {
    /// Equations that some maximum matching leaves unmatched, with all unknowns in them: more rows than columns,
    /// or empty.
    pub over: Part,
    /// As many equations as unknowns, perfectly matched among themselves.
    pub square: Part,
    /// Unknowns that some maximum matching leaves unmatched, with all equations they occur in: more columns than
    /// rows, or empty.
    pub under: Part,
}

/// Three lines `over: ...`, `square: ...`, `under: ...`.
impl fmt::Display for Decomposition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "over: {}", self.over)?;
        writeln!(f, "square: {}", self.square)?;
        writeln!(f, "under: {}", self.under)
    }
}
