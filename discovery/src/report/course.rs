//! What an equation lacks over time: of something unknown as free as the records allow, of a law what it adds and what the records leave open.

use serde_json::{Value, json};

use super::{Scene, number};
use crate::Fault;
use crate::disturbance::Disturbances;
use crate::evidence::hypothesis::Hypothesis;
use crate::evidence::location::courses;
use crate::evidence::missing::{Course, missing};
use crate::fit::Fit;
use crate::problem::Weighing;
use crate::search::Status;
use crate::terms::dictionary::Term;
use crate::terms::law::Law;
use crate::variant::Insert;

/// The course at the likeliest equation where something unknown is missing, or at that of a law; null where it cannot be told.
pub(super) fn missing_over_time(scene: &Scene<'_>) -> Value {
    let &Scene { setup, last, findings, .. } = scene;
    if !last.base.machine.is_fast() {
        return Value::Null;
    }
    // What counts as model error elsewhere is what is looked for here.
    let plain = setup.disturbed(Disturbances { levels: Vec::new(), ..setup.disturbances.clone() });
    let scene = &Scene { setup: plain.as_ref().unwrap_or(setup), ..*scene };
    let found = match (findings.status, &findings.law) {
        (Status::Unknown, _) => unknown(scene),
        (Status::Law, Some(law)) => of_law(scene, law),
        _ => Ok(None),
    };
    // A course that closes a loop that cannot be solved, or a run that fails with it, leaves the rest of the report as it is.
    found.ok().flatten().unwrap_or(Value::Null)
}

/// As smooth as the records allow.
fn unknown(scene: &Scene<'_>) -> Result<Option<Value>, Fault> {
    let last = scene.last;
    let fitted = last.terms.first().and_then(|tried| tried.hypothesis.terms.last()).map(|(term, _)| term);
    let Some(term) = fitted.or(last.located.first().map(|own| &own.term)) else { return Ok(None) };
    let courses = free(scene, (&last.base, &last.fit.xi), term)?;
    Ok(Some(written(scene, term, courses.iter().map(|own| course(scene, own)).collect())))
}

/// What a law adds in the model that has it, and beside it what the records would have added as well: where the law is all, that is nothing.
fn of_law(scene: &Scene<'_>, law: &Law) -> Result<Option<Value>, Fault> {
    let &Scene { setup, workshop, last, .. } = scene;
    let (Some(own), Some(expression)) = (law.terms.first(), law.expression()) else { return Ok(None) };
    let inserts: Vec<Insert> =
        last.base.inserts.iter().map(|own| Insert { candidate: own.clone(), values: Vec::new() }).collect();
    // The equation as it stands in the class that was written.
    let before = own.term.equation.trim_end_matches(';').trim();
    let (left, right) = before.split_once('=').unwrap_or((before, ""));
    let begins = [before.to_string(), format!("{left}= ({}) +", right.trim())];
    let sites = workshop.injection_sites(&inserts, last.base.machine.channel_names());
    let is_it = |text: &str| begins.iter().any(|begin| text.starts_with(begin.as_str()));
    let Some(site) = sites.iter().find(|site| site.path == own.term.component && is_it(&site.text)) else {
        return Ok(None);
    };
    let (file, line, equation) = (site.file.clone(), site.line, site.text.clone());
    let term = Term { file, line, equation, shape: "1".to_string(), ..own.term.clone() };
    let weighing = Weighing::whole(&setup.train, setup.study.shots.time_tolerance);
    let added = courses(setup, workshop, &last.base, &inserts, vec![expression.clone()], (&last.fit, &weighing))?
        .remove(&expression);
    let Some(added) = added else { return Ok(None) };
    let courses = free(scene, (&last.base, &last.fit.xi), &term)?;
    let shots = courses.into_iter().filter_map(|mut free| {
        let at = weighing.shots.iter().position(|&shot| shot == free.shot)?;
        let span = &setup.data.shots[free.shot].span;
        let law: Vec<f64> = free.times.iter().map(|&time| span.at(&added[at], time).0).collect();
        free.values.iter_mut().zip(&law).for_each(|(value, law)| *value += law);
        let mut json = course(scene, &free);
        json["law"] = json!(law);
        Some(json)
    });
    Ok(Some(written(scene, &own.term, shots.collect())))
}

/// The free course at an equation of a fitted model.
fn free(scene: &Scene<'_>, (hypothesis, xi): (&Hypothesis, &[f64]), term: &Term) -> Result<Vec<Course>, Fault> {
    let &Scene { setup, workshop, .. } = scene;
    let weighing = Weighing::whole(&setup.train, setup.study.shots.time_tolerance);
    let problem = hypothesis.problem(setup)?;
    let mut fit = Fit::at(&problem, xi, &weighing)?;
    drop(problem);
    hypothesis.refresh(setup, &mut fit, &weighing)?;
    missing(setup, workshop, (hypothesis, &fit), term, &weighing)
}

fn course(scene: &Scene<'_>, own: &Course) -> Value {
    json!({"shot": scene.setup.data.shots[own.shot].number, "time": own.times, "value": own.values, "stderr": own.errors,
        "misfit": {"before": number(own.misfit.0), "after": number(own.misfit.1)}})
}

fn written(scene: &Scene<'_>, term: &Term, shots: Vec<Value>) -> Value {
    json!({"equation": term.equation, "component": &*term.component, "file": scene.workshop.shown_file(&term.file), "line": term.line,
        "unit": term.of_equation, "shots": shots})
}
