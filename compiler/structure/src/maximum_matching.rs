//! Maximum bipartite matching: which equation determines which unknown.
//!
//! A cheap assignment (module `cheap`) is completed by phases of shortest augmenting paths (Hopcroft & Karp 1973,
//! *An n^5/2 algorithm for maximum matchings in bipartite graphs*): O(sqrt(n)) phases, each linear in the entries.
//! Entries may carry a priority class, 0 preferred: the entries of class 0 are matched to the maximum first, then
//! those of class 0 and 1, and so on (an augmenting path never frees what is matched).  This prefers low classes
//! strongly but does not minimise the number of high ones, which would be an assignment problem with weights.

use crate::cheap::{EntryFilter, extend_cheaply};
use crate::graph::{Entry, Incidence, Row};
use crate::matching::Matching;
use hyd_index::{IndexVec, TypedIndex};

/// A matching of the largest possible size.
///
/// `classes` gives each entry its priority class, 0 preferred; `None` treats all entries alike.  If a perfect
/// matching within class 0 exists, the result stays within class 0.  The result is a function of its arguments.
/// Panics if `classes` does not have one value per entry (a programming error).
pub fn maximum_matching(incidence: &Incidence, classes: Option<&IndexVec<Entry, u8>>) -> Matching {
    let transpose = incidence.transpose();
    let mut matching = Matching::empty(incidence);
    let mut search = PathSearch::new(incidence);
    for limit in class_levels(incidence, classes) {
        let filter = EntryFilter { classes, limit };
        extend_cheaply(incidence, &transpose, filter, &mut matching);
        search.complete(incidence, filter, &mut matching);
        if matching.size() == incidence.row_count().min(incidence.column_count()) {
            break;
        }
    }
    debug_assert_eq!(crate::verify::check_maximum_matching(incidence, &matching), Ok(()));
    matching
}

/// The classes that occur, ascending.
fn class_levels(incidence: &Incidence, classes: Option<&IndexVec<Entry, u8>>) -> Vec<u8> {
    let Some(classes) = classes else {
        return vec![0];
    };
    assert!(classes.len() == incidence.entry_count(), "invariant: one class per entry");
    let mut present = [false; 256];
    for &class in classes.iter() {
        present[class as usize] = true;
    }
    (0..=u8::MAX).filter(|&class| present[class as usize]).collect()
}

const UNREACHED: u32 = u32::MAX;

/// Work space of the phases.
struct PathSearch {
    /// Layer of each row in the current phase; `UNREACHED` once used or given up.
    layer: IndexVec<Row, u32>,
    /// Next entry position to try for each row in the current phase.
    cursor: IndexVec<Row, usize>,
    queue: Vec<Row>,
    path: Vec<Row>,
}

impl PathSearch {
    fn new(incidence: &Incidence) -> Self {
        Self {
            layer: IndexVec::filled(UNREACHED, incidence.row_count()),
            cursor: IndexVec::filled(0, incidence.row_count()),
            queue: Vec::new(),
            path: Vec::new(),
        }
    }

    /// Phases until no augmenting path of admitted entries is left.
    fn complete(&mut self, incidence: &Incidence, filter: EntryFilter<'_>, matching: &mut Matching) {
        let mut roots: Vec<Row> = matching.unmatched_rows().collect();
        while self.build_layers(incidence, filter, matching, &roots) {
            for &root in &roots {
                self.augment_from(incidence, filter, matching, root);
            }
            roots.retain(|&row| matching.column_of_row[row].is_none());
        }
    }

    /// Breadth-first layers of rows from the free ones up to the first layer that sees a free column.
    fn build_layers(
        &mut self,
        incidence: &Incidence,
        filter: EntryFilter<'_>,
        matching: &Matching,
        roots: &[Row],
    ) -> bool {
        self.layer.raw.fill(UNREACHED);
        self.queue.clear();
        for &root in roots {
            self.visit(incidence, root, 0);
        }
        let (mut head, mut last) = (0, UNREACHED);
        while let Some(&row) = self.queue.get(head) {
            head += 1;
            let layer = self.layer[row];
            if layer > last {
                break;
            }
            for (entry, column) in incidence.entries(row) {
                if !filter.admits(entry) {
                    continue;
                }
                match matching.row_of_column[column] {
                    None => last = layer,
                    Some(next) if self.layer[next] == UNREACHED && last == UNREACHED => {
                        self.visit(incidence, next, layer + 1);
                    }
                    Some(_) => {}
                }
            }
        }
        last != UNREACHED
    }

    fn visit(&mut self, incidence: &Incidence, row: Row, layer: u32) {
        self.layer[row] = layer;
        self.cursor[row] = incidence.entry_range(row).start;
        self.queue.push(row);
    }

    /// Depth-first search through the layers; flips the first path that ends in a free column.
    fn augment_from(&mut self, incidence: &Incidence, filter: EntryFilter<'_>, matching: &mut Matching, root: Row) {
        self.path.clear();
        self.path.push(root);
        while let Some(&row) = self.path.last() {
            let entry = self.cursor[row];
            if entry == incidence.entry_range(row).end {
                self.layer[row] = UNREACHED;
                self.path.pop();
                if let Some(&parent) = self.path.last() {
                    self.cursor[parent] += 1;
                }
                continue;
            }
            let entry = Entry::new(entry);
            if !filter.admits(entry) {
                self.cursor[row] += 1;
                continue;
            }
            match matching.row_of_column[incidence.column_of(entry)] {
                None => return self.flip(incidence, matching),
                Some(next) if self.layer[next] != UNREACHED && self.layer[next] == self.layer[row] + 1 => {
                    self.path.push(next);
                }
                Some(_) => self.cursor[row] += 1,
            }
        }
    }

    /// Gives every row of the path the column its cursor stands on; its rows are used up in this phase.
    fn flip(&mut self, incidence: &Incidence, matching: &mut Matching) {
        for &row in self.path.iter().rev() {
            let column = incidence.column_of(Entry::new(self.cursor[row]));
            matching.column_of_row[row] = Some(column);
            matching.row_of_column[column] = Some(row);
            self.layer[row] = UNREACHED;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brute_force::{any_incidence, any_incidence_with, maximum_size, restrict};
    use crate::graph::Column;
    use crate::verify::{check_matching, check_maximum_matching};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn size_agrees_with_exhaustive_search(incidence in any_incidence(7, 7)) {
            let matching = maximum_matching(&incidence, None);
            prop_assert_eq!(check_matching(&incidence, &matching), Ok(()));
            prop_assert_eq!(matching.size(), maximum_size(&incidence));
        }

        #[test]
        fn phases_alone_are_maximum(incidence in any_incidence(7, 7)) {
            let mut matching = Matching::empty(&incidence);
            let filter = EntryFilter { classes: None, limit: 0 };
            PathSearch::new(&incidence).complete(&incidence, filter, &mut matching);
            prop_assert_eq!(check_matching(&incidence, &matching), Ok(()));
            prop_assert_eq!(matching.size(), maximum_size(&incidence));
        }

        /// Whatever the classes, the size is maximum, and at least as many rows are matched as class 0 allows alone;
        /// a perfect matching within class 0 is found.
        #[test]
        fn classes_steer_but_do_not_shrink((incidence, classes) in any_incidence_with(6, 6, 0..3_u8)) {
            let matching = maximum_matching(&incidence, Some(&classes));
            prop_assert_eq!(matching.size(), maximum_size(&incidence));
            let preferred = restrict(&incidence, |entry| classes[entry] == 0);
            let perfect = incidence.row_count().min(incidence.column_count());
            if maximum_size(&preferred) == perfect {
                for (row, column) in matching.column_of_row.iter_enumerated() {
                    let entry = column.and_then(|column| incidence.entry(row, column));
                    prop_assert!(entry.is_none_or(|entry| classes[entry] == 0));
                }
            }
        }
    }

    #[test]
    fn prints_pairs_and_leftovers() {
        let incidence: Incidence = "2 rows, 2 columns\neq0: v0\neq1: v0\n".parse().expect("text");
        let matching = maximum_matching(&incidence, None);
        let text = "eq0 -> v0\neq1 -> none\nnone -> v1\n";
        assert_eq!(matching.to_string(), text);
    }

    /// Equation k holds v(k), v(k+1) and the last one only v(0): greedy choice by number misses one long path.
    #[test]
    fn long_augmenting_path_of_1e5_rows() {
        let n = 100_000_u32;
        let rows = (0..n).map(|k| match k {
            _ if k + 1 == n => vec![Column(0)],
            _ => vec![Column(k), Column(k + 1)],
        });
        let incidence = Incidence::from_rows(n as usize, rows).expect("sorted");
        let mut matching = Matching::empty(&incidence);
        for k in 0..n - 1 {
            matching.assign(Row(k), Column(k));
        }
        let filter = EntryFilter { classes: None, limit: 0 };
        PathSearch::new(&incidence).complete(&incidence, filter, &mut matching);
        assert!(matching.is_perfect());
        assert_eq!(check_maximum_matching(&incidence, &matching), Ok(()));
        assert!(maximum_matching(&incidence, None).is_perfect());
    }
}
