//! Substitution in the columns of L that belong to the first pivots, row by row.
//!
//! Taken column by column a row waits for its last change to come back from memory before the next one; by rows it stays
//! in a register.  The order of its changes is that of the pivots either way, so sums are the same to the bit.

use super::pivot::Pivot;

/// One product: value `source` times factor `place`.
#[derive(Clone, Copy, serde::Serialize, serde::Deserialize)]
struct Term {
    source: u32,
    place: u32,
}

/// The rows that change, in the order of their pivots.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(super) struct Lower {
    /// Row and number of its terms.
    rows: Vec<(u32, u32)>,
    terms: Vec<Term>,
    /// While they are listed: position of each row's pivot, and the terms with the positions of their rows.
    positions: Vec<u32>,
    unsorted: Vec<(u32, Term)>,
}

impl Lower {
    /// Lists the rows below the first pivots; `indices` are the columns and rows of the factors.
    pub(super) fn choose(&mut self, pivots: &[Pivot], first: usize, indices: &[u32]) {
        self.positions.resize(pivots.len(), 0);
        for (position, pivot) in pivots.iter().enumerate() {
            self.positions[pivot.row as usize] = position as u32;
        }
        self.unsorted.clear();
        for pivot in &pivots[..first] {
            self.unsorted.extend(pivot.lower_range().map(|place| {
                let term = Term { source: pivot.row, place: place as u32 };
                (self.positions[indices[place] as usize], term)
            }));
        }
        self.unsorted.sort_by_key(|&(position, _)| position);
        self.rows.clear();
        self.terms.clear();
        for of_row in self.unsorted.chunk_by(|a, b| a.0 == b.0) {
            self.rows.push((pivots[of_row[0].0 as usize].row, of_row.len() as u32));
            self.terms.extend(of_row.iter().map(|&(_, term)| term));
        }
    }

    /// Takes from `b` what the columns say; `values` are the factors.
    #[inline(always)]
    pub(super) fn subtract(&self, values: &[f64], b: &mut [f64]) {
        let mut rest = &*self.terms;
        for &(row, count) in &self.rows {
            let (here, later) = rest.split_at(count as usize);
            rest = later;
            let mut value = b[row as usize];
            for term in here {
                value -= values[term.place as usize] * b[term.source as usize];
            }
            b[row as usize] = value;
        }
    }
}
