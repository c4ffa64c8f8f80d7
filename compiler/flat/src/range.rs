//! The values of loop variables, and ranges as subscripts.
//!
//! Evenly spaced integers stay a start, a distance and a number, so a loop is not run through; all else is a list of
//! values.  How many values there are must be known at translation (Modelica 3.6, sections 10.4.3 and 11.2.2).

use std::sync::Arc;

use hyd_instance::{Resolved, ScalarType, Value};
use hyd_source::Code;
use hyd_syntax::tree::{BinaryOp, Expr, ExprKind, Iterator};

use crate::context::{Context, Fail, Local};
use crate::flatten::Flattener;
use crate::index::Affine;
use crate::lower::{Typed, local_of};

/// The values of a loop variable.
pub(crate) enum Range {
    /// Evenly spaced integers.
    Steps {
        /// First value.
        start: Affine,
        /// Distance.
        step: i64,
        /// How many.
        count: usize,
    },
    /// Any other values known at translation.
    Values(Arc<Vec<Value>>),
    /// The elements of an array inside a function.
    Nodes(Vec<Typed>),
}

impl Range {
    /// Number of values.
    pub(crate) fn count(&self) -> usize {
        match self {
            Range::Steps { count, .. } => *count,
            Range::Values(values) => values.len(),
            Range::Nodes(values) => values.len(),
        }
    }

    /// What stands at a position counted from 0.
    pub(crate) fn at(&self, position: &Affine) -> Result<Local, Fail> {
        match self {
            Range::Steps { start, step, .. } => {
                start.add_scaled(position, *step).map(Local::Index).ok_or(Fail::NeedsExpansion)
            }
            Range::Values(values) => {
                let k = position.as_constant().ok_or(Fail::NeedsExpansion)?;
                values.get(k as usize).map(|v| local_of(v.clone())).ok_or(Fail::Reported)
            }
            Range::Nodes(values) => {
                let k = position.as_constant().ok_or(Fail::NeedsExpansion)?;
                values.get(k as usize).map(|v| Local::Node(v.clone())).ok_or(Fail::Reported)
            }
        }
    }

    /// What the loop variable stands for in turn `k`, counted from 0.
    pub(crate) fn local(&self, k: usize) -> Result<Local, Fail> {
        Ok(match self {
            Range::Steps { start, step, .. } => {
                Local::Index(start.add_scaled(&Affine::constant(k as i64), *step).ok_or(Fail::NeedsExpansion)?)
            }
            Range::Values(values) => local_of(values[k].clone()),
            Range::Nodes(values) => Local::Node(values[k].clone()),
        })
    }
}

/// The message for `a:0:b`.
pub(crate) const ZERO_STEP: &str = "the step of this range is zero";

/// Most values of a range.
const MAX_STEPS: i128 = 1 << 27;

impl Flattener<'_, '_> {
    /// The values of a loop variable.
    pub(crate) fn range(&mut self, iterator: &Iterator, cx: &mut Context) -> Result<Range, Fail> {
        let Some(range) = &iterator.range else {
            let message = format!("the range of `{}` must be written", iterator.name.name);
            return Err(self.error(Code::NotStructural, iterator.name.span, message));
        };
        if let ExprKind::Range(start, step, stop) = &range.kind {
            return self.steps_of(start, step.as_deref(), stop, cx);
        }
        if self.mentions_counter(range, cx) {
            return Err(Fail::NeedsExpansion);
        }
        if cx.depth > 0 && self.mentions_local(range, cx) {
            return Ok(Range::Nodes(self.elements_of(range, cx)?));
        }
        let (env, _) = cx.env();
        Ok(Range::Values(self.tree.evaluate(range, cx.scope, &env)?.items()))
    }

    /// A range of Real values inside a function, whose ends may be variables of the function that are known here.
    fn real_steps(&mut self, parts: [&Expr; 3], stepped: bool, cx: &mut Context) -> Result<Range, Fail> {
        let mut values = [0.0, 1.0, 0.0];
        for (k, part) in parts.into_iter().enumerate() {
            if k == 1 && !stepped {
                continue;
            }
            let node = self.lower(part, cx, &[])?.node;
            match self.model.templates.arena.as_constant(node) {
                Some(value) => values[k] = value,
                None => return self.opaque(part.span),
            }
        }
        let [start, step, stop] = values;
        if step == 0.0 {
            return Err(self.error(Code::Value, parts[1].span, ZERO_STEP));
        }
        let count = hyd_instance::value::count_of_reals(start, step, stop);
        if !(count.is_finite() && count < 1e6) {
            return Err(self.error(Code::Limit, parts[0].span, "this range has no meaning or too many values"));
        }
        let values = (0..count as usize).map(|k| Value::Real(start + step * k as f64)).collect();
        Ok(Range::Values(Arc::new(values)))
    }

    /// True for ends of ranges of Real, Boolean or enumeration values.
    fn is_no_integer(&mut self, part: &Expr, cx: &Context) -> bool {
        match &part.kind {
            ExprKind::Real(_) | ExprKind::Boolean(_) => true,
            ExprKind::Ref(reference) if cx.local(&reference.parts[0].name.name).is_none() => {
                match self.tree.quietly(|tree| tree.resolve(cx.scope, reference)) {
                    Ok(Resolved::Literal(..)) => true,
                    Ok(Resolved::Variable(steps)) => {
                        let last = &self.tree.instances[steps[steps.len() - 1].0];
                        last.primitive.as_ref().is_some_and(|p| !matches!(p.scalar, ScalarType::Integer))
                    }
                    _ => false,
                }
            }
            ExprKind::Unary(_, a) => self.is_no_integer(a, cx),
            ExprKind::Binary(op, a, b) => {
                *op == BinaryOp::Div || self.is_no_integer(a, cx) || self.is_no_integer(b, cx)
            }
            _ => false,
        }
    }

    pub(crate) fn steps_of(
        &mut self,
        start: &Expr,
        step: Option<&Expr>,
        stop: &Expr,
        cx: &mut Context,
    ) -> Result<Range, Fail> {
        let (env, _) = cx.env();
        let mut parts = [Some(start), step, Some(stop)].into_iter().flatten();
        if cx.depth > 0 && parts.clone().any(|part| matches!(part.kind, ExprKind::Real(_))) {
            return self.real_steps([start, step.unwrap_or(start), stop], step.is_some(), cx);
        }
        if parts.any(|part| self.is_no_integer(part, cx)) {
            let whole = Expr {
                kind: ExprKind::Range(
                    Box::new(start.clone()),
                    step.map(|s| Box::new(s.clone())),
                    Box::new(stop.clone()),
                ),
                span: start.span.to(stop.span),
            };
            return Ok(Range::Values(self.tree.evaluate(&whole, cx.scope, &env)?.items()));
        }
        let (first, last) = (self.affine(start, cx)?, self.affine(stop, cx)?);
        let step = match step {
            Some(step) => match self.affine(step, cx)?.as_constant().ok_or(Fail::NeedsExpansion)? {
                0 => return Err(self.error(Code::Value, step.span, ZERO_STEP)),
                known => known,
            },
            None => 1,
        };
        let distance = last.add_scaled(&first, -1).and_then(|d| d.as_constant()).ok_or(Fail::NeedsExpansion)?;
        let backwards = distance != 0 && (distance > 0) != (step > 0);
        let count = if backwards { 0 } else { i128::from(distance) / i128::from(step) + 1 };
        if count > MAX_STEPS {
            let message = format!("this range has {count} values; at most {MAX_STEPS} are possible");
            return Err(self.error(Code::Limit, start.span.to(stop.span), message));
        }
        let count = count as usize;
        Ok(Range::Steps { start: first, step, count })
    }

    /// True if a variable of a function occurs.
    fn mentions_local(&self, expr: &Expr, cx: &Context) -> bool {
        crate::walk::any_ref(expr, &mut |reference| {
            matches!(
                cx.local(&reference.parts[0].name.name),
                Some(Local::Node(_) | Local::Array(..) | Local::Record(_) | Local::Records(..))
            )
        })
    }
}
