//! What linear columns explain of residuals, with the nuisances following them.
//!
//! Least squares over the amplitudes of the columns, with a prior where one is given, the nuisances projected out with theirs as in
//! [`crate::evidence::projection`].

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::fit::normal;

/// A column that is zero but for one run of rows.
pub(super) struct Columns {
    /// First row.
    pub first: usize,
    /// Values from there on.
    pub values: Vec<f64>,
}

/// What columns explain.
pub(super) struct Explained {
    /// Amplitudes of the columns.
    pub amplitudes: Vec<f64>,
    /// Residuals that are left.
    pub left: DVector<f64>,
    /// Drop of the misfit; its unit is up to who asks.
    pub gain: f64,
}

/// A share of the largest eigenvalue below which amplitudes are not told apart.
const RIDGE: f64 = 1e-9;

/// Residuals and their derivatives by nuisances, with rows weighed, and what the nuisances do by themselves: the same for all columns.
pub(super) struct Ground<'a> {
    residuals: &'a DVector<f64>,
    jacobian: &'a DMatrix<f64>,
    scales: Vec<f64>,
    scaled: DMatrix<f64>,
    weighed: DVector<f64>,
    factor: Cholesky<f64, Dyn>,
    pull: DVector<f64>,
}

impl<'a> Ground<'a> {
    /// For residuals whose derivatives by nuisances, which are at `xi`, are `jacobian`; rows are weighed by `scales`.  None where a
    /// derivative is not finite.
    pub(super) fn new(
        residuals: &'a DVector<f64>,
        jacobian: &'a DMatrix<f64>,
        scales: Vec<f64>,
        xi: &[f64],
    ) -> Option<Self> {
        let mut scaled = jacobian.clone();
        for mut column in scaled.column_iter_mut() {
            column.iter_mut().zip(&scales).for_each(|(value, scale)| *value *= scale);
        }
        let weighed =
            DVector::from_iterator(residuals.len(), residuals.iter().zip(&scales).map(|(r, scale)| r * scale));
        let factor = Cholesky::new(normal(&scaled))?;
        let pull = factor.solve(&(scaled.tr_mul(&weighed) + DVector::from_column_slice(xi)));
        Some(Self { residuals, jacobian, scales, scaled, weighed, factor, pull })
    }

    /// The amplitudes of `columns` that explain most.  They are expected within `spread` of zero, if there is one, and what they are
    /// beyond that is paid for.
    pub(super) fn explained(&self, columns: &[Columns], spread: Option<f64>) -> Option<Explained> {
        let scaled_by = |column: &Columns| -> Vec<f64> {
            column.values.iter().zip(&self.scales[column.first..]).map(|(value, scale)| value * scale).collect()
        };
        let own: Vec<Vec<f64>> = columns.iter().map(scaled_by).collect();
        let across =
            |k: usize| self.scaled.rows(columns[k].first, own[k].len()).tr_mul(&DVector::from_column_slice(&own[k]));
        let projected: Vec<DVector<f64>> = (0..own.len()).map(across).collect();
        let followed: Vec<DVector<f64>> = projected.iter().map(|own| self.factor.solve(own)).collect();
        let count = own.len();
        let inner = DMatrix::from_fn(count, count, |i, k| {
            direct((columns[i].first, &own[i]), (columns[k].first, &own[k])) - projected[i].dot(&followed[k])
        });
        let along = DVector::from_fn(count, |k, _| {
            let rows = self.weighed.rows(columns[k].first, own[k].len());
            rows.iter().zip(&own[k]).map(|(r, value)| r * value).sum::<f64>() - projected[k].dot(&self.pull)
        });
        let ridge = RIDGE * (0..count).map(|k| inner[(k, k)]).fold(0.0, f64::max);
        let mut regular = inner;
        let prior = spread.map_or(0.0, |spread| 1.0 / (spread * spread));
        for k in 0..count {
            regular[(k, k)] += ridge + prior;
        }
        let amplitudes = Cholesky::new(regular)?.solve(&along);
        let mut follow = DVector::zeros(self.jacobian.ncols());
        let mut left = self.residuals.clone();
        for (k, column) in columns.iter().enumerate() {
            for (row, value) in column.values.iter().enumerate() {
                left[column.first + row] -= amplitudes[k] * value;
            }
            follow += &projected[k] * amplitudes[k];
        }
        left += self.jacobian * self.factor.solve(&follow);
        Some(Explained { gain: amplitudes.dot(&along), amplitudes: amplitudes.as_slice().to_vec(), left })
    }
}

/// Product of two columns.
fn direct((a, x): (usize, &[f64]), (b, y): (usize, &[f64])) -> f64 {
    let from = a.max(b);
    let to = (a + x.len()).min(b + y.len());
    (from..to.max(from)).map(|row| x[row - a] * y[row - b]).sum()
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::{Columns, Ground};

    /// Two shots, a nuisance of both and an amplitude in each, against the normal equations of all three.
    #[test]
    fn amplitudes_are_those_of_the_joint_least_squares() {
        let n = 60;
        let nuisance = DVector::from_fn(n, |k, _| 1.0 + (0.2 * k as f64).sin());
        let wave = |k: usize| (0.37 * k as f64).cos();
        let noise = |k: usize| 0.1 * (1.9 * (k * k) as f64).sin();
        let residuals = DVector::from_fn(n, |k, _| noise(k) + if k < 30 { 2.0 } else { -1.0 } * wave(k));
        // The nuisance at its minimum, with its prior.
        let at = -nuisance.dot(&residuals) / (nuisance.norm_squared() + 1.0);
        let residuals = residuals + at * &nuisance;
        let part = |from: usize| Columns { first: from, values: (from..from + 30).map(wave).collect() };
        let jacobian = DMatrix::from_columns(std::slice::from_ref(&nuisance));
        let fit = |spread: Option<f64>| {
            let ground = Ground::new(&residuals, &jacobian, vec![1.0; n], &[at]).expect("regular");
            ground.explained(&[part(0), part(30)], spread).expect("regular")
        };
        let found = fit(None);
        let all = DMatrix::from_fn(n, 3, |row, k| match k {
            0 => nuisance[row],
            1 if row < 30 => -wave(row),
            2 if row >= 30 => -wave(row),
            _ => 0.0,
        });
        let mut normal = all.transpose() * &all;
        normal[(0, 0)] += 1.0;
        let gradient = all.transpose() * &residuals + DVector::from_column_slice(&[at, 0.0, 0.0]);
        let step = -normal.clone().cholesky().expect("regular").solve(&gradient);
        assert!((found.amplitudes[0] - step[1]).abs() < 1e-6 && (found.amplitudes[1] - step[2]).abs() < 1e-6);
        assert!((found.amplitudes[0] - 2.0).abs() < 0.1 && (found.amplitudes[1] + 1.0).abs() < 0.1);
        let left = &residuals + &all * &step;
        assert!((found.left - left).amax() < 1e-6);
        // With a prior of theirs.
        let expected = fit(Some(0.5));
        normal[(1, 1)] += 4.0;
        normal[(2, 2)] += 4.0;
        let step = -normal.cholesky().expect("regular").solve(&gradient);
        assert!((expected.amplitudes[0] - step[1]).abs() < 1e-6 && (expected.amplitudes[1] - step[2]).abs() < 1e-6);
        assert!((expected.gain + gradient.dot(&step)).abs() < 1e-6 * expected.gain && expected.gain < found.gain);
    }
}
