//! Jumps: a loop of equations loses its solution (a fold), and the run goes on with another one.
//!
//! A step that fails however small it is may stand before such a fold.  Just behind it, with the states moved on by
//! their rates, the curve of `fold` leads to another root.  The run goes on from there as after an event, and the jump
//! is kept for a note.  Where a root is still near, or none is found, the failure stands.  Derivatives with respect to
//! parameters follow the instant of the fold like that of any event.

use hyd_results::RowKind;
use hyd_system::{EquationInfo, EventPhase};

use super::{Run, Simulator};
use crate::corrector::{StepFailure, StepFault};
use crate::error::{SolveError, Stage};
use crate::events::iteration::{Instant, settle};
use crate::problem::Problem;
use crate::sensitivity::EventSource;

/// How far behind the last point the solution is looked for, as parts of the run.
const AHEAD: [f64; 4] = [1e-12, 1e-10, 1e-8, 1e-6];
/// An unknown that changes by more than this part of its size has jumped.
const JUMPED: f64 = 1e-3;
/// Jumps that follow each other sooner than this part of the run lead nowhere.
const SAME_PLACE: f64 = 1e-9;

/// A loop of equations went over to another of its solutions.
#[derive(Clone, PartialEq, Debug, serde::Serialize, serde::Deserialize)]
pub struct Jump {
    /// Time (s).
    pub time: f64,
    /// The variables of the loop.
    pub variables: Vec<String>,
    /// Those that are found by iteration, or, where rates alone change, their rates: name, value before, value after, unit.
    pub changes: Vec<(String, f64, f64, String)>,
    /// The equations of the loop.
    pub equations: Vec<EquationInfo>,
}

impl Simulator {
    /// After a step that failed: the time from which the run goes on, with other values, if there is a way on.
    pub(super) fn jump(
        &mut self,
        run: &mut Run<'_, '_>,
        failure: &StepFailure,
        (from, limit): (f64, f64),
    ) -> Result<Option<f64>, SolveError> {
        let repeated = self.jumps.last().is_some_and(|last| from - last.time <= SAME_PLACE * run.span());
        if failure.fault == StepFault::NotFinite || repeated {
            return Ok(None);
        }
        let Some(t) = self.find_other_solution(run, from, limit) else { return Ok(None) };
        let before = (self.integrator.y(), self.integrator.yp());
        let after = (self.point.y.as_slice(), self.point.yp.as_slice());
        let states = self.consistency.states();
        let jumped = jumped(before, after, states, (&self.weights.nominals, run.span()));
        self.jumps.push(describe(run.problem, t, (before, after), states, &jumped));
        let rows = run.options.event_rows || run.options.every_step;
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.reach(run.problem)?;
            self.output.flush(run.problem, run.sink, sensitivity)?;
            sensitivity.arrive(run.problem, from, before.0, before.1)?;
        }
        if rows {
            let sensitivity = self.sensitivity.as_deref_mut();
            self.output.row(run.problem, run.sink, t, before, RowKind::BeforeEvent, sensitivity)?;
        }
        if let Some(sensitivity) = &mut self.sensitivity {
            let fold = EventSource::Fold(jumped.first().copied().unwrap_or(0));
            sensitivity.shift(run.problem, from, before, fold);
            sensitivity.consistent(run.problem, (Stage::Event, t), after.0, after.1)?;
        }
        run.problem.statistics.state_events += 1;
        let at = Instant { first: EventPhase::First, t, time_scale: self.integrator.step_size(), span: run.span() };
        let (y, yp) = (&mut self.point.y, &mut self.point.yp);
        let sensitivity = self.sensitivity.as_deref_mut();
        let outcome = settle(run.problem, &mut self.consistency, &self.weights, at, (y, yp), sensitivity)?;
        run.terminated = outcome.terminated.or(run.terminated.take());
        if let Some(sensitivity) = &mut self.sensitivity {
            sensitivity.depart(run.problem, t, y, yp)?;
        }
        if rows {
            let sensitivity = self.sensitivity.as_deref_mut();
            self.output.row(run.problem, run.sink, t, (y, yp), RowKind::AfterEvent, sensitivity)?;
            self.output.skip_to(run.options, t);
        }
        if t <= run.checked_to {
            self.output.assertions(run.problem, t, (y, yp))?;
        }
        self.restart(run, t, false);
        Ok(Some(t))
    }

    /// Behind the last point the solution has vanished and there is another: its time, with values in `point`.
    fn find_other_solution(&mut self, run: &mut Run<'_, '_>, from: f64, limit: f64) -> Option<f64> {
        let nearest = 16.0 * self.integrator.smallest_step(from);
        for part in AHEAD {
            let ahead = (part * run.span()).max(nearest);
            if from + ahead >= limit {
                return None;
            }
            let (y, yp) = (&mut self.point.y, &mut self.point.yp);
            y.copy_from_slice(self.integrator.y());
            yp.copy_from_slice(self.integrator.yp());
            for (k, &state) in self.consistency.states().iter().enumerate() {
                if state {
                    y[k] += ahead * yp[k];
                }
            }
            let at = (from + ahead, self.integrator.step_size().max(1e-6 * run.span()));
            if !self.consistency.cross(run.problem, at, &self.weights, y, yp) {
                continue;
            }
            let before = (self.integrator.y(), self.integrator.yp());
            let scales = (&*self.weights.nominals, run.span());
            if !jumped(before, (y, yp), self.consistency.states(), scales).is_empty() {
                return Some(from + ahead);
            }
        }
        None
    }
}

/// The unknowns that differ by more than two points of a smooth solution close to each other would: algebraic ones by their values,
/// states by their rates, which short steps leave less accurate.
fn jumped(before: Values<'_>, after: Values<'_>, states: &[bool], (nominals, span): (&[f64], f64)) -> Vec<usize> {
    let differs = |&k: &usize| {
        let ((old, new), size, part) = match states[k] {
            true => ((before.1[k], after.1[k]), nominals[k] / span, 100.0 * JUMPED),
            false => ((before.0[k], after.0[k]), nominals[k], JUMPED),
        };
        (new - old).abs() > part * size.max(old.abs()).max(new.abs())
    };
    (0..states.len()).filter(differs).collect()
}

/// Values and rates of all unknowns.
type Values<'a> = (&'a [f64], &'a [f64]);

/// Unknowns stand in the order in which they are computed, so the first that moves belongs to the loop, and so does its equation.
fn describe(
    problem: &Problem<'_>,
    time: f64,
    (before, after): (Values<'_>, Values<'_>),
    states: &[bool],
    jumped: &[usize],
) -> Jump {
    let tables = problem.system.tables();
    let first = jumped.first().copied().unwrap_or(0);
    let known = tables.loop_of(first);
    let change = |&k: &usize| {
        let info = tables.unknowns.get(k).and_then(|&(v, _)| tables.variables.get(v as usize));
        let unit = info.map_or_else(String::new, |info| info.unit.to_string());
        match states[k] {
            true => (format!("der({})", tables.unknown_name(k)), before.1[k], after.1[k], String::new()),
            false => (tables.unknown_name(k), before.0[k], after.0[k], unit),
        }
    };
    let inside = |k: &&usize| known.map_or(**k == first, |found| found.unknowns.contains(&(**k as u32)));
    let name = |&(v, element): &(u32, u32)| tables.variables[v as usize].name.element(element as usize);
    let equations =
        known.map_or_else(|| tables.rows.get(first).into_iter().copied().collect(), |k| k.equations.clone());
    Jump {
        time,
        variables: known.map_or_else(|| vec![change(&first).0], |found| found.variables.iter().map(name).collect()),
        changes: jumped.iter().filter(inside).map(change).collect(),
        equations: equations.iter().filter_map(|&e| tables.equations.get(e as usize)).cloned().collect(),
    }
}
