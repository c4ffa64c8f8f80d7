//! What a search has fitted already, so that one that was ended goes on where it was.
//!
//! A fit is remembered by what was fitted and in which role.  Only the unknowns are kept: a fit that is recalled starts
//! from them and ends at once, with derivatives of its own.

use super::context::Search;
use crate::disturbance::Disturbances;
use crate::evidence::hypothesis::Hypothesis;
use crate::fault::Fault;
use crate::fit::{Effort, Fit, minimise};

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
    /// The fit that was remembered under this role, taken up again.
    pub(super) fn recalled(&self, role: &str, hypothesis: &Hypothesis) -> Result<Option<Fit>, Fault> {
        let Some(xi) = self.memory.recall(&self.key(role, hypothesis)) else { return Ok(None) };
        if !hypothesis.inserts.is_empty() {
            (self.progress)(&format!("fitting {}", hypothesis.label()));
        }
        let problem = hypothesis.problem(self.setup)?;
        let is_own = xi.len() == problem.unknowns.len();
        Ok(is_own.then(|| minimise(&problem, &xi, &self.whole(), Effort::FULL, None).ok()).flatten())
    }

    /// Remembers a fit.
    pub(super) fn keep(&self, role: &str, hypothesis: &Hypothesis, fit: &Fit) {
        self.memory.keep(&self.key(role, hypothesis), &fit.xi);
    }

    /// Fits to other shots are other fits.
    pub(super) fn key(&self, role: &str, hypothesis: &Hypothesis) -> String {
        let shots = if self.setup.exposed.is_empty() { "" } else { "other shots, " };
        let round = match self.setup.disturbances == Disturbances::default() {
            true => String::new(),
            false => format!("{:?}, ", self.setup.disturbances),
        };
        format!("{round}{shots}{role}: {}", hypothesis.key())
    }
}
