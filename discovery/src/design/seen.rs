//! Planned shots run by all contenders: what they say of each model, point by point.

use nalgebra::{DMatrix, DVector};

use super::aim::{Aim, Question};
use super::evidence::{Share, left};
use super::space::{Point, Space};
use crate::fit::Effort;
use crate::problem::{Problem, Runs, Weighing};
use crate::unknowns::Unknown;
use crate::{Fault, Setup};

/// Shots that are run at once: their residuals and derivatives are held together.
pub(crate) const BATCH: usize = 16;

/// A point and what a shot there says.
#[derive(Clone)]
pub(crate) struct Seen {
    /// The point.
    pub point: Point,
    /// By contender.
    pub shares: Vec<Share>,
}

/// What came of some points.
#[derive(Default)]
pub(crate) struct Batch {
    /// Those that were run.
    pub seen: Vec<Seen>,
    /// How many cannot be run by every model, and why the first cannot.
    pub failed: (usize, Option<String>),
    /// How many would leave what a channel may show.
    pub beyond: usize,
}

/// A contender on planned shots.
struct Planned<'a> {
    problem: Problem<'a>,
    xi: Vec<f64>,
    runs: Runs,
}

/// Where the rivals differ the most in a planned shot when everything has followed.
#[derive(Clone, Debug)]
pub(crate) struct Farthest {
    /// The channel.
    pub channel: usize,
    /// When (s).
    pub time: f64,
    /// Distance in standard deviations of the noise.
    pub deviations: f64,
}

impl Question {
    /// Runs shots at these points.
    ///
    /// # Errors
    /// A condition that a formula needs and the shots do not record, a value that no variable has.
    pub(crate) fn look(&self, setup: &Setup, space: &Space<'_>, points: &[Point]) -> Result<Batch, Fault> {
        let mut batch = Batch::default();
        for part in points.chunks(BATCH) {
            self.look_at_once(setup, space, part, &mut batch)?;
            if setup.watch.stopped() {
                return Err(Fault::run("interrupted"));
            }
        }
        Ok(batch)
    }

    fn look_at_once(&self, setup: &Setup, space: &Space<'_>, points: &[Point], batch: &mut Batch) -> Result<(), Fault> {
        let conditions: Vec<_> = points.iter().map(|point| point.conditions.clone()).collect();
        let draft = setup.planned(space.template, &conditions)?;
        let mut kept: Vec<usize> = (0..points.len()).collect();
        let mut all_runs: Vec<Runs> = Vec::new();
        for contender in &self.contenders {
            let problem = contender.hypothesis.problem(&draft)?;
            let xi = contender.unknowns(setup, &problem)?;
            let (runs, failures) = runs(&problem, &xi, &kept);
            for (shot, fault) in failures {
                kept.retain(|&own| own != shot);
                batch.failed.0 += 1;
                batch.failed.1.get_or_insert(fault.sentence);
            }
            kept.retain(|&shot| {
                let is_inside = shows_what_it_may(&draft, space, (&problem, &xi, &runs), shot);
                batch.beyond += usize::from(!is_inside);
                is_inside
            });
            all_runs.push(runs);
        }
        if kept.is_empty() {
            return Ok(());
        }
        // Weighed as a record of the first contender.
        let shown = {
            let first = self.contenders[0].hypothesis.problem(&draft)?;
            let xi = self.contenders[0].unknowns(setup, &first)?;
            draft.showing(&first, &xi, &all_runs[0])?
        };
        let whole = Weighing::whole(&kept, setup.study.shots.time_tolerance);
        let mut planned = Vec::with_capacity(self.contenders.len());
        for (contender, runs) in self.contenders.iter().zip(all_runs) {
            let problem = contender.hypothesis.problem(&shown)?;
            let xi = contender.unknowns(setup, &problem)?;
            planned.push(Planned { problem, xi, runs });
        }
        let residuals: Vec<DVector<f64>> =
            planned.iter().map(|own| own.problem.residuals(&own.xi, &own.runs, &whole)).collect();
        let parts = planned[0].problem.parts(&whole);
        let mut shares: Vec<Vec<Share>> = vec![Vec::new(); kept.len()];
        for (k, own) in planned.iter().enumerate() {
            let Some(columns) = self.columns(setup, k, &own.problem)? else {
                shares.iter_mut().for_each(|list| list.push(Share::none(0, 0)));
                continue;
            };
            let all: Vec<usize> = (0..own.problem.unknowns.len()).collect();
            let jacobian = own.problem.jacobian((&own.xi, &own.runs), &whole, &all, Effort::FULL.difference)?;
            let rivals = self.rivals(k);
            for ((list, part), &shot) in shares.iter_mut().zip(&parts).zip(&kept) {
                let rows = jacobian.rows(part.start, part.len()).into_owned();
                let (common, own) = divided(&rows, &columns, &own.problem.unknowns, shot);
                let change = |rival: usize| -> DVector<f64> {
                    (&residuals[k] - &residuals[rival]).rows(part.start, part.len()).into_owned()
                };
                let changes: Vec<DVector<f64>> = (0..rivals).map(change).collect();
                let share = Share::of(&common, &own, &changes);
                list.push(share.ok_or_else(|| Fault::run("a planned shot has derivatives that are not finite"))?);
            }
        }
        for (shares, &shot) in shares.into_iter().zip(&kept) {
            batch.seen.push(Seen { point: points[shot].clone(), shares });
        }
        Ok(())
    }

    /// By unknown of all shots of a contender's fit its column for planned shots; none for one that is only looked at.
    fn columns(&self, setup: &Setup, contender: usize, to: &Problem<'_>) -> Result<Option<Vec<Option<usize>>>, Fault> {
        let Some(known) = &self.contenders[contender].known else { return Ok(None) };
        let from = self.contenders[contender].made.problem(setup)?;
        let column = |&unknown: &usize| {
            let own = &from.unknowns[unknown];
            to.unknowns
                .iter()
                .position(|other| other.shot.is_none() && other.name == own.name && other.effect == own.effect)
        };
        Ok(Some(known.common.iter().map(column).collect()))
    }

    /// Where in planned shots a model, with everything followed, is farthest from a rival's record.
    pub(crate) fn farthest(
        &self,
        setup: &Setup,
        space: &Space<'_>,
        (points, shares): (&[Point], &[Share]),
        (truth, model): (usize, usize),
    ) -> Result<Vec<Option<Farthest>>, Fault> {
        let Some(known) = &self.contenders[model].known else { return Ok(vec![None; points.len()]) };
        let mut all = shares[model].clone();
        if let Aim::Reveal { before } = &self.aim {
            all.against[truth].0 += before[truth].0;
            all.against[truth].1 += &before[truth].1;
        }
        let Some((_, moved)) = all.growth(&known.information, truth) else { return Ok(vec![None; points.len()]) };
        let conditions: Vec<_> = points.iter().map(|point| point.conditions.clone()).collect();
        let draft = setup.planned(space.template, &conditions)?;
        let whole = Weighing::whole(&(0..points.len()).collect::<Vec<_>>(), setup.study.shots.time_tolerance);
        let residuals = |contender: usize, shown: &Setup| -> Result<(DVector<f64>, Option<DMatrix<f64>>), Fault> {
            let own = &self.contenders[contender];
            let problem = own.hypothesis.problem(shown)?;
            let xi = own.unknowns(setup, &problem)?;
            let runs = problem.simulate(&xi, &whole)?;
            let all: Vec<usize> = (0..problem.unknowns.len()).collect();
            let jacobian = match contender == model {
                true => Some(problem.jacobian((&xi, &runs), &whole, &all, Effort::FULL.difference)?),
                false => None,
            };
            Ok((problem.residuals(&xi, &runs, &whole), jacobian))
        };
        let shown = {
            let own = &self.contenders[truth];
            let problem = own.hypothesis.problem(&draft)?;
            let xi = own.unknowns(setup, &problem)?;
            let runs = problem.simulate(&xi, &whole)?;
            draft.showing(&problem, &xi, &runs)?
        };
        let (of_model, jacobian) = residuals(model, &shown)?;
        let (of_truth, _) = residuals(truth, &shown)?;
        let Some(jacobian) = jacobian else { return Ok(vec![None; points.len()]) };
        let problem = self.contenders[model].hypothesis.problem(&shown)?;
        let Some(columns) = self.columns(setup, model, &problem)? else { return Ok(vec![None; points.len()]) };
        let change = of_model - of_truth;
        let found = problem.parts(&whole).into_iter().enumerate().map(|(shot, part)| {
            let rows = jacobian.rows(part.start, part.len()).into_owned();
            let (common, own) = divided(&rows, &columns, &problem.unknowns, shot);
            let rest = left(&common, &own, &change.rows(part.start, part.len()).into_owned(), &moved)?;
            let (row, deviations) =
                rest.iter().map(|value| value.abs()).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
            let data = &shown.data.shots[shot];
            let measured: Vec<usize> = (0..data.traces.len()).filter(|&k| data.traces[k].is_some()).collect();
            Some(Farthest {
                channel: measured[row / data.times.len()],
                time: data.times[row % data.times.len()],
                deviations,
            })
        });
        Ok(found.collect())
    }
}

/// Derivatives by the unknowns of all shots, in the order of a fit's, and by those of one shot.
fn divided(
    rows: &DMatrix<f64>,
    columns: &[Option<usize>],
    unknowns: &[Unknown],
    shot: usize,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let common = DMatrix::from_fn(rows.nrows(), columns.len(), |i, k| columns[k].map_or(0.0, |own| rows[(i, own)]));
    let own: Vec<usize> = (0..unknowns.len()).filter(|&k| unknowns[k].shot == Some(shot)).collect();
    (common, rows.select_columns(&own))
}

/// Runs of some shots, and why the others cannot be run.
fn runs(problem: &Problem<'_>, xi: &[f64], shots: &[usize]) -> (Runs, Vec<(usize, Fault)>) {
    if let Ok(runs) = problem.simulate(xi, &Weighing::whole(shots, 0.0)) {
        return (runs, Vec::new());
    }
    let mut runs: Runs = vec![None; problem.data.shots.len()];
    let mut failures = Vec::new();
    for &shot in shots {
        match problem.simulate(xi, &Weighing::whole(&[shot], 0.0)) {
            Ok(mut own) => runs[shot] = own[shot].take(),
            Err(fault) => failures.push((shot, fault)),
        }
    }
    (runs, failures)
}

/// True if all channels of a shot stay within what they may show.
fn shows_what_it_may(
    setup: &Setup,
    space: &Space<'_>,
    (problem, xi, runs): (&Problem<'_>, &[f64], &Runs),
    shot: usize,
) -> bool {
    setup.data.channels.iter().enumerate().all(|(place, channel)| {
        let (low, high) = space.shown(&channel.name);
        let is_free = low == f64::NEG_INFINITY && high == f64::INFINITY;
        is_free
            || problem.shown(xi, runs, shot, place).iter().all(|&value| (low..=high).contains(&(channel.scale * value)))
    })
}
