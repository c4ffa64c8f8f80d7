//! The values of loop variables, and ranges as subscripts.
//!
//! Evenly spaced integers stay a start, a distance and a number, so a loop is not run through; all else is a list of
//! values.  How many values there are must be known at translation (Modelica 3.6, sections 10.4.3 and 11.2.2).

use std::sync::Arc;

use hyd_instance::range::{ZERO_STEP, count_of_integers, count_of_reals};
use hyd_instance::value::Items;
use hyd_instance::{Builtin, ScalarType, Value};
use hyd_source::Code;
use hyd_symbolic::Function;
use hyd_syntax::tree::{BinaryOp, UnaryOp};
use hyd_typed::{Base, Expr, Iterator, Kind};

use crate::expressions::piecewise::{common_divisor, relation, truth};
use crate::expressions::value::local_of;
use crate::state::context::{Context, Fail, Local};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, Cut};
use crate::state::node::Typed;

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
    Values(Arc<Items>),
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

/// Most values of a range.
const MAX_STEPS: i128 = 1 << 27;

impl Flattener<'_, '_> {
    /// The values of a loop variable.
    pub(crate) fn range(&mut self, iterator: &Iterator, cx: &mut Context) -> Result<Range, Fail> {
        let range = &iterator.range;
        if let Kind::Failed(said, _) = &range.kind {
            return Err(self.say(said));
        }
        if let Kind::Range(start, step, stop) = &range.kind {
            return self.steps_of(start, step.as_deref(), stop, cx);
        }
        if cx.has_counter_in(range) {
            return Err(Fail::NeedsExpansion);
        }
        if cx.depth > 0 && self.mentions_local(range, cx) {
            return Ok(Range::Nodes(self.elements_of(range, cx)?));
        }
        let (env, _) = cx.env();
        Ok(Range::Values(self.scopes.evaluate(&range.evaluable(), cx.scope, &env)?.items()))
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
        let count = count_of_reals(start, step, stop);
        if !(count.is_finite() && count < 1e6) {
            return Err(self.error(Code::Limit, parts[0].span, "this range has no meaning or too many values"));
        }
        let values = (0..count as usize).map(|k| Value::Real(start + step * k as f64)).collect();
        Ok(Range::Values(Value::array(values).items()))
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
        if cx.depth > 0 && parts.clone().any(|part| part.ty.base == Base::Scalar(ScalarType::Real)) {
            return self.real_steps([start, step.unwrap_or(start), stop], step.is_some(), cx);
        }
        if parts.any(|part| is_not_integer(part, cx)) {
            let step = step.map(|s| Box::new(s.clone()));
            let kind = Kind::Range(Box::new(start.clone()), step, Box::new(stop.clone()));
            let whole = Expr { kind, ty: start.ty.with_rank(1), span: start.span.to(stop.span) };
            return Ok(Range::Values(self.scopes.evaluate(&whole.evaluable(), cx.scope, &env)?.items()));
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
        let count = count_of_integers(0, step, distance);
        if count > MAX_STEPS {
            let message = format!("this range has {count} values; at most {MAX_STEPS} are possible");
            return Err(self.error(Code::Limit, start.span.to(stop.span), message));
        }
        let count = count as usize;
        Ok(Range::Steps { start: first, step, count })
    }

    /// True if a variable of a function occurs.
    fn mentions_local(&self, expr: &Expr, cx: &Context) -> bool {
        hyd_typed::any_local(expr, &mut |name| {
            matches!(
                cx.local(name.name()),
                Some(Local::Node(_) | Local::Array(..) | Local::Record(_) | Local::Records(..))
            )
        })
    }

    /// Truth of a condition for all values of the counters.
    pub(crate) fn truth_over_loops(&mut self, condition: &Expr, cx: &mut Context) -> Result<bool, Fail> {
        match &condition.kind {
            Kind::Boolean(truth) => Ok(*truth),
            Kind::Tuple(items) => match items.as_slice() {
                [Some(only)] => self.truth_over_loops(only, cx),
                _ => Err(Fail::NeedsExpansion),
            },
            Kind::Unary(UnaryOp::Not, a) => Ok(!self.truth_over_loops(a, cx)?),
            Kind::Binary(BinaryOp::And, a, b) => Ok(self.truth_over_loops(a, cx)? && self.truth_over_loops(b, cx)?),
            Kind::Binary(BinaryOp::Or, a, b) => Ok(self.truth_over_loops(a, cx)? || self.truth_over_loops(b, cx)?),
            Kind::Binary(op, a, b) => {
                let relation = relation(*op).ok_or(Fail::NeedsExpansion)?;
                let (sides, draft) = self.attempt(|flat| Ok((flat.affine(a, cx)?, flat.affine(b, cx)?)));
                if sides == Err(Fail::Reported) {
                    // No integers: values are compared one by one.
                    return Err(Fail::NeedsExpansion);
                }
                self.keep(draft);
                let (a, b) = sides?;
                let difference = a.add_scaled(&b, -1).ok_or(Fail::NeedsExpansion)?;
                truth(relation, &difference, cx)
            }
            _ => Err(Fail::NeedsExpansion),
        }
    }

    /// `div(a, m)`, `mod(a, m)` or `rem(a, m)` of counters as an affine function; none for other calls.
    pub(crate) fn affine_quotient(
        &mut self,
        function: Builtin,
        list: &[Expr],
        cx: &mut Context,
    ) -> Result<Option<Affine>, Fail> {
        let Builtin::Elementary(whole @ (Function::Div | Function::Mod | Function::Rem)) = function else {
            return Ok(None);
        };
        let [a, m] = list else { return Ok(None) };
        if cx.depth > 0 || !cx.has_counter_in(a) {
            return Ok(None);
        }
        let (a, m) = (self.affine(a, cx)?, self.affine(m, cx)?);
        let Some(m) = m.as_constant().filter(|&m| m > 0) else { return Ok(None) };
        // Below zero quotients are rounded upwards.
        if a.bounds(&cx.counts).0 < 0 {
            return Ok(None);
        }
        if let Some(&(counter, c)) = a.terms.iter().find(|(_, c)| c % m != 0) {
            let parts = usize::try_from(m / common_divisor(c, m)).map_err(|_| Fail::NeedsExpansion)?;
            return Err(cx.cut(counter, Cut::Modulo(parts)));
        }
        Ok(Some(match whole {
            Function::Div => {
                Affine { constant: a.constant / m, terms: a.terms.iter().map(|&(id, c)| (id, c / m)).collect() }
            }
            _ => Affine::constant(a.constant % m),
        }))
    }
}

/// True for ends of ranges of Real, Boolean or enumeration values, as far as names outside of functions say.
fn is_not_integer(part: &Expr, cx: &Context) -> bool {
    let local = |part: &Expr| matches!(&part.kind, Kind::Local(name) if cx.local(name.name()).is_some());
    match &part.kind {
        Kind::Unary(_, a) => is_not_integer(a, cx),
        Kind::Binary(hyd_syntax::tree::BinaryOp::Div, ..) => true,
        Kind::Binary(_, a, b) => is_not_integer(a, cx) || is_not_integer(b, cx),
        Kind::Real(_) | Kind::Boolean(_) | Kind::Literal(..) => true,
        Kind::Variable(_) => {
            !local(part) && part.ty.base != Base::Scalar(ScalarType::Integer) && part.ty.base != Base::None
        }
        _ => false,
    }
}
