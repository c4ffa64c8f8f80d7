//! Further effects that shots held out speak against.
//!
//! What one effect leaves, because nature has it in another form, is imitated by small amounts of others: the cost of the fitted shots falls,
//! and that of shots that were not fitted rises.  The first name is judged by them as a whole ([`super::decide`]), each further one
//! beside those before it.

use super::context::Search;
use super::pass::{Pass, Refuted};
use crate::catalogue::Candidate;
use crate::evidence::proof::unseen;
use crate::evidence::thresholds::LEAD;
use crate::fault::Fault;
use crate::problem::Weighing;

/// Mean square over that of noise from which on shots held out have to show what a further effect explains.
const FAR_BEYOND: f64 = 25.0;
/// The share of it that a further effect may leave there: what explains less imitates a part of something else.
const NEARLY_ALL: f64 = 0.8;

impl Search<'_> {
    /// Takes effects out again, the last first, as long as the gap on shots held out is larger with it, or, far beyond noise, hardly smaller.
    /// The pass that named one says so, and is the last one then.
    pub(super) fn withdraw(&self, passes: &mut Vec<Pass>, found: &mut Vec<Candidate>) -> Result<Vec<Refuted>, Fault> {
        let mut all = Vec::new();
        while let [.., before, last] = &passes[..]
            && found.len() > 1
            && !self.setup.held_out.is_empty()
            && is_next(before, last, found)
        {
            let (without, with) = (self.unseen(before)?, self.unseen(last)?);
            let expected = before.base.problem(self.setup)?.expected(&Weighing::whole(&self.setup.held_out, 0.0));
            let Some(refuted) = found.pop_if(|_| is_refuted((without, with), expected)) else { break };
            (self.progress)(&format!("refuted by the shots held out: {}", refuted.label()));
            passes.pop();
            let Some(before) = passes.last_mut() else { break };
            let by = (with / without).sqrt();
            for own in before.tried.iter_mut().filter(|own| own.fit.is_some() && own.hypothesis.ends_with(&refuted)) {
                own.verdict = match by > 1.0 {
                    true => format!("it makes the gap on shots held out larger, {by:.3} times"),
                    false => format!("on shots held out {:.0} % of the gap is left with it", 100.0 * by),
                };
                own.is_refuted = true;
            }
            all.push(Refuted { candidate: refuted, by });
        }
        Ok(all)
    }

    /// The sum of squares that the shots held out leave in the model that a pass began with, with the tolerance of time of the fits.
    pub(super) fn unseen(&self, pass: &Pass) -> Result<f64, Fault> {
        let setup = self.setup;
        unseen(&pass.base.problem(setup)?, &pass.fit.xi, &setup.held_out, setup.study.shots.time_tolerance)
    }
}

/// True if shots held out speak against a further effect: sums of squares without it and with it, and what noise leaves.
fn is_refuted((without, with): (f64, f64), expected: f64) -> bool {
    let is_far = without > FAR_BEYOND * expected;
    with > without + LEAD || is_far && with > NEARLY_ALL * without
}

/// True if the model of the last pass is that of the one before with the last effect beside it.
fn is_next(before: &Pass, last: &Pass, found: &[Candidate]) -> bool {
    let labels = |candidates: &[Candidate]| candidates.iter().map(Candidate::label).collect::<Vec<_>>();
    let all = labels(found);
    labels(&last.base.inserts) == all && labels(&before.base.inserts) == all[..all.len() - 1]
}

#[cfg(test)]
mod tests {
    use super::is_refuted;

    #[test]
    fn shots_held_out_have_to_show_a_further_effect_where_much_is_left() {
        // Near the noise less is asked: it must not be worse.
        assert!(!is_refuted((1300.0, 1290.0), 1000.0) && !is_refuted((1300.0, 1305.0), 1000.0));
        assert!(is_refuted((1300.0, 1320.0), 1000.0));
        // Gaps of 118 and 113 times noise, and of 118 and 90.
        assert!(is_refuted((118.0 * 118.0, 113.0 * 113.0), 1.0));
        assert!(!is_refuted((118.0 * 118.0, 90.0 * 90.0), 1.0));
    }
}
