//! Which columns of a Jacobian can be found by one evaluation: those that have no row in common get one colour.
//!
//! Columns are coloured one after the other with the first colour that none of their rows has seen.  Source: Curtis, Powell, Reid, J. Inst.
//! Maths Applics 13 (1974) 117.

use hyd_system::Pattern;

/// A pattern, and the colour of each of its columns.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Colours {
    /// Colour of each column, from 0.
    pub(crate) of_column: Vec<u32>,
    /// Where the rows of each column begin, and the total.
    pub(crate) starts: Vec<u32>,
    /// The rows, column by column.
    pub(crate) rows: Vec<u32>,
}

impl Colours {
    pub(crate) fn new(pattern: &Pattern) -> Self {
        let columns = pattern.columns();
        let mut of_column = Vec::with_capacity(columns);
        let mut seen: Vec<Vec<u32>> = vec![Vec::new(); pattern.rows];
        let mut taken: Vec<usize> = Vec::new();
        for column in 0..columns {
            let rows = &pattern.row_indices[pattern.column(column)];
            for &colour in rows.iter().flat_map(|&row| &seen[row as usize]) {
                let colour = colour as usize;
                if colour >= taken.len() {
                    taken.resize(colour + 1, usize::MAX);
                }
                taken[colour] = column;
            }
            let free = (0..).find(|&colour| taken.get(colour) != Some(&column)).unwrap_or_default();
            let colour = free as u32;
            rows.iter().for_each(|&row| seen[row as usize].push(colour));
            of_column.push(colour);
        }
        Self { of_column, starts: pattern.column_starts.clone(), rows: pattern.row_indices.clone() }
    }

    /// Number of colours.
    pub(crate) fn count(&self) -> usize {
        self.of_column.iter().max().map_or(0, |&most| most as usize + 1)
    }

    /// Number of entries of the pattern.
    pub(crate) fn entries(&self) -> usize {
        self.rows.len()
    }

    pub(crate) fn words(&self) -> usize {
        4 + 2 * self.of_column.len() + self.rows.len()
    }

    /// Rows of a column as a range.
    pub(crate) fn column(&self, column: usize) -> std::ops::Range<usize> {
        self.starts[column] as usize..self.starts[column + 1] as usize
    }

    /// The numbers fit together.
    pub(crate) fn is_sound(&self, rows: usize) -> bool {
        let ascends = self.starts.windows(2).all(|pair| pair[0] <= pair[1]);
        let ends = self.starts.last().map(|&end| end as usize) == Some(self.rows.len());
        ascends && ends && self.rows.iter().all(|&row| (row as usize) < rows)
    }
}
