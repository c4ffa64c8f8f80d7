//! Delays: the recorded past of what the equations delay, and the system as the solver sees it with its past.
//!
//! [`DelayWork`] records the sources of all delay sites over accepted steps ([`past`], [`record`]): polynomials of degree 4
//! over as many parts of a step as the tolerance asks for, sampled from the integrator's dense output with everything
//! explicit computed anew, so that the past is as exact as the solution.  [`Delaying`] wraps a system and hands it the
//! delayed values before every evaluation, so that the integrators know no delays.  Events of the past come back as
//! events ([`breaks`]): at a known instant where the delay time is fixed, by a root function where it varies.  Steps end where the pieces
//! of the past end that they read ([`mesh`]).
//!
//! A step may be longer than a delay.  Then the delayed time lies within the step, and its value is taken from the polynomial
//! through the iterate and the newest points; the Jacobian knows nothing of this, so that Newton's method limits the step
//! where it matters; where the newest points are too few or too far apart, the value is withheld (not a number), which makes the
//! step shorter (Bellen, Zennaro 2003, section 4.3: overlapping).  Sources that depend on their own delayed value at once
//! are iterated to rest within an evaluation.

mod breaks;
mod levels;
mod mesh;
mod past;
mod polynomial;
mod record;
mod system;
mod tangents;

use hyd_system::{DelaySite, Instants, Structure};

use breaks::Breaks;
use levels::Levels;
use past::{Past, Spot, Wanted};

pub(crate) use mesh::end_on;
pub(crate) use record::Recorder;
pub(crate) use system::Delaying;

/// Without states a step may have at least this part of the bound of a varying delay time.
const SHORTEST_PART: f64 = 1e-3;
/// A delay time is at rest when it changes by less than this part of its bound.
const SAME_DELAY: f64 = 16.0 * f64::EPSILON;
/// Points of the past, beside the iterate, for a value within the step in work.
const NEWEST_POINTS: usize = 4;
/// They lie at least this part of the step in work apart, so that differences are not noise.
const NEWEST_DISTANCE: f64 = 0.25;

/// The past of a run and all work space; used for run after run.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct DelayWork {
    sites: Vec<DelaySite>,
    any_varying: bool,
    instants: Instants,
    has_states: bool,
    /// The past is recorded (not yet during the start).
    recording: bool,
    /// The last event did nothing but let sites cross breaks.
    only_crossed: bool,
    past: Past,
    breaks: Breaks,
    lags: Lags,
    read: Values,
    asked: Asked,
    accuracy: Accuracy,
    step: StepInWork,
    record: Levels,
    /// In runs with derivatives: their past, and the time (s) up to which they have come.
    #[serde(skip)]
    derived: Option<Box<tangents::Derived>>,
    kept_from: f64,
}

/// The delay times, by site.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
struct Lags {
    /// Upper bounds (s).
    bounds: Vec<f64>,
    /// What they are now (s).
    times: Vec<f64>,
    /// Smallest of the fixed ones (s).
    shortest_fixed: f64,
}

/// What the equations get, by site: the delayed values and rates, and the sources that they were found from.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
struct Values {
    /// At the iterate, or at the end of the step being recorded.
    sources: Vec<f64>,
    values: Vec<f64>,
    rates: Vec<f64>,
    /// Time for which the values hold, if they depend on nothing else (s).
    cached: Option<f64>,
    /// A value within the step in work is not known well enough.
    coarse: bool,
}

/// What one evaluation answers, by site.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
struct Asked {
    sources: Vec<f64>,
    times: Vec<f64>,
}

/// What a source may be wrong by, by site.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
struct Accuracy {
    tolerance: f64,
    /// The largest value so far, and the tolerance of that.
    scale: Vec<f64>,
    limits: Vec<f64>,
}

/// The step in work, or being recorded.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
struct StepInWork {
    /// End of the step being recorded (s), with the sources there.
    anchor: Option<f64>,
    anchor_values: Vec<f64>,
    /// The sources at the beginning of the newest segment.
    begun: Vec<f64>,
    /// The step to the point has been accepted: its values are taken as they are, also where they have not quite come to rest.
    accepted: bool,
}

impl DelayWork {
    /// Work space for systems of this structure.
    pub(crate) fn new(structure: &Structure) -> Self {
        let n = structure.delays.len();
        let zero = || vec![0.0; n];
        Self {
            sites: structure.delays.clone(),
            any_varying: structure.delays.iter().any(|site| site.varying),
            has_states: structure.differential.contains(&true),
            lags: Lags { bounds: zero(), times: zero(), shortest_fixed: 0.0 },
            read: Values { sources: zero(), values: zero(), rates: zero(), ..Values::default() },
            asked: Asked { sources: zero(), times: zero() },
            accuracy: Accuracy { scale: zero(), limits: zero(), tolerance: 0.0 },
            step: StepInWork { anchor_values: zero(), begun: zero(), ..StepInWork::default() },
            record: Levels::new(n, structure.unknowns),
            ..Self::default()
        }
    }

    /// Prepares a run with the given relative tolerance.
    pub(crate) fn restart(&mut self, tolerance: f64) {
        (self.recording, self.only_crossed) = (false, false);
        self.step.accepted = false;
        self.step.anchor = None;
        self.read.cached = None;
        self.derived_off();
        self.accuracy.tolerance = tolerance;
        self.read.sources.fill(0.0);
    }

    fn derived_off(&mut self) {
        self.kept_from = f64::INFINITY;
        if let Some(derived) = &mut self.derived {
            derived.stop();
        }
    }

    /// What the system has of derivatives of delayed values no longer holds.
    fn forget_laid(&mut self) {
        if let Some(derived) = &mut self.derived {
            derived.laid = None;
        }
    }

    /// True if some delayed time lies within the step to `t` (s), so that its value depends on the iterate.
    fn reaches_into_step(&self, t: f64) -> bool {
        t - self.lags.shortest_fixed > self.past.end() || self.lags.shortest_fixed == 0.0 && t >= self.past.end()
    }

    /// Delayed values and rates at time `t` (s) from delay times and sources as they are known.  Sites that look back to the same
    /// instant, such as those of a line, share what is known of it.
    fn evaluate(&mut self, t: f64) {
        self.read.coarse = false;
        let end = self.past.end();
        let mut known: Option<(Wanted, Spot)> = None;
        for site in 0..self.sites.len() {
            let at = t - self.lags.times[site];
            let within = at > end || self.lags.times[site] == 0.0 && at >= end;
            if within && let Some(found) = self.inside(site, at, t) {
                (self.read.values[site], self.read.rates[site]) = found;
                continue;
            }
            let cursor = &mut self.breaks.cursors[site];
            let key = (at, cursor.low, cursor.high);
            let spot = match known.filter(|(before, _)| *before == key) {
                Some((_, spot)) => spot,
                None => self.past.locate(at, (cursor.low, cursor.high), &mut cursor.hint),
            };
            known = Some((key, spot));
            (self.read.values[site], self.read.rates[site]) = self.past.read(&spot, site);
        }
    }

    /// Value and rate at `at` (s), which lies within the step in work to `t` (s); none if the site reads before a break.
    fn inside(&mut self, site: usize, at: f64, t: f64) -> Option<(f64, f64)> {
        let (anchor, source) = match self.step.anchor {
            Some(end) => (end, self.step.anchor_values[site]),
            None => (t, self.read.sources[site]),
        };
        if self.breaks.cursors[site].high.is_some() || !source.is_finite() {
            return None;
        }
        let (value, rate) = self.within_step(site, at.min(anchor), (anchor, source));
        Some(if at >= anchor { (source, rate) } else { (value, rate) })
    }

    /// Value and rate at `at` (s) on the polynomial through the newest points and the iterate.
    fn within_step(&mut self, site: usize, at: f64, (t, source): (f64, f64)) -> (f64, f64) {
        let mut times = [0.0; NEWEST_POINTS + 1];
        let mut values = [0.0; NEWEST_POINTS + 1];
        let distance = NEWEST_DISTANCE * (t - self.past.end());
        if distance <= 0.0 {
            return (source, 0.0);
        }
        (times[0], values[0]) = (t, source);
        let mut count = 1 + self.past.newest_times(&mut times[1..], distance);
        let cursor = self.breaks.cursors[site];
        let mut hint = cursor.hint;
        for k in 1..count {
            values[k] = self.past.at(site, times[k], (cursor.low, None), &mut hint).0;
        }
        if count == 1 {
            (times[1], values[1], count) = (self.past.end(), self.step.begun[site], 2);
        }
        let fewer = |count: usize| {
            let mut values = values;
            polynomial::through(&times[..count], &mut values[..count], at).0
        };
        let (rougher, roughest) = (fewer(count - 1), fewer(count.saturating_sub(2).max(1)));
        let finer = polynomial::through(&times[..count], &mut values[..count], at);
        // Each degree more makes the polynomial better by the same factor, if it makes it better at all.
        let (last, before) = ((finer.0 - rougher).abs(), (rougher - roughest).abs());
        let left = match count {
            // A straight line is wrong by the square of what it changes, relative to the size.
            2 => last * (last / self.accuracy.scale[site].max(f64::MIN_POSITIVE)),
            _ if before > last => last * (last / before),
            _ => last,
        };
        self.read.coarse |= self.step.anchor.is_none() && left > self.accuracy.limits[site];
        finer
    }

    /// Takes over sources and delay times of an evaluation; true if nothing that matters has changed.
    fn settled(&mut self) -> bool {
        let mut settled = true;
        for site in 0..self.sites.len() {
            let (source, time) = (self.asked.sources[site], self.asked.times[site]);
            settled &=
                (source - self.read.sources[site]).abs() <= 1e-3 * self.accuracy.limits[site].max(f64::MIN_POSITIVE);
            self.read.sources[site] = source;
            if self.sites[site].varying && time.is_finite() {
                let time = time.clamp(0.0, self.lags.bounds[site].max(0.0));
                settled &= (time - self.lags.times[site]).abs() <= SAME_DELAY * self.lags.bounds[site];
                self.lags.times[site] = time;
            }
        }
        settled
    }

    /// The largest value of each source so far counts for what the tolerance lets pass.
    fn widen(&mut self, sources: &[f64]) {
        for (site, &value) in sources.iter().enumerate() {
            if value.is_finite() {
                self.accuracy.scale[site] = self.accuracy.scale[site].max(value.abs());
                self.accuracy.limits[site] = self.accuracy.tolerance * self.accuracy.scale[site];
            }
        }
    }

    /// Width of an instant at `t` (s).
    fn slack(&self, site: usize, t: f64) -> f64 {
        self.instants.width(t.abs().max(self.lags.times[site].abs()))
    }

    /// Longest sensible step (s).  Without states nothing tests the error of a step and no iteration can fail, so no step may be
    /// longer than the delay times at its beginning; a delay time that vanishes counts as a small part of its bound.
    fn longest_step(&self) -> f64 {
        if self.has_states || !self.recording {
            return f64::INFINITY;
        }
        let site = |site: usize| match self.sites[site].varying {
            true => self.lags.times[site].max(SHORTEST_PART * self.lags.bounds[site]),
            false if self.lags.times[site] == 0.0 => f64::INFINITY,
            false => self.lags.times[site],
        };
        (0..self.sites.len()).map(site).fold(f64::INFINITY, f64::min)
    }

    /// Where a step of about `h` and at most `most` (s) from `from` (s) should end for the site with the shortest fixed delay time;
    /// none if it does not matter.
    fn end_of_step(&self, from: f64, steps: (f64, f64)) -> Option<f64> {
        self.end_by(&self.past, from, steps)
    }

    /// The same for steps of the derivatives, whose past has pieces of its own.
    fn end_of_derived_step(&self, from: f64, steps: (f64, f64)) -> Option<f64> {
        let derived = self.derived.as_deref().filter(|derived| derived.is_recording())?;
        self.end_by(derived.past(), from, steps)
    }

    fn end_by(&self, past: &Past, from: f64, steps: (f64, f64)) -> Option<f64> {
        let fixed = (0..self.sites.len()).filter(|&site| !self.sites[site].varying && self.lags.times[site] > 0.0);
        let site = fixed.min_by(|&a, &b| self.lags.times[a].total_cmp(&self.lags.times[b]))?;
        let (lag, cursor) = (self.lags.times[site], &self.breaks.cursors[site]);
        let ends = past.ends(from - lag, (cursor.low, cursor.high), cursor.hint);
        end_on(ends.map(|t| t + lag), from, steps)
    }

    /// The first instant after `t` (s) at which a break comes back to a site with fixed delay time.
    fn next_break(&self, t: f64) -> f64 {
        let mut next = f64::INFINITY;
        for site in (0..self.sites.len()).filter(|&site| !self.sites[site].varying) {
            if let Some(high) = self.breaks.cursors[site].high {
                let back = self.past.begin_of(high) + self.lags.times[site];
                if self.instants.lies_ahead(back, t) {
                    next = next.min(back);
                }
            }
        }
        next
    }

    /// Lets all sites cross the breaks that they have reached at `t` (s); true if one has.
    fn cross(&mut self, t: f64) -> bool {
        let mut crossed = false;
        for site in 0..self.sites.len() {
            let (delay, instants) = (self.lags.times[site], self.instants);
            crossed |= match self.sites[site].varying {
                true => self.breaks.cross_near(&self.past, site, t - delay, self.slack(site, t)),
                false => self.breaks.cross(&self.past, site, |begin| instants.has_come(begin + delay, t)),
            };
        }
        if crossed {
            self.read.cached = None;
            self.forget_laid();
        }
        crossed
    }

    /// Root functions of the sites with varying delay time: positive while no break is reached.
    fn roots(&self, t: f64, out: &mut [f64]) {
        let varying = (0..self.sites.len()).filter(|&site| self.sites[site].varying);
        for (value, site) in out.iter_mut().zip(varying) {
            let at = t - self.lags.times[site];
            let cursor = &self.breaks.cursors[site];
            let above = cursor.high.map_or(f64::MAX, |high| self.past.begin_of(high) - at);
            let low = self.past.begin_of(cursor.low);
            let below = if low.is_finite() { at - low + 4.0 * self.slack(site, t) } else { f64::MAX };
            *value = above.min(below);
        }
    }
}
