//! What operators of clocks give: equations between the variables of partitions.

use hyd_flat::{ClockKind, FlatModel, Section, Target, VarId};
use hyd_source::Origin;
use hyd_symbolic::{Node, NodeId, Relation};

use crate::equations::Slots;
use crate::partition::{Partitions, elements};
use crate::ticks::{Tick, Ticks};

/// The equations of all operators.
pub(crate) fn relate(flat: &mut FlatModel, partitions: &Partitions, ticks: &Ticks) {
    for operator in flat.clocks.clone() {
        let origin = &operator.origin;
        for (value, source, _) in elements(&operator) {
            let tick = ticks.of_variable(partitions, value);
            match (&operator.kind, source, tick) {
                (ClockKind::Hold, Some(source), _) => {
                    let mut slots = Slots::default();
                    let held = slots.read(flat, Target::Var(source));
                    slots.define(flat, Section::Discrete, Target::Var(value), held, origin);
                }
                (ClockKind::Sample, Some(source), Some(tick)) => {
                    given(flat, (value, tick), Target::Pre(source), origin)
                }
                (
                    ClockKind::NoClock
                    | ClockKind::Sub(_)
                    | ClockKind::Super(_)
                    | ClockKind::Shift(..)
                    | ClockKind::Back(..),
                    Some(source),
                    Some(tick),
                ) if !partitions.is_clock(value) => given(flat, (value, tick), Target::Var(source), origin),
                (ClockKind::Interval, _, Some(tick)) => {
                    let mut slots = Slots::default();
                    let interval = interval(flat, &mut slots, tick);
                    slots.at_tick(flat, (value, tick.tick), interval, origin);
                }
                (ClockKind::FirstTick, _, Some(tick)) => {
                    let mut slots = Slots::default();
                    let first = is_first(flat, &mut slots, tick);
                    slots.at_tick(flat, (value, tick.tick), first, origin);
                }
                (ClockKind::Clock, _, Some(tick)) => {
                    let mut slots = Slots::default();
                    let ticks = slots.read(flat, Target::Var(tick.tick));
                    slots.define(flat, Section::Discrete, Target::Var(value), ticks, origin);
                }
                _ => {}
            }
        }
    }
}

/// `value = if tick then what else pre(value)`
fn given(flat: &mut FlatModel, (value, tick): (VarId, &Tick), what: Target, origin: &Origin) {
    let mut slots = Slots::default();
    let given = slots.read(flat, what);
    slots.at_tick(flat, (value, tick.tick), given, origin);
}

/// The time since the tick before, in s; 0 at the first one where nobody knows.
pub(crate) fn interval(flat: &mut FlatModel, slots: &mut Slots, tick: &Tick) -> NodeId {
    let Some(last) = tick.last else {
        return flat.templates.arena.constant(tick.interval.unwrap_or(0.0));
    };
    let first = is_first(flat, slots, tick);
    let before = slots.read(flat, Target::Pre(last));
    let arena = &mut flat.templates.arena;
    let (time, zero) = (arena.intern(Node::Time), arena.constant(0.0));
    let since = arena.sub(time, before);
    arena.select(first, zero, since)
}

fn is_first(flat: &mut FlatModel, slots: &mut Slots, tick: &Tick) -> NodeId {
    let before = slots.read(flat, Target::Pre(tick.count));
    let half = flat.templates.arena.constant(0.5);
    flat.templates.arena.compare(Relation::Less, before, half)
}
