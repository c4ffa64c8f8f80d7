//! The shots to make next: where, within what a bench can do, is most learned of what a search has left open?
//!
//! What is open decides what counts ([`aim`]): rivals that explain the shots about equally well are to be told apart; effects that the shots
//! could not show are to show; sizes that were found are to be known better.  Every point is run with every rival, events and all, and what
//! may be off follows to first order ([`evidence`]); points are a lattice over the conditions and then the neighbours of the best
//! ([`space`], [`seen`]).  Shots are chosen one after the other, each beside those chosen before.  For rivals the answer is proved by fits:
//! the record of one is added to the set, and the others are fitted to all of it.

mod aim;
mod answer;
mod evidence;
mod planned;
mod proved;
mod seen;
mod space;

use self::aim::{Aim, Open, Question};
pub use self::answer::{NextShots, PredictedCurves};
use self::evidence::Share;
use self::proved::{Proved, prove};
use self::seen::{BATCH, Batch, Farthest, Seen};
pub use self::space::Wish;
use self::space::{Point, Space};
use crate::evidence::thresholds::{LEAD, NEEDED};
use crate::search::Findings;
use crate::variant::Workshop;
use crate::{Fault, Setup};

/// Points of the lattice by condition that varies, and where models have delays, whose runs take long.
const LATTICE: (usize, usize) = (64, 24);
/// Rounds of neighbours around the best point, and the distance of the first ones as a part of each range.
const ROUNDS: usize = 4;
const NEIGHBOUR: f64 = 0.15;

/// A shot that is proposed.
pub(crate) struct Chosen {
    /// Where.
    pub point: Point,
    /// Shares of this shot and those chosen before it, by contender.
    pub shares: Vec<Share>,
    /// What all are worth together.
    pub worth: f64,
    /// Where rivals differ in it the most, by pair.
    pub farthest: Vec<Option<Farthest>>,
}

/// What was looked at on the way.
pub(crate) struct Looked {
    /// Points that were run, with their worth for the first shot.
    pub seen: Vec<(Point, f64)>,
    /// Points that cannot be run by every model.
    pub failed: (usize, Option<String>),
    /// Points at which a channel would leave what it may show.
    pub beyond: usize,
    /// Points where the bench must not go.
    pub forbidden: usize,
}

/// Proposes shots after a search.
///
/// # Errors
/// Conditions that are not there, models that cannot be run anywhere.
pub fn next_shots(
    setup: &Setup,
    workshop: &Workshop<'_>,
    findings: &Findings,
    wish: &Wish,
    progress: &dyn Fn(&str),
) -> Result<NextShots, Fault> {
    match &findings.law {
        Some(law) => law.known_to(workshop, |workshop| propose(setup, workshop, findings, wish, progress)),
        None => propose(setup, workshop, findings, wish, progress),
    }
}

fn propose(
    setup: &Setup,
    workshop: &Workshop<'_>,
    findings: &Findings,
    wish: &Wish,
    progress: &dyn Fn(&str),
) -> Result<NextShots, Fault> {
    let space = Space::new(setup, wish)?;
    // Inputs of planned shots are those of the shot that they are like.
    let conditions = vec![setup.bench.shots[space.template].conditions.clone(); BATCH];
    let planned = setup.planned(space.template, &conditions)?;
    let mut question = match Question::of((setup, &planned), workshop, findings)? {
        Open::Question(question) => question,
        Open::Nothing(why) => return Ok(NextShots::none(setup, findings, why)),
    };
    let names: Vec<&str> = question.contenders.iter().map(|own| own.label.as_str()).collect();
    progress(&format!("looking for the next shot by {}", names.join(", ")));
    let mut hunt = Hunt { setup, space: &space, question: &question, seen: Vec::new(), looked: Looked::none() };
    hunt.lattice(progress)?;
    let hopeless = hunt.hopeless();
    let Hunt { seen, looked, .. } = hunt;
    question.hopeless = hopeless;
    if question.is_hopeless() {
        let why = format!("no shot within these ranges settles anything: {}", question.never_told().join("; "));
        return Ok(NextShots::none(setup, findings, &why));
    }
    let mut hunt = Hunt { setup, space: &space, question: &question, seen, looked };
    hunt.value();
    let mut chosen: Vec<Chosen> = Vec::new();
    for _ in 0..wish.shots.max(1) {
        let shot = hunt.next(chosen.last(), progress)?;
        chosen.push(shot);
    }
    let points: Vec<Point> = chosen.iter().map(|own| own.point.clone()).collect();
    for k in 0..chosen.len() {
        let farthest = hunt.farthest(&points[..=k], &chosen[k].shares)?;
        chosen[k].farthest = farthest;
    }
    progress("fitting the rivals to each other's records of the proposed shots");
    let proved: Vec<Proved> = prove((setup, &space), workshop, &question, &points)?;
    let looked = hunt.looked;
    Ok(answer::answer((setup, &space), &question, findings, (chosen, proved), looked))
}

impl Looked {
    fn none() -> Self {
        Self { seen: Vec::new(), failed: (0, None), beyond: 0, forbidden: 0 }
    }
}

/// The search for points.
struct Hunt<'a> {
    setup: &'a Setup,
    space: &'a Space<'a>,
    question: &'a Question,
    seen: Vec<Seen>,
    looked: Looked,
}

impl Hunt<'_> {
    /// Looks at the lattice.
    fn lattice(&mut self, progress: &dyn Fn(&str)) -> Result<(), Fault> {
        let is_fast = self.question.contenders.iter().all(|own| own.hypothesis.machine.is_fast());
        let count = if is_fast { LATTICE.0 } else { LATTICE.1 } * self.space.axes.len().min(4);
        let places = self.space.lattice(count);
        progress(&format!("{count} points"));
        self.look(&places)?;
        if !self.seen.is_empty() {
            return Ok(());
        }
        let why = match (&self.looked.failed.1, self.looked.beyond, self.looked.forbidden) {
            (Some(why), ..) => format!("no planned shot can be run: {why}"),
            (None, 0, _) => "`[limits]` of the study forbid all points of these ranges".to_string(),
            (None, ..) => {
                "at all points of these ranges a channel leaves what `[limits.channels]` of the study allow".to_string()
            }
        };
        Err(Fault::new(why))
    }

    /// Pairs that are not told apart at any point that was run.
    fn hopeless(&self) -> Vec<(usize, usize)> {
        let needed = if matches!(self.question.aim, Aim::Apart) { LEAD } else { NEEDED };
        let most = |&(truth, model): &(usize, usize)| {
            self.seen.iter().map(|seen| self.question.evidence(&seen.shares, truth, model)).fold(0.0, f64::max)
        };
        self.question.compared().into_iter().filter(|pair| most(pair) < needed).collect()
    }

    /// Values the points anew, once it is known what counts.
    fn value(&mut self) {
        let worth: Vec<f64> = self.seen.iter().map(|own| self.worth(own, None)).collect();
        self.looked.seen.iter_mut().zip(worth).for_each(|(own, worth)| own.1 = worth);
    }

    /// Looks at places of the unit cube that were not looked at before.
    fn look(&mut self, places: &[Vec<f64>]) -> Result<(), Fault> {
        let mut points: Vec<Point> = Vec::new();
        for place in places {
            let Some(point) = self.space.at(place)? else {
                self.looked.forbidden += 1;
                continue;
            };
            let known = self.seen.iter().map(|own| &own.point).chain(&points);
            // On a coarse grid many places are the same point.
            if !known.into_iter().any(|known| known.values == point.values) {
                points.push(point);
            }
        }
        let Batch { seen, failed, beyond } = self.question.look(self.setup, self.space, &points)?;
        self.looked.failed.0 += failed.0;
        self.looked.failed.1 = self.looked.failed.1.take().or(failed.1);
        self.looked.beyond += beyond;
        let worth: Vec<(Point, f64)> = seen.iter().map(|own| (own.point.clone(), self.worth(own, None))).collect();
        self.looked.seen.extend(worth);
        self.seen.extend(seen);
        Ok(())
    }

    /// What a shot is worth beside those chosen before, by what it costs.
    fn worth(&self, own: &Seen, before: Option<&Chosen>) -> f64 {
        let gained = match before {
            None => self.question.worth(&own.shares),
            Some(before) => self.question.worth(&together(&before.shares, &own.shares)) - before.worth,
        };
        gained / own.point.cost
    }

    fn best(&self, before: Option<&Chosen>) -> Option<usize> {
        let worth: Vec<f64> = self.seen.iter().map(|own| self.worth(own, before)).collect();
        (0..worth.len()).max_by(|&a, &b| worth[a].total_cmp(&worth[b]).then(b.cmp(&a)))
    }

    /// The best point beside those chosen before.
    fn next(&mut self, before: Option<&Chosen>, progress: &dyn Fn(&str)) -> Result<Chosen, Fault> {
        let mut distance = NEIGHBOUR;
        for round in 0..ROUNDS {
            let Some(best) = self.best(before) else { break };
            let centre = self.space.cube(&self.seen[best].point);
            let mut places = Vec::new();
            for axis in 0..centre.len() {
                for side in [-distance, distance] {
                    let mut place = centre.clone();
                    place[axis] = (place[axis] + side).clamp(0.0, 1.0);
                    places.push(place);
                }
            }
            progress(&format!("around the best point, round {} of {ROUNDS}", round + 1));
            self.look(&places)?;
            distance /= 2.0;
        }
        let best = self.best(before).ok_or_else(|| Fault::run("no planned shot can be run"))?;
        let own = &self.seen[best];
        let shares = match before {
            None => own.shares.clone(),
            Some(before) => together(&before.shares, &own.shares),
        };
        let worth = self.question.worth(&shares);
        Ok(Chosen { point: own.point.clone(), shares, worth, farthest: Vec::new() })
    }

    /// By pair where the last of the points differs the most.
    fn farthest(&self, points: &[Point], shares: &[Share]) -> Result<Vec<Option<Farthest>>, Fault> {
        let pairs = self.question.compared();
        let mut found = Vec::with_capacity(pairs.len());
        for pair in pairs {
            let all = self.question.farthest(self.setup, self.space, (points, shares), pair)?;
            found.push(all.into_iter().next_back().flatten());
        }
        Ok(found)
    }
}

fn together(some: &[Share], others: &[Share]) -> Vec<Share> {
    some.iter().zip(others).map(|(a, b)| a.plus(b)).collect()
}
