//! One pass of the event iteration.
//!
//! A pass fixes `pre` values and the truth of relations, then evaluates assigned variables and discrete equations until
//! they agree with each other (the discrete part of the simultaneous equations of Modelica 3.6, section 8.6, at fixed
//! unknowns), then `reinit` and `terminate`.  The solver solves for the unknowns again between passes; where discrete equations read
//! unknowns that follow from discrete variables, a pass is repeated with their new values until both agree, before `pre` moves on.

use hyd_system::{AssertionReport, CheckKind, EvalFailure, EventChange, EventPhase};

use crate::instance::{Instance, Point};
use crate::program::Area;
use crate::routines::EventRoutines;

/// Rounds of a pass before the discrete equations are taken to have no solution at these unknowns.
const ROUNDS: usize = 16;

/// Values read of two solutions of the same equations that differ by no more than this, relative to them, are the same; where they are
/// differences that nearly vanish and do not come to rest, by no more than [`SOLVED`], relative to them and 1, after this many repetitions.
const SAME_SOLUTION: f64 = 1e-12;
const SOLVED: f64 = 1e-9;
const MANY_REPETITIONS: u32 = 20;

impl Instance {
    /// One pass; see [`hyd_system::DaeSystem::event_pass`].
    pub(crate) fn pass(
        &mut self,
        phase: EventPhase,
        t: f64,
        y: &mut [f64],
        yp: &[f64],
    ) -> Result<EventChange, EvalFailure> {
        self.set_time(t, phase == EventPhase::Initial);
        if phase != EventPhase::Repeat {
            self.save_pre(phase, Point { unknown: y, rate: yp });
        }
        let mut jumped = false;
        if phase == EventPhase::First {
            self.place_clock(t, Point { unknown: y, rate: yp });
            jumped = self.pass_samples(t);
        }
        self.remember();
        self.settle(phase, t, Point { unknown: y, rate: yp });
        // Passes of the start read one solution of the initial system after the other, too.
        self.memory.repetitions = match phase {
            EventPhase::Initial => self.memory.repetitions,
            EventPhase::Repeat => self.memory.repetitions + 1,
            _ => 0,
        };
        // The initial system read the values from before the start that it was solved with.
        let late = phase == EventPhase::Initial && std::mem::take(&mut self.memory.late_changed);
        let switched = self.differs() || late;
        let (changed, by_inputs) = (switched || jumped, jumped && !switched);
        if phase == EventPhase::Initial && self.loaded.model.routines.events.reads_solution {
            self.memory.repetitions += 1;
        }
        if !self.discrete_values().iter().all(|value| value.is_finite()) {
            return Err(self.discrete_failure(Point { unknown: y, rate: yp }));
        }
        // At the start every pass solves the initial system again with the same `pre`.
        let unsettled = changed && phase != EventPhase::Initial && self.loaded.model.routines.events.reads_solution;
        self.memory.reinit_waits = unsettled;
        if unsettled {
            return Ok(EventChange { changed, by_inputs, unsettled, ..EventChange::default() });
        }
        let terminated = self.event_checks(phase, Point { unknown: y, rate: yp });
        let reinitialised = self.reinitialise(y, yp)?;
        // Conditions are judged once relations and discrete variables have settled.
        if phase == EventPhase::Initial
            && !changed
            && let Some(contradiction) = self.memory.contradiction.take()
        {
            return Err(contradiction);
        }
        Ok(EventChange { changed, by_inputs, reinitialised, terminated, unsettled })
    }

    /// Relations and discrete equations at a point once more, `pre` as it is; true if something changes or is not finite.
    pub(crate) fn switch_at(&mut self, t: f64, point: Point<'_>) -> bool {
        self.set_time(t, false);
        self.remember();
        self.settle(EventPhase::Iterate, t, point);
        self.differs() || !self.discrete_values().iter().all(|value| value.is_finite())
    }

    /// Where discrete values and truths of relations stand.
    pub(crate) fn truths_and_values(&self) -> impl Iterator<Item = usize> + use<> {
        let layout = &self.loaded.model.area;
        layout.discrete.clone().chain(layout.held.clone()).map(|index| index as usize)
    }

    /// True if the last pass has left `reinit` to its repetition.
    pub fn reinit_waits(&self) -> bool {
        self.memory.reinit_waits
    }

    fn discrete_values(&self) -> &[f64] {
        let range = &self.loaded.model.area.discrete;
        &self.memory.data[range.start as usize..range.end as usize]
    }

    /// `pre(v)` of discrete and of continuous variables.
    fn save_pre(&mut self, phase: EventPhase, point: Point<'_>) {
        let loaded = self.loaded.clone();
        let layout = &loaded.model.area;
        // During the start `pre` of discrete variables are their start values, as `bind` left them (Modelica 3.6, 8.6).
        if phase != EventPhase::Initial {
            let discrete = layout.discrete.start as usize..layout.discrete.end as usize;
            self.memory.data.copy_within(discrete, layout.pre.start as usize);
        }
        if layout.pre_continuous.is_empty() {
            return;
        }
        self.run(loaded.model.routines.simulation.assign, point, &mut [], &mut []);
        for &(place, index) in &layout.pre_continuous {
            let value = match place.area {
                Area::Unknown => point.unknown[place.index as usize],
                Area::Work => self.memory.work[place.index as usize],
                _ => self.memory.data[place.index as usize],
            };
            self.memory.data[index as usize] = value;
        }
    }

    /// Keeps discrete variables and relations for comparison.
    fn remember(&mut self) {
        let layout = &self.loaded.model.area;
        let (discrete, held) = (layout.discrete.clone(), layout.held.clone());
        let positions = discrete.chain(held);
        for (kept, index) in self.memory.before.iter_mut().zip(positions) {
            *kept = self.memory.data[index as usize];
        }
    }

    /// True if a discrete variable is not what it was, or a relation of which more depends than discrete variables (`quenched = i < 1e-3 or
    /// pre(quenched)` does not ask for `i < 1e-3` once it is true); solutions that a repetition reads differ by rounding at least.
    fn differs(&self) -> bool {
        let layout = &self.loaded.model.area;
        let steering = &self.loaded.model.routines.events.steering;
        let steers = |index: u32| steering.get((index - layout.held.start) as usize).is_none_or(|&steers| steers);
        let held = layout.held.clone().zip(&self.memory.before[layout.discrete.len()..]);
        let held = held.filter(|&(index, _)| steers(index));
        let mut positions = layout.discrete.clone().zip(&self.memory.before).chain(held);
        let allowed = |a: f64, b: f64| match self.memory.repetitions {
            0 => 0.0,
            1..MANY_REPETITIONS => SAME_SOLUTION * a.abs().max(b.abs()),
            // About as exact as the solver makes unknowns.
            _ => SOLVED * (a.abs().max(b.abs()) + 1.0),
        };
        positions.any(|(index, &kept)| {
            let value = self.memory.data[index as usize];
            value != kept && (value - kept).abs() > allowed(value, kept)
        })
    }

    /// New truths once, then assigned variables and discrete equations until nothing changes.
    ///
    /// Relations stay as they are within a pass and when it is repeated, so that a discrete variable may move the threshold that
    /// fired it; those that read discrete variables without having a part in them keep up with them.
    fn settle(&mut self, phase: EventPhase, t: f64, point: Point<'_>) {
        let loaded = self.loaded.clone();
        self.run(loaded.model.routines.simulation.assign, point, &mut [], &mut []);
        let mut changed = phase != EventPhase::Repeat && self.update_relations(t, point);
        for _ in 0..ROUNDS {
            if changed {
                self.run(loaded.model.routines.simulation.assign, point, &mut [], &mut []);
            }
            changed = self.update_discrete(point);
            if !changed {
                return;
            }
            self.update_late(t, point);
        }
    }

    /// New truths of the relations that keep up with discrete variables.
    fn update_late(&mut self, t: f64, point: Point<'_>) {
        let loaded = self.loaded.clone();
        let (layout, events) = (&loaded.model.area, &loaded.model.routines.events);
        if events.late.is_empty() {
            return;
        }
        self.run_own(events.truths, point);
        let mut truths = std::mem::take(&mut self.memory.out);
        self.truths_by_instants(t, point, events, &mut truths);
        for &relation in &events.late {
            self.memory.data[(layout.held.start + relation) as usize] = truths[relation as usize];
        }
        self.memory.out = truths;
    }

    /// New truths; true if one changed.
    fn update_relations(&mut self, t: f64, point: Point<'_>) -> bool {
        let loaded = self.loaded.clone();
        let (layout, events) = (&loaded.model.area, &loaded.model.routines.events);
        let count = layout.held.len();
        if count == 0 {
            return false;
        }
        self.run_own(events.truths, point);
        let mut truths = std::mem::take(&mut self.memory.out);
        self.truths_by_roots(point, events, &mut truths);
        self.truths_by_instants(t, point, events, &mut truths);
        let mut changed = false;
        for (&truth, index) in truths[..count].iter().zip(layout.held.clone()) {
            let held = &mut self.memory.data[index as usize];
            changed |= *held != truth;
            *held = truth;
        }
        self.memory.out = truths;
        changed
    }

    /// Relations behind root functions follow the sign that the solver located, so that rounding cannot make them differ.
    ///
    /// `space` as in [`Instance::truths_by_instants`].
    fn truths_by_roots(&mut self, point: Point<'_>, events: &EventRoutines, space: &mut [f64]) {
        if events.rooted.is_empty() {
            return;
        }
        let (truths, roots) = space.split_at_mut(space.len() / 3);
        self.run(self.loaded.model.routines.simulation.extra, point, roots, &mut []);
        for (&relation, &root) in events.rooted.iter().zip(roots.iter()) {
            // At zero the comparison itself decides between `<` and `<=`.
            if root != 0.0 && !root.is_nan() {
                truths[relation as usize] = f64::from(u8::from(root > 0.0));
            }
        }
    }

    /// Evaluates the discrete equations in order; true if a variable changed.
    fn update_discrete(&mut self, point: Point<'_>) -> bool {
        let loaded = self.loaded.clone();
        let range = &loaded.model.area.discrete;
        let range = range.start as usize..range.end as usize;
        if range.is_empty() {
            return false;
        }
        self.memory.last.copy_from_slice(&self.memory.data[range.clone()]);
        self.run(loaded.model.routines.events.discrete, point, &mut [], &mut []);
        self.memory.data[range] != self.memory.last[..]
    }

    /// Runs `reinit`; true if a state changed.
    fn reinitialise(&mut self, y: &mut [f64], yp: &[f64]) -> Result<bool, EvalFailure> {
        let loaded = self.loaded.clone();
        let unknowns = &loaded.model.routines.events.reinit_unknowns;
        if unknowns.is_empty() {
            return Ok(false);
        }
        self.run(loaded.model.routines.simulation.assign, Point { unknown: y, rate: yp }, &mut [], &mut []);
        self.run_own(loaded.model.routines.events.reinits, Point { unknown: y, rate: yp });
        if !self.memory.out[..unknowns.len()].iter().all(|value| value.is_finite()) {
            return Err(self.reinit_failure(Point { unknown: y, rate: yp }));
        }
        let mut changed = false;
        // A state may have several, of which those that did not fire return what it was before all of them.
        let before: Vec<f64> = unknowns.iter().map(|&unknown| y[unknown as usize]).collect();
        for ((&unknown, &value), before) in unknowns.iter().zip(&self.memory.out).zip(before) {
            if value.to_bits() != before.to_bits() {
                y[unknown as usize] = value;
                changed = true;
            }
        }
        Ok(changed)
    }

    /// Terminations and assertions of `when`s: the message of the first termination that fires.  Assertions that fail are kept until they are
    /// asked for with those of the point.
    fn event_checks(&mut self, phase: EventPhase, point: Point<'_>) -> Option<String> {
        let loaded = self.loaded.clone();
        let checks = &loaded.model.checks;
        if checks.iter().all(|check| check.kind == CheckKind::Assert) {
            return None;
        }
        self.run(loaded.model.routines.simulation.assign, point, &mut [], &mut []);
        self.run_own(loaded.model.routines.events.checks, point);
        if phase == EventPhase::Initial {
            // Passes of the start are of one event: what the last one says counts.
            self.memory.failed.clear();
        }
        let out = &self.memory.out;
        if phase == EventPhase::Repeat {
            // The pass before, with what the solution has become since.
            self.memory.failed.retain(|(known, _)| out[*known] != 0.0);
        }
        let fired = |kind: CheckKind| {
            let all = checks.iter().zip(out).enumerate();
            all.filter(move |(_, (check, value))| check.kind == kind && **value != 0.0)
        };
        for (k, (check, _)) in fired(CheckKind::AssertOnce) {
            self.memory.failed.retain(|(known, _)| *known != k);
            self.memory.failed.push((k, check.report(out)));
        }
        let mut terminations = fired(CheckKind::Terminate);
        terminations.next().map(|(_, (check, _))| check.text(out))
    }

    /// Appends the assertions that do not hold.
    pub(crate) fn failed_assertions(&mut self, y: &[f64], yp: &[f64], out: &mut Vec<AssertionReport>) {
        out.extend(self.memory.failed.drain(..).map(|(_, report)| report));
        if self.loaded.model.checks.iter().all(|check| check.kind != CheckKind::Assert) {
            return;
        }
        let loaded = self.loaded.clone();
        let point = Point { unknown: y, rate: yp };
        self.run(loaded.model.routines.simulation.assign, point, &mut [], &mut []);
        self.run_own(loaded.model.routines.events.checks, point);
        for (check, &holds) in loaded.model.checks.iter().zip(&self.memory.out) {
            if check.kind == CheckKind::Assert && holds == 0.0 {
                out.push(check.report(&self.memory.out));
            }
        }
    }
}
