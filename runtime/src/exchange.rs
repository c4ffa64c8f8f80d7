//! A system for the integrator of somebody else: `der(x) = f(t, x)`, event indicators, events.
//!
//! The states `x` are the unknowns that are states now.  At given `t` and `x` the implicit equations are solved for rates and algebraic
//! unknowns, `F(t, (x, z), x') = 0`.  Where these enter linearly, with factors that only events change, one evaluation gives them; so it
//! is with equations that say each rate explicitly, `x' - f(t, x) = 0`.  Elsewhere the iteration of `initial::consistent`
//! begins at the *anchor*, the last point that the integrator has accepted, with the matrix of the *basis*, an earlier point of that kind
//! or the anchor itself; so a value depends on `t`, `x`, anchor and basis alone, never on the points that were tried between, and a
//! copy of these two gives the same bits.  Where an accepted point has taken many residuals it becomes the basis.  Indicators carry a
//! hysteresis (they change sign a little beyond the change of their relation), so that behind an event the relation has changed
//! without doubt.
//! What happens at known instants, relations of time alone included, is announced as a time event.
//! Systems with delays have no finite state and are refused.

use hyd_system::{AssertionReport, DaeSystem, EventPhase, Instants, StateChoice, Structure};

use crate::Statistics;
use crate::delay::{DelayWork, Delaying};
use crate::error::{SolveError, Stage};
use crate::events::iteration::{Instant, settle};
use crate::initial::consistent::Consistency;
use crate::initial::{InitialSystem, Start};
use crate::loops::judge;
use crate::output::check_outputs;
use crate::problem::Problem;
use crate::undetermined::OpenUnknowns;
use crate::weights::Weights;

/// Width of the hysteresis, relative to what a relation is made of.
const HYSTERESIS: f64 = 1e-10;
/// Step of the differences by which the size of root functions is found, relative to nominal values.
const PROBE: f64 = 1e-3;
/// Events at the same instant, one after the other, that are gone through before the model is taken to be at fault.
const MOST_EVENTS: usize = 100;
/// An accepted point that took more residuals than this becomes the basis: a matrix there, pivots chosen anew, costs as much as many.
const MOST_RESIDUALS: u64 = 6;
/// The way to a trial point is not parted more finely.
const SMALLEST_PART: f64 = 1e-3;
/// How far ahead changes of relations of time alone are looked for, as a part of the time scale: ten times the run, if its end is known.
const FORESIGHT: f64 = 1e4;
/// Without a stated end of the run, this part of a second counts as its time scale (s); else this part of the run.
const TIME_SCALE: f64 = 1e-3;

/// Numbers of [`Exchange::save`] before the points.
const SETTINGS: usize = 8;

/// What an event has led to.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Settled {
    /// States have other values, or other unknowns are states.
    pub values_changed: bool,
    /// Other unknowns are states.
    pub states_changed: bool,
    /// The model has ended the run: its message.
    pub terminated: Option<String>,
}

/// A point: time (s), unknowns, rates.
#[derive(Clone, Default)]
struct Point {
    t: f64,
    y: Vec<f64>,
    yp: Vec<f64>,
}

/// The system at a point of an integrator outside.
#[derive(Clone)]
pub struct Exchange {
    weights: Weights,
    consistency: Consistency,
    initial: InitialSystem,
    /// In its place but while the system is at work.
    delays: Option<Box<DelayWork>>,
    /// Where iterations begin.
    anchor: Point,
    /// Where the matrix is made.
    basis: Point,
    /// The matrix is that of the basis.
    anchored: bool,
    /// The present point took so long, or another matrix, that it is to be the basis once it is accepted.
    slow: bool,
    /// Points accepted since the start or the last event.
    accepted: u64,
    now: Point,
    /// Rates and algebraic unknowns belong to time and states.
    solved: bool,
    states: Vec<u32>,
    is_state: Vec<bool>,
    /// Widths of the hysteresis.
    widths: Vec<f64>,
    held: Vec<bool>,
    time_scale: f64,
    start: f64,
    stop: f64,
    /// One evaluation gives the rates.
    affine: bool,
    /// What `initial()` has kept from happening is still to come.
    starting: bool,
    reports: Vec<AssertionReport>,
    statistics: Statistics,
}

impl Exchange {
    /// Work space for systems of this structure.
    /// `affine`: it is known that rates of states and algebraic unknowns enter the residual linearly, with factors that only events change.
    pub fn new(structure: &Structure, affine: bool) -> Self {
        let (n, roots) = (structure.unknowns, structure.roots);
        let point = Point { t: 0.0, y: vec![0.0; n], yp: vec![0.0; n] };
        Self {
            weights: Weights::new(n),
            consistency: Consistency::new(structure),
            initial: InitialSystem::new(structure),
            delays: Some(Box::new(DelayWork::new(structure))),
            anchor: point.clone(),
            basis: point.clone(),
            anchored: false,
            slow: false,
            accepted: 0,
            now: point,
            solved: false,
            states: Vec::new(),
            is_state: structure.differential.clone(),
            widths: vec![0.0; roots],
            held: vec![false; roots],
            time_scale: TIME_SCALE,
            start: 0.0,
            stop: f64::INFINITY,
            affine: affine && structure.delays.is_empty(),
            starting: false,
            reports: Vec::new(),
            statistics: Statistics::default(),
        }
    }

    /// The start at `t` (s): parameters and consistent values.  `stop` (s): where the run ends, if that is known; `tolerance`:
    /// the relative one of the integrator.
    ///
    /// # Errors
    /// What keeps the start from having a solution.
    pub fn begin(
        &mut self,
        system: &mut dyn DaeSystem,
        (t, stop): (f64, Option<f64>),
        tolerance: f64,
    ) -> Result<Settled, SolveError> {
        self.statistics = Statistics::default();
        let span = stop.map_or(1.0, |stop| stop - t);
        self.time_scale = if span > 0.0 && span.is_finite() { TIME_SCALE * span } else { TIME_SCALE };
        (self.start, self.stop) = (t, stop.unwrap_or(f64::INFINITY));
        let settled = self.within(system, |this, problem| this.find_start(problem, t, tolerance))?;
        self.now.t = t;
        self.starting = true;
        self.take_over(system);
        self.begin_anew();
        self.find_widths(system);
        Ok(settled)
    }

    fn find_start(&mut self, problem: &mut Problem<'_>, t: f64, tolerance: f64) -> Result<Settled, SolveError> {
        let bound = problem.system.bind(t);
        bound.map_err(|failure| SolveError::evaluation(Stage::Start, t, failure, problem))?;
        problem.system.nominals(&mut self.weights.nominals);
        let differential = problem.system.structure().differential.clone();
        self.weights.set_differential(&differential);
        self.weights.configure(tolerance, differential.iter().map(|_| true));
        self.consistency.reset(&self.weights.nominals);
        self.consistency.read_states(problem);
        let (time_scale, weights, consistency) = (self.time_scale, &self.weights, &mut self.consistency);
        let mut start = Start { t, time_scale, weights, rescue: false, consistency, sensitivity: None };
        let Point { y, yp, .. } = &mut self.now;
        let terminated = self.initial.start(problem, &mut start, y, yp)?;
        problem.system.assertions(t, &self.now.y, &self.now.yp, &mut self.reports);
        self.refuse_failed()?;
        Ok(Settled { values_changed: true, states_changed: false, terminated })
    }

    /// The point is accepted: iterations begin here from now on.
    fn take_over(&mut self, system: &mut dyn DaeSystem) {
        system.states(&mut self.is_state);
        self.states.clear();
        self.states.extend((0u32..).zip(&self.is_state).filter(|(_, state)| **state).map(|(k, _)| k));
        system.held(&mut self.held);
        self.weights.update(&self.now.y);
        self.anchor.clone_from(&self.now);
        self.solved = true;
        self.slow = false;
    }

    /// The anchor becomes the basis.
    fn take_as_basis(&mut self) {
        self.basis.clone_from(&self.anchor);
        self.anchored = false;
    }

    /// As [`Exchange::take_as_basis`], where integration begins anew.
    fn begin_anew(&mut self) {
        self.take_as_basis();
        self.accepted = 0;
    }

    /// The size of each root function: what it changes by when each unknown changes by its nominal value.
    fn find_widths(&mut self, system: &mut dyn DaeSystem) {
        if self.widths.is_empty() {
            return;
        }
        let (n, roots) = (self.now.y.len(), self.widths.len());
        let (mut before, mut after) = (vec![0.0; roots], vec![0.0; roots]);
        system.roots(self.now.t, &self.now.y, &self.now.yp, &mut before);
        let mut sizes = vec![0.0f64; roots];
        let mut moved = self.now.y.clone();
        for k in 0..n {
            let step = PROBE * self.weights.nominals[k];
            moved[k] += step;
            system.roots(self.now.t, &moved, &self.now.yp, &mut after);
            moved[k] = self.now.y[k];
            for (size, (after, before)) in sizes.iter_mut().zip(after.iter().zip(&before)) {
                let change = (after - before).abs() / PROBE;
                *size = if change.is_finite() { size.max(change) } else { *size };
            }
        }
        for (width, (size, value)) in self.widths.iter_mut().zip(sizes.iter().zip(&before)) {
            // What no unknown moves here has the size of its value.
            let size = if *size > 0.0 { *size } else { value.abs() };
            *width = HYSTERESIS * if size > 0.0 && size.is_finite() { size } else { 1.0 };
        }
    }

    /// Number of states.
    #[inline]
    pub fn states(&self) -> usize {
        self.states.len()
    }

    /// Which unknowns are states.
    pub fn state_unknowns(&self) -> &[u32] {
        &self.states
    }

    /// Time (s).
    pub fn time(&self) -> f64 {
        self.now.t
    }

    /// Moves to a time (s).
    #[inline]
    pub fn set_time(&mut self, t: f64) {
        self.solved &= t.to_bits() == self.now.t.to_bits();
        self.now.t = t;
    }

    /// Moves to states, as many as there are.
    #[inline]
    pub fn set_states(&mut self, states: &[f64]) {
        if self.states.len() == self.now.y.len() {
            // All unknowns are states.
            let mut same = true;
            for (old, &value) in self.now.y.iter_mut().zip(states) {
                same &= value.to_bits() == old.to_bits();
                *old = value;
            }
            self.solved &= same;
            return;
        }
        for (&k, &value) in self.states.iter().zip(states) {
            let old = &mut self.now.y[k as usize];
            self.solved &= value.to_bits() == old.to_bits();
            *old = value;
        }
    }

    /// The states.
    pub fn get_states(&self, out: &mut [f64]) {
        for (value, &k) in out.iter_mut().zip(&self.states) {
            *value = self.now.y[k as usize];
        }
    }

    /// Nominal values of the states.
    pub fn get_nominals(&self, out: &mut [f64]) {
        for (value, &k) in out.iter_mut().zip(&self.states) {
            *value = self.weights.nominals[k as usize];
        }
    }

    /// Something outside has changed, such as an input: everything is solved for again.
    pub fn forget(&mut self) {
        self.solved = false;
        // Its slopes may be others, too, but for those that only events change.
        self.anchored &= self.affine;
    }

    /// Solves for rates and algebraic unknowns at the present time and states.
    ///
    /// # Errors
    /// There is no solution near that of the anchor: nothing has changed, and other values may be tried.
    #[inline]
    pub fn solve(&mut self, system: &mut dyn DaeSystem) -> Result<(), SolveError> {
        if self.solved { Ok(()) } else { self.solve_here(system) }
    }

    fn solve_here(&mut self, system: &mut dyn DaeSystem) -> Result<(), SolveError> {
        if self.affine && !self.anchored {
            self.anchored = self.within(system, |this, problem| {
                let Point { t, y, yp } = &this.basis;
                this.consistency.anchor_affine(problem, &this.weights, (*t, y, yp))
            });
        }
        if self.affine && self.anchored {
            let Point { t, y, yp } = &mut self.now;
            self.statistics.residuals += 1;
            let near = (&*self.anchor.y, &*self.anchor.yp);
            self.solved = self.consistency.solve_affine(system, *t, near, y, yp);
        }
        if self.solved { Ok(()) } else { self.search(system) }
    }

    /// Solves by iterations from the anchor.
    fn search(&mut self, system: &mut dyn DaeSystem) -> Result<(), SolveError> {
        self.within(system, |this, problem| {
            let t = this.now.t;
            if !this.anchored {
                let Point { t, y, yp } = &this.basis;
                this.anchored = this.consistency.anchor(problem, &this.weights, (*t, y, yp));
            }
            let before = problem.statistics;
            for (k, &state) in this.is_state.iter().enumerate() {
                if !state {
                    this.now.y[k] = this.anchor.y[k];
                }
            }
            this.now.yp.copy_from_slice(&this.anchor.yp);
            let place = (t, this.time_scale);
            let Point { y, yp, .. } = &mut this.now;
            let result = match this.consistency.follow(problem, place, &this.weights, y, yp) {
                true => Ok(()),
                false => this.consistency.solve(problem, place, &this.weights, y, yp).or_else(|fault| {
                    if this.in_parts(problem) {
                        return Ok(());
                    }
                    let attempt = this.consistency.last_attempt();
                    Err(SolveError::inconsistent(Stage::Step, t, fault, attempt, problem))
                }),
            };
            let after = &problem.statistics;
            // Another matrix was needed.
            this.anchored &= after.factorisations == before.factorisations;
            this.slow = !this.anchored || after.residuals - before.residuals > MOST_RESIDUALS;
            this.solved = result.is_ok();
            result
        })
    }

    /// Goes from the anchor to the present time and states along a straight line, in parts that are made smaller until each has a solution near
    /// that of the part before; false if that does not lead there.  Exponentials of a far trial point need this.
    fn in_parts(&mut self, problem: &mut Problem<'_>) -> bool {
        let (begin, end) = (self.anchor.clone(), self.now.clone());
        let mut reached = begin.clone();
        let (mut done, mut part) = (0.0f64, 0.5f64);
        while done < 1.0 {
            let next = (done + part).min(1.0);
            let along = |from: f64, to: f64| if next < 1.0 { from + next * (to - from) } else { to };
            let mut point = reached.clone();
            point.t = along(begin.t, end.t);
            for &k in &self.states {
                point.y[k as usize] = along(begin.y[k as usize], end.y[k as usize]);
            }
            let Point { t, y, yp } = &mut point;
            if self.consistency.solve(problem, (*t, self.time_scale), &self.weights, y, yp).is_ok() {
                (reached, done, part) = (point, next, 2.0 * part);
            } else {
                part *= 0.5;
                if part < SMALLEST_PART {
                    return false;
                }
            }
        }
        self.now = reached;
        true
    }

    /// Rates of the states.
    ///
    /// # Errors
    /// As [`Exchange::solve`].
    #[inline]
    pub fn derivatives(&mut self, system: &mut dyn DaeSystem, out: &mut [f64]) -> Result<(), SolveError> {
        self.solve(system)?;
        let rates = &self.now.yp;
        match self.states.len() == rates.len() && out.len() == rates.len() {
            true => out.copy_from_slice(rates),
            false => out.iter_mut().zip(&self.states).for_each(|(value, &k)| *value = rates[k as usize]),
        }
        Ok(())
    }

    /// Event indicators: an event is due where one of them changes its sign.
    ///
    /// # Errors
    /// As [`Exchange::solve`].
    pub fn indicators(&mut self, system: &mut dyn DaeSystem, out: &mut [f64]) -> Result<(), SolveError> {
        self.solve(system)?;
        system.roots(self.now.t, &self.now.y, &self.now.yp, out);
        for ((value, &width), &held) in out.iter_mut().zip(&self.widths).zip(&self.held) {
            *value += if held { width } else { -width };
        }
        Ok(())
    }

    /// All recorded variables, as [`DaeSystem::outputs`] orders them.
    ///
    /// # Errors
    /// As [`Exchange::solve`].
    pub fn outputs(&mut self, system: &mut dyn DaeSystem, row: &mut [f64]) -> Result<(), SolveError> {
        self.solve(system)?;
        system.outputs(self.now.t, &self.now.y, &self.now.yp, row);
        if row.iter().all(|value| value.is_finite()) {
            return Ok(());
        }
        self.within(system, |this, problem| check_outputs(problem, this.now.t, (&this.now.y, &this.now.yp), row))
    }

    /// Unknowns and rates, as they were solved for last.
    pub fn point(&self) -> (&[f64], &[f64]) {
        (&self.now.y, &self.now.yp)
    }

    /// The integrator has accepted the point: iterations begin here from now on.  Assertions that do not hold can be read from
    /// [`Exchange::reports`].
    ///
    /// # Errors
    /// As [`Exchange::solve`], and where an assertion of level error does not hold.
    pub fn accept(&mut self, system: &mut dyn DaeSystem) -> Result<(), SolveError> {
        self.solve(system)?;
        self.accepted += 1;
        if self.accepted.is_power_of_two() {
            self.within(system, |this, problem| {
                judge(problem, (Stage::Step, this.now.t), (&this.now.y, &this.now.yp))
            })?;
        }
        self.check(system)?;
        let slow = self.slow;
        self.take_over(system);
        if slow {
            self.take_as_basis();
        }
        Ok(())
    }

    fn check(&mut self, system: &mut dyn DaeSystem) -> Result<(), SolveError> {
        system.assertions(self.now.t, &self.now.y, &self.now.yp, &mut self.reports);
        self.refuse_failed()
    }

    /// The error of the first assertion of that level among the reports.
    fn refuse_failed(&mut self) -> Result<(), SolveError> {
        match self.reports.iter().position(|report| report.error) {
            Some(k) => {
                let report = Box::new(self.reports.swap_remove(k));
                Err(SolveError::Assertion { time: self.now.t, report })
            }
            None => Ok(()),
        }
    }

    /// True if [`Exchange::reports`] has something to give.
    #[inline]
    pub fn has_reports(&self) -> bool {
        !self.reports.is_empty()
    }

    /// Takes the assertions of level warning that have not held since the last call.
    pub fn reports(&mut self) -> Vec<AssertionReport> {
        std::mem::take(&mut self.reports)
    }

    /// True if another choice of states would be clearly better, so that an event should let it be made; `trial` is a copy of the system.
    pub fn wants_other_states(&mut self, trial: &mut dyn DaeSystem) -> bool {
        self.solved && choose_states(trial, &self.now).changed
    }

    /// The events of this instant, until nothing changes.
    ///
    /// # Errors
    /// As [`Exchange::accept`]; relations that keep changing.
    pub fn event(&mut self, system: &mut dyn DaeSystem) -> Result<Settled, SolveError> {
        self.solve(system)?;
        let mut settled = Settled::default();
        let before: Vec<f64> = self.states.iter().map(|&k| self.now.y[k as usize]).collect();
        let instants = Instants::of_run(self.start);
        for round in 0.. {
            let phase = if std::mem::take(&mut self.starting) { EventPhase::Started } else { EventPhase::First };
            let outcome = self.within(system, |this, problem| {
                let Point { t, y, yp } = &mut this.now;
                let at = Instant { first: phase, t: *t, time_scale: this.time_scale, span: f64::INFINITY };
                settle(problem, &mut this.consistency, &this.weights, at, (y, yp), None)
            })?;
            settled.terminated = settled.terminated.or(outcome.terminated);
            // Another event may follow at the same time, as that of `time > 1` does behind all others at 1 s.
            let next = system.next_time_event(self.now.t);
            if settled.terminated.is_some() || round == MOST_EVENTS || !instants.has_come(next.t, self.now.t) {
                break;
            }
        }
        self.anchored = false;
        self.check(system)?;
        settled.states_changed = choose_states(system, &self.now).changed;
        self.within(system, |this, problem| this.consistency.read_states(problem));
        if settled.states_changed {
            self.within(system, |this, problem| {
                let Point { t, y, yp } = &mut this.now;
                this.consistency.follow(problem, (*t, this.time_scale), &this.weights, y, yp);
            });
        }
        self.take_over(system);
        self.begin_anew();
        let moved = before.iter().zip(&self.states).any(|(old, &k)| self.now.y[k as usize].to_bits() != old.to_bits());
        settled.values_changed = moved || settled.states_changed;
        Ok(settled)
    }

    /// The next time event (s) behind the event that was settled last; infinity if there is none.
    pub fn next_event(&mut self, system: &mut dyn DaeSystem) -> f64 {
        let t = self.now.t;
        let next = system.next_time_event(t);
        // What happens right after the end of the run does not happen.
        let instants = Instants::of_run(self.start);
        let next = if next.right_after && instants.same(next.t, self.stop) { f64::INFINITY } else { next.t };
        // Relations of time alone change at instants that the integrator must not step over.
        let until = next.min(self.stop).min(t + FORESIGHT * self.time_scale);
        let unchanged = system.unchanged_until(t, until);
        if unchanged < until && instants.lies_ahead(unchanged, t) { unchanged } else { next }
    }

    /// What rates and algebraic unknowns change by when each state changes by an entry of `dx`, and each residual by one of `residual`
    /// beside (what comes of inputs): changes of all unknowns and of all rates.
    ///
    /// # Errors
    /// As [`Exchange::solve`], and where the equations are singular at this point.
    pub fn tangent(
        &mut self,
        system: &mut dyn DaeSystem,
        dx: &[f64],
        residual: &[f64],
    ) -> Result<(Vec<f64>, Vec<f64>), SolveError> {
        self.solve(system)?;
        let (mut dy, mut dyp) = (vec![0.0; self.now.y.len()], vec![0.0; self.now.y.len()]);
        for (&k, &value) in self.states.iter().zip(dx) {
            dy[k as usize] = value;
        }
        self.anchored = false;
        self.within(system, |this, problem| {
            let Point { t, y, yp } = &this.now;
            if !this.consistency.anchor(problem, &this.weights, (*t, y, yp)) {
                let reason = "the equations do not determine all derivatives at this point".to_string();
                let failure = hyd_system::EvalFailure { reason, ..Default::default() };
                return Err(SolveError::evaluation(Stage::Step, *t, failure, problem));
            }
            this.consistency.tangent(residual, &mut dy, &mut dyp);
            Ok(())
        })?;
        Ok((dy, dyp))
    }

    /// Everything that what follows depends on, beside the system, as numbers.
    pub fn save(&self) -> Vec<f64> {
        let Point { t, y, yp } = &self.now;
        let [solved, starting, slow] = [self.solved, self.starting, self.slow].map(|flag| f64::from(u8::from(flag)));
        let tolerance = self.weights.tolerance();
        let accepted = self.accepted as f64;
        let settings = [self.time_scale, self.start, self.stop, tolerance, solved, starting, slow, accepted];
        let (anchor, basis) = (&self.anchor, &self.basis);
        let points =
            [&[*t][..], y, yp, &[anchor.t], &anchor.y, &anchor.yp, &[basis.t], &basis.y, &basis.yp, &self.widths];
        settings.iter().chain(points.into_iter().flatten()).copied().collect()
    }

    /// Goes on from what [`Exchange::save`] has given with a system in the condition of that time; false, with nothing changed, if the numbers are
    /// not of such a system.
    pub fn restore(&mut self, system: &mut dyn DaeSystem, saved: &[f64]) -> bool {
        let (n, roots) = (self.now.y.len(), self.widths.len());
        if saved.len() != SETTINGS + 3 * (1 + 2 * n) + roots || saved[3].is_nan() || saved[3] <= 0.0 {
            return false;
        }
        let (settings, points) = saved.split_at(SETTINGS);
        (self.time_scale, self.start, self.stop) = (settings[0], settings[1], settings[2]);
        (self.solved, self.starting) = (settings[4] != 0.0, settings[5] != 0.0);
        let read = |point: &mut Point, values: &[f64]| {
            point.t = values[0];
            point.y.copy_from_slice(&values[1..=n]);
            point.yp.copy_from_slice(&values[1 + n..1 + 2 * n]);
        };
        let length = 1 + 2 * n;
        read(&mut self.anchor, &points[length..2 * length]);
        read(&mut self.basis, &points[2 * length..3 * length]);
        self.widths.copy_from_slice(&points[3 * length..]);
        system.nominals(&mut self.weights.nominals);
        let differential = system.structure().differential.clone();
        self.weights.set_differential(&differential);
        self.weights.configure(settings[3], differential.iter().map(|_| true));
        self.consistency.reset(&self.weights.nominals);
        self.within(system, |this, problem| this.consistency.read_states(problem));
        let (now, solved) = (points[..length].to_vec(), self.solved);
        self.now.clone_from(&self.anchor);
        self.take_over(system);
        read(&mut self.now, &now);
        (self.solved, self.slow, self.anchored) = (solved, settings[6] != 0.0, false);
        // NaN becomes 0; a number beyond every count becomes one that can still grow.
        self.accepted = (settings[7] as u64).min(u64::MAX >> 1);
        true
    }

    /// What it has cost so far.
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    fn within<R>(&mut self, system: &mut dyn DaeSystem, work: impl FnOnce(&mut Self, &mut Problem<'_>) -> R) -> R {
        let mut delays = self.delays.take().unwrap_or_default();
        let mut problem = Problem {
            system: Delaying::new(system, &mut delays),
            statistics: self.statistics,
            profile: None,
            open: OpenUnknowns::default(),
        };
        let result = work(self, &mut problem);
        self.statistics = problem.statistics;
        self.delays = Some(delays);
        result
    }
}

/// Judges the choice of states at a point; nothing changes where there is nothing to choose.
fn choose_states(system: &mut dyn DaeSystem, at: &Point) -> StateChoice {
    system.state_choices().map_or_else(StateChoice::default, |choices| choices.choose_states(at.t, &at.y, &at.yp))
}
