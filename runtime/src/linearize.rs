//! The linear model of a system at a point: `dx' = A dx + B du`, `dy = C dx + D du`.
//!
//! With `F(t, x, x', z) = 0`, states `x` and algebraic unknowns `z`, the implicit function theorem gives the derivatives of
//! `(x', z)` from `[F_x' F_z] d(x', z) = -(F_x dx + F_u du)` with the exact partial derivatives of the equations; outputs follow by
//! their own tangents.  Inputs are parameters.  Relations and discrete variables are held, as they are between events.  Of a set of
//! candidates those are states that are so at this point.  Eigenvalues by the QR algorithm with a bound of its turns after balancing
//! (Golub, Van Loan, "Matrix Computations", sections 7.5 and 7.4.6; Parlett and Reinsch 1969).  Not for systems with delays, which have
//! no finite state.

use std::fmt;

use faer::Mat;
use hyd_system::{Along, DaeSystem, Direction, Pattern, Place, Source};
use nalgebra::DMatrix;
use nalgebra::linalg::balancing::balance_parlett_reinsch;

/// A point of a run.
#[derive(Clone, Copy, Debug)]
pub struct OperatingPoint<'a> {
    /// Time in s.
    pub t: f64,
    /// Unknowns.
    pub y: &'a [f64],
    /// Their derivatives.
    pub yp: &'a [f64],
}

/// A linear model; matrices row by row.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct LinearModel {
    /// Index of each state among the unknowns.
    pub states: Vec<u32>,
    /// States by states, 1/s and the like.
    pub a: Vec<Vec<f64>>,
    /// States by inputs.
    pub b: Vec<Vec<f64>>,
    /// Outputs by states.
    pub c: Vec<Vec<f64>>,
    /// Outputs by inputs.
    pub d: Vec<Vec<f64>>,
    /// Eigenvalues of `a`, real and imaginary parts, by descending real part.
    pub eigenvalues: Vec<(f64, f64)>,
}

/// Why there is no linear model.
#[derive(Clone, PartialEq, Debug)]
pub enum LinearizeError {
    /// The system has delays.
    Delays,
    /// It brings no derivatives, or not by this input: its position, and a sentence.
    Input(usize, String),
    /// A derivative is not finite: the equation, if it is known.
    NotFinite(Option<String>),
    /// The equations do not determine this unknown at this point.
    Singular(String),
    /// The iteration for the eigenvalues does not end.
    Eigenvalues,
}

impl fmt::Display for LinearizeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LinearizeError::Delays => {
                f.write_str("the model has delays, which no linear model with finitely many states can represent")
            }
            LinearizeError::Input(_, reason) => f.write_str(reason),
            LinearizeError::NotFinite(Some(equation)) => {
                write!(f, "a derivative of `{equation}` is not a finite number")
            }
            LinearizeError::NotFinite(None) => f.write_str("a derivative is not a finite number"),
            LinearizeError::Singular(name) => write!(f, "the equations do not determine `{name}` at this point"),
            LinearizeError::Eigenvalues => {
                f.write_str("the iteration for the eigenvalues of the linear model does not converge")
            }
        }
    }
}

impl std::error::Error for LinearizeError {}

/// The linear model at a point that a run has reached; the system is as the run left it.
///
/// `inputs`: positions in `DaeSystem::parameters`; `outputs`: where their values stand.
///
/// # Errors
/// Delays, an input without derivatives, derivatives that are not finite, singular equations, eigenvalues that are not found.
pub fn linearize(
    system: &mut dyn DaeSystem,
    point: OperatingPoint<'_>,
    inputs: &[u32],
    outputs: &[Source],
) -> Result<LinearModel, LinearizeError> {
    if !system.structure().delays.is_empty() {
        return Err(LinearizeError::Delays);
    }
    let n = system.structure().unknowns;
    let mut is_state = vec![false; n];
    system.states(&mut is_state);
    let states: Vec<u32> = (0u32..).zip(&is_state).filter(|(_, state)| **state).map(|(k, _)| k).collect();
    let (x, u) = (states.len(), inputs.len());
    let width = x + u;
    set_directions(system, point.t, x, inputs)?;

    let (by_y, by_rate) = jacobians(system, point);
    // Columns of what follows: rates of states, and all other unknowns.
    let mut matrix = DMatrix::zeros(n, n);
    for (k, &state) in is_state.iter().enumerate() {
        matrix.set_column(k, &if state { by_rate.column(k) } else { by_y.column(k) });
    }
    let mut right = DMatrix::zeros(n, width);
    for (j, &state) in states.iter().enumerate() {
        right.set_column(j, &-by_y.column(state as usize));
    }
    for (row, block) in held_tangent(system, point, width).chunks_exact(width.max(1)).enumerate() {
        for (j, value) in block.iter().enumerate().skip(x) {
            right[(row, j)] = -value;
        }
    }
    if let Some(row) = (0..n).find(|&row| !matrix.row(row).iter().chain(right.row(row).iter()).all(|v| v.is_finite())) {
        let equation = system.tables().row_equation(row).map(|equation| equation.text.to_string());
        return Err(LinearizeError::NotFinite(equation));
    }
    let mut solution = solve(system, matrix, right)?;

    // Adding 0 makes 0 of -0.
    solution.add_scalar_mut(0.0);
    let a: Vec<Vec<f64>> = states.iter().map(|&k| (0..x).map(|j| solution[(k as usize, j)]).collect()).collect();
    let b = states.iter().map(|&k| (x..width).map(|j| solution[(k as usize, j)]).collect()).collect();
    let rows = output_rows(system, point, (&states, &is_state), &solution, outputs);
    let (c, d) = rows.into_iter().map(|row| (row[..x].to_vec(), row[x..].to_vec())).unzip();
    let eigenvalues = eigenvalues(&a).ok_or(LinearizeError::Eigenvalues)?;
    Ok(LinearModel { eigenvalues, states, a, b, c, d })
}

/// The states, for which nothing is known to the system, then the inputs.
fn set_directions(system: &mut dyn DaeSystem, t: f64, states: usize, inputs: &[u32]) -> Result<(), LinearizeError> {
    let none = || LinearizeError::Input(0, "the system has no derivatives".to_string());
    let tangents = system.tangents().ok_or_else(none)?;
    let mut directions = vec![Direction::None; states];
    directions.extend(inputs.iter().map(|&k| Direction::Parameter(k)));
    tangents.set_directions(&directions).map_err(|(k, error)| {
        let reason = match error {
            hyd_system::DirectionError::Unsupported(reason) => reason,
            _ => "it is computed or was fixed at translation, so it is not an input".to_string(),
        };
        LinearizeError::Input(k.saturating_sub(states), reason)
    })?;
    tangents.bind_tangent(t);
    Ok(())
}

/// `[F_x' F_z]` and `-F_x` at a point, and the indices of the states `x`; `None` where the system has delays or a derivative is not finite.
pub(crate) fn local_matrices(
    system: &mut dyn DaeSystem,
    point: OperatingPoint<'_>,
) -> Option<(DMatrix<f64>, DMatrix<f64>, Vec<u32>)> {
    if !system.structure().delays.is_empty() {
        return None;
    }
    let n = system.structure().unknowns;
    let mut is_state = vec![false; n];
    system.states(&mut is_state);
    let states: Vec<u32> = (0u32..).zip(&is_state).filter(|(_, state)| **state).map(|(k, _)| k).collect();
    let (by_y, by_rate) = jacobians(system, point);
    let mut matrix = DMatrix::zeros(n, n);
    for (k, &state) in is_state.iter().enumerate() {
        matrix.set_column(k, &if state { by_rate.column(k) } else { by_y.column(k) });
    }
    let mut right = DMatrix::zeros(n, states.len());
    for (j, &state) in states.iter().enumerate() {
        right.set_column(j, &-by_y.column(state as usize));
    }
    matrix.iter().chain(right.iter()).all(|value| value.is_finite()).then_some((matrix, right, states))
}

/// dF/dy and dF/dy'.
fn jacobians(system: &mut dyn DaeSystem, point: OperatingPoint<'_>) -> (DMatrix<f64>, DMatrix<f64>) {
    let (state, rate) = (system.structure().state_pattern.clone(), system.structure().rate_pattern.clone());
    let (mut state_values, mut rate_values) = (vec![0.0; state.entries()], vec![0.0; rate.entries()]);
    system.jacobian(point.t, point.y, point.yp, &mut state_values, &mut rate_values);
    (full(&state, &state_values), full(&rate, &rate_values))
}

fn full(pattern: &Pattern, values: &[f64]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(pattern.rows, pattern.columns());
    for column in 0..pattern.columns() {
        for entry in pattern.column(column) {
            matrix[(pattern.row_indices[entry] as usize, column)] = values[entry];
        }
    }
    matrix
}

/// Tangent of the residual with time, unknowns and rates held: what comes of the inputs.
fn held_tangent(system: &mut dyn DaeSystem, point: OperatingPoint<'_>, width: usize) -> Vec<f64> {
    let n = point.y.len();
    let mut out = vec![0.0; n * width];
    let (t, zero) = (vec![0.0; width], vec![0.0; n * width]);
    if let Some(tangents) = system.tangents().filter(|_| width > 0) {
        tangents.residual_tangent(point.t, point.y, point.yp, Along { t: &t, y: &zero, yp: &zero }, &mut out);
    }
    out
}

/// Rows and columns are scaled to 1 before elimination, so that units decide nothing.
pub(crate) fn solve(
    system: &dyn DaeSystem,
    mut matrix: DMatrix<f64>,
    mut right: DMatrix<f64>,
) -> Result<DMatrix<f64>, LinearizeError> {
    let singular = |k: usize| LinearizeError::Singular(system.tables().unknown_name(k));
    let n = matrix.nrows();
    if n == 0 {
        return Ok(right);
    }
    for row in 0..n {
        let size = matrix.row(row).amax();
        if size > 0.0 {
            matrix.row_mut(row).scale_mut(1.0 / size);
            right.row_mut(row).scale_mut(1.0 / size);
        }
    }
    let sizes: Vec<f64> = (0..n).map(|column| matrix.column(column).amax()).collect();
    if let Some(column) = sizes.iter().position(|size| *size == 0.0) {
        return Err(singular(column));
    }
    sizes.iter().enumerate().for_each(|(column, size)| matrix.column_mut(column).scale_mut(1.0 / size));
    let factors = matrix.lu();
    let upper = factors.u();
    if let Some(k) = (0..n).find(|&k| upper[(k, k)].abs() < f64::EPSILON) {
        return Err(singular(k));
    }
    let mut solution = factors.solve(&right).ok_or_else(|| singular(0))?;
    sizes.iter().enumerate().for_each(|(row, size)| solution.row_mut(row).scale_mut(1.0 / size));
    Ok(solution)
}

/// Derivatives of the outputs by states and inputs, a row each.
fn output_rows(
    system: &mut dyn DaeSystem,
    point: OperatingPoint<'_>,
    (states, is_state): (&[u32], &[bool]),
    solution: &DMatrix<f64>,
    outputs: &[Source],
) -> Vec<Vec<f64>> {
    let (n, width) = (point.y.len(), solution.ncols());
    let (mut dy, mut dyp) = (vec![0.0; n * width], vec![0.0; n * width]);
    for (k, &state) in is_state.iter().enumerate() {
        let to = if state { &mut dyp } else { &mut dy };
        for (j, to) in to[k * width..(k + 1) * width].iter_mut().enumerate() {
            *to = solution[(k, j)];
        }
    }
    for (j, &state) in states.iter().enumerate() {
        dy[state as usize * width + j] = 1.0;
    }
    let mut row = vec![0.0; system.structure().outputs * width];
    let mut parameters = vec![0.0; system.parameters().len() * width];
    let t = vec![0.0; width];
    if let Some(tangents) = system.tangents() {
        tangents.select_outputs(None);
        tangents.outputs_tangent(point.t, point.y, point.yp, Along { t: &t, y: &dy, yp: &dyp }, &mut row);
        tangents.parameters_tangent(&mut parameters);
    }
    let derivative = |source: &Source| {
        let sign = if source.negated { -1.0 } else { 1.0 };
        let block = |values: &[f64], k: u32| {
            values[k as usize * width..(k as usize + 1) * width].iter().map(|value| sign * value).collect()
        };
        match source.place {
            Place::Output(k) => block(&row, k),
            Place::Parameter(k) => block(&parameters, k),
            Place::Constant(_) => vec![0.0; width],
        }
    };
    outputs.iter().map(derivative).collect()
}

/// Real and imaginary parts, by descending real part; `None` if the iteration does not end.
pub(crate) fn eigenvalues(a: &[Vec<f64>]) -> Option<Vec<(f64, f64)>> {
    let n = a.len();
    let mut matrix = DMatrix::from_fn(n, n, |row, column| a[row][column]);
    if n == 0 {
        return Some(Vec::new());
    }
    balance_parlett_reinsch(&mut matrix);
    // The QR iteration of nalgebra turns forever on some matrices of many like cells.
    let balanced = Mat::from_fn(n, n, |row, column| matrix[(row, column)]);
    let found = balanced.eigenvalues().ok()?;
    let mut list: Vec<(f64, f64)> = found.iter().map(|value| (value.re + 0.0, value.im + 0.0)).collect();
    list.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1)));
    Some(list)
}
