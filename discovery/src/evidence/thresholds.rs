//! What counts as noise, and what a name needs: the numbers that the search and all that serves it decide by.

/// Drop of the cost (in units of the misfit per expected misfit) that a name needs.
pub(crate) const NEEDED: f64 = 25.0;
/// Lead over the next candidate.
pub(crate) const LEAD: f64 = 10.0;
/// Standard errors that the size must be away from zero.
pub(crate) const ERRORS: f64 = 4.0;
/// A size of fewer standard errors is none.
pub(crate) const NOTHING: f64 = 2.0;
/// Misfit per expected misfit up to which residuals count as noise.
pub(crate) const ADEQUATE: f64 = 1.06;
/// Standard deviations of the sum of squares of noise within which a misfit is that of noise.
const SPREAD: f64 = 3.0;
/// A candidate whose screening promises less is not followed: where something is missing, and where nothing but noise is left.
pub(crate) const PROMISING: (f64, f64) = (6.0, 12.0);

/// The largest misfit that counts as noise where noise leaves `expected`: of few independent samples the scatter of their sum decides.
pub(crate) fn adequate(expected: f64) -> f64 {
    (ADEQUATE * expected).max(noise(expected))
}

/// The largest misfit that noise alone leaves where it is expected to leave `expected`.
pub(crate) fn noise(expected: f64) -> f64 {
    expected + SPREAD * (2.0 * expected).sqrt()
}
