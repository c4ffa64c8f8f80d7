//! What changes at events only must be given values that change at events only.
//!
//! Integer, Boolean and enumeration variables, and Real ones declared `discrete`, take discrete-time expressions outside
//! `when` (Modelica 3.6, section 3.8.3): relations count, because they cause events; what stands in `noEvent` or inside
//! functions does not.  Looked at when all equations are there, since a `when` further down makes its variables discrete.
//! Algorithm sections, which mix both, are not looked at.

use hyd_source::{Code, Diagnostic};
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
        let noted = std::mem::take(&mut self.notes.discrete);
        self.let_records_follow(&noted);
        let mut reported = Vec::new();
        for at in noted {
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

    /// Numbers of records that functions of continuous values return (the `phase` of a state of a medium) are taken as they are returned: they
    /// and what is equal to them change at any time.
    fn let_records_follow(&mut self, noted: &[usize]) {
        let mut open = true;
        while std::mem::take(&mut open) {
            for &at in noted {
                let Some(block) = self.model.equations.get(at) else { continue };
                let template = self.model.templates.get(block.template);
                let operands = block.operands_of(0, template.arity as usize);
                let sides = [template.left, template.right];
                let Some(v) = self.discrete_variable(template.left, operands) else { continue };
                let fault = sides.into_iter().find_map(|side| self.varying_part(side, operands));
                let follows = match fault {
                    Some(Part::Call | Part::Relation) => true,
                    Some(Part::Value) => matches!(self.model.templates.arena.node(template.right), Node::Slot(_)),
                    None => false,
                };
                if follows && self.is_of_record(v) && !self.is_set_elsewhere(v, at) {
                    self.follow(v, at);
                    open = true;
                }
            }
            open |= self.follow_through_connections();
        }
    }

    /// What is connected to, or the same as, a number that changes at any time.
    fn follow_through_connections(&mut self) -> bool {
        let mut found = Vec::new();
        for (at, block) in self.model.equations.iter().enumerate() {
            let template = self.model.templates.get(block.template);
            let arena = &self.model.templates.arena;
            let sides = [arena.node(template.left), arena.node(template.right)];
            let [Node::Slot(a), Node::Slot(b)] = sides else { continue };
            if block.section != Section::Discrete || block.operands.is_empty() {
                continue;
            }
            let operands = block.operands_of(0, template.arity as usize);
            let [Target::Var(a), Target::Var(b)] = [a, b].map(|slot| operands[slot.0 as usize].target()) else {
                continue;
            };
            let follows = |v: VarId| self.model.variables[self.model.locate(v).0].at_any_time;
            match (follows(a), follows(b)) {
                (true, false) if self.is_of_record(b) => found.push((b, at)),
                (false, true) if self.is_of_record(a) => found.push((a, at)),
                (true, true) => found.push((a, at)),
                _ => {}
            }
        }
        let any = !found.is_empty();
        found.into_iter().for_each(|(v, at)| self.follow(v, at));
        any
    }

    fn follow(&mut self, v: VarId, at: usize) {
        let block = self.model.locate(v).0;
        let variable = &mut self.model.variables[block];
        (variable.variability, variable.at_any_time) = (Variability::Continuous, true);
        self.model.equations[at].section = Section::Continuous;
    }

    /// A number in a component that is a record.
    fn is_of_record(&self, v: VarId) -> bool {
        let block = self.model.locate(v).0;
        let inst = self.blocks.iter().find(|(_, own)| **own == block).map(|(&inst, _)| inst);
        let parent = inst.and_then(|inst| self.scopes.instances[inst].parent);
        parent.is_some_and(|parent| self.scopes.is_record(parent))
    }

    /// True if another discrete equation than this one determines the variable, such as one of a `when`; that it is equal to another one does
    /// not say that.
    fn is_set_elsewhere(&self, v: VarId, but: usize) -> bool {
        let is_equality = |at: usize| {
            let template = self.model.templates.get(self.model.equations[at].template);
            matches!(self.model.templates.arena.node(template.right), Node::Slot(_))
        };
        self.determining(v).any(|at| at != but && !is_equality(at))
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
        self.determining(v).next().is_some()
    }

    /// The discrete equations that have the variable on their left.
    fn determining(&self, v: VarId) -> impl Iterator<Item = usize> {
        let determines = move |block: &EquationBlock| {
            let template = self.model.templates.get(block.template);
            let Node::Slot(slot) = self.model.templates.arena.node(template.left) else { return false };
            let arity = template.arity as usize;
            (0..block.count as usize).any(|k| block.operands_of(k, arity)[slot.0 as usize].target() == Target::Var(v))
        };
        let blocks = self.model.equations.iter().enumerate();
        blocks.filter(move |(_, block)| block.section == Section::Discrete && determines(block)).map(|(at, _)| at)
    }

    /// A discrete variable that a side of an equation is.
    fn discrete_variable(&self, side: NodeId, operands: &[Operand]) -> Option<VarId> {
        let Node::Slot(slot) = self.model.templates.arena.node(side) else { return None };
        match operands[slot.0 as usize].target() {
            Target::Var(v) if self.model.variables[self.model.locate(v).0].variability == Variability::Discrete => {
                Some(v)
            }
            _ => None,
        }
    }

    /// What makes an expression vary between events; `None` if it does not.
    fn varying_part(&self, root: NodeId, operands: &[Operand]) -> Option<Part> {
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
enum Part {
    /// A continuous value.
    Value,
    /// A relation without events.
    Relation,
    /// A call of a compiled function.
    Call,
}
