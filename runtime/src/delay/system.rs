//! A system with its past: hands over the delayed values before every evaluation, and adds the events of the past.

use std::sync::Arc;

use hyd_system::{
    AssertionReport, DaeSystem, EvalFailure, EventChange, EventPhase, Excerpt, Instants, LoopError, StateChoice,
    Structure, Tables, TimeEvent,
};

use super::{DelayWork, SHORTEST_PART};

/// Most evaluations until delayed values, sources and delay times agree.
const MOST_PASSES: usize = 30;

/// A system and its past: what the solver evaluates.  Without delay sites every call goes straight through.
pub(crate) struct Delaying<'a> {
    pub(super) inner: &'a mut dyn DaeSystem,
    pub(super) work: &'a mut DelayWork,
}

impl<'a> Delaying<'a> {
    /// Both together; `work` must be made for the structure of the system.
    pub(crate) fn new(inner: &'a mut dyn DaeSystem, work: &'a mut DelayWork) -> Self {
        Self { inner, work }
    }

    /// Hands over the delayed values that belong to a point.
    #[inline(always)]
    pub(super) fn prepare(&mut self, t: f64, y: &[f64], yp: &[f64]) {
        if !self.work.sites.is_empty() && self.work.recording {
            self.look_back(t, y, yp);
        }
    }

    #[inline(never)]
    fn look_back(&mut self, t: f64, y: &[f64], yp: &[f64]) {
        let by_time_alone =
            !self.work.any_varying && (self.work.step.anchor.is_some() || !self.work.reaches_into_step(t));
        if by_time_alone {
            if self.work.read.cached != Some(t) {
                self.work.evaluate(t);
                self.hand_over();
                self.work.read.cached = Some(t);
            }
            return;
        }
        self.work.read.cached = None;
        let mut settled = false;
        for _ in 0..MOST_PASSES {
            self.work.evaluate(t);
            self.hand_over();
            self.ask(t, y, yp);
            settled = self.work.settled();
            if settled {
                break;
            }
        }
        // A shorter step knows better, or reads the past alone.
        if (self.work.read.coarse || !settled) && !self.work.step.accepted {
            self.work.read.values.fill(f64::NAN);
            self.hand_over();
        }
    }

    /// The system itself, for what only systems without a past are asked.
    pub(crate) fn inner(&mut self) -> &mut dyn DaeSystem {
        self.inner
    }

    /// Some equation reads values of the past.
    pub(crate) fn has_delays(&self) -> bool {
        !self.work.sites.is_empty()
    }

    /// Some inputs follow recorded samples.
    pub(crate) fn has_inputs(&self) -> bool {
        !self.inner.structure().inputs.is_empty()
    }

    /// A delay time that cannot vary is zero.
    pub(crate) fn has_vanished_delay(&self) -> bool {
        let mut sites = self.work.lags.times.iter().zip(&self.work.sites);
        self.work.recording && sites.any(|(&time, site)| time == 0.0 && !site.varying)
    }

    /// Prepares derivatives by this many directions.
    pub(crate) fn derive(&mut self, width: usize) {
        self.work.derive(width);
    }

    /// Longest sensible step from here (s).
    pub(crate) fn longest_step(&self) -> f64 {
        self.work.longest_step()
    }

    /// Where a step of about `h` and at most `most` (s) from `from` (s) should end for what it reads of the past, if that matters.
    pub(crate) fn end_of_step(&self, from: f64, steps: (f64, f64)) -> Option<f64> {
        self.work.end_of_step(from, steps)
    }

    /// The same for a step of the derivatives.
    pub(crate) fn end_of_derived_step(&self, from: f64, steps: (f64, f64)) -> Option<f64> {
        self.work.end_of_derived_step(from, steps)
    }

    /// The last event did nothing but let delays cross breaks of the past.
    pub(crate) fn has_only_crossed(&self) -> bool {
        self.work.only_crossed
    }

    /// The shortest delay time at present (s), none that vanishes.
    pub(crate) fn shortest_delay(&self) -> Option<f64> {
        let times = self.work.lags.times.iter().zip(&self.work.lags.bounds);
        times.filter(|(_, bound)| **bound > 0.0).map(|(&time, bound)| time.max(SHORTEST_PART * bound)).reduce(f64::min)
    }

    fn hand_over(&mut self) {
        if let Some(delays) = self.inner.delays() {
            delays.set_delayed(&self.work.read.values, &self.work.read.rates, &self.work.lags.times);
        }
    }

    /// Sources and delay times at a point with the delayed values as they are.
    fn ask(&mut self, t: f64, y: &[f64], yp: &[f64]) {
        let (sources, times) = (&mut self.work.asked.sources, &mut self.work.asked.times);
        if let Some(delays) = self.inner.delays() {
            delays.delay_points(t, y, yp, sources, times);
        }
    }

    /// The sources at a point, into `new_sources`.
    pub(super) fn sources_at(&mut self, t: f64, y: &[f64], yp: &[f64]) {
        self.prepare(t, y, yp);
        self.ask(t, y, yp);
    }

    /// The values at `t` (s) are those after the start or an event: the past goes on from here in a new segment.
    pub(crate) fn begin_segment(&mut self, t: f64, y: &[f64], yp: &[f64]) {
        if self.work.sites.is_empty() {
            return;
        }
        if !self.work.recording {
            self.begin_past(t, y, yp);
        } else if t < self.work.past.end() {
            self.work.past.cut(t);
        }
        let work = &mut *self.work;
        work.read.cached = None;
        for (site, left) in work.asked.times.iter_mut().enumerate() {
            let newest = work.past.newest();
            *left = work.past.at(site, t, (newest, None), &mut 0).0;
        }
        let mut left = std::mem::take(&mut self.work.step.anchor_values);
        left.copy_from_slice(&self.work.asked.times);
        if self.work.past.begin_of(self.work.past.newest()) < t {
            self.work.past.begin_segment(t);
        }
        self.sources_at(t, y, yp);
        let mut right = std::mem::take(&mut self.work.asked.sources);
        self.work.widen(&right);
        let work = &mut *self.work;
        work.read.sources.copy_from_slice(&right);
        work.step.begun.copy_from_slice(&right);
        work.breaks.add(&work.past, &left, &right, &work.accuracy.limits);
        std::mem::swap(&mut work.asked.sources, &mut right);
        std::mem::swap(&mut work.step.anchor_values, &mut left);
        // Without delay there is nothing to wait for.
        for site in 0..work.sites.len() {
            let slack = work.slack(site, t);
            if work.lags.times[site] <= slack {
                work.breaks.cross_near(&work.past, site, t, slack);
            }
        }
    }

    /// The first values of a run.
    fn begin_past(&mut self, t: f64, y: &[f64], yp: &[f64]) {
        if let Some(delays) = self.inner.delays() {
            delays.delay_bounds(&mut self.work.lags.bounds);
        }
        self.ask(t, y, yp);
        let work = &mut *self.work;
        for (site, &time) in work.asked.times.iter().enumerate() {
            work.lags.times[site] =
                if time.is_finite() { time.clamp(0.0, work.lags.bounds[site].max(0.0)) } else { 0.0 };
        }
        let fixed = work.lags.times.iter().zip(&work.sites).filter(|(_, site)| !site.varying);
        work.lags.shortest_fixed = fixed.map(|(&time, _)| time).fold(f64::INFINITY, f64::min);
        work.accuracy.scale.fill(0.0);
        work.accuracy.limits.fill(0.0);
        work.instants = Instants::of_run(t);
        work.past.restart(t, &work.asked.sources);
        work.breaks.restart(work.sites.len());
        work.read.sources.copy_from_slice(&work.asked.sources);
        work.recording = true;
    }
}

/// Evaluations: those of the system, with the delayed values that belong to the point; what has no part in the past goes straight through.
impl Delaying<'_> {
    pub(crate) fn structure(&self) -> &Structure {
        self.inner.structure()
    }

    pub(crate) fn tables(&self) -> &Arc<Tables> {
        self.inner.tables()
    }

    pub(crate) fn parameters(&self) -> &[f64] {
        self.inner.parameters()
    }

    pub(crate) fn bind(&mut self, t0: f64) -> Result<(), EvalFailure> {
        self.inner.bind(t0)
    }

    pub(crate) fn nominals(&self, out: &mut [f64]) {
        self.inner.nominals(out);
    }

    pub(crate) fn tested(&self, out: &mut [bool]) {
        self.inner.tested(out);
    }

    pub(crate) fn initial_nominals(&self, out: &mut [f64]) {
        self.inner.initial_nominals(out);
    }

    pub(crate) fn initial_guess(&mut self, t0: f64, z: &mut [f64]) -> Result<(), EvalFailure> {
        self.inner.initial_guess(t0, z)
    }

    pub(crate) fn initial_residual(&mut self, t0: f64, z: &[f64], out: &mut [f64]) -> Result<(), EvalFailure> {
        self.inner.initial_residual(t0, z, out)
    }

    pub(crate) fn initial_jacobian(&mut self, t0: f64, z: &[f64], values: &mut [f64]) -> Result<(), EvalFailure> {
        self.inner.initial_jacobian(t0, z, values)
    }

    pub(crate) fn initial_store(
        &mut self,
        t0: f64,
        z: &[f64],
        y: &mut [f64],
        yp: &mut [f64],
    ) -> Result<(), EvalFailure> {
        self.inner.initial_store(t0, z, y, yp)
    }

    pub(crate) fn residual(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.prepare(t, y, yp);
        self.inner.residual(t, y, yp, out);
    }

    pub(crate) fn loop_error(&mut self, t: f64, y: &[f64], yp: &[f64]) -> Option<LoopError> {
        self.prepare(t, y, yp);
        self.inner.torn_loops()?.loop_error(t, y, yp)
    }

    pub(crate) fn initial_loop_error(&mut self, t0: f64, z: &[f64]) -> Option<LoopError> {
        self.inner.torn_loops()?.initial_loop_error(t0, z)
    }

    pub(crate) fn jacobian(
        &mut self,
        t: f64,
        y: &[f64],
        yp: &[f64],
        state_values: &mut [f64],
        rate_values: &mut [f64],
    ) {
        self.prepare(t, y, yp);
        self.inner.jacobian(t, y, yp, state_values, rate_values);
    }

    pub(crate) fn has_homotopy(&mut self) -> bool {
        self.inner.homotopy().is_some()
    }

    /// See [`hyd_system::Homotopy`].
    pub(crate) fn set_homotopy(&mut self, share: f64) {
        if let Some(homotopy) = self.inner.homotopy() {
            homotopy.set_homotopy(share);
        }
    }

    /// Which unknowns are states at present.
    pub(crate) fn states(&mut self, out: &mut [bool]) {
        self.inner.states(out);
    }

    pub(crate) fn choose_states(&mut self, t: f64, y: &[f64], yp: &[f64]) -> StateChoice {
        self.prepare(t, y, yp);
        self.inner.state_choices().map_or_else(StateChoice::default, |choices| choices.choose_states(t, y, yp))
    }

    pub(crate) fn roots(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.prepare(t, y, yp);
        self.inner.roots(t, y, yp, out);
        let varying = self.work.sites.iter().filter(|site| site.varying).count();
        let first = out.len() - varying;
        self.work.roots(t, &mut out[first..]);
    }

    pub(crate) fn held(&self, out: &mut [bool]) {
        self.inner.held(out);
        let varying = self.work.sites.iter().filter(|site| site.varying).count();
        let first = out.len() - varying;
        out[first..].fill(true);
    }

    pub(crate) fn next_time_event(&mut self, t: f64) -> TimeEvent {
        let next = self.inner.next_time_event(t);
        let back = if self.work.recording { self.work.next_break(t) } else { f64::INFINITY };
        // What coincides happens at the system's own instant, so that breaks do not wander off by adding delays.
        if self.work.instants.lies_ahead(next.t, back) { TimeEvent::at(back) } else { next }
    }

    pub(crate) fn unchanged_until(&mut self, t: f64, until: f64) -> f64 {
        self.inner.unchanged_until(t, until)
    }

    pub(crate) fn event_pass(
        &mut self,
        phase: EventPhase,
        t: f64,
        y: &mut [f64],
        yp: &[f64],
    ) -> Result<EventChange, EvalFailure> {
        self.prepare(t, y, yp);
        let mut change = self.inner.event_pass(phase, t, y, yp)?;
        // Values before the event are those before the break; the new ones count from the next pass on.
        let is_quiet = !change.changed;
        if phase == EventPhase::First {
            let has_crossed = self.work.recording && self.work.cross(t);
            change.changed |= has_crossed;
            self.work.only_crossed = has_crossed && is_quiet;
        } else {
            self.work.only_crossed &= is_quiet;
        }
        Ok(change)
    }

    /// See [`hyd_system::Switches::switch`]; false without relations.
    pub(crate) fn switch(&mut self, t: f64, y: &[f64], yp: &[f64]) -> bool {
        self.prepare(t, y, yp);
        self.inner.switches().is_some_and(|switches| switches.switch(t, y, yp))
    }

    /// See [`hyd_system::Switches::switched`]; none without relations.
    pub(crate) fn switched(&mut self) -> Option<Vec<f64>> {
        self.inner.switches().map(|switches| switches.switched())
    }

    pub(crate) fn switch_back(&mut self, kept: &[f64]) {
        if let Some(switches) = self.inner.switches() {
            switches.switch_back(kept);
        }
    }

    pub(crate) fn outputs(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.prepare(t, y, yp);
        self.inner.outputs(t, y, yp, out);
    }

    pub(crate) fn find_excerpt(&mut self, wanted: &[u32]) -> Option<Excerpt> {
        let excerpt = self.inner.find_excerpt(wanted)?;
        // What is read of the past may depend on everything.
        let rates = excerpt.rates || self.inner.delays().is_some();
        Some(Excerpt { rates, ..excerpt })
    }

    pub(crate) fn excerpt(&mut self, number: usize, t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        self.prepare(t, y, yp);
        self.inner.excerpt(number, t, y, yp, out);
    }

    pub(crate) fn assertions(&mut self, t: f64, y: &[f64], yp: &[f64], out: &mut Vec<AssertionReport>) {
        self.prepare(t, y, yp);
        self.inner.assertions(t, y, yp, out);
    }

    /// Tells the system of a step; true if it wants an event there.
    pub(crate) fn completed(&mut self, t: f64, y: &[f64]) -> Result<bool, EvalFailure> {
        self.inner.steps().map_or(Ok(false), |steps| steps.completed(t, y))
    }

    pub(crate) fn input_reach(&mut self, t: f64) -> f64 {
        self.inner.inputs().map_or(f64::INFINITY, |inputs| inputs.input_reach(t))
    }

    /// How many samples of the input with the most have passed.
    pub(crate) fn samples_passed(&mut self, t: f64) -> u64 {
        self.inner.inputs().map_or(0, |inputs| inputs.samples_passed(t))
    }

    pub(crate) fn diagnose(&mut self, t: f64, y: &[f64], yp: &[f64]) -> Option<EvalFailure> {
        self.prepare(t, y, yp);
        self.inner.diagnose(t, y, yp)
    }

    pub(crate) fn diagnose_initial(&mut self, t0: f64, z: &[f64]) -> Option<EvalFailure> {
        self.inner.diagnose_initial(t0, z)
    }
}
