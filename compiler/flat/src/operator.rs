//! Operators with special meaning: `der`, `pre`, `edge`, `change`, `noEvent`, `semiLinear` (Modelica 3.6, sections 3.7.2 to 3.7.5).

use hyd_instance::{Builtin, Resolved, ScalarType};
use hyd_source::{Code, Span};
use hyd_symbolic::{Node, Relation};
use hyd_syntax::tree::{Expr, ExprKind};
use hyd_system::Variability;

use crate::context::{Context, Fail};
use crate::flatten::Flattener;
use crate::index::{Affine, Kind, SlotKey};
use crate::lower::Typed;
use crate::model::VarId;

impl Flattener<'_, '_> {
    pub(crate) fn without_events(&mut self, expr: &Expr, cx: &mut Context, index: &[Affine]) -> Result<Typed, Fail> {
        let before = std::mem::replace(&mut cx.no_event, true);
        let result = self.lower(expr, cx, index);
        cx.no_event = before;
        result
    }

    pub(crate) fn lower_der(
        &mut self,
        span: Span,
        list: &[Expr],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        self.expect_arguments(span, "der", list, 1)?;
        let ExprKind::Ref(reference) = &list[0].kind else {
            let always = std::mem::replace(&mut cx.may_add_variables, false);
            let result = self.lower_der_of_expression(&list[0], cx, index);
            cx.may_add_variables = always;
            return result;
        };
        match self.tree.resolve(cx.scope, reference)? {
            Resolved::Variable(steps) => {
                let last = steps[steps.len() - 1].0;
                if self.tree.instances[last].variability <= hyd_syntax::tree::Variability::Parameter {
                    return Ok(self.literal(0.0, ScalarType::Real));
                }
                self.lower_variable(span, &steps, Kind::Der, cx, index)
            }
            _ => Err(self.error(Code::BadArguments, span, "`der` needs a variable")),
        }
    }

    /// `der(expression)`: the chain rule over its variables.
    pub(crate) fn lower_der_of_expression(
        &mut self,
        expr: &Expr,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let value = self.lower(expr, cx, index)?;
        let mut rates = Vec::new();
        for slot in hyd_symbolic::slots(&self.model.templates.arena, &[value.node]) {
            let key = self.slots.keys[slot.0 as usize].clone();
            let rate = match key {
                SlotKey::Variable(Kind::Var, v, offset) if self.varies(v) => {
                    let rate = self.slots.slot(SlotKey::Variable(Kind::Der, v, offset));
                    self.model.templates.arena.slot(rate)
                }
                SlotKey::Variable(Kind::Der, v, offset) if self.varies(v) => {
                    let (rate, at) = self.rate_variable(expr.span, v, &offset, cx)?;
                    let rate = self.slots.slot(SlotKey::Variable(Kind::Der, rate, at));
                    self.model.templates.arena.slot(rate)
                }
                _ => self.model.templates.arena.constant(0.0),
            };
            rates.push((slot, rate));
        }
        let one = self.model.templates.arena.constant(1.0);
        let zero = self.model.templates.arena.constant(0.0);
        let seed = |leaf: Node| match leaf {
            Node::Time => Some(one),
            Node::Slot(slot) => Some(rates.iter().find(|(s, _)| *s == slot).map_or(zero, |(_, r)| *r)),
            _ => None,
        };
        Ok(Typed::real(hyd_symbolic::tangent(&mut self.model.templates.arena, value.node, seed)))
    }

    /// True for a continuous variable.
    pub(crate) fn varies(&self, v: VarId) -> bool {
        self.variable_of(v).variability == Variability::Continuous
    }

    pub(crate) fn lower_pre(
        &mut self,
        span: Span,
        list: &[Expr],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        self.expect_arguments(span, "pre", list, 1)?;
        let ExprKind::Ref(reference) = &list[0].kind else {
            return Err(self.error(Code::BadArguments, span, "`pre` needs a variable"));
        };
        match self.tree.resolve(cx.scope, reference)? {
            Resolved::Variable(steps) => {
                let last = steps[steps.len() - 1].0;
                let variability = self.tree.instances[last].variability;
                if variability <= hyd_syntax::tree::Variability::Parameter {
                    return self.lower_variable(span, &steps, Kind::Var, cx, index);
                }
                if variability == hyd_syntax::tree::Variability::Continuous && !cx.in_when {
                    let message = format!(
                        "`pre` of the continuous variable `{}` is allowed only inside `when`",
                        self.tree.instances[last].name
                    );
                    return Err(self.error(Code::Misplaced, span, message));
                }
                self.lower_variable(span, &steps, Kind::Pre, cx, index)
            }
            _ => Err(self.error(Code::BadArguments, span, "`pre` needs a variable")),
        }
    }

    /// `edge(b)` is `b and not pre(b)`, `change(v)` is `v <> pre(v)`.
    pub(crate) fn lower_edge(
        &mut self,
        span: Span,
        builtin: Builtin,
        list: &[Expr],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        self.expect_arguments(span, builtin.name(), list, 1)?;
        let now = self.lower(&list[0], cx, index)?;
        let before = self.lower_pre(span, list, cx, index)?;
        let arena = &mut self.model.templates.arena;
        if builtin == Builtin::Change {
            return Ok(Typed::boolean(arena.compare(Relation::NotEqual, now.node, before.node)));
        }
        let off = arena.not(before.node);
        let node = arena.and(now.node, off);
        self.want_boolean(list[0].span, "`edge`", &now)?;
        Ok(Typed::boolean(node))
    }

    /// `semiLinear(x, p, n)` is `smooth(0, if x >= 0 then p*x else n*x)`.
    pub(crate) fn lower_semi_linear(
        &mut self,
        span: Span,
        list: &[Expr],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        self.expect_arguments(span, "semiLinear", list, 3)?;
        let mut values = Vec::with_capacity(3);
        for argument in list {
            let scalar = self.shape(argument, cx)?.is_empty();
            let value = self.lower(argument, cx, if scalar { &[] } else { index })?;
            self.want_number(argument.span, "`semiLinear`", &value)?;
            values.push(value);
        }
        let [x, p, n] = values.as_slice() else { return Err(Fail::Reported) };
        let arena = &mut self.model.templates.arena;
        let zero = arena.constant(0.0);
        let test = arena.compare(Relation::GreaterEqual, x.node, zero);
        let (up, down) = (arena.mul(p.node, x.node), arena.mul(n.node, x.node));
        Ok(Typed::real(arena.select(test, up, down)))
    }
}
