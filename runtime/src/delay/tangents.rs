//! Derivatives through delays: the past of the sensitivities, kept beside that of the values.
//!
//! A delayed value is `u(t - tau)`; along a direction it changes by `s_u(t - tau) + u'(t - tau) (dt - dtau)`, where
//! `s_u` is the recorded derivative of the source at fixed time and `dt` that of the instant itself, which is zero but
//! for events.  A break of the past comes back at `t_b + tau`, an instant that moves by `dt_b + dtau` (Baker, Paul,
//! "Discontinuous solutions of neutral delay differential equations", Appl. Numer. Math. 56 (2006) 284, for the values;
//! with the derivatives of instants the formula at events needs nothing more). Steps of the sensitivities are no longer
//! than the shortest delay, so that what they read is known.

use hyd_system::{Along, EventPhase, Tangents};

use super::DelayWork;
use super::past::{Past, Segment, Spot, Wanted};
use super::polynomial::NODES;
use super::system::Delaying;

/// A derivative has jumped if the change is this many tolerances of its largest size.
const VISIBLE_JUMP: f64 = 100.0;

/// What is kept for derivatives.
#[derive(Clone, Default)]
pub(crate) struct Derived {
    /// Directions, the last of which is time.
    width: usize,
    /// Derivatives of the sources, site by site.
    past: Past,
    hints: Vec<usize>,
    /// Derivatives of the instants at which segments begin, from segment `first` on.
    instants: Vec<f64>,
    first: Segment,
    /// Derivatives of the delay times, and of the sources, at the last point that was asked for.
    times: Vec<f64>,
    sources: Vec<f64>,
    /// Largest derivative of each source so far.
    largest: Vec<f64>,
    /// Of the delayed values and of their rates.
    values: Vec<f64>,
    rates: Vec<f64>,
    still: Vec<f64>,
    /// Derivatives of the sources at the nodes of the piece to come, and the end of the last piece (s).
    nodes: Vec<f64>,
    end: Option<f64>,
    recording: bool,
    /// Time (s) for which the system has the derivatives of the delayed values, that of an instant at rest.
    pub(super) laid: Option<f64>,
}

impl Derived {
    /// Records nothing until derivatives begin anew.
    pub(super) fn stop(&mut self) {
        (self.recording, self.laid) = (false, None);
    }

    pub(super) fn is_recording(&self) -> bool {
        self.recording
    }

    /// Derivatives of the sources.
    pub(super) fn past(&self) -> &Past {
        &self.past
    }

    fn count(&self) -> usize {
        self.width - 1
    }

    /// Begins segments at `t` (s), an instant with these derivatives, until `newest` is one.
    fn begin_segments(&mut self, newest: Segment, t: f64, instant: &[f64]) {
        self.laid = None;
        while self.past.newest() < newest {
            self.past.begin_segment(t);
            self.instants.extend_from_slice(instant);
        }
    }

    fn instant(&self, segment: Segment, direction: usize) -> f64 {
        let at = segment.checked_sub(self.first).map(|k| k * self.count() + direction);
        at.and_then(|at| self.instants.get(at)).copied().unwrap_or(0.0)
    }
}

impl DelayWork {
    /// Prepares the derivatives of a run by this many directions, the last of which is time.
    pub(crate) fn derive(&mut self, width: usize) {
        let mut derived = self.derived.take().unwrap_or_default();
        let sites = self.sites.len();
        for blocks in [&mut derived.times, &mut derived.sources, &mut derived.values, &mut derived.rates] {
            blocks.clear();
            blocks.resize(sites * width, 0.0);
        }
        derived.nodes.resize(NODES * sites * (width - 1), 0.0);
        derived.hints.resize(sites, 0);
        derived.largest.clear();
        derived.largest.resize(sites * (width - 1), 0.0);
        derived.still.clear();
        derived.still.resize(width, 0.0);
        (derived.width, derived.recording, derived.end) = (width, false, None);
        self.derived = Some(derived);
    }
}

impl Delaying<'_> {
    /// Derivatives of the system alone.
    fn inner_tangents(&mut self) -> &mut dyn Tangents {
        self.inner.tangents().expect("invariant: a system with tangents keeps them")
    }

    fn take_derived(&mut self) -> Option<Box<Derived>> {
        if self.work.recording { self.work.derived.take_if(|derived| derived.recording) } else { None }
    }

    /// Hands over delayed values and their derivatives at a point; `dt` are those of its time.
    fn lay(&mut self, t: f64, y: &[f64], yp: &[f64], dt: Option<&[f64]>, along: Option<Along<'_>>) {
        let Some(mut derived) = self.take_derived() else {
            self.prepare(t, y, yp);
            return;
        };
        let varying = self.work.any_varying;
        let dt = dt.filter(|dt| dt.iter().any(|dt| *dt != 0.0));
        let kept = self.keep();
        self.prepare(t, y, yp);
        if !varying && dt.is_none() && derived.laid == Some(t) {
            self.work.derived = Some(derived);
            return;
        }
        derived.laid = dt.is_none().then_some(t);
        let Derived { width, past, hints, times, sources, values, rates, still, .. } = &mut *derived;
        let dt = dt.unwrap_or(still);
        if let Some(along) = along.filter(|_| varying) {
            self.inner_tangents().delay_points_tangent(t, y, yp, along, sources, times);
        }
        let (width, last) = (*width, *width - 1);
        let mut known: Option<(Wanted, (Spot, Spot))> = None;
        for (k, site) in self.work.sites.iter().enumerate() {
            let at = t - self.work.lags.times[k];
            let mut cursor = self.work.breaks.cursors[k];
            let (range, key) = ((cursor.low, cursor.high), (at, cursor.low, cursor.high));
            let spots = match known.filter(|(before, _)| *before == key) {
                Some((_, spots)) => spots,
                None => (past.locate(at, range, &mut hints[k]), self.work.past.locate(at, range, &mut cursor.hint)),
            };
            known = Some((key, spots));
            let block = k * width..(k + 1) * width;
            let (values, rates) = (&mut values[block.clone()], &mut rates[block.clone()]);
            past.read_block(&spots.0, k * last, (&mut values[..last], &mut rates[..last]));
            (values[last], rates[last]) = (0.0, 0.0);
            let (slope, bend) = (self.work.read.rates[k], self.work.past.bend(&spots.1, k));
            for ((value, rate), (dt, time)) in values.iter_mut().zip(rates).zip(dt.iter().zip(&times[block])) {
                let moved = dt - time;
                // The equations have what a varying delay time does.
                *value += slope * if site.varying { *dt } else { moved };
                *rate += bend * moved;
            }
        }
        let delays = std::mem::take(&mut self.work.lags.times);
        self.inner_tangents().set_delayed_tangents(values, rates, &delays);
        self.work.lags.times = delays;
        self.restore(kept);
        self.work.derived = Some(derived);
    }

    /// Delay times that vary, and sources: the solution goes on from where it was, to the last bit.
    fn keep(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        self.work.any_varying.then(|| (self.work.lags.times.clone(), self.work.read.sources.clone()))
    }

    fn restore(&mut self, kept: Option<(Vec<f64>, Vec<f64>)>) {
        if let Some((times, sources)) = kept {
            (self.work.lags.times, self.work.read.sources) = (times, sources);
            self.work.read.cached = None;
        }
    }

    /// The derivatives hold after the start or an event whose instant has the derivatives `instant`: their past goes on from here
    /// in a new segment, like that of the values.
    pub(crate) fn begin_derived(&mut self, t: f64, (y, yp): (&[f64], &[f64]), along: Along<'_>, instant: &[f64]) {
        if self.work.sites.is_empty() {
            return;
        }
        let newest = self.work.past.newest();
        if let Some(derived) = self.work.derived.as_deref_mut().filter(|derived| derived.recording) {
            derived.begin_segments(newest, t, instant);
        }
        self.lay(t, y, yp, None, Some(along));
        let Some(mut derived) = self.work.derived.take() else { return };
        let Derived { sources, times, .. } = &mut *derived;
        self.inner_tangents().delay_points_tangent(t, y, yp, along, sources, times);
        if !derived.recording {
            let (width, last) = (derived.width, derived.count());
            let values: Vec<f64> =
                derived.sources.chunks_exact(width).flat_map(|block| &block[..last]).copied().collect();
            derived.past.restart(t, &values);
            derived.instants.clear();
            derived.instants.resize(last, 0.0);
            (derived.first, derived.recording) = (0, true);
            derived.begin_segments(newest, t, instant);
        } else {
            self.keep_jumps(&mut derived, t);
        }
        (derived.end, derived.laid) = (None, None);
        self.work.kept_from = t;
        self.work.derived = Some(derived);
    }

    /// Where values are smooth but their derivatives jump, there is a break.
    fn keep_jumps(&mut self, derived: &mut Derived, t: f64) {
        let newest = self.work.past.newest();
        let (width, last) = (derived.width, derived.count());
        for site in 0..self.work.sites.len() {
            let jumps = |direction: usize| {
                let left = derived.past.at(site * last + direction, t, (newest - 1, Some(newest)), &mut 0).0;
                let limit = VISIBLE_JUMP * self.work.accuracy.tolerance * derived.largest[site * last + direction];
                (derived.sources[site * width + direction] - left).abs() > limit
            };
            if newest > 1 && (0..last).any(jumps) {
                self.work.breaks.keep_newest(&self.work.past, site);
            }
        }
    }

    /// True if the derivatives of the sources at `t` (s) are known as those at the end of the last piece.
    pub(crate) fn continues_derived(&mut self, t: f64) -> bool {
        let Some(derived) = self.work.derived.as_deref_mut().filter(|derived| derived.end == Some(t)) else {
            return false;
        };
        let part = derived.nodes.len() / NODES;
        derived.nodes.copy_within((NODES - 1) * part.., 0);
        true
    }

    /// Notes the derivatives of the sources at node `node` of the piece to come.
    pub(crate) fn sample_derived(&mut self, node: usize, t: f64, (y, yp): (&[f64], &[f64]), along: Along<'_>) {
        self.lay(t, y, yp, None, Some(along));
        let Some(mut derived) = self.work.derived.take() else { return };
        let Derived { sources, times, .. } = &mut *derived;
        self.inner_tangents().delay_points_tangent(t, y, yp, along, sources, times);
        let (width, last) = (derived.width, derived.count());
        let part = derived.nodes.len() / NODES;
        let Derived { nodes, sources, .. } = &mut *derived;
        for (to, from) in nodes[node * part..].chunks_exact_mut(last).zip(sources.chunks_exact(width)) {
            to.copy_from_slice(&from[..last]);
        }
        for (largest, value) in derived.largest.iter_mut().zip(&derived.nodes[node * part..]) {
            *largest = largest.max(value.abs());
        }
        self.work.derived = Some(derived);
    }

    /// Adds the piece whose nodes have been noted; nothing before `keep` (s) is asked for any longer.
    pub(crate) fn record_derived(&mut self, (from, to): (f64, f64), keep: f64) {
        let work = &mut *self.work;
        let Some(derived) = &mut work.derived else { return };
        derived.past.push(from, to, &derived.nodes);
        (derived.end, derived.laid) = (Some(to), None);
        work.kept_from = keep;
        let reach = work.lags.bounds.iter().copied().fold(0.0, f64::max);
        derived.past.drop_before(keep - reach, work.breaks.oldest_read());
        let gone = derived.past.oldest() - derived.first;
        if gone > 0 {
            derived.instants.drain(..gone * derived.count());
            derived.first += gone;
        }
    }

    /// Derivatives of the instant `t` (s) at which a break comes back to a site with fixed delay time; false if there is none.
    fn break_tangent(&self, t: f64, out: &mut [f64]) -> bool {
        let Some(derived) = self.work.derived.as_deref().filter(|derived| derived.recording) else { return false };
        for (k, _) in self.work.sites.iter().enumerate().filter(|(_, site)| !site.varying) {
            let Some(high) = self.work.breaks.cursors[k].high else { continue };
            let back = self.work.past.begin_of(high) + self.work.lags.times[k];
            if self.work.instants.same(back, t) {
                for (direction, out) in out[..derived.count()].iter_mut().enumerate() {
                    *out = derived.instant(high, direction) + derived.times[k * derived.width + direction];
                }
                return true;
            }
        }
        false
    }

    /// Tangents of the root functions of the sites with varying delay time, after [`Delaying::lay`] at the point.
    fn break_roots_tangent(&self, t: f64, dt: &[f64], out: &mut [f64]) {
        let Some(derived) = self.work.derived.as_deref().filter(|derived| derived.recording) else {
            return out.fill(0.0);
        };
        let varying = self.work.sites.iter().enumerate().filter(|(_, site)| site.varying);
        for ((k, _), block) in varying.zip(out.chunks_exact_mut(derived.width)) {
            let at = t - self.work.lags.times[k];
            let cursor = self.work.breaks.cursors[k];
            let low = self.work.past.begin_of(cursor.low);
            let above = cursor.high.map_or(f64::MAX, |high| self.work.past.begin_of(high) - at);
            let (sign, segment) =
                if above <= at - low { (1.0, cursor.high.unwrap_or(cursor.low)) } else { (-1.0, cursor.low) };
            for (direction, value) in block.iter_mut().enumerate() {
                let bound = if direction < derived.count() { derived.instant(segment, direction) } else { 0.0 };
                *value = sign * (bound - dt[direction] + derived.times[k * derived.width + direction]);
            }
        }
    }
}

/// Derivatives of the evaluations, after those of the delayed values that belong to the point.
impl Delaying<'_> {
    pub(crate) fn bind_tangent(&mut self, t0: f64) {
        self.inner_tangents().bind_tangent(t0);
    }

    pub(crate) fn initial_residual_tangent(&mut self, t0: f64, z: &[f64], out: &mut [f64]) {
        self.inner_tangents().initial_residual_tangent(t0, z, out);
    }

    pub(crate) fn initial_store_tangent(&mut self, t0: f64, z: &[f64], dz: &[f64], dy: &mut [f64], dyp: &mut [f64]) {
        self.inner_tangents().initial_store_tangent(t0, z, dz, dy, dyp);
    }

    pub(crate) fn residual_tangent(&mut self, t: f64, y: &[f64], yp: &[f64], along: Along<'_>, out: &mut [f64]) {
        self.lay(t, y, yp, Some(along.t), Some(along));
        self.inner_tangents().residual_tangent(t, y, yp, along, out);
    }

    pub(crate) fn jacobian_tangent(
        &mut self,
        t: f64,
        y: &[f64],
        yp: &[f64],
        jacobians: (&mut [f64], &mut [f64]),
        out: &mut [f64],
    ) {
        self.lay(t, y, yp, None, None);
        self.inner_tangents().jacobian_tangent(t, y, yp, jacobians, out);
    }

    pub(crate) fn branches(&mut self) -> usize {
        self.inner_tangents().branches()
    }

    pub(crate) fn branch_values(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let kept = self.keep();
        self.prepare(t, y, yp);
        self.inner_tangents().branch_values(t, y, yp, out);
        self.restore(kept);
    }

    pub(crate) fn roots_tangent(&mut self, t: f64, y: &[f64], yp: &[f64], along: Along<'_>, out: &mut [f64]) {
        self.lay(t, y, yp, Some(along.t), Some(along));
        let varying = self.work.sites.iter().filter(|site| site.varying).count();
        let (own, breaks) = out.split_at_mut(out.len() - varying * along.t.len());
        self.inner_tangents().roots_tangent(t, y, yp, along, own);
        self.break_roots_tangent(t, along.t, breaks);
    }

    pub(crate) fn instant_tangent(&mut self, t: f64, out: &mut [f64]) -> bool {
        self.inner_tangents().instant_tangent(t, out) || self.break_tangent(t, out)
    }

    pub(crate) fn before_event_pass(&mut self, phase: EventPhase, t: f64, y: &[f64], yp: &[f64], along: Along<'_>) {
        self.lay(t, y, yp, Some(along.t), Some(along));
        self.inner_tangents().before_event_pass(phase, t, y, yp, along);
    }

    pub(crate) fn after_event_pass(
        &mut self,
        phase: EventPhase,
        t: f64,
        y: &[f64],
        yp: &[f64],
        along: Along<'_>,
        dy: &mut [f64],
    ) -> bool {
        // The pass has seen the delayed values before the breaks that it lets the sites cross, and so do its derivatives.
        self.inner_tangents().after_event_pass(phase, t, y, yp, along, dy)
    }

    pub(crate) fn outputs_tangent(&mut self, t: f64, y: &[f64], yp: &[f64], along: Along<'_>, out: &mut [f64]) {
        self.lay(t, y, yp, Some(along.t), Some(along));
        self.inner_tangents().outputs_tangent(t, y, yp, along, out);
    }

    pub(crate) fn parameters_tangent(&mut self, out: &mut [f64]) {
        self.inner_tangents().parameters_tangent(out);
    }
}
