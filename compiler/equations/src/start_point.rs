//! Numbers at which the choice of states is judged: parameters and start values as far as they are known before the run.
//!
//! Bindings are evaluated in order, then start attributes.  What has no start value gets a made-up number near 1, the same
//! in every translation, so that an expression that depends on it is neither zero nor singular by accident.

use std::cell::RefCell;

use hyd_flat::{Operand, Section, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_source::Diagnostic;
use hyd_symbolic::{Evaluator, NodeId, SlotId};
use hyd_system::{Settable, ValueKind};
use rustc_hash::FxHashMap;

use crate::algebra::Algebra;
use crate::plan::bindings::{assignment, sort_bindings};
use crate::sorted::Assignment;
use crate::system::{EquationSystem, OperandRange, Role};

/// Values of variables and their derivatives at the start.
pub(crate) struct StartPoint {
    value: IndexVec<VarId, Option<f64>>,
    start: IndexVec<VarId, Option<f64>>,
    time: f64,
    /// Makes other numbers up.
    seed: u32,
    /// Expressions that were evaluated before: thousands of equations share one.
    prepared: RefCell<FxHashMap<NodeId, Evaluator>>,
}

impl StartPoint {
    /// The start point of a system; a cycle among its parameters is an error.
    pub(crate) fn new(system: &mut EquationSystem, algebra: &mut Algebra) -> Result<Self, Diagnostic> {
        let bindings = sort_bindings(system, algebra)?;
        let mut point = Self::of_parameters(system, &bindings.assignments);
        for eq in system.equations_in(Section::Start) {
            if let Some(a) = assignment(system, eq, 0) {
                point.execute(system, &a);
            }
        }
        for v in system.roles.indices() {
            point.value[v] = point.value[v].or(point.start[v]);
        }
        Ok(point)
    }

    /// Only what is known before the start, from its assignments in order.
    pub(crate) fn of_parameters(system: &EquationSystem, bindings: &[Assignment]) -> Self {
        let count = system.roles.len();
        let time = system.flat.experiment.start.unwrap_or(0.0);
        let mut point = Self {
            value: IndexVec::filled(None, count),
            start: IndexVec::filled(None, count),
            time,
            seed: 0,
            prepared: RefCell::default(),
        };
        for a in bindings {
            point.execute(system, a);
        }
        point
    }

    /// Parameters as declared, all that is not known before the start somewhere near its start value, other numbers for each seed:
    /// what holds at several such points does not hold by accident.
    pub(crate) fn scattered(system: &mut EquationSystem, bindings: &[Assignment], seed: u32) -> Self {
        let mut point = Self::of_parameters(system, bindings);
        point.seed = seed.wrapping_mul(0x9e37_79b9);
        for eq in system.equations_in(Section::Start) {
            if let Some(a) = assignment(system, eq, 0) {
                point.execute(system, &a);
            }
        }
        for v in system.roles.indices() {
            let near = point.start[v].filter(|&start| start != 0.0).map(|start| start * typical(v.0 ^ point.seed));
            point.value[v] = point.value[v].or(near);
        }
        point
    }

    /// A made-up number, another for each seed.
    pub(crate) fn made_up(&self, key: u32) -> f64 {
        typical(key ^ self.seed)
    }

    /// The same with a made-up number for each real parameter that can be set.
    pub(crate) fn of_made_up_parameters(system: &EquationSystem, bindings: &[Assignment]) -> Self {
        let mut point = Self::of_parameters(system, &[]);
        for a in bindings {
            point.execute(system, a);
            if let Target::Var(v) = a.target {
                let block = &system.flat.variables[system.flat.locate(v).0];
                let free = system.roles[v] == Role::Parameter && block.settable == Settable::Yes;
                if free && block.kind == ValueKind::Real {
                    point.value[v] = Some(typical(v.0));
                }
            }
        }
        point
    }

    fn execute(&mut self, system: &EquationSystem, a: &Assignment) {
        let given = system.flat.given.iter().find(|(v, _)| a.target == Target::Var(*v)).map(|(_, value)| *value);
        let value = given.unwrap_or_else(|| self.evaluate(system, a.value, a.operands));
        let value = Some(value).filter(|value| value.is_finite());
        match a.target {
            Target::Var(v) => self.value[v] = value,
            Target::Start(v) => self.start[v] = value,
            _ => {}
        }
    }

    /// The value of a variable, if it is known.
    pub(crate) fn value(&self, v: VarId) -> Option<f64> {
        self.value[v]
    }

    /// The start attribute of a variable, if it is known.
    pub(crate) fn start(&self, v: VarId) -> Option<f64> {
        self.start[v]
    }

    /// The value of an expression.
    pub(crate) fn evaluate(&self, system: &EquationSystem, root: NodeId, operands: OperandRange) -> f64 {
        let operands = system.operands_of(operands);
        let read = |slot: SlotId| self.read(system, operands[slot.index()]);
        let mut prepared = self.prepared.borrow_mut();
        let evaluator = prepared.entry(root).or_insert_with(|| Evaluator::new(&system.flat.templates.arena, &[root]));
        evaluator.evaluate(read, self.time, true)[0]
    }

    fn read(&self, system: &EquationSystem, operand: Operand) -> f64 {
        let value = match operand.target() {
            Target::Var(v) => self.value[v].unwrap_or_else(|| self.made_up(v.0)),
            Target::Start(v) | Target::Pre(v) => self.start[v].unwrap_or(0.0),
            Target::Der(v) => self.made_up(v.0 ^ 0x5555),
            Target::Const(c) => system.flat.constants[c],
            Target::Held(_) | Target::Chosen(_) | Target::DelayedRate(_) => 0.0,
            Target::Delayed(site) => self.made_up(site ^ 0x3333),
            Target::Input(k) => self.made_up(k ^ 0x6666),
            Target::InputRate(k) => self.made_up(k ^ 0x7777),
        };
        if operand.negated() { -value } else { value }
    }
}

/// A number between 0.5 and 1.5 (multiplicative hashing, Knuth 1998, section 6.4).
pub(crate) fn typical(seed: u32) -> f64 {
    0.5 + f64::from(seed.wrapping_add(1).wrapping_mul(2_654_435_769) >> 8) / f64::from(1_u32 << 24)
}
