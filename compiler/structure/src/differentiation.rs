//! The plan of differentiations: a pattern with its differentiated equations and unknowns, made by [`crate::pantelides`].

use crate::graph::{Column, Incidence, Row};
use crate::matching::Matching;
use hyd_index::{IndexVec, TypedIndex};

/// The pattern with all differentiated equations and unknowns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DifferentiationPlan {
    /// The given rows and columns, then the differentiated ones; a differentiated row lists only the derivatives in it.
    pub incidence: Incidence,
    /// The derivative of each equation, if it is differentiated.
    pub row_derivative: IndexVec<Row, Option<Row>>,
    /// The derivative of each unknown, if there is one.
    pub column_derivative: IndexVec<Column, Option<Column>>,
    /// Matches every equation that is not differentiated further to an unknown that is not.
    pub matching: Matching,
}

impl DifferentiationPlan {
    /// How often each of the first `count` rows is differentiated.
    pub fn row_orders(&self, count: usize) -> IndexVec<Row, u32> {
        IndexVec::from_vec((0..count).map(|row| chain_length(&self.row_derivative, Row::new(row))).collect())
    }

    /// The highest derivative of a column, counted from that column.
    pub fn order_above(&self, column: Column) -> u32 {
        chain_length(&self.column_derivative, column)
    }
}

fn chain_length<I: TypedIndex>(next: &IndexVec<I, Option<I>>, start: I) -> u32 {
    let mut length = 0;
    let mut at = start;
    while let Some(derivative) = next[at] {
        at = derivative;
        length += 1;
    }
    length
}
