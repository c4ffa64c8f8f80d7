//! What a search has fitted already, so that one that was ended goes on where it was.
//!
//! A fit is remembered by what was fitted and in which role.  Only the unknowns are kept: a fit that is recalled starts from them and
//! ends at once, with derivatives of its own.

use super::Search;
use crate::Fault;
use crate::fit::{Effort, Fit, minimise};
use crate::hypothesis::Hypothesis;

/// Keeps fits.
pub trait Memory {
    /// The unknowns of a fit made before.
    fn recall(&self, key: &str) -> Option<Vec<f64>>;
    /// Remembers a fit.
    fn keep(&self, key: &str, xi: &[f64]);
}

/// Remembers nothing.
pub struct Forgetful;

impl Memory for Forgetful {
    fn recall(&self, _key: &str) -> Option<Vec<f64>> {
        None
    }

    fn keep(&self, _key: &str, _xi: &[f64]) {}
}

impl Search<'_> {
    /// The fit under this key, or the one that `make` makes.
    pub(super) fn remembered(
        &self,
        role: &str,
        hypothesis: &Hypothesis,
        make: impl FnOnce() -> Result<Option<Fit>, Fault>,
    ) -> Result<Option<Fit>, Fault> {
        let key = format!("{role}: {}", hypothesis.label());
        if let Some(xi) = self.memory.recall(&key) {
            let problem = hypothesis.problem(self.setup)?;
            if xi.len() == problem.unknowns.len()
                && let Ok(fit) = minimise(&problem, &xi, &self.whole(), Effort::FULL, None)
            {
                return Ok(Some(fit));
            }
        }
        let fit = make()?;
        if let Some(fit) = &fit {
            self.memory.keep(&key, &fit.xi);
        }
        Ok(fit)
    }
}
