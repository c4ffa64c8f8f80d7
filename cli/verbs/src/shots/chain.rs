//! What a measuring chain shows of a value of the model.

/// Part of a value by which it may differ from the end of a range that it is at: tables have nine digits.
const END: f64 = 1e-7;

/// A measuring chain: `gain*model(t - late - clock*t) + offset` within limits.
#[derive(Clone, Copy)]
pub(super) struct Chain {
    pub(super) gain: f64,
    pub(super) offset: f64,
    pub(super) late: f64,
    pub(super) clock: f64,
    pub(super) limits: (f64, f64),
}

impl Chain {
    /// What is shown of a value of the model to which something is added.
    pub(super) fn shown(&self, model: f64, added: f64) -> f64 {
        let whole = self.gain * model + self.offset + added;
        // Of what is not a number the larger one would be the end of the range.
        if whole.is_nan() { whole } else { whole.max(self.limits.0).min(self.limits.1) }
    }

    /// The time of the run that is shown at a time of the record (s).
    pub(super) fn machine_time(&self, time: f64) -> f64 {
        time - self.late - self.clock * time
    }

    /// What was added to a value of the model where `shown` was shown of it; of what is at the end of the range nothing is known.
    pub(super) fn added(&self, model: f64, shown: f64) -> f64 {
        let whole = self.gain * model + self.offset;
        let is_at = |end: f64| end.is_finite() && (shown - end).abs() <= END * end.abs().max(shown.abs());
        let is_beyond = whole < self.limits.0 || whole > self.limits.1;
        let is_clipped = is_at(self.limits.0) || is_at(self.limits.1) || is_beyond;
        if is_clipped || !whole.is_finite() { 0.0 } else { shown - whole }
    }
}

#[cfg(test)]
mod tests {
    use super::Chain;

    #[test]
    fn what_is_added_is_what_lacks_but_at_the_ends_of_the_range() {
        // The end of a range that was scaled is not a round number, and a table has nine digits.
        let chain = Chain { gain: 2.0, offset: 1.0, late: 0.1, clock: 0.01, limits: (0.0, 50.000_000_000_000_01) };
        assert_eq!(chain.added(3.0, 7.25), 0.25);
        assert_eq!((chain.added(30.0, 50.0), chain.added(24.5, 50.0), chain.added(-3.0, 0.0)), (0.0, 0.0, 0.0));
        assert_eq!(chain.added(f64::NAN, 7.0), 0.0);
        assert!(chain.shown(f64::NAN, 0.0).is_nan());
        assert_eq!(
            (chain.shown(3.0, 0.25), chain.shown(30.0, 0.0), chain.shown(-3.0, 0.0)),
            (7.25, chain.limits.1, 0.0)
        );
        assert!((chain.machine_time(1.0) - 0.89).abs() < 1e-15);
        // Without an end nothing is at it.
        let open = Chain { limits: (f64::NEG_INFINITY, f64::INFINITY), ..chain };
        assert_eq!(open.added(30.0, 62.0), 1.0);
    }
}
