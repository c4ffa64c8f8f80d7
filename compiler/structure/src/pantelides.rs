//! Which equations must be differentiated how often, so that all highest derivatives are determined.
//!
//! Pantelides 1988, *The consistent initialization of differential-algebraic systems*, SIAM J. Sci. Stat. Comput. 9(2):
//! an equation that cannot be matched to a highest derivative blocks a smallest set of equations; these are
//! differentiated, the unknowns in them get derivatives, and the search goes on with the new equation.  The first rows
//! are matched all at once (a blocked set is minimal whatever the matching), so that only equations that cannot be
//! matched cost a search.  The numbers of differentiations agree with the canonical offsets of Pryce 2001, *A simple
//! structural analysis method for DAEs*, BIT 41(2).  Nothing is differentiated here: rows and columns are only numbered.

use crate::augment::{Augmentation, Augmenter};
use crate::decomposition::minimal_overdetermined;
use crate::differentiation::DifferentiationPlan;
use crate::graph::{Column, Incidence, Row};
use crate::matching::Matching;
use crate::maximum_matching::maximum_matching;
use crate::parts::Part;
use hyd_index::{IndexVec, TypedIndex};

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NotReducible {
    /// Even with an unknown and its derivatives counted as one there are more equations than unknowns here, so
    /// differentiating would never end.
    Singular(Part),
    /// The table of derivatives names a column twice or one that does not exist, or the pattern grows too large.
    Malformed,
}

/// Differentiates until every equation is matched.
///
/// `derivative` says for each column which column is its time derivative.
///
/// # Errors
/// [`NotReducible`], if the system is structurally singular or the table is not a set of chains.
pub fn pantelides(
    incidence: &Incidence,
    derivative: &IndexVec<Column, Option<Column>>,
) -> Result<DifferentiationPlan, NotReducible> {
    let first = first_columns(incidence, derivative).ok_or(NotReducible::Malformed)?;
    check_regular(incidence, &first)?;
    let mut search = Search {
        plan: DifferentiationPlan {
            incidence: incidence.clone(),
            row_derivative: IndexVec::filled(None, incidence.row_count()),
            column_derivative: derivative.clone(),
            matching: match_highest(incidence, derivative),
        },
        augmenter: Augmenter::new(),
    };
    let open: Vec<Row> = search.plan.matching.unmatched_rows().collect();
    for row in open {
        search.settle(row)?;
    }
    Ok(search.plan)
}

/// The undifferentiated column of each column; none if the table is not a set of chains.
fn first_columns(
    incidence: &Incidence,
    derivative: &IndexVec<Column, Option<Column>>,
) -> Option<IndexVec<Column, Column>> {
    let count = incidence.column_count();
    if derivative.len() != count {
        return None;
    }
    let mut is_derivative = IndexVec::filled(false, count);
    for &column in derivative.iter().flatten() {
        if column.index() >= count || std::mem::replace(&mut is_derivative[column], true) {
            return None;
        }
    }
    let mut first = IndexVec::filled(None, count);
    for start in incidence.columns().filter(|&column| !is_derivative[column]) {
        let mut at = Some(start);
        while let Some(column) = at {
            first[column] = Some(start);
            at = derivative[column];
        }
    }
    first.raw.into_iter().collect::<Option<Vec<_>>>().map(IndexVec::from_vec)
}

/// The condition under which the algorithm ends (Pantelides 1988, section 4).
fn check_regular(incidence: &Incidence, first: &IndexVec<Column, Column>) -> Result<(), NotReducible> {
    let mut merged = Incidence::new(incidence.column_count());
    for row in incidence.rows() {
        let mut columns: Vec<Column> = incidence.row(row).iter().map(|&column| first[column]).collect();
        columns.sort_unstable();
        columns.dedup();
        merged.push_row(columns).map_err(|_| NotReducible::Malformed)?;
    }
    let matching = maximum_matching(&merged, None);
    match matching.unmatched_rows().next() {
        None => Ok(()),
        Some(row) => match minimal_overdetermined(&merged, &matching, row) {
            Ok(part) => Err(NotReducible::Singular(part)),
            Err(_) => Err(NotReducible::Malformed),
        },
    }
}

/// A maximum matching to unknowns that have no derivative.
fn match_highest(incidence: &Incidence, derivative: &IndexVec<Column, Option<Column>>) -> Matching {
    let mut highest = Incidence::new(incidence.column_count());
    for row in incidence.rows() {
        let columns = incidence.row(row).iter().copied().filter(|&column| derivative[column].is_none());
        highest.push_row(columns).expect("invariant: a part of a row that ascends");
    }
    maximum_matching(&highest, None)
}

struct Search {
    plan: DifferentiationPlan,
    augmenter: Augmenter,
}

impl Search {
    /// Differentiates what blocks a row, until the last derivative of the row is matched.
    fn settle(&mut self, row: Row) -> Result<(), NotReducible> {
        let mut row = row;
        loop {
            let plan = &mut self.plan;
            let highest = |column: Column| plan.column_derivative[column].is_none();
            match self.augmenter.augment(&plan.incidence, &mut plan.matching, row, highest) {
                Augmentation::Matched => return Ok(()),
                Augmentation::Blocked(part) => row = self.differentiate(&part, row)?,
            }
        }
    }

    /// Differentiates a blocked set; the derivative of the blocking row.
    fn differentiate(&mut self, part: &Part, blocking: Row) -> Result<Row, NotReducible> {
        let plan = &mut self.plan;
        plan.incidence.add_columns(part.columns.len()).map_err(|_| NotReducible::Malformed)?;
        for &column in &part.columns {
            let derivative = plan.column_derivative.push(None);
            plan.column_derivative[column] = Some(derivative);
        }
        for &row in &part.rows {
            let derivatives = plan.incidence.row(row).iter().filter_map(|&column| plan.column_derivative[column]);
            let mut columns: Vec<Column> = derivatives.collect();
            columns.sort_unstable();
            let derivative = plan.incidence.push_row(columns).map_err(|_| NotReducible::Malformed)?;
            plan.row_derivative.push(None);
            plan.row_derivative[row] = Some(derivative);
        }
        plan.matching.grow(&plan.incidence);
        for &column in &part.columns {
            let pair = plan.matching.row_of_column[column].and_then(|row| plan.row_derivative[row]);
            if let (Some(row), Some(derivative)) = (pair, plan.column_derivative[column]) {
                plan.matching.assign(row, derivative);
            }
        }
        Ok(plan.row_derivative[blocking].expect("invariant: the blocking row is in its blocked set"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signature::{Signature, any_signature};
    use crate::verify::check_differentiation;
    use proptest::prelude::*;

    /// The pendulum in Cartesian coordinates as second-order equations: x, y, x', y', x'', y'', F.
    #[test]
    fn the_pendulum_length_is_differentiated_twice() {
        let text = "3 rows, 7 columns\neq0: v0 v4 v6\neq1: v1 v5 v6\neq2: v0 v1\n";
        let incidence: Incidence = text.parse().expect("text");
        let next = |k: u32| if k < 4 { Some(Column(k + 2)) } else { None };
        let derivative = IndexVec::from_vec((0..7).map(next).collect());
        let plan = pantelides(&incidence, &derivative).expect("regular");
        assert_eq!(plan.row_orders(3).raw, [0, 0, 2]);
        assert_eq!(plan.order_above(Column(0)), 2);
        assert_eq!(check_differentiation(&incidence, &derivative, &plan), Ok(()));
    }

    #[test]
    fn singular_systems_and_broken_tables_are_refused() {
        let incidence: Incidence = "2 rows, 2 columns\neq0: v0\neq1: v1\n".parse().expect("text");
        let chain = IndexVec::from_vec(vec![Some(Column(1)), None]);
        let part = Part::sorted(vec![Row(0), Row(1)], vec![Column(0)]);
        assert_eq!(pantelides(&incidence, &chain), Err(NotReducible::Singular(part)));
        let cycle = IndexVec::from_vec(vec![Some(Column(1)), Some(Column(0))]);
        assert_eq!(pantelides(&incidence, &cycle), Err(NotReducible::Malformed));
    }

    proptest! {
        /// The numbers of differentiations are the smallest offsets of the signature matrix, found by trying every
        /// assignment; singular systems are recognised.
        #[test]
        fn agrees_with_the_signature_method(signature in any_signature(5, 2)) {
            let (incidence, derivative, first) = signature.first_order();
            match (pantelides(&incidence, &derivative), signature.offsets()) {
                (Err(NotReducible::Singular(part)), None) => {
                    prop_assert!(part.rows.len() > part.columns.len());
                }
                (Ok(plan), Some((rows, columns))) => {
                    prop_assert_eq!(plan.row_orders(signature.size()).raw, rows);
                    let orders: Vec<u32> = first.iter().map(|&column| plan.order_above(column)).collect();
                    prop_assert_eq!(orders, columns);
                    prop_assert_eq!(check_differentiation(&incidence, &derivative, &plan), Ok(()));
                }
                (plan, offsets) => prop_assert!(false, "{plan:?} against {offsets:?} of {:?}", Signature::clone(&signature)),
            }
        }
    }
}
