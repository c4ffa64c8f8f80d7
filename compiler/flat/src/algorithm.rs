//! Algorithm sections of models: run symbolically, then one equation per variable they set.
//!
//! `algorithm v := e; ...` determines every variable it assigns: `v = node` with the node found by running the
//! statements; values of other continuous variables stand in it as those variables.  A variable read before its first
//! assignment has its value before the event (discrete) or its start value
//! (Modelica 3.6, section 11.1.2).

use std::rc::Rc;

use hyd_instance::{Resolved, Scope};
use hyd_source::{Code, Origin, Span};
use hyd_symbolic::{Node, NodeId, replace_below};
use hyd_syntax::tree::{AlgorithmSection, Arguments, ComponentRef, Expr, ExprKind, Statement, StatementKind};
use hyd_system::{ValueKind, Variability};
use rustc_hash::FxHashMap;

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::index::{Affine, Kind, SlotKey};
use crate::lower::Typed;
use crate::model::{PerElement, Section, VarId};
use crate::section::Loops;
use crate::statement::Flow;
use crate::when::WhenCondition;

/// Where a statement stands.
#[derive(Clone, Copy)]
struct Place {
    in_when: bool,
    initial: bool,
}

impl Flattener<'_, '_> {
    pub(crate) fn algorithm(&mut self, section: &AlgorithmSection, scope: Scope) {
        let mut whens = Vec::new();
        if !self.when_conditions(&section.statements, scope, &mut whens) {
            return;
        }
        let origin = Origin { path: self.path(scope.inst), span: section.span };
        let start = self.context_of(scope);
        self.with_loops(start, &mut |flat, cx| {
            flat.enter(cx);
            cx.whens.clone_from(&whens);
            cx.assigned = Some(Vec::new());
            let mut targets = Vec::new();
            flat.targets(&section.statements, Place { in_when: false, initial: section.initial }, cx, &mut targets)?;
            cx.algorithm_targets = Rc::new(targets.into_iter().collect());
            let flow = flat.run(&section.statements, cx);
            if !matches!(flow, Ok(Flow::Next) | Err(Fail::Reported | Fail::NeedsExpansion)) {
                let message = "`return` and `break` end a function or a loop, not an algorithm section";
                return Err(flat.error(Code::Misplaced, section.span, message));
            }
            flow?;
            let assigned = cx.assigned.take().unwrap_or_default();
            let variables = if section.initial { FxHashMap::default() } else { flat.variables_of_values(&assigned) };
            for (v, value) in assigned {
                let slot = flat.slots.slot(SlotKey::Variable(Kind::Var, v, Affine::constant(0)));
                let left = flat.model.templates.arena.slot(slot);
                let discrete = flat.variable_of(v).variability == Variability::Discrete;
                let kind = match (section.initial, discrete) {
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

    /// The continuous variables that values are of: the others use the variable, so that a recurrence over n variables does not become
    /// expressions of n operations.
    fn variables_of_values(&mut self, assigned: &[(VarId, Typed)]) -> FxHashMap<NodeId, NodeId> {
        let mut known = FxHashMap::default();
        for (v, value) in assigned {
            let operation = matches!(
                self.model.templates.arena.node(value.node),
                Node::Neg(_)
                    | Node::Add(..)
                    | Node::Sub(..)
                    | Node::Mul(..)
                    | Node::Div(..)
                    | Node::If(..)
                    | Node::Call1(..)
                    | Node::Call2(..)
                    | Node::Apply(..)
            );
            let variable = self.variable_of(*v);
            let real = (variable.variability, &variable.kind) == (Variability::Continuous, &ValueKind::Real);
            if operation && real {
                let slot = self.slots.slot(SlotKey::Variable(Kind::Var, *v, Affine::constant(0)));
                known.entry(value.node).or_insert_with(|| self.model.templates.arena.slot(slot));
            }
        }
        known
    }

    /// Discrete Booleans for the conditions of all `when` statements of the section.
    fn when_conditions(
        &mut self,
        statements: &[Statement],
        scope: Scope,
        whens: &mut Vec<(Span, Vec<WhenCondition>)>,
    ) -> bool {
        for statement in statements {
            if let StatementKind::When(branches) = &statement.kind {
                let number = self.next_when();
                for (k, (condition, _)) in branches.iter().enumerate() {
                    match self.conditions(condition, number, k, scope, &Loops::default()) {
                        Some(found) => whens.push((condition.span, found)),
                        None => return false,
                    }
                }
            }
        }
        true
    }

    /// The scalar variables the statements assign; those set inside `when` become discrete.
    fn targets(
        &mut self,
        statements: &[Statement],
        place: Place,
        cx: &mut Context,
        targets: &mut Vec<VarId>,
    ) -> Result<(), Fail> {
        for statement in statements {
            match &statement.kind {
                StatementKind::Assign(target, _) => self.target(target, place, cx, targets)?,
                StatementKind::AssignTuple(list, ..) => {
                    for target in list.iter().flatten() {
                        self.target(target, place, cx, targets)?;
                    }
                }
                StatementKind::If(branches) => {
                    for (_, body) in branches {
                        self.targets(body, place, cx, targets)?;
                    }
                }
                StatementKind::When(branches) => {
                    for (_, body) in branches {
                        self.targets(body, Place { in_when: true, ..place }, cx, targets)?;
                    }
                }
                StatementKind::For(_, body) | StatementKind::While(_, body) => {
                    self.targets(body, place, cx, targets)?
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// All elements of the variable named: which of them are set may depend on loops.
    fn target(
        &mut self,
        target: &ComponentRef,
        place: Place,
        cx: &mut Context,
        targets: &mut Vec<VarId>,
    ) -> Result<(), Fail> {
        let Resolved::Variable(steps) = self.tree.resolve(cx.scope, target)? else {
            return Err(self.error(Code::Misplaced, target.span, "only variables can be assigned"));
        };
        let last = steps[steps.len() - 1].0;
        let known = self.tree.instances[last].variability <= hyd_syntax::tree::Variability::Parameter;
        let leaves = self.variables_below(last);
        let computed = place.initial
            && self.tree.instances[last].variability == hyd_syntax::tree::Variability::Parameter
            && leaves.iter().all(|&block| self.model.variables[block].fixed == PerElement::All(false));
        if known && !computed {
            let message =
                format!("`{}` is a parameter or constant and cannot be assigned", self.tree.instances[last].name);
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
            None => self.tree.instances[inst].children.iter().flat_map(|&c| self.variables_below(c)).collect(),
        }
    }

    /// `variable := value` in an algorithm section of a model.
    pub(crate) fn assign_variable(
        &mut self,
        target: &ComponentRef,
        value: Local,
        cx: &mut Context,
    ) -> Result<(), Fail> {
        if let Local::Record(fields) | Local::Records(fields, _) = value {
            for (name, field) in fields {
                let mut inner = target.clone();
                let ident = hyd_syntax::tree::Ident { name, span: target.span };
                inner.parts.push(hyd_syntax::tree::RefPart { name: ident, subscripts: Vec::new() });
                self.assign_variable(&inner, field, cx)?;
            }
            return Ok(());
        }
        let expr = Expr { kind: ExprKind::Ref(target.clone()), span: target.span };
        let shape = self.shape(&expr, cx)?;
        let values = self.values_of(target.span, value)?;
        if values.len() != shape.iter().product::<usize>() {
            let message = format!("{} values are given to {} elements", values.len(), shape.iter().product::<usize>());
            return Err(self.error(Code::ArrayShape, target.span, message));
        }
        let Resolved::Variable(steps) = self.tree.resolve(cx.scope, target)? else { return Err(Fail::Reported) };
        let last = steps[steps.len() - 1].0;
        let Some(&block) = self.blocks.get(&last) else { return Err(Fail::Reported) };
        let first = self.model.variables[block].first;
        for (k, value) in values.iter().cloned().enumerate() {
            let mut rest = k;
            let mut at = vec![Affine::constant(0); shape.len()];
            for (position, &size) in shape.iter().enumerate().rev() {
                at[position] = Affine::constant((rest % size) as i64);
                rest /= size;
            }
            let (offset, _) = self.position_of(target.span, &steps, cx, &at)?;
            let v = VarId(first.0 + offset.as_constant().ok_or(Fail::NeedsExpansion)? as u32);
            if let Some(primitive) = &self.tree.instances[last].primitive {
                let wanted = primitive.scalar.clone();
                self.check_assignable(&wanted, &value, target.span, Section::Continuous, last)?;
            }
            let assigned = cx.assigned.get_or_insert_default();
            match assigned.iter_mut().find(|(known, _)| *known == v) {
                Some((_, slot)) => *slot = value,
                None => assigned.push((v, value)),
            }
        }
        Ok(())
    }

    /// `when` in an algorithm: the branch that fires runs, else all stays as it was.
    pub(crate) fn run_when(
        &mut self,
        span: Span,
        branches: &[(Expr, Vec<Statement>)],
        cx: &mut Context,
    ) -> Result<(), Fail> {
        let mut conditions = Vec::new();
        for (condition, _) in branches {
            match cx.whens.iter().find(|(span, _)| *span == condition.span) {
                Some((_, found)) => conditions.push(found.clone()),
                None => {
                    let message = "`when` is allowed only at the top of an algorithm section of a model";
                    return Err(self.error(Code::Misplaced, span, message));
                }
            }
        }
        let fires = self.fires(&conditions, cx)?;
        let before = cx.in_when;
        for (k, (condition, body)) in branches.iter().enumerate() {
            let mut yes = cx.clone();
            yes.in_when = true;
            let arena = &mut self.model.templates.arena;
            yes.holds = Some(cx.holds.map_or(fires[k], |holds| arena.and(holds, fires[k])));
            self.run(body, &mut yes)?;
            let no = cx.clone();
            self.join_contexts(condition.span, fires[k], yes, no, cx)?;
        }
        cx.in_when = before;
        Ok(())
    }

    /// `terminate(text)` in a `when` of an algorithm.
    pub(crate) fn run_terminate(&mut self, span: Span, arguments: &Arguments, cx: &mut Context) -> Result<(), Fail> {
        let text = match arguments {
            Arguments::List { positional, .. } if positional.len() == 1 => &positional[0],
            _ => return Err(self.error(Code::BadArguments, span, "`terminate` takes a text")),
        };
        let (message, values) = self.message(text, cx.scope, false);
        let values = self.message_values(message, &values, cx)?;
        let acts = cx.holds.unwrap_or_else(|| self.model.templates.arena.constant(1.0));
        let origin = Origin { path: self.path(cx.scope.inst), span };
        self.emit(Section::Terminate(message), acts, values, &cx.loop_counts(), &origin);
        Ok(())
    }

    /// `reinit(state, value)` in a `when` of an algorithm.
    pub(crate) fn run_reinit(&mut self, span: Span, arguments: &Arguments, cx: &mut Context) -> Result<(), Fail> {
        let (state, value) = match arguments {
            Arguments::List { positional, .. } if positional.len() == 2 => (&positional[0], &positional[1]),
            _ => return Err(self.error(Code::BadArguments, span, "`reinit` takes a state and its new value")),
        };
        let ExprKind::Ref(reference) = &state.kind else {
            return Err(self.error(Code::BadArguments, state.span, "`reinit` needs a variable"));
        };
        if self.no_state(reference, state.span, cx.scope) {
            return Err(Fail::Reported);
        }
        let shape = self.shape(state, cx)?;
        let acts = cx.holds.unwrap_or_else(|| self.model.templates.arena.constant(1.0));
        let origin = Origin { path: self.path(cx.scope.inst), span };
        let scalar = self.shape(value, cx)?.is_empty();
        for at in crate::if_equation::positions(&shape) {
            let target = self.lower_ref(reference, cx, &at)?;
            let new = self.lower(value, cx, if scalar { &[] } else { &at })?;
            self.want_number(value.span, "`reinit`", &new)?;
            let right = self.model.templates.arena.select(acts, new.node, target.node);
            self.emit(Section::Reinit, target.node, right, &cx.loop_counts(), &origin);
        }
        Ok(())
    }
}
