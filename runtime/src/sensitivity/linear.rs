//! Matrices of the linear systems behind sensitivities, and their solution for all directions.
//!
//! Three systems: the iteration matrix `dF/dy + c dF/dy'` of a step, the matrix of the consistency solve (columns of dF/dy'
//! for differential and of dF/dy for algebraic unknowns), and the Jacobian of the initial system.  All are evaluated and
//! factored at the point in question, because a linear system is solved once and has no iteration to make up for an old
//! matrix.

use hyd_system::{Structure, wide};

use super::trail::Trail;
use crate::linear::{FactorError, IterationMatrix, LinearSolver, subtract};
use crate::problem::Problem;
use crate::tiled::{LANES, Tile};

/// Change of an entry of a Jacobian that counts as a jump, as a part of it.
const JUMP: f64 = 1e-4;

/// The matrices with their factors and work space.
pub(super) struct Matrices {
    matrix: IterationMatrix,
    initial: InitialMatrix,
    tiles: Vec<Tile>,
    /// Point and entries on one side of a break, for the comparison with the other.
    y: Vec<f64>,
    yp: Vec<f64>,
    before: Vec<f64>,
}

/// The Jacobian of the initial system.
struct InitialMatrix {
    solver: LinearSolver,
    values: Vec<f64>,
    column: Vec<f64>,
}

impl Matrices {
    /// Work space for systems of this structure.
    pub(super) fn new(structure: &Structure) -> Self {
        let initial = &structure.initial;
        Self {
            matrix: IterationMatrix::new(structure),
            initial: InitialMatrix {
                solver: LinearSolver::new(&initial.pattern),
                values: vec![0.0; initial.pattern.entries()],
                column: vec![0.0; initial.unknowns],
            },
            tiles: Vec::new(),
            y: vec![0.0; structure.unknowns],
            yp: vec![0.0; structure.unknowns],
            before: Vec::new(),
        }
    }

    /// Sets the sizes of the unknowns, and forgets what was chosen for the matrices before.
    pub(super) fn reset(&mut self, nominals: &[f64]) {
        self.matrix.begin(nominals);
    }

    /// Factors `dF/dy + c dF/dy'` at a point, and gives the tangent of F with the unknowns held.
    pub(super) fn factor_along(
        &mut self,
        problem: &mut Problem<'_>,
        (t, c): (f64, f64),
        (y, yp): (&[f64], &[f64]),
        forcing: &mut [f64],
    ) -> Result<(), FactorError> {
        problem.system.jacobian_tangent(t, y, yp, self.matrix.parts(), forcing);
        self.matrix.factor(c)
    }

    /// True if the Jacobians on both sides of a break differ by more than rounding and smooth change explain.
    pub(super) fn jump_between(&mut self, problem: &mut Problem<'_>, trail: &Trail, (a, b): (f64, f64)) -> bool {
        trail.values(a, &mut self.y, &mut self.yp);
        let (state, rate) = self.matrix.parts();
        problem.system.jacobian(a, &self.y, &self.yp, state, rate);
        self.before.clear();
        self.before.extend(self.matrix.entries());
        trail.values(b, &mut self.y, &mut self.yp);
        let (state, rate) = self.matrix.parts();
        problem.system.jacobian(b, &self.y, &self.yp, state, rate);
        self.before.iter().zip(self.matrix.entries()).any(|(a, b)| (a - b).abs() > JUMP * a.abs().max(b.abs()))
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
        problem.system.jacobian_tangent(t, y, yp, self.matrix.parts(), forcing);
        self.matrix.factor_consistent(differential)
    }

    /// `column -= dF/dy s` over differential unknowns with the last matrix; all have `tiles` tiles per unknown.
    pub(super) fn subtract_state_product(&self, s: &[Tile], differential: &[bool], column: &mut [Tile], tiles: usize) {
        for (j, s) in s.chunks_exact(tiles).enumerate().filter(|(j, _)| differential[*j]) {
            for (row, entry) in self.matrix.state_column(j) {
                subtract(&mut column[row * tiles..(row + 1) * tiles], entry, s);
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
                        for (row, entry) in self.matrix.rate_column(j) {
                            subtract(&mut column[row * tiles..(row + 1) * tiles], -c * entry, base);
                        }
                    }
                }
            },
        );
    }

    #[inline(always)]
    fn add_rate_blocks<const T: usize>(&self, c: f64, base: &[[Tile; T]], column: &mut [[Tile; T]]) {
        for (j, base) in base.iter().enumerate() {
            for (row, entry) in self.matrix.rate_column(j) {
                subtract(&mut column[row], -c * entry, base);
            }
        }
    }

    /// Replaces several right-hand sides by their solutions.
    pub(super) fn solve_tiles(&mut self, column: &mut Vec<Tile>, tiles: usize) {
        self.matrix.solve_tiles(column, tiles);
    }

    /// Factors the matrix of the consistency solve.
    pub(super) fn factor_consistent(
        &mut self,
        problem: &mut Problem<'_>,
        t: f64,
        (y, yp): (&[f64], &[f64]),
        differential: &[bool],
    ) -> Result<(), FactorError> {
        let (state, rate) = self.matrix.parts();
        problem.jacobian(t, y, yp, state, rate);
        problem.statistics.factorisations += 1;
        self.matrix.factor_consistent(differential)
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
        self.matrix.solve_tiles(&mut self.tiles, tiles);
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
        let InitialMatrix { solver, values, column } = &mut self.initial;
        if problem.system.initial_jacobian(t, z, values).is_err() {
            return Err(FactorError::NotFinite { row: 0, column: 0 });
        }
        problem.system.initial_nominals(column);
        solver.begin(column);
        solver.factor(values)?;
        solve_columns(solver, column, b, width);
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
