//! Constraints that structure does not see, because unknowns cancel out of a sum of equations.
//!
//! `a = u1 - s` and `b = u2 - s` seem to determine `u1` and `s`, until `a` is `b`: then their difference says something of other
//! variables, and neither of the two equations what it seemed to.  Where the slopes are numbers before the run, the sum in which
//! the unknowns cancel takes the place of one of the equations (the method of linear combinations of Tan, Nedialkov and Pryce 2017,
//! "Conversion methods for improving structural analysis of differential-algebraic equation systems"), which changes no solution,
//! and everything is analysed again.  Parameters that slopes depend on are fixed with that.

use hyd_flat::{Operand, Target, VarId};
use hyd_index::TypedIndex;
use hyd_symbolic::{Node, NodeId, SlotId, Template, partial, post_order, simplify, slots, substitute};
use rustc_hash::FxHashMap;

use crate::algebra::{Algebra, Known, is_clocked};
use crate::alias::eliminate_aliases;
use crate::alias::representative::block_of_variable;
use crate::decided::fix_what_is_behind;
use crate::plan::bindings::sort_bindings;
use crate::relations::append;
use crate::start_point::StartPoint;
use crate::system::{Combination, EqId, EquationSystem, OperandRange};

/// Coefficients whose sum is an integer but for this part of the largest of them are meant to give it; where it is 0 they cancel.
const ZERO: f64 = 1e-12;
/// Most sums; each takes an analysis of the whole system.
const MOST: usize = 40;

/// Tries with more and more sums until the equations are regular; what the first attempt gave if they never are.
///
/// An attempt that fails says which equations are to be added up next, if that may help.
pub fn until_regular<T>(mut attempt: impl FnMut(&[Combination]) -> Result<T, Box<(T, Option<Combination>)>>) -> T {
    let mut combinations = Vec::new();
    let (first, mut next) = match attempt(&combinations) {
        Ok(value) => return value,
        Err(failed) => *failed,
    };
    while let Some(combination) = next.filter(|next| combinations.len() < MOST && !combinations.contains(next)) {
        combinations.push(combination);
        match attempt(&combinations) {
            Ok(value) => return value,
            Err(failed) => next = failed.1,
        }
    }
    first
}

/// Puts sums in the place of equations, each after the ones before; false if there is nothing to replace.
pub(crate) fn combine(system: &mut EquationSystem, combinations: &[Combination]) -> bool {
    for combination in combinations {
        if !combine_one(system, combination) {
            return false;
        }
        *system = eliminate_aliases(std::mem::take(system));
        system.reduction.combined.push(combination.clone());
    }
    true
}

fn combine_one(system: &mut EquationSystem, combination: &Combination) -> bool {
    let places: FxHashMap<(u32, u32), f64> = combination.terms.iter().map(|term| (term.place, term.factor)).collect();
    let mut found: Vec<(EqId, f64)> = Vec::new();
    for (eq, equation) in system.equations.iter_enumerated() {
        if equation.order == 0
            && let Some(&factor) = places.get(&(equation.block, equation.element))
        {
            found.push((eq, factor));
        }
    }
    let first = combination.terms[0].place;
    let replaced = found.iter().map(|&(eq, _)| eq);
    let replaced = replaced.into_iter().find(|&eq| (system.equations[eq].block, system.equations[eq].element) == first);
    let Some(replaced) = replaced.filter(|_| found.len() == places.len()) else { return false };
    if found.iter().any(|&(eq, _)| has_given_derivative(system, eq)) {
        return false;
    }
    let Ok(bindings) = sort_bindings(system, &mut Algebra::default()) else { return false };
    let values = StartPoint::of_parameters(system, &bindings.assignments);
    let slopes = slopes(system, (&bindings.known, &values), &found);
    let gathered = gathered(&slopes);
    if !gathered.iter().any(|(_, coefficient)| *coefficient == 0.0) {
        return false;
    }
    let is_gathered = |slope: &Slope| gathered.iter().any(|(target, _)| *target == slope.target);
    let read: Vec<VarId> = slopes.into_iter().filter(is_gathered).flat_map(|slope| slope.reads).collect();
    let (template, operands) = sum(system, &found, &gathered);
    let template = system.flat.templates.intern(template);
    let operands = append(system, &operands);
    system.equations[replaced].template = template;
    system.equations[replaced].operands = operands;
    let blocks = block_of_variable(&system.flat);
    fix_what_is_behind(system, &bindings.assignments, &read, &blocks);
    true
}

/// True if a derivative that its author gave of a function counts: it may read what the function itself does not depend on.
fn has_given_derivative(system: &EquationSystem, eq: EqId) -> bool {
    let template = system.flat.templates.get(system.equations[eq].template);
    let arena = &system.flat.templates.arena;
    post_order(arena, &[template.left, template.right])
        .into_iter()
        .any(|id| matches!(arena.node(id), Node::Apply(body, _, _) if !arena.body(body).derivatives.is_empty()))
}

/// What an equation of the sum multiplies an unknown with, the factor of the equation included.
struct Slope {
    target: Target,
    /// None if it changes during the run.
    value: Option<f64>,
    reads: Vec<VarId>,
}

fn slopes(system: &mut EquationSystem, (known, values): (&Known, &StartPoint), terms: &[(EqId, f64)]) -> Vec<Slope> {
    let mut algebra = Algebra::default();
    let mut found = Vec::new();
    for &(eq, factor) in terms {
        let equation = system.equations[eq];
        let facts = algebra.facts(&mut system.flat.templates, equation.template).clone();
        for &slot in &facts.slots {
            let operand = system.operands_of(equation.operands)[slot.index()];
            if known.is_known(operand) || !matches!(operand.target(), Target::Var(_) | Target::Der(_)) {
                continue;
            }
            let slope = partial(&mut system.flat.templates.arena, facts.residual, slot);
            let templates = &system.flat.templates;
            let operands = system.operands_of(equation.operands);
            let read: Vec<Operand> =
                slots(&templates.arena, &[slope]).into_iter().map(|slot| operands[slot.index()]).collect();
            let fixed = !is_clocked(templates, slope) && read.iter().all(|&operand| known.is_known(operand));
            let sign = if operand.negated() { -factor } else { factor };
            let value = fixed.then(|| sign * values.evaluate(system, slope, equation.operands));
            let variable = |operand: Operand| match operand.target() {
                Target::Var(v) => Some(v),
                _ => None,
            };
            let reads = read.into_iter().filter_map(variable).collect();
            found.push(Slope { target: operand.target(), value, reads });
        }
    }
    found
}

/// What unknowns of several equations, or with a coefficient of 0, are multiplied with in the sum; 0 for those that cancel.
fn gathered(slopes: &[Slope]) -> Vec<(Target, f64)> {
    let mut found: Vec<(Target, f64)> = Vec::new();
    for slope in slopes {
        if found.iter().any(|(target, _)| *target == slope.target) {
            continue;
        }
        let own = slopes.iter().filter(|other| other.target == slope.target).map(|other| other.value);
        let Some(values) = own.collect::<Option<Vec<f64>>>() else { continue };
        let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        let total: f64 = values.iter().sum();
        // Rounding has no part in it: a vector that is turned and turned back is the same.
        let near = (total - total.round()).abs() <= ZERO * largest;
        let coefficient = if near { total.round() } else { total };
        if values.len() > 1 || coefficient == 0.0 {
            found.push((slope.target, coefficient));
        }
    }
    found
}

/// The slot of an operand, a new one where it has none.
fn place(operands: &mut Vec<Operand>, target: Target) -> SlotId {
    let known = operands.iter().position(|known| known.target() == target);
    SlotId::new(known.unwrap_or_else(|| {
        operands.push(Operand::new(target));
        operands.len() - 1
    }))
}

/// The sum, `... = 0`, with what is gathered in one term each.
fn sum(system: &mut EquationSystem, terms: &[(EqId, f64)], gathered: &[(Target, f64)]) -> (Template, Vec<Operand>) {
    let mut all: Vec<Operand> = Vec::new();
    let arena = &mut system.flat.templates.arena;
    let zero = arena.constant(0.0);
    let mut total = zero;
    for &(eq, factor) in terms {
        let equation = system.equations[eq];
        let template = system.flat.templates.get(equation.template);
        let OperandRange { first, len } = equation.operands;
        let operands = &system.operands[first as usize..(first + len) as usize];
        let arena = &mut system.flat.templates.arena;
        let nodes: Vec<NodeId> = operands
            .iter()
            .map(|operand| {
                if gathered.iter().any(|(target, _)| *target == operand.target()) {
                    return zero;
                }
                let node = arena.slot(place(&mut all, operand.target()));
                if operand.negated() { arena.neg(node) } else { node }
            })
            .collect();
        let residual = arena.sub(template.left, template.right);
        let rest = substitute(arena, residual, &|slot| nodes[slot.index()]);
        let factor = arena.constant(factor);
        let term = arena.mul(factor, rest);
        total = arena.add(total, term);
    }
    let arena = &mut system.flat.templates.arena;
    for &(target, coefficient) in gathered.iter().filter(|(_, coefficient)| *coefficient != 0.0) {
        let (node, coefficient) = (arena.slot(place(&mut all, target)), arena.constant(coefficient));
        let term = arena.mul(coefficient, node);
        total = arena.add(total, term);
    }
    let left = simplify(arena, total);
    let right = arena.constant(0.0);
    (Template { left, right, arity: all.len() as u32 }, all)
}
