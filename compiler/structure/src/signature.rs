//! Signature matrices of small systems and their offsets by exhaustive search, for the property tests.
//!
//! Pryce 2001, *A simple structural analysis method for DAEs*, BIT 41(2): entry (i, j) is the highest order of unknown j
//! in equation i; a transversal of largest sum gives the smallest offsets by a fixed-point iteration (section 3).  The
//! transversal is found by trying every permutation, so nothing is shared with the algorithms under test.

use crate::graph::{Column, Incidence};
use hyd_index::{IndexVec, TypedIndex};
use proptest::collection::vec;
use proptest::prelude::*;

/// `orders[i][j]`: highest order of unknown `j` in equation `i`.
#[derive(Clone, Debug)]
pub(crate) struct Signature {
    orders: Vec<Vec<Option<u32>>>,
}

/// Matrices of up to `size` equations with orders up to `highest`, of any density.
pub(crate) fn any_signature(size: usize, highest: u32) -> impl Strategy<Value = Signature> {
    (1..=size, 0.2_f64..0.9).prop_flat_map(move |(n, density)| {
        let order = proptest::option::weighted(density, 0..=highest);
        vec(vec(order, n), n).prop_map(|orders| Signature { orders })
    })
}

impl Signature {
    pub(crate) fn size(&self) -> usize {
        self.orders.len()
    }

    /// The order of unknown `column` in equation `row`.
    pub(crate) fn order(&self, row: usize, column: usize) -> Option<u32> {
        self.orders[row][column]
    }

    /// The system with a column for every order that is needed, its table of derivatives, and the column of each unknown.
    pub(crate) fn first_order(&self) -> (Incidence, IndexVec<Column, Option<Column>>, Vec<Column>) {
        let highest = |j: usize| self.orders.iter().filter_map(|row| row[j]).max().unwrap_or(0);
        let mut first = Vec::new();
        let mut derivative = IndexVec::new();
        for j in 0..self.size() {
            first.push(Column::new(derivative.len()));
            for _ in 0..highest(j) {
                derivative.push(Some(Column::new(derivative.len() + 1)));
            }
            derivative.push(None);
        }
        let rows = self.orders.iter().map(|row| {
            let columns = row.iter().zip(&first);
            columns.filter_map(|(order, first)| order.map(|order| Column(first.0 + order))).collect::<Vec<_>>()
        });
        let incidence = Incidence::from_rows(derivative.len(), rows).expect("ascending by construction");
        (incidence, derivative, first)
    }

    /// The smallest offsets of equations and unknowns; none if there is no transversal.
    pub(crate) fn offsets(&self) -> Option<(Vec<u32>, Vec<u32>)> {
        let best = self.best_transversal()?;
        let n = self.size();
        let mut rows = vec![0; n];
        loop {
            let column = |j: usize| (0..n).filter_map(|i| self.orders[i][j].map(|o| o + rows[i])).max().unwrap_or(0);
            let columns: Vec<u32> = (0..n).map(column).collect();
            let next = |i: usize| columns[best[i]] - self.orders[i][best[i]].unwrap_or(0);
            let new: Vec<u32> = (0..n).map(next).collect();
            if new == rows {
                return Some((rows, columns));
            }
            rows = new;
        }
    }

    fn best_transversal(&self) -> Option<Vec<usize>> {
        fn extend(
            orders: &[Vec<Option<u32>>],
            chosen: &mut Vec<usize>,
            sum: u32,
            best: &mut Option<(u32, Vec<usize>)>,
        ) {
            let i = chosen.len();
            if i == orders.len() {
                if best.as_ref().is_none_or(|(before, _)| sum > *before) {
                    *best = Some((sum, chosen.clone()));
                }
                return;
            }
            for j in 0..orders.len() {
                if let (Some(order), false) = (orders[i][j], chosen.contains(&j)) {
                    chosen.push(j);
                    extend(orders, chosen, sum + order, best);
                    chosen.pop();
                }
            }
        }
        let mut best = None;
        extend(&self.orders, &mut Vec::new(), 0, &mut best);
        best.map(|(_, chosen)| chosen)
    }
}
