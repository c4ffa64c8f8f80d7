//! One model in all ways: what differs, if anything.

use std::panic::{AssertUnwindSafe, catch_unwind};

use hyd_differential::evaluate::{Solution, Trouble, evaluate};
use hyd_differential::model::{Expr, Kind, Model, Role, Shape};
use hyd_differential::print::{Form, column, text};

use crate::ways::{Rows, Way, translate};

/// Allowed difference between the solver and the direct evaluation, relative to 1 and the value.
const ALLOWED: f64 = 1e-5;
/// Instants at which values are compared.
const INSTANTS: usize = 24;

/// A check of a model: a form of its text, and what is asked of it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Check {
    /// The three ways for the plain text.
    Ways,
    /// Loops and components written out.
    WrittenOut,
    /// Parameters as constants.
    Constants,
    /// Parameters set on the translated model, sizes before the translation.
    Set,
}

/// All checks.
pub(crate) const CHECKS: [Check; 4] = [Check::Ways, Check::WrittenOut, Check::Constants, Check::Set];

/// A difference.
#[derive(Clone, Debug)]
pub(crate) struct Difference {
    /// What kind it is: only the same kind counts while a case is made smaller.
    pub kind: String,
    /// What a reader needs to know.
    pub details: String,
    /// The text.
    pub text: String,
}

/// What came out of a check.
pub(crate) enum Verdict {
    /// All ways agree.
    Same,
    /// The model says too little: none of the product's business.
    Unclear(String),
    /// They do not.
    Different(Difference),
}

/// Instants that lie on no multiple of 1/32 s, but for the start and the stop.
fn instants(model: &Model) -> Vec<f64> {
    let inner = (0..INSTANTS).map(|k| model.stop * (k as f64 + 0.37) / INSTANTS as f64);
    std::iter::once(0.0).chain(inner).chain(std::iter::once(model.stop)).collect()
}

/// The names and values of what is set, and the model that declares these values.
fn changed(model: &Model) -> (Vec<(String, String)>, Model) {
    let mut other = model.clone();
    let mut set = Vec::new();
    let mut longer = Vec::new();
    for (id, variable) in other.variables.iter_mut().enumerate().filter(|(_, v)| !v.dropped) {
        match (variable.role, &variable.value) {
            (Role::Parameter, Some(Expr::Number(value))) => {
                let value = value * 1.25 + 0.125;
                variable.value = Some(Expr::Number(value));
                set.push((column(model, Form::default(), id, 0), format!("{value}")));
            }
            (Role::Parameter, Some(Expr::Array(list))) if variable.sizes.len() == 1 => {
                let Some(Expr::Number(first)) = list.first() else { continue };
                let value = first + 0.25;
                let mut list = list.clone();
                list[0] = Expr::Number(value);
                variable.value = Some(Expr::Array(list));
                set.push((column(model, Form::default(), id, 0), format!("{value}")));
            }
            (Role::Structural, Some(Expr::Number(value))) => {
                let value = value + 1.0;
                variable.value = Some(Expr::Number(value));
                set.push((variable.name.clone(), format!("{value}")));
                longer.push((id, value as usize));
            }
            _ => {}
        }
    }
    for variable in &mut other.variables {
        if let Some((_, n)) = longer.iter().find(|(id, _)| variable.size_by == Some(*id)) {
            variable.sizes[0] = *n;
        }
    }
    (set, other)
}

/// Compares values with those of the direct evaluation.
fn deviation(model: &Model, form: Form, expected: &Solution, rows: &Rows) -> Option<String> {
    for (id, variable) in model.variables.iter().enumerate().filter(|(_, v)| !v.dropped) {
        for element in 0..variable.count() {
            let name = column(model, form, id, element);
            let Some(values) = rows.values(&name) else { return Some(format!("there is no `{name}`")) };
            for (k, (time, value)) in expected.times.iter().zip(values).enumerate() {
                if expected.is_near_event(*time) {
                    continue;
                }
                let right = expected.rows[k][id][element];
                let allowed = if variable.kind == Kind::Real { ALLOWED * (1.0 + right.abs()) } else { 0.0 };
                // What is not a number agrees with nothing.
                if (value - right).abs() <= allowed {
                    continue;
                }
                return Some(format!("`{name}` at {time} s is {value}, and {right} by direct evaluation"));
            }
        }
    }
    None
}

fn different(kind: &str, details: String, text: &str) -> Verdict {
    Verdict::Different(Difference { kind: kind.to_string(), details, text: text.to_string() })
}

fn failed(message: &str, text: &str) -> Verdict {
    let (kind, details) = message.split_once('\n').unwrap_or((message, ""));
    different(kind, details.to_string(), text)
}

/// What a model computes by direct evaluation.
pub(crate) fn reference(model: &Model) -> Result<Solution, Trouble> {
    evaluate(model, &instants(model))
}

/// Makes one check of a model; `known`: its direct evaluation, where the caller has it.
pub(crate) fn check(model: &Model, check: Check, known: Option<&Solution>) -> Verdict {
    let (set, meant) = match check {
        Check::Set => changed(model),
        _ => (Vec::new(), model.clone()),
    };
    let form = match check {
        Check::WrittenOut => Form { unrolled: true, flat: true, constant: false },
        Check::Constants => Form { constant: true, ..Form::default() },
        _ => Form::default(),
    };
    if check == Check::WrittenOut && !has_loops(model) || check == Check::Set && set.is_empty() {
        return Verdict::Same;
    }
    let times = instants(model);
    let known = known.filter(|_| check != Check::Set);
    let expected = match known.cloned().map_or_else(|| reference(&meant), Ok) {
        Ok(expected) => expected,
        Err(Trouble::Unclear(reason)) => return Verdict::Unclear(reason),
        Err(Trouble::Wrong(reason)) => return different("nonsense", reason, &text(model, form)),
    };
    let written = text(model, form);
    let settings: String = set.iter().map(|(n, v)| format!("// --set {n}={v}\n")).collect();
    let shown = format!("{settings}{written}");
    let run = || -> Verdict {
        let translated = match translate(&written, &set) {
            Ok(translated) => translated,
            Err(message) => return failed(&message, &shown),
        };
        let native = match translated.run(Way::Native, &times) {
            Ok(rows) => rows,
            Err(message) => return failed(&message, &shown),
        };
        if check == Check::Ways {
            for way in [Way::Interpreted, Way::Read] {
                match translated.run(way, &times) {
                    Err(message) => return failed(&format!("{way:?} {message}"), &shown),
                    Ok(rows) if rows.bits() != native.bits() => {
                        let other = deviation(&meant, form, &expected, &rows).unwrap_or("agrees".into());
                        let own = deviation(&meant, form, &expected, &native).unwrap_or("agrees".into());
                        let details = format!("machine code: {own}\n{way:?}: {other}");
                        return different("ways differ", details, &shown);
                    }
                    Ok(_) => {}
                }
            }
        }
        match deviation(&meant, form, &expected, &native) {
            Some(details) => different("values", details, &shown),
            None => Verdict::Same,
        }
    };
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(verdict) => verdict,
        Err(_) => different("panics", String::new(), &shown),
    }
}

fn has_loops(model: &Model) -> bool {
    let text = text(model, Form::default());
    text.contains("for ") || model.components.iter().any(|c| c.shape == Shape::Model)
}
