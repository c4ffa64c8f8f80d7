//! Unknown units from the rows: propagation first, elimination for what is coupled.
//!
//! Taking logarithms makes each row a linear equation in the exponents of the unknown units, with a known unit as right side.
//! A row with one unknown left gives it (a work list, each row looked at once per unknown it holds); rows that keep
//! several are reduced by sparse Gaussian elimination over the rationals with back substitution.  Rows are kept, so that
//! each can be checked afterwards with the units found.

use crate::form::{Product, UnknownId};
use crate::infer::Row;
use crate::rational::Rational;
use crate::unit::{Dimension, Unit};

/// Longest row that elimination works on.
const LONGEST_ROW: usize = 32;
/// Most substitutions in elimination, against fill-in without end.
const MOST_STEPS: usize = 2_000_000;

/// The units found.
pub(crate) struct Solution {
    /// Unit of each unknown, if it follows.
    pub units: Vec<Option<Product>>,
    /// The row each unit came from.
    pub source: Vec<Option<u32>>,
    /// Rows that contradict others though each alone could hold.
    pub coupled: Vec<u32>,
}

impl Solution {
    /// The product with all units found put in; `None` if a number outgrows its type.
    pub(crate) fn substitute(&self, product: &Product) -> Option<Product> {
        if product.unknowns.iter().all(|(id, _)| self.units[*id as usize].is_none()) {
            return Some(product.clone());
        }
        let mut result = Product { unknowns: Vec::new(), ..product.clone() };
        let plain = product.unknowns.len() == 1
            && product.unknowns[0].1 == Rational::ONE
            && product.dimension.is_none()
            && product.offset == Some(0.0);
        for &(id, exponent) in &product.unknowns {
            let factor = match &self.units[id as usize] {
                Some(found) if plain => {
                    return Some(Product { declared: product.declared || found.declared, ..found.clone() });
                }
                Some(found) => found.clone(),
                None => Product::unknown(id),
            };
            result = result.times(&factor, exponent)?;
        }
        if product.offset.is_none() {
            result.offset = None;
        }
        Some(result)
    }

    /// `left/right` of a row with all units found put in.
    fn ratio(&self, row: &Row) -> Option<Product> {
        let ratio = row.left.times(&row.right, Rational::whole(-1))?;
        self.substitute(&ratio)
    }
}

/// Solves the rows for `count` unknown units.
pub(crate) fn solve(rows: &[Row], count: usize) -> Solution {
    let mut solution = Solution { units: vec![None; count], source: vec![None; count], coupled: Vec::new() };
    let uses = uses(rows, count);
    let mut queue: std::collections::VecDeque<u32> = (0..rows.len() as u32).collect();
    propagate(rows, &uses, &mut queue, &mut solution);
    eliminate(rows, &mut solution);
    solution
}

/// Rows that hold each unknown.
fn uses(rows: &[Row], count: usize) -> Vec<Vec<u32>> {
    let mut uses = vec![Vec::new(); count];
    for (k, row) in rows.iter().enumerate() {
        for (id, _) in row.left.unknowns.iter().chain(&row.right.unknowns) {
            let list: &mut Vec<u32> = &mut uses[*id as usize];
            if list.last() != Some(&(k as u32)) {
                list.push(k as u32);
            }
        }
    }
    uses
}

fn propagate(rows: &[Row], uses: &[Vec<u32>], queue: &mut std::collections::VecDeque<u32>, solution: &mut Solution) {
    while let Some(k) = queue.pop_front() {
        let row = &rows[k as usize];
        if row.left.is_known() && row.right.is_known() {
            continue;
        }
        let Some(ratio) = solution.ratio(row) else { continue };
        let [(id, exponent)] = ratio.unknowns[..] else { continue };
        let Some(unit) = isolate(&ratio, exponent) else { continue };
        let offset = zero_point(row, id, solution);
        solution.units[id as usize] = Some(Product { offset, ..unit });
        solution.source[id as usize] = Some(k);
        queue.extend(&uses[id as usize]);
    }
}

/// The unknown of `known * unknown^exponent = 1`.
fn isolate(ratio: &Product, exponent: Rational) -> Option<Product> {
    let known = Product { unknowns: Vec::new(), ..ratio.clone() };
    Product::rule(&Unit::ONE).times(&known, exponent.recip()?.negative()?)
}

/// The zero point of an unknown that alone makes a side: that of the other side.
fn zero_point(row: &Row, id: UnknownId, solution: &Solution) -> Option<f64> {
    let alone =
        |p: &Product| p.unknowns == [(id, Rational::ONE)] && p.dimension == Dimension::NONE && p.offset == Some(0.0);
    let other = match (alone(&row.left), alone(&row.right)) {
        (true, false) => &row.right,
        (false, true) => &row.left,
        _ => return None,
    };
    solution.substitute(other)?.offset
}

/// A row solved for one of its unknowns.
struct Pivot {
    id: UnknownId,
    value: Product,
    row: u32,
}

fn eliminate(rows: &[Row], solution: &mut Solution) {
    let mut pivots: Vec<Pivot> = Vec::new();
    let mut pivot_of: rustc_hash::FxHashMap<UnknownId, usize> = rustc_hash::FxHashMap::default();
    let mut steps = 0;
    for (k, row) in rows.iter().enumerate() {
        if row.left.is_known() && row.right.is_known() {
            continue;
        }
        let Some(mut ratio) = solution.ratio(row) else { continue };
        let open = !ratio.is_known();
        let mut complete = open;
        while let Some(&(id, exponent)) = ratio.unknowns.iter().find(|(id, _)| pivot_of.contains_key(id)) {
            steps += 1;
            let others = Product { unknowns: ratio.unknowns.iter().copied().filter(|u| u.0 != id).collect(), ..ratio };
            match others.times(&pivots[pivot_of[&id]].value, exponent) {
                Some(next) if next.unknowns.len() <= LONGEST_ROW && steps < MOST_STEPS => ratio = next,
                _ => {
                    complete = false;
                    ratio = Product::rule(&Unit::ONE);
                }
            }
        }
        match ratio.unknowns.first().copied() {
            Some((id, exponent)) if complete => {
                let Some(inverse) = exponent.recip().and_then(Rational::negative) else { continue };
                let rest = Product { unknowns: ratio.unknowns[1..].to_vec(), ..ratio };
                let Some(value) = Product::rule(&Unit::ONE).times(&rest, inverse) else { continue };
                pivot_of.insert(id, pivots.len());
                pivots.push(Pivot { id, value, row: k as u32 });
            }
            None if complete && ratio.declared && ratio.dimension != Dimension::NONE => solution.coupled.push(k as u32),
            _ => {}
        }
    }
    // Later pivots do not occur in the rows of earlier ones reduced by them, so going backwards settles all.
    for pivot in pivots.iter().rev() {
        if let Some(value) = solution.substitute(&pivot.value)
            && value.is_known()
        {
            solution.units[pivot.id as usize] = Some(Product { offset: None, ..value });
            solution.source[pivot.id as usize] = Some(pivot.row);
        }
    }
}
