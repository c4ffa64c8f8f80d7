//! Candidates for states become equations: which of them are states is data, not structure.
//!
//! For each set of candidates `x_k` with derivatives `z_k`, all unknowns of the solver, there are as many equations
//! `sum_k c_rk (der(x_k) - z_k) = 0` as there are states; the choices `c_rk` are 0 or 1 and change during the run.  The
//! coefficients of the constraints become values that are computed to judge the choice (Mattsson, Olsson, Elmqvist 2000,
//! *Dynamic selection of states in Dymola*).  When to choose anew is decided where these values are known.

use hyd_flat::{EquationBlock, Operand, Section, StateSelect, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_source::{Diagnostic, Origin};
use hyd_structure::independent;
use hyd_symbolic::{SlotId, Template, TemplateId, canonical};

use crate::algebra::Algebra;
use crate::index_reduction::higher::Derivatives;
use crate::index_reduction::structure::{OpenSet, Slope};
use crate::start_point::StartPoint;
use crate::system::{Candidate, Equation, EquationSystem, Resolution, Role, Selection};

/// Appends the equations of the sets and notes the sets themselves.
pub(crate) fn append_selections(system: &mut EquationSystem, sets: &[OpenSet], derivatives: &Derivatives) {
    for set in sets {
        for &(_, _, slope) in &set.entries {
            append_pivot(system, slope, derivatives);
        }
        let first = system.reduction.selections.iter().map(Selection::choices).sum::<usize>() as u32;
        let candidates: Vec<Candidate> = set
            .candidates
            .iter()
            .map(|&(column, v, order)| Candidate {
                column,
                variable: derivatives.variable(v, order),
                weight: weight(system, v),
            })
            .collect();
        let selection = Selection {
            size: set.size,
            entries: set.entries.iter().map(|entry| (entry.0, entry.1)).collect(),
            pivots: set.pivots.clone(),
            open: set.open.clone(),
            candidates,
            first,
        };
        append_equations(system, &selection, set, derivatives);
        system.reduction.selections.push(selection);
    }
}

/// True if every candidate still stands for itself or for another candidate, each for a different one.
pub(crate) fn candidates_are_distinct(system: &EquationSystem) -> bool {
    let mut seen = rustc_hash::FxHashSet::default();
    let candidates = system.reduction.selections.iter().flat_map(|selection| &selection.candidates);
    candidates.into_iter().all(|candidate| {
        let kept = match system.resolution[candidate.variable] {
            Resolution::Own => candidate.variable,
            Resolution::Alias { of, .. } => of,
            Resolution::Value(_) => return false,
        };
        system.roles[kept] == Role::Candidate && seen.insert(kept)
    })
}

/// The candidates that the values at the start make dependent, as far as they are known; none where they say nothing.
pub(crate) fn dependent_at_start(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
) -> Result<IndexVec<VarId, bool>, Diagnostic> {
    let mut dependent = IndexVec::filled(false, system.roles.len());
    if system.reduction.selections.is_empty() {
        return Ok(dependent);
    }
    let point = StartPoint::new(system, algebra)?;
    let mut values = system.equations_in(Section::Pivot).into_iter().map(|eq| {
        let equation = system.equations[eq];
        point.evaluate(system, system.flat.templates.get(equation.template).left, equation.operands)
    });
    for selection in &system.reduction.selections {
        let mut columns = vec![Vec::new(); selection.size.1 as usize];
        for (&(row, column), value) in selection.entries.iter().zip(&mut values) {
            columns[column as usize].push((row, if value.is_finite() { value } else { 0.0 }));
        }
        // Later candidates are rather dependent than earlier ones, unwilling ones rather than others.
        let mut order: Vec<&Candidate> = selection.candidates.iter().rev().collect();
        order.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        let ordered = selection.pivots.iter().map(|pivot| pivot.1).chain(order.iter().map(|c| c.column));
        let ordered = ordered.map(|column| columns[column as usize].clone()).collect();
        for k in independent(selection.size.0 as usize, ordered) {
            if let Some(candidate) = k.checked_sub(selection.pivots.len()).and_then(|k| order.get(k)) {
                let kept = match system.resolution[candidate.variable] {
                    Resolution::Alias { of, .. } => of,
                    _ => candidate.variable,
                };
                dependent[kept] = true;
            }
        }
    }
    Ok(dependent)
}

/// How unwilling a variable is to be a state, in the size of its column.
fn weight(system: &EquationSystem, v: VarId) -> f64 {
    let (block, k) = system.flat.locate(v);
    let block = &system.flat.variables[block];
    let nominal = block.nominal.get(k).map(f64::abs).filter(|nominal| nominal.is_finite() && *nominal > 0.0);
    let wish = match block.state_select.get(k) {
        StateSelect::Always => 0.01,
        StateSelect::Prefer => 0.2,
        StateSelect::Default => 1.0,
        StateSelect::Avoid => 5.0,
        StateSelect::Never => 100.0,
    };
    nominal.unwrap_or(1.0) * wish
}

/// An equation whose left side is the slope.
fn append_pivot(system: &mut EquationSystem, slope: Slope, derivatives: &Derivatives) {
    let equation = system.equations[slope.equation];
    let arena = &mut system.flat.templates.arena;
    let zero = arena.constant(0.0);
    let (template, slots) = canonical(arena, slope.value, zero);
    let template = system.flat.templates.intern(template);
    let read = |slot: &SlotId| {
        let operand = system.operands_of(equation.operands)[slot.index()];
        match operand.target() {
            Target::Der(v) => Operand::new(derivatives.target(v, 1)).signed(operand.negated()),
            _ => operand,
        }
    };
    let operands: Vec<Operand> = slots.iter().map(read).collect();
    let origin = system.flat.equations[equation.block as usize].origin.clone();
    append(system, Section::Pivot, template, vec![operands], origin);
}

/// The equations that make some candidates states.
fn append_equations(system: &mut EquationSystem, selection: &Selection, set: &OpenSet, derivatives: &Derivatives) {
    let count = selection.candidates.len();
    let arena = &mut system.flat.templates.arena;
    let mut left = arena.constant(0.0);
    for k in 0..count {
        let [choice, rate, value] = [0, 1, 2].map(|part| arena.slot(SlotId::new(3 * k + part)));
        let difference = arena.sub(rate, value);
        let term = arena.mul(choice, difference);
        left = arena.add(left, term);
    }
    let right = arena.constant(0.0);
    let template = system.flat.templates.intern(Template { left, right, arity: 3 * count as u32 });
    let row = |row: usize| -> Vec<Operand> {
        let terms = set.candidates.iter().zip(0..).flat_map(|(&(_, v, order), k)| {
            let choice = selection.first + (row * count) as u32 + k;
            let state = derivatives.variable(v, order);
            [Target::Chosen(choice), Target::Der(state), Target::Var(derivatives.variable(v, order + 1))]
        });
        terms.map(Operand::new).collect()
    };
    let rows = (0..selection.states()).map(row).collect();
    let first = selection.candidates[0].variable;
    let origin = system.flat.variables[system.flat.locate(first).0].origin.clone();
    append(system, Section::Selection, template, rows, origin);
}

fn append(
    system: &mut EquationSystem,
    section: Section,
    template: TemplateId,
    rows: Vec<Vec<Operand>>,
    origin: Origin,
) {
    let block = system.flat.equations.len() as u32;
    for (element, operands) in (0..).zip(&rows) {
        let operands = crate::relations::append(system, operands);
        system.equations.push(Equation { template, operands, block, element, order: 0 });
    }
    let count = rows.len() as u32;
    system.flat.equations.push(EquationBlock {
        section,
        made: false,
        template,
        count,
        operands: rows.concat(),
        origin,
    });
}
