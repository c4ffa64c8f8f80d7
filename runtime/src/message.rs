//! Solver errors in the user's words: what happened, where in the text, the last good values, what to try.
//!
//! The first line is a sentence of its own; the following lines give place, values and a hint.  Nothing here decides anything.

use std::fmt::{self, Display, Formatter};

use hyd_system::{EquationInfo, EvalFailure, RootInfo, significant};

use crate::Jump;
use crate::error::{Cause, Place, SolveError, Stage, StepReport};

impl Display for SolveError {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            SolveError::Option(error) => write!(f, "{error}"),
            SolveError::Evaluation { stage, time, failure, equation } => {
                let time = significant(*time);
                write!(f, "{} at t = {time} s failed: {}", stage.words(), evaluation(failure))?;
                equation.as_deref().map_or(Ok(()), |equation| line_of(f, equation))
            }
            SolveError::Initial { time, cause, place } => {
                let time = significant(*time);
                write!(f, "no initial values found at t = {time} s: {}", cause.words(place))?;
                place_lines(f, place, "values where the search ended")?;
                match cause {
                    Cause::Singular => hint(
                        f,
                        "its coefficient may be zero at these values, or equations may repeat each other: change start values or \
                         parameters, or check the initial equations",
                    ),
                    _ => hint(f, "give start values closer to the solution, or check the initial equations"),
                }
            }
            SolveError::Inconsistent { stage, time, cause, place } => {
                let time = significant(*time);
                write!(f, "{} at t = {time} s: no consistent values found: {}", stage.words(), cause.words(place))?;
                place_lines(f, place, "values where the search ended")?;
                hint(f, "the algebraic equations may have no solution for these states")
            }
            SolveError::Rounding { stage, time, error, equation } => {
                let time = significant(*time);
                write!(f, "{} at t = {time} s: rounding errors grow along a loop of equations", stage.words())?;
                write!(f, ": the last one is off by {error:.0e} relative to its terms")?;
                if let Some(equation) = equation {
                    line_of(f, equation)?;
                }
                hint(f, "these parameter values need another order of the equations than the values at translation")
            }
            SolveError::StepTooSmall(report) => {
                write!(f, "the step size collapsed at t = {} s", significant(report.time))?;
                if let Some(variable) = &report.place.variable {
                    write!(f, ": the error of {variable} stays above the tolerance")?;
                }
                step_lines(f, report)?;
                hint(f, "the solution may grow without bound or jump here; a discontinuity should cause an event")
            }
            SolveError::NoConvergence(report) => {
                write!(
                    f,
                    "the equations could not be solved beyond t = {} s: Newton's method diverges",
                    significant(report.time)
                )?;
                step_lines(f, report)?;
                hint(f, "look for a discontinuity without an event, or for an equation without a solution")
            }
            SolveError::NotFinite(report) => {
                write!(
                    f,
                    "no finite value beyond t = {} s: {}",
                    significant(report.time),
                    Cause::NotFinite.words(&report.place)
                )?;
                step_lines(f, report)?;
                hint(f, "keep divisors away from zero and arguments of sqrt and log within their domains")
            }
            SolveError::Singular(report) => {
                write!(f, "the equations are singular at t = {} s", significant(report.time))?;
                if let Some(variable) = &report.place.variable {
                    write!(f, ": {variable} is not determined")?;
                }
                step_lines(f, report)?;
                hint(
                    f,
                    "an equation may no longer depend on this variable (a coefficient became zero), or two equations may coincide",
                )
            }
            SolveError::EventLoop { time, passes, relations } => {
                let time = significant(*time);
                write!(f, "the event at t = {time} s does not settle: relations still change after {passes} passes")?;
                relation_lines(f, relations)?;
                hint(f, "two conditions may keep switching each other; `pre` breaks such a loop")
            }
            SolveError::Chattering { time, events, accumulating: false, relations } => {
                let time = significant(*time);
                write!(f, "chattering at t = {time} s: {events} events while time stands still")?;
                relation_lines(f, relations)?;
                hint(f, "add hysteresis to the condition, or use `smooth` or `noEvent` if the expression is continuous")
            }
            SolveError::Chattering { time, accumulating: true, relations, .. } => {
                let time = significant(*time);
                write!(f, "events accumulate at t = {time} s: the intervals between them keep shrinking")?;
                relation_lines(f, relations)?;
                hint(f, "let the motion come to rest: end it by a Boolean once the speed at an impact is below a limit")
            }
            SolveError::Assertion { time, report } => {
                let time = significant(*time);
                write!(f, "assertion failed at t = {time} s: {}\n  at {}:{}", report.message, report.file, report.line)
            }
            SolveError::TooManySteps { time, steps, step, place } => {
                let time = significant(*time);
                write!(f, "gave up at t = {time} s after {steps} steps; the step size was {step:.3e} s")?;
                if let Some(variable) = &place.variable {
                    write!(f, "\n  largest error: {variable}")?;
                }
                hint(
                    f,
                    "a `noEvent` whose condition keeps flipping needs an event or a smooth transition; otherwise raise the step limit \
                     (`--max-steps`) or loosen the tolerance",
                )
            }
            SolveError::Interrupted { time } => write!(f, "interrupted at t = {time} s"),
            SolveError::Sink { time, error } => write!(f, "results at t = {time} s cannot be written: {error}"),
        }
    }
}

impl std::error::Error for SolveError {}

/// Variables, values and equations of a jump that are shown.
const MOST_NAMED: usize = 4;

impl Display for Jump {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let names = self.variables.iter().take(MOST_NAMED).map(String::as_str).collect::<Vec<_>>().join(", ");
        let more = match self.variables.len().saturating_sub(MOST_NAMED) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let time = significant(self.time);
        write!(
            f,
            "at t = {time} s the solution for {names}{more} ends; the run goes on with another solution of the same equations:"
        )?;
        for (k, (name, before, after, unit)) in self.changes.iter().take(MOST_NAMED).enumerate() {
            let comma = if k == 0 { "" } else { "," };
            let space = if unit.is_empty() { "" } else { " " };
            write!(f, "{comma} {name} from {} to {}{space}{unit}", significant(*before), significant(*after))?;
        }
        self.equations.iter().take(MOST_NAMED).try_for_each(|equation| line_of(f, equation))
    }
}

impl Stage {
    fn words(self) -> &'static str {
        match self {
            Stage::Start => "the start",
            Stage::Step => "the step",
            Stage::Event => "the event",
        }
    }
}

impl Cause {
    fn words(self, place: &Place) -> String {
        match (self, &place.evaluation, &place.variable) {
            (Cause::NotFinite, Some(failure), _) => evaluation(failure),
            (Cause::NotFinite, None, Some(variable)) => {
                format!("the derivative with respect to {variable} is not finite")
            }
            (Cause::NotFinite, None, None) => "a value is not finite".to_string(),
            (Cause::Singular, _, Some(variable)) => format!("{variable} is not determined (singular equations)"),
            (Cause::Singular, _, None) => "the equations are singular".to_string(),
            (Cause::NoConvergence, _, Some(variable)) => format!("no convergence, worst in {variable}"),
            (Cause::NoConvergence, _, None) => "no convergence".to_string(),
        }
    }
}

/// What failed, and for which variable.  A reason that is a sentence or ends with the user's own text stands last, so that nothing
/// runs into it.
fn evaluation(failure: &EvalFailure) -> String {
    match &failure.variable {
        Some(variable) if failure.reason.contains([':', ',']) => {
            format!("in the computation of {variable}, {}", failure.reason)
        }
        Some(variable) => format!("{} in the computation of {variable}", failure.reason),
        None => failure.reason.clone(),
    }
}

fn step_lines(f: &mut Formatter<'_>, report: &StepReport) -> fmt::Result {
    write!(f, "\n  last step tried: {:.3e} s at order {}", report.step, report.order)?;
    place_lines(f, &report.place, "last good values")
}

fn place_lines(f: &mut Formatter<'_>, place: &Place, title: &str) -> fmt::Result {
    if let Some(equation) = &place.equation {
        line_of(f, equation)?;
    }
    if place.values.is_empty() {
        return Ok(());
    }
    write!(f, "\n  {title}: ")?;
    for (k, (name, value, unit)) in place.values.iter().enumerate() {
        let comma = if k == 0 { "" } else { ", " };
        let space = if unit.is_empty() { "" } else { " " };
        let value = significant(*value);
        write!(f, "{comma}{name} = {value}{space}{unit}")?;
    }
    Ok(())
}

fn line_of(f: &mut Formatter<'_>, equation: &EquationInfo) -> fmt::Result {
    write!(f, "\n  equation: {}\n  at {}:{}", equation.text, equation.file, equation.line)?;
    if !equation.component.is_empty() {
        write!(f, " in {}", equation.component)?;
    }
    Ok(())
}

fn relation_lines(f: &mut Formatter<'_>, relations: &[RootInfo]) -> fmt::Result {
    for relation in relations {
        write!(f, "\n  relation: {}\n  at {}:{}", relation.text, relation.file, relation.line)?;
    }
    Ok(())
}

fn hint(f: &mut Formatter<'_>, text: &str) -> fmt::Result {
    write!(f, "\n  hint: {text}")
}
