//! Symbolic work on templates, done once per template and slot: what occurs, and what each slot equals.
//!
//! Equations only look results up.  Whether a solution may be used depends on what the equation's slots read: dividing
//! by a number is safe, by an expression of parameters nearly so, by anything that changes during the run it is not.

use hyd_flat::{Operand, Target, VarId};
use hyd_index::{IndexVec, TypedIndex};
use hyd_symbolic::{
    Node, NodeId, SlotId, Template, TemplateId, Templates, isolate, post_order, slots, solve_for, without_ignored,
};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::jacobian::reverse::WIDE;
use crate::system::{EqId, EquationSystem, Role};

/// What occurs in `left - right` of a template.
#[derive(Clone, Debug)]
pub(crate) struct Facts {
    /// Left side minus right side.
    pub residual: NodeId,
    /// Slots in it, ascending.
    pub slots: Vec<SlotId>,
    /// Time or `initial()` occurs.
    pub clocked: bool,
}

/// A slot solved for.
#[derive(Clone, Debug)]
pub(crate) struct Solved {
    /// Its value.
    pub value: NodeId,
    /// The negative of its value.
    pub negative: NodeId,
    /// `slot - value`.
    pub residual: NodeId,
    /// `slot*divisor - dividend`, where the slot is what the template divides by: linear, and finite where the slot is 0.
    pub cleared: Option<NodeId>,
    /// Expressions divided by that are not numbers.
    pub divisors: Vec<NodeId>,
    /// Slots in them.
    pub divisor_slots: Vec<SlotId>,
    /// Time or `initial()` occurs in what was divided by.
    pub clocked_divisor: bool,
}

/// How well an equation can be solved for one of its unknowns; smaller is better.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Solvability {
    /// Without dividing by anything but numbers.
    Always = 0,
    /// Dividing by an expression of parameters.
    ByParameters = 1,
    /// Dividing by something that changes.
    Sometimes = 2,
    /// Not linear.
    Never = 3,
}

impl Solvability {
    /// Good enough for an explicit assignment.
    pub(crate) fn is_safe(self) -> bool {
        self <= Solvability::ByParameters
    }
}

/// Variables known before anything is solved.
pub(crate) struct Known {
    /// Parameters, constants and what depends on nothing else.
    pub bound: IndexVec<VarId, bool>,
}

impl Known {
    /// All parameters and constants.
    pub(crate) fn parameters(system: &EquationSystem) -> Self {
        let is_parameter = |role: &Role| matches!(role, Role::Parameter | Role::Constant);
        Self { bound: IndexVec::from_vec(system.roles.iter().map(is_parameter).collect()) }
    }

    /// True if the operand has its value before the run.
    pub(crate) fn is_known(&self, operand: Operand) -> bool {
        match operand.target() {
            Target::Const(_) => true,
            Target::Var(v) => self.bound[v],
            _ => false,
        }
    }
}

/// The results found so far.
#[derive(Default)]
pub(crate) struct Algebra {
    facts: Vec<Option<Facts>>,
    solved: Vec<Vec<Option<Option<Box<Solved>>>>>,
    /// For wide templates: which slots are plain terms of a sum.
    terms: FxHashMap<TemplateId, Vec<bool>>,
}

impl Algebra {
    /// What occurs in an equation's template.
    pub(crate) fn facts(&mut self, templates: &mut Templates, id: TemplateId) -> &Facts {
        if self.facts.len() <= id.index() {
            self.facts.resize(templates.len(), None);
        }
        self.facts[id.index()].get_or_insert_with(|| {
            let template = templates.get(id);
            let residual = templates.arena.sub(template.left, template.right);
            let residual = without_ignored(&mut templates.arena, residual);
            let mut slots = slots(&templates.arena, &[residual]);
            slots.sort_unstable();
            Facts { residual, slots, clocked: is_clocked(templates, residual) }
        })
    }

    /// A slot's value, if the template is linear in it.
    pub(crate) fn solve(&mut self, templates: &mut Templates, id: TemplateId, slot: SlotId) -> Option<&Solved> {
        if self.solved.len() <= id.index() {
            self.solved.resize(templates.len(), Vec::new());
        }
        let list = &mut self.solved[id.index()];
        if list.is_empty() {
            list.resize(templates.get(id).arity as usize, None);
        }
        list[slot.index()].get_or_insert_with(|| solve(templates, id, slot).map(Box::new)).as_deref()
    }

    /// How well an equation can be solved for the unknown in a slot.
    pub(crate) fn solvability(
        &mut self,
        system: &mut EquationSystem,
        known: &Known,
        eq: EqId,
        slot: SlotId,
    ) -> Solvability {
        let equation = system.equations[eq];
        let template = system.flat.templates.get(equation.template);
        if template.arity as usize > WIDE {
            let terms = self.terms.entry(equation.template);
            let terms = terms.or_insert_with(|| plain_terms(&system.flat.templates, template));
            return if terms[slot.index()] { Solvability::Always } else { Solvability::Never };
        }
        let Some(solved) = self.solve(&mut system.flat.templates, equation.template, slot) else {
            return Solvability::Never;
        };
        let operands = system.operands_of(equation.operands);
        if solved.divisors.is_empty() {
            Solvability::Always
        } else if !solved.clocked_divisor && solved.divisor_slots.iter().all(|s| known.is_known(operands[s.index()])) {
            Solvability::ByParameters
        } else {
            Solvability::Sometimes
        }
    }

    /// The value to assign to the target of the operand in a slot, its sign taken into account.
    pub(crate) fn value(&mut self, system: &mut EquationSystem, eq: EqId, slot: SlotId) -> Option<NodeId> {
        let equation = system.equations[eq];
        let negated = system.operands_of(equation.operands)[slot.index()].negated();
        let solved = self.solve(&mut system.flat.templates, equation.template, slot)?;
        Some(if negated { solved.negative } else { solved.value })
    }
}

fn solve(templates: &mut Templates, id: TemplateId, slot: SlotId) -> Option<Solved> {
    let template = templates.get(id);
    let arena = &mut templates.arena;
    let (left, right) = (without_ignored(arena, template.left), without_ignored(arena, template.right));
    let solution = isolate(arena, left, right, slot)?;
    let own = arena.slot(slot);
    let (negative, residual) = (arena.neg(solution.value), arena.sub(own, solution.value));
    let cleared = match arena.node(solution.value) {
        Node::Div(dividend, divisor) if solve_for(arena, left, right, slot).is_none() => {
            let product = arena.mul(own, divisor);
            Some(arena.sub(product, dividend))
        }
        _ => None,
    };
    Some(Solved {
        value: solution.value,
        cleared,
        negative,
        residual,
        divisor_slots: slots(arena, &solution.divisors),
        clocked_divisor: solution.divisors.iter().any(|&divisor| is_clocked(templates, divisor)),
        divisors: solution.divisors,
    })
}

/// The slots that stand once in a template, as a term of a sum with a number as coefficient.
///
/// Solving a wide equation for each of its slots just to see whether that is possible would cost the square of its
/// length; this looks at all slots at once and misses only rarer forms.
fn plain_terms(templates: &Templates, template: Template) -> Vec<bool> {
    let arena = &templates.arena;
    let mut count = vec![0_u32; template.arity as usize];
    let mut inner = Vec::new();
    let mut stack = vec![template.left, template.right];
    let mut seen = FxHashSet::default();
    while let Some(id) = stack.pop() {
        match arena.node(id) {
            Node::Slot(slot) => count[slot.index()] += 1,
            // A shared part would be looked at again and again; its slots stand there more than once.
            _ if !seen.insert(id) => inner.push(id),
            Node::Add(a, b) | Node::Sub(a, b) => stack.extend([a, b]),
            Node::Neg(a) => stack.push(a),
            Node::Mul(a, b) if arena.as_constant(a).is_some_and(|factor| factor != 0.0) => stack.push(b),
            Node::Div(a, b) if arena.as_constant(b).is_some_and(|divisor| divisor != 0.0) => stack.push(a),
            _ => inner.push(id),
        }
    }
    for slot in slots(arena, &inner) {
        count[slot.index()] += 2;
    }
    count.into_iter().map(|count| count == 1).collect()
}

/// True if time, `initial()` or `homotopy` occurs.
pub(crate) fn is_clocked(templates: &Templates, root: NodeId) -> bool {
    let arena = &templates.arena;
    post_order(arena, &[root])
        .into_iter()
        .any(|id| matches!(arena.node(id), Node::Time | Node::Initial | Node::Homotopy))
}
