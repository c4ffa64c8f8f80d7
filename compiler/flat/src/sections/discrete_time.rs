//! What changes at events only must be given values that change at events only.
//!
//! Integer, Boolean and enumeration variables, and Real ones declared `discrete`, take discrete-time expressions outside
//! `when` (Modelica 3.6, section 3.8.3): relations count, because they cause events; what stands in `noEvent` or inside
//! functions does not.  Looked at when all equations are there, since a `when` further down makes its variables discrete (section 4.5); so is
//! `pre` outside of `when`, which discrete-time variables alone have there (section 3.7.5).
//! Algorithm sections, which mix both, are not looked at.

use hyd_source::{Code, Diagnostic, Span};
use hyd_symbolic::{Node, NodeId, post_order};
use hyd_system::{ValueKind, Variability};
use rustc_hash::FxHashMap;

use crate::model::{EquationBlock, Operand, Section, Target, VarId};
use crate::state::flattener::Flattener;

impl Flattener<'_, '_> {
    /// The equations made last determine discrete variables: looked at in the end.
    pub(crate) fn note_discrete(&mut self) {
        let tables = self.tables();
        let known = &mut tables.notes.discrete;
        if let Some(last) = tables.equations.len().checked_sub(1).filter(|last| known.last() != Some(last)) {
            known.push(last);
        }
    }

    /// Reports discrete variables with values that change between events.
    pub(crate) fn check_discrete_time(&mut self) {
        let mut reported = Vec::new();
        for at in std::mem::take(&mut self.notes.discrete) {
            let Some(block) = self.model.equations.get(at) else { continue };
            let template = self.model.templates.get(block.template);
            let operands = block.operands_of(0, template.arity as usize);
            let sides = [template.left, template.right];
            let Some(fault) = sides.into_iter().find_map(|side| self.varying_part(side, operands)) else { continue };
            let Some(v) = self.discrete_variable(template.left, operands) else { continue };
            if block.section == Section::Continuous && self.set_at_events(v) {
                continue;
            }
            if !reported.contains(&block.origin.span) {
                reported.push(block.origin.span);
                let diagnostic = self.no_discrete_time(block, v, fault);
                self.report(diagnostic);
            }
        }
    }

    /// Reports `pre` of continuous variables outside of `when`: they have a value before an event, which nothing holds after it.
    pub(crate) fn check_before_event(&mut self) {
        let mut reported: Vec<Span> = Vec::new();
        for (span, inst) in std::mem::take(&mut self.notes.before_event) {
            let variability = self.scopes.variability(inst);
            if variability == hyd_syntax::tree::Variability::Continuous && !reported.contains(&span) {
                reported.push(span);
                let name = &self.scopes.instances[inst].name;
                let message = format!("`pre` of the continuous variable `{name}` is allowed only inside `when`");
                let _ = self.error(Code::Misplaced, span, message);
            }
        }
    }

    fn no_discrete_time(&self, block: &EquationBlock, v: VarId, fault: Part) -> Diagnostic {
        let (of, k) = self.model.locate(v);
        let of = &self.model.variables[of];
        let what = match of.kind {
            ValueKind::Integer => "an Integer",
            ValueKind::Boolean => "a Boolean",
            ValueKind::Enumeration(_) => "of an enumeration",
            ValueKind::Real => "declared `discrete`",
        };
        let name = of.name.element(k);
        let message = format!("`{name}` is {what} and changes at events only, but this may change at any time");
        let help = match fault {
            Part::Call => {
                "relations inside a function cause no events: give it the relation as an argument, set the variable in a \
                 `when`, or write `annotation(GenerateEvents = true)` in the function"
            }
            Part::Relation => {
                "a relation causes an event where it stands in an equation without `noEvent` and `smooth`; inside a function, and `==` of Reals, \
                 it does not"
            }
            Part::Value => "set it in a `when`, which says at which instants it takes a value",
        };
        Diagnostic::error(Code::DiscreteTime, message)
            .at(block.origin.span, "")
            .with(of.origin.span, "declared here")
            .help(help)
    }

    /// True if a discrete equation, such as one of a `when`, determines the variable: others only read it.
    fn set_at_events(&self, v: VarId) -> bool {
        let determines = |block: &EquationBlock| {
            let template = self.model.templates.get(block.template);
            let Node::Slot(slot) = self.model.templates.arena.node(template.left) else { return false };
            let arity = template.arity as usize;
            (0..block.count as usize).any(|k| block.operands_of(k, arity)[slot.0 as usize].target() == Target::Var(v))
        };
        self.model.equations.iter().any(|block| block.section == Section::Discrete && determines(block))
    }

    /// A discrete variable that a side of an equation is.
    pub(crate) fn discrete_variable(&self, side: NodeId, operands: &[Operand]) -> Option<VarId> {
        let Node::Slot(slot) = self.model.templates.arena.node(side) else { return None };
        match operands[slot.0 as usize].target() {
            Target::Var(v) if self.model.variables[self.model.locate(v).0].variability == Variability::Discrete => {
                Some(v)
            }
            _ => None,
        }
    }

    /// What makes an expression vary between events; `None` if it does not.
    pub(crate) fn varying_part(&self, root: NodeId, operands: &[Operand]) -> Option<Part> {
        let arena = &self.model.templates.arena;
        let mut known: FxHashMap<NodeId, Option<Part>> = FxHashMap::default();
        for id in post_order(arena, &[root]) {
            let node = arena.node(id);
            let mut inner = None;
            node.map(|operand| {
                inner = inner.or(known.get(&operand).copied().flatten());
                operand
            });
            let own = match node {
                Node::Time => Some(Part::Value),
                Node::Slot(slot) => match operands[slot.0 as usize].target() {
                    Target::Der(_)
                    | Target::Delayed(_)
                    | Target::DelayedRate(_)
                    | Target::Input(_)
                    | Target::InputRate(_) => Some(Part::Value),
                    Target::Var(v) if self.varies(v) => Some(Part::Value),
                    _ => None,
                },
                Node::Event(..) => None,
                Node::Compare(..) => inner.map(|_| Part::Relation),
                Node::Apply(..) => inner.map(|_| Part::Call),
                _ => inner,
            };
            known.insert(id, own);
        }
        known.get(&root).copied().flatten()
    }
}

/// What varies between events.
#[derive(Clone, Copy)]
pub(crate) enum Part {
    /// A continuous value.
    Value,
    /// A relation without events.
    Relation,
    /// A call of a compiled function.
    Call,
}
