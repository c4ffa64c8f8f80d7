//! What can end a run early, with everything a user needs to find the place.
//!
//! One variant per cause, data in fields; names of variables, equations and places in the text are copied from the system's
//! tables when the error is made, so that it outlives the system.  [`std::fmt::Display`] (in `message`) renders it in the user's
//! words.

use std::io;

use hyd_system::{AssertionReport, EquationInfo, EvalFailure, RootInfo};

use crate::OptionError;
use crate::corrector::damped::NewtonFailure;
use crate::corrector::{StepFailure, StepFault};
use crate::course::Course;
use crate::events::chatter::Pile;
use crate::events::cycle::Repeats;
use crate::initial::consistent::Inconsistent;
use crate::initial::curvature::Curvature;
use crate::local_mode::LocalMode;
use crate::problem::Problem;
use crate::vanishing::Vanishing;

/// What the solver was doing.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stage {
    /// Finding the values at the start.
    Start,
    /// Stepping in time.
    Step,
    /// Handling an event.
    Event,
}

/// Why a nonlinear system was not solved.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Cause {
    /// A value is not finite.
    NotFinite,
    /// The equations do not determine the unknown.
    Singular,
    /// The iteration does not converge.
    NoConvergence,
}

/// Where it went wrong, in the user's names.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Place {
    /// Residual row at fault, if known.
    pub row: Option<usize>,
    /// The user's equation behind it.
    pub equation: Option<EquationInfo>,
    /// Index of the unknown at fault, if known.
    pub unknown: Option<usize>,
    /// Its name.
    pub variable: Option<String>,
    /// Names, values and units that matter there, as last known to be good.
    pub values: Vec<(String, f64, String)>,
    /// What exactly is not finite, if that is the trouble.
    pub evaluation: Option<EvalFailure>,
    /// Values of all variables at the start and at some of the last steps, the last point included, where steps had been done.
    pub course: Option<Box<Course>>,
    /// What the equations near the last point say of the trouble, where steps had been done.
    pub near: Option<Box<Near>>,
}

/// What the equations near the last good point say of a step that cannot be done.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Near {
    /// The eigenvalue behind it.
    pub mode: Option<LocalMode>,
    /// Equations that were about to determine an unknown no longer.
    pub vanishing: Option<Vanishing>,
    /// A variable whose allowed error is below the rounding of its values: name, nominal value, largest value.
    pub below_rounding: Option<(String, f64, f64)>,
    /// Length of the whole run (s).
    pub span: f64,
    /// Size of the last step that was done, or tried if none was (s).
    pub step: f64,
}

/// What can be said of start values from which no solution was found.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct StartAdvice {
    /// Other starts that were tried in vain.
    pub tried: usize,
    /// Variables whose start values decide, with these values, the most important first; the others occur linearly or nearly so.
    pub decisive: Vec<(String, f64)>,
    /// The equation that bends most on the first step.
    pub bent: Option<EquationInfo>,
}

/// An unknown decides if it bends an equation at least this much, relative to the one that does most.
const DECIDES: f64 = 0.05;

impl StartAdvice {
    pub(crate) fn new(tried: usize, curvature: Option<&Curvature>, guess: &[f64], problem: &Problem<'_>) -> Self {
        let Some(Curvature { row, of_unknown }) = curvature else { return Self { tried, ..Self::default() } };
        let tables = problem.system.tables();
        let largest = of_unknown.iter().copied().fold(0.0, f64::max);
        let mut decisive: Vec<usize> = (0..guess.len()).filter(|&k| of_unknown[k] > DECIDES * largest).collect();
        decisive.sort_by(|&a, &b| of_unknown[b].total_cmp(&of_unknown[a]));
        let named = |k: usize| Some((tables.initial_unknowns.get(k)?.to_string(), guess[k]));
        let equation = tables.initial_rows.get(*row).and_then(|&e| tables.equations.get(e as usize));
        let decisive = decisive.into_iter().filter_map(named).take(MOST_VALUES).collect();
        Self { tried, decisive, bent: equation.cloned() }
    }
}

/// A step that could not be done.
#[derive(Clone, PartialEq, Debug)]
pub struct StepReport {
    /// Last time that was reached (s).
    pub time: f64,
    /// Last step tried (s).
    pub step: f64,
    /// Order of the formula then.
    pub order: usize,
    /// Where it went wrong.
    pub place: Place,
}

/// Why a run ended before its time.  Rows handed to the sink before are valid in every case.
#[derive(Debug)]
pub enum SolveError {
    /// An option is outside its range.
    Option(OptionError),
    /// An evaluation outside the residual failed (start values, discrete equations).
    Evaluation {
        /// What was being done.
        stage: Stage,
        /// Time (s).
        time: f64,
        /// What failed.
        failure: Box<EvalFailure>,
        /// The equation, if known.
        equation: Option<Box<EquationInfo>>,
    },
    /// The initial system has no solution that could be found.
    Initial {
        /// Start time (s).
        time: f64,
        /// Why.
        cause: Cause,
        /// Where; values are those at which the iteration stopped.
        place: Box<Place>,
        /// What can be said of the start values.
        advice: Box<StartAdvice>,
    },
    /// No consistent values at the start or after an event.
    Inconsistent {
        /// What was being done.
        stage: Stage,
        /// Time (s).
        time: f64,
        /// Why.
        cause: Cause,
        /// Where; values are those at which the iteration stopped.
        place: Box<Place>,
    },
    /// The equations of a loop do not hold, because rounding errors grow from one to the next in the order in which they are computed.
    Rounding {
        /// What was being done.
        stage: Stage,
        /// Time (s).
        time: f64,
        /// How far the equation is from holding, relative to its terms.
        error: f64,
        /// The equation that closes the loop, if known.
        equation: Option<Box<EquationInfo>>,
    },
    /// The local error cannot be kept within the tolerance by any step.
    StepTooSmall(Box<StepReport>),
    /// Newton's method does not converge for any step.
    NoConvergence(Box<StepReport>),
    /// An equation has no finite value for any step.
    NotFinite(Box<StepReport>),
    /// The equations do not determine all unknowns.
    Singular(Box<StepReport>),
    /// Relations keep changing at one instant.
    EventLoop {
        /// Time (s).
        time: f64,
        /// Passes of the event iteration.
        passes: usize,
        /// Relations that still changed in the last pass.
        relations: Vec<RootInfo>,
        /// What changes from pass to pass.
        repeats: Box<Repeats>,
    },
    /// Events follow each other while time stands still.
    Chattering {
        /// Time (s).
        time: f64,
        /// Events in a row.
        events: u32,
        /// Their distances shrink towards a point in time (a bouncing ball); otherwise they only are close.
        accumulating: bool,
        /// Relations of the last event.
        relations: Vec<RootInfo>,
        /// The events before it.
        pile: Box<Pile>,
    },
    /// An assertion of level error does not hold.
    Assertion {
        /// Time (s).
        time: f64,
        /// The assertion.
        report: Box<AssertionReport>,
    },
    /// The limit of steps is reached.
    TooManySteps {
        /// Time reached (s).
        time: f64,
        /// Steps done.
        steps: u64,
        /// Step size now (s).
        step: f64,
        /// The variable whose error was the largest of the last step, with values.
        place: Box<Place>,
    },
    /// The caller asked to stop; what was computed so far is complete and valid.
    Interrupted {
        /// Time reached (s).
        time: f64,
    },
    /// The results cannot be written.
    Sink {
        /// Time of the row (s).
        time: f64,
        /// What the system says.
        error: io::Error,
    },
}

fn of_equation(equation: Option<&EquationInfo>) -> Vec<(&str, u32)> {
    equation.map(|e| (e.file.as_ref(), e.line)).into_iter().collect()
}

impl SolveError {
    /// Other starts from which no initial values were found either.
    pub fn other_starts(&self) -> usize {
        match self {
            SolveError::Initial { advice, .. } => advice.tried,
            _ => 0,
        }
    }

    /// Time reached (s), if the run had begun.
    pub fn time(&self) -> Option<f64> {
        match self {
            SolveError::Option(_) => None,
            SolveError::Evaluation { time, .. }
            | SolveError::Initial { time, .. }
            | SolveError::Inconsistent { time, .. }
            | SolveError::Rounding { time, .. }
            | SolveError::EventLoop { time, .. }
            | SolveError::Chattering { time, .. }
            | SolveError::Assertion { time, .. }
            | SolveError::TooManySteps { time, .. }
            | SolveError::Interrupted { time }
            | SolveError::Sink { time, .. } => Some(*time),
            SolveError::StepTooSmall(report)
            | SolveError::NoConvergence(report)
            | SolveError::NotFinite(report)
            | SolveError::Singular(report) => Some(report.time),
        }
    }

    /// True if the equations may have been solved in an order in which rounding errors grow, even until the rest looks singular: a
    /// model with torn loops may run with its loops whole.
    pub fn may_be_rounding(&self) -> bool {
        match self {
            SolveError::Rounding { .. } | SolveError::Singular(_) => true,
            SolveError::Initial { cause, .. } | SolveError::Inconsistent { cause, .. } => *cause == Cause::Singular,
            _ => false,
        }
    }

    /// The same, or if Newton's method has found no values after an event, which it may with whole loops.  A search that tries values out does
    /// not ask for that: where they lead nowhere it takes others.
    pub fn may_be_of_loops(&self) -> bool {
        self.may_be_rounding() || matches!(self, SolveError::Inconsistent { .. })
    }

    /// File names and lines of the equation, relations or assertion at fault, as far as they are known.
    pub fn places(&self) -> Vec<(&str, u32)> {
        match self {
            SolveError::Evaluation { equation, .. } | SolveError::Rounding { equation, .. } => {
                of_equation(equation.as_deref())
            }
            SolveError::Initial { place, .. } | SolveError::Inconsistent { place, .. } => {
                of_equation(place.equation.as_ref())
            }
            SolveError::StepTooSmall(report)
            | SolveError::NoConvergence(report)
            | SolveError::NotFinite(report)
            | SolveError::Singular(report) => of_equation(report.place.equation.as_ref()),
            SolveError::EventLoop { relations, .. } | SolveError::Chattering { relations, .. } => {
                relations.iter().map(|r| (r.file.as_ref(), r.line)).collect()
            }
            SolveError::Assertion { report, .. } => vec![(report.file.as_ref(), report.line)],
            SolveError::Option(_)
            | SolveError::TooManySteps { .. }
            | SolveError::Interrupted { .. }
            | SolveError::Sink { .. } => Vec::new(),
        }
    }

    /// Values along a run that came to no good end, if steps had been done.
    pub fn course(&self) -> Option<&Course> {
        match self {
            SolveError::StepTooSmall(report)
            | SolveError::NoConvergence(report)
            | SolveError::NotFinite(report)
            | SolveError::Singular(report) => report.place.course.as_deref(),
            SolveError::TooManySteps { place, .. } => place.course.as_deref(),
            _ => None,
        }
    }

    /// What the equations near the last point say, if steps had been done.
    pub fn near(&self) -> Option<&Near> {
        match self {
            SolveError::StepTooSmall(report)
            | SolveError::NoConvergence(report)
            | SolveError::NotFinite(report)
            | SolveError::Singular(report) => report.place.near.as_deref(),
            SolveError::TooManySteps { place, .. } => place.near.as_deref(),
            _ => None,
        }
    }

    /// The same with values along the run and what the equations near the last point say.
    pub(crate) fn with_course(mut self, course: Course, near: Near) -> Self {
        let place = match &mut self {
            SolveError::StepTooSmall(report)
            | SolveError::NoConvergence(report)
            | SolveError::NotFinite(report)
            | SolveError::Singular(report) => &mut report.place,
            SolveError::TooManySteps { place, .. } => place,
            _ => return self,
        };
        place.course = Some(Box::new(course));
        place.near = Some(Box::new(near));
        self
    }

    /// Name of the variable at fault, if it is known.
    pub fn variable(&self) -> Option<&str> {
        match self {
            SolveError::Evaluation { failure, .. } => failure.variable.as_deref(),
            SolveError::Initial { place, .. } | SolveError::Inconsistent { place, .. } => place.variable.as_deref(),
            SolveError::TooManySteps { place, .. } => place.variable.as_deref(),
            SolveError::StepTooSmall(report)
            | SolveError::NoConvergence(report)
            | SolveError::NotFinite(report)
            | SolveError::Singular(report) => report.place.variable.as_deref(),
            _ => None,
        }
    }

    /// Index of the unknown at fault of a step, if it is known.
    pub(crate) fn unknown(&self) -> Option<usize> {
        match self {
            SolveError::TooManySteps { place, .. } => place.unknown,
            SolveError::StepTooSmall(report)
            | SolveError::NoConvergence(report)
            | SolveError::NotFinite(report)
            | SolveError::Singular(report) => report.place.unknown,
            _ => None,
        }
    }

    pub(crate) fn evaluation(stage: Stage, time: f64, failure: EvalFailure, problem: &Problem<'_>) -> Self {
        let equations = &problem.system.tables().equations;
        let equation = failure.equation.and_then(|k| equations.get(k as usize)).cloned().map(Box::new);
        SolveError::Evaluation { stage, time, failure: Box::new(failure), equation }
    }

    pub(crate) fn initial(
        time: f64,
        cause: NewtonFailure,
        (row, unknown): (Option<usize>, Option<usize>),
        z: &[f64],
        problem: &mut Problem<'_>,
    ) -> Self {
        let not_finite = cause == NewtonFailure::NotFinite;
        let evaluation = if not_finite { problem.system.diagnose_initial(time, z) } else { None };
        let tables = problem.system.tables();
        let name = |k: usize| {
            tables.initial_unknowns.get(k).map_or_else(|| format!("unknown {}", k + 1), |name| name.to_string())
        };
        let equation_of =
            |k: usize| tables.initial_rows.get(k).and_then(|&e| tables.equations.get(e as usize)).cloned();
        let pattern = &problem.system.structure().initial.pattern;
        let mut shown: Vec<usize> = unknown.into_iter().collect();
        if let Some(row) = row {
            let in_row = |&c: &usize| pattern.row_indices[pattern.column(c)].contains(&(row as u32));
            shown.extend((0..pattern.columns()).filter(in_row).filter(|&c| Some(c) != unknown));
        }
        shown.truncate(MOST_VALUES);
        let place = Place {
            row,
            equation: evaluated_equation(&evaluation, problem).or_else(|| row.and_then(equation_of)),
            unknown,
            variable: unknown.map(name),
            values: shown.into_iter().map(|k| (name(k), z[k], String::new())).collect(),
            evaluation,
            course: None,
            near: None,
        };
        SolveError::Initial { time, cause: cause.into(), place: Box::new(place), advice: Box::default() }
    }

    pub(crate) fn inconsistent(
        stage: Stage,
        time: f64,
        fault: Inconsistent,
        (y, yp): (&[f64], &[f64]),
        problem: &mut Problem<'_>,
    ) -> Self {
        let not_finite = fault.cause == NewtonFailure::NotFinite;
        let evaluation = if not_finite { problem.system.diagnose(time, y, yp) } else { None };
        let place = Place::new(fault.row, fault.unknown, y, evaluation, problem);
        SolveError::Inconsistent { stage, time, cause: fault.cause.into(), place: Box::new(place) }
    }

    /// The limit of steps is reached at a time (s), after this many steps, with this step (s); `unknown` limits the steps.
    pub(crate) fn too_many_steps(
        (time, steps, step): (f64, u64, f64),
        unknown: Option<usize>,
        y: &[f64],
        problem: &Problem<'_>,
    ) -> Self {
        let place = Box::new(Place::new(None, unknown, y, None, problem));
        SolveError::TooManySteps { time, steps, step, place }
    }

    /// The error of a failed step; `attempt` are the values of the last attempt, `good` those of the last accepted point.
    pub(crate) fn step(
        failure: StepFailure,
        time: f64,
        attempt: (&[f64], &[f64]),
        good: &[f64],
        problem: &mut Problem<'_>,
    ) -> Self {
        let not_finite = failure.fault == StepFault::NotFinite;
        let evaluation = if not_finite { problem.system.diagnose(failure.t, attempt.0, attempt.1) } else { None };
        let place = Place::new(failure.row, failure.unknown, good, evaluation, problem);
        let report = Box::new(StepReport { time, step: failure.h, order: failure.order, place });
        match failure.fault {
            StepFault::Error => SolveError::StepTooSmall(report),
            StepFault::Convergence => SolveError::NoConvergence(report),
            StepFault::NotFinite => SolveError::NotFinite(report),
            StepFault::Singular => SolveError::Singular(report),
        }
    }
}

/// Number of values that a message shows.
const MOST_VALUES: usize = 6;

impl Place {
    /// The unknown at fault and those in the equation at fault, with values.
    fn new(
        row: Option<usize>,
        unknown: Option<usize>,
        y: &[f64],
        evaluation: Option<EvalFailure>,
        problem: &Problem<'_>,
    ) -> Self {
        let tables = problem.system.tables();
        let pattern = &problem.system.structure().state_pattern;
        let mut shown: Vec<usize> = unknown.into_iter().collect();
        if let Some(row) = row {
            let in_row = |&c: &usize| pattern.row_indices[pattern.column(c)].contains(&(row as u32));
            shown.extend((0..pattern.columns()).filter(in_row).filter(|&c| Some(c) != unknown));
        }
        if shown.is_empty() {
            shown.extend(0..y.len());
        }
        shown.truncate(MOST_VALUES);
        let unit = |k: usize| {
            let variable = tables.unknowns.get(k).and_then(|&(v, _)| tables.variables.get(v as usize));
            variable.map_or_else(String::new, |variable| variable.unit.to_string())
        };
        Self {
            row,
            equation: evaluated_equation(&evaluation, problem)
                .or_else(|| row.and_then(|k| tables.row_equation(k)).cloned()),
            unknown,
            variable: unknown.map(|k| tables.unknown_name(k)),
            values: shown.into_iter().map(|k| (tables.unknown_name(k), y[k], unit(k))).collect(),
            evaluation,
            course: None,
            near: None,
        }
    }
}

fn evaluated_equation(evaluation: &Option<EvalFailure>, problem: &Problem<'_>) -> Option<EquationInfo> {
    let index = evaluation.as_ref()?.equation?;
    problem.system.tables().equations.get(index as usize).cloned()
}

impl From<NewtonFailure> for Cause {
    fn from(failure: NewtonFailure) -> Self {
        match failure {
            NewtonFailure::NotFinite | NewtonFailure::SlopeNotFinite { .. } => Cause::NotFinite,
            NewtonFailure::Singular { .. } => Cause::Singular,
            NewtonFailure::NoConvergence { .. } => Cause::NoConvergence,
        }
    }
}

impl From<OptionError> for SolveError {
    fn from(error: OptionError) -> Self {
        SolveError::Option(error)
    }
}
