//! The Jacobian of a large plan: local partial derivatives in loops, composed by a list of multiply-adds.
//!
//! Code computes the partial derivatives of each row by its own slots into a scratch array.  The chain rule through the
//! assignments is then a fixed list `s[to] += s[a]*s[b]` in the order of the rows (forward accumulation on the extended
//! Jacobian, Griewank and Walther 2008, "Evaluating Derivatives", chapter 9).  Code does not grow with the number of
//! rows; the list does, at some twelve bytes per term.
//!
//! Scratch array: the number 1, the partials, the rows of assignments on their supports, entries of dF/dy, of dF/dy'.
//! A partial that is an entry by itself, such as nearly all of equations without assignments, is computed where the
//! entry stands and needs no term.

use hyd_equations::{PlanJacobian, SortedSystem};
use hyd_payload::accumulation::{Accumulation, MINUS, PartialRows, Term};
use hyd_symbolic::Arena;
use hyd_system::Pattern;

use super::batch::{Batch, Item};
use super::rows::{Column, Rows};
use crate::layout::{Place, PlanPlaces};
use crate::program::Area;

/// Plans the composition: items that compute the partials (into `Area::Out`) go into the batch; the list.
pub(crate) fn plan(
    sorted: &SortedSystem,
    places: &PlanPlaces,
    rows: &Rows<'_>,
    jacobian: &PlanJacobian,
    patterns: (&Pattern, &Pattern),
    (arena, batch): (&Arena, &mut Batch<'_>),
) -> Result<(Accumulation, PartialRows), String> {
    let (positions, first) = positions(rows, jacobian);
    let targets = Targets::new(first, rows, jacobian, patterns)?;
    let mut terms = terms((sorted, places, rows, jacobian), &positions, &targets)?;
    // How many products are added at each place.
    let mut shares = vec![0u8; targets.length];
    for term in &terms {
        shares[term.to as usize] = shares[term.to as usize].saturating_add(1);
    }
    let is_alone = |term: &Term| term.b == 0 && term.a & MINUS == 0 && shares[term.to as usize] == 1;
    let alone: Vec<(u32, u32)> = terms.iter().filter(|term| is_alone(term)).map(|term| (term.a, term.to)).collect();
    terms.retain(|term| !is_alone(term));
    let owners = add_partials((sorted, rows, jacobian), &positions, &alone, targets.length, (arena, batch))?;
    let Targets { state, rate, length, .. } = targets;
    Ok((Accumulation { terms, first, state, rate, length }, owners))
}

/// All products of the chain rule, row by row.
fn terms(
    (sorted, places, rows, jacobian): (&SortedSystem, &PlanPlaces, &Rows<'_>, &PlanJacobian),
    positions: &Positions,
    targets: &Targets<'_>,
) -> Result<Vec<Term>, String> {
    let mut terms = Vec::new();
    for row in 0..rows.count() {
        let (_, operands) = rows.expression(sorted, row);
        for (j, &(slot, _)) in jacobian.partials(row).iter().enumerate() {
            let (column, negated) = rows.column(sorted, places, operands[slot.0 as usize]);
            let a = positions.of(row, j) | if negated { MINUS } else { 0 };
            match column {
                Column::Direct(c) => terms.push(Term { to: targets.of(row, c)?, a, b: 0 }),
                Column::Assigned(m) => {
                    for (k, &c) in jacobian.support.row(m as usize).iter().enumerate() {
                        let b = (targets.starts[m as usize] + k) as u32;
                        terms.push(Term { to: targets.of(row, c)?, a, b });
                    }
                }
                Column::None => {}
            }
        }
    }
    Ok(terms)
}

/// Where sums stand in the scratch array.
struct Targets<'a> {
    jacobian: &'a PlanJacobian,
    /// Patterns of dF/dy and dF/dy'.
    patterns: (&'a Pattern, &'a Pattern),
    unknowns: usize,
    /// Begin of the row of each assignment.
    starts: Vec<usize>,
    /// Begin of the entries of dF/dy and of dF/dy'.
    state: usize,
    rate: usize,
    length: usize,
}

impl<'a> Targets<'a> {
    /// Behind `first` numbers: the number 1 and the partials.
    fn new(
        first: usize,
        rows: &Rows<'_>,
        jacobian: &'a PlanJacobian,
        patterns: (&'a Pattern, &'a Pattern),
    ) -> Result<Self, String> {
        let assignments = rows.plan.assignments.len();
        let mut starts = Vec::with_capacity(assignments);
        let mut state = first;
        for row in 0..assignments {
            starts.push(state);
            state += jacobian.support.row(row).len();
        }
        let rate = state + patterns.0.entries();
        let length = rate + patterns.1.entries();
        if length >= MINUS as usize {
            return Err("the Jacobian is too large".into());
        }
        Ok(Self { jacobian, patterns, unknowns: rows.plan.unknowns.len(), starts, state, rate, length })
    }

    /// The place of the derivative of a row by an unknown, or by the rate of one behind them.
    fn of(&self, row: usize, column: u32) -> Result<u32, String> {
        let missing = || "a Jacobian entry lies outside its pattern".to_string();
        if let Some(start) = self.starts.get(row) {
            let k = self.jacobian.support.row(row).binary_search(&column).map_err(|_| missing())?;
            return Ok((start + k) as u32);
        }
        let residual = (row - self.starts.len()) as u32;
        let (base, pattern, column) = if (column as usize) < self.unknowns {
            (self.state, self.patterns.0, column as usize)
        } else {
            (self.rate, self.patterns.1, column as usize - self.unknowns)
        };
        let range = pattern.column(column);
        let k = pattern.row_indices[range.clone()].binary_search(&residual).map_err(|_| missing())?;
        Ok((base + range.start + k) as u32)
    }
}

/// Scratch positions of the partials: form by form, within a form derivative by derivative, so that loops ascend evenly.
struct Positions {
    /// Per row: position of its first partial and the distance to the next one.
    of_row: Vec<(u32, u32)>,
}

impl Positions {
    fn of(&self, row: usize, j: usize) -> u32 {
        let (first, step) = self.of_row[row];
        first + step * j as u32
    }
}

/// The positions, and the first one behind them.
fn positions(rows: &Rows<'_>, jacobian: &PlanJacobian) -> (Positions, usize) {
    let forms = jacobian.forms.len();
    let mut members = vec![0u32; forms];
    for &form in &jacobian.form_of_row {
        members[form as usize] += 1;
    }
    let mut base = Vec::with_capacity(forms);
    let mut end = 1u32;
    for (form, &count) in members.iter().enumerate() {
        base.push(end);
        end += count * jacobian.forms.row(form).len() as u32;
    }
    let mut seen = vec![0u32; forms];
    let of_row = (0..rows.count()).map(|row| {
        let form = jacobian.form_of_row[row] as usize;
        seen[form] += 1;
        (base[form] + seen[form] - 1, members[form])
    });
    (Positions { of_row: of_row.collect() }, end as usize)
}

/// Items that compute the partials, those `alone` (position and entry) at their entries; the row of each place.
fn add_partials(
    (sorted, rows, jacobian): (&SortedSystem, &Rows<'_>, &PlanJacobian),
    positions: &Positions,
    alone: &[(u32, u32)],
    length: usize,
    (arena, batch): (&Arena, &mut Batch<'_>),
) -> Result<PartialRows, String> {
    let mut places: Vec<u32> = (0..length as u32).collect();
    for &(position, entry) in alone {
        places[position as usize] = entry;
    }
    let mut owners = PartialRows { rows: vec![0; length] };
    let (mut to, mut values) = (Vec::new(), Vec::new());
    for row in 0..rows.count() {
        let partials = jacobian.partials(row);
        if partials.is_empty() {
            continue;
        }
        let place = |j: usize| Place { area: Area::Out, index: places[positions.of(row, j) as usize] };
        to.clear();
        to.extend((0..partials.len()).map(place));
        to.iter().for_each(|place| owners.rows[place.index as usize] = row as u32);
        values.clear();
        values.extend(partials.iter().map(|&(_, node)| node));
        let (_, operands) = rows.expression(sorted, row);
        batch.add(arena, Item { level: 0, values: &values, operands, extra: &[], to: &to })?;
    }
    Ok(owners)
}
