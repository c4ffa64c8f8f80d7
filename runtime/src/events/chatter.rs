//! Noticing when instants pile up.
//!
//! Many events without progress in time are chattering and end the run, because integration would take forever.  So are events at
//! ever shorter distance: beyond the point where they accumulate the model says nothing, and rounding would let a ball fall through
//! its floor.  The last events are kept to say which relations take part, how often and whether in turns.  A hysteresis is
//! proposed from the rate at which the relation is crossed: what is `w` wide and crossed at the rate `r` is crossed back after about
//! `2 w/r`, and that shall be the part [`PERIOD`] of the run.

use std::collections::VecDeque;

use hyd_system::RootInfo;

use super::relations;
use crate::error::SolveError;
use crate::problem::Problem;

/// Events in a row, each closer to the last than `CLOSE` of the run, that count as chattering.
const MOST_CLOSE_EVENTS: u32 = 200;
const CLOSE: f64 = 1e-9;
/// After so many it is looked whether they change anything.
const FEW_CLOSE_EVENTS: u32 = 3;
/// Close events in a row, each nearer to the last than that was to the one before, that count as accumulating.
const MOST_SHRINKING_GAPS: u32 = 5;
const CLOSE_SHRINKING: f64 = 1e-8;
/// Events of one relation in a row, each closer to the last than `NEAR` of the run, that will come to no end in reasonable time: a ball on
/// something that moves, whose bounces stay at the size of rounding.
const MOST_NEAR_EVENTS: u32 = 1000;
const NEAR: f64 = 1e-7;
/// Before them the distances shrank to this part of each other, so that the events accumulate.
const FALLEN: f64 = 0.9;
/// Events that are kept.
const KEPT: usize = 100;
/// Two relations take turns if the one follows the other in at least this part of the events.
const IN_TURNS: f64 = 0.8;
/// A hysteresis is proposed that is crossed back after this part of the run.
const PERIOD: f64 = 1e-3;
/// Part of the run over which the rate of a relation is taken.
const AHEAD: f64 = 1e-7;

/// A relation that takes part in chattering.
#[derive(Clone, PartialEq, Debug)]
pub struct Chattering {
    /// The relation.
    pub relation: RootInfo,
    /// How often it changed among the last events.
    pub count: usize,
    /// Width of a hysteresis in its compared values, where their rate is known.
    pub width: Option<f64>,
}

/// The events that piled up.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Pile {
    /// The relations, the most frequent first.
    pub relations: Vec<Chattering>,
    /// Number of events looked at.
    pub events: usize,
    /// The time that they took (s).
    pub within: f64,
    /// The two most frequent change in turns.
    pub in_turns: bool,
}

/// An event that was seen.
#[derive(Clone, Copy, Debug, serde::Serialize, serde::Deserialize)]
struct Seen {
    t: f64,
    /// The first relation that changed; `None` at an event of time.
    relation: Option<usize>,
}

/// Counts events that follow each other closely, and those at ever shorter distance.
#[derive(Clone, Default, Debug, serde::Serialize, serde::Deserialize)]
pub(crate) struct Chatter {
    last: Option<f64>,
    gap: f64,
    close: u32,
    shrinking: u32,
    near: u32,
    /// Shrinking distances in a row before they stayed about the same.
    fallen: u32,
    recent: VecDeque<Seen>,
}

impl Chatter {
    /// Notes an event at `t` of a run of length `span` (s); an error if there were too many close by, or if their distances shrink
    /// towards a point in time that no number of events will reach (a bouncing ball).  `y`, `yp`: values before the event.
    pub(crate) fn note(
        &mut self,
        (t, span): (f64, f64),
        fired: &[bool],
        problem: &mut Problem<'_>,
        (y, yp): (&[f64], &[f64]),
    ) -> Result<(), SolveError> {
        let gap = self.last.map_or(f64::INFINITY, |last| t - last);
        let close = gap <= CLOSE * span;
        self.close = if close { self.close + 1 } else { 0 };
        self.shrinking = if gap <= CLOSE_SHRINKING * span && gap < self.gap { self.shrinking + 1 } else { 0 };
        let relation = fired.iter().position(|&fired| fired);
        let again = relation.is_some() && self.recent.back().is_some_and(|last| last.relation == relation);
        self.near = if again && gap <= NEAR * span { self.near + 1 } else { 0 };
        self.fallen = match gap {
            gap if gap < FALLEN * self.gap => self.fallen + 1,
            gap if gap <= 2.0 * self.gap => self.fallen,
            _ => 0,
        };
        (self.last, self.gap) = (Some(t), gap);
        if self.recent.len() == KEPT {
            self.recent.pop_front();
        }
        self.recent.push_back(Seen { t, relation });
        let is_near = self.near >= MOST_NEAR_EVENTS;
        let accumulating = self.shrinking >= MOST_SHRINKING_GAPS || is_near && self.fallen >= MOST_SHRINKING_GAPS;
        if self.close < MOST_CLOSE_EVENTS && !accumulating && !is_near {
            return Ok(());
        }
        let relations = relations(problem, fired);
        let pile = Box::new(self.pile((t, span), problem, (y, yp)));
        Err(SolveError::Chattering { time: t, events: self.close.max(self.near), accumulating, relations, pile })
    }

    /// The last event was one of several that followed each other closely.
    pub(crate) fn is_close(&self) -> bool {
        self.close >= FEW_CLOSE_EVENTS
    }

    /// What is known of the last events, of those that belong together.
    fn pile(&self, (t, span): (f64, f64), problem: &mut Problem<'_>, (y, yp): (&[f64], &[f64])) -> Pile {
        let mut from = self.recent.len();
        while from > 0 && self.recent.get(from).is_none_or(|later| later.t - self.recent[from - 1].t <= NEAR * span) {
            from -= 1;
        }
        let seen: Vec<Seen> = self.recent.iter().skip(from).copied().collect();
        let tables = problem.system.tables().clone();
        let mut counts: Vec<(usize, usize)> = Vec::new();
        for relation in seen.iter().filter_map(|seen| seen.relation) {
            match counts.iter_mut().find(|(known, _)| *known == relation) {
                Some((_, count)) => *count += 1,
                None => counts.push((relation, 1)),
            }
        }
        counts.sort_by_key(|&(relation, count)| (std::cmp::Reverse(count), relation));
        let turns = match counts.as_slice() {
            [(a, _), (b, _), ..] => {
                let pair = |x: &Seen, y: &Seen| (x.relation, y.relation) == (Some(*a), Some(*b));
                seen.windows(2).filter(|w| pair(&w[0], &w[1]) || pair(&w[1], &w[0])).count()
            }
            _ => 0,
        };
        let rates = rates(problem, (t, AHEAD * span), (y, yp));
        let width = |k: usize| {
            let rate = rates.get(k).copied().filter(|rate| rate.is_finite() && *rate != 0.0)?;
            Some(0.5 * PERIOD * span * rate.abs())
        };
        let of = |&(k, count): &(usize, usize)| {
            Some(Chattering { relation: tables.roots.get(k)?.clone(), count, width: width(k) })
        };
        Pile {
            relations: counts.iter().filter_map(of).collect(),
            events: seen.len(),
            within: seen.first().map_or(0.0, |first| t - first.t),
            in_turns: seen.len() > 1 && turns as f64 >= IN_TURNS * (seen.len() - 1) as f64,
        }
    }
}

/// The rates of all root functions along the solution at `t`, taken over the time `ahead` (s).
fn rates(problem: &mut Problem<'_>, (t, ahead): (f64, f64), (y, yp): (&[f64], &[f64])) -> Vec<f64> {
    let count = problem.system.structure().roots;
    let (mut now, mut then) = (vec![f64::NAN; count], vec![f64::NAN; count]);
    problem.system.roots(t, y, yp, &mut now);
    // Only states go on with their rates; others are found by equations, and stay out of account.
    let mut states = problem.system.structure().differential.clone();
    problem.system.states(&mut states);
    let moved = |k: usize| if states[k] { y[k] + ahead * yp[k] } else { y[k] };
    let later: Vec<f64> = (0..y.len()).map(moved).collect();
    problem.system.roots(t + ahead, &later, yp, &mut then);
    now.iter().zip(&then).map(|(now, then)| (then - now) / ahead).collect()
}
