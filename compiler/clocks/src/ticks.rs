//! When clocks tick: discrete variables that are true in one pass of an event.
//!
//! All rates of one base share an event per instant.  Each counts its ticks; the next instant is the first of the next ticks of all, in
//! whole multiples of the largest interval of which all intervals and shifts are multiples.  So clocks that tick together do so in the
//! same pass, and no sum of intervals wanders off.  `due` is true when `time` reaches the instant and false again in the next pass,
//! because the counts have gone on (as in `sample(start, interval)`).

use hyd_flat::{ClockKind, FlatModel, Section, Target, VarId};
use hyd_index::IndexVec;
use hyd_source::Origin;
use hyd_symbolic::{Function, Node, NodeId, Relation};
use hyd_system::{ValueKind, Variability};
use rustc_hash::{FxHashMap, FxHashSet};

use crate::equations::{Slots, variable};
use crate::partition::{PartitionId, Partitions, elements, is_running};
use crate::rates::{Base, Rate, Rates};
use crate::ratio::Ratio;

/// The ticks of one rate.
#[derive(Clone, Debug)]
pub(crate) struct Tick {
    /// True in the pass of a tick.
    pub tick: VarId,
    /// Number of ticks so far.
    pub count: VarId,
    /// The interval in s; `None` where it varies.
    pub interval: Option<f64>,
    /// When it ticked last, where the interval varies.
    pub last: Option<VarId>,
}

/// The ticks of all partitions.
pub(crate) struct Ticks {
    of: IndexVec<PartitionId, Option<Tick>>,
    pub methods: IndexVec<PartitionId, Option<std::sync::Arc<str>>>,
}

impl Ticks {
    pub(crate) fn of(&self, partition: PartitionId) -> Option<&Tick> {
        self.of[partition].as_ref()
    }

    /// The ticks of a variable that has a clock.
    pub(crate) fn of_variable(&self, partitions: &Partitions, v: VarId) -> Option<&Tick> {
        self.of(partitions.of[v])
    }
}

/// A rate, its variables, and the text that it is of.
struct Entry {
    rate: Rate,
    tick: Tick,
    origin: Origin,
}

pub(crate) fn make(flat: &mut FlatModel, partitions: &Partitions, rates: &Rates) -> Ticks {
    let mut texts: IndexVec<PartitionId, Option<Origin>> = IndexVec::filled(None, partitions.clocked.len());
    for operator in &flat.clocks {
        for (value, _, _) in elements(operator) {
            texts[partitions.of[value]].get_or_insert_with(|| operator.origin.clone());
        }
    }
    let mut entries: Vec<Entry> = Vec::new();
    let mut of = IndexVec::filled(None, partitions.clocked.len());
    for (partition, rate) in rates.of.iter_enumerated() {
        let Some(rate) = *rate else { continue };
        let known = entries.iter().position(|entry| entry.rate == rate);
        let at = known.unwrap_or_else(|| {
            let number = entries.len() + 1;
            let origin = texts[partition].clone().or_else(|| flat.clocks.first().map(|own| own.origin.clone()));
            let origin = origin.expect("invariant: rates follow from operators of clocks");
            let tick = variable(flat, format!("$clock{number}.tick"), ValueKind::Boolean, &origin);
            let count = variable(flat, format!("$clock{number}.count"), ValueKind::Real, &origin);
            let interval = rate.base.seconds().map(|unit| unit * rate.interval.above() / rate.interval.below());
            let last = interval.is_none().then(|| {
                let last = variable(flat, format!("$clock{number}.last"), ValueKind::Real, &origin);
                flat.variables.raw.last_mut().expect("invariant: made above").unit = Some("s".into());
                last
            });
            entries.push(Entry { rate, tick: Tick { tick, count, interval, last }, origin });
            entries.len() - 1
        });
        of[partition] = Some(entries[at].tick.clone());
    }
    let mut bases: Vec<Base> = Vec::new();
    for entry in &entries {
        if !bases.contains(&entry.rate.base) {
            bases.push(entry.rate.base);
        }
    }
    for (number, base) in bases.into_iter().enumerate() {
        let own: Vec<&Entry> = entries.iter().filter(|entry| entry.rate.base == base).collect();
        match base {
            Base::Condition(condition) => {
                let seen = listens_to_itself(flat, partitions, rates, condition);
                of_condition(flat, (number + 1, seen), condition, &own);
            }
            Base::Second | Base::Interval(_) => of_time(flat, number + 1, base, &own),
        }
    }
    for entry in &entries {
        counted(flat, entry);
    }
    Ticks { of, methods: rates.methods.clone() }
}

/// `count = if tick then pre(count) + 1 else pre(count)`, and when it ticked last.
fn counted(flat: &mut FlatModel, entry: &Entry) {
    let Entry { tick: Tick { tick, count, last, .. }, origin, .. } = entry;
    let mut slots = Slots::default();
    let before = slots.read(flat, Target::Pre(*count));
    let one = flat.templates.arena.constant(1.0);
    let more = flat.templates.arena.add(before, one);
    slots.at_tick(flat, (*count, *tick), more, origin);
    if let Some(last) = last {
        let time = flat.templates.arena.intern(Node::Time);
        Slots::default().at_tick(flat, (*last, *tick), time, origin);
    }
}

/// The number of units at which an entry ticks next: `shift + pre(count)*interval`.
fn next(flat: &mut FlatModel, slots: &mut Slots, entry: &Entry, unit: Ratio) -> NodeId {
    let before = slots.read(flat, Target::Pre(entry.tick.count));
    let whole = |ratio: Ratio| ratio.over(unit).map_or(0.0, Ratio::value);
    let (interval, shift) = (whole(entry.rate.interval), whole(entry.rate.shift));
    let arena = &mut flat.templates.arena;
    let (interval, shift) = (arena.constant(interval), arena.constant(shift));
    let way = arena.mul(before, interval);
    arena.add(way, shift)
}

/// Clocks whose times are known before.
fn of_time(flat: &mut FlatModel, number: usize, base: Base, entries: &[&Entry]) {
    let origin = &entries[0].origin;
    let parts = entries.iter().flat_map(|entry| [entry.rate.interval, entry.rate.shift]);
    // Where numbers leave the exact range, times are near enough.
    let unit = parts.fold(Ratio::ZERO, |unit, part| unit.common(part).unwrap_or(unit));
    let begin = variable(flat, format!("$clocks{number}.begin"), ValueKind::Real, origin);
    let due = variable(flat, format!("$clocks{number}.due"), ValueKind::Boolean, origin);
    if let Some(block) = flat.variables.raw.iter_mut().rev().find(|block| block.first == begin) {
        (block.has_start, block.unit) = (true, Some("s".into()));
    }
    let time = flat.templates.arena.intern(Node::Time);
    Slots::default().define(flat, Section::Start, Target::Start(begin), time, origin);
    let mut slots = Slots::default();
    let kept = slots.read(flat, Target::Pre(begin));
    slots.define(flat, Section::Discrete, Target::Var(begin), kept, origin);

    // Several clocks have a variable for the one that comes first, so that each is compared with it alone.
    let first = match entries {
        [_] => None,
        _ => {
            let first = variable(flat, format!("$clocks{number}.next"), ValueKind::Real, origin);
            let mut slots = Slots::default();
            let all: Vec<NodeId> = entries.iter().map(|entry| next(flat, &mut slots, entry, unit)).collect();
            let arena = &mut flat.templates.arena;
            let least = all.into_iter().reduce(|a, b| arena.call2(Function::Min, a, b));
            let least = least.unwrap_or_else(|| arena.constant(0.0));
            slots.define(flat, Section::Discrete, Target::Var(first), least, origin);
            Some(first)
        }
    };
    let mut slots = Slots::default();
    let instant = match first {
        Some(first) => slots.read(flat, Target::Var(first)),
        None => next(flat, &mut slots, entries[0], unit),
    };
    let start = slots.read(flat, Target::Pre(begin));
    let seconds = base.seconds().unwrap_or(1.0);
    let arena = &mut flat.templates.arena;
    let (above, below) = (arena.constant(seconds * unit.above()), arena.constant(unit.below()));
    let way = arena.mul(instant, above);
    let way = arena.div(way, below);
    let instant = arena.add(start, way);
    let reached = arena.event(Relation::GreaterEqual, time, instant);
    let initial = arena.intern(Node::Initial);
    let running = arena.not(initial);
    let is_due = arena.and(reached, running);
    slots.define(flat, Section::Discrete, Target::Var(due), is_due, origin);

    for entry in entries {
        let mut slots = Slots::default();
        let mut tick = slots.read(flat, Target::Var(due));
        if let Some(first) = first {
            let own = next(flat, &mut slots, entry, unit);
            let first = slots.read(flat, Target::Var(first));
            let arena = &mut flat.templates.arena;
            let is_first = arena.compare(Relation::LessEqual, own, first);
            tick = arena.and(tick, is_first);
        }
        slots.define(flat, Section::Discrete, Target::Var(entry.tick.tick), tick, &entry.origin);
    }
}

/// True if the condition of a clock follows, through discrete variables alone, from what is held of its own ticks.
fn listens_to_itself(flat: &FlatModel, partitions: &Partitions, rates: &Rates, condition: VarId) -> bool {
    let is_discrete = |v: VarId| flat.variables[flat.locate(v).0].variability == Variability::Discrete;
    let is_of_it = |source: VarId| {
        let rate = rates.of[partitions.of[source]];
        rate.is_some_and(|rate| rate.base == Base::Condition(condition))
    };
    let holds = flat.clocks.iter().filter(|own| own.kind == ClockKind::Hold).flat_map(elements);
    let held: FxHashSet<VarId> =
        holds.filter_map(|(value, source, _)| source.filter(|&source| is_of_it(source)).map(|_| value)).collect();
    if held.is_empty() {
        return false;
    }
    let mut readers: FxHashMap<VarId, Vec<Vec<VarId>>> = FxHashMap::default();
    for block in flat.equations.iter().filter(|block| is_running(block.section)) {
        let arity = flat.templates.get(block.template).arity as usize;
        for k in 0..block.count as usize {
            let operands = block.operands_of(k, arity).iter();
            let own: Vec<VarId> = operands
                .filter_map(|operand| match operand.target() {
                    Target::Var(v) if is_discrete(v) => Some(v),
                    _ => None,
                })
                .collect();
            for &v in &own {
                readers.entry(v).or_default().push(own.clone());
            }
        }
    }
    let mut reached = FxHashSet::from_iter([condition]);
    let mut open = vec![condition];
    while let Some(v) = open.pop() {
        if held.contains(&v) {
            return true;
        }
        for &next in readers.get(&v).into_iter().flatten().flatten() {
            if reached.insert(next) {
                open.push(next);
            }
        }
    }
    false
}

/// Clocks that tick where a Boolean becomes true; in the pass after it, if that follows from what ticks then (`late`).
fn of_condition(flat: &mut FlatModel, (number, late): (usize, bool), condition: VarId, entries: &[&Entry]) {
    let origin = &entries[0].origin;
    let due = variable(flat, format!("$clocks{number}.due"), ValueKind::Boolean, origin);
    let count = variable(flat, format!("$clocks{number}.count"), ValueKind::Real, origin);
    let mut slots = Slots::default();
    // What is true at the start ticks there.
    let seen = variable(flat, format!("$clocks{number}.seen"), ValueKind::Boolean, origin);
    let is_true = if late { Target::Pre(condition) } else { Target::Var(condition) };
    let mut own = Slots::default();
    let now = own.read(flat, is_true);
    let arena = &mut flat.templates.arena;
    let initial = arena.intern(Node::Initial);
    let running = arena.not(initial);
    let now = arena.and(now, running);
    own.define(flat, Section::Discrete, Target::Var(seen), now, origin);
    let (now, before) = (slots.read(flat, is_true), slots.read(flat, Target::Pre(seen)));
    let arena = &mut flat.templates.arena;
    let initial = arena.intern(Node::Initial);
    let (was_false, running) = (arena.not(before), arena.not(initial));
    let rises = arena.and(now, was_false);
    let is_due = arena.and(rises, running);
    slots.define(flat, Section::Discrete, Target::Var(due), is_due, origin);
    let mut slots = Slots::default();
    let before = slots.read(flat, Target::Pre(count));
    let one = flat.templates.arena.constant(1.0);
    let more = flat.templates.arena.add(before, one);
    slots.at_tick(flat, (count, due), more, origin);
    for entry in entries {
        let mut slots = Slots::default();
        let due = slots.read(flat, Target::Var(due));
        let so_far = slots.read(flat, Target::Pre(count));
        let own = next(flat, &mut slots, entry, Ratio::ONE);
        let arena = &mut flat.templates.arena;
        let is_own = arena.compare(Relation::LessEqual, own, so_far);
        let tick = arena.and(due, is_own);
        slots.define(flat, Section::Discrete, Target::Var(entry.tick.tick), tick, &entry.origin);
    }
}
