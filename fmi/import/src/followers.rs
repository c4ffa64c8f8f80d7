//! Inputs of a unit that follow recorded samples.
//!
//! Samples of a held input count from an event on, as in models of this program, so that an evaluation sees one side of a jump.  Inputs that
//! only change at events are held whatever was asked for.

use std::sync::Arc;

use hyd_system::{Hold, InputError, Instants, Sample, Series, TimeEvent};

/// One input, an element of an array among them.
#[derive(Clone, Debug)]
pub(crate) struct Follower {
    pub(crate) name: Arc<str>,
    /// It changes at events alone.
    pub(crate) is_discrete: bool,
    /// Its values are integers from the first to the second; none for reals.
    pub(crate) whole: Option<(f64, f64)>,
    series: Option<Arc<Series>>,
    /// A value that was given in place of samples.
    given: Option<f64>,
    stepwise: bool,
    sample: usize,
}

impl Follower {
    pub(crate) fn new(name: Arc<str>, is_discrete: bool, whole: Option<(f64, f64)>) -> Self {
        Self { name, is_discrete, whole, series: None, given: None, stepwise: false, sample: 0 }
    }

    /// Takes samples.
    pub(crate) fn follow(&mut self, series: &Arc<Series>) -> Result<(), InputError> {
        let held = match self.is_discrete && series.hold() != Hold::Zero {
            true => {
                let held = Series::new(series.times().to_vec(), series.values().to_vec(), Hold::Zero);
                Arc::new(held.map_err(|_| InputError::Unknown)?)
            }
            false => Arc::clone(series),
        };
        self.stepwise = held.hold() == Hold::Zero;
        self.series = Some(held);
        (self.given, self.sample) = (None, 0);
        Ok(())
    }

    /// Has a value at every time from now on.
    pub(crate) fn give(&mut self, value: f64) {
        (self.given, self.series) = (Some(value), None);
    }

    /// Begins a run at `t0` (s).
    pub(crate) fn start(&mut self, t0: f64) -> Result<(), String> {
        if self.given.is_some() {
            return Ok(());
        }
        let name = &self.name;
        let Some(series) = &self.series else { return Err(format!("the input `{name}` has no samples")) };
        if let Some((least, most)) = self.whole
            && let Some(value) = series.values().iter().find(|v| v.fract() != 0.0 || **v < least || **v > most)
        {
            return Err(format!("the input `{name}` takes integers from {least} to {most}, and a sample is {value}"));
        }
        self.sample = series.interval(t0, 0);
        self.pass(t0, Instants::of_run(t0));
        Ok(())
    }

    /// Lets the samples count whose time has come; true if the value has jumped.
    pub(crate) fn pass(&mut self, t: f64, instants: Instants) -> bool {
        let Some(series) = self.series.as_ref().filter(|_| self.stepwise) else { return false };
        let before = self.sample;
        while series.times().get(self.sample + 1).is_some_and(|&time| instants.has_come(time, t)) {
            self.sample += 1;
        }
        series.next_break(before).is_some_and(|k| k <= self.sample)
    }

    pub(crate) fn at(&mut self, t: f64) -> Sample {
        let Some(series) = &self.series else {
            return Sample { value: self.given.unwrap_or_default(), ..Sample::default() };
        };
        if !self.stepwise {
            self.sample = series.interval(t, self.sample);
        }
        series.at(t, self.sample)
    }

    fn next_break(&self) -> Option<f64> {
        let series = self.series.as_ref().filter(|_| self.stepwise)?;
        series.next_break(self.sample).map(|k| series.times()[k])
    }
}

/// How far a step from `t` may lead (s) so that no feature of the inputs is stepped over.
pub(crate) fn reach(followers: &[Follower], t: f64) -> f64 {
    let reach = |follower: &Follower| match &follower.series {
        Some(series) if !follower.stepwise => series.reach(series.interval(t, follower.sample), t),
        _ => f64::INFINITY,
    };
    followers.iter().map(reach).fold(f64::INFINITY, f64::min)
}

/// How many samples of the input with the most have passed at `t` (s).
pub(crate) fn samples_passed(followers: &[Follower], t: f64) -> u64 {
    let passed = |follower: &Follower| match &follower.series {
        Some(_) if follower.stepwise => follower.sample as u64,
        Some(series) => series.interval(t, follower.sample) as u64,
        None => 0,
    };
    followers.iter().map(passed).max().unwrap_or(0)
}

/// The earlier of a time event and the next jump of an input after `t` (s).
pub(crate) fn next_jump(followers: &[Follower], next: TimeEvent, t: f64, instants: Instants) -> TimeEvent {
    let mut next = next;
    for time in followers.iter().filter_map(Follower::next_break) {
        if instants.lies_ahead(time, t) && instants.lies_ahead(next.t, time) {
            next = TimeEvent::of_input(time);
        }
    }
    next
}
