//! Effects that a search has taken up, with what stood against each of them then.
//!
//! Where several effects explain what is missing about equally well and more than noise is left with the best of them, the search
//! goes on with that one for the time being (a tie): what else is missing may have bent them alike, and tells them apart once it is found.

use super::pass::{Alike, Pass, Tried};
use crate::catalogue::Candidate;
use crate::evidence::thresholds::noise;
use crate::fit::Fit;

/// Most ties that a search goes on from.
const TIES: usize = 2;
/// Rivals that explained at least this share of what the effect did (in the cost) are kept, so many of them.
const RIVALS: (f64, usize) = (0.5, 5);

/// Another effect that explained what one was taken up for.
#[derive(Clone)]
pub(super) struct Rival {
    pub candidate: Candidate,
    /// Its unknowns where its fit ended.
    pub numbers: Vec<f64>,
}

/// An effect in the model.
pub(super) struct Own {
    pub candidate: Candidate,
    /// The best first.
    pub rivals: Vec<Rival>,
    /// Those that explained as much in its place when they were last asked, by how much less of the cost.
    pub alike: Vec<(Candidate, f64)>,
}

/// Effects that were alike when one of them was taken up.
pub(super) struct Tie {
    /// Position of that one in the model.
    pub number: usize,
    /// How many passes there were, the one in which they were alike included.
    pub passes: usize,
    /// Their positions among the candidates of that pass.
    pub close: Vec<usize>,
}

/// Effects in the model, in the order in which they were found.
#[derive(Default)]
pub(super) struct Found {
    pub all: Vec<Own>,
    /// Those that are not decided yet, in the order of their effects.
    pub ties: Vec<Tie>,
    /// How many ties the search has gone on from.
    gone_on: usize,
}

impl Found {
    /// Effects without rivals.
    pub(super) fn of(effects: Vec<Candidate>) -> Self {
        let all = effects.into_iter().map(|candidate| Own { candidate, rivals: Vec::new(), alike: Vec::new() });
        Self { all: all.collect(), ..Self::default() }
    }

    pub(super) fn effects(&self) -> Vec<Candidate> {
        self.all.iter().map(|own| own.candidate.clone()).collect()
    }

    /// What explains as much in the place of effects in the model.
    pub(super) fn alike(&self) -> Vec<Alike> {
        let of = |own: &Own| {
            let named = own.candidate.clone();
            let alike = own.alike.iter().cloned();
            alike.map(move |(candidate, behind)| Alike { named: named.clone(), candidate, behind }).collect::<Vec<_>>()
        };
        self.all.iter().flat_map(of).collect()
    }

    /// Takes up the candidate at this position of a pass that began with these effects.
    pub(super) fn take(&mut self, pass: &Pass, named: usize) {
        let explained = |k: usize| pass.tried[k].fit.as_ref().map_or(0.0, |fit| pass.fit.cost - fit.cost);
        let enough = RIVALS.0 * explained(named);
        let is_rival = |k: &usize| *k != named && !pass.tried[*k].is_nothing() && explained(*k) >= enough;
        let others: Vec<usize> = (0..pass.tried.len()).filter(is_rival).take(RIVALS.1).collect();
        self.put(pass, named, &others);
    }

    /// Takes up the first of candidates that explain it equally well, for the time being.
    pub(super) fn take_for_now(&mut self, pass: &Pass, close: Vec<usize>, passes: usize) {
        self.put(pass, close[0], &close[1..]);
        self.ties.push(Tie { number: self.all.len() - 1, passes, close });
        self.gone_on += 1;
    }

    fn put(&mut self, pass: &Pass, named: usize, others: &[usize]) {
        let count = pass.fit.xi.len();
        let rival = |k: &usize| {
            let Tried { hypothesis, fit: Some(fit), .. } = &pass.tried[*k] else { return None };
            Some(Rival { candidate: hypothesis.inserts.last()?.clone(), numbers: fit.xi[count..].to_vec() })
        };
        let rivals = others.iter().filter_map(rival).collect();
        let own = pass.tried[named].hypothesis.inserts.last();
        self.all.extend(own.map(|own| Own { candidate: own.clone(), rivals, alike: Vec::new() }));
    }

    /// Takes an effect out again; a tie that it was in is over.
    pub(super) fn remove(&mut self, number: usize) -> Candidate {
        self.ties.retain(|tie| tie.number != number);
        self.ties.iter_mut().for_each(|tie| tie.number -= usize::from(tie.number > number));
        // They were compared beside it.
        self.all.iter_mut().for_each(|own| own.alike.clear());
        self.all.remove(number).candidate
    }

    /// Keeps the first ones only.
    pub(super) fn truncate(&mut self, count: usize) {
        self.all.truncate(count);
        self.ties.retain(|tie| tie.number < count);
    }

    /// The last tie, if nothing was found after it.
    pub(super) fn last_tie(&mut self) -> Option<Tie> {
        let count = self.all.len();
        self.ties.pop_if(|tie| tie.number + 1 == count)
    }

    /// True if a search may go on with the first of candidates that are alike: it has not done so too often, and more than noise is left.
    pub(super) fn goes_on(&self, pass: &Pass, close: &[usize], most: usize) -> bool {
        let leaves_more = |fit: &Fit| fit.misfit > noise(pass.expected);
        let first = close.first().and_then(|&k| pass.tried[k].fit.as_ref());
        self.gone_on < TIES && self.all.len() + 1 < most && first.is_some_and(leaves_more)
    }
}
