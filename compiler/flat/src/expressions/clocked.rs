//! Operators of clocks: `sample(u)`, `hold`, `previous`, `subSample`, ..., `Clock(...)` (Modelica 3.6, chapter 16).
//!
//! Each call becomes variables of the translation's own for its argument and its value, one per element, and a
//! [`ClockOperator`] that relates them.  Nothing joins the clocks of the two here: which equations belong to which clock, and when
//! that ticks, is found out of the whole model by the stage of clocks.  `previous` reads the value before the event and only notes that
//! it was asked for.

use hyd_instance::{Builtin, ScalarType, Value};
use hyd_source::{Code, Origin, Span};
use hyd_system::{ValueKind, Variability};
use hyd_typed::{Expr, Kind as Form};

use crate::expressions::builtin_call::BuiltinCall;
use crate::expressions::delay::offset;
use crate::model::{ClockKind, ClockOperator, Section, VarId};
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, Kind, SlotKey};
use crate::state::made::Made;
use crate::state::node::Typed;

fn is_number(expr: &Expr) -> bool {
    matches!(expr.kind, Form::Integer(_) | Form::Real(_))
}

impl BuiltinCall<'_, '_, '_> {
    /// The element at `index` of what an operator of clocks gives.
    pub(crate) fn lower_clocked(&mut self, index: &[Affine]) -> Result<Typed, Fail> {
        let (list, builtin) = (self.list, self.builtin);
        match (builtin, list) {
            (Builtin::Previous, [variable]) => self.lower_previous(variable, index),
            (Builtin::Clock, _) => self.lower_clock(),
            (Builtin::Interval | Builtin::FirstTick, []) => self.value_of_clock(None),
            (Builtin::Interval | Builtin::FirstTick, [of]) => {
                let shape = self.flat.shape(of, self.cx)?;
                let first: Vec<Affine> = shape.iter().map(|_| Affine::constant(0)).collect();
                let of = self.flat.lower(of, self.cx, &first)?;
                self.value_of_clock(Some(of))
            }
            (Builtin::Sample, [u]) if is_number(u) => {
                let message = "`sample` takes the first instant and the interval, or a value that varies and a clock";
                Err(self.flat.error(Code::BadArguments, self.span, message))
            }
            (Builtin::Sample, [u]) => self.related(ClockKind::Sample, u, None, index),
            (Builtin::Sample, [u, clock]) => self.related(ClockKind::Sample, u, Some(clock), index),
            (Builtin::Hold, [u]) => self.related(ClockKind::Hold, u, None, index),
            (Builtin::NoClock, [u]) => self.related(ClockKind::NoClock, u, None, index),
            (Builtin::SubSample | Builtin::SuperSample, [u, rest @ ..]) if rest.len() < 2 => {
                // A factor of 0 is one that is left out (16.5.2).
                let factor = rest.first().map(|own| self.counted(own)).transpose()?.filter(|&factor| factor > 0);
                let kind =
                    if builtin == Builtin::SubSample { ClockKind::Sub(factor) } else { ClockKind::Super(factor) };
                self.related(kind, u, None, index)
            }
            (Builtin::ShiftSample | Builtin::BackSample, [u, counter, rest @ ..]) if rest.len() < 2 => {
                let counter = self.counted(counter)?;
                let resolution = rest.first().map(|own| self.counted(own)).transpose()?.unwrap_or(1);
                if let (0, Some(own)) = (resolution, rest.first()) {
                    return Err(self.flat.error(Code::Value, own.span, "the resolution must be at least 1"));
                }
                let back = builtin == Builtin::BackSample;
                let kind =
                    if back { ClockKind::Back(counter, resolution) } else { ClockKind::Shift(counter, resolution) };
                self.related(kind, u, None, index)
            }
            _ => {
                let takes = match builtin {
                    Builtin::Interval | Builtin::FirstTick => "nothing or a clocked variable",
                    Builtin::SubSample | Builtin::SuperSample => "a clocked expression and a factor",
                    Builtin::ShiftSample | Builtin::BackSample => "a clocked expression, a counter and a resolution",
                    Builtin::Sample => "an expression and a clock, or the first instant and the interval",
                    Builtin::Previous => "a clocked variable",
                    _ => "a clocked expression",
                };
                let message = format!("`{}` takes {takes}", builtin.name());
                Err(self.flat.error(Code::BadArguments, self.span, message))
            }
        }
    }

    /// A number of ticks, which the structure of the model depends on.
    fn counted(&mut self, expr: &Expr) -> Result<u64, Fail> {
        let value = self.known(expr)?;
        let number = value.as_real().filter(|x| x.fract() == 0.0 && (0.0..9.0e15).contains(x));
        number.map(|x| x as u64).ok_or_else(|| {
            let message = format!("`{}` needs a number of ticks here: an integer not below 0", self.builtin.name());
            self.flat.error(Code::Value, expr.span, message)
        })
    }

    fn known(&mut self, expr: &Expr) -> Result<Value, Fail> {
        let (env, _) = self.cx.env();
        Ok(self.flat.scopes.evaluate(&expr.evaluable(), self.cx.scope, &env)?)
    }

    fn lower_previous(&mut self, variable: &Expr, index: &[Affine]) -> Result<Typed, Fail> {
        let Form::Variable(named) = &variable.kind else {
            return Err(self.flat.error(Code::BadArguments, self.span, "`previous` needs a variable"));
        };
        let last = named.last();
        if self.flat.scopes.variability(last) <= hyd_syntax::tree::Variability::Parameter {
            return self.flat.lower_variable(self.span, &named.steps, Kind::Var, self.cx, index);
        }
        let before = self.flat.lower_variable(self.span, &named.steps, Kind::Pre, self.cx, index)?;
        if let Some(&block) = self.flat.blocks.get(&last) {
            let (value, count) = (self.flat.variable(block).first, self.flat.variable(block).count);
            let origin = self.flat.origin_of_call(self.span, self.cx);
            let kind = ClockKind::Previous;
            self.flat.tables().clocks.push(ClockOperator { kind, count, value, source: None, clock: None, origin });
        }
        Ok(before)
    }

    /// `interval(of)`, `firstTick(of)`
    fn value_of_clock(&mut self, of: Option<Typed>) -> Result<Typed, Fail> {
        let (kind, scalar) = match self.builtin {
            Builtin::Interval => (ClockKind::Interval, ScalarType::Real),
            _ => (ClockKind::FirstTick, ScalarType::Boolean),
        };
        let source = of.map(|of| self.flat.clocked_source(self.span, &of, self.cx)).transpose()?;
        let unit = (kind == ClockKind::Interval).then_some("s");
        self.flat.operator((kind, source, None), scalar, (self.span, unit), self.cx)
    }

    /// An operator between what is lowered from `u` and its own value.
    fn related(&mut self, kind: ClockKind, u: &Expr, clock: Option<&Expr>, index: &[Affine]) -> Result<Typed, Fail> {
        let value = self.flat.lower(u, self.cx, index)?;
        let starts = matches!(kind, ClockKind::Hold | ClockKind::Back(..));
        let source = self.flat.clocked_source(self.span, &value, self.cx)?;
        if let (true, Form::Variable(named)) = (starts, &u.kind) {
            let start = self.flat.lower_variable(u.span, &named.steps, Kind::Start, self.cx, index)?;
            self.flat.start_of_source(source, &start, (self.span, self.cx))?;
        }
        let clock = match clock {
            Some(clock) => {
                let clock = self.flat.lower(clock, self.cx, &[])?;
                Some(self.flat.clocked_source(self.span, &clock, self.cx)?)
            }
            None => None,
        };
        self.flat.operator((kind, Some(source), clock), value.scalar, (self.span, None), self.cx)
    }

    /// `Clock()`, `Clock(interval)`, `Clock(counter, resolution)`, `Clock(condition)`, `Clock(clock, method)`
    fn lower_clock(&mut self) -> Result<Typed, Fail> {
        let span = self.span;
        let (kind, source) = match self.list {
            [] => (ClockKind::Clock, None),
            [first, rest @ ..] if rest.len() < 2 => {
                let value = self.flat.lower(first, self.cx, &[])?;
                match (&value.scalar, rest) {
                    (ScalarType::Clock, [method]) => {
                        let Value::Text(method) = self.known(method)? else {
                            let message = "the solver method of a clock is a String";
                            return Err(self.flat.error(Code::TypeMismatch, method.span, message));
                        };
                        let source = self.flat.clocked_source(span, &value, self.cx)?;
                        (ClockKind::Solver(method.as_ref().into()), Some(source))
                    }
                    // The start of the interval counts before the first tick, where nothing reads it.
                    (ScalarType::Boolean, _) => {
                        let source = self.flat.clocked_source(span, &value, self.cx)?;
                        (ClockKind::Condition, Some(source))
                    }
                    (ScalarType::Integer, _) => {
                        let counter = self.counted(first)?;
                        let resolution = rest.first().map(|own| self.counted(own)).transpose()?.unwrap_or(1);
                        if counter == 0 || resolution == 0 {
                            let message = "the interval of a clock must be positive";
                            return Err(self.flat.error(Code::Value, span, message));
                        }
                        (ClockKind::Exact(counter, resolution), None)
                    }
                    (ScalarType::Real, []) => {
                        let period = self.known(first)?.as_real().unwrap_or(f64::NAN);
                        if !(period > 0.0 && period.is_finite()) {
                            let message = format!("the interval of a clock is {period} s, and must be positive");
                            return Err(self.flat.error(Code::Value, first.span, message));
                        }
                        (ClockKind::Period(period), None)
                    }
                    _ => return Err(self.no_clock()),
                }
            }
            _ => return Err(self.no_clock()),
        };
        self.flat.operator((kind, source, None), ScalarType::Clock, (span, None), self.cx)
    }

    fn no_clock(&mut self) -> Fail {
        let message = "`Clock` takes nothing, an interval in s, a counter and a resolution, a condition, or a clock and a solver method";
        self.flat.error(Code::BadArguments, self.span, message)
    }
}

impl Flattener<'_, '_> {
    fn origin_of_call(&mut self, span: Span, cx: &Context) -> Origin {
        Origin { path: self.path(cx.scope.inst), span }
    }

    /// Notes that variables are clocks.
    pub(crate) fn note_clock(&mut self, value: VarId, count: u32, origin: Origin) {
        let kind = ClockKind::Clock;
        self.tables().clocks.push(ClockOperator { kind, count, value, source: None, clock: None, origin });
    }

    /// Variables that are a value that is lowered, one per element.
    pub(crate) fn clocked_source(&mut self, span: Span, value: &Typed, cx: &Context) -> Result<VarId, Fail> {
        let first = self.clocked_variable("source", &value.scalar, span, cx)?;
        let left = self.element_slot(Kind::Var, first, cx)?;
        let (dims, origin) = (cx.loop_counts(), self.origin_of_call(span, cx));
        let section = if value.scalar == ScalarType::Real { Section::Continuous } else { Section::Discrete };
        self.define_in(section, left, value.node, &dims, &origin);
        Ok(first)
    }

    fn start_of_source(&mut self, source: VarId, start: &Typed, (span, cx): (Span, &Context)) -> Result<(), Fail> {
        let left = self.element_slot(Kind::Start, source, cx)?;
        let (dims, origin) = (cx.loop_counts(), self.origin_of_call(span, cx));
        let (block, _) = self.locate(source);
        if let Some(block) = self.newest().filter(|block| block.first == source) {
            block.has_start = true;
        } else {
            debug_assert!(false, "the source is the newest variable, not {block:?}");
        }
        self.emit(Section::Start, left, start.node, &dims, &origin);
        Ok(())
    }

    fn element_slot(&mut self, kind: Kind, first: VarId, cx: &Context) -> Result<hyd_symbolic::NodeId, Fail> {
        let at = offset(cx)?;
        let slot = self.slots.slot(SlotKey::Variable(kind, first, at));
        Ok(self.model.templates.arena.slot(slot))
    }

    /// Variables of the translation's own, one per element.
    fn clocked_variable(&mut self, part: &str, scalar: &ScalarType, span: Span, cx: &Context) -> Result<VarId, Fail> {
        let kind = match scalar {
            ScalarType::Real => ValueKind::Real,
            ScalarType::Integer => ValueKind::Integer,
            ScalarType::Boolean | ScalarType::Clock => ValueKind::Boolean,
            ScalarType::Enumeration(e) => ValueKind::Enumeration(e.literals.clone().into()),
            ScalarType::Text | ScalarType::Object => {
                let message = format!("{} has no clock", scalar.name());
                return Err(self.error(Code::TypeMismatch, span, message));
            }
        };
        let real = kind == ValueKind::Real && part == "source";
        let variability = if real { Variability::Continuous } else { Variability::Discrete };
        let (dims, origin) = (cx.loop_counts(), self.origin_of_call(span, cx));
        let call = self.call_text(span);
        let name = if origin.path.is_empty() { call } else { format!("{}.{call}", origin.path) };
        let name = if part == "value" { name } else { format!("{name}.{part}") };
        let first = self.make(Made::Clock, name, &dims, (kind, variability), origin.clone());
        if *scalar == ScalarType::Clock {
            self.note_clock(first, dims.iter().product::<usize>() as u32, origin);
        }
        Ok(first)
    }

    /// An operator with a value of its own.
    fn operator(
        &mut self,
        (kind, source, clock): (ClockKind, Option<VarId>, Option<VarId>),
        scalar: ScalarType,
        (span, unit): (Span, Option<&str>),
        cx: &Context,
    ) -> Result<Typed, Fail> {
        if cx.depth > 0 {
            return Err(self.error(Code::Misplaced, span, "clocks have no place inside a function"));
        }
        let value = self.clocked_variable("value", &scalar, span, cx)?;
        if let (Some(unit), Some(block)) = (unit, self.newest()) {
            block.unit = Some(unit.into());
        }
        let count = cx.loop_counts().iter().product::<usize>() as u32;
        let origin = self.origin_of_call(span, cx);
        // That it is a clock has been noted with the variable.
        if kind != ClockKind::Clock {
            self.tables().clocks.push(ClockOperator { kind, count, value, source, clock, origin });
        }
        Ok(Typed { node: self.element_slot(Kind::Var, value, cx)?, scalar })
    }
}
