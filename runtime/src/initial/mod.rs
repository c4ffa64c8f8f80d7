//! The start of a run: from start values to consistent values with settled relations.
//!
//! Bind parameters, solve the initial system `G(z) = 0` by the damped method, store its solution as `(y, y')`, make that
//! consistent ([`consistent`]) and run the event iteration of the start; as long as a relation or a discrete variable changes,
//! the initial system is another one and is solved again from the last solution.  What `reinit` has written at the start
//! is not overwritten by a later solution.  Where the first of these systems has no solution, or one without values, discrete variables
//! are decided by the guess.  Where Newton's method fails and there are simplified expressions (`homotopy`), the
//! way leads over the simplified system; where that fails too, solutions are looked for elsewhere ([`rescue`]).

pub(crate) mod consistent;
pub(crate) mod curvature;
pub(crate) mod rescue;

use hyd_system::{EventPhase, Pattern, Structure};

use crate::corrector::damped::{Newton, NewtonFailure, Target};
use crate::error::{SolveError, Stage, StartAdvice};
use crate::events::cycle::Cycle;
use crate::events::effect::{Before, zero_what_is_rounding};
use crate::events::held_changes;
use crate::linear::{FactorError, LinearSolver};
use crate::loops::{judge, judge_initial};
use crate::problem::{Problem, all_finite};
use crate::sensitivity::Sensitivity;
use crate::weights::{Weights, largest};
use consistent::Consistency;
use rescue::Rescue;

/// Accepted size of a correction, relative to values and nominals.
const TOLERANCE: f64 = 1e-11;
/// First and smallest step from the simplified to the actual system.
const FIRST_SHARE: f64 = 0.25;
const SMALLEST_SHARE: f64 = 1e-4;
/// Most passes of the event iteration at the start.
const MOST_PASSES: usize = 100;
/// After so many it is looked whether they change anything.
const MANY_PASSES: usize = 10;
/// How often discrete variables are decided before the first solution: each time those that follow from the last ones join them.
const MOST_DECISIONS: usize = MOST_PASSES;

/// Solver of the initial system.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct InitialSystem {
    core: Core,
    newton: Newton,
    /// Where the first search for a solution began: the start values.
    given: Vec<f64>,
    /// How initial values were found where the start values did not lead to them.
    rescued: Option<Rescue>,
}

#[derive(Clone, serde::Serialize, serde::Deserialize)]
struct Core {
    pattern: Pattern,
    solver: LinearSolver,
    values: Vec<f64>,
    /// Sizes of the unknowns, and which are moved before others where equations leave them open.
    sizes: Vec<f64>,
    ranks: Vec<u8>,
}

struct View<'a, 'b> {
    core: &'a mut Core,
    problem: &'a mut Problem<'b>,
    t: f64,
}

impl Target for View<'_, '_> {
    fn residual(&mut self, x: &[f64], out: &mut [f64]) -> bool {
        self.problem.statistics.residuals += 1;
        self.problem.system.initial_residual(self.t, x, out).is_ok() && all_finite(out)
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), FactorError> {
        self.problem.statistics.jacobians += 1;
        self.problem.statistics.factorisations += 1;
        if self.problem.system.initial_jacobian(self.t, x, &mut self.core.values).is_err() {
            return Err(FactorError::NotFinite { row: 0, column: 0 });
        }
        self.core.solver.factor(&mut self.core.values)
    }

    fn factor_deficient(&mut self, x: &[f64]) -> bool {
        self.problem.system.initial_jacobian(self.t, x, &mut self.core.values).is_ok()
            && self.core.solver.factor_deficient(&self.core.values, &self.core.sizes, &self.core.ranks)
    }

    fn solve(&mut self, b: &mut [f64]) {
        self.core.solver.solve(b);
    }

    fn contradicts(&self, x: &[f64], part: f64) -> bool {
        self.core.solver.contradicts(x, part)
    }
}

/// What the start needs beside the system.
pub(crate) struct Start<'a> {
    pub(crate) t: f64,
    /// Time (s) in which nominal changes are expected, for the size of rates.
    pub(crate) time_scale: f64,
    pub(crate) weights: &'a Weights,
    /// Initial values may be looked for away from the start values.
    pub(crate) rescue: bool,
    pub(crate) consistency: &'a mut Consistency,
    pub(crate) sensitivity: Option<&'a mut Sensitivity>,
}

impl InitialSystem {
    /// Work space for the initial system of this structure.
    pub(crate) fn new(structure: &Structure) -> Self {
        let pattern = structure.initial.pattern.clone();
        let solver = LinearSolver::new(&pattern);
        let values = vec![0.0; pattern.entries()];
        let newton = Newton::new(structure.initial.unknowns);
        let core = Core { pattern, solver, values, sizes: newton.nominals.clone(), ranks: Vec::new() };
        Self { core, newton, given: Vec::new(), rescued: None }
    }

    /// How the last start found its values, if its start values did not lead to them.
    pub(crate) fn rescued(&self) -> Option<&Rescue> {
        self.rescued.as_ref()
    }

    /// Notes what the equations of the last start leave open.
    pub(crate) fn note_open(&self, problem: &mut Problem<'_>, t: f64) {
        problem.note_open_at_start(t, self.core.solver.undetermined());
    }

    /// Finds the values at the start.  The system must be bound.  Returns the message of `terminate`, if it was called.
    pub(crate) fn start(
        &mut self,
        problem: &mut Problem<'_>,
        start: &mut Start<'_>,
        y: &mut [f64],
        yp: &mut [f64],
    ) -> Result<Option<String>, SolveError> {
        let t = start.t;
        self.rescued = None;
        let failed = |failure, problem: &Problem<'_>| SolveError::evaluation(Stage::Start, t, failure, problem);
        let result = problem.system.initial_guess(t, &mut self.newton.x);
        result.map_err(|failure| failed(failure, problem))?;
        problem.system.initial_nominals(&mut self.newton.nominals);
        self.core.solver.begin(&self.newton.nominals);
        self.core.sizes.copy_from_slice(&self.newton.nominals);
        let mut before = vec![false; problem.system.structure().roots];
        let mut terminated = None;
        let mut reinitialised = false;
        let mut cycle = Cycle::default();
        let mut last: Option<Before> = None;
        for pass in 0..MOST_PASSES {
            if !reinitialised {
                self.solve_and_store(problem, (t, start.rescue), pass == 0, (y, yp))?;
            }
            start.consistency.choose_states(problem, t, y, yp);
            let at = (t, start.time_scale);
            if let Err(fault) = start.consistency.solve(problem, at, start.weights, y, yp) {
                return Err(SolveError::inconsistent(
                    Stage::Start,
                    t,
                    fault,
                    start.consistency.last_attempt(),
                    problem,
                ));
            }
            if pass >= MANY_PASSES {
                zero_what_is_rounding(start.weights, y, yp);
            }
            judge(problem, (Stage::Start, t), (y, yp))?;
            if let Some(sensitivity) = start.sensitivity.as_deref_mut() {
                match reinitialised {
                    false => sensitivity.initial(problem, t, &self.newton.x, y, yp)?,
                    true => sensitivity.consistent(problem, (Stage::Start, t), y, yp)?,
                }
                sensitivity.before_pass(problem, EventPhase::Initial, t, y, yp);
            }
            // Each pass finds the values anew: sides that equations keep equal differ by other roundings, and the truths between them never rest.
            let settled = |last: &Before, problem: &mut Problem<'_>| {
                last.switches_what_is_equal(problem, start.weights, (t, start.time_scale), (y, yp))
            };
            if !reinitialised && last.as_ref().is_some_and(|last| settled(last, problem)) {
                return Ok(terminated);
            }
            last = (pass >= MANY_PASSES).then(|| Before::new(problem, t, (y, yp)));
            problem.system.held(&mut before);
            let result = problem.system.event_pass(EventPhase::Initial, t, y, yp);
            let change = result.map_err(|failure| failed(failure, problem))?;
            terminated = change.terminated.or(terminated);
            let mut again = false;
            if let Some(sensitivity) = start.sensitivity.as_deref_mut() {
                again = sensitivity.after_pass(problem, EventPhase::Initial, t, yp);
            }
            reinitialised |= change.reinitialised;
            if !again && !change.changed && !change.reinitialised {
                return Ok(terminated);
            }
            cycle.note(problem, (pass, MOST_PASSES), (t, &*y, &*yp));
        }
        let (relations, repeats) = (held_changes(problem, &before), Box::new(cycle.repeats(problem)));
        Err(SolveError::EventLoop { time: t, passes: MOST_PASSES, relations, repeats })
    }

    /// Solves the initial system and stores its solution as `(y, y')`.  Where that fails for the first one, discrete variables may be what
    /// is wrong, as they still have their start values: a divisor that nothing has set yet.  They are decided, and it is tried again.
    fn solve_and_store(
        &mut self,
        problem: &mut Problem<'_>,
        (t, may_look): (f64, bool),
        first: bool,
        (y, yp): (&mut [f64], &mut [f64]),
    ) -> Result<(), SolveError> {
        let guess = self.newton.x.clone();
        if first {
            self.given.clone_from(&guess);
            self.core.ranks.clear();
        }
        let mut decisions = if first { MOST_DECISIONS } else { 0 };
        let mut solved = self.solve(problem, t);
        if solved.is_ok() && self.core.solver.is_deficient() {
            self.solve_from_given(problem, t, (y, yp));
        }
        if solved.is_err() && first && self.decide_at(problem, t, guess.clone(), (y, yp)) {
            solved = self.solve(problem, t);
        }
        loop {
            if let Err(error) = solved {
                self.elsewhere(problem, (t, may_look), &guess, error)?;
            }
            judge_initial(problem, t, &self.newton.x)?;
            let Err(failure) = problem.system.initial_store(t, &self.newton.x, y, yp) else { return Ok(()) };
            let error = SolveError::evaluation(Stage::Start, t, failure, problem);
            if decisions == 0 || !self.decide_at(problem, t, self.newton.x.clone(), (y, yp)) {
                return Err(error);
            }
            decisions -= 1;
            solved = self.solve(problem, t);
        }
    }

    /// What the equations leave open is to be near the start values, not near the solution of an earlier pass with other relations; and what
    /// relations watch nearer than what else could make up for it.
    fn solve_from_given(&mut self, problem: &mut Problem<'_>, t: f64, (y, yp): (&mut [f64], &mut [f64])) {
        let found = self.newton.clone();
        let open: Vec<usize> = self.core.solver.undetermined().collect();
        let mut moved = found.x.clone();
        self.core.ranks = problem.watched(&open, &found.nominals, &found.x, |problem, k, value, roots| {
            moved[k] = value;
            // It writes all values before it says which one is missing.
            let _ = problem.system.initial_store(t, &moved, y, yp);
            problem.system.roots(t, y, yp, roots);
            moved[k] = found.x[k];
        });
        self.newton.x.copy_from_slice(&self.given);
        if self.solve(problem, t).is_err() {
            // The factors are wanted that belong to the solution.
            self.newton = found;
            let _ = self.solve(problem, t);
        }
    }

    /// Discrete variables as these unknowns decide them, not as they start: a valve that starts closed may leave the equations
    /// singular that the guess would open.  True if that makes another system, to be solved from there again.  What has no value yet does
    /// not matter, unless a discrete variable is made of it.
    fn decide_at(
        &mut self,
        problem: &mut Problem<'_>,
        t: f64,
        unknowns: Vec<f64>,
        (y, yp): (&mut [f64], &mut [f64]),
    ) -> bool {
        // It writes all values before it says which one is missing.
        let _ = problem.system.initial_store(t, &unknowns, y, yp);
        self.newton.x = unknowns;
        problem.system.event_pass(EventPhase::Initial, t, y, yp).is_ok_and(|change| change.changed)
    }

    /// Looks for a solution away from the guess, from which Newton's method has failed; if there is none the failure stands, with what
    /// can be said of the guess.
    fn elsewhere(
        &mut self,
        problem: &mut Problem<'_>,
        (t, may_look): (f64, bool),
        guess: &[f64],
        error: SolveError,
    ) -> Result<(), SolveError> {
        let SolveError::Initial { time, cause, place, .. } = error else { return Err(error) };
        let found = if may_look { self.rescue(problem, t, guess) } else { Err(0) };
        match found {
            Ok(rescue) => {
                self.rescued = Some(rescue);
                Ok(())
            }
            Err(tried) => {
                let curvature = self.curvature(problem, t, guess);
                let advice = Box::new(StartAdvice::new(tried, curvature.as_ref(), guess, problem));
                Err(SolveError::Initial { time, cause, place, advice })
            }
        }
    }

    fn solve(&mut self, problem: &mut Problem<'_>, t: f64) -> Result<(), SolveError> {
        if self.newton.x.is_empty() {
            return Ok(());
        }
        let guess = if problem.system.has_homotopy() { self.newton.x.clone() } else { Vec::new() };
        let mut result = self.newton.solve(&mut View { core: &mut self.core, problem, t }, TOLERANCE);
        if result.is_err() && !guess.is_empty() {
            self.newton.x.copy_from_slice(&guess);
            result = self.continue_from_simplified(problem, t);
            problem.system.set_homotopy(1.0);
        }
        result.map_err(|cause| {
            let (row, unknown) = self.blame(cause);
            SolveError::initial(t, cause, (row, unknown), self.newton.attempt(), problem)
        })
    }

    /// From the simplified system to the actual one, each solution being the guess for the next (numerical continuation,
    /// Allgower, Georg 2003, *Introduction to Numerical Continuation Methods*, chapter 2).
    fn continue_from_simplified(&mut self, problem: &mut Problem<'_>, t: f64) -> Result<(), NewtonFailure> {
        problem.system.set_homotopy(0.0);
        self.newton.solve(&mut View { core: &mut self.core, problem, t }, TOLERANCE)?;
        let (mut share, mut step) = (0.0, FIRST_SHARE);
        let mut last = self.newton.x.clone();
        while share < 1.0 {
            let next = f64::min(share + step, 1.0);
            problem.system.set_homotopy(next);
            match self.newton.solve(&mut View { core: &mut self.core, problem, t }, TOLERANCE) {
                Ok(()) => {
                    last.copy_from_slice(&self.newton.x);
                    (share, step) = (next, 2.0 * step);
                }
                Err(failure) if step <= SMALLEST_SHARE => return Err(failure),
                Err(_) => {
                    self.newton.x.copy_from_slice(&last);
                    step *= 0.25;
                }
            }
        }
        Ok(())
    }

    fn blame(&self, cause: NewtonFailure) -> (Option<usize>, Option<usize>) {
        let n = self.newton.x.len();
        match cause {
            NewtonFailure::Singular { row, column } | NewtonFailure::SlopeNotFinite { row, column } => {
                (Some(row), Some(column))
            }
            NewtonFailure::NotFinite => (self.newton.not_finite_row(), None),
            NewtonFailure::NoConvergence { .. } => {
                let row = |k: usize| self.newton.residual[k] * self.core.solver.row_scale(k);
                let size = |k: usize| self.newton.correction[k] / self.newton.nominals[k].max(self.newton.x[k].abs());
                debug_assert_eq!(self.core.pattern.rows, n);
                (largest((0..n).map(row)), largest((0..n).map(size)))
            }
        }
    }
}
