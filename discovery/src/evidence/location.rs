//! Where is something missing?  Every term of every equation compared with the residuals of a fit, without a fit of its own.
//!
//! All terms are injected at once with coefficients of zero, and the runs carry the sensitivities to the coefficients
//! along: the change of the channels per unit of a term, with everything that follows from it.  What the nuisances can
//! imitate is taken out ([`crate::evidence::projection`]); what is left says by how much the cost would drop (the score test, Rao
//! 1948).  Where terms are many, the shot that is farthest from the model chooses those that are compared with all
//! shots.  Models with delays are not located by equation: a hundred directions through delays take minutes.

use std::collections::BTreeMap;

use nalgebra::DVector;

use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::projection::{Projection, Score};
use crate::evidence::thresholds::LEAD;
use crate::fit::{Fit, Jacobian};
use crate::machine::Job;
use crate::problem::{Problem, Runs, Weighing};
use crate::tasks::{Task, Tasks};
use crate::terms::dictionary::{Place, Shown, Term, places, terms};
use crate::variant::{Insert, Workshop, coefficient};
use crate::{Fault, Setup};

/// Share by which what terms explain differs when they are the same: rounding.
const SAME: f64 = 1e-6;
/// Terms looked at in one run.
pub(crate) const TOGETHER: usize = 96;
/// Terms that one shot leaves for all shots.
const SCREENED: usize = TOGETHER;
/// Coefficients of any size are taken.
pub(crate) const ANY: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// A term compared with the residuals.
#[derive(Clone, Debug)]
pub struct Located {
    /// The term.
    pub term: Term,
    /// Its score; the amplitude is the coefficient.
    pub score: Score,
}

/// All terms of all equations of a fitted model, the best first.  `exchangeable` are the paths
/// of components that are made to be exchanged: of equations that are equally good those of such components come first.  With `at`
/// only the equation of this term is looked at.
///
/// # Errors
/// When the model with terms cannot be translated or run.
pub(crate) fn locate(
    (setup, workshop, tasks): (&Setup, &Workshop<'_>, Tasks<'_>),
    hypothesis: &Hypothesis,
    (exchangeable, at): (&[&str], Option<&Term>),
    (fit, projection): (&Fit, &Projection<'_>),
    weighing: &Weighing,
) -> Result<Vec<Located>, Fault> {
    if !hypothesis.machine.is_fast() {
        return Ok(Vec::new());
    }
    let inserts: Vec<Insert> = hypothesis
        .inserts
        .iter()
        .map(|candidate| Insert { candidate: candidate.clone(), values: Vec::new() })
        .collect();
    let tables = hypothesis.machine.tables();
    let names = hypothesis.machine.channel_names();
    let mut places = places(workshop.injection_sites(&inserts, names), (tables, names), exchangeable);
    places.retain(|place| at.is_none_or(|term| term.is_at(&place.site)));
    let shown = shown(setup, workshop, hypothesis, &inserts, &places, (fit, weighing))?;
    let mut all: Vec<Term> =
        places.iter().flat_map(|place| terms(place, &shown, tables, exchangeable.is_empty())).collect();
    let look_at = |all: &[Term], fitted: (&Fit, &Projection<'_>), weighing: &Weighing| {
        let parts: Vec<&[Term]> = all.chunks(TOGETHER).collect();
        let task = |k: usize| {
            let place = |term: &Term| format!("{} {} {} {}", term.component, term.line, term.equation, term.shape);
            let terms: Vec<String> = parts[k].iter().map(place).collect();
            let shots: Vec<f64> = weighing.shots.iter().map(|&shot| shot as f64).collect();
            let words = format!("terms of {}: {}", hypothesis.key(), terms.join("; "));
            Task::new(words).from(&shots).with(fitted.0)
        };
        let make = |k: usize| Ok(look_or_halve((setup, workshop), hypothesis, &inserts, parts[k], fitted, weighing));
        let scores: Vec<Vec<Option<Score>>> = tasks.each(parts.len(), &setup.watch, &task, &mut { make })?;
        let scored = all.iter().zip(scores.concat());
        let scored = scored.filter_map(|(term, score)| Some(Located { term: term.clone(), score: score? }));
        let mut located: Vec<Located> = scored.collect();
        located.sort_by(|a, b| b.score.gain.total_cmp(&a.score.gain));
        Ok::<_, Fault>(located)
    };
    if all.len() > SCREENED && weighing.shots.len() > 1 {
        let (alone, own) = farthest_shot(&hypothesis.problem(setup)?, fit, weighing);
        if let Some(projection) = Projection::new(&alone) {
            let screened = look_at(&all, (&alone, &projection), &own)?;
            all = screened.into_iter().take(SCREENED).map(|located| located.term).collect();
        }
    }
    let mut located = look_at(&all, (fit, projection), weighing)?;
    // Equations that are as good as the best: first those of components that are meant to be exchanged.
    let best = located.first().map_or(0.0, |best| best.score.gain);
    let equal = located.partition_point(|own| own.score.gain > best - LEAD);
    located[..equal].sort_by_key(|own| !exchangeable.contains(&&*own.term.component));
    // Of terms that are the same but for a factor (a variable and twice that variable) those of the equation's own variables.
    let best = located.first().map_or(0.0, |best| best.score.gain);
    let same = located.iter().position(|own| own.score.gain < best * (1.0 - SAME)).unwrap_or(located.len());
    located[..same].sort_by_key(|own| strangers(&own.term));
    Ok(located)
}

/// Number of variables in a term's shape that its equation does not hold; functions such as `abs` do not count.
fn strangers(term: &Term) -> usize {
    let is_inside = |c: char| c.is_alphanumeric() || "_.[]'".contains(c);
    let variables = |text: &str| -> Vec<String> {
        let mut rest = text;
        let mut found = Vec::new();
        while let Some(begin) = rest.find(is_inside) {
            let (word, after) =
                rest[begin..].split_at(rest[begin..].find(|c| !is_inside(c)).unwrap_or(rest.len() - begin));
            if word.starts_with(char::is_alphabetic) && !after.starts_with('(') {
                found.push(word.to_string());
            }
            rest = after;
        }
        found
    };
    let known = variables(&term.equation);
    variables(&term.shape).iter().filter(|word| !known.contains(word)).count()
}

/// The fit seen on the one shot whose residuals are farthest from noise.
pub(crate) fn farthest_shot(problem: &Problem<'_>, fit: &Fit, weighing: &Weighing) -> (Fit, Weighing) {
    let alone = weighing.shots.iter().map(|&shot| of_one_shot(problem, fit, weighing, shot));
    let excess = |(fit, own): &(Fit, Weighing)| fit.residuals.norm_squared() - problem.expected(own);
    let farthest = alone.max_by(|a, b| excess(a).total_cmp(&excess(b)));
    farthest.unwrap_or_else(|| (fit.clone(), weighing.clone()))
}

/// The fit seen on one of its shots.
pub(crate) fn of_one_shot(problem: &Problem<'_>, fit: &Fit, weighing: &Weighing, shot: usize) -> (Fit, Weighing) {
    let own = Weighing { shots: vec![shot], ..weighing.clone() };
    let before = weighing.shots.iter().take_while(|&&other| other != shot).copied().collect();
    let (first, rows) = (problem.rows(&Weighing { shots: before, ..weighing.clone() }), problem.rows(&own));
    let cut = |own: &Jacobian| Jacobian::new(own.matrix.rows(first, rows).into_owned(), own.unknowns.clone());
    let residuals = fit.residuals.rows(first, rows).into_owned();
    (Fit { residuals, jacobian: fit.jacobian.as_ref().map(cut), ..fit.clone() }, own)
}

/// What the variables around the equations show in the fitted model.
fn shown(
    setup: &Setup,
    workshop: &Workshop<'_>,
    hypothesis: &Hypothesis,
    inserts: &[Insert],
    places: &[Place],
    fitted: (&Fit, &Weighing),
) -> Result<BTreeMap<String, Shown>, Fault> {
    let names = places.iter().flat_map(|place| place.variables.iter().map(|(_, full)| full.clone()));
    let courses = courses(setup, workshop, hypothesis, inserts, names.collect(), fitted)?;
    let of_all = |(name, shots): (String, Vec<Vec<f64>>)| Some((name, Shown::of(shots.concat())?));
    Ok(courses.into_iter().filter_map(of_all).collect())
}

/// Variables of the fitted model over time, by their full names: on the output points of each shot that the weighing has.
///
/// # Errors
/// When the model cannot be translated or run.
pub(crate) fn courses(
    setup: &Setup,
    workshop: &Workshop<'_>,
    hypothesis: &Hypothesis,
    inserts: &[Insert],
    mut names: Vec<String>,
    (fit, weighing): (&Fit, &Weighing),
) -> Result<BTreeMap<String, Vec<Vec<f64>>>, Fault> {
    names.sort_unstable();
    names.dedup();
    let watching = Workshop { channels: names.clone(), ..workshop.clone() };
    let machine = setup.machine_of(watching.translate(inserts)?, names.len())?;
    let problem = setup.problem(&machine, &hypothesis.inserts)?;
    let runs = problem.simulate(&fit.xi, weighing)?;
    let mut values: BTreeMap<String, Vec<Vec<f64>>> = BTreeMap::new();
    for run in weighing.shots.iter().filter_map(|&shot| runs[shot].as_ref()) {
        for (name, series) in names.iter().zip(run) {
            values.entry(name.clone()).or_default().push(series.clone());
        }
    }
    Ok(values)
}

/// Scores of some terms; none of those that a channel does not tell of.  A term may close a loop that cannot be solved from the start; such
/// a one is found by halving and has none either.
fn look_or_halve(
    (setup, workshop): (&Setup, &Workshop<'_>),
    hypothesis: &Hypothesis,
    inserts: &[Insert],
    terms: &[Term],
    fitted: (&Fit, &Projection<'_>),
    weighing: &Weighing,
) -> Vec<Option<Score>> {
    let (fit, projection) = fitted;
    match signatures(setup, workshop, hypothesis, inserts, terms, (&fit.xi, &fit.runs), weighing) {
        Ok(found) => found.iter().map(|own| own.as_ref().map(|own| projection.score(own, ANY))).collect(),
        Err(_) if terms.len() < 2 => vec![None; terms.len()],
        Err(_) => {
            let half = |terms: &[Term]| look_or_halve((setup, workshop), hypothesis, inserts, terms, fitted, weighing);
            let (left, right) = terms.split_at(terms.len() / 2);
            [half(left), half(right)].concat()
        }
    }
}

/// How the residuals change per unit of the coefficient of each term; none where a channel does not tell.
///
/// # Errors
/// When the model with terms cannot be translated or run.
pub(crate) fn signatures(
    setup: &Setup,
    workshop: &Workshop<'_>,
    hypothesis: &Hypothesis,
    inserts: &[Insert],
    terms: &[Term],
    (xi, runs): (&[f64], &Runs),
    weighing: &Weighing,
) -> Result<Vec<Option<DVector<f64>>>, Fault> {
    let known = hypothesis.terms.len();
    let all: Vec<Term> = hypothesis.terms.iter().map(|(term, _)| term).chain(terms).cloned().collect();
    let machine = setup.machine(workshop.translate_with_terms(inserts, &all)?)?;
    let mut problem = hypothesis.problem_of(setup, &machine)?;
    let first = problem.places.len();
    for k in 0..terms.len() {
        let (place, nominal) = machine.parameter(&coefficient(known + k))?;
        problem.places.push(place);
        problem.base.iter_mut().for_each(|values| values.push(nominal));
    }
    let derived: Vec<usize> = (first..first + terms.len()).collect();
    let job = |&shot: &usize| Job { span: shot, values: problem.values(xi, shot), derived: derived.clone() };
    let jobs: Vec<Job> = weighing.shots.iter().map(job).collect();
    let spans = problem.spans(weighing.horizon);
    let answers = machine.run_derived(&spans, &problem.places, &jobs);
    let mut parts = Vec::with_capacity(jobs.len());
    for (job, answer) in jobs.iter().zip(answers) {
        parts.push((job.span, answer?.1));
    }
    let rows = problem.rows(weighing);
    let signature = |k: usize| {
        let mut signature = Vec::with_capacity(rows);
        for (shot, derivatives) in &parts {
            let change = |channel: usize| derivatives[k][channel].clone();
            signature.extend(problem.response((xi, runs), *shot, &change, weighing)?);
        }
        (signature.len() == rows).then(|| DVector::from_vec(signature))
    };
    Ok((0..terms.len()).map(signature).collect())
}
