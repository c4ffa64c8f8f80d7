//! Algorithm sections of models: run symbolically, then one equation per variable they set.
//!
//! `algorithm v := e; ...` determines every variable it assigns: `v = node` with the node found by running the
//! statements; values of other continuous variables stand in it as those variables.  A variable read before its first
//! assignment has its value before the event (discrete) or its start value
//! (Modelica 3.6, section 11.1.2); so it is in the conditions of `when`.

use std::rc::Rc;

use hyd_instance::Scope;
use hyd_source::{Code, Origin, Span};
use hyd_symbolic::{Arena, Node, NodeId, replace_below};
use hyd_system::{ValueKind, Variability};
use hyd_typed::{Expr, Kind as Form, Statement, StatementKind};
use rustc_hash::FxHashMap;

use crate::functions::statement::Flow;
use crate::model::{PerElement, Section, VarId};
use crate::sections::loops::Loops;
use crate::sections::when_condition::StatementCondition;
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, Kind, SlotKey};
use crate::state::node::Typed;

/// Where a statement stands.
#[derive(Clone, Copy)]
struct Place {
    in_when: bool,
    initial: bool,
}

impl Flattener<'_, '_> {
    pub(crate) fn algorithm(&mut self, statements: &[Statement], initial: bool, span: Span, scope: Scope) {
        let mut whens = Vec::new();
        if !self.when_conditions(statements, scope, &mut whens) {
            return;
        }
        let origin = Origin { path: self.path(scope.inst), span };
        let start = self.context_of(scope);
        self.with_loops(start, &mut |flat, cx| {
            flat.enter(cx);
            // It is run once, at the start: nothing in it is an event.
            cx.no_event = initial;
            cx.whens.clone_from(&whens);
            cx.assigned = Some(Vec::new());
            let mut targets = Vec::new();
            flat.targets(statements, Place { in_when: false, initial }, &mut targets)?;
            cx.algorithm_targets = Rc::new(targets.into_iter().collect());
            let flow = flat.run(statements, cx);
            if !matches!(flow, Ok(Flow::Next) | Err(Fail::Reported | Fail::NeedsExpansion)) {
                let message = "`return` and `break` end a function or a loop, not an algorithm section";
                return Err(flat.error(Code::Misplaced, span, message));
            }
            flow?;
            let assigned = cx.assigned.take().unwrap_or_default();
            flat.emit_conditions(&assigned, cx, &origin);
            let variables = if initial { FxHashMap::default() } else { flat.variables_of_values(&assigned) };
            for (v, value) in assigned {
                let slot = flat.slots.slot(SlotKey::Variable(Kind::Var, v, Affine::constant(0)));
                let left = flat.model.templates.arena.slot(slot);
                let discrete = flat.variable_of(v).variability == Variability::Discrete;
                let kind = match (initial, discrete) {
                    (true, _) => Section::Initial,
                    (false, true) => Section::Discrete,
                    (false, false) => Section::Continuous,
                };
                let right = match kind {
                    Section::Continuous => replace_below(&mut flat.model.templates.arena, value.node, &variables),
                    _ => value.node,
                };
                flat.emit(kind, left, right, &cx.loop_counts(), &origin);
            }
            Ok(())
        });
    }

    /// The equations of the conditions of `when` statements.  Where one reads what the section ends with, it reads the variable: the same expression has
    /// the same value, wherever it comes from, and levels keep a variable from being read before it is computed.
    fn emit_conditions(&mut self, assigned: &[(VarId, Typed)], cx: &Context, section: &Origin) {
        if cx.decided.is_empty() {
            return;
        }
        let variables = self.variables_by_value(assigned, |_, _| true);
        for (left, right, span) in &cx.decided {
            let known = variables.get(right).copied();
            let right = known.unwrap_or_else(|| replace_below(&mut self.model.templates.arena, *right, &variables));
            let origin = Origin { span: *span, ..section.clone() };
            self.emit(Section::Discrete, *left, right, &cx.loop_counts(), &origin);
        }
    }

    /// The continuous variables that values are of: the others use the variable, so that a recurrence over n variables does not become
    /// expressions of n operations.
    fn variables_of_values(&mut self, assigned: &[(VarId, Typed)]) -> FxHashMap<NodeId, NodeId> {
        self.variables_by_value(assigned, |flat, v| {
            let variable = flat.variable_of(v);
            (variable.variability, &variable.kind) == (Variability::Continuous, &ValueKind::Real)
        })
    }

    /// The first of these variables that each value is assigned to, where the value takes some work.
    fn variables_by_value(
        &mut self,
        assigned: &[(VarId, Typed)],
        is_meant: impl Fn(&Self, VarId) -> bool,
    ) -> FxHashMap<NodeId, NodeId> {
        let mut known = FxHashMap::default();
        for (v, value) in assigned {
            if is_operation(&self.model.templates.arena, value.node) && is_meant(self, *v) {
                let slot = self.slots.slot(SlotKey::Variable(Kind::Var, *v, Affine::constant(0)));
                known.entry(value.node).or_insert_with(|| self.model.templates.arena.slot(slot));
            }
        }
        known
    }

    /// Discrete Booleans for the conditions of all `when` statements of the section.
    fn when_conditions(&mut self, statements: &[Statement], scope: Scope, whens: &mut Vec<StatementCondition>) -> bool {
        for statement in statements {
            if let StatementKind::When(branches) = &statement.kind {
                let number = self.next_when();
                for (k, (condition, _)) in branches.iter().enumerate() {
                    match self.condition_variables(condition, number, k, scope, &Loops::default()) {
                        Some(found) => whens.push(found),
                        None => return false,
                    }
                }
            }
        }
        true
    }

    /// The scalar variables the statements assign; those set inside `when` become discrete.
    fn targets(&mut self, statements: &[Statement], place: Place, targets: &mut Vec<VarId>) -> Result<(), Fail> {
        for statement in statements {
            match &statement.kind {
                StatementKind::Assign(target, _) => self.target(target, place, targets)?,
                StatementKind::AssignTuple(list, _) => {
                    for target in list.iter().flatten() {
                        self.target(target, place, targets)?;
                    }
                }
                StatementKind::If(branches) => {
                    for (_, body) in branches {
                        self.targets(body, place, targets)?;
                    }
                }
                StatementKind::When(branches) => {
                    for (_, body) in branches {
                        self.targets(body, Place { in_when: true, ..place }, targets)?;
                    }
                }
                StatementKind::For(_, body) | StatementKind::While(_, body) => self.targets(body, place, targets)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// All elements of the variable named: which of them are set may depend on loops.
    fn target(&mut self, target: &Expr, place: Place, targets: &mut Vec<VarId>) -> Result<(), Fail> {
        let Form::Variable(variable) = &target.kind else {
            return Err(self.error(Code::Misplaced, target.span, "only variables can be assigned"));
        };
        let last = variable.last();
        let known = self.scopes.variability(last) <= hyd_syntax::tree::Variability::Parameter;
        let leaves = self.variables_below(last);
        let computed = place.initial
            && self.scopes.variability(last) == hyd_syntax::tree::Variability::Parameter
            && leaves.iter().all(|&block| self.model.variables[block].fixed == PerElement::All(false));
        if known && !computed {
            let message =
                format!("`{}` is a parameter or constant and cannot be assigned", self.scopes.instances[last].name);
            return Err(self.error(Code::Misplaced, target.span, message));
        }
        if place.in_when {
            self.make_discrete(last);
        }
        for block in leaves {
            let block = &self.model.variables[block];
            targets.extend((0..block.count).map(|k| VarId(block.first.0 + k)));
        }
        Ok(())
    }

    fn variables_below(&self, inst: hyd_instance::InstId) -> Vec<crate::model::BlockId> {
        match self.blocks.get(&inst) {
            Some(&block) => vec![block],
            None => self.scopes.instances[inst].children.iter().flat_map(|&c| self.variables_below(c)).collect(),
        }
    }
}

/// True for nodes that are worth a variable: neither a number nor a variable itself.
fn is_operation(arena: &Arena, value: NodeId) -> bool {
    matches!(
        arena.node(value),
        Node::Neg(_)
            | Node::Add(..)
            | Node::Sub(..)
            | Node::Mul(..)
            | Node::Div(..)
            | Node::Not(_)
            | Node::And(..)
            | Node::Or(..)
            | Node::Compare(..)
            | Node::Event(..)
            | Node::If(..)
            | Node::Call1(..)
            | Node::Call2(..)
            | Node::Apply(..)
    )
}
