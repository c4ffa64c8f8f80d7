//! Consistent values: rates of differential and values of algebraic unknowns from given differential values.
//!
//! With `y_d` fixed, `F(t, (y_d, y_a), y'_d) = 0` is solved for `x = (y'_d, y_a)`: at the start, after events, and at
//! output points, so that constraints hold wherever a value is shown.  Source: Brown, Hindmarsh, Petzold, SIAM J. Sci. Comput.
//! 19 (1998) 1495.  Column `j` of the matrix is that of dF/dy' for a differential and of dF/dy for an algebraic unknown;
//! it is regular for systems of index 1 whose differential equations determine the rates.  Two ways:
//! [`Consistency::solve`] from afar by the damped method, [`Consistency::refine`] from close by with an old matrix.

use hyd_system::math::square;
use hyd_system::{DaeSystem, StateChoice, Structure};

use crate::corrector::damped::{Newton, NewtonFailure, Target};
use crate::corrector::kinks::pass_pieces;
use crate::corrector::relaxed::lead_back;
use crate::fold;
use crate::linear::{FactorError, IterationMatrix};
use crate::problem::Problem;
use crate::weights::{Weights, largest};

/// Accepted size of a correction of the damped method, relative to values and nominals.
const TOLERANCE: f64 = 1e-10;
/// Accepted error of a refinement, as a part of the integration tolerance.
const REFINED: f64 = 0.01;
/// Accepted relative error of algebraic unknowns in a row of results, whatever the tolerance.
const PROJECTED: f64 = 1e-12;
/// A refinement that converges slower than this needs a new matrix.
const SLOWEST: f64 = 0.9;
/// Most iterations of a refinement with one matrix.
const MOST_REFINEMENTS: usize = 3;
/// Convergence is not taken to be faster than this.
const LEAST_RATE: f64 = 0.05;
const MOST_PROJECTIONS: usize = 8;
/// Most rounds until relations at given unknowns, and the discrete variables that depend on them, agree.
const MOST_SWITCHINGS: usize = 8;

/// Why no consistent values were found.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Inconsistent {
    pub(crate) cause: NewtonFailure,
    /// Residual row at fault, if known.
    pub(crate) row: Option<usize>,
    /// Unknown at fault, if known.
    pub(crate) unknown: Option<usize>,
}

/// Matrix, factors and vectors.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Consistency {
    core: Core,
    newton: Newton,
    residual: Vec<f64>,
    have_matrix: bool,
    /// Of an affine system each of whose rows has one of the values to be found: for each value its row and the inverse of its factor.
    /// Otherwise empty.
    direct: Vec<(u32, f64)>,
    /// There are such rows, and no value to be found is algebraic.
    only_rates: bool,
    /// As many zeros as there are unknowns.
    zeros: Vec<f64>,
}

#[derive(Clone, serde::Serialize, serde::Deserialize)]
struct Core {
    matrix: IterationMatrix,
    differential: Vec<bool>,
    /// Sizes of what is looked for.
    sizes: Vec<f64>,
    y: Vec<f64>,
    yp: Vec<f64>,
}

impl Core {
    fn factor(&mut self, problem: &mut Problem<'_>, t: f64) -> Result<(), FactorError> {
        let (state, rate) = self.matrix.parts();
        problem.jacobian(t, &self.y, &self.yp, state, rate);
        problem.statistics.factorisations += 1;
        self.matrix.factor_consistent(&self.differential)
    }

    /// The same for corrections of values that are nearly consistent, of equations that may depend on each other; false if there are none.
    fn factor_for_corrections(&mut self, problem: &mut Problem<'_>, t: f64) -> bool {
        match self.factor(problem, t) {
            Ok(()) => true,
            Err(FactorError::Singular { .. }) => self.factor_deficient(problem),
            Err(FactorError::NotFinite { .. }) => false,
        }
    }

    fn factor_deficient(&mut self, problem: &Problem<'_>) -> bool {
        self.matrix.factor_consistent_deficient(&self.differential, &self.sizes, problem.open.ranks())
    }

    /// Rates are looked for as exactly as a step `h` (s) needs them.
    fn size_by(&mut self, h: f64, weights: &Weights) {
        let own = self.sizes.iter_mut().zip(&self.differential).zip(weights.nominals.iter());
        own.for_each(|((size, &differential), nominal)| {
            *size = if differential && h > 0.0 { nominal / h } else { *nominal }
        });
    }

    /// The unknowns of the matrix at the current values.
    #[cold]
    fn gathered(&self) -> Vec<f64> {
        let rates = self.yp.iter().zip(&self.differential);
        self.y
            .iter()
            .zip(rates)
            .map(|(&value, (&rate, &differential))| if differential { rate } else { value })
            .collect()
    }

    /// The unknowns of the problem from `x`.
    fn scatter(&mut self, x: &[f64]) {
        for (k, &value) in x.iter().enumerate() {
            if self.differential[k] {
                self.yp[k] = value;
            } else {
                self.y[k] = value;
            }
        }
    }
}

struct View<'a, 'b> {
    core: &'a mut Core,
    problem: &'a mut Problem<'b>,
    t: f64,
    /// Relations and discrete variables follow the unknowns.
    switching: bool,
}

impl View<'_, '_> {
    /// False if relations and what they decide on do not come to rest.
    fn switch(&mut self) -> bool {
        let (t, core) = (self.t, &self.core);
        !self.switching || (0..MOST_SWITCHINGS).any(|_| !self.problem.system.switch(t, &core.y, &core.yp))
    }
}

impl Target for View<'_, '_> {
    fn residual(&mut self, x: &[f64], out: &mut [f64]) -> bool {
        self.core.scatter(x);
        self.switch() && self.problem.residual(self.t, &self.core.y, &self.core.yp, out)
    }

    fn factor(&mut self, x: &[f64]) -> Result<(), FactorError> {
        self.core.scatter(x);
        self.switch();
        self.core.factor(self.problem, self.t)
    }

    fn factor_deficient(&mut self, _: &[f64]) -> bool {
        self.core.factor_deficient(self.problem)
    }

    fn solve(&mut self, b: &mut [f64]) {
        self.core.matrix.solve(b);
    }

    fn contradicts(&self, x: &[f64], part: f64) -> bool {
        self.core.matrix.contradicts(x, part)
    }
}

impl Consistency {
    /// Work space for systems of this structure.
    pub(crate) fn new(structure: &Structure) -> Self {
        let n = structure.unknowns;
        let core = Core {
            matrix: IterationMatrix::new(structure),
            differential: structure.differential.clone(),
            sizes: vec![1.0; n],
            y: vec![0.0; n],
            yp: vec![0.0; n],
        };
        Self {
            core,
            newton: Newton::new(n),
            residual: vec![0.0; n],
            have_matrix: false,
            direct: Vec::new(),
            only_rates: false,
            zeros: vec![0.0; n],
        }
    }

    /// Sets the sizes of the unknowns and drops the matrix.
    pub(crate) fn reset(&mut self, nominals: &[f64]) {
        self.core.matrix.begin(nominals);
        self.have_matrix = false;
    }

    /// Judges the choice of states at consistent values; true if it was changed.
    pub(crate) fn choose_states(&mut self, problem: &mut Problem<'_>, t: f64, y: &[f64], yp: &[f64]) -> StateChoice {
        let judged = problem.system.choose_states(t, y, yp);
        if judged.changed {
            self.read_states(problem);
        }
        judged
    }

    /// Takes over which unknowns are states.
    pub(crate) fn read_states(&mut self, problem: &mut Problem<'_>) {
        problem.system.states(&mut self.core.differential);
        self.have_matrix = false;
    }

    /// Behind the last solution: notes what its equations leave open, and finds which of these unknowns are moved before others
    /// ([`crate::undetermined`]).
    pub(crate) fn rank_open(&self, problem: &mut Problem<'_>, t: f64, weights: &Weights, y: &[f64], yp: &[f64]) {
        if !self.core.matrix.is_deficient() {
            return problem.open.set_ranks(Vec::new());
        }
        problem.note_open(t, Some(&self.core.differential), self.core.matrix.undetermined());
        let algebraic = self.core.matrix.undetermined().filter(|&k| !self.core.differential[k]);
        let open: Vec<usize> = algebraic.collect();
        let mut moved = y.to_vec();
        let ranks = problem.watched(&open, &weights.nominals, y, |problem, k, value, roots| {
            moved[k] = value;
            problem.system.roots(t, &moved, yp, roots);
            moved[k] = y[k];
        });
        problem.open.set_ranks(ranks);
    }

    /// Which unknowns are states.
    pub(crate) fn states(&self) -> &[bool] {
        &self.core.differential
    }

    /// Solves from far away.  `time_scale` (s): a rate counts as small below `nominal / time_scale`.  On success the
    /// algebraic part of `y` and the differential part of `yp` are replaced; on failure neither changes.
    pub(crate) fn solve(
        &mut self,
        problem: &mut Problem<'_>,
        (t, time_scale): (f64, f64),
        weights: &Weights,
        y: &mut [f64],
        yp: &mut [f64],
    ) -> Result<(), Inconsistent> {
        self.search(problem, (t, time_scale), weights, (y, yp), false)
    }

    /// The same for unknowns, relations and discrete variables together, `pre` as it is: a piecewise system, solved with the branch that
    /// holds at each point tried.  On failure relations and discrete variables are those of the last one.
    pub(crate) fn solve_switching(
        &mut self,
        problem: &mut Problem<'_>,
        (t, time_scale): (f64, f64),
        weights: &Weights,
        y: &mut [f64],
        yp: &mut [f64],
    ) -> Result<(), Inconsistent> {
        self.search(problem, (t, time_scale), weights, (y, yp), true)
    }

    fn search(
        &mut self,
        problem: &mut Problem<'_>,
        (t, time_scale): (f64, f64),
        weights: &Weights,
        (y, yp): (&mut [f64], &mut [f64]),
        switching: bool,
    ) -> Result<(), Inconsistent> {
        self.have_matrix = false;
        self.load(time_scale, weights, y, yp);
        let mut view = View { core: &mut self.core, problem, t, switching };
        let mut found = self.newton.solve(&mut view, TOLERANCE);
        if let Err(NewtonFailure::NoConvergence { .. }) = found
            && switching
        {
            self.load(time_scale, weights, y, yp);
            let mut view = View { core: &mut self.core, problem, t, switching };
            if pass_pieces(&mut self.newton, &mut view, TOLERANCE) {
                found = self.newton.solve(&mut view, TOLERANCE);
            }
        } else if let Err(NewtonFailure::NoConvergence { .. }) = found {
            let failed = self.newton.clone();
            self.load(time_scale, weights, y, yp);
            let first = self.newton.x.clone();
            let mut view = View { core: &mut self.core, problem, t, switching };
            if lead_back(&mut self.newton, &mut view, &first, TOLERANCE) {
                found = Ok(());
            } else {
                self.core.scatter(&failed.x);
                self.newton = failed;
            }
        }
        match found {
            Ok(()) => {
                self.core.scatter(&self.newton.x);
                self.have_matrix = true;
                y.copy_from_slice(&self.core.y);
                yp.copy_from_slice(&self.core.yp);
                Ok(())
            }
            Err(cause) => Err(self.blame(cause)),
        }
    }

    /// Where the solution has just vanished: leads from the last values to another one of the same equations, as [`solve`] does on
    /// success; false if there is none on the way.
    ///
    /// [`solve`]: Consistency::solve
    pub(crate) fn cross(
        &mut self,
        problem: &mut Problem<'_>,
        (t, time_scale): (f64, f64),
        weights: &Weights,
        y: &mut [f64],
        yp: &mut [f64],
    ) -> bool {
        self.have_matrix = false;
        self.load(time_scale, weights, y, yp);
        let mut x = self.newton.x.clone();
        let mut view = View { core: &mut self.core, problem, t, switching: false };
        if !fold::follow(&mut view, &mut x, &self.newton.nominals) {
            return false;
        }
        self.newton.x.copy_from_slice(&x);
        if self.newton.solve(&mut view, TOLERANCE).is_err() {
            return false;
        }
        self.core.scatter(&self.newton.x);
        y.copy_from_slice(&self.core.y);
        yp.copy_from_slice(&self.core.yp);
        true
    }

    /// The values from which a search starts, and their sizes.
    fn load(&mut self, time_scale: f64, weights: &Weights, y: &[f64], yp: &[f64]) {
        self.core.y.copy_from_slice(y);
        self.core.yp.copy_from_slice(yp);
        for k in 0..y.len() {
            let differential = self.core.differential[k];
            self.newton.x[k] = if differential { yp[k] } else { y[k] };
            let nominal = weights.nominals[k];
            self.newton.nominals[k] = if differential { nominal / time_scale } else { nominal };
        }
        self.core.sizes.copy_from_slice(&self.newton.nominals);
    }

    /// Improves nearly consistent values with an old matrix where possible; false if they could not be improved, in which
    /// case they are unchanged.  `h` (s): the rates are wanted with the accuracy that a step of this size needs.
    pub(crate) fn refine(
        &mut self,
        problem: &mut Problem<'_>,
        (t, h): (f64, f64),
        weights: &Weights,
        y: &mut [f64],
        yp: &mut [f64],
    ) -> bool {
        self.approach(problem, (t, h), weights, (REFINED, MOST_REFINEMENTS), y, yp)
    }

    /// As [`Consistency::refine`], but until constraints hold as well as numbers allow: for values that are shown.  Where no
    /// unknown is algebraic there are none, and this is a refinement.  Where one matrix does not lead there, the damped method may.
    pub(crate) fn project(
        &mut self,
        problem: &mut Problem<'_>,
        (t, h): (f64, f64),
        weights: &Weights,
        y: &mut [f64],
        yp: &mut [f64],
    ) -> bool {
        let limit = REFINED.min(PROJECTED / weights.tolerance());
        let constrained = self.core.differential.iter().any(|differential| !differential);
        (constrained && self.approach(problem, (t, h), weights, (limit, MOST_PROJECTIONS), y, yp))
            || self.refine(problem, (t, h), weights, y, yp)
            || (constrained && self.solve_nearby(problem, (t, h), weights, y, yp))
    }

    /// As [`Consistency::solve`], without the ways that lead further away.
    fn solve_nearby(
        &mut self,
        problem: &mut Problem<'_>,
        (t, h): (f64, f64),
        weights: &Weights,
        y: &mut [f64],
        yp: &mut [f64],
    ) -> bool {
        self.load(h, weights, y, yp);
        let mut view = View { core: &mut self.core, problem, t, switching: false };
        self.have_matrix = self.newton.solve(&mut view, TOLERANCE).is_ok();
        if self.have_matrix {
            self.core.scatter(&self.newton.x);
            y.copy_from_slice(&self.core.y);
            yp.copy_from_slice(&self.core.yp);
        }
        self.have_matrix
    }

    /// Takes the matrix at a point of which the values to be found are a smooth continuation; false if it has none.
    /// The same bits come of the same point, whatever was factored before.
    pub(crate) fn anchor(
        &mut self,
        problem: &mut Problem<'_>,
        weights: &Weights,
        (t, y, yp): (f64, &[f64], &[f64]),
    ) -> bool {
        self.core.matrix.begin(&weights.nominals);
        self.core.y.copy_from_slice(y);
        self.core.yp.copy_from_slice(yp);
        self.have_matrix = self.core.factor(problem, t).is_ok();
        self.have_matrix
    }

    /// What rates and algebraic unknowns change by when states change by those entries of `dy`, and each residual by that of `residual`
    /// beside: the implicit function theorem at the point of [`Consistency::anchor`].
    pub(crate) fn tangent(&mut self, residual: &[f64], dy: &mut [f64], dyp: &mut [f64]) {
        let core = &mut self.core;
        self.residual.iter_mut().zip(residual).for_each(|(own, given)| *own = -given);
        for (column, &along) in dy.iter().enumerate().filter(|(k, _)| core.differential[*k]) {
            for (row, slope) in core.matrix.state_column(column) {
                self.residual[row] -= slope * along;
            }
        }
        core.matrix.solve(&mut self.residual);
        for (k, &value) in self.residual.iter().enumerate() {
            *(if core.differential[k] { &mut dyp[k] } else { &mut dy[k] }) = value;
        }
    }

    /// As [`Consistency::anchor`], for [`Consistency::solve_affine`].
    pub(crate) fn anchor_affine(
        &mut self,
        problem: &mut Problem<'_>,
        weights: &Weights,
        at: (f64, &[f64], &[f64]),
    ) -> bool {
        self.direct.clear();
        self.only_rates = false;
        if !self.anchor(problem, weights, at) {
            return false;
        }
        let core = &self.core;
        let mut taken = vec![false; core.differential.len()];
        for (column, &differential) in core.differential.iter().enumerate() {
            let mut entries = core.matrix.consistent_column(column, differential).filter(|(_, factor)| *factor != 0.0);
            match (entries.next(), entries.next()) {
                (Some((row, factor)), None) if !taken[row] => {
                    taken[row] = true;
                    self.direct.push((row as u32, factor.recip()));
                }
                _ => {
                    self.direct.clear();
                    break;
                }
            }
        }
        self.only_rates = !self.direct.is_empty() && core.differential.iter().all(|&differential| differential);
        true
    }

    /// The values where the system is affine (see `exchange`) and the matrix is that since the last event: one evaluation.  Where each row has
    /// one of them it is made at zero, so that what an equation says explicitly comes without a rounding; elsewhere at `near`, unknowns and
    /// rates of a point from which the corrections are small.  False where they are not finite; `y` and `yp` have changed then, too.
    #[inline]
    pub(crate) fn solve_affine(
        &mut self,
        system: &mut dyn DaeSystem,
        t: f64,
        near: (&[f64], &[f64]),
        y: &mut [f64],
        yp: &mut [f64],
    ) -> bool {
        let core = &mut self.core;
        let mut sum = 0.0;
        if self.only_rates {
            system.residual(t, y, &self.zeros, &mut self.residual);
            for (rate, &(row, inverse)) in yp.iter_mut().zip(&self.direct) {
                *rate = 0.0 - self.residual[row as usize] * inverse;
                sum += 0.0 * *rate;
            }
            return sum == 0.0;
        }
        let is_direct = !self.direct.is_empty();
        for (k, &differential) in core.differential.iter().enumerate() {
            let (own, near) = if differential { (&mut yp[k], near.1[k]) } else { (&mut y[k], near.0[k]) };
            *own = if is_direct { 0.0 } else { near };
        }
        system.residual(t, y, yp, &mut self.residual);
        if !is_direct {
            core.matrix.solve(&mut self.residual);
        }
        for (k, &differential) in core.differential.iter().enumerate() {
            let d = match self.direct.get(k) {
                Some(&(row, inverse)) => self.residual[row as usize] * inverse,
                None => self.residual[k],
            };
            *(if differential { &mut yp[k] } else { &mut y[k] }) -= d;
            sum += 0.0 * d;
        }
        sum == 0.0
    }

    /// As [`Consistency::project`], but rates and algebraic unknowns alike as exact as numbers allow, or not at all.
    pub(crate) fn follow(
        &mut self,
        problem: &mut Problem<'_>,
        (t, h): (f64, f64),
        weights: &Weights,
        y: &mut [f64],
        yp: &mut [f64],
    ) -> bool {
        self.approach(problem, (t, h), weights, (PROJECTED / weights.tolerance(), MOST_PROJECTIONS), y, yp)
    }

    fn approach(
        &mut self,
        problem: &mut Problem<'_>,
        (t, h): (f64, f64),
        weights: &Weights,
        until: (f64, usize),
        y: &mut [f64],
        yp: &mut [f64],
    ) -> bool {
        for _ in 0..2 {
            self.core.y.copy_from_slice(y);
            self.core.yp.copy_from_slice(yp);
            let fresh = !self.have_matrix;
            if fresh {
                self.core.size_by(h, weights);
                self.have_matrix = self.core.factor_for_corrections(problem, t);
                if !self.have_matrix {
                    return false;
                }
            }
            if self.iterate(problem, (t, h), weights, until) {
                y.copy_from_slice(&self.core.y);
                yp.copy_from_slice(&self.core.yp);
                return true;
            }
            self.have_matrix = false;
            if fresh {
                break;
            }
        }
        false
    }

    fn iterate(
        &mut self,
        problem: &mut Problem<'_>,
        (t, h): (f64, f64),
        weights: &Weights,
        (limit, most): (f64, usize),
    ) -> bool {
        let core = &mut self.core;
        let mut last = f64::INFINITY;
        for iteration in 0..most {
            if !problem.residual(t, &core.y, &core.yp, &mut self.residual) {
                return false;
            }
            core.matrix.solve(&mut self.residual);
            if core.matrix.is_deficient() && core.matrix.contradicts(&core.gathered(), limit * weights.tolerance()) {
                return false;
            }
            let mut sum = 0.0;
            for (k, &d) in self.residual.iter().enumerate() {
                let scaled = if core.differential[k] {
                    core.yp[k] -= d;
                    d * h
                } else {
                    core.y[k] -= d;
                    d
                };
                sum += square(scaled * weights.all[k]);
            }
            let size = (sum / self.residual.len().max(1) as f64).sqrt();
            // The first ratio flatters an old matrix.
            let rate = if iteration == 0 { 0.5 } else { (size / last).max(LEAST_RATE) };
            if rate >= SLOWEST || !rate.is_finite() || !size.is_finite() {
                return false;
            }
            if size * rate / (1.0 - rate) <= limit {
                return true;
            }
            last = size;
        }
        false
    }

    fn blame(&self, cause: NewtonFailure) -> Inconsistent {
        match cause {
            NewtonFailure::Singular { row, column } | NewtonFailure::SlopeNotFinite { row, column } => {
                Inconsistent { cause, row: Some(row), unknown: Some(column) }
            }
            NewtonFailure::NotFinite => Inconsistent { cause, row: self.newton.not_finite_row(), unknown: None },
            NewtonFailure::NoConvergence { .. } => {
                let row = |k: usize| self.newton.residual[k] * self.core.matrix.row_scale(k);
                let size = |k: usize| self.newton.correction[k] / self.newton.nominals[k].max(self.newton.x[k].abs());
                let n = self.newton.x.len();
                Inconsistent { cause, row: largest((0..n).map(row)), unknown: largest((0..n).map(size)) }
            }
        }
    }

    /// Values where the last attempt stopped, for messages.
    pub(crate) fn last_attempt(&self) -> (&[f64], &[f64]) {
        (&self.core.y, &self.core.yp)
    }
}
