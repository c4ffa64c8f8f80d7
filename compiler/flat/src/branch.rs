//! `if` expressions: branches chosen at translation where the condition is known there, else a choice at run time.
//!
//! A condition on loop variables chooses its branch for each value of the loop (Modelica 3.6, section 3.6.5, evaluates
//! only the branch taken), so the other one may have subscripts out of range.  Branches are not always evaluated, so
//! nothing in them becomes an equation of its own.

use hyd_instance::{Resolved, ScalarType, Scope, Value};
use hyd_source::{Code, Span};
use hyd_symbolic::NodeId;
use hyd_syntax::tree::{ComponentRef, Expr, ExprKind, Variability};

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::index::Affine;
use crate::lower::Typed;

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
        match self.loop_condition(condition, cx)? {
            Some(true) => return Ok(Test::Always),
            Some(false) => return Ok(Test::Never),
            None => {}
        }
        let test = self.lower(condition, cx, &[])?;
        self.want_boolean(condition.span, "a condition", &test)?;
        // In a function a condition known here decides: the other side may never end.
        let known = if cx.depth > 0 { self.model.templates.arena.as_constant(test.node) } else { None };
        Ok(match known {
            Some(0.0) => Test::Never,
            Some(_) => Test::Always,
            None => Test::Run(test.node),
        })
    }

    /// Lowers what is reached only where `test` is true.
    pub(crate) fn where_holds<T>(
        &mut self,
        test: NodeId,
        cx: &mut Context,
        lower: impl FnOnce(&mut Self, &mut Context) -> T,
    ) -> T {
        let around = cx.holds;
        let arena = &mut self.model.templates.arena;
        cx.holds = Some(around.map_or(test, |outer| arena.and(outer, test)));
        let result = lower(self, cx);
        cx.holds = around;
        result
    }

    /// Truth of a condition on loop variables and Integer parameters alone (`i > 1`, `j == i`, `i < N`), so that the
    /// branch not taken may have subscripts out of range; none for other conditions.  A condition of literals alone is decided, too,
    /// and where loops were written out because of an array made in parts, literals stand where their variables stood.
    fn loop_condition(&mut self, condition: &Expr, cx: &mut Context) -> Result<Option<bool>, Fail> {
        let (mut loops, mut others) = (is_of_literals(condition) || self.tree.has_parts(), false);
        if !is_arithmetic(condition) {
            loops = false;
        }
        crate::walk::any_ref(condition, &mut |reference| {
            let name = &reference.parts[0].name.name;
            match (reference.parts.len(), cx.local(name)) {
                (1, Some(Local::Index(_) | Local::Value(_))) => loops = true,
                (_, Some(_)) => others = true,
                (_, None) => others |= !self.is_integer_parameter(reference, cx.scope),
            }
            others
        });
        if !loops || others || cx.depth > 0 {
            return Ok(None);
        }
        let (env, complete) = cx.env();
        if !complete {
            return self.truth_over_loops(condition, cx).map(Some);
        }
        match self.tree.evaluate(condition, cx.scope, &env)? {
            Value::Boolean(truth) => Ok(Some(truth)),
            _ => Ok(None),
        }
    }

    fn is_integer_parameter(&mut self, reference: &ComponentRef, scope: Scope) -> bool {
        let Ok(Resolved::Variable(steps)) = self.tree.resolve(scope, reference) else { return false };
        let last = &self.tree.instances[steps[steps.len() - 1].0];
        let integer = last.primitive.as_ref().is_some_and(|primitive| primitive.scalar == ScalarType::Integer);
        integer && last.variability <= Variability::Parameter
    }

    /// `if test then chosen else other`, whose types must agree.
    pub(crate) fn choose(&mut self, span: Span, test: NodeId, chosen: Typed, other: Typed) -> Result<Typed, Fail> {
        let scalar = if chosen.scalar == other.scalar {
            chosen.scalar.clone()
        } else if chosen.is_number() && other.is_number() {
            ScalarType::Real
        } else {
            let message =
                format!("the branches have different types, {} and {}", chosen.scalar.name(), other.scalar.name());
            return Err(self.error(Code::TypeMismatch, span, message));
        };
        let node = self.model.templates.arena.select(test, chosen.node, other.node);
        Ok(Typed { node, scalar })
    }
}

/// True for relations and arithmetic of numbers, Booleans and names, without calls or choices.
fn is_arithmetic(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Integer(_) | ExprKind::Real(_) | ExprKind::Boolean(_) | ExprKind::Ref(_) => true,
        ExprKind::Unary(_, a) => is_arithmetic(a),
        ExprKind::Binary(_, a, b) => is_arithmetic(a) && is_arithmetic(b),
        ExprKind::Tuple(items) => matches!(items.as_slice(), [Some(only)] if is_arithmetic(only)),
        _ => false,
    }
}

/// True for arithmetic that names nothing.
fn is_of_literals(expr: &Expr) -> bool {
    is_arithmetic(expr) && !crate::walk::any_ref(expr, &mut |_| true)
}
