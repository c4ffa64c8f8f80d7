//! Rivals fitted to each other's records: by how much does the cost of a wrong one really grow with the proposed shots?
//!
//! What counts here is no longer linear.  The record of each rival, without noise, stands in for the shots; the other rivals are fitted to
//! the whole set with it, from where their fits ended.

use super::aim::{Aim, Question};
use super::planned::carried;
use super::space::{Point, Space};
use crate::evidence::hypothesis::Hypothesis;
use crate::fit::{Effort, minimise};
use crate::problem::Weighing;
use crate::variant::Workshop;
use crate::{Fault, Setup};

/// A rival fitted to another one's record.
pub(crate) struct Proved {
    /// Whose record, and who was fitted.
    pub pair: (usize, usize),
    /// Growth of the cost.
    pub growth: f64,
    /// By planned shot and channel what the fitted rival shows; nothing for channels that the shot lacks.
    pub shown: Vec<Vec<Vec<f64>>>,
    /// What the record shows.
    pub record: Vec<Vec<Vec<f64>>>,
    /// Times of each planned shot (s).
    pub times: Vec<Vec<f64>>,
}

/// Fits every pair of rivals; nothing where there are none.
///
/// # Errors
/// A text that cannot be translated, a record that cannot be made.
pub(crate) fn prove(
    (setup, space): (&Setup, &Space<'_>),
    workshop: &Workshop<'_>,
    question: &Question,
    points: &[Point],
) -> Result<Vec<Proved>, Fault> {
    if !matches!(question.aim, Aim::Apart) {
        return Ok(Vec::new());
    }
    let conditions: Vec<_> = points.iter().map(|point| point.conditions.clone()).collect();
    let draft = setup.planned(space.template, &conditions)?;
    let all = Weighing::whole(&(0..points.len()).collect::<Vec<_>>(), 0.0);
    let mut found = Vec::new();
    for truth in 0..question.contenders.len() {
        let models: Vec<usize> =
            question.compared().into_iter().filter(|pair| pair.0 == truth).map(|pair| pair.1).collect();
        if models.is_empty() {
            continue;
        }
        let own = &question.contenders[truth];
        let joined = {
            let problem = own.hypothesis.problem(&draft)?;
            let xi = own.unknowns(setup, &problem)?;
            let runs = problem.simulate(&xi, &all)?;
            setup.joined(&draft.showing(&problem, &xi, &runs)?)
        };
        for model in models {
            // A fit that does not succeed proves nothing, and the expected growth stands alone.
            if let Ok(proved) = fitted(setup, &joined, workshop, question, (truth, model)) {
                found.push(proved);
            }
        }
    }
    Ok(found)
}

fn fitted(
    setup: &Setup,
    joined: &Setup,
    workshop: &Workshop<'_>,
    question: &Question,
    (truth, model): (usize, usize),
) -> Result<Proved, Fault> {
    let own = &question.contenders[model];
    let of = &own.hypothesis;
    let hypothesis = Hypothesis::with_terms(joined, workshop, of.inserts.clone(), of.terms.clone())?;
    let problem = hypothesis.problem(joined)?;
    let made = own.made.problem(setup)?;
    let mut xi = carried(&made, &own.fit.xi, &problem);
    for (unknown, xi) in problem.unknowns.iter().zip(&mut xi) {
        // What belongs to a shot that was made is where its fit ended.
        let before = |(other, _): &(&crate::unknowns::Unknown, &f64)| other.name == unknown.name;
        if unknown.shot.is_some_and(|shot| shot < setup.bench.shots.len())
            && let Some((_, before)) = made.unknowns.iter().zip(&own.fit.xi).find(before)
        {
            *xi = *before;
        }
    }
    let whole = Weighing::whole(&joined.train, joined.study.shots.time_tolerance);
    let fit = minimise(&problem, &xi, &whole, Effort::FULL, None)?;
    // The record of a rival has no noise, and its own cost does not grow with it.
    let growth = (fit.cost - own.fit.cost).max(0.0);
    let first = setup.bench.shots.len();
    let planned = first..joined.bench.shots.len();
    let channels = 0..joined.data.channels.len();
    let measured = |shot: usize, channel: usize| joined.data.shots[shot].traces[channel].as_ref();
    let shown = planned.clone().map(|shot| {
        let of = |channel: usize| match measured(shot, channel) {
            Some(_) => problem.shown(&fit.xi, &fit.runs, shot, channel),
            None => Vec::new(),
        };
        channels.clone().map(of).collect()
    });
    let record = planned.clone().map(|shot| {
        channels.clone().map(|channel| measured(shot, channel).map_or(Vec::new(), |own| own.values.clone())).collect()
    });
    let times = planned.clone().map(|shot| joined.data.shots[shot].times.clone());
    Ok(Proved {
        pair: (truth, model),
        growth,
        shown: shown.collect(),
        record: record.collect(),
        times: times.collect(),
    })
}

impl Question {
    /// Pairs that a report tells of: whose record, and which model is fitted to it.
    pub(crate) fn compared(&self) -> Vec<(usize, usize)> {
        let count = self.contenders.len();
        let all: Vec<(usize, usize)> = match self.aim {
            Aim::Apart => (0..count).flat_map(|model| (0..count).map(move |truth| (truth, model))).collect(),
            Aim::Reveal { .. } => (1..count).map(|truth| (truth, 0)).collect(),
            Aim::Narrow { .. } => Vec::new(),
        };
        all.into_iter().filter(|pair| pair.0 != pair.1 && !self.hopeless.contains(pair)).collect()
    }
}
