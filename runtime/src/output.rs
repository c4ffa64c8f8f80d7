//! Rows for the sink: which points, which values, and the assertions that are checked there.
//!
//! Output points between steps interpolate all unknowns and then make the algebraic ones and the rates consistent, so that
//! constraints hold in every row.  Event points are written twice.  Warnings are collected once each.

use hyd_results::{RowKind, Sink};
use hyd_system::{AssertionReport, EvalFailure, Excerpt, Instants, Place, Source, Structure, Tables};

use crate::delay::Delaying;
use crate::error::{SolveError, Stage};
use crate::initial::consistent::Consistency;
use crate::integrator::Integrator;
use crate::loops::judge;
use crate::problem::{Problem, all_finite};
use crate::sensitivity::Sensitivity;
use crate::weights::Weights;
use crate::{Options, Warning};

/// A run that writes a step's rows asks after this many whether to stop.
const ROWS_BETWEEN_QUESTIONS: usize = 1000;

/// Warnings that are kept apart; the last one takes the points of all further ones.
const MOST_WARNINGS: usize = 1000;

/// Outputs that rows need, which a system evaluates without the others.
#[derive(Clone)]
struct Needed {
    /// Positions in a row, in ascending order.
    outputs: Vec<u32>,
    /// What evaluates them.
    excerpt: Excerpt,
}

impl Needed {
    /// None where the system evaluates all of them anyway.
    fn new(outputs: &[u32], system: &mut Delaying<'_>) -> Option<Self> {
        let mut outputs = outputs.to_vec();
        outputs.sort_unstable();
        outputs.dedup();
        let excerpt = system.find_excerpt(&outputs)?;
        Some(Self { outputs, excerpt })
    }

    /// They follow from states, the time and what is constant within a step.
    fn is_of_states(&self, states: &[bool]) -> bool {
        !self.excerpt.rates && self.excerpt.unknowns.iter().all(|&k| states[k as usize])
    }

    /// Evaluates them; false if one is not finite.
    fn evaluate(&self, problem: &mut Problem<'_>, t: f64, (y, yp): (&[f64], &[f64]), row: &mut [f64]) -> bool {
        problem.system.excerpt(self.excerpt.number, t, y, yp, row);
        self.outputs.iter().all(|&k| row[k as usize].is_finite())
    }
}

/// Writes the rows of one run.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Output {
    row: Vec<f64>,
    outputs: usize,
    y: Vec<f64>,
    yp: Vec<f64>,
    next: usize,
    /// Output points written so far.
    points: u64,
    /// No output point that is still to be written comes before this time (s).
    due: f64,
    /// The end of what the run has passed (s).
    passed: f64,
    reports: Vec<AssertionReport>,
    /// The end of the run (s), where all outputs are evaluated.
    stop: f64,
    /// What rows at output points need, if not everything; numbers of excerpts hold for one system.
    #[serde(skip)]
    needed: Option<Needed>,
    /// What rows within steps need, if not everything.
    #[serde(skip)]
    needed_within: Option<Needed>,
    /// The same where that is unknowns alone: positions in the row, with those among the unknowns.
    states_within: Option<Vec<(u32, u32)>>,
    /// Which of the warnings the last point belongs to.
    open: Vec<usize>,
    /// Assertions of level warning that did not hold.
    pub(crate) warnings: Vec<Warning>,
}

impl Output {
    /// Work space for systems of this structure.
    pub(crate) fn new(structure: &Structure) -> Self {
        let n = structure.unknowns;
        Self {
            row: vec![0.0; structure.outputs],
            outputs: structure.outputs,
            y: vec![0.0; n],
            yp: vec![0.0; n],
            next: 0,
            points: 0,
            due: f64::NEG_INFINITY,
            passed: f64::NEG_INFINITY,
            reports: Vec::new(),
            stop: f64::INFINITY,
            needed: None,
            needed_within: None,
            states_within: None,
            open: Vec::new(),
            warnings: Vec::new(),
        }
    }

    /// Forgets the run before; each row holds `extra` derivatives behind the outputs.
    pub(crate) fn restart(&mut self, options: &Options, system: &mut Delaying<'_>, extra: usize) {
        self.states_within = options.needed_within.as_ref().and_then(|needed| unknowns_of(needed, system.tables()));
        let plain = options.needed_outputs.as_deref().filter(|_| extra == 0);
        self.needed = plain.and_then(|needed| Needed::new(needed, system));
        self.needed_within = match self.states_within {
            Some(_) => None,
            None => options.needed_within.as_deref().and_then(|needed| Needed::new(needed, system)),
        };
        self.stop = options.stop;
        self.row.resize(self.outputs + extra, 0.0);
        (self.next, self.due, self.points) = (1, f64::NEG_INFINITY, 0);
        self.passed = options.start;
        self.skip_to(options, options.start);
        self.reports.clear();
        self.open.clear();
        self.warnings.clear();
    }

    /// One row.
    pub(crate) fn row(
        &mut self,
        problem: &mut Problem<'_>,
        sink: &mut dyn Sink,
        t: f64,
        (y, yp): (&[f64], &[f64]),
        kind: RowKind,
        sensitivity: Option<&mut Sensitivity>,
    ) -> Result<(), SolveError> {
        self.passed = self.passed.max(t);
        let (row, derivatives) = self.row.split_at_mut(self.outputs);
        problem.system.outputs(t, y, yp, row);
        if let Some(sensitivity) = sensitivity {
            sensitivity.outputs(problem, t, (y, yp), derivatives);
        }
        check_outputs(problem, t, (y, yp), &self.row[..self.outputs])?;
        sink.row(t, &self.row, kind).map_err(|error| SolveError::Sink { time: t, error })
    }

    /// One row, with the outputs alone that are needed in it unless it is to be `whole`, or one of them is not finite.
    fn needed_row(
        &mut self,
        problem: &mut Problem<'_>,
        sink: &mut dyn Sink,
        (t, kind): (f64, RowKind),
        (y, yp): (&[f64], &[f64]),
        whole: bool,
    ) -> Result<(), SolveError> {
        let needed = if kind == RowKind::Within { &self.needed_within } else { &self.needed };
        if let Some(needed) = needed.as_ref().filter(|_| !whole)
            && needed.evaluate(problem, t, (y, yp), &mut self.row)
        {
            self.passed = self.passed.max(t);
            return sink.row(t, &self.row, kind).map_err(|error| SolveError::Sink { time: t, error });
        }
        self.row(problem, sink, t, (y, yp), kind, None)
    }

    /// The output points up to `end` (s) that the last step passed; those at `end` itself only if `inclusive`, else they are
    /// left to the rows of an event.  `stop` is asked now and then.
    pub(crate) fn grid(
        &mut self,
        problem: &mut Problem<'_>,
        sink: &mut dyn Sink,
        (options, stop): (&Options, &dyn Fn() -> bool),
        (past, consistency, weights): (&Integrator, &mut Consistency, &Weights),
        (end, inclusive): (f64, bool),
        sensitivity: Option<&mut Sensitivity>,
    ) -> Result<(), SolveError> {
        let begin = std::mem::replace(&mut self.passed, end);
        let within = options.within_steps && sensitivity.is_none();
        let parts = if within { past.parts() } else { 1 };
        for part in 1..parts {
            let t = begin + (end - begin) * (part as f64 / parts as f64);
            self.shown(problem, sink, (options, stop), (past, consistency, weights), (t, true), None)?;
            self.within(problem, sink, (past, consistency, weights), t)?;
        }
        if !options.every_step {
            self.shown(problem, sink, (options, stop), (past, consistency, weights), (end, inclusive), sensitivity)?;
        } else if inclusive {
            self.point(problem, sink, (past, consistency, weights), (end, RowKind::Normal), sensitivity)?;
        }
        if within && inclusive {
            self.within(problem, sink, (past, consistency, weights), end)?;
        }
        Ok(())
    }

    /// The output points at equal intervals, or those that are listed, up to `end` (s), as [`Output::grid`] has them.
    fn shown(
        &mut self,
        problem: &mut Problem<'_>,
        sink: &mut dyn Sink,
        (options, stop): (&Options, &dyn Fn() -> bool),
        (past, consistency, weights): (&Integrator, &mut Consistency, &Weights),
        (end, inclusive): (f64, bool),
        mut sensitivity: Option<&mut Sensitivity>,
    ) -> Result<(), SolveError> {
        if self.due > end || options.every_step {
            return Ok(());
        }
        let instants = Instants::of_run(options.start);
        while let Some(t) = options.output_time(self.next) {
            if t > end || (!inclusive && options.event_rows && instants.same(t, end)) {
                self.due = t;
                return Ok(());
            }
            if self.next.is_multiple_of(ROWS_BETWEEN_QUESTIONS) && stop() {
                return Err(SolveError::Interrupted { time: t });
            }
            self.next += 1;
            let at = (t, RowKind::Normal);
            self.point(problem, sink, (past, consistency, weights), at, sensitivity.as_deref_mut())?;
        }
        self.due = f64::INFINITY;
        Ok(())
    }

    /// A row within a step.  States are what the polynomial of the step says, so nothing is evaluated where nothing else is needed.
    fn within(
        &mut self,
        problem: &mut Problem<'_>,
        sink: &mut dyn Sink,
        (past, consistency, weights): (&Integrator, &mut Consistency, &Weights),
        t: f64,
    ) -> Result<(), SolveError> {
        let states = consistency.states();
        if let Some(needed) = self.needed_within.as_ref().filter(|needed| needed.is_of_states(states)) {
            past.at(t, &mut self.y, &mut self.yp);
            if needed.evaluate(problem, t, (&self.y, &self.yp), &mut self.row) {
                return sink.row(t, &self.row, RowKind::Within).map_err(|error| SolveError::Sink { time: t, error });
            }
        }
        let Some(needed) = self.states_within.as_ref().filter(|needed| needed.iter().all(|&(_, k)| states[k as usize]))
        else {
            return self.point(problem, sink, (past, consistency, weights), (t, RowKind::Within), None);
        };
        past.at(t, &mut self.y, &mut self.yp);
        for &(position, k) in needed {
            self.row[position as usize] = self.y[k as usize];
        }
        sink.row(t, &self.row, RowKind::Within).map_err(|error| SolveError::Sink { time: t, error })
    }

    /// A row at a point that the last step passed: states interpolated, everything else made consistent with them.
    fn point(
        &mut self,
        problem: &mut Problem<'_>,
        sink: &mut dyn Sink,
        (past, consistency, weights): (&Integrator, &mut Consistency, &Weights),
        (t, kind): (f64, RowKind),
        sensitivity: Option<&mut Sensitivity>,
    ) -> Result<(), SolveError> {
        let (mut y, mut yp) = (std::mem::take(&mut self.y), std::mem::take(&mut self.yp));
        past.at(t, &mut y, &mut yp);
        let holds = consistency.project(problem, (t, past.step_size()), weights, &mut y, &mut yp);
        self.points += 1;
        let judged = match holds && self.points.is_power_of_two() {
            true => judge(problem, (Stage::Step, t), (&y, &yp)),
            false => Ok(()),
        };
        let written = judged.and_then(|()| match sensitivity {
            Some(sensitivity) => {
                sensitivity.wait(t, (&y, &yp));
                Ok(())
            }
            None => {
                let whole = kind == RowKind::Normal && (self.points.is_power_of_two() || t >= self.stop);
                self.needed_row(problem, sink, (t, kind), (&y, &yp), whole)
            }
        });
        let result = match kind {
            // Not every row within a step comes by here, so none is what assertions are checked at.
            RowKind::Within => written,
            _ => written.and_then(|()| self.assertions(problem, t, (&y, &yp))),
        };
        // Whatever the result, the next run finds its room.
        (self.y, self.yp) = (y, yp);
        result
    }

    /// Writes the rows that have got their derivatives.
    pub(crate) fn flush(
        &mut self,
        problem: &mut Problem<'_>,
        sink: &mut dyn Sink,
        sensitivity: &mut Sensitivity,
    ) -> Result<(), SolveError> {
        while let Some(row) = sensitivity.next_row() {
            let written = self.row(problem, sink, row.t, (&row.y, &row.yp), RowKind::Normal, Some(&mut *sensitivity));
            sensitivity.give_back(row);
            written?;
        }
        Ok(())
    }

    /// Drops output points that the rows of an event at `t` (s) stand for.
    pub(crate) fn skip_to(&mut self, options: &Options, t: f64) {
        while self.is_due(options, t) {
            self.next += 1;
        }
    }

    /// True if the next output point lies at `t` (s), or before it.
    pub(crate) fn is_due(&self, options: &Options, t: f64) -> bool {
        let instants = Instants::of_run(options.start);
        options.output_time(self.next).is_some_and(|next| instants.has_come(next, t))
    }

    /// Checks the assertions at a point; an error if one of that level does not hold.
    pub(crate) fn assertions(
        &mut self,
        problem: &mut Problem<'_>,
        t: f64,
        (y, yp): (&[f64], &[f64]),
    ) -> Result<(), SolveError> {
        problem.system.assertions(t, y, yp, &mut self.reports);
        if self.reports.is_empty() {
            self.open.clear();
            return Ok(());
        }
        let before = self.open.len();
        for report in self.reports.drain(..) {
            if report.error {
                return Err(SolveError::Assertion { time: t, report: Box::new(report) });
            }
            // Elements of an array stand at one place; they are taken in their order.
            let place = |report: &AssertionReport| (report.file.clone(), report.line);
            let taken = &self.open[before..];
            let same = |k: &&usize| place(&self.warnings[**k].report) == place(&report);
            let found = match report.line {
                // What others say has no place, and comes when they like.
                0 => self.warnings.iter().position(|known| known.report == report),
                _ => self.open[..before].iter().filter(|k| !taken.contains(k)).find(same).copied(),
            };
            let k = found.unwrap_or(self.warnings.len().min(MOST_WARNINGS - 1));
            if k == self.warnings.len() {
                self.warnings.push(Warning { time: t, until: t, points: 0, report });
            }
            let warning = &mut self.warnings[k];
            (warning.until, warning.points) = (t, warning.points + 1);
            self.open.push(k);
        }
        self.open.drain(..before);
        Ok(())
    }
}

/// The unknowns that stand at these positions of the row; none if something else stands at one of them.
fn unknowns_of(positions: &[u32], tables: &Tables) -> Option<Vec<(u32, u32)>> {
    let mut wanted = positions.to_vec();
    wanted.sort_unstable();
    wanted.dedup();
    let mut found = Vec::with_capacity(wanted.len());
    for (&(variable, element), k) in tables.unknowns.iter().zip(0..) {
        if let Place::Output(position) = tables.variables[variable as usize].sources[element as usize].place
            && wanted.binary_search(&position).is_ok()
        {
            found.push((position, k));
        }
    }
    (found.len() == wanted.len()).then_some(found)
}

/// An error where a recorded variable is not finite, as where a square root has no value: why, if the model can say, else the first such variable.
pub(crate) fn check_outputs(
    problem: &mut Problem<'_>,
    t: f64,
    (y, yp): (&[f64], &[f64]),
    row: &[f64],
) -> Result<(), SolveError> {
    if all_finite(row) {
        return Ok(());
    }
    let failure = problem.system.diagnose(t, y, yp).unwrap_or_else(|| {
        let bad = row.iter().position(|value| !value.is_finite());
        let variable = problem.system.tables().variables.iter().find_map(|info| {
            let recorded = |source: &Source| matches!(source.place, Place::Output(k) if Some(k as usize) == bad);
            info.sources.iter().position(recorded).map(|element| info.name.element(element))
        });
        EvalFailure { variable, reason: "not a number".into(), ..EvalFailure::default() }
    });
    Err(SolveError::evaluation(Stage::Step, t, failure, problem))
}
