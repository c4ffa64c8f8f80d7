//! Why a step could not be done: what the integrators say when corrections fail however small the step.

use super::modified::Correction;

/// What prevents a step.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum StepFault {
    /// The error test fails however small the step.
    Error,
    /// Newton's method does not converge however small the step.
    Convergence,
    /// The residual or Jacobian is not finite however small the step.
    NotFinite,
    /// The iteration matrix is singular however small the step.
    Singular,
}

/// A step that could not be done; the integrator stands at the last accepted point.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct StepFailure {
    pub(crate) fault: StepFault,
    /// Time stepped to (s) and size of the last attempt (s).
    pub(crate) t: f64,
    pub(crate) h: f64,
    pub(crate) order: usize,
    /// Residual row at fault, if known.
    pub(crate) row: Option<usize>,
    /// Unknown at fault, if known.
    pub(crate) unknown: Option<usize>,
}

impl StepFailure {
    /// The failure behind a correction that did not converge; `failure` makes one of a fault, where nothing is known of
    /// row and unknown.
    pub(crate) fn of_correction(outcome: Correction, failure: impl FnOnce(StepFault) -> Self) -> Self {
        let at_fault = |row, column, failure| Self { row: Some(row), unknown: Some(column), ..failure };
        match outcome {
            Correction::Converged | Correction::Diverged => failure(StepFault::Convergence),
            Correction::NotFinite => failure(StepFault::NotFinite),
            Correction::SlopeNotFinite { row, column } => at_fault(row, column, failure(StepFault::NotFinite)),
            Correction::Singular { row, column } => at_fault(row, column, failure(StepFault::Singular)),
        }
    }
}
