//! Forward sensitivities: derivatives of the solution with respect to parameters and start values.
//!
//! Staggered direct method (Feehery, Tolsma, Barton, Appl. Numer. Math. 25 (1997) 41): behind the accepted points of the
//! solution the linear systems `F_y s + F_y' s' + F_p = 0` are integrated with the matrix of each point ([`steps`]).
//! Initial values come from the linearised initial system, and events shift with the parameters ([`event`]).  Steps are the
//! sensitivities' own: the solution is the same with and without them, whatever method computes it.
//!
//! Vectors hold blocks of `width` derivatives per unknown: one per parameter, and one last for the derivative with
//! respect to time, which serves at events.  Within steps there is no such last one, and the order is another.

mod breaks;
mod event;
mod linear;
mod steps;
pub(crate) mod tables;
mod trail;
mod waiting;

use std::sync::Arc;

use hyd_system::{Along, DaeSystem, Direction, DirectionError, Place, Settable, Structure, Tables};

use crate::OptionError;
use crate::corrector::damped::NewtonFailure;
use crate::delay::Delaying;
use crate::error::{SolveError, Stage};
use crate::initial::consistent::Inconsistent;
use crate::linear::FactorError;
use crate::problem::Problem;
use breaks::Breaks;
use linear::Matrices;
use steps::Steps;
use tables::ExtendedTables;
use trail::Trail;
use waiting::Waiting;

pub(crate) use event::EventSource;
pub(crate) use waiting::WaitingRow;

/// Derivatives below this part of `nominal / parameter` count as zero in the error test.
const LEAST: f64 = 1e-3;

/// Sensitivities of one run after the other.
pub(crate) struct Sensitivity {
    names: Vec<String>,
    directions: Vec<Direction>,
    tables: ExtendedTables,
    /// Unknowns that are states at present.
    differential: Vec<bool>,
    outputs: usize,
    /// Number of parameters and one for time.
    width: usize,
    matrices: Matrices,
    steps: Steps,
    trail: Trail,
    breaks: Breaks,
    waiting: Waiting,
    at: AtPoint,
    event: EventWork,
    solution: Solution,
    rows: Rows,
    /// A point of the solution at which sources of delays are derived.
    point: (Vec<f64>, Vec<f64>),
    /// A derivative of a discrete variable changed in the event.
    pub(crate) changed: bool,
}

/// Derivatives at the current point.
struct AtPoint {
    /// Of y and y'.
    s: Vec<f64>,
    sp: Vec<f64>,
    /// Of the current time: those of an instant while an event is settled, else 0.
    dt: Vec<f64>,
    /// Of the instant of the last event.
    instant: Vec<f64>,
}

impl AtPoint {
    fn along(&self) -> Along<'_> {
        Along { t: &self.dt, y: &self.s, yp: &self.sp }
    }
}

/// What an event needs: derivatives before a pass, those of the root functions, and the values before the pass.
struct EventWork {
    base: Vec<f64>,
    roots: Vec<f64>,
    y_before: Vec<f64>,
}

/// Right-hand sides and solutions of the linear systems of the equations and of the initial equations.
struct Solution {
    rhs: Vec<f64>,
    z: Vec<f64>,
}

/// What is written: derivatives of outputs and of parameters, and parameters with their derivatives behind.
struct Rows {
    /// Outputs whose derivatives are looked at, if not all; the others mean nothing.
    wanted: Option<Vec<u32>>,
    row: Vec<f64>,
    parameters: Vec<f64>,
    extended: Vec<f64>,
}

impl Sensitivity {
    /// Prepares for the named parameters or start values; reuses `old` where it fits.  `wanted`: outputs that are
    /// looked at, if not all.
    ///
    /// # Errors
    /// Which name cannot be varied, and why.
    pub(crate) fn prepare(
        old: Option<Box<Sensitivity>>,
        system: &mut dyn DaeSystem,
        names: &[String],
        wanted: Option<&[u32]>,
    ) -> Result<Box<Sensitivity>, OptionError> {
        let tables = Arc::clone(system.tables());
        let mut made = match old.filter(|old| old.names == names && old.tables.is_of(&tables)) {
            Some(old) => old,
            None => {
                let mut directions = Vec::with_capacity(names.len() + 1);
                for name in names {
                    directions.push(direction(&tables, name)?);
                }
                directions.push(Direction::None);
                let parameters = system.parameters().len();
                Box::new(Self::new(system.structure(), &tables, names, directions, parameters))
            }
        };
        made.changed = false;
        made.trail.clear();
        made.waiting.clear();
        let Some(tangents) = system.tangents() else {
            return Err(refusal(&names[0], "the system has no derivatives with respect to parameters"));
        };
        tangents.set_directions(&made.directions).map_err(|(k, error)| {
            let name = names.get(k).unwrap_or(&names[0]);
            match error {
                DirectionError::NotSettable => refusal(name, "it is computed or fixed, so it cannot be varied"),
                DirectionError::NoStart => refusal(name, "it has no start value that the run depends on"),
                DirectionError::Unsupported(reason) => refusal(name, &reason),
            }
        })?;
        tangents.select_outputs(wanted);
        if made.rows.wanted.as_deref() != wanted {
            made.rows.wanted = wanted.map(<[u32]>::to_vec);
        }
        Ok(made)
    }

    fn new(
        structure: &Structure,
        tables: &Arc<Tables>,
        names: &[String],
        directions: Vec<Direction>,
        parameters: usize,
    ) -> Self {
        let (n, width) = (structure.unknowns, directions.len());
        let block = || vec![0.0; n * width];
        let sizes = (structure.outputs, parameters);
        Self {
            names: names.to_vec(),
            directions,
            tables: ExtendedTables::new(tables, names, sizes),
            differential: structure.differential.clone(),
            outputs: structure.outputs,
            width,
            matrices: Matrices::new(structure),
            steps: Steps::new(n, width - 1),
            trail: Trail::new(n),
            breaks: Breaks::new(n),
            waiting: Waiting::default(),
            at: AtPoint { s: block(), sp: block(), dt: vec![0.0; width], instant: vec![0.0; width - 1] },
            event: EventWork { base: block(), roots: vec![0.0; structure.roots * width], y_before: vec![0.0; n] },
            solution: Solution { rhs: block(), z: vec![0.0; structure.initial.unknowns * width] },
            rows: Rows {
                wanted: None,
                row: vec![0.0; structure.outputs * width],
                parameters: vec![0.0; parameters * width],
                extended: Vec::new(),
            },
            point: (vec![0.0; n], vec![0.0; n]),
            changed: false,
        }
    }

    /// Number of parameters.
    fn count(&self) -> usize {
        self.width - 1
    }

    /// Values that a row has beside the outputs.
    pub(crate) fn extra_outputs(&self) -> usize {
        self.outputs * self.count()
    }

    /// Tables with the derivatives as further variables.
    pub(crate) fn tables(&self) -> &Arc<Tables> {
        &self.tables.extended
    }

    /// Parameter values followed by their derivatives.
    pub(crate) fn parameters(&mut self, system: &mut Delaying<'_>) -> &[f64] {
        self.rows.extended.clear();
        self.rows.extended.extend_from_slice(system.parameters());
        system.parameters_tangent(&mut self.rows.parameters);
        for block in self.rows.parameters.chunks_exact(self.width) {
            self.rows.extended.extend_from_slice(&block[..self.width - 1]);
        }
        &self.rows.extended
    }

    /// The start of a run, after `bind`.
    pub(crate) fn begin(&mut self, problem: &mut Problem<'_>, t: f64, tolerance: f64, nominals: &[f64]) {
        self.matrices.reset(nominals);
        self.at.dt.fill(0.0);
        self.at.s.fill(0.0);
        self.at.sp.fill(0.0);
        self.at.instant.fill(0.0);
        problem.system.derive(self.width);
        let parameters = problem.system.parameters();
        self.steps.begin(tolerance, |unknown, direction| {
            let value = match self.directions[direction] {
                Direction::Parameter(k) => parameters[k as usize].abs(),
                Direction::Start(..) | Direction::None => nominals[unknown],
            };
            LEAST * nominals[unknown] / if value > 0.0 { value } else { 1.0 }
        });
        problem.system.bind_tangent(t);
    }

    /// Derivatives of the solution `z` of the initial system and of what it stores.
    pub(crate) fn initial(
        &mut self,
        problem: &mut Problem<'_>,
        t: f64,
        z: &[f64],
        y: &[f64],
        yp: &[f64],
    ) -> Result<(), SolveError> {
        if !z.is_empty() {
            problem.system.initial_residual_tangent(t, z, &mut self.solution.z);
            let solved = self.matrices.solve_initial(problem, t, z, &mut self.solution.z, self.width);
            solved.map_err(|error| match error {
                FactorError::Singular { row, column } | FactorError::NotFinite { row, column } => {
                    let cause = NewtonFailure::Singular { row, column };
                    SolveError::initial(t, cause, (Some(row), Some(column)), z, problem)
                }
            })?;
            self.solution.z.iter_mut().for_each(|value| *value = -*value);
        }
        problem.system.initial_store_tangent(t, z, &self.solution.z, &mut self.at.s, &mut self.at.sp);
        self.consistent(problem, (Stage::Start, t), y, yp)
    }

    /// Derivatives of algebraic unknowns and of rates from those of differential unknowns and of time.
    pub(crate) fn consistent(
        &mut self,
        problem: &mut Problem<'_>,
        (stage, t): (Stage, f64),
        y: &[f64],
        yp: &[f64],
    ) -> Result<(), SolveError> {
        let width = self.width;
        problem.system.states(&mut self.differential);
        self.at.sp.fill(0.0);
        for (block, _) in self.at.s.chunks_exact_mut(width).zip(&self.differential).filter(|(_, d)| !**d) {
            block.fill(0.0);
        }
        let along = self.at.along();
        problem.system.residual_tangent(t, y, yp, along, &mut self.solution.rhs);
        let factored = self.matrices.factor_consistent(problem, t, (y, yp), &self.differential);
        factored.map_err(|error| singular((stage, t), error, (y, yp), problem))?;
        self.matrices.solve(&mut self.solution.rhs, width);
        let blocks = self.at.s.chunks_exact_mut(width).zip(self.at.sp.chunks_exact_mut(width));
        for ((block, &differential), solution) in
            blocks.zip(&self.differential).zip(self.solution.rhs.chunks_exact(width))
        {
            let target = if differential { block.1 } else { block.0 };
            for (value, x) in target.iter_mut().zip(solution) {
                *value = -x;
            }
        }
        Ok(())
    }

    /// Forgets the past: the current derivatives are those at the point.
    pub(crate) fn restart(&mut self, problem: &mut Problem<'_>, t: f64, y: &[f64], yp: &[f64]) {
        let along = self.at.along();
        problem.system.begin_derived(t, (y, yp), along, &self.at.instant);
        self.breaks.restart(problem, t, y, yp);
        self.steps.restart(t, &self.at.s, &self.at.sp, self.width);
        self.trail.restart(t, y, yp);
    }

    /// Takes an accepted point of the solution, and steps as far as is worth while.
    pub(crate) fn follow(
        &mut self,
        problem: &mut Problem<'_>,
        t: f64,
        (y, yp): (&[f64], &[f64]),
    ) -> Result<(), SolveError> {
        self.trail.push(t, y, yp, &self.differential);
        self.breaks.look(problem, &mut self.matrices, &self.trail, (t, y, yp));
        while self.trail.is_full() || self.steps.fits(&self.trail, &self.breaks, problem.system.shortest_delay()) {
            self.step(problem)?;
        }
        Ok(())
    }

    /// Steps to the newest point of the solution; all rows get their derivatives.
    pub(crate) fn reach(&mut self, problem: &mut Problem<'_>) -> Result<(), SolveError> {
        while self.steps.newest() < self.trail.end() {
            self.step(problem)?;
        }
        self.serve(f64::INFINITY);
        Ok(())
    }

    /// One step along the trail.
    fn step(&mut self, problem: &mut Problem<'_>) -> Result<(), SolveError> {
        let along = (&mut self.trail, &mut self.breaks);
        self.steps.cross(problem, &mut self.matrices, along, &self.differential);
        let along = (&mut self.trail, &mut self.breaks);
        let done = self.steps.step(problem, &mut self.matrices, along, &self.differential);
        if let Err((t, error)) = done {
            let n = self.differential.len();
            let (mut y, mut yp) = (vec![0.0; n], vec![0.0; n]);
            self.trail.values(t, &mut y, &mut yp);
            return Err(singular((Stage::Step, t), error, (&y, &yp), problem));
        }
        self.record(problem)?;
        self.trail.drop_before(self.steps.newest());
        self.serve(self.steps.newest());
        Ok(())
    }

    /// Records what delays ask for later: the derivatives of their sources over the last step.
    fn record(&mut self, problem: &mut Problem<'_>) -> Result<(), SolveError> {
        let (from, to) = (self.steps.before(), self.steps.newest());
        if !problem.system.has_delays() || to <= from {
            return Ok(());
        }
        let mut point = std::mem::take(&mut self.point);
        let sampled = self.sample(problem, (from, to), (&mut point.0, &mut point.1));
        self.point = point;
        sampled?;
        let keep = self.waiting.oldest().map_or(from, |row| row.min(from));
        problem.system.record_derived((from, to), keep);
        Ok(())
    }

    /// Hands the derivatives at the nodes of a step over to the past.
    fn sample(
        &mut self,
        problem: &mut Problem<'_>,
        (from, to): (f64, f64),
        (y, yp): (&mut [f64], &mut [f64]),
    ) -> Result<(), SolveError> {
        let known = usize::from(problem.system.continues_derived(from));
        for node in known..=4 {
            let t = if node == 4 { to } else { from + (to - from) * node as f64 / 4.0 };
            self.trail.values(t, y, yp);
            self.at.s.fill(0.0);
            self.at.sp.fill(0.0);
            self.steps.at(t, &self.differential, (&mut self.at.s, &mut self.at.sp), self.width);
            // Interpolated algebraic unknowns amplify what is rough in the past that they follow, pass after pass.
            self.consistent(problem, (Stage::Step, t), y, yp)?;
            let along = self.at.along();
            problem.system.sample_derived(node, t, (y, yp), along);
        }
        Ok(())
    }

    /// Gives the rows up to `t` (s) their derivatives.
    fn serve(&mut self, t: f64) {
        while let Some(row) = self.waiting.next_up_to(t) {
            let at = row.t.min(self.steps.newest());
            self.steps.at(at, &self.differential, (&mut row.s, &mut row.sp), self.width);
        }
    }

    /// Lets a row wait for its derivatives.
    pub(crate) fn wait(&mut self, t: f64, (y, yp): (&[f64], &[f64])) {
        self.waiting.push(t, y, yp, self.at.s.len());
        self.serve(self.steps.newest());
    }

    /// The next row that has its derivatives, which become the current ones.
    pub(crate) fn next_row(&mut self) -> Option<WaitingRow> {
        let row = self.waiting.take()?;
        self.at.s.copy_from_slice(&row.s);
        self.at.sp.copy_from_slice(&row.sp);
        Some(row)
    }

    /// Takes the memory of such a row back.
    pub(crate) fn give_back(&mut self, row: WaitingRow) {
        self.waiting.give_back(row);
    }

    /// Derivatives of the outputs at the current point, parameter by parameter, into `out`.
    pub(crate) fn outputs(&mut self, problem: &mut Problem<'_>, t: f64, (y, yp): (&[f64], &[f64]), out: &mut [f64]) {
        let along = self.at.along();
        problem.system.outputs_tangent(t, y, yp, along, &mut self.rows.row);
        let (row, width) = (&self.rows.row, self.width);
        let mut write = |k: usize| {
            let (target, block) = (k * (width - 1)..(k + 1) * (width - 1), k * width..(k + 1) * width - 1);
            out[target].copy_from_slice(&row[block]);
        };
        match &self.rows.wanted {
            Some(wanted) => wanted.iter().for_each(|&k| write(k as usize)),
            None => (0..self.outputs).for_each(write),
        }
    }
}

/// The matrix of the sensitivities has no solution: the same trouble as with the values, in the same words.
fn singular(
    (stage, time): (Stage, f64),
    error: FactorError,
    values: (&[f64], &[f64]),
    problem: &mut Problem<'_>,
) -> SolveError {
    if let FactorError::NotFinite { .. } = error
        && let Some(failure) = problem.system.diagnose(time, values.0, values.1)
    {
        return SolveError::evaluation(stage, time, failure, problem);
    }
    let (cause, row, column) = match error {
        FactorError::Singular { row, column } => (NewtonFailure::Singular { row, column }, row, column),
        FactorError::NotFinite { row, column } => (NewtonFailure::SlopeNotFinite { row, column }, row, column),
    };
    SolveError::inconsistent(
        stage,
        time,
        Inconsistent { cause, row: Some(row), unknown: Some(column) },
        values,
        problem,
    )
}

fn refusal(name: &str, reason: &str) -> OptionError {
    OptionError::Sensitivity { name: name.to_string(), reason: reason.to_string() }
}

/// What a name stands for: a parameter, or the start value of a variable.
fn direction(tables: &Tables, name: &str) -> Result<Direction, OptionError> {
    let unknown = || refusal(name, "there is no parameter or variable of this name");
    let found = tables.variables.iter().enumerate().find_map(|(k, variable)| {
        let first = variable.name.parts.first().map_or("", |part| part.0.as_ref());
        let maybe = !variable.name.derivative && name.starts_with(first);
        let element = if maybe { (0..variable.name.count()).find(|&e| variable.name.element(e) == name) } else { None };
        element.map(|element| (k, element))
    });
    let (k, element) = found.ok_or_else(unknown)?;
    let variable = &tables.variables[k];
    if variable.settable == Settable::Structural {
        return Err(refusal(name, "it decides sizes or structure, so nothing depends on it smoothly"));
    }
    if variable.kind != hyd_system::ValueKind::Real {
        return Err(refusal(name, "it is not a real number"));
    }
    match variable.sources.get(element).ok_or_else(unknown)?.place {
        Place::Parameter(index) => Ok(Direction::Parameter(index)),
        Place::Output(_) => Ok(Direction::Start(k as u32, element as u32)),
        Place::Constant(_) => Err(refusal(name, "it is a constant")),
    }
}
