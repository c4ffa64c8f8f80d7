//! Would a plainer effect do in the place of an earlier one, although it explained little when that was taken up?
//!
//! An effect with several numbers explains with some of them, if it is found first, a part of what shows only once another one is in the model: play
//! whose middle may lie anywhere is a constant force.  Each such effect is taken out again, and those with fewer numbers are
//! compared with what the rest leaves; the likeliest are rivals that are fitted in its place ([`super::exchange`]).

use super::context::Search;
use super::found::{Found, Rival};
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::projection::Projection;
use crate::fault::Fault;
use crate::fit::Fit;

/// Effects that are tried, and the least share of what the other one explains that they have to promise.
const LIKELIEST: (usize, f64) = (2, 0.5);

impl Search<'_> {
    /// Adds rivals with fewer numbers to all effects but the last one; not where runs are long.
    ///
    /// # Errors
    /// A model that cannot be translated.
    pub(super) fn stand_ins(&self, found: &mut Found, fit: &Fit) -> Result<(), Fault> {
        let (effects, whole) = (found.effects(), self.whole());
        for (number, own) in effects.iter().enumerate().take(effects.len().saturating_sub(1)) {
            let numbers = own.effect.parameters.len();
            if numbers < 2 {
                continue;
            }
            (self.progress)(&format!("screening what could stand in for {}", own.label()));
            let Some((rest, mut left)) = self.taken_out(&effects, fit, number)? else { continue };
            if !rest.machine.is_fast() {
                continue;
            }
            rest.refresh(self.setup, &mut left, &whole)?;
            let Some(projection) = Projection::new(&left) else { continue };
            let enough = LIKELIEST.1 * (left.cost - fit.cost);
            let mut likely: Vec<(f64, Rival)> = Vec::new();
            for candidate in self.candidates.iter().filter(|other| other.effect.parameters.len() < numbers) {
                let is_known = found.all[number].rivals.iter().any(|rival| rival.candidate.is_same(candidate));
                if is_known || rest.inserts.iter().any(|own| own.excludes(candidate) || own.is_same(candidate)) {
                    continue;
                }
                let inserts = [&rest.inserts[..], std::slice::from_ref(candidate)].concat();
                let other = Hypothesis::new(self.setup, self.workshop, inserts)?;
                let look = if other.machine.is_fast() {
                    other.look(self.setup, &left, &projection, (&whole, false))?
                } else {
                    None
                };
                if let Some(look) = look.filter(|look| look.score.gain >= enough) {
                    likely.push((look.score.gain, Rival { candidate: candidate.clone(), numbers: look.start }));
                }
            }
            likely.sort_by(|a, b| b.0.total_cmp(&a.0));
            found.all[number].rivals.extend(likely.into_iter().take(LIKELIEST.0).map(|(_, rival)| rival));
        }
        Ok(())
    }
}
