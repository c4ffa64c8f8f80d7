//! Random small graphs and exhaustive answers for the property tests.
//!
//! Everything here follows definitions, not the algorithms under test: matchings by trying every choice, reachability
//! by repeated relaxation.  Only for patterns of a few rows.

use crate::graph::{Column, Entry, Incidence, Row};
use hyd_index::{IndexVec, TypedIndex};
use proptest::collection::vec;
use proptest::prelude::*;

fn from_flags(columns: usize, flags: &[Vec<bool>]) -> Incidence {
    let rows = flags.iter().map(|row| {
        let columns = (0..columns).filter(|&k| row[k]);
        columns.map(Column::new).collect::<Vec<_>>()
    });
    Incidence::from_rows(columns, rows).expect("ascending by construction")
}

/// Patterns of up to `rows` x `columns` of any density (exactly `columns` columns).
pub(crate) fn any_incidence(rows: usize, columns: usize) -> impl Strategy<Value = Incidence> {
    (0.05_f64..0.7).prop_flat_map(move |density| {
        let flag = proptest::bool::weighted(density);
        vec(vec(flag, columns), 0..=rows).prop_map(move |flags| from_flags(columns, &flags))
    })
}

/// The same with a value for every entry.
pub(crate) fn any_incidence_with<T: std::fmt::Debug + Clone>(
    rows: usize,
    columns: usize,
    value: impl Strategy<Value = T> + Clone,
) -> impl Strategy<Value = (Incidence, IndexVec<Entry, T>)> {
    any_incidence(rows, columns).prop_flat_map(move |incidence| {
        let values = vec(value.clone(), incidence.entry_count());
        values.prop_map(move |values| (incidence.clone(), IndexVec::from_vec(values)))
    })
}

/// Square patterns of 1 to `size` rows that hold a (scrambled) diagonal, so that a perfect matching exists.
pub(crate) fn any_incidence_square(size: usize) -> impl Strategy<Value = Incidence> {
    (1..=size, 0.0_f64..0.5).prop_flat_map(|(n, density)| {
        let diagonal = Just((0..n).collect::<Vec<_>>()).prop_shuffle();
        let flags = vec(vec(proptest::bool::weighted(density), n), n);
        (diagonal, flags).prop_map(move |(diagonal, mut flags)| {
            for (row, &column) in diagonal.iter().enumerate() {
                flags[row][column] = true;
            }
            from_flags(n, &flags)
        })
    })
}

/// The pattern with the entries for which `keep` holds.
pub(crate) fn restrict(incidence: &Incidence, keep: impl Fn(Entry) -> bool) -> Incidence {
    let rows = incidence.rows().map(|row| {
        let entries = incidence.entries(row).filter(|&(entry, _)| keep(entry));
        entries.map(|(_, column)| column).collect::<Vec<_>>()
    });
    Incidence::from_rows(incidence.column_count(), rows).expect("a part of a valid pattern")
}

/// The size of a maximum matching, by trying every column and "none" for every row.
pub(crate) fn maximum_size(incidence: &Incidence) -> usize {
    fn best(incidence: &Incidence, row: usize, used: u64) -> usize {
        if row == incidence.row_count() {
            return 0;
        }
        let free = |column: &&Column| used >> column.0 & 1 == 0;
        let columns = incidence.row(Row::new(row)).iter().filter(free);
        let with = columns.map(|column| 1 + best(incidence, row + 1, used | 1 << column.0));
        with.max().unwrap_or(0).max(best(incidence, row + 1, used))
    }
    best(incidence, 0, 0)
}

/// `result[a][b]`: a path of at least one edge leads from `a` to `b`.
pub(crate) fn transitive_closure(edges: &[Vec<bool>]) -> Vec<Vec<bool>> {
    let mut reach = edges.to_vec();
    for via in 0..reach.len() {
        for from in 0..reach.len() {
            for to in 0..reach.len() {
                reach[from][to] |= reach[from][via] && reach[via][to];
            }
        }
    }
    reach
}
