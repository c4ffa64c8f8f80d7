//! A second look at the effects, with a few steps of a fit on borrowed derivatives.
//!
//! The score of an effect supposes that nuisances answer in proportion.  Where they can imitate most of it they must go
//! far, and the score sees little of what a fit would find.  Here the nuisances do move: Levenberg-Marquardt steps
//! whose Jacobian is that of the fit without the effect, with the columns of the effect's own numbers, corrected by
//! Broyden's update and never computed anew, so that a step costs one run of each shot.

use super::context::Search;
use super::pass::Pass;
use crate::catalogue::Kind;
use crate::evidence::hypothesis::Look;
use crate::fault::Fault;
use crate::fit::{Effort, Fit, Jacobian, minimise};

/// Steps; nothing is computed anew.
const STEPS: Effort = Effort { steps: 6, gain: 2.0, worthwhile: f64::NEG_INFINITY, ..Effort::FULL };
/// Where nothing but noise is left.
const FEWER: Effort = Effort { steps: 4, ..STEPS };
/// Where the nuisances leave more of a signature than this, the score is trusted: where something is missing, and where
/// nothing but noise is left.
const LEFT: (f64, f64) = (0.35, 0.15);
/// A signature that would be seen less clearly than this at the size that explains most is not followed.
const VISIBLE: f64 = 25.0;

impl Search<'_> {
    /// Looks again at the effects that nuisances can imitate, from the fit `seen`.
    pub(super) fn probe(&self, pass: &mut Pass, seen: &Fit, is_quiet: bool) -> Result<(), Fault> {
        (self.progress)("screening again what nuisances could imitate");
        let whole = self.whole();
        let Some(Jacobian { matrix: jacobian, .. }) = &seen.jacobian else { return Ok(()) };
        let (effort, limit) = if is_quiet { (FEWER, LEFT.1) } else { (STEPS, LEFT.0) };
        let mut doubtful = Vec::new();
        for (rank, tried) in pass.tried.iter().enumerate() {
            // Measuring chains answer in proportion.
            let is_sensor = tried.hypothesis.inserts.last().is_some_and(|insert| insert.effect.kind == Kind::Sensor);
            if is_quiet && is_sensor {
                continue;
            }
            let is_doubtful = |look: &&Look| look.score.left < limit && look.score.power > VISIBLE;
            if let Some(look) = tried.look.as_ref().filter(is_doubtful)
                && tried.hypothesis.machine.is_fast()
            {
                doubtful.push((rank, &tried.hypothesis, look));
            }
        }
        let make = |k: usize| {
            let (_, hypothesis, look) = doubtful[k];
            let problem = hypothesis.problem(self.setup)?;
            let typical = hypothesis.inserts.last().map(|own| own.effect.probe * self.setup.scale(own));
            let typical = typical.map(|size| hypothesis.at_size(&problem, &seen.xi, size));
            let claimed = (!is_quiet).then(|| [&seen.xi[..], &look.start[..]].concat());
            let mut best = None;
            for start in typical.into_iter().chain(claimed) {
                let Ok(fit) = minimise(&problem, &start, &whole, effort, Some((jacobian, &whole))) else { continue };
                let cost_drop = pass.fit.cost - fit.cost;
                if cost_drop > best.as_ref().map_or(0.0, |(known, _): &(f64, Vec<f64>)| *known) {
                    best = Some((cost_drop, fit.xi));
                }
            }
            Ok(best)
        };
        let task = |k: usize| self.task("probe", doubtful[k].1, &[&doubtful[k].2.start, &[pass.fit.cost]]).with(seen);
        let probed = self.each(doubtful.len(), task, make)?;
        let ranks: Vec<usize> = doubtful.iter().map(|own| own.0).collect();
        for (rank, probed) in ranks.into_iter().zip(probed) {
            if let Some(look) = &mut pass.tried[rank].look {
                look.probed = probed;
            }
        }
        Ok(())
    }
}
