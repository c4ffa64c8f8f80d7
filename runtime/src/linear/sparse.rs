//! Sparse LU: ordering and pivoting factorisation by faer, then numeric refactorisation with fixed pivots.
//!
//! The first factorisation `P A Q = L U` orders the columns (AMD on A + A' if the diagonal is full, else COLAMD) and chooses
//! pivots by size.  Its pattern is closed under fill, so later matrices of the same pattern are factored left-looking
//! (Gilbert, Peierls, SIAM J. Sci. Stat. Comput. 9, 1988) along it without search.  Pivots are watched: when one
//! becomes small against its column the pivoting factorisation is repeated.  faer does not report numerical singularity;
//! the pivots are checked here.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::PermRef;
use faer::sparse::linalg::lu::simplicial::{
    SimplicialLu, factorize_simplicial_numeric_lu, factorize_simplicial_numeric_lu_scratch,
};
use faer::sparse::linalg::{LuError, amd, colamd};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use hyd_system::Pattern;

use super::factor::{FactorError, PIVOT_FLOOR, subtract};
use crate::tiled::{LANES, Tile};

/// A pivot smaller than this, relative to the largest candidate of its column, asks for a new pivot order.
const PIVOT_DRIFT: f64 = 1e-6;

/// One triangular factor in compressed columns, rows ascending, diagonal left out.
#[derive(Clone, Default, serde::Serialize, serde::Deserialize)]
struct Factor {
    starts: Vec<u32>,
    rows: Vec<u32>,
    values: Vec<f64>,
    /// Columns with values other than zero.  Where rates are solved for, most have none: their matrix is nearly diagonal, in the
    /// pattern of one that is not.
    busy: Vec<bool>,
}

impl Factor {
    fn column(&self, c: usize) -> std::ops::Range<usize> {
        self.starts[c] as usize..self.starts[c + 1] as usize
    }

    /// Subtracts this multiple of a column.
    #[inline]
    fn subtract(&self, c: usize, multiple: f64, x: &mut [f64]) {
        let range = self.column(c);
        for (&row, &value) in self.rows[range.clone()].iter().zip(&self.values[range]) {
            x[row as usize] -= value * multiple;
        }
    }

    /// Looks which columns have values other than zero.
    fn find_busy(&mut self) {
        let busy = self.starts.windows(2).map(|ends| &self.values[ends[0] as usize..ends[1] as usize]);
        self.busy.clear();
        self.busy.extend(busy.map(|values| values.iter().any(|&value| value != 0.0)));
    }

    /// Copies a factor of faer, sorted and without entries for which `skip(row, column)`.
    fn copy(&mut self, source: SparseColMatRef<'_, u32, f64>, skip: impl Fn(usize, usize) -> bool) {
        self.starts.clear();
        self.rows.clear();
        self.values.clear();
        self.starts.push(0);
        let mut entries: Vec<(u32, f64)> = Vec::new();
        for c in 0..source.ncols() {
            entries.clear();
            let column = source.row_idx_of_col_raw(c).iter().zip(source.val_of_col(c));
            entries.extend(column.map(|(&r, &v)| (r, v)).filter(|&(r, _)| !skip(r as usize, c)));
            entries.sort_unstable_by_key(|&(r, _)| r);
            self.rows.extend(entries.iter().map(|&(r, _)| r));
            self.values.extend(entries.iter().map(|&(_, v)| v));
            self.starts.push(self.rows.len() as u32);
        }
    }
}

/// Factors of one matrix and all that is needed to renew them.
#[derive(Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct Sparse {
    /// Column of A at each place, and its inverse.
    columns: Vec<u32>,
    columns_inverse: Vec<u32>,
    /// Row of A at each place, and its inverse.
    rows: Vec<u32>,
    rows_inverse: Vec<u32>,
    lower: Factor,
    /// Rows over their pivots: no division stands in the chain of a substitution.
    upper: Factor,
    /// Of the pivots.
    inverses: Vec<f64>,
    work: Vec<f64>,
    /// The same for several right-hand sides, made when first needed.
    tiles: Vec<Tile>,
    pivoted: bool,
    /// Memory in which nothing lasts.
    #[serde(skip, default = "SimplicialLu::new")]
    lu: SimplicialLu<u32, f64>,
    scratch: Scratch,
}

/// Memory of the factorisation, in which nothing lasts.
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(from = "usize", into = "usize")]
struct Scratch {
    unknowns: usize,
    memory: MemBuffer,
}

impl Scratch {
    fn new(unknowns: usize) -> Self {
        let size = factorize_simplicial_numeric_lu_scratch::<u32, f64>(unknowns, unknowns);
        Self { unknowns, memory: MemBuffer::new(size) }
    }
}

impl From<usize> for Scratch {
    fn from(unknowns: usize) -> Self {
        Self::new(unknowns)
    }
}

impl From<Scratch> for usize {
    fn from(scratch: Scratch) -> Self {
        scratch.unknowns
    }
}

impl Clone for Scratch {
    fn clone(&self) -> Self {
        Self::new(self.unknowns)
    }
}

impl Sparse {
    /// Orders the columns of matrices with this pattern.
    pub(super) fn new(pattern: &Pattern) -> Self {
        let n = pattern.rows;
        let (columns, columns_inverse) = order(pattern);
        Self {
            columns,
            columns_inverse,
            rows: vec![0; n],
            rows_inverse: vec![0; n],
            lower: Factor::default(),
            upper: Factor::default(),
            inverses: vec![0.0; n],
            work: vec![0.0; n],
            tiles: Vec::new(),
            pivoted: false,
            lu: SimplicialLu::new(),
            scratch: Scratch::new(n),
        }
    }

    /// Chooses pivots anew for the next matrix.
    pub(super) fn forget(&mut self) {
        self.pivoted = false;
    }

    /// Factors the matrix with scaled `values` on `pattern`: along the known pivots if they serve, else with new ones.
    pub(super) fn factor(&mut self, pattern: &Pattern, values: &[f64]) -> Result<(), FactorError> {
        if !(self.pivoted && self.refactor(pattern, values)) {
            self.pivot(pattern, values)?;
        }
        for (value, &row) in self.upper.values.iter_mut().zip(&self.upper.rows) {
            *value *= self.inverses[row as usize];
        }
        self.lower.find_busy();
        self.upper.find_busy();
        Ok(())
    }

    /// Left-looking factorisation with fixed pivots; false if a pivot is too small.
    fn refactor(&mut self, pattern: &Pattern, values: &[f64]) -> bool {
        let x = &mut self.work;
        for j in 0..self.inverses.len() {
            let column = self.columns[j] as usize;
            for entry in pattern.column(column) {
                x[self.rows_inverse[pattern.row_indices[entry] as usize] as usize] = values[entry];
            }
            for u in self.upper.column(j) {
                let k = self.upper.rows[u] as usize;
                let factor = x[k];
                self.upper.values[u] = factor;
                x[k] = 0.0;
                if factor != 0.0 {
                    for l in self.lower.column(k) {
                        x[self.lower.rows[l] as usize] -= self.lower.values[l] * factor;
                    }
                }
            }
            let pivot = x[j];
            x[j] = 0.0;
            let mut largest = 0.0f64;
            let inverse = pivot.recip();
            for l in self.lower.column(j) {
                let row = self.lower.rows[l] as usize;
                largest = largest.max(x[row].abs());
                self.lower.values[l] = x[row] * inverse;
                x[row] = 0.0;
            }
            // A column without candidates has nothing to compare with: its pivot must not vanish against the scaled matrix.
            let floor = (PIVOT_DRIFT * largest).max(PIVOT_FLOOR);
            if pivot.abs() <= floor || !pivot.is_finite() || !largest.is_finite() {
                x.fill(0.0);
                return false;
            }
            self.inverses[j] = inverse;
        }
        true
    }

    /// Factorisation with a new choice of pivots.
    fn pivot(&mut self, pattern: &Pattern, values: &[f64]) -> Result<(), FactorError> {
        self.pivoted = false;
        let n = pattern.rows;
        let symbolic = SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_starts, None, &pattern.row_indices);
        let result = factorize_simplicial_numeric_lu(
            &mut self.rows,
            &mut self.rows_inverse,
            &mut self.lu,
            SparseColMatRef::new(symbolic, values),
            PermRef::new_checked(&self.columns, &self.columns_inverse, n),
            MemStack::new(&mut self.scratch.memory),
        );
        match result {
            Ok(()) => {}
            Err(LuError::SymbolicSingular { index }) => return Err(self.name(pattern, index, None)),
            Err(LuError::Generic(_)) => return Err(self.name(pattern, 0, None)),
        }
        self.lower.copy(self.lu.l_factor_unsorted(), |r, c| r == c);
        self.upper.copy(self.lu.u_factor_unsorted(), |r, c| r == c);
        for c in 0..n {
            let upper = self.lu.u_factor_unsorted();
            let mut entries = upper.row_idx_of_col_raw(c).iter().zip(upper.val_of_col(c));
            let pivot = entries.find(|&(&r, _)| r as usize == c).map_or(0.0, |(_, &v)| v);
            let column_max = pattern.column(self.columns[c] as usize).fold(0.0f64, |m, e| m.max(values[e].abs()));
            if pivot.abs() <= PIVOT_FLOOR * column_max || !pivot.is_finite() {
                return Err(self.name(pattern, c, Some(self.rows[c] as usize)));
            }
            self.inverses[c] = pivot.recip();
        }
        self.pivoted = true;
        Ok(())
    }

    /// The error that names the column at place `c`.
    fn name(&self, pattern: &Pattern, c: usize, row: Option<usize>) -> FactorError {
        let column = self.columns.get(c).map_or(0, |&column| column as usize);
        let touching = || pattern.row_indices.get(pattern.column(column).start).map_or(column, |&r| r as usize);
        FactorError::Singular { row: row.unwrap_or_else(touching), column }
    }

    /// Replaces `b` by the solution.
    pub(super) fn solve(&mut self, b: &mut [f64]) {
        let x = &mut self.work;
        for (value, &row) in x.iter_mut().zip(&self.rows) {
            *value = b[row as usize];
        }
        let n = x.len();
        for c in 0..n {
            let value = x[c];
            if value != 0.0 && self.lower.busy[c] {
                self.lower.subtract(c, value, x);
            }
        }
        for (value, inverse) in x.iter_mut().zip(&self.inverses) {
            *value *= inverse;
        }
        for c in (0..n).rev() {
            let value = x[c];
            if value != 0.0 && self.upper.busy[c] {
                self.upper.subtract(c, value, x);
            }
        }
        for (&value, &column) in x.iter().zip(&self.columns) {
            b[column as usize] = value;
        }
        x.fill(0.0);
    }

    /// Replaces each of several right-hand sides by its solution: `count` tiles per unknown.
    pub(super) fn solve_tiles(&mut self, b: &mut [Tile], count: usize) {
        let n = self.inverses.len();
        self.tiles.resize((n + 1) * count, [0.0; LANES]);
        // The value of a column stands apart while it is subtracted from others.
        let (x, own) = self.tiles.split_at_mut(n * count);
        let block = |k: u32| k as usize * count..(k as usize + 1) * count;
        for (values, &row) in x.chunks_exact_mut(count).zip(&self.rows) {
            values.copy_from_slice(&b[block(row)]);
        }
        for c in 0..n {
            own.copy_from_slice(&x[block(c as u32)]);
            for entry in self.lower.column(c) {
                subtract(&mut x[block(self.lower.rows[entry])], self.lower.values[entry], own);
            }
        }
        for (values, &inverse) in x.chunks_exact_mut(count).zip(&self.inverses) {
            values.iter_mut().flatten().for_each(|value| *value *= inverse);
        }
        for c in (0..n).rev() {
            own.copy_from_slice(&x[block(c as u32)]);
            for entry in self.upper.column(c) {
                subtract(&mut x[block(self.upper.rows[entry])], self.upper.values[entry], own);
            }
        }
        for (values, &column) in x.chunks_exact(count).zip(&self.columns) {
            b[block(column)].copy_from_slice(values);
        }
    }
}

/// A column order that keeps fill low, and its inverse.
fn order(pattern: &Pattern) -> (Vec<u32>, Vec<u32>) {
    let n = pattern.rows;
    let entries = pattern.entries();
    let (mut forward, mut inverse) = (vec![0u32; n], vec![0u32; n]);
    let symbolic = SymbolicSparseColMatRef::new_checked(n, n, &pattern.column_starts, None, &pattern.row_indices);
    let has_diagonal = |c: usize| pattern.row_indices[pattern.column(c)].binary_search(&(c as u32)).is_ok();
    let done = if (0..n).all(has_diagonal) {
        let mut memory = MemBuffer::new(amd::order_scratch::<u32>(n, entries));
        let control = amd::Control::default();
        amd::order(&mut forward, &mut inverse, symbolic, control, MemStack::new(&mut memory)).is_ok()
    } else {
        let mut memory = MemBuffer::new(colamd::order_scratch::<u32>(n, n, entries));
        let control = colamd::Control::default();
        colamd::order(&mut forward, &mut inverse, symbolic, control, MemStack::new(&mut memory)).is_ok()
    };
    if !done {
        // Any order is correct; this one merely fills more.
        for k in 0..n {
            (forward[k], inverse[k]) = (k as u32, k as u32);
        }
    }
    (forward, inverse)
}
