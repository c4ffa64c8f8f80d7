//! Subscripts as affine functions of loop counters.
//!
//! An equation inside loops (written `for` loops, arrays of components around it, elements of an array equation) is lowered
//! once with symbolic counters.  Where a subscript is affine, or a condition decided, on parts of the values of a counter only
//! (`if k > 1`, `div(k, 2)`), it is lowered once for each part; else the loops are run through.

use hyd_index::{TypedIndex, typed_index};
use hyd_symbolic::SlotId;
use rustc_hash::FxHashMap;

use crate::functions::call_memory::CallMemory;
use crate::model::{ConstId, Target, VarId};

typed_index!(
    /// A loop counter of the equation being lowered; counts from 0.
    CounterId,
    "k"
);

/// `constant + sum of coefficient * counter`
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(crate) struct Affine {
    /// Value where all counters are 0.
    pub constant: i64,
    /// Counters with coefficients, by ascending counter, coefficients not 0.
    pub terms: Vec<(CounterId, i64)>,
}

impl Affine {
    /// A fixed number.
    pub(crate) fn constant(value: i64) -> Self {
        Self { constant: value, terms: Vec::new() }
    }

    /// One counter.
    pub(crate) fn counter(id: CounterId) -> Self {
        Self { constant: 0, terms: vec![(id, 1)] }
    }

    /// The number, if no counter occurs.
    pub(crate) fn as_constant(&self) -> Option<i64> {
        self.terms.is_empty().then_some(self.constant)
    }

    /// `self + factor * other`; `None` on overflow.
    pub(crate) fn add_scaled(&self, other: &Affine, factor: i64) -> Option<Affine> {
        let mut result = self.clone();
        result.constant = result.constant.checked_add(other.constant.checked_mul(factor)?)?;
        for &(id, c) in &other.terms {
            let scaled = c.checked_mul(factor)?;
            match result.terms.iter_mut().find(|(known, _)| *known == id) {
                Some(term) => term.1 = term.1.checked_add(scaled)?,
                None => result.terms.push((id, scaled)),
            }
        }
        result.terms.retain(|(_, c)| *c != 0);
        result.terms.sort_unstable();
        Some(result)
    }

    /// The value where the counters have these values.
    pub(crate) fn at(&self, counters: &[i64]) -> i64 {
        self.constant + self.terms.iter().map(|(id, c)| c * counters[id.index()]).sum::<i64>()
    }

    /// Smallest and largest value over all counters, given their counts (each at least 1).
    pub(crate) fn bounds(&self, counts: &[usize]) -> (i64, i64) {
        let (mut low, mut high) = (self.constant, self.constant);
        for &(id, c) in &self.terms {
            let reach = c.saturating_mul(counts[id.index()].saturating_sub(1) as i64);
            low = low.saturating_add(reach.min(0));
            high = high.saturating_add(reach.max(0));
        }
        (low, high)
    }
}

/// The next turn of loops with so many turns each, the last one fastest; after the last the first.
pub(crate) fn advance(counters: &mut [i64], counts: &[usize]) {
    for (counter, &count) in counters.iter_mut().zip(counts).rev() {
        *counter += 1;
        if (*counter as usize) < count {
            break;
        }
        *counter = 0;
    }
}

/// How the values of a counter are taken apart.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Cut {
    /// Those below this position and the others.
    At(usize),
    /// Every so manieth, from each of the first.
    Modulo(usize),
}

impl Cut {
    /// True if each part of `count` values holds fewer of them, and not so few that running through them were as good.
    pub(crate) fn divides(self, count: usize) -> bool {
        match self {
            Cut::At(position) => 0 < position && position < count,
            Cut::Modulo(parts) => 1 < parts && parts <= 16 && 2 * parts <= count,
        }
    }
}

/// Part of the values of a counter: `first + stride*k` for `k` below `count`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Window {
    /// The counter.
    pub counter: CounterId,
    /// First value.
    pub first: i64,
    /// Distance of the values.
    pub stride: i64,
    /// How many, at least 1.
    pub count: usize,
}

impl Window {
    /// The values, affine in the counter that now counts them.
    pub(crate) fn values(self) -> Affine {
        match self.count {
            1 => Affine::constant(self.first),
            _ => Affine { constant: self.first, terms: vec![(self.counter, self.stride)] },
        }
    }

    /// The parts, in the order of their first values; none is empty.
    pub(crate) fn parts(self, cut: Cut) -> Vec<Window> {
        match cut {
            Cut::At(position) => {
                let rest =
                    Window { first: self.first + self.stride * position as i64, count: self.count - position, ..self };
                vec![Window { count: position, ..self }, rest]
            }
            Cut::Modulo(parts) => {
                let part = |k: usize| Window {
                    first: self.first + self.stride * k as i64,
                    stride: self.stride * parts as i64,
                    count: (self.count - k).div_ceil(parts),
                    ..self
                };
                (0..parts).map(part).collect()
            }
        }
    }
}

/// What a slot of the equation being lowered reads.
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(crate) enum SlotKey {
    /// A target of the kind given, at variable `first + offset`.
    Variable(Kind, VarId, Affine),
    /// The number itself: a loop variable used as a value.
    Number(Affine),
    /// A number with a unit.
    Quantity(ConstId),
}

/// Kinds of targets that point at variables.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) enum Kind {
    /// `Target::Var`
    Var,
    /// `Target::Der`
    Der,
    /// `Target::Pre`
    Pre,
    /// `Target::Start`
    Start,
    /// `Target::Delayed`; the number is that of the site.
    Delayed,
    /// `Target::DelayedRate`; the number is that of the site.
    DelayedRate,
    /// `Target::Input`; the number is that of the input.
    Input,
}

impl Kind {
    /// The target of this kind.
    pub(crate) fn of(self, v: VarId) -> Target {
        match self {
            Kind::Var => Target::Var(v),
            Kind::Der => Target::Der(v),
            Kind::Pre => Target::Pre(v),
            Kind::Start => Target::Start(v),
            Kind::Delayed => Target::Delayed(v.0),
            Kind::DelayedRate => Target::DelayedRate(v.0),
            Kind::Input => Target::Input(v.0),
        }
    }
}

/// The slots of the equation being lowered.
#[derive(Default)]
pub(crate) struct Slots {
    /// What each slot reads.
    pub keys: Vec<SlotKey>,
    known: FxHashMap<SlotKey, SlotId>,
    /// Calls whose values are over these slots.
    pub(crate) calls: CallMemory,
}

impl Slots {
    /// Slots that read these keys in their order.
    pub(crate) fn of(keys: Vec<SlotKey>) -> Self {
        let mut slots = Self::default();
        for key in keys {
            let _ = slots.slot(key);
        }
        slots
    }

    /// The slot that reads `key`.
    pub(crate) fn slot(&mut self, key: SlotKey) -> SlotId {
        if let Some(&known) = self.known.get(&key) {
            return known;
        }
        let id = SlotId::new(self.keys.len());
        self.keys.push(key.clone());
        self.known.insert(key, id);
        id
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_hold_each_value_once() {
        let counter = CounterId(0);
        let whole = Window { counter, first: 3, stride: 2, count: 7 };
        let values = |window: &Window| (0..window.count as i64).map(|k| window.first + window.stride * k).collect();
        for cut in [Cut::At(1), Cut::At(6), Cut::Modulo(2), Cut::Modulo(3)] {
            assert!(cut.divides(whole.count));
            let mut found: Vec<i64> = whole.parts(cut).iter().flat_map(|part| -> Vec<i64> { values(part) }).collect();
            found.sort_unstable();
            assert_eq!(found, values(&whole), "{cut:?}");
        }
        assert!(!Cut::At(0).divides(7) && !Cut::At(7).divides(7) && !Cut::Modulo(4).divides(7));
    }

    #[test]
    fn affine_arithmetic_and_bounds() {
        let i = Affine::counter(CounterId(0));
        let j = Affine::counter(CounterId(1));
        let e = Affine::constant(3).add_scaled(&i, 2).and_then(|e| e.add_scaled(&j, -1)).expect("small");
        assert_eq!(e.bounds(&[5, 4]), (0, 11));
        assert_eq!(e.add_scaled(&i, -2).and_then(|e| e.add_scaled(&j, 1)).expect("small").as_constant(), Some(3));
    }
}
