//! The smallest set of equations that has more members than unknowns, for messages.
//!
//! The set around one unmatched equation ([`minimal_overdetermined`](crate::minimal_overdetermined)) is minimal, but with
//! several surplus equations another may be smaller; the smallest is a shortest circuit of a transversal matroid, which is hard to
//! find in general.  First equations are matched in the order of their distance from each of a few seeds, the first that is
//! blocked closing a set.  Then branch and bound looks for smaller ones (Land and Doig 1960): an unknown with one equation
//! of the set needs another, a set that reaches `n` unknowns ends with at least `n + 1` equations (Hall 1935).  The result
//! is the smallest unless [`MOST_LOOKS`] did not suffice, which takes large sets in dense parts; without any one of its
//! equations the rest can be matched in any case.

use crate::augment::{Augmentation, Augmenter};
use crate::decomposition::decompose;
use crate::graph::{Column, Incidence, Row};
use crate::matching::Matching;
use crate::parts::Part;
use hyd_index::IndexVec;

/// Equations that branch and bound looks at, each time that it does.
pub const MOST_LOOKS: usize = 2_000_000;
/// Equations that sets are first sought around.
const MOST_SEEDS: usize = 64;

/// The smallest over-determined set found; `None` if the matching covers all rows or is not maximum.
pub fn smallest_overdetermined(incidence: &Incidence, matching: &Matching) -> Option<Part> {
    let over = decompose(incidence, matching).ok()?.over;
    if over.rows.is_empty() {
        return None;
    }
    let users = users(incidence, &over);
    let near = around_seeds(incidence, &over, &users)?;
    let mut search = Search::new(incidence, &users, near.rows);
    search.run(&over);
    closed_set(incidence, &search.best)
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

/// The first set that closes when equations are matched around each seed; the seeds are those with the fewest unknowns.
fn around_seeds(incidence: &Incidence, over: &Part, users: &IndexVec<Column, Vec<Row>>) -> Option<Part> {
    let mut best: Option<Part> = None;
    for &seed in seeds(incidence, over).iter().take(MOST_SEEDS) {
        let limit = best.as_ref().map_or(usize::MAX, |best| best.rows.len());
        if let Some(part) = around(incidence, users, seed).filter(|part| part.rows.len() < limit) {
            best = Some(part);
        }
    }
    best
}

/// Rows with few unknowns first.
fn seeds(incidence: &Incidence, over: &Part) -> Vec<Row> {
    let mut seeds = over.rows.clone();
    seeds.sort_by_key(|&row| (incidence.row(row).len(), row));
    seeds
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

/// The first set that closes when these rows are matched in order.
fn closed_set(incidence: &Incidence, rows: &[Row]) -> Option<Part> {
    let mut matching = Matching::empty(incidence);
    let mut augmenter = Augmenter::new();
    rows.iter().find_map(|&row| match augmenter.augment(incidence, &mut matching, row, |_| true) {
        Augmentation::Blocked(part) => Some(part),
        _ => None,
    })
}

/// Branch and bound over sets that are connected by their columns.
struct Search<'a> {
    incidence: &'a Incidence,
    users: &'a IndexVec<Column, Vec<Row>>,
    /// The smallest over-determined set so far.
    best: Vec<Row>,
    /// The set at hand.
    set: Vec<Row>,
    /// Its columns, in the order in which they came.
    columns: Vec<Column>,
    /// In how many rows of the set each column occurs.
    uses: IndexVec<Column, u32>,
    /// Rows in the set, or ruled out below the node at hand.
    closed: IndexVec<Row, bool>,
    looks: usize,
}

impl<'a> Search<'a> {
    fn new(incidence: &'a Incidence, users: &'a IndexVec<Column, Vec<Row>>, best: Vec<Row>) -> Self {
        Self {
            incidence,
            users,
            best,
            set: Vec::new(),
            columns: Vec::new(),
            uses: IndexVec::filled(0, incidence.column_count()),
            closed: IndexVec::filled(false, incidence.row_count()),
            looks: 0,
        }
    }

    /// Sets with the first row, then those without it but with the second, and so on.
    fn run(&mut self, over: &Part) {
        for row in seeds(self.incidence, over) {
            if self.looks > MOST_LOOKS {
                return;
            }
            self.include(row);
            self.closed[row] = true;
        }
    }

    /// All sets that contain the set at hand, this row and no closed one.
    fn include(&mut self, row: Row) {
        self.looks += 1;
        if self.looks > MOST_LOOKS {
            return;
        }
        let known = self.columns.len();
        for &column in self.incidence.row(row) {
            self.uses[column] += 1;
            if self.uses[column] == 1 {
                self.columns.push(column);
            }
        }
        self.set.push(row);
        self.closed[row] = true;
        if self.set.len() > self.columns.len() {
            if self.set.len() < self.best.len() {
                self.best.clone_from(&self.set);
            }
        } else if self.columns.len() + 1 < self.best.len() {
            self.branch();
        }
        self.closed[row] = false;
        self.set.pop();
        self.columns.truncate(known);
        self.incidence.row(row).iter().for_each(|&column| self.uses[column] -= 1);
    }

    /// The next row: one of those with the loneliest column, or any neighbour if no column is lonely.
    fn branch(&mut self) {
        self.looks += self.columns.iter().map(|&column| self.users[column].len()).sum::<usize>();
        let open = |column: &Column| self.users[*column].iter().filter(|&&row| !self.closed[row]);
        let lonely = self.columns.iter().filter(|&&column| self.uses[column] == 1);
        let mut next: Vec<Row> = match lonely.min_by_key(|column| open(column).count()) {
            Some(column) => open(column).copied().collect(),
            None => self.columns.iter().flat_map(open).copied().collect(),
        };
        next.sort_by_key(|&row| (self.incidence.row(row).len(), row));
        next.dedup();
        for &row in &next {
            self.include(row);
            self.closed[row] = true;
        }
        next.iter().for_each(|&row| self.closed[row] = false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brute_force::{any_incidence, maximum_size, restrict};
    use crate::maximum_matching::maximum_matching;
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

        /// No set of fewer equations is over-determined.
        #[test]
        fn no_set_is_smaller(incidence in any_incidence(7, 5)) {
            let matching = maximum_matching(&incidence, None);
            let fewest = fewest_rows(&incidence);
            let part = smallest_overdetermined(&incidence, &matching);
            prop_assert_eq!(part.as_ref().map(|part| part.rows.len() as u32), fewest);
            if let Some(part) = part {
                prop_assert!(is_overdetermined(&incidence, &part));
            }
        }

        /// No set of fewer equations contains fewer unknowns, among more sets than the definition can be tried on.
        #[test]
        fn no_set_has_a_surplus_with_fewer_members(incidence in any_incidence(13, 11)) {
            let part = smallest_overdetermined(&incidence, &maximum_matching(&incidence, None));
            let reach: Vec<u32> = incidence.rows().map(|row| incidence.row(row).iter().fold(0, |a, c| a | 1 << c.0)).collect();
            let columns = |set: u32| (0..reach.len()).filter(|k| set >> k & 1 == 1).fold(0, |a, k| a | reach[k]);
            let surplus = |set: &u32| set.count_ones() > columns(*set).count_ones();
            let fewest = (1..1_u32 << reach.len()).filter(surplus).map(u32::count_ones).min();
            prop_assert_eq!(part.map(|part| part.rows.len() as u32), fewest);
        }

        /// In large parts too: without any one of its equations the rest can be matched.
        #[test]
        fn sets_are_irreducible(incidence in any_incidence(40, 30)) {
            let matching = maximum_matching(&incidence, None);
            let Some(part) = smallest_overdetermined(&incidence, &matching) else { return Ok(()) };
            prop_assert!(is_overdetermined(&incidence, &part));
            for without in &part.rows {
                let kept = |entry: crate::Entry| part.rows.iter().any(|row| {
                    row != without && incidence.entry_range(*row).contains(&entry.index())
                });
                let rest = maximum_matching(&restrict(&incidence, kept), None);
                prop_assert_eq!(rest.column_of_row.iter().flatten().count(), part.rows.len() - 1);
            }
        }
    }

    /// A part in which the search around single equations closes larger sets first: wide equations that share their unknowns.
    #[test]
    fn a_set_of_wide_equations_is_found_among_narrow_ones() {
        // A ring of 30 pairs with a value for two of its unknowns: both and the way between them make 17 equations.
        let count = 30_u32;
        let mut rows: Vec<Vec<Column>> = (0..count - 1).map(|k| vec![Column(k), Column(k + 1)]).collect();
        rows.extend([vec![Column(0)], vec![Column(15)]]);
        // Four equations in three unknowns of the chain.
        let wide = [5, 12, 19].map(Column);
        rows.extend((0..4).map(|_| wide.to_vec()));
        let incidence = Incidence::from_rows(count as usize, rows).expect("ascending");
        let part = smallest_overdetermined(&incidence, &maximum_matching(&incidence, None)).expect("five too many");
        assert_eq!((part.rows.len(), part.columns), (4, wide.to_vec()));
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
