//! When each partition ticks: clocks that the text constructs, handed on along the operators between partitions.
//!
//! A rate is a base, an interval and the first tick, the last two as fractions of the unit of the base: of a second, of the interval of
//! a clock whose interval is a Real, or of one tick of a condition.

use hyd_flat::{ClockKind, ClockOperator, FlatModel, VarId};
use hyd_index::IndexVec;
use hyd_source::{Code, Diagnostic, Origin};
use std::sync::Arc;

use crate::partition::{PartitionId, Partitions, elements};
use crate::ratio::Ratio;

/// What a rate counts.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) enum Base {
    /// Seconds.
    Second,
    /// Intervals of so many seconds (the bits of the number).
    Interval(u64),
    /// Times at which this Boolean becomes true.
    Condition(VarId),
}

impl Base {
    /// Its unit in s.
    pub(crate) fn seconds(self) -> Option<f64> {
        match self {
            Base::Second => Some(1.0),
            Base::Interval(bits) => Some(f64::from_bits(bits)),
            Base::Condition(_) => None,
        }
    }
}

/// When a partition ticks.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) struct Rate {
    pub base: Base,
    pub interval: Ratio,
    /// The first tick.
    pub shift: Ratio,
}

/// Rates and solver methods of all partitions that have a clock.
pub(crate) struct Rates {
    pub of: IndexVec<PartitionId, Option<Rate>>,
    pub methods: IndexVec<PartitionId, Option<Arc<str>>>,
}

/// An operator between two partitions.
struct Relation<'m> {
    kind: &'m ClockKind,
    source: PartitionId,
    value: PartitionId,
    origin: &'m Origin,
}

/// Why a rate does not follow.
enum Fault {
    /// The numbers leave the exact range, or a factor is not whole.
    Number,
    /// It would have to tick before the start, or between ticks of a condition.
    Early,
    Between,
}

pub(crate) fn infer(flat: &FlatModel, partitions: &Partitions, diagnostics: &mut Vec<Diagnostic>) -> Rates {
    let count = partitions.clocked.len();
    let mut rates = Rates { of: IndexVec::filled(None, count), methods: IndexVec::filled(None, count) };
    let mut origins: IndexVec<PartitionId, Option<&Origin>> = IndexVec::filled(None, count);
    let mut relations = Vec::new();
    for operator in &flat.clocks {
        for (value, source, _) in elements(operator) {
            let own = partitions.of[value];
            if let Some(rate) = constructed(operator, source) {
                match rates.of[own].filter(|&known| known != rate) {
                    Some(_) => diagnostics.push(two_clocks(&operator.origin, origins[own])),
                    None => (rates.of[own], origins[own]) = (Some(rate), Some(&operator.origin)),
                }
            }
            if let ClockKind::Solver(method) = &operator.kind {
                rates.methods[own] = Some(method.clone());
            }
            let relates = matches!(
                operator.kind,
                ClockKind::Solver(_)
                    | ClockKind::Sub(_)
                    | ClockKind::Super(_)
                    | ClockKind::Shift(..)
                    | ClockKind::Back(..)
            );
            if let Some(source) = source.filter(|_| relates) {
                let (kind, origin) = (&operator.kind, &operator.origin);
                relations.push(Relation { kind, source: partitions.of[source], value: own, origin });
            }
        }
    }
    hand_on(&mut rates, &mut origins, &relations, diagnostics);
    if diagnostics.is_empty() {
        unknown(flat, partitions, &rates, &relations, diagnostics);
    }
    rates
}

/// The rate of a clock that an operator constructs.
fn constructed(operator: &ClockOperator, source: Option<VarId>) -> Option<Rate> {
    let (base, interval) = match (&operator.kind, source) {
        (ClockKind::Exact(counter, resolution), _) => {
            (Base::Second, Ratio::new(i128::from(*counter), i128::from(*resolution))?)
        }
        (ClockKind::Period(seconds), _) => (Base::Interval(seconds.to_bits()), Ratio::ONE),
        (ClockKind::Condition, Some(source)) => (Base::Condition(source), Ratio::ONE),
        _ => return None,
    };
    Some(Rate { base, interval, shift: Ratio::ZERO })
}

/// Hands rates on until nothing new follows; each relation is judged once both sides are known.
fn hand_on<'m>(
    rates: &mut Rates,
    origins: &mut IndexVec<PartitionId, Option<&'m Origin>>,
    relations: &[Relation<'m>],
    diagnostics: &mut Vec<Diagnostic>,
) {
    let mut judged = vec![false; relations.len()];
    let mut changed = true;
    while changed {
        changed = false;
        for (relation, judged) in relations.iter().zip(&mut judged).filter(|(_, judged)| !**judged) {
            let (source, value) = (rates.of[relation.source], rates.of[relation.value]);
            let (target, found) = match (source, value) {
                (Some(source), Some(value)) => {
                    *judged = true;
                    changed = true;
                    if !agrees(relation.kind, source, value) {
                        diagnostics.push(contradiction(relation, source, value));
                    }
                    continue;
                }
                (Some(source), None) => (relation.value, forward(relation.kind, source)),
                (None, Some(value)) => (relation.source, backward(relation.kind, value)),
                (None, None) => continue,
            };
            match found {
                None => continue,
                Some(Ok(rate)) => {
                    (rates.of[target], origins[target]) = (Some(rate), Some(relation.origin));
                }
                Some(Err(fault)) => diagnostics.push(impossible(relation, &fault)),
            }
            *judged = true;
            changed = true;
        }
    }
}

fn checked(base: Base, interval: Option<Ratio>, shift: Option<Ratio>) -> Result<Rate, Fault> {
    let (Some(interval), Some(shift)) = (interval, shift) else { return Err(Fault::Number) };
    if shift.is_negative() {
        return Err(Fault::Early);
    }
    let whole = interval.integer().is_some() && shift.integer().is_some();
    match base {
        Base::Condition(_) if !whole => Err(Fault::Between),
        _ => Ok(Rate { base, interval, shift }),
    }
}

fn number(n: u64) -> Option<Ratio> {
    Ratio::new(i128::from(n), 1)
}

fn part(counter: u64, resolution: u64) -> Option<Ratio> {
    Ratio::new(i128::from(counter), i128::from(resolution))
}

/// The rate of the value; none where a factor is not known.
fn forward(kind: &ClockKind, source: Rate) -> Option<Result<Rate, Fault>> {
    let Rate { base, interval, shift } = source;
    Some(match kind {
        ClockKind::Solver(_) => Ok(source),
        ClockKind::Sub(factor) => checked(base, number((*factor)?).and_then(|n| interval.times(n)), Some(shift)),
        ClockKind::Super(factor) => checked(base, number((*factor)?).and_then(|n| interval.over(n)), Some(shift)),
        ClockKind::Shift(counter, resolution) => {
            let way = part(*counter, *resolution).and_then(|part| interval.times(part));
            checked(base, Some(interval), way.and_then(|way| shift.plus(way)))
        }
        ClockKind::Back(counter, resolution) => {
            let way = part(*counter, *resolution).and_then(|part| interval.times(part));
            checked(base, Some(interval), way.and_then(|way| shift.minus(way)))
        }
        _ => return None,
    })
}

/// The rate of the source: the same the other way round.
fn backward(kind: &ClockKind, value: Rate) -> Option<Result<Rate, Fault>> {
    match kind {
        ClockKind::Sub(factor) => forward(&ClockKind::Super(*factor), value),
        ClockKind::Super(factor) => forward(&ClockKind::Sub(*factor), value),
        ClockKind::Shift(counter, resolution) => forward(&ClockKind::Back(*counter, *resolution), value),
        ClockKind::Back(counter, resolution) => forward(&ClockKind::Shift(*counter, *resolution), value),
        other => forward(other, value),
    }
}

/// True if a relation holds between two known rates; a factor that is left out may be any integer.
fn agrees(kind: &ClockKind, source: Rate, value: Rate) -> bool {
    match kind {
        ClockKind::Sub(None) => is_multiple(value, source),
        ClockKind::Super(None) => is_multiple(source, value),
        _ => match forward(kind, source) {
            Some(Ok(rate)) => rate == value || is_near(rate, value),
            _ => false,
        },
    }
}

/// True if the first ticks at some of the ticks of the second.
fn is_multiple(slow: Rate, fast: Rate) -> bool {
    if slow.base == fast.base {
        return slow.shift == fast.shift && slow.interval.over(fast.interval).and_then(Ratio::integer).is_some();
    }
    let factor = seconds(slow.interval, slow.base).zip(seconds(fast.interval, fast.base)).map(|(a, b)| a / b);
    factor.is_some_and(|factor| factor > 0.5 && (factor - factor.round()).abs() < 1e-9 * factor)
}

/// True if two rates of different bases are the same but for rounding.
fn is_near(a: Rate, b: Rate) -> bool {
    a.base != b.base && is_multiple(a, b) && is_multiple(b, a)
}

fn seconds(ratio: Ratio, base: Base) -> Option<f64> {
    Some(ratio.value() * base.seconds()?)
}

fn shown(rate: Rate) -> String {
    match (seconds(rate.interval, rate.base), seconds(rate.shift, rate.base)) {
        (Some(interval), Some(0.0)) => format!("every {interval} s"),
        (Some(interval), Some(shift)) => format!("every {interval} s from {shift} s on"),
        _ => match rate.interval.integer() {
            Some(1) => "whenever its condition becomes true".to_string(),
            _ => format!("every {} times that its condition becomes true", rate.interval.value()),
        },
    }
}

fn two_clocks(origin: &Origin, other: Option<&Origin>) -> Diagnostic {
    let fault = Diagnostic::error(Code::Clock, "what has this clock already has another one").at(origin.span, "");
    match other {
        Some(other) => fault.with(other.span, "the other clock"),
        None => fault,
    }
}

fn contradiction(relation: &Relation<'_>, source: Rate, value: Rate) -> Diagnostic {
    let message = match relation.kind {
        ClockKind::Sub(None) | ClockKind::Super(None) => {
            format!("no factor leads from a clock that ticks {} to one that ticks {}", shown(source), shown(value))
        }
        _ => format!(
            "this ticks {} by the clock on its left, and does not follow from one that ticks {}",
            shown(value),
            shown(source)
        ),
    };
    Diagnostic::error(Code::Clock, message).at(relation.origin.span, "")
}

fn impossible(relation: &Relation<'_>, fault: &Fault) -> Diagnostic {
    let message = match fault {
        Fault::Number => "the interval of this clock leaves the range of exact numbers",
        Fault::Early => "the first tick of this clock would come before the start",
        Fault::Between => {
            "this clock would have to tick between the ticks of a condition, whose times nobody knows before"
        }
    };
    Diagnostic::error(Code::Clock, message).at(relation.origin.span, "")
}

/// Partitions with a clock that nothing gives a rate, each told once.
fn unknown(
    flat: &FlatModel,
    partitions: &Partitions,
    rates: &Rates,
    relations: &[Relation<'_>],
    diagnostics: &mut Vec<Diagnostic>,
) {
    let mut told: IndexVec<PartitionId, bool> = IndexVec::filled(false, partitions.clocked.len());
    // What follows from an unknown clock is not told again.
    for relation in relations.iter().filter(|relation| rates.of[relation.source].is_none()) {
        told[relation.value] |= !matches!(relation.kind, ClockKind::Sub(None) | ClockKind::Super(None));
    }
    let all = flat.clocks.iter().flat_map(|operator| {
        let sides = |(value, source, _): (VarId, Option<VarId>, Option<VarId>)| [source, Some(value)];
        elements(operator).flat_map(sides).flatten().map(|v| (v, &operator.origin))
    });
    let is_unknown = |v: VarId| partitions.clocked_of(v).filter(|&own| rates.of[own].is_none());
    let open: Vec<(PartitionId, &Origin)> = all.filter_map(|(v, origin)| Some((is_unknown(v)?, origin))).collect();
    // Where all follow from each other the first one is told.
    let first = open.first().map(|&(own, _)| own).filter(|_| open.iter().all(|&(own, _)| told[own]));
    if let Some(first) = first {
        told[first] = false;
    }
    for (own, origin) in open {
        if std::mem::replace(&mut told[own], true) {
            continue;
        }
        let named = flat.variables.iter().find(|block| {
            block.made.is_none() && (0..block.count).any(|k| partitions.of[VarId(block.first.0 + k)] == own)
        });
        let message = match named {
            Some(block) => format!("nothing says when `{}` ticks", block.name.element(0)),
            None => "nothing says when this ticks".to_string(),
        };
        let fault = Diagnostic::error(Code::Clock, message).at(origin.span, "");
        diagnostics
            .push(fault.help("give it a clock: `sample(u, Clock(0.1))`, or `when Clock(0.1) then ... end when`"));
    }
}
