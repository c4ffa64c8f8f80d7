//! `sample(start, interval)`: true at the instants `start + k*interval`.
//!
//! Two discrete variables of the translation's own carry it: the next instant, and whether it is due.  `due` rises when
//! `time` reaches the instant before the event, the instant moves on, and `due` falls again in the next pass of the same
//! event, so `sample` is true in one pass only (Modelica 3.6, section 3.7.5).  Inside loops and arrays of components each
//! element has instants of its own.

use hyd_source::{Code, Origin, Span};
use hyd_symbolic::{Function, Node, Relation};
use hyd_syntax::tree::Expr;
use hyd_system::{ValueKind, Variability};

use crate::context::{Context, Fail};
use crate::flatten::Flattener;
use crate::index::{Affine, Kind, SlotKey};
use crate::lower::Typed;
use crate::made::Made;
use crate::model::{Section, VarId};

impl Flattener<'_, '_> {
    pub(crate) fn lower_sample(&mut self, span: Span, list: &[Expr], cx: &mut Context) -> Result<Typed, Fail> {
        let [start, interval] = list else {
            return Err(self.error(Code::BadArguments, span, "`sample` takes the first instant and the interval"));
        };
        let mut turn = cx.fixed.clone().unwrap_or_default();
        turn.extend(cx.windows.iter().flat_map(|window| [window.first, window.stride]));
        let key = (cx.scope.inst, span, turn);
        let due = match self.samples.get(&key) {
            Some(&known) => known,
            None => {
                let made = self.make_sample(span, start, interval, cx)?;
                self.samples.insert(key, made);
                made
            }
        };
        let at = crate::delay::offset(cx)?;
        let now = self.variable_slot(Kind::Var, due, &at);
        let before = self.variable_slot(Kind::Pre, due, &at);
        let arena = &mut self.model.templates.arena;
        let off = arena.not(before);
        Ok(Typed::boolean(arena.and(now, off)))
    }

    fn variable_slot(&mut self, kind: Kind, v: VarId, at: &Affine) -> hyd_symbolic::NodeId {
        let slot = self.slots.slot(SlotKey::Variable(kind, v, at.clone()));
        self.model.templates.arena.slot(slot)
    }

    /// `due = time >= pre(next) and not initial()`, `next = if due and not pre(due) then pre(next) + interval else pre(next)`.
    fn make_sample(&mut self, span: Span, start: &Expr, interval: &Expr, cx: &mut Context) -> Result<VarId, Fail> {
        let origin = Origin { path: self.path(cx.scope.inst), span };
        let first = self.lower(start, cx, &[])?;
        let step = self.lower(interval, cx, &[])?;
        self.want_number(start.span, "`sample`", &first)?;
        self.want_number(interval.span, "`sample`", &step)?;
        let number = self.samples.len() + 1;
        let shape = (ValueKind::Real, Variability::Discrete);
        let dims = cx.loop_counts();
        let at = crate::delay::offset(cx)?;
        let next = self.make(Made::Event, format!("$sample{number}.next"), &dims, shape, origin.clone());
        let (block, _) = self.model.locate(next);
        self.model.variables[block].has_start = true;
        let due = self.made_boolean(format!("$sample{number}.due"), &dims, origin.clone());
        let mut slot = |kind: Kind, v: VarId| self.variable_slot(kind, v, &at);
        let (next_start, next_pre) = (slot(Kind::Start, next), slot(Kind::Pre, next));
        let (next_now, due_now) = (slot(Kind::Var, next), slot(Kind::Var, due));
        let due_pre = slot(Kind::Pre, due);
        let arena = &mut self.model.templates.arena;
        // The first instant at or after the start of the run.
        let (time, zero) = (arena.intern(Node::Time), arena.constant(0.0));
        let passed = arena.sub(time, first.node);
        let turns = arena.div(passed, step.node);
        let whole = arena.call1(Function::Ceil, turns);
        let skipped = arena.call2(Function::Max, whole, zero);
        let way = arena.mul(skipped, step.node);
        let begin = arena.add(first.node, way);
        let reached = arena.event(Relation::GreaterEqual, time, next_pre);
        let initial = arena.intern(Node::Initial);
        let running = arena.not(initial);
        let is_due = arena.and(reached, running);
        let was = arena.not(due_pre);
        let rises = arena.and(due_now, was);
        let later = arena.add(next_pre, step.node);
        let moved = arena.select(rises, later, next_pre);
        self.emit(Section::Start, next_start, begin, &dims, &origin);
        self.emit(Section::Discrete, due_now, is_due, &dims, &origin);
        self.emit(Section::Discrete, next_now, moved, &dims, &origin);
        Ok(due)
    }
}
