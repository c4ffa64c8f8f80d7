//! The derivatives of residuals by unknowns, and what is known of these because of them.

use std::sync::OnceLock;

use nalgebra::{Cholesky, DMatrix};

/// A matrix with a column for each of some unknowns.
#[derive(Clone, Debug)]
pub(crate) struct Jacobian {
    /// The derivatives.
    pub matrix: DMatrix<f64>,
    /// The unknowns of its columns.
    pub unknowns: Vec<usize>,
    /// Found when it is first asked for: every number of a report asks for its error, and the product of the matrix with itself is what
    /// an error costs.
    covariance: OnceLock<Option<DMatrix<f64>>>,
}

impl Jacobian {
    /// Of derivatives by these unknowns.
    pub(crate) fn new(matrix: DMatrix<f64>, unknowns: Vec<usize>) -> Self {
        Self { matrix, unknowns, covariance: OnceLock::new() }
    }

    /// Covariance of the unknowns at the minimum, `(J'J + I)^-1`, in the order of the columns; none where it is not finite.
    pub(crate) fn covariance(&self) -> Option<&DMatrix<f64>> {
        let invert = || Cholesky::new(normal(&self.matrix)).map(|factor| factor.inverse());
        self.covariance.get_or_init(invert).as_ref()
    }

    /// The covariance without the derivatives that it is from; it has no rows.
    pub(crate) fn summary(&self) -> Self {
        let covariance = OnceLock::from(self.covariance().cloned());
        Self { matrix: DMatrix::zeros(0, self.matrix.ncols()), unknowns: self.unknowns.clone(), covariance }
    }
}

/// `J'J`.  The product of a transposed copy is one of blocks, several times as fast as one of columns with each other.
pub(crate) fn squared(jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    jacobian.transpose() * jacobian
}

/// `J'J + I`: the normal equations with the unit prior.
pub(crate) fn normal(jacobian: &DMatrix<f64>) -> DMatrix<f64> {
    let mut normal = squared(jacobian);
    for k in 0..normal.nrows() {
        normal[(k, k)] += 1.0;
    }
    normal
}
