//! Parameters against their `min` and `max`, with the values of the text and those set from outside, dependent ones included.
//!
//! Modelica 3.6, section 4.9.1: values outside the limits are an error.  Variables are not looked at: what they do during a run
//! is not known here.

use std::collections::HashMap;

use hyd_equations::{SortedSystem, parameter_values};
use hyd_flat::{Section, Target, VarId, VariableBlock};
use hyd_source::{Code, Diagnostic, Span};
use hyd_system::{NamePattern, ValueKind, Variability};

/// At most so many messages.
const MOST: usize = 20;

/// A message for every parameter and constant whose value is outside its limits.  `set`: values from outside by path.
pub(crate) fn check_limits(sorted: &SortedSystem, set: &[(String, String)]) -> Vec<Diagnostic> {
    let flat = &sorted.system.flat;
    let limited = |block: &&VariableBlock| {
        let bounded = (0..block.count as usize).any(|k| block.min.get(k).is_finite() || block.max.get(k).is_finite());
        block.variability <= Variability::Parameter && bounded && block.kind != ValueKind::Boolean
    };
    let blocks: Vec<&VariableBlock> = flat.variables.raw.iter().filter(limited).collect();
    if blocks.is_empty() {
        return Vec::new();
    }
    let given = values_given(&flat.variables.raw, set);
    let values = parameter_values(sorted, &|v| given.get(&v).copied());
    let mut messages = Vec::new();
    for block in blocks {
        for k in 0..block.count as usize {
            let v = VarId(block.first.0 + k as u32);
            let (value, low, high) = (values[v], block.min.get(k), block.max.get(k));
            let (side, limit) = match value {
                value if value < low => (Side::Below, low),
                value if value > high => (Side::Above, high),
                _ => continue,
            };
            let place = binding_span(sorted, v).filter(|_| !given.contains_key(&v));
            messages.push(message(block, k, value, side, limit, place));
            if messages.len() == MOST {
                return messages;
            }
        }
    }
    messages
}

#[derive(Clone, Copy)]
enum Side {
    Below,
    Above,
}

fn message(block: &VariableBlock, k: usize, value: f64, side: Side, limit: f64, place: Option<Span>) -> Diagnostic {
    let text = |value: f64| match &block.kind {
        ValueKind::Enumeration(literals) => {
            let literal = literals.get(value as usize - 1);
            literal.map_or_else(|| value.to_string(), |l| format!("`{l}`"))
        }
        _ => value.to_string(),
    };
    let (words, attribute, limit_at) = match side {
        Side::Below => ("below", "min", block.limit_spans[0]),
        Side::Above => ("above", "max", block.limit_spans[1]),
    };
    let name = block.name.element(k);
    let message = format!("`{name}` is {}, {words} its `{attribute}` {}", text(value), text(limit));
    let declared = block.origin.span;
    let mut diagnostic = Diagnostic::error(Code::Value, message);
    diagnostic = match place.filter(|place| *place != declared) {
        Some(place) => diagnostic.at(place, "this is its value"),
        None => diagnostic.at(declared, "declared here"),
    };
    match limit_at {
        Some(limit_at) => diagnostic.with(limit_at, format!("the limit `{attribute}` is stated here")),
        None => diagnostic,
    }
}

/// Where the value of a parameter stands in the text.
fn binding_span(sorted: &SortedSystem, v: VarId) -> Option<Span> {
    let flat = &sorted.system.flat;
    let found = flat.equations.iter().filter(|block| block.section == Section::Binding).find(|block| {
        let template = flat.templates.get(block.template);
        (0..block.count as usize).any(|k| {
            let operands = block.operands_of(k, template.arity as usize);
            hyd_symbolic::slots(&flat.templates.arena, &[template.left])
                .iter()
                .any(|slot| operands.get(slot.0 as usize).is_some_and(|o| o.target() == Target::Var(v)))
        })
    });
    found.map(|block| block.origin.span)
}

/// Values from outside for scalar variables; what names nothing or is no number is refused elsewhere.
fn values_given(variables: &[VariableBlock], set: &[(String, String)]) -> HashMap<VarId, f64> {
    let mut given = HashMap::new();
    for (name, text) in set {
        let Some((block, elements)) = variables.iter().find_map(|b| Some((b, elements(&b.name, name)?))) else {
            continue;
        };
        let leaves = text.split(['{', '}', ',']).map(str::trim).filter(|leaf| !leaf.is_empty());
        let numbers: Vec<f64> = leaves.filter_map(|leaf| stored(&block.kind, leaf)).collect();
        for (position, k) in elements.enumerate() {
            if let Some(&number) = numbers.get(position).or(numbers.first().filter(|_| numbers.len() == 1)) {
                given.insert(VarId(block.first.0 + k as u32), number);
            }
        }
    }
    given
}

/// A value as it is stored in a run.
fn stored(kind: &ValueKind, text: &str) -> Option<f64> {
    match kind {
        ValueKind::Enumeration(literals) => {
            let last = text.rsplit('.').next()?;
            literals.iter().position(|literal| **literal == *last).map(|k| (k + 1) as f64)
        }
        _ => text.parse::<f64>().ok().filter(|number| number.is_finite()),
    }
}

/// The elements that a name means: all of an array, or one.
fn elements(pattern: &NamePattern, name: &str) -> Option<std::ops::Range<usize>> {
    if pattern.derivative || !name.starts_with(&*pattern.parts.first()?.0) {
        return None;
    }
    let bare: String = pattern.parts.iter().map(|(text, _)| &**text).collect();
    if bare == name {
        return Some(0..pattern.count());
    }
    let spaceless: String = name.chars().filter(|c| !c.is_whitespace()).collect();
    (0..pattern.count()).find(|&k| pattern.element(k) == spaceless).map(|k| k..k + 1)
}
