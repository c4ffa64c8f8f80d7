//! Operators with special meaning: `der`, `pre`, `edge`, `change`, `noEvent`, `semiLinear` (Modelica 3.6, sections 3.7.2 to 3.7.5).

use hyd_instance::{Builtin, ScalarType};
use hyd_source::{Code, Span};
use hyd_symbolic::{Node, Relation};
use hyd_typed::Kind as Form;

use crate::expressions::builtin_call::BuiltinCall;
use crate::state::context::Fail;
use crate::state::index::{Affine, Kind, SlotKey};
use crate::state::node::Typed;

impl BuiltinCall<'_, '_, '_> {
    pub(crate) fn without_events(&mut self, k: usize, index: &[Affine]) -> Result<Typed, Fail> {
        let before = std::mem::replace(&mut self.cx.no_event, true);
        let result = self.flat.lower(&self.list[k], self.cx, index);
        self.cx.no_event = before;
        result
    }

    pub(crate) fn lower_der(&mut self, index: &[Affine]) -> Result<Typed, Fail> {
        let (span, list) = (self.span, self.list);
        self.expect_arguments("der", 1)?;
        match &list[0].kind {
            Form::Variable(variable) => {
                if self.flat.scopes.variability(variable.last()) <= hyd_syntax::tree::Variability::Parameter {
                    return Ok(self.flat.literal(0.0, ScalarType::Real));
                }
                self.flat.lower_variable(span, &variable.steps, Kind::Der, self.cx, index)
            }
            Form::Time | Form::Literal(..) | Form::Values(..) | Form::Class(..) | Form::Local(_) => {
                Err(self.flat.error(Code::BadArguments, span, "`der` needs a variable"))
            }
            _ => {
                let always = std::mem::replace(&mut self.cx.may_add_variables, false);
                let value = self.flat.lower(&list[0], self.cx, index);
                self.cx.may_add_variables = always;
                self.rate_of_value(list[0].span, &value?)
            }
        }
    }

    /// `der(expression)`: the chain rule over its variables.
    pub(crate) fn rate_of_value(&mut self, span: Span, value: &Typed) -> Result<Typed, Fail> {
        let mut rates = Vec::new();
        for slot in hyd_symbolic::slots(&self.flat.model.templates.arena, &[value.node]) {
            let key = self.flat.slots.keys[slot.0 as usize].clone();
            let rate = match key {
                SlotKey::Variable(Kind::Var, v, offset) if self.flat.varies(v) => {
                    let rate = self.flat.slots.slot(SlotKey::Variable(Kind::Der, v, offset));
                    self.flat.model.templates.arena.slot(rate)
                }
                SlotKey::Variable(Kind::Der, v, offset) if self.flat.varies(v) => {
                    let (rate, at) = self.flat.rate_variable(span, v, &offset, self.cx)?;
                    let rate = self.flat.slots.slot(SlotKey::Variable(Kind::Der, rate, at));
                    self.flat.model.templates.arena.slot(rate)
                }
                _ => self.flat.model.templates.arena.constant(0.0),
            };
            rates.push((slot, rate));
        }
        let one = self.flat.model.templates.arena.constant(1.0);
        let zero = self.flat.model.templates.arena.constant(0.0);
        let seed = |leaf: Node| match leaf {
            Node::Time => Some(one),
            Node::Slot(slot) => Some(rates.iter().find(|(s, _)| *s == slot).map_or(zero, |(_, r)| *r)),
            _ => None,
        };
        Ok(Typed::real(hyd_symbolic::time_derivative(&mut self.flat.model.templates.arena, value.node, seed)))
    }

    pub(crate) fn lower_pre(&mut self, index: &[Affine]) -> Result<Typed, Fail> {
        let (span, list) = (self.span, self.list);
        self.expect_arguments("pre", 1)?;
        match &list[0].kind {
            Form::Variable(variable) => {
                let (last, steps) = (variable.last(), &variable.steps);
                let variability = self.flat.scopes.variability(last);
                if variability <= hyd_syntax::tree::Variability::Parameter {
                    return self.flat.lower_variable(span, steps, Kind::Var, self.cx, index);
                }
                if variability == hyd_syntax::tree::Variability::Continuous && !self.cx.in_when {
                    self.flat.tables().notes.before_event.push((span, last));
                }
                self.flat.lower_variable(span, steps, Kind::Pre, self.cx, index)
            }
            _ => Err(self.flat.error(Code::BadArguments, span, "`pre` needs a variable")),
        }
    }

    /// `edge(b)` is `b and not pre(b)`, `change(v)` is `v <> pre(v)`.
    pub(crate) fn lower_edge(&mut self, index: &[Affine]) -> Result<Typed, Fail> {
        let (_span, list, builtin) = (self.span, self.list, self.builtin);
        self.expect_arguments(builtin.name(), 1)?;
        let now = self.flat.lower(&list[0], self.cx, index)?;
        if builtin == Builtin::Edge {
            self.flat.want_boolean(list[0].span, "`edge`", &now)?;
        }
        let before = self.lower_pre(index)?;
        let arena = &mut self.flat.model.templates.arena;
        if builtin == Builtin::Change {
            return Ok(Typed::boolean(arena.compare(Relation::NotEqual, now.node, before.node)));
        }
        let off = arena.not(before.node);
        Ok(Typed::boolean(arena.and(now.node, off)))
    }

    /// `semiLinear(x, p, n)` is `smooth(0, if x >= 0 then p*x else n*x)`.
    pub(crate) fn lower_semi_linear(&mut self, index: &[Affine]) -> Result<Typed, Fail> {
        let (_span, list) = (self.span, self.list);
        self.expect_arguments("semiLinear", 3)?;
        let mut values = Vec::with_capacity(3);
        for argument in list {
            let scalar = self.flat.shape(argument, self.cx)?.is_empty();
            let value = self.flat.lower(argument, self.cx, if scalar { &[] } else { index })?;
            self.flat.want_number(argument.span, "`semiLinear`", &value)?;
            values.push(value);
        }
        let [x, p, n] = values.as_slice() else { return Err(Fail::Reported) };
        let arena = &mut self.flat.model.templates.arena;
        let zero = arena.constant(0.0);
        let test = arena.compare(Relation::GreaterEqual, x.node, zero);
        let (up, down) = (arena.mul(p.node, x.node), arena.mul(n.node, x.node));
        Ok(Typed::real(arena.select(test, up, down)))
    }
}
