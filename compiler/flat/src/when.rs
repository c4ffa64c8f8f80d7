//! `when` equations: conditions become discrete Booleans, assignments become equations that hold at events.
//!
//! `when c then v = e; end when` is `b = c; v = if b and not pre(b) and not initial() then e else pre(v)`; `elsewhen`
//! branches fire only if none before does (Modelica 3.6, section 8.3.5).  At the start only conditions that name
//! `initial()` fire.

use hyd_instance::{Resolved, Scope};
use hyd_source::{Code, Diagnostic, Origin, Span};
use hyd_symbolic::{Node, NodeId};
use hyd_syntax::tree::{Arguments, ComponentRef, Equation, EquationKind, Expr, ExprKind, Variability};

use crate::context::{Context, Fail};
use crate::flatten::Flattener;
use crate::index::{Affine, Kind, SlotKey};
use crate::lower::Typed;
use crate::model::{Section, VarId};
use crate::section::Loops;

/// One condition of a branch.
#[derive(Clone, Debug)]
pub enum WhenCondition {
    /// `initial()`
    Initial,
    /// A discrete Boolean, one per element of the loops.
    Variable(VarId),
}

/// A variable set in one or several branches.
struct Target<'e> {
    reference: &'e ComponentRef,
    /// Per branch: the expression, if the branch sets the variable, and which output of a call it takes.
    values: Vec<Option<(&'e Expr, Option<usize>)>>,
    span: Span,
}

impl Flattener<'_, '_> {
    pub(crate) fn when(
        &mut self,
        equation: &Equation,
        branches: &[(Expr, Vec<Equation>)],
        scope: Scope,
        loops: &Loops<'_>,
    ) {
        self.whens += 1;
        let number = self.whens;
        let mut conditions: Vec<Vec<WhenCondition>> = Vec::new();
        for (k, (condition, _)) in branches.iter().enumerate() {
            match self.conditions(condition, number, k, scope, loops) {
                Some(found) => conditions.push(found),
                None => return,
            }
        }
        let origin = Origin { path: self.path(scope.inst), span: equation.span };
        for (k, (_, body)) in branches.iter().enumerate() {
            for inner in body {
                self.when_action(inner, k, &conditions, scope, loops);
            }
        }
        for target in self.when_targets(branches) {
            self.when_assignment(&target, &conditions, &origin, scope, loops);
        }
    }

    /// The conditions of one branch as discrete Booleans (`{a, b}` gives two).
    pub(crate) fn conditions(
        &mut self,
        expr: &Expr,
        number: u32,
        branch: usize,
        scope: Scope,
        loops: &Loops<'_>,
    ) -> Option<Vec<WhenCondition>> {
        let parts: Vec<&Expr> = match &expr.kind {
            ExprKind::Array(items) => items.iter().collect(),
            _ => vec![expr],
        };
        let mut result = Vec::new();
        for (k, part) in parts.into_iter().enumerate() {
            if let ExprKind::Call(function, _) = &part.kind
                && function.parts.len() == 1
                && function.parts[0].name.name.as_ref() == "initial"
            {
                result.push(WhenCondition::Initial);
                continue;
            }
            result.push(WhenCondition::Variable(self.condition_variable(part, number, (branch, k), scope, loops)?));
        }
        Some(result)
    }

    /// `$when1.1.1 = condition`, one per element of the loops around.
    fn condition_variable(
        &mut self,
        expr: &Expr,
        number: u32,
        part: (usize, usize),
        scope: Scope,
        loops: &Loops<'_>,
    ) -> Option<VarId> {
        let origin = Origin { path: self.path(scope.inst), span: expr.span };
        let mut probe = self.context_of(scope);
        // The loops decide how many conditions there are; their sizes do not depend on counters.
        let sizes = match self.enter_all(&mut probe, loops) {
            Ok(()) => probe.counts.clone(),
            Err(_) => {
                let message =
                    "the loops around a `when` must have ranges that are known and do not depend on each other";
                let _ = self.error(Code::NotStructural, expr.span, message);
                return None;
            }
        };
        let name = format!("$when{number}.{}.{}", part.0 + 1, part.1 + 1);
        let first = self.internal_boolean(name, &sizes, origin.clone());
        let start = self.context_of(scope);
        let before = self.tree.table.diagnostics.len();
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            let value = flat.lower(expr, cx, &[])?;
            flat.want_boolean(expr.span, "the condition of a `when`", &value)?;
            let left = flat.condition_slot(first, cx, Kind::Var)?;
            flat.emit(Section::Discrete, left, value.node, &cx.loop_counts(), &origin);
            Ok(())
        });
        (self.tree.table.diagnostics.len() == before).then_some(first)
    }

    fn condition_slot(&mut self, first: VarId, cx: &Context, kind: Kind) -> Result<NodeId, Fail> {
        let mut offset = Affine::constant(0);
        for (k, &size) in cx.counts.iter().enumerate() {
            let at = match &cx.fixed {
                Some(values) if k < values.len() => Affine::constant(values[k]),
                _ => Affine::counter(crate::index::CounterId(k as u32)),
            };
            offset = crate::flatten::scale(&offset, size).add_scaled(&at, 1).ok_or(Fail::NeedsExpansion)?;
        }
        let slot = self.slots.slot(SlotKey::Variable(kind, first, offset));
        Ok(self.model.templates.arena.slot(slot))
    }

    /// When each branch fires.
    pub(crate) fn fires(&mut self, conditions: &[Vec<WhenCondition>], cx: &Context) -> Result<Vec<NodeId>, Fail> {
        let mut result: Vec<NodeId> = Vec::new();
        let mut earlier: Option<NodeId> = None;
        for branch in conditions {
            let mut own: Option<NodeId> = None;
            for condition in branch {
                let edge = match condition {
                    WhenCondition::Initial => self.model.templates.arena.intern(Node::Initial),
                    WhenCondition::Variable(first) => {
                        let now = self.condition_slot(*first, cx, Kind::Var)?;
                        let before = self.condition_slot(*first, cx, Kind::Pre)?;
                        let arena = &mut self.model.templates.arena;
                        let off = arena.not(before);
                        let rises = arena.and(now, off);
                        let initial = arena.intern(Node::Initial);
                        let running = arena.not(initial);
                        arena.and(rises, running)
                    }
                };
                let arena = &mut self.model.templates.arena;
                own = Some(own.map_or(edge, |o| arena.or(o, edge)));
            }
            let arena = &mut self.model.templates.arena;
            let own = own.unwrap_or_else(|| arena.constant(0.0));
            let fires = match earlier {
                None => own,
                Some(before) => {
                    let none = arena.not(before);
                    arena.and(own, none)
                }
            };
            earlier = Some(earlier.map_or(own, |e| arena.or(e, own)));
            result.push(fires);
        }
        Ok(result)
    }

    /// `reinit`, `assert`, `terminate` of a branch; other equations are gathered by `when_targets`.
    fn when_action(
        &mut self,
        equation: &Equation,
        branch: usize,
        conditions: &[Vec<WhenCondition>],
        scope: Scope,
        loops: &Loops<'_>,
    ) {
        let EquationKind::Call(function, arguments) = &equation.kind else { return };
        let name = function.parts[0].name.name.clone();
        let Arguments::List { positional, .. } = arguments else { return };
        match (name.as_ref(), positional.as_slice()) {
            ("reinit", [state, value]) => self.reinit(equation, state, value, branch, conditions, scope, loops),
            ("terminate", [text]) => {
                let (message, values) = self.message(text, scope, false);
                let origin = Origin { path: self.path(scope.inst), span: equation.span };
                let start = Context { in_when: true, ..self.context_of(scope) };
                self.with_loops(start, &mut |flat, cx| {
                    flat.enter_all(cx, loops)?;
                    let fires = flat.fires(conditions, cx)?;
                    let values = flat.message_values(message, &values, cx)?;
                    flat.emit(Section::Terminate(message), fires[branch], values, &cx.loop_counts(), &origin);
                    Ok(())
                });
            }
            ("assert", [condition, text, ..]) => {
                let (message, values) = self.message(text, scope, true);
                let origin = Origin { path: self.path(scope.inst), span: equation.span };
                let start = Context { in_when: true, ..self.context_of(scope) };
                self.with_loops(start, &mut |flat, cx| {
                    flat.enter_all(cx, loops)?;
                    let fires = flat.fires(conditions, cx)?;
                    let test = flat.lower(condition, cx, &[])?;
                    flat.want_boolean(condition.span, "`assert`", &test)?;
                    let arena = &mut flat.model.templates.arena;
                    let idle = arena.not(fires[branch]);
                    let holds = arena.or(idle, test.node);
                    let values = flat.message_values(message, &values, cx)?;
                    flat.emit(Section::Assert(message), holds, values, &cx.loop_counts(), &origin);
                    Ok(())
                });
            }
            ("reinit", _) => {
                let _ = self.error(Code::BadArguments, equation.span, "`reinit` takes a state and its new value");
            }
            _ => {
                let message = format!("`{name}` is not allowed inside `when`");
                let _ = self.error(Code::Misplaced, equation.span, message);
            }
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn reinit(
        &mut self,
        equation: &Equation,
        state: &Expr,
        value: &Expr,
        branch: usize,
        conditions: &[Vec<WhenCondition>],
        scope: Scope,
        loops: &Loops<'_>,
    ) {
        let ExprKind::Ref(reference) = &state.kind else {
            let _ = self.error(Code::BadArguments, state.span, "`reinit` needs a variable");
            return;
        };
        if let Ok(Resolved::Variable(steps)) = self.tree.resolve(scope, reference) {
            let instance = &self.tree.instances[steps[steps.len() - 1].0];
            let (variability, declared) = (instance.variability, instance.span);
            if variability != Variability::Continuous {
                let parameter = variability <= Variability::Parameter;
                let why = if parameter { "is constant" } else { "has no derivative" };
                let message = format!("`reinit` needs a state, and `{}` {why}", print_ref(reference));
                self.report(
                    Diagnostic::error(Code::Misplaced, message).at(state.span, "").with(declared, "declared here"),
                );
                return;
            }
        }
        let origin = Origin { path: self.path(scope.inst), span: equation.span };
        let start = Context { in_when: true, ..self.context_of(scope) };
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            let shape = flat.shape(state, cx)?;
            let index: Vec<Affine> = shape.iter().map(|&size| cx.counter(size)).collect();
            let target = flat.lower_ref(reference, cx, &index)?;
            let rank = flat.shape(value, cx)?.len();
            let new = flat.lower(value, cx, if rank == 0 { &[] } else { &index })?;
            flat.want_number(value.span, "`reinit`", &new)?;
            // The conditions know the loops, not the elements of an array state.
            let mut outer = cx.clone();
            outer.counts.truncate(cx.counts.len() - shape.len());
            let fires = flat.fires(conditions, &outer)?;
            let right = flat.model.templates.arena.select(fires[branch], new.node, target.node);
            flat.emit(Section::Reinit, target.node, right, &cx.loop_counts(), &origin);
            Ok(())
        });
    }

    /// The variables set by `v = e` in the branches.
    fn when_targets<'e>(&mut self, branches: &'e [(Expr, Vec<Equation>)]) -> Vec<Target<'e>> {
        let mut targets: Vec<Target<'e>> = Vec::new();
        for (k, (_, body)) in branches.iter().enumerate() {
            for equation in body {
                match &equation.kind {
                    EquationKind::Equal(left, right) => {
                        let parts: Vec<(&Expr, Option<usize>)> = match &left.kind {
                            ExprKind::Tuple(items) => {
                                let several = items.len() > 1;
                                let part =
                                    |(n, e): (usize, &'e Option<Expr>)| Some((e.as_ref()?, several.then_some(n)));
                                items.iter().enumerate().filter_map(part).collect()
                            }
                            _ => vec![(left, None)],
                        };
                        for (part, output) in parts {
                            self.when_target(part, (right, output), (k, branches.len()), equation.span, &mut targets);
                        }
                    }
                    EquationKind::Call(..) => {}
                    _ => {
                        let message =
                            "inside `when` only `v = expression`, `reinit`, `assert` and `terminate` are supported";
                        let _ = self.error(Code::OutsideProfile, equation.span, message);
                    }
                }
            }
        }
        targets
    }

    /// Notes that branch `k` of `count` sets `left`.
    fn when_target<'e>(
        &mut self,
        left: &'e Expr,
        value: (&'e Expr, Option<usize>),
        (k, count): (usize, usize),
        span: Span,
        targets: &mut Vec<Target<'e>>,
    ) {
        let ExprKind::Ref(reference) = &left.kind else {
            let message = "inside `when` the left side must be a variable";
            let _ = self.error(Code::Misplaced, left.span, message);
            return;
        };
        let text = hyd_syntax::print_expr(left);
        match targets.iter_mut().find(|t| print_ref(t.reference) == text) {
            Some(target) => target.values[k] = Some(value),
            None => {
                let mut values = vec![None; count];
                values[k] = Some(value);
                targets.push(Target { reference, values, span });
            }
        }
    }

    /// The value a branch gives: an expression or one of several outputs of a call.
    fn when_value(
        &mut self,
        (expr, output): (&Expr, Option<usize>),
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let Some(n) = output else {
            let rank = self.shape(expr, cx)?.len();
            return self.lower(expr, cx, if rank == 0 { &[] } else { index });
        };
        let ExprKind::Call(function, arguments) = &expr.kind else {
            return Err(self.error(Code::TypeMismatch, expr.span, "several results come only from a function"));
        };
        let outputs = self.call_outputs(expr.span, function, arguments, cx)?;
        match outputs.get(n) {
            Some((_, value)) => self.element_of_local(expr.span, value, index),
            None => {
                let message = format!("the function gives {} values, but {} are taken", outputs.len(), n + 1);
                Err(self.error(Code::BadArguments, expr.span, message))
            }
        }
    }

    fn when_assignment(
        &mut self,
        target: &Target<'_>,
        conditions: &[Vec<WhenCondition>],
        origin: &Origin,
        scope: Scope,
        loops: &Loops<'_>,
    ) {
        if let Ok(Resolved::Variable(steps)) = self.tree.resolve(scope, target.reference) {
            let whole = steps.iter().all(|(_, subscripts)| subscripts.is_empty());
            if whole && self.set_before(steps[steps.len() - 1].0, target) {
                return;
            }
            self.make_discrete(steps[steps.len() - 1].0);
        }
        let origin = Origin { span: target.span, ..origin.clone() };
        let start = Context { in_when: true, ..self.context_of(scope) };
        let left_expr = Expr { kind: ExprKind::Ref(target.reference.clone()), span: target.reference.span };
        self.with_loops(start, &mut |flat, cx| {
            flat.enter_all(cx, loops)?;
            let fires = flat.fires(conditions, cx)?;
            let shape = flat.shape(&left_expr, cx)?;
            let index: Vec<Affine> = shape.iter().map(|&size| cx.counter(size)).collect();
            let left = flat.lower_ref(target.reference, cx, &index)?;
            let hyd_symbolic::Node::Slot(slot) = flat.model.templates.arena.node(left.node) else {
                return Err(flat.error(Code::Misplaced, target.span, "only variables can be set inside `when`"));
            };
            let SlotKey::Variable(_, first, offset) = flat.slots.keys[slot.0 as usize].clone() else {
                return Err(Fail::Reported);
            };
            let pre = flat.slots.slot(SlotKey::Variable(Kind::Pre, first, offset));
            let mut right = flat.model.templates.arena.slot(pre);
            for (k, value) in target.values.iter().enumerate().rev() {
                let Some((expr, output)) = *value else { continue };
                let value = flat.when_value((expr, output), cx, &index)?;
                let fits = value.scalar == left.scalar
                    || value.is_number() && matches!(left.scalar, hyd_instance::ScalarType::Real);
                if !fits {
                    let message = format!(
                        "`{}` is {}, but the value is {}",
                        print_ref(target.reference),
                        left.scalar.name(),
                        value.scalar.name()
                    );
                    return Err(flat.error(Code::TypeMismatch, expr.span, message));
                }
                right = flat.model.templates.arena.select(fires[k], value.node, right);
            }
            flat.emit(Section::Discrete, left.node, right, &cx.loop_counts(), &origin);
            Ok(())
        });
    }

    /// Only one `when` may set a variable: reports the second.
    fn set_before(&mut self, inst: hyd_instance::InstId, target: &Target<'_>) -> bool {
        let Some(first) = self.set_in_when.insert(inst, target.span) else { return false };
        let message = format!("`{}` is set by two `when` equations", print_ref(target.reference));
        self.report(
            Diagnostic::error(Code::Unbalanced, message)
                .at(target.span, "second time")
                .with(first, "first time")
                .help("one `when` with `elsewhen` says which comes first"),
        );
        true
    }

    /// A Real variable set inside `when` changes at events only.
    pub(crate) fn make_discrete(&mut self, inst: hyd_instance::InstId) {
        if let Some(&block) = self.blocks.get(&inst)
            && self.model.variables[block].variability == hyd_system::Variability::Continuous
        {
            self.model.variables[block].variability = hyd_system::Variability::Discrete;
            self.tree.instances[inst].variability = Variability::Discrete;
        }
    }
}

fn print_ref(reference: &ComponentRef) -> String {
    hyd_syntax::print_expr(&Expr { kind: ExprKind::Ref(reference.clone()), span: reference.span })
}
