//! The integrator of a run: variable-order BDF and the one-step method behind one face, and the choice between them.
//!
//! [`Integrator`] steps with one of the two and hands over from one to the other at accepted points, without a restart at order
//! one.  With [`Solver::Auto`] the [`monitor`] decides when, from what steps cost and how far they lead.

mod crowding;
mod interruption;
mod monitor;
mod phases;

use hyd_system::Structure;

use crate::bdf::Bdf;
use crate::corrector::StepFailure;
use crate::esdirk::{Esdirk, ORDER};
use crate::first_step::FirstSteps;
use crate::problem::Problem;
use crate::weights::Weights;
use crate::{Solver, Statistics};
use crowding::Crowding;
use interruption::Interruption;
use monitor::{Mode, Monitor, Rival, StepFacts};
use phases::MOST_PHASES;
pub use phases::{Method, MethodPhase, Reason};

/// A factorisation with its Jacobian counts as this many iterations.
const WORK_OF_FACTORISATION: f64 = 3.0;
/// A BDF step is about so much shorter than one of the one-step method; at a handover the past is sampled at this distance.
const STEP_RATIO: f64 = 4.0;

/// Smaller systems stay with BDF: what few oscillations they have must be resolved by any method, and where contacts change their
/// character trials cost more than they gain (a drive of eight states: a fifth more time at equal error).
const LEAST_UNKNOWNS: usize = 40;
/// The first step of a trial is at most so much longer than those of BDF suggest.
const MOST_LEAP: f64 = 100.0;

/// The method in use.
#[derive(Clone, Copy, PartialEq, Eq, Debug, serde::Serialize, serde::Deserialize)]
enum Active {
    Bdf,
    OneStep,
}

/// Both methods with their work space.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Integrator {
    bdf: Bdf,
    /// Made when first needed.
    one_step: Option<Box<Esdirk>>,
    active: Active,
    solver: Solver,
    limits: Limits,
    monitor: Monitor,
    /// The monitor watches: the system is large enough, has no delays, and its choice of states does not change during the run; one
    /// that does must be judged at every step of BDF, whose steps are short enough for it.
    watched: bool,
    /// The system has delays, and states of its own that do not change: then the one-step method integrates it, because its error
    /// estimate does not look at differences over many steps, which the rough error of a recorded past fills.
    delayed: bool,
    /// With delays: they are shorter than the steps.
    crowding: Crowding,
    /// Recorded inputs: their samples come so close to each other that BDF does not get beyond low order.
    interruption: Interruption,
    /// It is watched: the one-step method may take over.
    interruptible: bool,
    /// The step to come is the first after an event: it is one of the one-step method, whose past BDF takes over at order 4.
    starting: bool,
    /// It is one of BDF instead.
    straight: bool,
    /// The run has had its first start.
    begun: bool,
    scratch: Vec<f64>,
    phases: Vec<MethodPhase>,
}

/// What a run prescribes.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
struct Limits {
    max_order: usize,
    max_step: f64,
    time_scale: f64,
    nominals: Vec<f64>,
}

impl Integrator {
    /// Work space for systems of this structure.
    pub(crate) fn new(structure: &Structure) -> Self {
        Self {
            bdf: Bdf::new(structure),
            one_step: None,
            active: Active::Bdf,
            solver: Solver::Auto,
            limits: Limits::default(),
            monitor: Monitor::new(Rival::OneStep),
            watched: false,
            delayed: false,
            crowding: Crowding::new(),
            interruption: Interruption::new(),
            interruptible: false,
            starting: false,
            straight: false,
            begun: false,
            scratch: vec![0.0; structure.unknowns],
            phases: Vec::with_capacity(MOST_PHASES),
        }
    }

    /// Prepares a run from `start` (s): method, limits, and the time (s) below whose rounding no step makes sense.
    pub(crate) fn configure(
        &mut self,
        (solver, max_order): (Solver, usize),
        (start, max_step, time_scale): (f64, f64, f64),
        nominals: &[f64],
    ) {
        self.solver = solver;
        (self.limits.max_order, self.limits.max_step, self.limits.time_scale) = (max_order, max_step, time_scale);
        self.limits.nominals.clear();
        self.limits.nominals.extend_from_slice(nominals);
        self.bdf.configure(max_order, max_step, time_scale, nominals);
        if let Some(one_step) = &mut self.one_step {
            one_step.configure(max_step, time_scale, nominals);
        }
        let rival = if solver == Solver::Auto { Rival::OneStep } else { Rival::LowOrder };
        self.monitor = Monitor::new(rival);
        let method = if solver == Solver::Esdirk { Method::Esdirk } else { Method::Bdf };
        (self.begun, self.straight) = (false, false);
        self.crowding = Crowding::new();
        self.interruption = Interruption::new();
        self.phases.clear();
        self.phases.push(MethodPhase { from: start, method, reason: Reason::Start });
    }

    /// Which methods were used from when on.
    pub(crate) fn phases(&self) -> &[MethodPhase] {
        &self.phases
    }

    /// The method that the mode asks for.
    fn wanted(&self) -> Active {
        match (self.solver, self.monitor.mode()) {
            (Solver::Esdirk, _) => Active::OneStep,
            (Solver::Auto, _) if self.starting || self.delayed && !self.crowding.is_on() => Active::OneStep,
            (Solver::Auto, _) if self.interruptible && self.interruption.is_on() => Active::OneStep,
            _ if !self.watched => Active::Bdf,
            (Solver::Auto, Mode::Rival | Mode::RivalTried) => Active::OneStep,
            _ => Active::Bdf,
        }
    }

    /// Whether the next start is one of BDF, whose first step is straight in all unknowns.
    pub(crate) fn begin_straight(&mut self, straight: bool) {
        self.straight = straight;
    }

    /// Starts anew from consistent values `(y, y')`, after the start or an event; `states`: the unknowns that are states now.
    pub(crate) fn restart(
        &mut self,
        structure: &Structure,
        t: f64,
        (y, yp, states): (&[f64], &[f64], &[bool]),
        first: FirstSteps,
    ) {
        let plain = states == structure.differential;
        self.delayed = plain && !structure.delays.is_empty() && states.contains(&true);
        // Stages within a step do not come in the order of time, which values of the past within the step rely on.
        let plain = plain && structure.delays.is_empty();
        if !self.begun && self.delayed && self.solver == Solver::Auto {
            self.phases.clear();
            self.phases.push(MethodPhase { from: t, method: Method::Esdirk, reason: Reason::Start });
        }
        self.starting = std::mem::replace(&mut self.begun, true) && plain && !self.straight;
        self.interruptible = plain && !structure.inputs.is_empty() && self.solver == Solver::Auto;
        self.watched = structure.unknowns >= LEAST_UNKNOWNS && plain;
        self.monitor.restart();
        self.drop_matrix();
        self.active = self.wanted();
        match self.active {
            Active::OneStep => self.one_step(structure).restart(t, (y, yp, states), first.fourth_order, false),
            Active::Bdf => self.bdf.restart(t, y, yp, first.first_order),
        }
        self.limit_order();
    }

    fn one_step(&mut self, structure: &Structure) -> &mut Esdirk {
        let limits = &self.limits;
        self.one_step.get_or_insert_with(|| {
            let mut made = Box::new(Esdirk::new(structure));
            made.configure(limits.max_step, limits.time_scale, &limits.nominals);
            made
        })
    }

    /// The next step begins with the rates at hand, not with a past of values.
    pub(crate) fn begins_with_rates(&self) -> bool {
        self.active == Active::OneStep
    }

    /// Goes on with other states, whose consistent values and rates these are.  The past of BDF, which is made of
    /// values, keeps its worth; a step of the other method begins with the rates.
    pub(crate) fn set_states(&mut self, y: &[f64], yp: &[f64], states: &[bool]) {
        self.drop_matrix();
        if let (Active::OneStep, Some(one_step)) = (self.active, &mut self.one_step) {
            one_step.set_states(y, yp, states);
        }
    }

    /// The equations, but not their solution, have changed: matrices are dropped, the past is kept.
    fn drop_matrix(&mut self) {
        self.bdf.drop_matrix();
        if let Some(one_step) = &mut self.one_step {
            one_step.drop_matrix();
        }
    }

    fn limit_order(&mut self) {
        let low = self.solver == Solver::Bdf && matches!(self.monitor.mode(), Mode::Rival | Mode::RivalTried);
        self.bdf.set_max_order(if low { self.limits.max_order.min(2) } else { self.limits.max_order });
    }

    /// Hands the newest point with its past over to the method that the mode asks for.
    #[inline(always)]
    fn hand_over(&mut self, structure: &Structure) {
        let wanted = self.wanted();
        self.limit_order();
        if wanted != self.active {
            self.pass_on(structure, wanted);
        }
    }

    #[inline(never)]
    fn pass_on(&mut self, structure: &Structure, wanted: Active) {
        let (bdf_t, bdf_h) = (self.bdf.t(), self.bdf.next_step());
        self.one_step(structure);
        let Some(one_step) = &mut self.one_step else { return };
        match wanted {
            Active::OneStep => {
                // Where instability has shortened the steps, the right one is nearer to those before.
                let h = STEP_RATIO * bdf_h.max(self.monitor.longest().min(MOST_LEAP * bdf_h));
                let values = (self.bdf.y(), self.bdf.yp(), structure.differential.as_slice());
                one_step.restart(bdf_t, values, h, true);
            }
            Active::Bdf => {
                let h = one_step.next_step().min(one_step.step_size()) / STEP_RATIO;
                let scratch = &mut self.scratch;
                let past = |t: f64, y: &mut [f64]| one_step.at(t, y, scratch);
                self.bdf.resume((one_step.t(), h, ORDER), one_step.yp(), past);
            }
        }
        self.active = wanted;
    }

    /// The next step is one of the one-step method, which must not be longer than a delay.
    pub(crate) fn is_one_step(&self) -> bool {
        self.wanted() == Active::OneStep
    }

    /// Notes whether the shortest delay (s) keeps the step short.
    pub(crate) fn note_delay(&mut self, shortest: f64) {
        // Behind an event there is no step yet to judge, and none to hand over.
        if self.solver != Solver::Auto || !self.delayed || self.t() <= self.t_before() {
            return;
        }
        let step = self.stepping().map_or_else(|| self.bdf.step_size(), Esdirk::next_step);
        if self.crowding.note(step, shortest) && self.phases.len() < MOST_PHASES {
            let (method, reason) = match self.crowding.is_on() {
                true => (Method::Bdf, Reason::ShortDelay),
                false => (Method::Esdirk, Reason::LongDelay),
            };
            self.phases.push(MethodPhase { from: self.t(), method, reason });
        }
    }

    /// Before a step: how many samples of recorded inputs have passed.
    pub(crate) fn note_samples(&mut self, passed: u64) {
        if !self.interruptible {
            return;
        }
        if let Some(advantage) = self.interruption.samples(passed)
            && self.phases.len() < MOST_PHASES
        {
            let (method, reason) = match self.interruption.is_on() {
                true => (Method::Esdirk, Reason::Samples { advantage }),
                false => (Method::Bdf, Reason::Recovered { advantage }),
            };
            self.phases.push(MethodPhase { from: self.t(), method, reason });
        }
    }

    /// The step (s) that goes on behind a jump of a recorded input, where the one-step method is in use, and not for this step alone.
    pub(crate) fn pace_of_samples(&self) -> Option<f64> {
        let taken_up = self.solver == Solver::Esdirk || self.interruptible && self.interruption.is_on();
        (taken_up && self.active == Active::OneStep).then(|| self.step_and_most().0)
    }

    /// Tells the monitor of the step just done, of this many iterations.
    fn note(&mut self, h: f64, work: f64, before: &Statistics, after: &Statistics) {
        let (ratio, order) = self.bdf.falling();
        let growing = match self.active {
            Active::Bdf => self.bdf.next_step() > h,
            Active::OneStep => self.one_step.as_ref().is_some_and(|method| method.next_step() > h),
        };
        let attempts = |s: &Statistics| s.error_rejections + s.convergence_failures;
        let rejected = attempts(after) > attempts(before);
        let mode = self.monitor.mode();
        if !self.monitor.after(&StepFacts { h, work, ratio, order, rejected, growing }) {
            return;
        }
        let advantage = self.monitor.advantage();
        let (method, reason) = match (mode, self.monitor.mode(), self.solver) {
            (Mode::RivalTried, Mode::Rival, Solver::Bdf) => (Method::BdfLowOrder, Reason::Stability { advantage }),
            (Mode::RivalTried, Mode::Rival, _) => (Method::Esdirk, Reason::Stability { advantage }),
            (Mode::BdfTried, Mode::Bdf, _) => (Method::Bdf, Reason::Recovered { advantage }),
            _ => return,
        };
        if self.phases.len() < MOST_PHASES {
            self.phases.push(MethodPhase { from: self.t(), method, reason });
        }
    }

    fn stepping(&self) -> Option<&Esdirk> {
        if self.active == Active::OneStep { self.one_step.as_deref() } else { None }
    }

    /// Time of the newest accepted point (s).
    pub(crate) fn t(&self) -> f64 {
        self.stepping().map_or_else(|| self.bdf.t(), Esdirk::t)
    }

    /// Time of the accepted point before (s).
    pub(crate) fn t_before(&self) -> f64 {
        self.stepping().map_or_else(|| self.bdf.t_before(), Esdirk::t_before)
    }

    /// Step to be tried next, and how long it may become to end on a limit (s).
    pub(crate) fn step_and_most(&self) -> (f64, f64) {
        self.stepping().map_or_else(|| (self.bdf.next_step(), self.bdf.next_step()), Esdirk::step_and_most)
    }

    /// Last accepted step (s), or the one to be tried first.
    pub(crate) fn step_size(&self) -> f64 {
        self.stepping().map_or_else(|| self.bdf.step_size(), Esdirk::step_size)
    }

    /// Values at the newest accepted point.
    pub(crate) fn y(&self) -> &[f64] {
        self.stepping().map_or_else(|| self.bdf.y(), Esdirk::y)
    }

    /// Rates at the newest accepted point.
    pub(crate) fn yp(&self) -> &[f64] {
        self.stepping().map_or_else(|| self.bdf.yp(), Esdirk::yp)
    }

    /// Interpolates within the last accepted step.
    pub(crate) fn at(&self, t: f64, y: &mut [f64], yp: &mut [f64]) {
        match self.stepping() {
            Some(one_step) => one_step.at(t, y, yp),
            None => self.bdf.at(t, y, yp),
        }
    }

    /// Parts into which a step is at least divided to look for changes of relations within it.
    pub(crate) fn parts(&self) -> usize {
        if self.active == Active::OneStep { STEP_RATIO as usize } else { 2 }
    }

    /// The unknown whose error was the largest of the last step.
    pub(crate) fn dominant(&self, weights: &Weights) -> Option<usize> {
        self.stepping().map_or_else(|| self.bdf.dominant(weights), |method| method.dominant(weights))
    }

    /// Smallest sensible step at time `t` (s).
    pub(crate) fn smallest_step(&self, t: f64) -> f64 {
        self.bdf.smallest_step(t)
    }

    /// Values of the last attempt, for messages about values that are not finite.
    pub(crate) fn last_attempt(&self) -> (&[f64], &[f64]) {
        self.stepping().map_or_else(|| self.bdf.last_attempt(), Esdirk::last_attempt)
    }

    /// Does one step, not beyond `limit` (s).
    pub(crate) fn step(
        &mut self,
        problem: &mut Problem<'_>,
        weights: &mut Weights,
        limit: f64,
    ) -> Result<(), StepFailure> {
        if self.solver != Solver::Esdirk {
            self.hand_over(problem.system.structure());
        }
        let watched = self.watched && self.solver != Solver::Esdirk;
        let before = (watched || self.interruptible).then_some(problem.statistics);
        let from = self.t();
        match (self.active, &mut self.one_step) {
            (Active::OneStep, Some(one_step)) => one_step.step(problem, weights, limit)?,
            _ => self.bdf.step(problem, weights, limit)?,
        }
        let started = std::mem::take(&mut self.starting) && self.solver == Solver::Auto;
        let Some(before) = before else { return Ok(()) };
        let (h, after) = (self.t() - from, &problem.statistics);
        let factorisations = (after.factorisations - before.factorisations) as f64;
        let iterations = (after.newton_iterations - before.newton_iterations) as f64;
        let work = (iterations + WORK_OF_FACTORISATION * factorisations).max(1.0);
        if self.interruptible {
            self.interruption.step(h, work);
        }
        if watched && !started && !(self.interruptible && self.interruption.is_on()) {
            self.note(h, work, &before, after);
        }
        Ok(())
    }
}
