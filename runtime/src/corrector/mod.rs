//! Newton's method: the corrector that both integrators share, and the damped method for values from afar.
//!
//! [`modified`] corrects the prediction of a step with a matrix that is kept over steps; it knows a time, a leading coefficient and
//! predicted values, and not which formula they come from.  [`damped`] solves where nothing is predicted: at the start, after events
//! and along folds, [`relaxed`] in steps where that fails, [`kinks`] piece by piece where a system has pieces.  [`failure`] is what an integrator reports when corrections fail however small the step.

pub(crate) mod damped;
mod failure;
pub(crate) mod kinks;
mod modified;
pub(crate) mod relaxed;

pub(crate) use failure::{StepFailure, StepFault};
pub(crate) use modified::{Correction, Corrector, Prediction};
