//! Which variables share a clock: those that stand in the same equations.

use hyd_flat::{ClockKind, ClockOperator, FlatModel, Operand, Section, Target, VarId};
use hyd_index::{IndexVec, TypedIndex, typed_index};
use hyd_source::{Code, Diagnostic};
use hyd_system::Variability;
use rustc_hash::FxHashSet;

typed_index!(
    /// A set of variables that share a clock, or that have none.
    PartitionId,
    "p"
);

/// The partitions of a model.
pub(crate) struct Partitions {
    /// Partition of each scalar variable.
    pub of: IndexVec<VarId, PartitionId>,
    /// Whether it has a clock.
    pub clocked: IndexVec<PartitionId, bool>,
    /// For variables that vary during the run.
    varies: IndexVec<VarId, bool>,
    /// For variables that are clocks, which say no more than when they tick.
    are_clocks: IndexVec<VarId, bool>,
}

/// Sets that are joined.
struct Sets(Vec<u32>);

impl Sets {
    fn find(&mut self, v: u32) -> u32 {
        let mut root = v;
        while self.0[root as usize] != root {
            root = self.0[root as usize];
        }
        let mut at = v;
        while self.0[at as usize] != root {
            at = std::mem::replace(&mut self.0[at as usize], root);
        }
        root
    }

    fn join(&mut self, a: VarId, b: VarId) {
        let (a, b) = (self.find(a.0), self.find(b.0));
        // The lower one stays, so that numbers follow the text.
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// The variable that a slot reads during the run: its value, rate or value from before.
pub(crate) fn variable_of(operand: Operand) -> Option<VarId> {
    match operand.target() {
        Target::Var(v) | Target::Der(v) | Target::Pre(v) => Some(v),
        _ => None,
    }
}

/// Elements of an operator: value, source and clock of each.
pub(crate) fn elements(
    operator: &ClockOperator,
) -> impl Iterator<Item = (VarId, Option<VarId>, Option<VarId>)> + use<> {
    let (value, source, clock) = (operator.value, operator.source, operator.clock);
    let nth = |first: VarId, k: u32| VarId(first.0 + k);
    (0..operator.count).map(move |k| (nth(value, k), source.map(|v| nth(v, k)), clock.map(|v| nth(v, k))))
}

/// True for equations that hold during the run, always or at ticks.
pub(crate) fn is_running(section: Section) -> bool {
    matches!(section, Section::Continuous | Section::Discrete)
}

impl Partitions {
    pub(crate) fn of(flat: &FlatModel) -> Self {
        let mut varies = IndexVec::filled(false, flat.scalars as usize);
        for block in flat.variables.iter().filter(|block| block.variability > Variability::Parameter) {
            (0..block.count).for_each(|k| varies[VarId(block.first.0 + k)] = true);
        }
        let mut sets = Sets((0..flat.scalars).collect());
        for block in flat.equations.iter().filter(|block| is_running(block.section)) {
            let arity = flat.templates.get(block.template).arity as usize;
            for k in 0..block.count as usize {
                let mut own = block.operands_of(k, arity).iter().filter_map(|&o| variable_of(o)).filter(|&v| varies[v]);
                let Some(first) = own.next() else { continue };
                own.for_each(|v| sets.join(first, v));
            }
        }
        for &(at, clock, count) in &flat.clocked {
            let block = &flat.equations[at as usize];
            let arity = flat.templates.get(block.template).arity as usize;
            let each = (block.count / count.max(1)).max(1);
            for k in 0..block.count {
                let clock = VarId(clock.0 + (k / each).min(count.saturating_sub(1)));
                let own = block.operands_of(k as usize, arity).iter().filter_map(|&o| variable_of(o));
                own.filter(|&v| varies[v]).for_each(|v| sets.join(clock, v));
            }
        }
        for operator in &flat.clocks {
            for (value, source, clock) in elements(operator) {
                if let Some(clock) = clock {
                    sets.join(value, clock);
                }
                if let (ClockKind::Interval | ClockKind::FirstTick, Some(source)) = (&operator.kind, source) {
                    sets.join(value, source);
                }
            }
        }
        let mut number = vec![None; flat.scalars as usize];
        let mut partitions = 0;
        let of: Vec<PartitionId> = (0..flat.scalars)
            .map(|v| {
                let root = sets.find(v) as usize;
                *number[root].get_or_insert_with(|| {
                    partitions += 1;
                    PartitionId::new(partitions - 1)
                })
            })
            .collect();
        let of = IndexVec::from_vec(of);
        let mut clocked = IndexVec::filled(false, partitions);
        for operator in &flat.clocks {
            for (value, source, _) in elements(operator) {
                let (is_value, is_source) = sides(&operator.kind);
                clocked[of[value]] |= is_value;
                if let Some(source) = source {
                    clocked[of[source]] |= is_source;
                }
            }
        }
        let mut are_clocks = IndexVec::filled(false, flat.scalars as usize);
        for operator in flat.clocks.iter().filter(|operator| operator.kind == ClockKind::Clock) {
            elements(operator).for_each(|(value, ..)| are_clocks[value] = true);
        }
        Self { of, clocked, varies, are_clocks }
    }

    /// True for a variable that is a clock.
    pub(crate) fn is_clock(&self, v: VarId) -> bool {
        self.are_clocks.get(v).copied().unwrap_or(false)
    }

    /// The partition of a variable that has a clock.
    pub(crate) fn clocked_of(&self, v: VarId) -> Option<PartitionId> {
        self.of.get(v).copied().filter(|&p| self.clocked[p] && self.varies[v])
    }

    /// The partition of the variables that an equation reads.
    pub(crate) fn of_equation(&self, operands: &[Operand]) -> Option<PartitionId> {
        operands.iter().filter_map(|&operand| variable_of(operand)).find_map(|v| self.clocked_of(v))
    }

    /// Values that have a clock where there must be none, and arrays of which only some elements have one.
    pub(crate) fn faults(&self, flat: &FlatModel) -> Vec<Diagnostic> {
        let mut faults = Vec::new();
        for operator in &flat.clocks {
            for (value, source, _) in elements(operator) {
                let text = match (&operator.kind, source) {
                    (ClockKind::Hold, _) if self.clocked[self.of[value]] => {
                        "`hold` gives a value that holds at all times, but it stands in an equation of a clock"
                    }
                    (ClockKind::Sample, Some(source)) if self.clocked[self.of[source]] => {
                        "`sample` takes a value that holds at all times, but this has a clock"
                    }
                    (ClockKind::Condition, Some(source)) if self.clocked[self.of[source]] => {
                        "the condition of a clock must hold at all times, but this has a clock"
                    }
                    _ => continue,
                };
                let help = match operator.kind {
                    ClockKind::Hold => "`sample(hold(x))` comes back to a clock; within one clock `x` itself is meant",
                    ClockKind::Sample => {
                        "`hold` makes such a value of a clocked one; `subSample`, `superSample` and `noClock` go from clock to clock"
                    }
                    _ => "`hold` makes such a value of a clocked one",
                };
                faults.push(Diagnostic::error(Code::Clock, text).at(operator.origin.span, "").help(help));
                break;
            }
        }
        faults.extend(self.set_at_events(flat));
        for block in flat.variables.iter().filter(|block| block.variability > Variability::Parameter) {
            let mut own = (0..block.count).map(|k| self.clocked_of(VarId(block.first.0 + k)).is_some());
            let first = own.next();
            if let Some(k) = own.position(|clocked| Some(clocked) != first) {
                let (a, b) = (block.name.element(0), block.name.element(k + 1));
                let (with, without) = if first == Some(true) { (a, b) } else { (b, a) };
                let text = format!(
                    "`{with}` has a clock and `{without}` has none: elements of an array that differ in that are not supported"
                );
                faults.push(Diagnostic::error(Code::Clock, text).at(block.origin.span, "declared here"));
            }
        }
        faults
    }
}

impl Partitions {
    /// Variables that a `when` of events sets, or of which `pre` is asked, and that stand in equations of a clock; each told once.
    fn set_at_events(&self, flat: &FlatModel) -> Vec<Diagnostic> {
        let asked = flat.clocks.iter().filter(|operator| operator.kind == ClockKind::Previous).flat_map(elements);
        let asked: FxHashSet<VarId> = asked.map(|(value, ..)| value).collect();
        let mut told: FxHashSet<VarId> = FxHashSet::default();
        let mut faults = Vec::new();
        for block in flat.equations.iter().filter(|block| is_running(block.section)) {
            for operand in &block.operands {
                let Target::Pre(v) = operand.target() else { continue };
                let (of, k) = flat.locate(v);
                let of = &flat.variables[of];
                if of.made.is_some() || asked.contains(&v) || self.clocked_of(v).is_none() || !told.insert(v) {
                    continue;
                }
                let name = of.name.element(k);
                let message = format!("`{name}` changes at events, but it stands in an equation of a clock");
                let fault = Diagnostic::error(Code::Clock, message).at(block.origin.span, "");
                let help = format!(
                    "`sample({name})` is its value before a tick; what `pre` is of events `previous` is of ticks"
                );
                faults.push(fault.with(of.origin.span, "declared here").help(help));
            }
        }
        faults
    }
}

/// Whether the value and the source of an operator have clocks for that.
fn sides(kind: &ClockKind) -> (bool, bool) {
    match kind {
        ClockKind::Hold => (false, true),
        ClockKind::Sample | ClockKind::Condition | ClockKind::NoClock => (true, false),
        ClockKind::Clock | ClockKind::Exact(..) | ClockKind::Period(_) | ClockKind::Previous => (true, false),
        ClockKind::Solver(_)
        | ClockKind::Sub(_)
        | ClockKind::Super(_)
        | ClockKind::Shift(..)
        | ClockKind::Back(..)
        | ClockKind::Interval
        | ClockKind::FirstTick => (true, true),
    }
}
