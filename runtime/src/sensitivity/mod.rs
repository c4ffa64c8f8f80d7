//! Forward sensitivities: derivatives of the solution with respect to parameters and start values.
//!
//! Staggered direct method (Feehery, Tolsma, Barton, Appl. Numer. Math. 25 (1997) 41): along the accepted points of the
//! solution the linear systems `(F_y + a_0 F_y') s = -(F_y' w + F_p)` are solved with a new matrix each, with the derivative
//! formula of [`past`].  Initial values come from the linearised initial system, and events shift with the
//! parameters ([`event`]).  Steps are the sensitivities' own ([`mesh`]): the solution is the same with and without them,
//! whatever method computes it.
//!
//! All vectors hold blocks of `width` derivatives per unknown: one per parameter, and one last for the derivative with
//! respect to time, which serves at events.

mod event;
mod linear;
mod mesh;
mod past;
pub(crate) mod tables;

use std::sync::Arc;

use hyd_system::{Along, DaeSystem, Direction, DirectionError, Place, Settable, Structure, Tables, Tangents};

use crate::OptionError;
use crate::error::{SolveError, Stage};
use crate::initial::consistent::Inconsistent;
use crate::linear::FactorError;
use crate::newton::NewtonFailure;
use crate::problem::Problem;
use linear::Matrices;
use mesh::{Control, Trail};
use past::{MAX_ORDER, Past};
use tables::ExtendedTables;

pub(crate) use event::EventSource;

/// Derivatives below this part of `nominal / parameter` count as zero in the error test.
const LEAST: f64 = 1e-3;

/// Smallest step, relative to the time.
const SMALLEST: f64 = 1e3 * f64::EPSILON;

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
    past: Past,
    trail: Trail,
    control: Control,
    tolerance: f64,
    most_order: usize,
    /// Largest derivatives so far, and the least that counts.
    largest: Vec<f64>,
    /// Rates at the newest point.
    rates: Vec<f64>,
    y: Vec<f64>,
    yp: Vec<f64>,
    /// Derivatives of y and y' at the current point.
    s: Vec<f64>,
    sp: Vec<f64>,
    /// Derivatives of the current time: those of an instant while an event is settled, else 0.
    dt: Vec<f64>,
    base: Vec<f64>,
    rhs: Vec<f64>,
    z: Vec<f64>,
    roots: Vec<f64>,
    y_before: Vec<f64>,
    row: Vec<f64>,
    parameters: Vec<f64>,
    /// A derivative of a discrete variable changed in the event.
    pub(crate) changed: bool,
}

impl Sensitivity {
    /// Prepares for the named parameters or start values; reuses `old` where it fits.
    ///
    /// # Errors
    /// Which name cannot be varied, and why.
    pub(crate) fn prepare(
        old: Option<Box<Sensitivity>>,
        system: &mut dyn DaeSystem,
        names: &[String],
    ) -> Result<Box<Sensitivity>, OptionError> {
        if !system.structure().delays.is_empty() {
            return Err(refusal(
                &names[0],
                "the model reads values of the past (delay), through which no derivatives go",
            ));
        }
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
            past: Past::new(n * width),
            trail: Trail::new(n),
            control: Control::new(),
            tolerance: 1e-6,
            most_order: MAX_ORDER,
            largest: block(),
            rates: block(),
            y: vec![0.0; n],
            yp: vec![0.0; n],
            s: block(),
            sp: block(),
            dt: vec![0.0; width],
            base: block(),
            rhs: block(),
            z: vec![0.0; structure.initial.unknowns * width],
            roots: vec![0.0; structure.roots * width],
            y_before: vec![0.0; n],
            row: vec![0.0; structure.outputs * width],
            parameters: vec![0.0; parameters * width],
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
    pub(crate) fn parameters(&mut self, system: &mut dyn DaeSystem) -> Vec<f64> {
        let mut values = system.parameters().to_vec();
        tangents(system).parameters_tangent(&mut self.parameters);
        for block in self.parameters.chunks_exact(self.width) {
            values.extend_from_slice(&block[..self.width - 1]);
        }
        values
    }

    /// The start of a run, after `bind`.
    pub(crate) fn begin(&mut self, problem: &mut Problem<'_>, t: f64, tolerance: f64, nominals: &[f64]) {
        self.matrices.reset(nominals);
        self.dt.fill(0.0);
        self.s.fill(0.0);
        self.sp.fill(0.0);
        self.tolerance = tolerance;
        for (block, nominal) in self.largest.chunks_exact_mut(self.width).zip(nominals) {
            for (largest, &direction) in block.iter_mut().zip(&self.directions) {
                let value = match direction {
                    Direction::Parameter(k) => problem.system.parameters()[k as usize].abs(),
                    Direction::Start(..) | Direction::None => *nominal,
                };
                *largest = LEAST * nominal / if value > 0.0 { value } else { 1.0 };
            }
        }
        tangents(&mut problem.system).bind_tangent(t);
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
            tangents(&mut problem.system).initial_residual_tangent(t, z, &mut self.z);
            let solved = self.matrices.solve_initial(problem, t, z, &mut self.z, self.width);
            solved.map_err(|error| match error {
                FactorError::Singular { row, column } | FactorError::NotFinite { row, column } => {
                    let cause = NewtonFailure::Singular { row, column };
                    SolveError::initial(t, cause, (Some(row), Some(column)), z, problem)
                }
            })?;
            self.z.iter_mut().for_each(|value| *value = -*value);
        }
        tangents(&mut problem.system).initial_store_tangent(t, z, &self.z, &mut self.s, &mut self.sp);
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
        self.sp.fill(0.0);
        for (block, _) in self.s.chunks_exact_mut(width).zip(&self.differential).filter(|(_, d)| !**d) {
            block.fill(0.0);
        }
        let along = Along { t: &self.dt, y: &self.s, yp: &self.sp };
        tangents(&mut problem.system).residual_tangent(t, y, yp, along, &mut self.rhs);
        let factored = self.matrices.factor_consistent(problem, t, (y, yp), &self.differential);
        factored.map_err(|error| singular((stage, t), error, (y, yp), problem))?;
        self.matrices.solve(&mut self.rhs, width);
        let blocks = self.s.chunks_exact_mut(width).zip(self.sp.chunks_exact_mut(width));
        for ((block, &differential), solution) in blocks.zip(&self.differential).zip(self.rhs.chunks_exact(width)) {
            let target = if differential { block.1 } else { block.0 };
            for (value, x) in target.iter_mut().zip(solution) {
                *value = -x;
            }
        }
        Ok(())
    }

    /// Forgets the past: the current derivatives are those at the point.
    pub(crate) fn restart(&mut self, t: f64, y: &[f64], yp: &[f64]) {
        self.past.restart(t, &self.s);
        self.rates.copy_from_slice(&self.sp);
        self.trail.restart(t, y, yp);
        self.control = Control::new();
        self.measure();
    }

    /// Takes an accepted point of the solution, reached with a formula of this order, and steps as far as is worth while.
    pub(crate) fn follow(
        &mut self,
        problem: &mut Problem<'_>,
        t: f64,
        (y, yp): (&[f64], &[f64]),
        order: usize,
    ) -> Result<(), SolveError> {
        self.most_order = order.clamp(2, MAX_ORDER);
        self.trail.push(t, y, yp);
        while self.trail.is_full() || self.past.newest() + self.control.h <= t {
            self.step(problem)?;
        }
        Ok(())
    }

    /// Steps until `t` (s) is not beyond the newest point, so that it can be interpolated.
    pub(crate) fn reach(&mut self, problem: &mut Problem<'_>, t: f64) -> Result<(), SolveError> {
        while self.past.newest() < t.min(self.trail.end()) {
            self.step(problem)?;
        }
        Ok(())
    }

    /// One step of the sensitivities along the trail.
    fn step(&mut self, problem: &mut Problem<'_>) -> Result<(), SolveError> {
        let from = self.past.newest();
        let smallest = SMALLEST * from.abs().max(self.trail.end().abs());
        let (mut y, mut yp) = (std::mem::take(&mut self.y), std::mem::take(&mut self.yp));
        let result = loop {
            let order = self.control.order.min(self.past.count()).max(1);
            self.control.order = order;
            let t = self.trail.target(from, self.control.h.max(smallest).min(self.trail.end() - from));
            if t - from <= 2.0 * smallest {
                self.control.insist();
            }
            self.trail.values(t, &mut y, &mut yp);
            let weights = self.past.derivative_weights(t, order);
            self.past.combine(&weights, order, &mut self.base);
            // Between two points a slope may have no finite value where the points themselves have one.
            let solved = self.stage(problem, t, (&y, &yp), weights[0]);
            problem.statistics.sensitivity_steps += 1;
            let errors = match solved {
                Ok(()) => [order.wrapping_sub(1), order, order + 1].map(|order| self.error(t, order)),
                Err(_) => [None, Some(f64::INFINITY), None],
            };
            if self.control.judge(t - from, errors, self.most_order) {
                if let Err(error) = solved {
                    break Err(error);
                }
                self.past.push(t, order, &self.s);
                self.rates.copy_from_slice(&self.sp);
                self.trail.drop_before(t);
                self.measure();
                break Ok(());
            }
            if self.control.order == 1 {
                self.past.forget();
            }
        };
        (self.y, self.yp) = (y, yp);
        result
    }

    /// Keeps the largest derivatives.
    fn measure(&mut self) {
        for (largest, s) in self.largest.iter_mut().zip(&self.s) {
            *largest = largest.max(s.abs());
        }
    }

    /// Error of the current values at an order, in tolerances; none where there is no past to tell.
    fn error(&mut self, t: f64, order: usize) -> Option<f64> {
        let factor = if order == 0 || order > MAX_ORDER {
            return None;
        } else if order == 1 && self.past.count() == 1 {
            let h = t - self.past.newest();
            for ((value, last), rate) in self.rhs.iter_mut().zip(self.past.last()).zip(&self.rates) {
                *value = last + h * rate;
            }
            0.5
        } else {
            self.past.predict(t, order, &mut self.rhs)?
        };
        let mut worst = 0.0f64;
        for direction in 0..self.width - 1 {
            let mut sum = 0.0;
            for (k, _) in self.differential.iter().enumerate().filter(|(_, differential)| **differential) {
                let at = k * self.width + direction;
                sum += ((self.s[at] - self.rhs[at]) / self.largest[at].max(self.s[at].abs())).powi(2);
            }
            worst = worst.max(sum);
        }
        let count = self.differential.iter().filter(|differential| **differential).count().max(1);
        Some(factor * (worst / count as f64).sqrt() / self.tolerance)
    }

    /// One implicit stage at `(t, y, y')` where `s' = c s + w`, with `w` in `base`: solves for `s` and `s'`.
    fn stage(
        &mut self,
        problem: &mut Problem<'_>,
        t: f64,
        (y, yp): (&[f64], &[f64]),
        c: f64,
    ) -> Result<(), SolveError> {
        // The last value as prediction: what is solved for is its change.
        self.s.copy_from_slice(self.past.last());
        for ((rate, s), base) in self.sp.iter_mut().zip(&self.s).zip(&self.base) {
            *rate = c * s + base;
        }
        let along = Along { t: &self.dt, y: &self.s, yp: &self.sp };
        tangents(&mut problem.system).residual_tangent(t, y, yp, along, &mut self.rhs);
        let factored = self.matrices.factor_step(problem, (t, c), y, yp);
        factored.map_err(|error| singular((Stage::Step, t), error, (y, yp), problem))?;
        self.matrices.solve(&mut self.rhs, self.width);
        for ((s, rate), change) in self.s.iter_mut().zip(&mut self.sp).zip(&self.rhs) {
            *s -= change;
            *rate -= c * change;
        }
        Ok(())
    }

    /// Brings the current derivatives to a time within the last step, for an output or an event there.
    pub(crate) fn interpolate(&mut self, t: f64) {
        self.past.interpolate(t, &mut self.s, &mut self.sp);
        if t == self.past.newest() {
            self.s.copy_from_slice(self.past.last());
        }
    }

    /// Derivatives of the outputs at the current point, parameter by parameter, into `out`.
    pub(crate) fn outputs(&mut self, problem: &mut Problem<'_>, t: f64, (y, yp): (&[f64], &[f64]), out: &mut [f64]) {
        let along = Along { t: &self.dt, y: &self.s, yp: &self.sp };
        tangents(&mut problem.system).outputs_tangent(t, y, yp, along, &mut self.row);
        for (target, block) in out.chunks_exact_mut(self.width - 1).zip(self.row.chunks_exact(self.width)) {
            target.copy_from_slice(&block[..self.width - 1]);
        }
    }
}

fn tangents(system: &mut dyn DaeSystem) -> &mut dyn Tangents {
    system.tangents().expect("invariant: a system with tangents keeps them")
}

/// The matrix of the sensitivities has no solution: the same trouble as with the values, in the same words.
fn singular(
    (stage, time): (Stage, f64),
    error: FactorError,
    values: (&[f64], &[f64]),
    problem: &mut Problem<'_>,
) -> SolveError {
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
        return Err(refusal(name, "it is no real number"));
    }
    match variable.sources.get(element).ok_or_else(unknown)?.place {
        Place::Parameter(index) => Ok(Direction::Parameter(index)),
        Place::Output(_) => Ok(Direction::Start(k as u32, element as u32)),
        Place::Constant(_) => Err(refusal(name, "it is a constant")),
    }
}
