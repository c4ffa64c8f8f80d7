//! The smallest set of equations that has more members than unknowns, for messages.
//!
//! The set around one unmatched equation ([`minimal_overdetermined`](crate::minimal_overdetermined)) is minimal, but with
//! several surplus equations another may be smaller; the smallest is a shortest circuit of a transversal matroid, which is hard to
//! find in general.  Up to [`EXHAUSTIVE`] equations every subset is looked at (Hall 1935).  In larger parts equations are matched
//! in the order of their distance from each of a few seeds, the first that is blocked closing a set: exact where the smallest set
//! lies close together, else an upper bound.

use crate::augment::{Augmentation, Augmenter};
use crate::decomposition::{Part, decompose};
use crate::graph::{Column, Incidence, Row};
use crate::matching::Matching;
use hyd_index::IndexVec;

/// Parts of at most so many equations are searched completely.
pub const EXHAUSTIVE: usize = 16;
/// Larger parts are searched around at most so many equations.
const MOST_SEEDS: usize = 64;

/// The smallest over-determined set found; `None` if the matching covers all rows or is not maximum.
pub fn smallest_overdetermined(incidence: &Incidence, matching: &Matching) -> Option<Part> {
    let over = decompose(incidence, matching).ok()?.over;
    if over.rows.is_empty() {
        return None;
    }
    if over.rows.len() <= EXHAUSTIVE { exhaustive(incidence, &over) } else { around_seeds(incidence, &over) }
}

/// The smallest under-determined set found: more unknowns than equations that they occur in.  As for equations, with the two
/// exchanged.
pub fn smallest_underdetermined(incidence: &Incidence, matching: &Matching) -> Option<Part> {
    let transpose = incidence.transpose();
    let lines = incidence.columns().map(|column| transpose.rows(column).iter().map(|row| Column(row.0)));
    let exchanged = Incidence::from_rows(incidence.row_count(), lines).ok()?;
    let mut partner = Matching::empty(&exchanged);
    for (row, column) in matching.column_of_row.iter_enumerated() {
        if let Some(column) = column {
            partner.assign(Row(column.0), Column(row.0));
        }
    }
    let part = smallest_overdetermined(&exchanged, &partner)?;
    let rows = part.columns.iter().map(|column| Row(column.0)).collect();
    Some(Part { rows, columns: part.rows.iter().map(|row| Column(row.0)).collect() })
}

/// All subsets, by the columns that they reach.
fn exhaustive(incidence: &Incidence, over: &Part) -> Option<Part> {
    let bit = |column: &Column| over.columns.binary_search(column).map_or(0, |k| 1_u32 << k);
    let reach: Vec<u32> =
        over.rows.iter().map(|&row| incidence.row(row).iter().map(bit).fold(0, |a, b| a | b)).collect();
    let mut columns = vec![0_u32; 1 << over.rows.len()];
    let mut best: Option<u32> = None;
    for set in 1..columns.len() as u32 {
        let first = set.trailing_zeros() as usize;
        columns[set as usize] = columns[(set & (set - 1)) as usize] | reach[first];
        let surplus = set.count_ones() > columns[set as usize].count_ones();
        if surplus && best.is_none_or(|best| set.count_ones() < best.count_ones()) {
            best = Some(set);
        }
    }
    let best = best?;
    let chosen = |members: &[_], set: u32| (0..members.len()).filter(|k| set >> k & 1 == 1).collect::<Vec<_>>();
    Some(Part {
        rows: chosen(&[(); EXHAUSTIVE], best).into_iter().map(|k| over.rows[k]).collect(),
        columns: chosen(&[(); 32], columns[best as usize]).into_iter().map(|k| over.columns[k]).collect(),
    })
}

/// The first set that closes when equations are matched around each seed; the seeds are those with the fewest unknowns.
fn around_seeds(incidence: &Incidence, over: &Part) -> Option<Part> {
    let neighbours = users(incidence, over);
    let mut seeds = over.rows.clone();
    seeds.sort_by_key(|&row| (incidence.row(row).len(), row));
    let mut best: Option<Part> = None;
    for &seed in seeds.iter().take(MOST_SEEDS) {
        let limit = best.as_ref().map_or(usize::MAX, |best| best.rows.len());
        if let Some(part) = around(incidence, &neighbours, seed).filter(|part| part.rows.len() < limit) {
            best = Some(part);
        }
    }
    best
}

/// The rows of the part in which each column occurs.
fn users(incidence: &Incidence, over: &Part) -> IndexVec<Column, Vec<Row>> {
    let mut users: IndexVec<Column, Vec<Row>> = IndexVec::filled(Vec::new(), incidence.column_count());
    for &row in &over.rows {
        for &column in incidence.row(row) {
            users[column].push(row);
        }
    }
    users
}

fn around(incidence: &Incidence, users: &IndexVec<Column, Vec<Row>>, seed: Row) -> Option<Part> {
    let mut matching = Matching::empty(incidence);
    let mut augmenter = Augmenter::new();
    let mut seen = IndexVec::filled(false, incidence.row_count());
    seen[seed] = true;
    let mut ring = vec![seed];
    while !ring.is_empty() {
        // Within the same distance those with few unknowns first.
        ring.sort_by_key(|&row| (incidence.row(row).len(), row));
        for &row in &ring {
            if let Augmentation::Blocked(part) = augmenter.augment(incidence, &mut matching, row, |_| true) {
                return Some(part);
            }
        }
        let mut next = Vec::new();
        for column in ring.iter().flat_map(|&row| incidence.row(row)) {
            next.extend(users[*column].iter().copied().filter(|&row| !std::mem::replace(&mut seen[row], true)));
        }
        ring = next;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brute_force::{any_incidence, maximum_size, restrict};
    use crate::matching::maximum_matching;
    use hyd_index::TypedIndex;
    use proptest::prelude::*;

    /// Fewest rows that cannot all be matched, by trying all sets.
    fn fewest_rows(incidence: &Incidence) -> Option<u32> {
        let rows: Vec<Row> = incidence.rows().collect();
        let cannot = |set: &u32| {
            let member = |row: Row| set >> row.index() & 1 == 1;
            let inside = |entry: crate::Entry| {
                rows.iter().any(|&row| member(row) && incidence.entry_range(row).contains(&entry.index()))
            };
            maximum_size(&restrict(incidence, inside)) < set.count_ones() as usize
        };
        (0..1_u32 << rows.len()).filter(cannot).map(u32::count_ones).min()
    }

    fn is_overdetermined(incidence: &Incidence, part: &Part) -> bool {
        let closed = |&row: &Row| incidence.row(row).iter().all(|column| part.columns.contains(column));
        part.rows.iter().all(closed) && part.rows.len() > part.columns.len()
    }

    proptest! {
        /// The same for unknowns: no fewer unknowns occur in still fewer equations.
        #[test]
        fn no_set_of_unknowns_is_smaller(incidence in any_incidence(5, 7)) {
            let part = smallest_underdetermined(&incidence, &maximum_matching(&incidence, None));
            let columns: Vec<Column> = incidence.columns().collect();
            let occurs_in = |set: u32| {
                let member = |column: &Column| set >> column.index() & 1 == 1;
                incidence.rows().filter(|&row| incidence.row(row).iter().any(member)).count()
            };
            let lacking = |set: &u32| set.count_ones() as usize > occurs_in(*set);
            let fewest = (0..1_u32 << columns.len()).filter(lacking).map(u32::count_ones).min();
            prop_assert_eq!(part.map(|part| part.columns.len() as u32), fewest);
        }

        /// No set of fewer equations is over-determined; the search around seeds gives a set, no smaller one.
        #[test]
        fn no_set_is_smaller(incidence in any_incidence(7, 5)) {
            let matching = maximum_matching(&incidence, None);
            let fewest = fewest_rows(&incidence);
            let part = smallest_overdetermined(&incidence, &matching);
            prop_assert_eq!(part.as_ref().map(|part| part.rows.len() as u32), fewest);
            if let Some(part) = part {
                prop_assert!(is_overdetermined(&incidence, &part));
                let over = decompose(&incidence, &matching).expect("maximum").over;
                let near = around_seeds(&incidence, &over).expect("the part is over-determined");
                prop_assert!(is_overdetermined(&incidence, &near) && near.rows.len() >= part.rows.len());
            }
        }
    }

    /// A long chain with one equation too many, and a pair of equations in one unknown far from it: the pair is found.
    #[test]
    fn a_small_set_is_found_in_a_large_part() {
        let count = 60_u32;
        let mut rows: Vec<Vec<Column>> = (0..count - 1).map(|k| vec![Column(k), Column(k + 1)]).collect();
        rows.extend([vec![Column(0)], vec![Column(count - 1)], vec![Column(31)], vec![Column(31), Column(31 + 1)]]);
        let incidence = Incidence::from_rows(count as usize, rows).expect("ascending");
        let matching = maximum_matching(&incidence, None);
        let part = smallest_overdetermined(&incidence, &matching).expect("three equations too many");
        // v31; v31 v32, twice.
        assert_eq!((part.rows.len(), part.columns.as_slice()), (3, &[Column(31), Column(32)][..]));
    }
}
