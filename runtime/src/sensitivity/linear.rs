//! Matrices of the linear systems behind sensitivities, and their solution for all directions.
//!
//! Three systems: the iteration matrix `dF/dy + c dF/dy'` of a step, the matrix of the consistency solve (columns of dF/dy'
//! for differential and of dF/dy for algebraic unknowns), and the Jacobian of the initial system.  All are evaluated and
//! factored at the point in question, because a linear system is solved once and has no iteration to make up for an old
//! matrix.

use hyd_system::{Pattern, Structure, wide};

use super::trail::Trail;
use crate::linear::{FactorError, LinearSolver, MergedPattern, subtract};
use crate::problem::Problem;
use crate::tiled::{LANES, Tile};

/// Change of an entry of a Jacobian that counts as a jump, as a part of it.
const JUMP: f64 = 1e-4;

/// A matrix with its factors and work space.
pub(super) struct Matrices {
    merged: MergedPattern,
    state_pattern: Pattern,
    rate_pattern: Pattern,
    solver: LinearSolver,
    state_values: Vec<f64>,
    rate_values: Vec<f64>,
    values: Vec<f64>,
    tiles: Vec<Tile>,
    y: Vec<f64>,
    yp: Vec<f64>,
    before: Vec<f64>,
    initial_solver: LinearSolver,
    initial_values: Vec<f64>,
    initial_column: Vec<f64>,
}

impl Matrices {
    /// Work space for systems of this structure.
    pub(super) fn new(structure: &Structure) -> Self {
        let merged = MergedPattern::new(&structure.state_pattern, &structure.rate_pattern);
        let initial = &structure.initial;
        Self {
            solver: LinearSolver::new(&merged.pattern),
            state_values: vec![0.0; structure.state_pattern.entries()],
            rate_values: vec![0.0; structure.rate_pattern.entries()],
            values: vec![0.0; merged.pattern.entries()],
            merged,
            state_pattern: structure.state_pattern.clone(),
            rate_pattern: structure.rate_pattern.clone(),
            tiles: Vec::new(),
            y: vec![0.0; structure.unknowns],
            yp: vec![0.0; structure.unknowns],
            before: Vec::new(),
            initial_solver: LinearSolver::new(&initial.pattern),
            initial_values: vec![0.0; initial.pattern.entries()],
            initial_column: vec![0.0; initial.unknowns],
        }
    }

    /// Sets the sizes of the unknowns, and forgets what was chosen for the matrices before.
    pub(super) fn reset(&mut self, nominals: &[f64]) {
        self.solver.begin(nominals);
    }

    /// Factors `dF/dy + c dF/dy'` at a point, and gives the tangent of F with the unknowns held.
    pub(super) fn factor_along(
        &mut self,
        problem: &mut Problem<'_>,
        (t, c): (f64, f64),
        (y, yp): (&[f64], &[f64]),
        forcing: &mut [f64],
    ) -> Result<(), FactorError> {
        let (state, rate) = (&mut self.state_values, &mut self.rate_values);
        problem.system.jacobian_tangent(t, y, yp, (state, rate), forcing);
        self.merged.combine(&self.state_values, &self.rate_values, c, &mut self.values);
        self.solver.factor(&mut self.values)
    }

    /// True if the Jacobians on both sides of a break differ by more than rounding and smooth change explain.
    pub(super) fn jump_between(&mut self, problem: &mut Problem<'_>, trail: &Trail, (a, b): (f64, f64)) -> bool {
        trail.values(a, &mut self.y, &mut self.yp);
        problem.system.jacobian(a, &self.y, &self.yp, &mut self.state_values, &mut self.rate_values);
        self.before.clear();
        self.before.extend_from_slice(&self.state_values);
        self.before.extend_from_slice(&self.rate_values);
        trail.values(b, &mut self.y, &mut self.yp);
        problem.system.jacobian(b, &self.y, &self.yp, &mut self.state_values, &mut self.rate_values);
        let after = self.state_values.iter().chain(&self.rate_values);
        self.before.iter().zip(after).any(|(a, b)| (a - b).abs() > JUMP * a.abs().max(b.abs()))
    }

    /// Factors the matrix of the consistency solve at a point, and gives the tangent of F with the unknowns held.
    pub(super) fn select_along(
        &mut self,
        problem: &mut Problem<'_>,
        t: f64,
        (y, yp): (&[f64], &[f64]),
        differential: &[bool],
        forcing: &mut [f64],
    ) -> Result<(), FactorError> {
        let (state, rate) = (&mut self.state_values, &mut self.rate_values);
        problem.system.jacobian_tangent(t, y, yp, (state, rate), forcing);
        let parts = (&self.state_pattern, &self.rate_pattern);
        self.merged.select(parts, &self.state_values, &self.rate_values, differential, &mut self.values);
        self.solver.factor(&mut self.values)
    }

    /// `column -= dF/dy s` over differential unknowns with the last matrix; all have `tiles` tiles per unknown.
    pub(super) fn subtract_state_product(&self, s: &[Tile], differential: &[bool], column: &mut [Tile], tiles: usize) {
        for (j, s) in s.chunks_exact(tiles).enumerate().filter(|(j, _)| differential[*j]) {
            for entry in self.state_pattern.column(j) {
                let row = self.state_pattern.row_indices[entry] as usize;
                subtract(&mut column[row * tiles..(row + 1) * tiles], self.state_values[entry], s);
            }
        }
    }

    /// `column += c dF/dy' base` with the last matrix.
    pub(super) fn add_rate_product(&self, c: f64, base: &[Tile], column: &mut [Tile], tiles: usize) {
        // Loops over few tiles of known number have no overhead.
        wide(
            #[inline(always)]
            || match tiles {
                1 => self.add_rate_blocks(c, base.as_chunks::<1>().0, column.as_chunks_mut().0),
                2 => self.add_rate_blocks(c, base.as_chunks::<2>().0, column.as_chunks_mut().0),
                3 => self.add_rate_blocks(c, base.as_chunks::<3>().0, column.as_chunks_mut().0),
                _ => {
                    for (j, base) in base.chunks_exact(tiles).enumerate() {
                        for entry in self.rate_pattern.column(j) {
                            let row = self.rate_pattern.row_indices[entry] as usize;
                            subtract(&mut column[row * tiles..(row + 1) * tiles], -c * self.rate_values[entry], base);
                        }
                    }
                }
            },
        );
    }

    #[inline(always)]
    fn add_rate_blocks<const T: usize>(&self, c: f64, base: &[[Tile; T]], column: &mut [[Tile; T]]) {
        for (j, base) in base.iter().enumerate() {
            for entry in self.rate_pattern.column(j) {
                let row = self.rate_pattern.row_indices[entry] as usize;
                subtract(&mut column[row], -c * self.rate_values[entry], base);
            }
        }
    }

    /// Replaces several right-hand sides by their solutions.
    pub(super) fn solve_tiles(&mut self, column: &mut Vec<Tile>, tiles: usize) {
        self.solver.solve_tiles(column, tiles);
    }

    /// Factors the matrix of the consistency solve.
    pub(super) fn factor_consistent(
        &mut self,
        problem: &mut Problem<'_>,
        t: f64,
        (y, yp): (&[f64], &[f64]),
        differential: &[bool],
    ) -> Result<(), FactorError> {
        problem.jacobian(t, y, yp, &mut self.state_values, &mut self.rate_values);
        let parts = (&self.state_pattern, &self.rate_pattern);
        self.merged.select(parts, &self.state_values, &self.rate_values, differential, &mut self.values);
        problem.statistics.factorisations += 1;
        self.solver.factor(&mut self.values)
    }

    /// Replaces the blocks of `b` by the solutions.
    pub(super) fn solve(&mut self, b: &mut [f64], width: usize) {
        let tiles = width.div_ceil(LANES);
        self.tiles.resize(b.len() / width * tiles, [0.0; LANES]);
        let own = self.tiles.as_flattened_mut().chunks_exact_mut(tiles * LANES);
        for (own, block) in own.zip(b.chunks_exact(width)) {
            own[..width].copy_from_slice(block);
            own[width..].fill(0.0);
        }
        self.solver.solve_tiles(&mut self.tiles, tiles);
        let own = self.tiles.as_flattened().chunks_exact(tiles * LANES);
        for (own, block) in own.zip(b.chunks_exact_mut(width)) {
            block.copy_from_slice(&own[..width]);
        }
    }

    /// Solves the initial system's linearisation at `z`.
    pub(super) fn solve_initial(
        &mut self,
        problem: &mut Problem<'_>,
        t: f64,
        z: &[f64],
        b: &mut [f64],
        width: usize,
    ) -> Result<(), FactorError> {
        problem.statistics.jacobians += 1;
        problem.statistics.factorisations += 1;
        if problem.system.initial_jacobian(t, z, &mut self.initial_values).is_err() {
            return Err(FactorError::NotFinite { row: 0, column: 0 });
        }
        problem.system.initial_nominals(&mut self.initial_column);
        self.initial_solver.begin(&self.initial_column);
        self.initial_solver.factor(&mut self.initial_values)?;
        solve_columns(&mut self.initial_solver, &mut self.initial_column, b, width);
        Ok(())
    }
}

fn solve_columns(solver: &mut LinearSolver, column: &mut [f64], b: &mut [f64], width: usize) {
    for direction in 0..width {
        for (value, block) in column.iter_mut().zip(b.chunks_exact(width)) {
            *value = block[direction];
        }
        // Directions that nothing drives are many at the start of a run.
        if column.iter().all(|value| *value == 0.0) {
            continue;
        }
        solver.solve(column);
        for (value, block) in column.iter().zip(b.chunks_exact_mut(width)) {
            block[direction] = *value;
        }
    }
}
