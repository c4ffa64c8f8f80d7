//! Does a set of initial conditions that has one too many contradict itself?
//!
//! The values of the set are found one after the other, by equations with a single unknown that can be solved for it (as in
//! forward substitution); then the surplus equation, or whichever is left over, is evaluated.  Sets with parameters that may be
//! set for a run, with time, or with equations that must be solved together stay undecided here: the start decides.

use hyd_flat::{Operand, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_source::Diagnostic;
use hyd_structure::Part;
use hyd_symbolic::{NodeId, SlotId, eval};
use rustc_hash::FxHashMap;

use crate::algebra::Algebra;
use crate::incidence::Pattern;
use crate::start_point::StartPoint;
use crate::system::{EqId, EquationSystem, OperandRange};

/// An equation holds if it is violated by at most this, relative to its sides or to 1.
pub(crate) const TOLERANCE: f64 = 1e-6;
/// Larger sets are left to the start.
const MOST_EQUATIONS: usize = 200;

/// Start attributes as far as they are numbers.
pub(crate) type StartNumbers = IndexVec<VarId, Option<f64>>;

/// An equation that does not hold, with the values of its sides.
pub(crate) struct Contradiction {
    /// The equation.
    pub equation: EqId,
    /// Left and right.
    pub sides: [f64; 2],
}

/// Substitutes through the equations of a part; `None` if they agree or that is not known.
pub(crate) fn find_contradiction(
    system: &mut EquationSystem,
    algebra: &mut Algebra,
    starts: &StartNumbers,
    pattern: &Pattern,
    (part, surplus): (&Part, EqId),
) -> Option<Contradiction> {
    let mut open: Vec<EqId> = part.rows.iter().map(|row| pattern.rows[row.index()]).collect();
    if open.len() > MOST_EQUATIONS {
        return None;
    }
    // The surplus equation comes last, so that it is the one that is found to fail.
    open.retain(|&eq| eq != surplus);
    open.push(surplus);
    let mut values = Values { known: FxHashMap::default(), starts };
    loop {
        let count = open.len();
        let mut rest = Vec::with_capacity(count);
        for &eq in &open {
            match values.use_equation(system, algebra, eq) {
                Use::Solved => {}
                Use::Waits => rest.push(eq),
                Use::Sides([left, right])
                    if (left - right).abs() > TOLERANCE * left.abs().max(right.abs()).max(1.0) =>
                {
                    return Some(Contradiction { equation: eq, sides: [left, right] });
                }
                Use::Sides(_) => {}
            }
        }
        if rest.is_empty() || rest.len() == count {
            return None;
        }
        open = rest;
    }
}

/// Start values that are numbers: others may be set for a run.
pub(crate) fn start_numbers(system: &mut EquationSystem, algebra: &mut Algebra) -> Result<StartNumbers, Diagnostic> {
    let point = StartPoint::new(system, algebra)?;
    let mut starts = IndexVec::filled(None, system.roles.len());
    for eq in system.equations_in(hyd_flat::Section::Start) {
        let right = system.flat.templates.get(system.equations[eq].template).right;
        let target = system.left_operand(eq).map(|operand| operand.target());
        if let (Some(Target::Start(v)), Some(_)) = (target, system.flat.templates.arena.as_constant(right)) {
            starts[v] = point.start(v);
        }
    }
    Ok(starts)
}

struct Values<'a> {
    known: FxHashMap<Target, f64>,
    starts: &'a StartNumbers,
}

enum Use {
    /// It gave a value.
    Solved,
    /// More than one value is missing, or it cannot be solved.
    Waits,
    /// Everything in it is known.
    Sides([f64; 2]),
}

impl Values<'_> {
    fn of(&self, system: &EquationSystem, operand: Operand) -> Option<f64> {
        let value = match operand.target() {
            Target::Const(c) => Some(system.flat.constants[c]),
            Target::Start(v) => self.starts[v],
            target => self.known.get(&target).copied(),
        };
        value.map(|value| if operand.negated() { -value } else { value })
    }

    fn evaluate(&self, system: &EquationSystem, root: NodeId, operands: OperandRange) -> f64 {
        let operands = system.operands_of(operands);
        let read = |slot: SlotId| self.of(system, operands[slot.index()]).unwrap_or(f64::NAN);
        eval(&system.flat.templates.arena, root, read, f64::NAN, true)
    }

    fn use_equation(&mut self, system: &mut EquationSystem, algebra: &mut Algebra, eq: EqId) -> Use {
        let equation = system.equations[eq];
        let facts = algebra.facts(&mut system.flat.templates, equation.template);
        let operands = system.operands_of(equation.operands);
        let missing: Vec<SlotId> =
            facts.slots.iter().copied().filter(|slot| self.of(system, operands[slot.index()]).is_none()).collect();
        match missing[..] {
            [] => {
                let template = system.flat.templates.get(equation.template);
                let sides = [template.left, template.right].map(|side| self.evaluate(system, side, equation.operands));
                Use::Sides(sides)
            }
            [slot] => {
                let target = system.operands_of(equation.operands)[slot.index()].target();
                let Some(node) = self.unknown(system, target).then(|| algebra.value(system, eq, slot)).flatten() else {
                    return Use::Waits;
                };
                let value = self.evaluate(system, node, equation.operands);
                if !value.is_finite() {
                    return Use::Waits;
                }
                self.known.insert(target, value);
                Use::Solved
            }
            _ => Use::Waits,
        }
    }

    /// Only what the initial system determines may be found here.
    fn unknown(&self, system: &EquationSystem, target: Target) -> bool {
        match target {
            Target::Var(v) | Target::Der(v) => system.is_continuous(v),
            _ => false,
        }
    }
}
