//! Incidence of equations (rows) and unknowns (columns): which unknown occurs in which equation.
//!
//! Turns lists of unknowns per equation into compressed sparse row storage, its column-wise view, and a stable text
//! form that can be read back.  Entries are numbered row by row, so that per-entry facts (a preference, "solvable")
//! live in tables beside the incidence, addressed by [`Entry`].  Storage as in Duff, Erisman, Reid 2017, *Direct
//! Methods for Sparse Matrices*, ch. 2.  No values and no expressions are held here.

use hyd_index::{IndexVec, TypedIndex, typed_index};
use std::fmt;
use std::ops::Range;
use std::str::FromStr;

typed_index!(
    /// An equation.
    Row,
    "eq"
);
typed_index!(
    /// An unknown.
    Column,
    "v"
);
typed_index!(
    /// One occurrence of an unknown in an equation; numbered row by row in column order.
    Entry,
    "entry"
);

/// Why rows do not form an incidence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum IncidenceError {
    /// The columns of a row do not ascend strictly at this column.
    Unsorted {
        /// The row.
        row: Row,
        /// The first column that is not above its predecessor.
        column: Column,
    },
    /// A row names a column beyond the number of columns.
    ColumnOutside {
        /// The row.
        row: Row,
        /// The column that does not exist.
        column: Column,
    },
    /// More rows, columns or entries than 32-bit numbers can count.
    TooLarge,
    /// The text form is malformed.
    Text {
        /// Line number from 1.
        line: usize,
        /// What should have stood there.
        expected: &'static str,
    },
}

impl fmt::Display for IncidenceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unsorted { row, column } => {
                write!(f, "the columns of {row} are not strictly ascending at {column}")
            }
            Self::ColumnOutside { row, column } => {
                write!(f, "{row} names {column}, which does not exist")
            }
            Self::TooLarge => write!(f, "more than 2^32 - 1 rows, columns or entries"),
            Self::Text { line, expected } => write!(f, "line {line}: expected {expected}"),
        }
    }
}

impl std::error::Error for IncidenceError {}

/// A sparse pattern of `row_count` equations in `column_count` unknowns, stored row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Incidence {
    column_count: usize,
    /// `row_count + 1` positions in `entries`.
    starts: Vec<u32>,
    entries: Vec<Column>,
}

impl Incidence {
    /// A pattern without rows over `column_count` unknowns.
    pub fn new(column_count: usize) -> Self {
        Self { column_count, starts: vec![0], entries: Vec::new() }
    }

    /// The pattern of the given rows, each a strictly ascending list of columns below `column_count`.
    pub fn from_rows<R>(column_count: usize, rows: impl IntoIterator<Item = R>) -> Result<Self, IncidenceError>
    where
        R: IntoIterator<Item = Column>,
    {
        if column_count > u32::MAX as usize {
            return Err(IncidenceError::TooLarge);
        }
        let mut incidence = Self::new(column_count);
        for row in rows {
            incidence.push_row(row)?;
        }
        Ok(incidence)
    }

    /// Appends an equation (strictly ascending columns below the column count) and returns its number.
    ///
    /// On an error the pattern is as before.
    pub fn push_row(&mut self, columns: impl IntoIterator<Item = Column>) -> Result<Row, IncidenceError> {
        let start = self.entries.len();
        if self.row_count() >= u32::MAX as usize {
            return Err(IncidenceError::TooLarge);
        }
        let row = Row::new(self.row_count());
        self.entries.extend(columns);
        match self.check_tail(row, start) {
            Ok(end) => {
                self.starts.push(end);
                Ok(row)
            }
            Err(error) => {
                self.entries.truncate(start);
                Err(error)
            }
        }
    }

    fn check_tail(&self, row: Row, start: usize) -> Result<u32, IncidenceError> {
        let tail = &self.entries[start..];
        if let Some(pair) = tail.windows(2).find(|pair| pair[0] >= pair[1]) {
            let column = pair[1];
            return Err(IncidenceError::Unsorted { row, column });
        }
        match tail.last() {
            Some(&column) if column.index() >= self.column_count => Err(IncidenceError::ColumnOutside { row, column }),
            _ => u32::try_from(self.entries.len()).map_err(|_| IncidenceError::TooLarge),
        }
    }

    /// Appends `count` unknowns that occur nowhere yet.
    pub fn add_columns(&mut self, count: usize) -> Result<(), IncidenceError> {
        match self.column_count.checked_add(count) {
            Some(total) if total <= u32::MAX as usize => {
                self.column_count = total;
                Ok(())
            }
            _ => Err(IncidenceError::TooLarge),
        }
    }

    /// Number of equations.
    pub fn row_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// Number of unknowns.
    pub fn column_count(&self) -> usize {
        self.column_count
    }

    /// Number of occurrences.
    pub fn entry_count(&self) -> usize {
        self.entries.len()
    }

    /// All equations in order.
    pub fn rows(&self) -> impl DoubleEndedIterator<Item = Row> + use<> {
        (0..self.row_count()).map(Row::new)
    }

    /// All unknowns in order.
    pub fn columns(&self) -> impl DoubleEndedIterator<Item = Column> + use<> {
        (0..self.column_count).map(Column::new)
    }

    /// The unknowns of an equation, ascending.
    pub fn row(&self, row: Row) -> &[Column] {
        &self.entries[self.entry_range(row)]
    }

    /// The positions of a row's entries; `row(r)[k]` is entry `entry_range(r).start + k`.
    pub fn entry_range(&self, row: Row) -> Range<usize> {
        self.starts[row.index()] as usize..self.starts[row.index() + 1] as usize
    }

    /// The occurrences of an equation with their entry numbers, ascending.
    pub fn entries(&self, row: Row) -> impl Iterator<Item = (Entry, Column)> + '_ {
        let range = self.entry_range(row);
        range.map(|k| (Entry::new(k), self.entries[k]))
    }

    /// The unknown of an occurrence.
    pub fn column_of(&self, entry: Entry) -> Column {
        self.entries[entry.index()]
    }

    /// The entry of `column` in `row`, if it occurs there.
    pub fn entry(&self, row: Row, column: Column) -> Option<Entry> {
        let position = self.row(row).binary_search(&column).ok()?;
        Some(Entry::new(self.entry_range(row).start + position))
    }

    /// A table with one value per entry, for facts such as "solvable".
    pub fn entry_table<T>(&self, mut value: impl FnMut(Row, Column) -> T) -> IndexVec<Entry, T> {
        let mut table = Vec::with_capacity(self.entry_count());
        for row in self.rows() {
            table.extend(self.row(row).iter().map(|&column| value(row, column)));
        }
        IndexVec::from_vec(table)
    }

    /// The same pattern seen column by column.
    pub fn transpose(&self) -> Transpose {
        let mut starts = vec![0_u32; self.column_count + 1];
        for column in &self.entries {
            starts[column.index() + 1] += 1;
        }
        for k in 0..self.column_count {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut rows = vec![Row(0); self.entry_count()];
        let mut entries = vec![Entry(0); self.entry_count()];
        for row in self.rows() {
            for (entry, column) in self.entries(row) {
                let slot = &mut next[column.index()];
                rows[*slot as usize] = row;
                entries[*slot as usize] = entry;
                *slot += 1;
            }
        }
        Transpose { starts, rows, entries }
    }
}

/// The column-wise view of an [`Incidence`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Transpose {
    starts: Vec<u32>,
    rows: Vec<Row>,
    entries: Vec<Entry>,
}

impl Transpose {
    fn range(&self, column: Column) -> Range<usize> {
        self.starts[column.index()] as usize..self.starts[column.index() + 1] as usize
    }

    /// The equations an unknown occurs in, ascending.
    pub fn rows(&self, column: Column) -> &[Row] {
        &self.rows[self.range(column)]
    }

    /// The entry numbers of the unknown's occurrences, parallel to [`Transpose::rows`].
    pub fn entries(&self, column: Column) -> &[Entry] {
        &self.entries[self.range(column)]
    }
}

/// First line `2 rows, 3 columns`, then one line `eq0: v1 v2` per equation.
impl fmt::Display for Incidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (rows, columns) = (self.row_count(), self.column_count);
        writeln!(f, "{rows} rows, {columns} columns")?;
        for row in self.rows() {
            write!(f, "{row}:")?;
            for column in self.row(row) {
                write!(f, " {column}")?;
            }
            writeln!(f)?;
        }
        Ok(())
    }
}

/// Reads the text form written by `Display`; the rows stand in order and the first line counts them.
impl FromStr for Incidence {
    type Err = IncidenceError;

    fn from_str(text: &str) -> Result<Self, IncidenceError> {
        let mut lines = text.lines().zip(1..);
        let expected = "`<n> rows, <m> columns`";
        let (rows, columns) =
            lines.next().and_then(|(line, _)| parse_sizes(line)).ok_or(IncidenceError::Text { line: 1, expected })?;
        let mut incidence = Self::from_rows::<[Column; 0]>(columns, [])?;
        let mut last = 1;
        for (text, line) in lines {
            let expected = "`eq<number of this row>: v<k> v<l> ...`";
            let row = parse_row(text, incidence.row_count());
            incidence.push_row(row.ok_or(IncidenceError::Text { line, expected })?)?;
            last = line;
        }
        if incidence.row_count() != rows {
            let expected = "as many rows as the first line says";
            return Err(IncidenceError::Text { line: last, expected });
        }
        Ok(incidence)
    }
}

fn parse_sizes(line: &str) -> Option<(usize, usize)> {
    let (rows, columns) = line.split_once(" rows, ")?;
    let columns = columns.strip_suffix(" columns")?;
    Some((rows.parse().ok()?, columns.parse().ok()?))
}

fn parse_row(line: &str, number: usize) -> Option<Vec<Column>> {
    let (name, columns) = line.split_once(':')?;
    if name.strip_prefix("eq")?.parse() != Ok(number) {
        return None;
    }
    let words = columns.split_whitespace();
    words.map(|word| word.strip_prefix('v')?.parse().ok().map(Column)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brute_force::any_incidence;
    use proptest::prelude::*;

    #[test]
    fn text_form_is_stable() {
        let rows = [vec![Column(1), Column(2)], vec![], vec![Column(0)]];
        let incidence = Incidence::from_rows(3, rows).expect("sorted");
        let text = "3 rows, 3 columns\neq0: v1 v2\neq1:\neq2: v0\n";
        assert_eq!(incidence.to_string(), text);
    }

    #[test]
    fn wrong_rows_are_refused_and_leave_the_pattern_unchanged() {
        let mut incidence = Incidence::new(2);
        let (row, column) = (Row(0), Column(1));
        assert_eq!(incidence.push_row([Column(1), Column(1)]), Err(IncidenceError::Unsorted { row, column }));
        let column = Column(2);
        assert_eq!(incidence.push_row([Column(0), column]), Err(IncidenceError::ColumnOutside { row, column }));
        assert_eq!(incidence, Incidence::new(2));
        incidence.add_columns(1).expect("small");
        assert_eq!(incidence.push_row([Column(0), column]), Ok(row));
    }

    #[test]
    fn malformed_text_is_located() {
        for (text, line) in [
            ("", 1),
            ("1 rows", 1),
            ("2 rows, 2 columns\neq0: v0\n", 2),
            ("1 rows, 2 columns\neq1: v0\n", 2),
            ("1 rows, 2 columns\neq0: w0\n", 2),
        ] {
            match Incidence::from_str(text) {
                Err(IncidenceError::Text { line: found, .. }) => assert_eq!(found, line, "{text}"),
                other => panic!("{text}: {other:?}"),
            }
        }
    }

    proptest! {
        #[test]
        fn text_form_round_trips(incidence in any_incidence(8, 8)) {
            prop_assert_eq!(incidence.to_string().parse(), Ok(incidence));
        }

        #[test]
        fn transpose_holds_the_same_entries(incidence in any_incidence(8, 8)) {
            let transpose = incidence.transpose();
            let mut count = 0;
            for column in incidence.columns() {
                prop_assert!(transpose.rows(column).is_sorted());
                for (&row, &entry) in transpose.rows(column).iter().zip(transpose.entries(column)) {
                    prop_assert_eq!(incidence.entry(row, column), Some(entry));
                    prop_assert_eq!(incidence.column_of(entry), column);
                    count += 1;
                }
            }
            prop_assert_eq!(count, incidence.entry_count());
        }
    }
}
