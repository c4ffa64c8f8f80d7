//! Columns by where their values come from, so that what several names share is kept, written and compared once.
//!
//! Aliases are columns of one output, at most with another sign; parameters and constants do not change from row to row.  A
//! [`Tracks`] lists the outputs that columns show, each once and in ascending order, and for each column which of them it is.

use hyd_system::{Place, Source};

use crate::Column;

/// What a column is in each row.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Origin {
    /// An output that is kept.
    Track {
        /// Its position among those that are kept.
        track: u32,
        /// The column is its negative.
        negated: bool,
    },
    /// Always the same number.
    Fixed(f64),
}

/// The outputs that columns show, and what each column is.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Tracks {
    /// What each column is.
    pub origins: Vec<Origin>,
    /// First output and number of outputs of neighbours that are kept.
    runs: Vec<(u32, u32)>,
    count: usize,
}

impl Tracks {
    /// The tracks of columns; `parameters` are the values that the run has.
    pub fn new(columns: &[Column], parameters: &[f64]) -> Self {
        let output = |column: &Column| match column.source.place {
            Place::Output(k) => Some(k),
            Place::Parameter(_) | Place::Constant(_) => None,
        };
        let mut outputs: Vec<u32> = columns.iter().filter_map(output).collect();
        outputs.sort_unstable();
        outputs.dedup();
        let mut runs: Vec<(u32, u32)> = Vec::new();
        for &k in &outputs {
            match runs.last_mut() {
                Some((first, length)) if *first + *length == k => *length += 1,
                _ => runs.push((k, 1)),
            }
        }
        let origin = |column: &Column| {
            let Source { place, negated } = column.source;
            match place {
                // Every output of a column is in the list.
                Place::Output(k) => Origin::Track { track: outputs.partition_point(|&own| own < k) as u32, negated },
                Place::Parameter(_) | Place::Constant(_) => Origin::Fixed(column.value(&[], parameters)),
            }
        };
        Self { origins: columns.iter().map(origin).collect(), runs, count: outputs.len() }
    }

    /// How many outputs are kept.
    pub fn len(&self) -> usize {
        self.count
    }

    /// True if no column changes.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Appends the outputs that are kept; NaN for those that the row does not have.
    pub fn gather(&self, row: &[f64], kept: &mut Vec<f64>) {
        for &(first, length) in &self.runs {
            let range = first as usize..(first + length) as usize;
            match row.get(range.clone()) {
                Some(values) => kept.extend_from_slice(values),
                None => kept.extend(range.map(|k| row.get(k).copied().unwrap_or(f64::NAN))),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_names_share_is_kept_once() {
        let column = |place, negated| Column { name: String::new(), source: Source { place, negated } };
        let columns = [
            column(Place::Output(5), false),
            column(Place::Output(2), true),
            column(Place::Parameter(1), true),
            column(Place::Output(5), true),
            column(Place::Output(3), false),
            column(Place::Constant(4.0), false),
        ];
        let tracks = Tracks::new(&columns, &[0.0, 8.0]);
        let mut kept = Vec::new();
        tracks.gather(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0], &mut kept);
        assert_eq!((tracks.len(), kept.as_slice()), (3, &[2.0, 3.0, 5.0][..]));
        let track = |track, negated| Origin::Track { track, negated };
        assert_eq!(
            tracks.origins,
            [track(2, false), track(0, true), Origin::Fixed(-8.0), track(2, true), track(1, false), Origin::Fixed(4.0)]
        );
        kept.clear();
        tracks.gather(&[0.0, 1.0, 2.0], &mut kept);
        assert!(kept[0] == 2.0 && kept[1].is_nan() && kept[2].is_nan());
    }
}
