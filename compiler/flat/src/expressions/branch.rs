//! `if` expressions: branches chosen at translation where the condition is known there, else a choice at run time.
//!
//! A condition on loop variables chooses its branch for each value of the loop (Modelica 3.6, section 3.6.5, evaluates
//! only the branch taken), so the other one may have subscripts out of range.  Branches are not always evaluated, so
//! nothing in them becomes an equation of its own.

use hyd_instance::{Env, ScalarType, Value};
use hyd_source::Span;
use hyd_symbolic::{NodeId, SlotId, Step};
use hyd_syntax::tree::Variability;
use hyd_typed::{Expr, Kind, Variable};

use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::index::Affine;
use crate::state::node::Typed;
use crate::state::steps::DEEPEST;

/// When a branch is taken.
pub(crate) enum Test {
    /// Known before the run: it is.
    Always,
    /// Known before the run: it is not.
    Never,
    /// The run decides.
    Run(NodeId),
}

impl Flattener<'_, '_> {
    /// The element of an `if` expression.
    pub(crate) fn lower_if(
        &mut self,
        span: Span,
        branches: &[(Expr, Expr)],
        otherwise: &Expr,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        if !index.is_empty()
            && let Some(chosen) = self.branch_by_sizes(branches, otherwise, cx)?
        {
            return self.lower(chosen, cx, index);
        }
        let always = std::mem::replace(&mut cx.may_add_variables, false);
        let result = self.lower_branches(span, branches, otherwise, cx, index);
        cx.may_add_variables = always;
        result
    }

    /// A loop over the branches: a table of many thousands of them is no deeper for the machine than one of two.
    fn lower_branches(
        &mut self,
        span: Span,
        branches: &[(Expr, Expr)],
        otherwise: &Expr,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let called = cx.called.clone();
        let around = cx.holds;
        let mut tried: Vec<(NodeId, Result<Typed, Fail>)> = Vec::new();
        let mut last = None;
        for (k, (condition, value)) in branches.iter().enumerate() {
            let test = match self.branch_test(condition, cx) {
                Ok(Test::Always) => Ok(None),
                Ok(Test::Never) => continue,
                Ok(Test::Run(test)) => Ok(Some(test)),
                Err(fail) => Err(fail),
            };
            match test {
                Ok(None) => {
                    last = Some(self.lower(value, cx, index));
                    break;
                }
                Ok(Some(test)) if self.in_body(cx) => {
                    last = Some(self.build_choice(span, test, value, (&branches[k + 1..], otherwise), cx, index));
                    break;
                }
                Ok(Some(test)) => {
                    cx.depends_on_run();
                    let chosen = self.where_holds(test, cx, |flat, cx| flat.lower(value, cx, index));
                    tried.push((test, chosen));
                    // What follows is reached only where this branch is not taken.
                    let arena = &mut self.model.templates.arena;
                    let not = arena.not(test);
                    cx.holds = Some(cx.holds.map_or(not, |outer| arena.and(outer, not)));
                }
                Err(fail) => {
                    last = Some(Err(fail));
                    break;
                }
            }
        }
        let last = last.unwrap_or_else(|| self.lower(otherwise, cx, index));
        cx.holds = around;
        cx.called = called;
        if let Some((_, Err(fail))) = tried.iter().find(|(_, chosen)| chosen.is_err()) {
            return Err(*fail);
        }
        let mut result = last?;
        for (test, chosen) in tried.into_iter().rev() {
            result = self.choose(span, test, chosen?, result)?;
        }
        Ok(result)
    }

    /// When a branch is taken.
    pub(crate) fn branch_test(&mut self, condition: &Expr, cx: &mut Context) -> Result<Test, Fail> {
        let known = match self.evaluated_condition(condition, cx)? {
            None => self.loop_condition(condition, cx)?,
            known => known,
        };
        match known {
            Some(true) => return Ok(Test::Always),
            Some(false) => return Ok(Test::Never),
            None => {}
        }
        let test = self.lower(condition, cx, &[])?;
        self.want_boolean(condition.span, "a condition", &test)?;
        // A condition known here decides: the other side may never end, or name elements that do not exist.
        Ok(match self.model.templates.arena.as_constant(test.node) {
            Some(0.0) => Test::Never,
            Some(_) => Test::Always,
            None => Test::Run(test.node),
        })
    }

    /// Truth of a condition on constants and on parameters with `annotation(Evaluate = true)` alone.
    fn evaluated_condition(&mut self, condition: &Expr, cx: &mut Context) -> Result<Option<bool>, Fail> {
        if cx.depth > 0 || !is_arithmetic(condition) || hyd_typed::any_local(condition, &mut |_| true) {
            return Ok(None);
        }
        let (mut some, mut others) = (false, false);
        hyd_typed::any_variable(condition, &mut |variable| {
            let variability = self.scopes.variability(variable.last());
            let evaluate = self.scopes.instances[variable.last()].evaluate;
            some |= evaluate;
            others |= !(variability == Variability::Constant || evaluate && variability == Variability::Parameter);
            others
        });
        if !some || others || hyd_typed::any(condition, &mut |part| matches!(part.kind, Kind::Time)) {
            return Ok(None);
        }
        match self.scopes.evaluate(&condition.evaluable(), cx.scope, &Env::default())? {
            Value::Boolean(truth) => Ok(Some(truth)),
            _ => Ok(None),
        }
    }

    /// Truth of a condition on loop variables and Integer parameters alone (`i > 1`, `j == i`, `i < N`), so that the
    /// branch not taken may have subscripts out of range; none for other conditions.  A condition of literals alone is decided, too,
    /// and where loops were written out because of an array made in parts, literals stand where their variables stood.
    fn loop_condition(&mut self, condition: &Expr, cx: &mut Context) -> Result<Option<bool>, Fail> {
        let (mut loops, mut others) = (is_of_literals(condition) || self.scopes.has_parts(), false);
        if !is_arithmetic(condition) {
            loops = false;
        }
        hyd_typed::any_local(condition, &mut |name| {
            match (name.parts.len(), cx.local(name.name())) {
                (1, Some(Local::Index(_) | Local::Value(_))) => loops = true,
                _ => others = true,
            }
            others
        });
        others |= hyd_typed::any_variable(condition, &mut |variable| !self.is_integer_parameter(variable));
        others |= hyd_typed::any(condition, &mut |part| {
            matches!(part.kind, Kind::Time | Kind::Literal(..) | Kind::Class(..))
        });
        if !loops || others || cx.depth > 0 {
            return Ok(None);
        }
        let (env, complete) = cx.env();
        if !complete {
            return self.truth_over_loops(condition, cx).map(Some);
        }
        match self.scopes.evaluate(&condition.evaluable(), cx.scope, &env)? {
            Value::Boolean(truth) => Ok(Some(truth)),
            _ => Ok(None),
        }
    }

    fn is_integer_parameter(&self, variable: &Variable) -> bool {
        let last = &self.scopes.instances[variable.last()];
        let integer = last.primitive.as_ref().is_some_and(|primitive| primitive.scalar == ScalarType::Integer);
        integer && self.scopes.variability(variable.last()) <= Variability::Parameter
    }

    /// `if test then value else ...` as an expression: only the side taken is computed.
    pub(crate) fn build_choice(
        &mut self,
        span: Span,
        test: NodeId,
        value: &Expr,
        (rest, otherwise): (&[(Expr, Expr)], &Expr),
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        if rest.len() > DEEPEST {
            return self.build_flat_choice(span, (test, value), (rest, otherwise), cx, index);
        }
        let (mut yes, a) = self.block(|flat| flat.lower(value, cx, index))?;
        let (mut no, b) = self.block(|flat| flat.lower_if(span, rest, otherwise, cx, index))?;
        let joined = self.choose(span, test, a.clone(), b.clone())?;
        if yes.is_empty() && no.is_empty() {
            return Ok(joined);
        }
        let register = self.registers(1).start;
        yes.push(Step::Set(register, a.node));
        no.push(Step::Set(register, b.node));
        self.step(Step::If(test, yes, no));
        Ok(Typed { node: self.model.templates.arena.slot(SlotId(register)), scalar: joined.scalar })
    }

    /// The same for many branches, one after the other as in [`Self::build_flat_if`].
    pub(crate) fn build_flat_choice(
        &mut self,
        span: Span,
        (test, value): (NodeId, &Expr),
        (rest, otherwise): (&[(Expr, Expr)], &Expr),
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let (result, taken) = (self.registers(1).start, self.open_flag());
        let node = self.model.templates.arena.slot(SlotId(result));
        let (mut yes, first) = self.block(|flat| flat.lower(value, cx, index))?;
        yes.extend([Step::Set(result, first.node), self.take(taken)]);
        self.step(Step::If(test, yes, Vec::new()));
        let mut joined = Typed { node, scalar: first.scalar };
        let branches = rest.iter().map(|(condition, value)| (Some(condition), value));
        for (condition, value) in branches.chain([(None, otherwise)]) {
            let (steps, (always, scalar)) = self.block(|flat| {
                let test = match condition {
                    None => Test::Always,
                    Some(condition) => flat.branch_test(condition, cx)?,
                };
                let test = match test {
                    Test::Never => return Ok((false, None)),
                    Test::Always => None,
                    Test::Run(test) => Some(test),
                };
                let (mut yes, value) = flat.block(|flat| flat.lower(value, cx, index))?;
                yes.extend([Step::Set(result, value.node), flat.take(taken)]);
                match test {
                    Some(test) => flat.step(Step::If(test, yes, Vec::new())),
                    None => yes.into_iter().for_each(|step| flat.step(step)),
                }
                Ok((test.is_none(), Some(value.scalar)))
            })?;
            self.step_unless(taken, steps);
            if let Some(scalar) = scalar {
                joined = Typed { node, ..self.choose(span, test, joined, Typed { node, scalar })? };
            }
            if always {
                break;
            }
        }
        Ok(joined)
    }

    /// `a and b`, `a or b`: the second is computed only where it matters.
    pub(crate) fn build_logic(
        &mut self,
        both: bool,
        a: &Expr,
        b: &Expr,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let x = self.lower(a, cx, index)?;
        self.want_boolean(a.span, "a logical operator", &x)?;
        let (mut steps, y) = self.block(|flat| flat.lower(b, cx, index))?;
        self.want_boolean(b.span, "a logical operator", &y)?;
        let arena = &mut self.model.templates.arena;
        if steps.is_empty() {
            return Ok(Typed::boolean(if both { arena.and(x.node, y.node) } else { arena.or(x.node, y.node) }));
        }
        let decided = arena.constant(if both { 0.0 } else { 1.0 });
        let register = self.registers(1).start;
        steps.push(Step::Set(register, y.node));
        let other = vec![Step::Set(register, decided)];
        let step = if both { Step::If(x.node, steps, other) } else { Step::If(x.node, other, steps) };
        self.step(step);
        Ok(Typed::boolean(self.model.templates.arena.slot(SlotId(register))))
    }
}

/// True for relations and arithmetic of numbers, Booleans and names, without calls or choices.
fn is_arithmetic(expr: &Expr) -> bool {
    match &expr.kind {
        Kind::Integer(_) | Kind::Real(_) | Kind::Boolean(_) | Kind::Variable(_) | Kind::Local(_) | Kind::Time => true,
        Kind::Literal(..) | Kind::Values(..) | Kind::Class(..) => true,
        Kind::Unary(_, a) => is_arithmetic(a),
        Kind::Binary(_, a, b) => is_arithmetic(a) && is_arithmetic(b),
        Kind::Tuple(items) => matches!(items.as_slice(), [Some(only)] if is_arithmetic(only)),
        _ => false,
    }
}

/// True for arithmetic that names nothing.
fn is_of_literals(expr: &Expr) -> bool {
    let names = |part: &Expr| {
        matches!(
            part.kind,
            Kind::Variable(_) | Kind::Local(_) | Kind::Time | Kind::Literal(..) | Kind::Values(..) | Kind::Class(..)
        )
    };
    is_arithmetic(expr) && !hyd_typed::any(expr, &mut |part| names(part))
}
