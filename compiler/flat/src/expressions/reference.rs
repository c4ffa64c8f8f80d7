//! References and subscripts.
//!
//! A reference to an array element becomes a slot whose position is affine in the loop counters.  A reference without
//! subscripts to an array takes them from the element that is asked for.

use std::rc::Rc;

use hyd_instance::{InstId, ScalarType, Value};
use hyd_source::{Code, Diagnostic, Span};
use hyd_syntax::tree::{BinaryOp, UnaryOp, Variability};
use hyd_typed::{Expr, Kind as Form, Local as Name, Variable};

use crate::expressions::range::Range;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::{Flattener, scale};
use crate::state::index::{Affine, Kind, SlotKey};
use crate::state::node::Typed;

/// One subscript: a position, or a list of positions that keeps the dimension.
pub(crate) enum Subscript {
    At(Affine),
    /// `:`
    All,
    /// `a:s:b` as positions from 0.
    Slice {
        start: Affine,
        step: i64,
        count: usize,
    },
    /// Any other list of positions from 0.
    List(Vec<i64>),
}

impl Flattener<'_, '_> {
    /// A variable, whole or at subscripts.
    pub(crate) fn lower_reference(
        &mut self,
        expr: &Expr,
        variable: &Variable,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let (_, last) = &variable.steps[variable.steps.len() - 1];
        if last.iter().any(|subscript| self.is_of_the_run(subscript, cx)) {
            return self.element_at_run(expr, variable, cx, index);
        }
        self.lower_variable(expr.span, &variable.steps, Kind::Var, cx, index)
    }

    pub(crate) fn lower_local(
        &mut self,
        span: Span,
        name: &Name,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let (local, subscripts) = self.leaf_of_path(name, cx)?;
        match local {
            Local::Index(_) if index.is_empty() => self.node_of_index(span, &local),
            Local::Array(items, shape) => self.array_element(span, &items, &shape, &subscripts, cx, index),
            other => self.element_of_local(span, &other, index),
        }
    }

    /// An element of an array of a function; `index` says which of those that the subscripts keep.
    pub(crate) fn array_element(
        &mut self,
        span: Span,
        items: &Rc<Vec<Typed>>,
        shape: &[usize],
        subscripts: &[Expr],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        if cx.depth > 0 && self.computed_subscripts(shape, subscripts, cx)? {
            return self.load_element(span, items, shape, subscripts, cx, index);
        }
        let mut at: Vec<Affine> = Vec::new();
        let mut taken = 0;
        for (k, &size) in shape.iter().enumerate() {
            let subscript = match subscripts.get(k) {
                Some(expr) => self.subscript(expr, size, cx)?,
                None => Subscript::All,
            };
            at.push(self.apply_subscript(span, subscript, index, &mut taken)?);
        }
        self.element_of_local(span, &Local::Array(items.clone(), shape.to_vec()), &at)
    }

    /// A variable, its derivative or its value before the event.
    pub(crate) fn lower_variable(
        &mut self,
        span: Span,
        steps: &[(InstId, Vec<Expr>)],
        kind: Kind,
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Typed, Fail> {
        let last = steps[steps.len() - 1].0;
        let scalar = self.scalar_of(span, last)?;
        let instance = &self.scopes.instances[last];
        let name = instance.name.clone();
        let constant = instance.variability == Variability::Constant || !self.blocks.contains_key(&last);
        if constant
            && self.in_body(cx)
            && let Some(element) = self.load_constant(span, steps, cx, index)?
        {
            return Ok(element);
        }
        let (offset, taken) = self.position_of(span, steps, cx, index)?;
        if taken != index.len() {
            let message = format!("`{name}` is a scalar here, but an array is needed");
            return Err(self.error(Code::ArrayShape, span, message));
        }
        if constant {
            return self.element_of_constant(span, last, &offset);
        }
        if kind == Kind::Der && !matches!(scalar, ScalarType::Real) {
            let message = format!("`der` needs a Real variable, but `{name}` is {}", scalar.name());
            return Err(self.error(Code::TypeMismatch, span, message));
        }
        let first = self.model.variables[self.blocks[&last]].first;
        if kind == Kind::Var && cx.assigned.is_some() {
            let k = offset.as_constant().ok_or(Fail::NeedsExpansion)?;
            let v = crate::model::VarId(first.0 + k as u32);
            if let Some((_, typed)) = cx.assigned.iter().flatten().find(|(known, _)| *known == v) {
                return Ok(typed.clone());
            }
            if cx.algorithm_targets.contains(&v) {
                return Ok(self.current(v, cx));
            }
        }
        let slot = self.slots.slot(SlotKey::Variable(kind, first, offset));
        Ok(Typed { node: self.model.templates.arena.slot(slot), scalar })
    }

    /// The type of a variable that can stand in an equation.
    fn scalar_of(&mut self, span: Span, inst: InstId) -> Result<ScalarType, Fail> {
        let instance = &self.scopes.instances[inst];
        let name = instance.name.clone();
        if instance.absent {
            let declared = instance.span;
            self.report(
                Diagnostic::error(Code::UnknownName, format!("`{name}` does not exist here: its condition is false"))
                    .at(span, "")
                    .with(declared, "declared with a condition here"),
            );
            return Err(Fail::Reported);
        }
        let Some(primitive) = &instance.primitive else {
            if self.scopes.is_broken(inst) {
                return Err(Fail::Reported);
            }
            return Err(self.error(Code::TypeMismatch, span, format!("`{name}` is a component, not a value")));
        };
        let scalar = primitive.scalar.clone();
        if matches!(scalar, ScalarType::Text | ScalarType::Object) {
            let what = if scalar == ScalarType::Text { "a String" } else { "an external object" };
            return Err(self.error(Code::TypeMismatch, span, format!("{what} is not a value of an equation")));
        }
        Ok(scalar)
    }

    /// An element of a constant, or the value of all of them where that is the same.
    fn element_of_constant(&mut self, span: Span, inst: InstId, offset: &Affine) -> Result<Typed, Fail> {
        let value = self.scopes.value_of(inst, span)?;
        let size = value.shape().iter().product::<usize>();
        let is_single = size == 1;
        let chosen = match offset.as_constant() {
            _ if is_single => value.scalar_at(0),
            // The same for all elements of the arrays of components around it.
            Some(k) if size > 0 => value.scalar_at(k as usize % size),
            Some(_) => None,
            None => value.uniform(),
        };
        let Some(chosen) = chosen.cloned() else { return Err(Fail::NeedsExpansion) };
        let k = if is_single { 0 } else { offset.as_constant().unwrap_or(0) };
        self.constant_of(span, inst, &chosen, k as usize)
    }

    /// An element of a constant array at subscripts that the run decides, inside a compiled function.
    fn load_constant(
        &mut self,
        span: Span,
        steps: &[(InstId, Vec<Expr>)],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<Option<Typed>, Fail> {
        let (last, subscripts) = (steps[steps.len() - 1].0, &steps[steps.len() - 1].1);
        let dims = self.scopes.instances[last].dims.clone();
        let whole = hyd_instance::instance::full_dims(&self.scopes.instances, last);
        if whole.len() != dims.len() || !self.computed_subscripts(&dims, subscripts, cx)? {
            return Ok(None);
        }
        let value = self.scopes.value_of(last, span)?;
        let mut items = Vec::new();
        for number in value.flatten() {
            items.push(self.constant_value(span, number)?);
        }
        self.load_element(span, &items, &dims, subscripts, cx, index).map(Some)
    }

    /// Position of the element among the elements of the variable, and how many of `index` were used.
    pub(crate) fn position_of(
        &mut self,
        span: Span,
        steps: &[(InstId, Vec<Expr>)],
        cx: &mut Context,
        index: &[Affine],
    ) -> Result<(Affine, usize), Fail> {
        let last = steps[steps.len() - 1].0;
        let mut offset = Affine::constant(0);
        let mut taken = 0;
        for id in hyd_instance::instance::chain(&self.scopes.instances, last) {
            let dims = self.scopes.instances[id].dims.clone();
            let subscripts: &[Expr] = steps.iter().find(|(i, _)| *i == id).map_or(&[], |(_, s)| s.as_slice());
            let in_steps = steps.iter().any(|(i, _)| *i == id);
            if subscripts.len() > dims.len() {
                let name = self.path(id);
                let plural = |n: usize| if n == 1 { "" } else { "s" };
                let (has, written) = (dims.len(), subscripts.len());
                let message = match has {
                    0 => format!("`{name}` is a scalar and takes no subscripts"),
                    _ => format!(
                        "`{name}` has {has} dimension{}, but {written} subscript{} are written",
                        plural(has),
                        plural(written)
                    ),
                };
                return Err(self.error(Code::ArrayShape, span, message));
            }
            for (k, &size) in dims.iter().enumerate() {
                let at = if !in_steps {
                    self.note_subscripts_of(id);
                    let implicit = cx.implicit.iter().find(|(i, _)| *i == id).map(|(_, own)| own[k].clone());
                    implicit.ok_or_else(|| {
                        let name = self.path(id);
                        self.error(Code::ArrayShape, span, format!("`{name}` is an array and needs subscripts here"))
                    })?
                } else {
                    let subscript = match subscripts.get(k) {
                        Some(expr) => self.subscript(expr, size, cx)?,
                        None => Subscript::All,
                    };
                    self.apply_subscript(span, subscript, index, &mut taken)?
                };
                self.check_inside(id, span, &at, size, cx)?;
                offset = scale(&offset, size).add_scaled(&at, 1).ok_or(Fail::NeedsExpansion)?;
            }
        }
        Ok((offset, taken))
    }

    fn apply_subscript(
        &mut self,
        span: Span,
        subscript: Subscript,
        index: &[Affine],
        taken: &mut usize,
    ) -> Result<Affine, Fail> {
        if let Subscript::At(at) = subscript {
            return Ok(at);
        }
        let Some(wanted) = index.get(*taken).cloned() else {
            return Err(self.no_scalar(span));
        };
        *taken += 1;
        match subscript {
            Subscript::At(at) => Ok(at),
            Subscript::All => Ok(wanted),
            Subscript::Slice { start, step, .. } => start.add_scaled(&wanted, step).ok_or(Fail::NeedsExpansion),
            Subscript::List(list) => {
                let k = wanted.as_constant().ok_or(Fail::NeedsExpansion)?;
                list.get(k as usize).map(|&k| Affine::constant(k)).ok_or(Fail::Reported)
            }
        }
    }

    fn check_inside(&mut self, inst: InstId, span: Span, at: &Affine, size: usize, cx: &Context) -> Result<(), Fail> {
        let (low, high) = at.bounds(&cx.counts);
        if cx.counts.contains(&0) || (low >= 0 && (high as usize) < size) {
            return Ok(());
        }
        let (k, name) = (if low < 0 { low + 1 } else { high.saturating_add(1) }, self.path(inst));
        Err(self.outside(span, &format!(" of `{name}`"), k, size))
    }

    pub(crate) fn subscript(&mut self, expr: &Expr, size: usize, cx: &mut Context) -> Result<Subscript, Fail> {
        if matches!(expr.kind, Form::Colon) {
            return Ok(Subscript::All);
        }
        if let Form::Range(start, step, stop) = &expr.kind {
            cx.ends.push(size);
            let range = self.steps_of(start, step.as_deref(), stop, cx);
            cx.ends.pop();
            return Ok(match range? {
                Range::Steps { start, step, count } => {
                    let start = start.add_scaled(&Affine::constant(-1), 1).ok_or(Fail::NeedsExpansion)?;
                    Subscript::Slice { start, step, count }
                }
                Range::Values(values) => {
                    Subscript::List(values.iter().filter_map(|v| v.as_integer().map(|k| k - 1)).collect())
                }
                Range::Nodes(_) => return self.opaque(expr.span),
            });
        }
        if self.shape(expr, cx)?.is_empty() {
            return Ok(Subscript::At(self.position(expr, size, cx)?));
        }
        let (mut env, complete) = cx.env();
        if !complete {
            return Err(Fail::NeedsExpansion);
        }
        env.ends.push(size);
        let value = self.scopes.evaluate(&expr.evaluable(), cx.scope, &env)?;
        Ok(Subscript::List(value.flatten().iter().filter_map(|v| v.as_integer().map(|k| k - 1)).collect()))
    }

    /// A subscript as a position from 0.
    fn position(&mut self, expr: &Expr, size: usize, cx: &mut Context) -> Result<Affine, Fail> {
        cx.ends.push(size);
        let value = self.affine(expr, cx);
        cx.ends.pop();
        value?.add_scaled(&Affine::constant(-1), 1).ok_or(Fail::NeedsExpansion)
    }

    /// An integer expression as an affine function of the counters.
    pub(crate) fn affine(&mut self, expr: &Expr, cx: &mut Context) -> Result<Affine, Fail> {
        match &expr.kind {
            Form::Integer(k) => return Ok(Affine::constant(*k)),
            Form::Local(name) if name.parts.len() == 1 => {
                if let Some(Local::Index(affine)) = cx.local(name.name()) {
                    return Ok(affine.clone());
                }
            }
            Form::Unary(UnaryOp::Minus, a) => {
                let a = self.affine(a, cx)?;
                return Affine::constant(0).add_scaled(&a, -1).ok_or(Fail::NeedsExpansion);
            }
            Form::Binary(op @ (BinaryOp::Add | BinaryOp::Sub), a, b) => {
                let (a, b) = (self.affine(a, cx)?, self.affine(b, cx)?);
                let factor = if *op == BinaryOp::Add { 1 } else { -1 };
                return a.add_scaled(&b, factor).ok_or(Fail::NeedsExpansion);
            }
            Form::Binary(BinaryOp::Mul, a, b) => {
                let (a, b) = (self.affine(a, cx)?, self.affine(b, cx)?);
                let product = match (a.as_constant(), b.as_constant()) {
                    (Some(k), _) => Affine::constant(0).add_scaled(&b, k),
                    (_, Some(k)) => Affine::constant(0).add_scaled(&a, k),
                    _ => None,
                };
                return product.ok_or(Fail::NeedsExpansion);
            }
            Form::Tuple(items) => {
                if let [Some(only)] = items.as_slice() {
                    return self.affine(only, cx);
                }
            }
            Form::Builtin(builtin, list) => {
                if let Some(quotient) = self.affine_quotient(*builtin, list, cx)? {
                    return Ok(quotient);
                }
            }
            _ => {}
        }
        let (env, complete) = cx.env();
        if !complete && cx.has_counter_in(expr) {
            return Err(Fail::NeedsExpansion);
        }
        if cx.depth > 0 {
            // Inside a function the names are its own: what is known of them is known as nodes.
            let value = self.lower(expr, cx, &[])?;
            let known = self.model.templates.arena.as_constant(value.node);
            return match known.filter(|x| x.fract() == 0.0 && x.abs() < 1e15) {
                Some(x) => {
                    let shift = i64::from(matches!(value.scalar, ScalarType::Boolean));
                    Ok(Affine::constant(x as i64 + shift))
                }
                None => self.opaque(expr.span),
            };
        }
        match self.scopes.evaluate(&expr.evaluable(), cx.scope, &env)? {
            Value::Integer(k) => Ok(Affine::constant(k)),
            Value::Enumeration(_, k) => Ok(Affine::constant(i64::from(k))),
            // `false` is the first element of an array over `Boolean`, `true` the second.
            Value::Boolean(b) if cx.ends.last() == Some(&2) => Ok(Affine::constant(i64::from(b) + 1)),
            other => {
                let message = format!("an Integer is needed here, not {}", other.type_name());
                Err(self.error(Code::TypeMismatch, expr.span, message))
            }
        }
    }
}
