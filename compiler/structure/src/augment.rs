//! Matching one equation at a time, as index reduction needs it.
//!
//! [`Augmenter::augment`] tries to match one more equation by a shortest augmenting path through admitted unknowns
//! (breadth-first variant of the AUGMENTPATH step in Pantelides 1988, *The consistent initialization of
//! differential-algebraic systems*).  If there is none, the equations and unknowns reached are returned: more
//! equations than unknowns, the smallest such set around the equation.  The incidence may grow between calls.

use crate::graph::{Column, Incidence, Row};
use crate::matching::Matching;
use crate::parts::Part;
use hyd_index::IndexVec;

/// Outcome of one attempt.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Augmentation {
    /// The equation is matched now (or was before).
    Matched,
    /// No path: the set has one equation more than (admitted) unknowns.  The matching is unchanged.
    Blocked(Part),
}

/// Work space of [`Augmenter::augment`], reused between calls so that one call costs only what it reaches.
#[derive(Clone, Debug)]
pub struct Augmenter {
    /// The row from which each column was reached in the attempt `stamp`.
    reached_from: IndexVec<Column, (u32, Row)>,
    stamp: u32,
    queue: Vec<Row>,
    columns: Vec<Column>,
}

impl Default for Augmenter {
    fn default() -> Self {
        Self::new()
    }
}

impl Augmenter {
    /// Empty work space; it grows with the incidence.
    pub fn new() -> Self {
        Self { reached_from: IndexVec::new(), stamp: 0, queue: Vec::new(), columns: Vec::new() }
    }

    /// Matches `row` through columns for which `admit` holds, or says what blocks it.
    ///
    /// `matching` may be smaller than the incidence (it is grown).  Columns that are not admitted are treated as
    /// absent; they keep a partner they already have.
    pub fn augment(
        &mut self,
        incidence: &Incidence,
        matching: &mut Matching,
        row: Row,
        admit: impl Fn(Column) -> bool,
    ) -> Augmentation {
        matching.grow(incidence);
        if matching.column_of_row[row].is_some() {
            return Augmentation::Matched;
        }
        self.start(incidence, row);
        let mut head = 0;
        while let Some(&row) = self.queue.get(head) {
            head += 1;
            for &column in incidence.row(row) {
                if self.reached_from[column].0 == self.stamp || !admit(column) {
                    continue;
                }
                self.reached_from[column] = (self.stamp, row);
                self.columns.push(column);
                match matching.row_of_column[column] {
                    None => {
                        self.flip(matching, column);
                        return Augmentation::Matched;
                    }
                    Some(next) => self.queue.push(next),
                }
            }
        }
        Augmentation::Blocked(Part::sorted(self.queue.clone(), self.columns.clone()))
    }

    fn start(&mut self, incidence: &Incidence, row: Row) {
        if self.stamp == u32::MAX {
            self.reached_from.raw.clear();
            self.stamp = 0;
        }
        let unreached = (0, Row(0));
        if self.reached_from.len() < incidence.column_count() {
            self.reached_from.raw.resize(incidence.column_count(), unreached);
        }
        self.stamp += 1;
        self.queue.clear();
        self.queue.push(row);
        self.columns.clear();
    }

    /// Walks back from a free column to the start, handing every column on the path to the row it was reached from.
    fn flip(&self, matching: &mut Matching, free: Column) {
        let mut next = Some(free);
        while let Some(column) = next {
            let (_, row) = self.reached_from[column];
            next = matching.column_of_row[row].replace(column);
            matching.row_of_column[column] = Some(row);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brute_force::{any_incidence, maximum_size, restrict};
    use crate::verify::check_matching;
    use proptest::prelude::*;

    proptest! {
        /// One equation at a time reaches the same size as exhaustive search over the admitted columns, also when
        /// the incidence grows between the calls; a blocked set violates Hall's condition by exactly one.
        #[test]
        fn agrees_with_exhaustive_search(
            full in any_incidence(7, 7),
            excluded in proptest::collection::vec(any::<bool>(), 7),
        ) {
            let admit = |column: Column| !excluded[column.0 as usize];
            let mut incidence = Incidence::new(full.column_count());
            let mut matching = Matching::empty(&incidence);
            let mut augmenter = Augmenter::new();
            for row in full.rows() {
                incidence.push_row(full.row(row).iter().copied()).expect("same row");
                let before = matching.size();
                match augmenter.augment(&incidence, &mut matching, row, admit) {
                    Augmentation::Matched => prop_assert_eq!(matching.size(), before + 1),
                    Augmentation::Blocked(part) => {
                        prop_assert_eq!(matching.size(), before);
                        prop_assert_eq!(part.rows.len(), part.columns.len() + 1);
                        prop_assert!(part.rows.contains(&row));
                        for &member in &part.rows {
                            for column in incidence.row(member).iter().filter(|&&c| admit(c)) {
                                prop_assert!(part.columns.contains(column));
                            }
                        }
                    }
                }
                prop_assert_eq!(check_matching(&incidence, &matching), Ok(()));
            }
            let admitted = restrict(&full, |entry| admit(full.column_of(entry)));
            prop_assert_eq!(matching.size(), maximum_size(&admitted));
        }
    }

    #[test]
    fn a_released_column_can_be_matched_again() {
        let incidence: Incidence = "2 rows, 2 columns\neq0: v0\neq1: v0 v1\n".parse().expect("text");
        let mut matching = Matching::empty(&incidence);
        let mut augmenter = Augmenter::new();
        let not_v1 = |column| column != Column(1);
        let outcome = augmenter.augment(&incidence, &mut matching, Row(1), |_| true);
        assert_eq!(outcome, Augmentation::Matched);
        assert_eq!(matching.column_of_row[Row(1)], Some(Column(0)));
        let outcome = augmenter.augment(&incidence, &mut matching, Row(0), not_v1);
        let part = Part::sorted(vec![Row(0), Row(1)], vec![Column(0)]);
        assert_eq!(outcome, Augmentation::Blocked(part));
        matching.release(Row(1));
        let outcome = augmenter.augment(&incidence, &mut matching, Row(0), not_v1);
        assert_eq!(outcome, Augmentation::Matched);
    }
}
