//! `delay(expr, time)` and `delay(expr, time, most)`: the value of an expression some time ago.
//!
//! A call becomes a delay site: internal variables for what is delayed, for the delay time and for the delayed value `d`,
//! one element per element of the loops around.  While the model runs `d` is what the solver has recorded of
//! the source; where the delay time varies, `d = c - r*time` with `c` and `r` handed over such that this is the delayed value
//! and has the right slope in the delay time, so that Jacobian and index reduction need no further rule.  At the start `d`
//! is the source itself (Modelica 3.6, section 3.7.4.1).  How the past is kept is the solver's affair.

use hyd_instance::ScalarType;
use hyd_source::{Code, Diagnostic, Origin, Span};
use hyd_symbolic::{NodeId, Relation};
use hyd_system::{TextFormat, ValueKind, Variability};

use crate::model::{DelayBlock, Message, MessagePart, Section, VarId};
use crate::state::context::{Context, Fail};
use crate::state::flattener::{Flattener, scale};
use crate::state::index::{Affine, CounterId, Kind, SlotKey};
use crate::state::made::Made;
use crate::state::node::Typed;

/// The parts of a call, lowered.
struct Parts {
    value: NodeId,
    time: NodeId,
    most: Option<NodeId>,
    varying: bool,
}

impl Flattener<'_, '_> {
    /// `list`: the texts and values of the arguments.
    pub(crate) fn delay(&mut self, span: Span, list: &[(Span, Typed)], cx: &Context) -> Result<Typed, Fail> {
        let message = "`delay` takes an expression, the delay time and, if that varies, its upper bound";
        if cx.depth > 0 {
            return Err(self.error(Code::Misplaced, span, "`delay` is not allowed inside a function"));
        }
        let (expr, time, most) = match list {
            [expr, time] => (expr, time, None),
            [expr, time, most] => (expr, time, Some(most)),
            _ => return Err(self.error(Code::BadArguments, span, message)),
        };
        let whats = ["`delay`", "the delay time", "the upper bound of the delay time"];
        for ((span, value), what) in list.iter().zip(whats) {
            self.want_number(*span, what, value)?;
        }
        let (value, delay, time) = (expr.1.node, time.1.node, time.0);
        let bound = most.map(|(_, bound)| bound.node);
        if self.is_fixed(value) {
            return Ok(Typed::real(value));
        }
        if let Some(seconds) = self.model.templates.arena.as_constant(delay)
            && seconds < 0.0
        {
            return Err(self.error(Code::Value, time, format!("the delay time {seconds} s is negative")));
        }
        let varying = !self.is_fixed(delay);
        match (bound, most) {
            (None, _) if varying => {
                let message = "the delay time changes during the run, so its upper bound is needed";
                let fault = Diagnostic::error(Code::BadArguments, message).at(time, "this is not a parameter");
                self.report(fault.help("`delay(expression, time, most)` takes the upper bound as third argument"));
                return Err(Fail::Reported);
            }
            (Some(bound), Some((most, _))) if !self.is_fixed(bound) => {
                let message = "the upper bound of a delay time must be a parameter";
                return Err(self.error(Code::NotStructural, *most, message));
            }
            _ => {}
        }
        let parts = Parts { value, time: delay, most: bound, varying };
        let node = self.make_site(span, &parts, cx)?;
        Ok(Typed { node, scalar: ScalarType::Real })
    }

    /// The internal variables and equations of a call; returns the delayed value.
    fn make_site(&mut self, span: Span, parts: &Parts, cx: &Context) -> Result<NodeId, Fail> {
        let origin = Origin { path: self.path(cx.scope.inst), span };
        let dims = cx.loop_counts();
        let offset = offset(cx)?;
        let name = self.site_name(span, &origin);
        let real = |variability| (ValueKind::Real, variability);
        let moving = real(Variability::Continuous);
        let source = self.make(Made::Delay, format!("{name}.source"), &dims, moving.clone(), origin.clone());
        let value = self.make(Made::Delay, name.clone(), &dims, moving, origin.clone());
        let kind = if parts.varying { Variability::Continuous } else { Variability::Parameter };
        let time = self.make(Made::Delay, format!("{name}.time"), &dims, real(kind), origin.clone());
        self.give_unit(time, "s");
        let most = parts.most.map(|_| {
            let most =
                self.make(Made::Delay, format!("{name}.most"), &dims, real(Variability::Parameter), origin.clone());
            self.give_unit(most, "s");
            most
        });
        let first = self.delay_sites();
        let count = dims.iter().product::<usize>() as u32;
        let most_varying = most.filter(|_| parts.varying);
        self.tables().delays.push(DelayBlock { first, count, source, value, time, most: most_varying });

        let mut slot = |kind: Kind, first: VarId| {
            let slot = self.slots.slot(SlotKey::Variable(kind, first, offset.clone()));
            self.model.templates.arena.slot(slot)
        };
        let (source, value, time) = (slot(Kind::Var, source), slot(Kind::Var, value), slot(Kind::Var, time));
        let most = most.map(|most| slot(Kind::Var, most));
        let delayed = slot(Kind::Delayed, VarId(first));
        let rate = slot(Kind::DelayedRate, VarId(first));
        let arena = &mut self.model.templates.arena;
        let delayed = match parts.varying {
            true => {
                let way = arena.mul(rate, time);
                arena.sub(delayed, way)
            }
            false => delayed,
        };
        self.define(source, parts.value, &dims, &origin);
        match parts.varying {
            true => self.define(time, parts.time, &dims, &origin),
            false => self.emit(Section::Binding, time, parts.time, &dims, &origin),
        }
        if let (Some(most), Some(bound)) = (most, parts.most) {
            self.emit(Section::Binding, most, bound, &dims, &origin);
        }
        self.define(value, delayed, &dims, &origin);
        self.emit(Section::Initial, value, source, &dims, &origin);
        if self.model.templates.arena.as_constant(parts.time).is_none() {
            self.check_time(time, most, &dims, &origin);
        }
        Ok(value)
    }

    /// `assert(0 <= time and time <= most, ...)`
    fn check_time(&mut self, time: NodeId, most: Option<NodeId>, dims: &[usize], origin: &Origin) {
        let call = self.call_text(origin.span);
        let arena = &mut self.model.templates.arena;
        let zero = arena.constant(0.0);
        let mut holds = arena.compare(Relation::LessEqual, zero, time);
        let value = || MessagePart::Value(TextFormat::default(), ValueKind::Real);
        let words = |text: &str| MessagePart::Text(text.into());
        let mut parts = vec![words(&format!("the delay time of `{call}` is ")), value()];
        let mut shown = vec![time];
        match most {
            Some(most) => {
                let below = arena.compare(Relation::LessEqual, time, most);
                holds = arena.and(holds, below);
                parts.extend([words(" s, and may go from 0 s to its upper bound of "), value(), words(" s")]);
                shown.push(most);
            }
            None => parts.push(words(" s, and may not be negative")),
        }
        let shown = arena.argument_list(&shown);
        let beyond = if most.is_some() { " or above its upper bound" } else { "" };
        let text = format!("the delay time of `{call}` is negative{beyond}");
        let message = self.add_message(Message { text: text.into(), parts, error: true });
        self.emit(Section::Assert(message), holds, shown, dims, origin);
    }

    fn give_unit(&mut self, v: VarId, unit: &str) {
        if let Some(block) = self.newest().filter(|block| block.first == v) {
            block.unit = Some(unit.into());
        }
    }

    /// The call as it stands in the text, behind the path of its component.
    fn site_name(&self, span: Span, origin: &Origin) -> String {
        let call = self.call_text(span);
        if origin.path.is_empty() { call } else { format!("{}.{call}", origin.path) }
    }

    pub(crate) fn call_text(&self, span: Span) -> String {
        self.scopes.table.files.snippet(span).split_whitespace().collect::<Vec<_>>().join(" ")
    }
}

/// Position of the element for the counters: fixed ones count once.
pub(crate) fn offset(cx: &Context) -> Result<Affine, Fail> {
    let fixed = cx.fixed.as_ref().map_or(0, Vec::len);
    let mut offset = Affine::constant(0);
    for (k, &size) in cx.loop_counts().iter().enumerate() {
        let at = if k < fixed { Affine::constant(0) } else { Affine::counter(CounterId(k as u32)) };
        offset = scale(&offset, size).add_scaled(&at, 1).ok_or(Fail::NeedsExpansion)?;
    }
    Ok(offset)
}
