//! Dulmage-Mendelsohn decomposition: where a system has too many and where too few equations.
//!
//! From a maximum matching, alternating paths out of the unmatched equations reach the over-determined part, those
//! out of the unmatched unknowns the under-determined part; the rest is square and perfectly matched.  The parts do
//! not depend on the matching (Dulmage & Mendelsohn 1958, *Coverings of bipartite graphs*; computed as in Pothen & Fan
//! 1990, *Computing the block triangular form of a sparse matrix*, section 2).  The set reached from a single
//! unmatched vertex is the smallest explanation of that vertex.  Words: "over-determined" is Pothen & Fan's vertical
//! and "under-determined" their horizontal part.

use crate::graph::{Column, Incidence, Row, Transpose};
use crate::matching::Matching;
use crate::parts::{Decomposition, Part};
use hyd_index::{IndexVec, TypedIndex};
use std::fmt;

/// The matching is not maximum: an alternating path leads from this free vertex to a free vertex of the other side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotMaximum {
    /// The unmatched equation.
    pub row: Row,
    /// The unmatched unknown.
    pub column: Column,
}

impl fmt::Display for NotMaximum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { row, column } = self;
        write!(f, "the matching is not maximum: it can be extended by {row} and {column}")
    }
}

impl std::error::Error for NotMaximum {}

/// The coarse Dulmage-Mendelsohn decomposition; linear in the entries.
pub fn decompose(incidence: &Incidence, matching: &Matching) -> Result<Decomposition, NotMaximum> {
    let free_rows: Vec<Row> = matching.unmatched_rows().collect();
    let free_columns: Vec<Column> = matching.unmatched_columns().collect();
    let over = reach_from_rows(incidence, matching, &free_rows)?;
    let under = reach_from_columns(&incidence.transpose(), matching, &free_columns)?;
    let square = Part {
        rows: complement(incidence.rows(), &over.rows, &under.rows),
        columns: complement(incidence.columns(), &over.columns, &under.columns),
    };
    let result = Decomposition { over, square, under };
    debug_assert_eq!(crate::verify::check_decomposition(incidence, &result), Ok(()));
    Ok(result)
}

/// The smallest over-determined set that holds the unmatched equation `row`: one equation more than unknowns, and
/// without any one of its equations the rest can be matched.
///
/// `row` must be unmatched; for a matched row the result is meaningless (but nothing fails).
pub fn minimal_overdetermined(incidence: &Incidence, matching: &Matching, row: Row) -> Result<Part, NotMaximum> {
    reach_from_rows(incidence, matching, &[row])
}

/// The smallest under-determined set that holds the unmatched unknown `column`: one unknown more than equations,
/// and with any one of its unknowns given the others can be matched.
pub fn minimal_underdetermined(transpose: &Transpose, matching: &Matching, column: Column) -> Result<Part, NotMaximum> {
    reach_from_columns(transpose, matching, &[column])
}

/// Members of `all` in neither of the two ascending lists.
fn complement<T: TypedIndex>(all: impl Iterator<Item = T>, first: &[T], second: &[T]) -> Vec<T> {
    let outside = |list: &[T], member: &T| list.binary_search(member).is_err();
    all.filter(|member| outside(first, member) && outside(second, member)).collect()
}

/// Everything on alternating paths: a row, any of its columns, the row matched to that column, and so on.
///
/// A path that ends in an unmatched column enlarges the matching; then it was not maximum.
fn reach_from_rows(incidence: &Incidence, matching: &Matching, roots: &[Row]) -> Result<Part, NotMaximum> {
    let mut seen = IndexVec::filled(false, incidence.column_count());
    let (mut rows, mut columns) = (roots.to_vec(), Vec::new());
    // The root from which each row was reached, parallel to `rows`.
    let mut origin = roots.to_vec();
    let mut head = 0;
    while let Some(&row) = rows.get(head) {
        let root = origin[head];
        head += 1;
        for &column in incidence.row(row) {
            if std::mem::replace(&mut seen[column], true) {
                continue;
            }
            columns.push(column);
            match matching.row_of_column[column] {
                None => return Err(NotMaximum { row: root, column }),
                Some(next) if roots.binary_search(&next).is_ok() => {}
                Some(next) => {
                    rows.push(next);
                    origin.push(root);
                }
            }
        }
    }
    Ok(Part::sorted(rows, columns))
}

/// The same from columns: a column, any row it occurs in, the column matched to that row, and so on.
fn reach_from_columns(transpose: &Transpose, matching: &Matching, roots: &[Column]) -> Result<Part, NotMaximum> {
    let mut seen = IndexVec::filled(false, matching.column_of_row.len());
    let (mut rows, mut columns) = (Vec::new(), roots.to_vec());
    let mut origin = roots.to_vec();
    let mut head = 0;
    while let Some(&column) = columns.get(head) {
        let root = origin[head];
        head += 1;
        for &row in transpose.rows(column) {
            if std::mem::replace(&mut seen[row], true) {
                continue;
            }
            rows.push(row);
            match matching.column_of_row[row] {
                None => return Err(NotMaximum { row, column: root }),
                Some(next) if roots.binary_search(&next).is_ok() => {}
                Some(next) => {
                    columns.push(next);
                    origin.push(root);
                }
            }
        }
    }
    Ok(Part::sorted(rows, columns))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brute_force::{any_incidence, maximum_size, restrict};
    use crate::maximum_matching::maximum_matching;
    use proptest::prelude::*;

    /// The size of a maximum matching without the equation.
    fn size_without_row(incidence: &Incidence, row: Row) -> usize {
        let range = incidence.entry_range(row);
        maximum_size(&restrict(incidence, |entry| !range.contains(&entry.index())))
    }

    /// The size of a maximum matching without the unknown.
    fn size_without_column(incidence: &Incidence, column: Column) -> usize {
        maximum_size(&restrict(incidence, |entry| incidence.column_of(entry) != column))
    }

    proptest! {
        /// Some maximum matching leaves a vertex unmatched exactly if the maximum stays the same without it.
        #[test]
        fn parts_agree_with_the_definition(incidence in any_incidence(6, 6)) {
            let matching = maximum_matching(&incidence, None);
            let parts = decompose(&incidence, &matching).expect("maximum");
            let size = maximum_size(&incidence);
            for row in incidence.rows() {
                let dispensable = size_without_row(&incidence, row) == size;
                prop_assert_eq!(parts.over.rows.contains(&row), dispensable);
                if dispensable {
                    prop_assert!(incidence.row(row).iter().all(|c| parts.over.columns.contains(c)));
                }
            }
            for column in incidence.columns() {
                let dispensable = size_without_column(&incidence, column) == size;
                prop_assert_eq!(parts.under.columns.contains(&column), dispensable);
            }
        }

        /// The set of one unmatched equation is singular, and no longer singular without any one of its equations.
        #[test]
        fn overdetermined_sets_are_minimal(incidence in any_incidence(6, 6)) {
            let matching = maximum_matching(&incidence, None);
            for row in matching.unmatched_rows() {
                let part = minimal_overdetermined(&incidence, &matching, row).expect("maximum");
                prop_assert!(part.rows.contains(&row));
                let rows = |without: Option<Row>| {
                    let members: Vec<Row> = part.rows.iter().copied().filter(|&r| Some(r) != without).collect();
                    restrict(&incidence, |entry| {
                        members.iter().any(|&r| incidence.entry_range(r).contains(&entry.index()))
                    })
                };
                prop_assert_eq!(part.rows.len(), part.columns.len() + 1);
                prop_assert_eq!(maximum_size(&rows(None)), part.columns.len());
                for &member in &part.rows {
                    prop_assert_eq!(maximum_size(&rows(Some(member))), part.rows.len() - 1);
                }
            }
        }

        /// The set of one unmatched unknown, likewise with unknowns and equations exchanged.
        #[test]
        fn underdetermined_sets_are_minimal(incidence in any_incidence(6, 6)) {
            let matching = maximum_matching(&incidence, None);
            let transpose = incidence.transpose();
            for column in matching.unmatched_columns() {
                let part = minimal_underdetermined(&transpose, &matching, column).expect("maximum");
                prop_assert!(part.columns.contains(&column));
                let columns = |without: Option<Column>| restrict(&incidence, |entry| {
                    let own = incidence.column_of(entry);
                    Some(own) != without && part.columns.contains(&own)
                });
                prop_assert_eq!(part.columns.len(), part.rows.len() + 1);
                prop_assert_eq!(maximum_size(&columns(None)), part.rows.len());
                for &member in &part.columns {
                    prop_assert_eq!(maximum_size(&columns(Some(member))), part.columns.len() - 1);
                }
            }
        }
    }

    /// Three equations in two unknowns, one explicit pair, one equation in two unknowns that occur nowhere else.
    #[test]
    fn all_three_parts() {
        let text = "5 rows, 5 columns\neq0: v0 v1\neq1: v0 v1\neq2: v0 v1\neq3: v0 v2\neq4: v2 v3 v4\n";
        let incidence: Incidence = text.parse().expect("text");
        let matching = maximum_matching(&incidence, None);
        let parts = decompose(&incidence, &matching).expect("maximum");
        let expected = "over: eq0 eq1 eq2 | v0 v1\nsquare: eq3 | v2\nunder: eq4 | v3 v4\n";
        assert_eq!(parts.to_string(), expected);
    }

    #[test]
    fn a_matching_that_can_be_extended_is_refused() {
        let incidence: Incidence = "2 rows, 2 columns\neq0: v0 v1\neq1: v0\n".parse().expect("text");
        let mut matching = Matching::empty(&incidence);
        matching.assign(Row(0), Column(0));
        let (row, column) = (Row(1), Column(1));
        assert_eq!(decompose(&incidence, &matching), Err(NotMaximum { row, column }));
        let transpose = incidence.transpose();
        assert_eq!(minimal_underdetermined(&transpose, &matching, column), Err(NotMaximum { row, column }));
    }
}
