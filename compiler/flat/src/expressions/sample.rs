//! `sample(start, interval)`: true at the instants `start + k*interval`.
//!
//! Two discrete variables of the translation's own carry it: how many instants have passed, and whether one is due.  `due` is
//! true when `time` reaches the instant that comes next, the count goes on, and `due` falls again in the next pass of the
//! same event, so `sample` is true in one pass only (Modelica 3.6, section 3.7.5).  The instant is computed from the
//! count, because a running sum would wander off.  Inside loops and arrays of components each element has instants of its own.

use hyd_instance::InstId;
use hyd_source::{Code, Diagnostic, Origin, Span};
use hyd_symbolic::{Function, Node, NodeId, Relation};
use hyd_system::{TextFormat, ValueKind, Variability};

use crate::model::{Message, MessagePart, Section, VarId};
use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::{Affine, Kind, SlotKey};
use crate::state::made::Made;
use crate::state::node::Typed;

/// An instant this part of the times it is computed from before the start of the run is at the start.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// What a sample belongs to: the instance, the text, the turn of the loops around.
pub(crate) type SampleKey = (InstId, Span, Vec<i64>);

impl Flattener<'_, '_> {
    /// `start` and `interval`: their texts and values.
    pub(crate) fn sample(
        &mut self,
        span: Span,
        start: (Span, Typed),
        interval: (Span, Typed),
        cx: &Context,
    ) -> Result<Typed, Fail> {
        let mut turn = cx.fixed.clone().unwrap_or_default();
        turn.extend(cx.windows.iter().flat_map(|window| [window.first, window.stride]));
        let key = (cx.scope.inst, span, turn);
        let known = self.all_notes().find_map(|notes| notes.samples.get(&key).copied());
        let due = match known {
            Some(known) => known,
            None => {
                let made = self.make_sample(span, start, interval, cx)?;
                self.tables().notes.samples.insert(key, made);
                made
            }
        };
        let at = crate::expressions::delay::offset(cx)?;
        Ok(Typed::boolean(self.variable_slot(Kind::Var, due, &at)))
    }

    fn variable_slot(&mut self, kind: Kind, v: VarId, at: &Affine) -> hyd_symbolic::NodeId {
        let slot = self.slots.slot(SlotKey::Variable(kind, v, at.clone()));
        self.model.templates.arena.slot(slot)
    }

    /// `due = time >= start + pre(turn)*interval and not initial()`, `turn = if due then pre(turn) + 1 else pre(turn)`.
    fn make_sample(
        &mut self,
        span: Span,
        (start, first): (Span, Typed),
        (interval, step): (Span, Typed),
        cx: &Context,
    ) -> Result<VarId, Fail> {
        let origin = Origin { path: self.path(cx.scope.inst), span };
        self.want_number(start, "`sample`", &first)?;
        self.want_number(interval, "`sample`", &step)?;
        for (part, value, what) in [(start, &first, "first instant"), (interval, &step, "interval")] {
            if !self.is_fixed(value.node) {
                let message = format!("the {what} of `sample` must be known before the run");
                let fault = Diagnostic::error(Code::NotStructural, message).at(part, "this changes during the run");
                self.report(fault.help("a relation like `time >= pre(next)` has instants that the run decides"));
                return Err(Fail::Reported);
            }
        }
        let number = self.all_notes().map(|notes| notes.samples.len()).sum::<usize>() + 1;
        let shape = (ValueKind::Real, Variability::Discrete);
        let dims = cx.loop_counts();
        let at = crate::expressions::delay::offset(cx)?;
        let turn = self.make(Made::Event, format!("$sample{number}.turn"), &dims, shape, origin.clone());
        if let Some(block) = self.newest() {
            block.has_start = true;
        }
        let due = self.made_boolean(format!("$sample{number}.due"), &dims, origin.clone());
        let mut slot = |kind: Kind, v: VarId| self.variable_slot(kind, v, &at);
        let (turn_start, turn_pre) = (slot(Kind::Start, turn), slot(Kind::Pre, turn));
        let (turn_now, due_now) = (slot(Kind::Var, turn), slot(Kind::Var, due));
        let proper = self.check_sample((span, interval), &step, cx.holds, &dims, &origin)?;
        let arena = &mut self.model.templates.arena;
        let (zero, one) = (arena.constant(0.0), arena.constant(1.0));
        // The first instant at or after the start of the run; one that coincides with it but for rounding counts.
        let time = arena.intern(Node::Time);
        let passed = arena.sub(time, first.node);
        let (now, from) = (arena.call1(Function::Abs, time), arena.call1(Function::Abs, first.node));
        let scale = arena.call2(Function::Max, now, from);
        let rounding = arena.constant(ROUNDING);
        let slack = arena.mul(rounding, scale);
        let left = arena.sub(passed, slack);
        let turns = arena.div(left, step.node);
        let whole = arena.call1(Function::Ceil, turns);
        let skipped = arena.call2(Function::Max, whole, zero);
        let begin = arena.select(proper, skipped, zero);
        let way = arena.mul(turn_pre, step.node);
        let instant = arena.add(first.node, way);
        let reached = arena.event(Relation::GreaterEqual, time, instant);
        let initial = arena.intern(Node::Initial);
        let running = arena.not(initial);
        let reached = arena.and(reached, proper);
        let is_due = arena.and(reached, running);
        let later = arena.add(turn_pre, one);
        let moved = arena.select(due_now, later, turn_pre);
        self.emit(Section::Start, turn_start, begin, &dims, &origin);
        self.emit(Section::Discrete, due_now, is_due, &dims, &origin);
        self.emit(Section::Discrete, turn_now, moved, &dims, &origin);
        Ok(due)
    }

    /// That the interval is a positive number: refused here where its value is known, asserted of the run otherwise (`holds`: where the
    /// place is reached).
    fn check_sample(
        &mut self,
        (span, at): (Span, Span),
        step: &Typed,
        holds: Option<NodeId>,
        dims: &[usize],
        origin: &Origin,
    ) -> Result<NodeId, Fail> {
        let call = self.call_text(span);
        let arena = &mut self.model.templates.arena;
        if let Some(value) = arena.as_constant(step.node).filter(|_| holds.is_none()) {
            return match value > 0.0 && value.is_finite() {
                true => Ok(arena.constant(1.0)),
                false => {
                    let message = format!("the interval of `{call}` is {value}, and must be a positive number");
                    Err(self.error(Code::BadArguments, at, message))
                }
            };
        }
        let (zero, most) = (arena.constant(0.0), arena.constant(f64::MAX));
        let positive = arena.compare(Relation::Greater, step.node, zero);
        let finite = arena.compare(Relation::LessEqual, step.node, most);
        let proper = arena.and(positive, finite);
        let shown = arena.argument_list(&[step.node]);
        let (before, after) = (format!("the interval of `{call}` is "), ", and must be a positive number".to_string());
        let parts = vec![
            MessagePart::Text(before.clone().into()),
            MessagePart::Value(TextFormat::default(), ValueKind::Real),
            MessagePart::Text(after.clone().into()),
        ];
        let message = self.add_message(Message { text: format!("{before}no{after}").into(), parts, error: true });
        let arena = &mut self.model.templates.arena;
        let wanted = match holds {
            Some(holds) => {
                let idle = arena.not(holds);
                arena.or(idle, proper)
            }
            None => proper,
        };
        self.emit(Section::Assert(message), wanted, shown, dims, origin);
        Ok(proper)
    }
}
