//! Solver errors in the user's words: what happened, where in the text, the last good values, what to try.
//!
//! The first line is a sentence of its own; the following lines give place, values and a hint.  Nothing here decides anything.

use std::fmt::{self, Display, Formatter};

use hyd_system::{Contradicted, EquationInfo, EvalFailure, Reading, RootInfo, ValueKind, math, significant};

use crate::Jump;
use crate::error::{Cause, Near, Place, SolveError, Stage, StartAdvice, StepReport};
use crate::events::chatter::Pile;
use crate::events::cycle::{Changing, Repeats};

impl Display for SolveError {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            SolveError::Option(error) => write!(f, "{error}"),
            SolveError::Evaluation { stage, time, failure, equation } => {
                let time = significant(*time);
                write!(f, "{} at t = {time} s failed: {}", stage.words(), evaluation(failure))?;
                equation.as_deref().map_or(Ok(()), |equation| line_of(f, equation))?;
                reads_lines(f, failure)?;
                match (&failure.variable, failure.contradicts, stage) {
                    (variable, Some(against), Stage::Start) => {
                        hint(f, &contradiction_hint(variable.as_deref(), against))
                    }
                    _ if failure.reads.is_empty() => Ok(()),
                    _ => domain_hint(f, Some(failure)),
                }
            }
            SolveError::Initial { time, cause, place, advice } => {
                let time = significant(*time);
                write!(f, "no initial values found at t = {time} s: {}", cause.words(place))?;
                if *cause == Cause::NoConvergence && advice.tried > 1 {
                    write!(f, "; there may be no solution: {} other starts did not lead to one either", advice.tried)?;
                }
                place.evaluation.as_ref().map_or(Ok(()), |failure| reads_lines(f, failure))?;
                place_lines(f, place, "values where the search ended")?;
                advice_lines(f, (advice, cause))?;
                match cause {
                    Cause::Singular => hint(
                        f,
                        "its coefficient may be zero at these values, or equations may repeat each other: change start values or \
                         parameters, or check the initial equations",
                    ),
                    _ if place.evaluation.as_ref().is_some_and(|failure| failure.is_foreign) => Ok(()),
                    _ => hint(f, "give start values closer to the solution, or check the initial equations"),
                }
            }
            SolveError::Inconsistent { stage, time, cause, place } => {
                let time = significant(*time);
                write!(f, "{} at t = {time} s: no consistent values found: {}", stage.words(), cause.words(place))?;
                place.evaluation.as_ref().map_or(Ok(()), |failure| reads_lines(f, failure))?;
                place_lines(f, place, "values where the search ended")?;
                match &place.evaluation {
                    Some(failure) if *cause == Cause::NotFinite => domain_hint(f, Some(failure)),
                    _ if *cause == Cause::Singular => hint(
                        f,
                        "its coefficient may be zero at these values, or equations may repeat each other: change start values or parameters",
                    ),
                    _ => hint(f, "the algebraic equations may have no solution for these states"),
                }
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
                match (&report.place.variable, grows_at_the_end(report)) {
                    (Some(variable), Some((before, now))) => {
                        let (before, now) = (significant(before), significant(now));
                        write!(f, ": {variable} grows without bound, from {before} at the start to {now}")?;
                        grow_with_it(f, variable, report)?;
                        step_lines(f, report)?;
                        hint(f, GROWING)
                    }
                    (variable, _) => {
                        if let Some(variable) = variable {
                            write!(f, ": the error of {variable} stays above the tolerance")?;
                        }
                        step_lines(f, report)?;
                        write!(f, "\n  {JUMPS}")
                    }
                }
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
                let (time, words) = (significant(report.time), Cause::NotFinite.words(&report.place));
                if let Some((variable, before, now)) = grown(&report.place) {
                    let (before, now) = (significant(before), significant(now));
                    write!(
                        f,
                        "no finite value beyond t = {time} s: {variable} grows without bound, from {before} at the start to {now}: {words}"
                    )?;
                    step_lines(f, report)?;
                    return hint(f, GROWING);
                }
                write!(f, "no finite value beyond t = {time} s: {words}")?;
                step_lines(f, report)?;
                domain_hint(f, report.place.evaluation.as_ref())
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
            SolveError::EventLoop { time, passes, relations, repeats } => {
                let time = significant(*time);
                write!(f, "the event at t = {time} s does not settle: values still change after {passes} passes")?;
                match repeats.variables.iter().find(|own| counts_on(own)) {
                    Some(own) => hint(
                        f,
                        &format!(
                            "`{name}` counts on with every pass, since an equation gives it a new value from its own `pre` at all times: put that \
                             equation into a `when`, as in `when sample(0, 0.1) then ... end when`",
                            name = own.name
                        ),
                    ),
                    None => match moved(repeats) {
                        Some(moved) => hint(
                            f,
                            &format!(
                                "what one pass changes a later one takes back, which moves {moved}: a hysteresis wider than that breaks such a loop, \
                                 as does a state or a delay between the two"
                            ),
                        ),
                        None => hint(
                            f,
                            "what one pass changes a later one takes back: `pre` of one, or another condition, breaks such a loop",
                        ),
                    },
                }?;
                relation_lines(f, relations)?;
                repeat_lines(f, repeats)
            }
            SolveError::Chattering { time, events, accumulating: false, relations, pile } => {
                let time = significant(*time);
                write!(f, "chattering at t = {time} s: {events} events while time stands still")?;
                pile_lines(f, pile, relations)?;
                let widths = pile.relations.iter().filter_map(|found| Some((found, found.width?)));
                match widths.max_by(|a, b| a.1.total_cmp(&b.1)) {
                    Some((found, width)) => hint(
                        f,
                        &format!(
                            "give `{}` a hysteresis (on above a limit, off below another): with the two {width:.1e} apart it switches \
                             about a thousand times in the run; or replace the jump by a ramp, which needs no event (`noEvent`)",
                            found.relation.text
                        ),
                    ),
                    None => hint(
                        f,
                        "give the condition a hysteresis, or replace the jump by a ramp, which needs no event (`noEvent`)",
                    ),
                }
            }
            SolveError::Chattering { time, accumulating: true, relations, pile, .. } => {
                let time = significant(*time);
                write!(f, "events accumulate at t = {time} s: the intervals between them keep shrinking")?;
                pile_lines(f, pile, relations)?;
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
                    write!(f, ", kept down by the error of {variable}")?;
                }
                place.near.as_deref().map_or(Ok(()), |near| near_lines(f, near))?;
                hint(
                    f,
                    "a `noEvent` or `sign` that keeps flipping needs an event or a smooth transition (`tanh(v/w)` with a small `w` for \
                     `sign(v)`); otherwise raise the step limit (`--max-steps`) or loosen the tolerance",
                )
            }
            SolveError::Interrupted { time } => write!(f, "interrupted at t = {time} s"),
            SolveError::Sink { time, error } => write!(f, "results at t = {time} s cannot be written: {error}"),
        }
    }
}

impl std::error::Error for SolveError {}

impl SolveError {
    /// True where a variable grows without bound, as it does where something has the wrong sign.
    pub fn grows(&self) -> bool {
        match self {
            SolveError::StepTooSmall(report) if grows_at_the_end(report).is_some() => true,
            SolveError::NotFinite(report) => grown(&report.place).is_some(),
            _ => self.runs_away(),
        }
    }

    /// True where an equation has lost its solution, or a value at the start is not defined.
    pub fn is_undefined(&self) -> bool {
        match self {
            SolveError::NoConvergence(report) => {
                report.place.near.as_ref().is_some_and(|near| near.vanishing.is_some())
            }
            SolveError::Initial { cause, .. } => *cause == Cause::NotFinite,
            _ => false,
        }
    }

    /// True where the equations near the last point drive a motion away faster than the run could show.
    pub fn runs_away(&self) -> bool {
        matches!(self, SolveError::StepTooSmall(report) if runs_away(report))
    }
}

/// What may help where equations decide alone.
const OTHER_SOLUTION: &str = "if they have another solution, start values can lead to that one";

/// Which condition at the start may go.
fn contradiction_hint(variable: Option<&str>, against: Contradicted) -> String {
    match (variable, against) {
        (Some(variable), Contradicted::Model) => {
            format!(
                "drop `fixed = true` of `{variable}`, whose value at the start follows from the equations alone; {OTHER_SOLUTION}"
            )
        }
        (Some(_), Contradicted::Named) => {
            "drop one of these conditions (`fixed = true`), or give values that agree".to_string()
        }
        (Some(variable), Contradicted::Others) => {
            format!("drop `fixed = true` of `{variable}` or of a start that it follows from, or give values that agree")
        }
        (None, Contradicted::Model) => format!(
            "the equations of the model decide this alone: give a variable a start value instead, or change the model; {OTHER_SOLUTION}"
        ),
        (None, Contradicted::Named) => "drop one of these conditions".to_string(),
        (None, Contradicted::Others) => {
            "drop this initial equation, or one of the conditions that it follows from".to_string()
        }
    }
}

/// A motion grows without bound where its time constant is less than this part of the run.
const FAST_GROWTH: f64 = 1e-4;

/// A variable that exceeds its value at the start, or 1, by this factor grows without bound.
const GROWN: f64 = 1e6;

/// The same where the equations near the end drive it further.
const GROWN_AWAY: f64 = 1e3;

/// The same for a variable of which it is not known that it is at fault.
const BEYOND: f64 = 1e50;

/// What to try where a value is outside of what an operation takes.
const DOMAINS: &str = "keep divisors away from zero and arguments of sqrt and log within their domains";
/// What is said where steps collapse, and nothing is known that the run approaches.
pub const JUMPS: &str = "hint: the solution may grow without bound or jump here; a discontinuity should cause an event";
/// What to try where a variable grows without bound.
const GROWING: &str = "the solution ends here: what lets it grow lacks a limit, or has the wrong sign";

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

/// True where the equations near the last point drive the variable at fault away.
fn runs_away(report: &StepReport) -> bool {
    let Some(near) = report.place.near.as_deref().filter(|_| report.place.variable.is_some()) else { return false };
    let grows = |(re, im): (f64, f64)| re > im && re * near.span * FAST_GROWTH > 1.0;
    near.mode.as_ref().is_some_and(|mode| grows(mode.eigenvalue))
}

/// The values of the variable at fault at the start and at the end, if it has grown out of all proportion, or by much where it runs away.
fn grows_at_the_end(report: &StepReport) -> Option<(f64, f64)> {
    let (course, variable) = (report.place.course.as_ref()?, report.place.variable.as_ref()?);
    let last = course.times().count().checked_sub(1)?;
    let (before, now) = (course.value(0, variable)?, course.value(last, variable)?);
    let factor = if runs_away(report) { GROWN_AWAY } else { GROWN };
    (now.abs() > factor * before.abs().max(1.0)).then_some((before, now))
}

/// What has grown with the variable at fault, which may only be the first to fail.
fn grow_with_it(f: &mut Formatter<'_>, variable: &str, report: &StepReport) -> fmt::Result {
    let Some(course) = report.place.course.as_ref() else { return Ok(()) };
    let factor = if runs_away(report) { GROWN_AWAY } else { GROWN };
    let others =
        course.unknowns().filter(|&(_, before, now)| now.is_finite() && now.abs() > factor * before.abs().max(1.0));
    let others =
        others.map(|(k, before, now)| (course.unknown_name(k), before, now)).filter(|(name, ..)| name != variable);
    let mut others: Vec<(String, f64, f64)> = others.collect();
    if others.is_empty() {
        return Ok(());
    }
    others.sort_by(|a, b| b.2.abs().total_cmp(&a.2.abs()));
    let one = |(name, before, now): &(String, f64, f64)| {
        format!("{name} from {} to {}", significant(*before), significant(*now))
    };
    let shown: Vec<String> = others.iter().take(MOST_NAMED).map(one).collect();
    let more = match others.len().saturating_sub(MOST_NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    write!(f, "\n  with it: {}{more}", shown.join(", "))
}

/// The first of the variables that are shown which has grown out of all proportion, with its values at the start and at the end.
fn grown(place: &Place) -> Option<(&str, f64, f64)> {
    let course = place.course.as_ref()?;
    let last = course.times().count().checked_sub(1)?;
    let names = place.variable.iter().chain(place.values.iter().map(|(name, ..)| name));
    names.map(String::as_str).find_map(|name| {
        let (before, now) = (course.value(0, name)?, course.value(last, name)?);
        (now.abs() > BEYOND * before.abs().max(1.0)).then_some((name, before, now))
    })
}

/// What to try where a value is not finite; the message of a function's own assertion says it better.
fn domain_hint(f: &mut Formatter<'_>, failure: Option<&EvalFailure>) -> fmt::Result {
    match failure {
        Some(failure) if failure.is_foreign || failure.reason.contains(" fails: ") => Ok(()),
        Some(failure) if failure.is_unset() => {
            hint(f, "give the variable a value on every way through the function, such as by an `else`")
        }
        Some(failure) if failure.reason.contains(" uses subscript 0 ") => {
            hint(f, "subscripts begin at 1: a start value counts, too, which is 0 where none is given")
        }
        Some(failure) if is_subscript(failure) => {
            hint(f, "a subscript has to stay within its array: limit it, or end the run before")
        }
        _ => hint(f, DOMAINS),
    }
}

/// True where an element was asked for that an array does not have.
fn is_subscript(failure: &EvalFailure) -> bool {
    failure.reason.contains(" uses subscript ")
}

/// By how much real variables move from pass to pass.
fn moved(repeats: &Repeats) -> Option<String> {
    let real = repeats.variables.iter().filter(|own| own.kind == ValueKind::Real);
    let by = |own: &Changing| {
        let (low, high) = own.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
        format!("`{}` by {}", own.name, significant(high - low))
    };
    let all: Vec<String> = real.take(MOST_NAMED).map(by).collect();
    (repeats.period.is_some() && !all.is_empty()).then(|| all.join(", "))
}

/// What the value at fault was computed from.
fn reads_lines(f: &mut Formatter<'_>, failure: &EvalFailure) -> fmt::Result {
    if failure.reads.is_empty() {
        return Ok(());
    }
    let one = |read: &Reading| {
        let unit = Some(read.unit.as_str()).filter(|unit| !["", "1"].contains(unit));
        let unit = unit.map_or_else(String::new, |unit| format!(" {unit}"));
        format!("{} = {}{unit}", read.name, significant(read.value))
    };
    // Of an element that does not exist the others say least.
    let (elements, mut others): (Vec<&Reading>, Vec<&Reading>) =
        failure.reads.iter().partition(|read| is_subscript(failure) && read.name.ends_with(']'));
    others.extend(elements);
    let shown: Vec<String> = others.into_iter().take(MOST_NAMED).map(one).collect();
    let more = match failure.reads.len().saturating_sub(MOST_NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    write!(f, "\n  there {}{more}", shown.join(", "))
}

fn step_lines(f: &mut Formatter<'_>, report: &StepReport) -> fmt::Result {
    write!(f, "\n  last step tried: {:.3e} s at order {}", report.step, report.order)?;
    place_lines(f, &report.place, "last good values")?;
    report.place.near.as_deref().map_or(Ok(()), |near| near_lines(f, near))
}

/// Steps shorter than this part of a time constant do not follow the motion of that constant.
const FAR_BELOW: f64 = 1e-3;
/// Equations whose fastest motion dies out in less than this part of the run are stiff.
const STIFF: f64 = 1e-3;

/// What the equations near the last point say.
fn near_lines(f: &mut Formatter<'_>, near: &Near) -> fmt::Result {
    if let Some((name, nominal, largest)) = &near.below_rounding {
        let (nominal, largest) = (significant(*nominal), significant(*largest));
        write!(
            f,
            "\n  the error that {name} may have is below the rounding of its values, up to {largest}: its nominal value {nominal} is out \
             of scale; set `nominal = {largest}`"
        )?;
    }
    if let Some(vanishing) = &near.vanishing {
        let equation = vanishing.equation.as_ref().map_or_else(String::new, |own| format!(", most in `{}`", own.text));
        write!(
            f,
            "\n  the equations determine {} ever less{equation}: their smallest singular value goes from {:.2e} at the start to {:.2e}",
            vanishing.variable, vanishing.before, vanishing.now
        )?;
    }
    let Some(mode) = &near.mode else { return Ok(()) };
    let (re, im) = mode.eigenvalue;
    let value = match (re, im) {
        (re, 0.0) => format!("{re:.3e}"),
        (0.0, im) => format!("+- {im:.3e} i"),
        (re, im) => format!("{re:.3e} +- {im:.3e} i"),
    };
    let shares: Vec<String> =
        mode.shares.iter().map(|(name, share)| format!("{name} {:.0} %", 100.0 * share)).collect();
    write!(f, "\n  the eigenvalue behind it is {value} 1/s, ")?;
    match shares.is_empty() {
        true => write!(f, "shared by many of the {} states", mode.states)?,
        false => write!(f, "of {}", shares.join(", "))?,
    }
    let (constant, step) = (math::hypot(re, im).recip(), near.step);
    if re > 0.0 && re * near.span > 1.0 && re > im {
        write!(f, ": the motion grows by a factor of e every {:.2e} s", re.recip())?;
    } else if step < FAR_BELOW * constant {
        write!(
            f,
            ": its motion takes {constant:.2e} s, the steps {step:.2e} s, so it is not what keeps them short, but a jump or a singularity"
        )?;
    } else {
        write!(f, ": the steps of {step:.2e} s follow its motion")?;
    }
    if mode.fastest * near.span * STIFF > 1.0 && mode.fastest > 1e3 * mode.slowest {
        let (fast, slow) = (mode.fastest.recip(), mode.slowest.recip());
        write!(f, "; the equations are stiff, with time constants from {fast:.1e} s to {slow:.1e} s")
    } else {
        write!(f, "; the equations are not stiff")
    }
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

/// Which start values decide, and what else was tried.
fn advice_lines(f: &mut Formatter<'_>, (advice, cause): (&StartAdvice, &Cause)) -> fmt::Result {
    let names: Vec<String> =
        advice.decisive.iter().map(|(name, value)| format!("{name} (now {})", significant(*value))).collect();
    match (names.as_slice(), &advice.bent) {
        ([], _) => {}
        ([one], Some(bent)) => write!(f, "\n  the start value of {one} decides; most curved is {}", bent.text)?,
        (several, Some(bent)) => {
            let (shown, more) = several.split_at(several.len().min(MOST_NAMED));
            let more = if more.is_empty() { String::new() } else { format!(" and {} more", more.len()) };
            write!(f, "\n  the start values of {}{more} decide; most curved is {}", shown.join(", "), bent.text)?;
        }
        _ => {}
    }
    match advice.tried {
        0 => Ok(()),
        1 => write!(f, "\n  from one other start no solution was found either"),
        _ if *cause == Cause::NoConvergence => Ok(()),
        tried => write!(f, "\n  from {tried} other starts no solution was found either: there may be none"),
    }
}

fn line_of(f: &mut Formatter<'_>, equation: &EquationInfo) -> fmt::Result {
    write!(f, "\n  equation: {}\n  at {}:{}", equation.text, equation.file, equation.line)?;
    if !equation.component.is_empty() {
        write!(f, " in {}", equation.component)?;
    }
    Ok(())
}

/// Which relations changed how often among the last events.
fn pile_lines(f: &mut Formatter<'_>, pile: &Pile, last: &[RootInfo]) -> fmt::Result {
    if pile.relations.is_empty() {
        return relation_lines(f, last);
    }
    for found in pile.relations.iter().take(MOST_NAMED) {
        let (text, file, line) = (&found.relation.text, &found.relation.file, found.relation.line);
        write!(f, "\n  relation: {text}\n  at {file}:{line}")?;
    }
    let counts = pile.relations.iter().take(MOST_NAMED);
    let counts: Vec<String> = counts.map(|found| format!("`{}` {} times", found.relation.text, found.count)).collect();
    write!(f, "\n  the last {} events, within {:.1e} s: {}", pile.events, pile.within, counts.join(", "))?;
    match pile.relations.as_slice() {
        [first, second, ..] if pile.in_turns => {
            write!(f, "\n  `{}` takes turns with `{}`", first.relation.text, second.relation.text)
        }
        _ => Ok(()),
    }
}

/// A variable goes on by the same amount from pass to pass.
fn counts_on(changing: &Changing) -> bool {
    let steps: Vec<f64> = changing.values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    matches!(changing.kind, ValueKind::Integer | ValueKind::Real)
        && steps.len() >= 3
        && steps[0] != 0.0
        && steps.iter().all(|step| *step == steps[0])
}

/// What changes from pass to pass.
fn repeat_lines(f: &mut Formatter<'_>, repeats: &Repeats) -> fmt::Result {
    if repeats.variables.is_empty() {
        return Ok(());
    }
    let value = |kind: &ValueKind, value: f64| match kind {
        ValueKind::Boolean => (if value == 0.0 { "false" } else { "true" }).to_string(),
        ValueKind::Enumeration(literals) => {
            literals.get((value as usize).wrapping_sub(1)).map_or_else(|| significant(value), ToString::to_string)
        }
        ValueKind::Real | ValueKind::Integer => significant(value),
    };
    let one = |changing: &Changing| {
        let values: Vec<String> = changing.values.iter().map(|v| value(&changing.kind, *v)).collect();
        format!("`{}` = {}", changing.name, values.join(", "))
    };
    let all: Vec<String> = repeats.variables.iter().map(one).collect();
    match repeats.period {
        Some(period) => write!(f, "\n  every {period} passes the same again: {}", all.join("; ")),
        None => write!(f, "\n  in the last passes: {}", all.join("; ")),
    }
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
