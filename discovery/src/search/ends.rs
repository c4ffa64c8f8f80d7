//! Where the models that the round before named had their lowest fits.
//!
//! A round weighs samples otherwise than the one before, but a wave that was found is where it was: its fit begins there, instead of far away
//! with nuisances as expected.  What was not named is fitted as ever, and so is what runs fast, and all of it where the best model left much: its
//! waves may be in the wrong place.

use super::context::{Search, patience};
use super::pass::Findings;
use crate::evidence::hypothesis::Hypothesis;
use crate::fault::Fault;
use crate::fit::{Fit, minimise};
use crate::setup::Setup;

/// Unknowns by name, by model.
#[derive(Clone, Debug, Default)]
pub struct Ends(Vec<(String, Vec<(String, f64)>)>);

impl Ends {
    /// Of all models with effects that a pass of these findings, made with this setup, began with.
    pub(super) fn of(findings: &Findings, setup: &Setup) -> Result<Self, Fault> {
        let named = findings.passes.iter().filter(|pass| !pass.base.inserts.is_empty());
        let end = |pass: &super::Pass| {
            let problem = pass.base.problem(setup)?;
            let names = problem.unknowns.iter().map(|unknown| unknown.name.clone());
            Ok((pass.base.key(), names.zip(pass.fit.xi.iter().copied()).collect()))
        };
        named.map(end).collect::<Result<_, Fault>>().map(Self)
    }
}

impl Search<'_> {
    /// The fit of a model whose runs are long from where that of the round before ended; none where that had none.
    pub(super) fn resumed(&self, hypothesis: &Hypothesis) -> Result<Option<Fit>, Fault> {
        let key = hypothesis.key();
        let end = self.ends.0.iter().rev().find(|(own, _)| *own == key).filter(|_| !hypothesis.machine.is_fast());
        let Some((_, end)) = end else { return Ok(None) };
        let problem = hypothesis.problem(self.setup)?;
        // What disturbs the records may have brought further unknowns, or taken some away.
        let start = problem.unknowns.iter().map(|unknown| {
            let known = end.iter().find(|(name, _)| *name == unknown.name);
            known.map_or(0.0, |(_, xi)| unknown.within(*xi))
        });
        let start: Vec<f64> = start.collect();
        (self.progress)(&format!("fitting {}", hypothesis.label()));
        let make = || Ok(minimise(&problem, &start, &self.whole(), patience(&problem), None).ok());
        self.one(|| self.task("resumed", hypothesis, &[&start]), make)
    }
}
