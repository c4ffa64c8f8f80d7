//! Parameters against their `min` and `max`, with the values of the text and those set from outside, dependent ones included.
//!
//! Modelica 3.6, section 4.9.1: values outside the limits are an error.  What variables do during a run is not known
//! here, but where they begin often is.

use std::collections::{BTreeSet, HashMap};

use hyd_equations::{SortedSystem, parameter_values};
use hyd_flat::{Section, Target, VarId, VariableBlock};
use hyd_source::{Code, Diagnostic, FileId, Severity, Span};
use hyd_system::given::{self, Elements, Outside};
use hyd_system::{ValueKind, Variability};

/// At most so many messages.
const MOST: usize = 20;

/// A warning for every fixed start value that is a number outside the limits of its variable, which will begin where it may not be.
pub(crate) fn check_starts(sorted: &SortedSystem) -> Vec<Diagnostic> {
    let flat = &sorted.system.flat;
    let mut messages = Vec::new();
    for equations in flat.equations.iter().filter(|block| block.section == Section::Start) {
        let template = flat.templates.get(equations.template);
        let Some(value) = flat.templates.arena.as_constant(template.right) else { continue };
        for operand in &equations.operands {
            let Target::Start(v) = operand.target() else { continue };
            let (block, k) = flat.locate(v);
            let block = &flat.variables[block];
            if block.variability <= Variability::Parameter || !block.fixed.get(k) {
                continue;
            }
            let value = if operand.negated() { -value } else { value };
            let limits = (block.min.get(k), block.max.get(k));
            let Some(outside) = given::outside(|| block.name.element(k), &block.kind, value, limits) else { continue };
            let message = format!("at the start {}", outside.message);
            messages
                .push(Diagnostic::warning(Code::Value, message).at(equations.origin.span, "this is its start value"));
            if messages.len() == MOST {
                return messages;
            }
        }
    }
    messages
}

/// A message for every parameter and constant whose value is outside its limits; one for all that have value and limit from the same
/// places.  `set`: values from outside by path.  A value that a text of a library (no `own` file) gives against a limit that such a text
/// states is a warning: other tools take such libraries.
pub(crate) fn check_limits(sorted: &SortedSystem, set: &[(String, String)], own: &BTreeSet<FileId>) -> Vec<Diagnostic> {
    let flat = &sorted.system.flat;
    let limited = |block: &&VariableBlock| {
        let bounded = (0..block.count as usize).any(|k| block.min.get(k).is_finite() || block.max.get(k).is_finite());
        block.variability <= Variability::Parameter && bounded && block.kind != ValueKind::Boolean
    };
    let blocks: Vec<&VariableBlock> = flat.variables.raw.iter().filter(limited).collect();
    if blocks.is_empty() {
        return Vec::new();
    }
    let set = values_given(&flat.variables.raw, set);
    let values = parameter_values(sorted, &|v| set.get(&v).copied());
    let mut messages = Vec::new();
    let mut places: Vec<((Option<Span>, Option<Span>), usize)> = Vec::new();
    for block in blocks {
        for k in 0..block.count as usize {
            let v = VarId(block.first.0 + k as u32);
            let limits = (block.min.get(k), block.max.get(k));
            let Some(outside) = given::outside(|| block.name.element(k), &block.kind, values[v], limits) else {
                continue;
            };
            let place = binding_span(sorted, v).filter(|_| !set.contains_key(&v));
            let limit_at = block.limit_spans[usize::from(!outside.is_below)];
            if let (Some(_), Some(more)) = (place, places.iter_mut().find(|(known, _)| *known == (place, limit_at))) {
                more.1 += 1;
                continue;
            }
            if messages.len() == MOST {
                continue;
            }
            let mut told = message(block, outside, place);
            let of_library = |span: Option<Span>| span.is_some_and(|span| !own.contains(&span.file));
            if of_library(place) && of_library(limit_at) {
                told.severity = Severity::Warning;
                told.notes.push("value and limit are stated in libraries: the value is taken as it is".to_string());
            }
            messages.push(told);
            places.push(((place, limit_at), 0));
        }
    }
    for (told, (_, more)) in messages.iter_mut().zip(places) {
        if more > 0 {
            told.notes.push(format!("{more} more with this value and this limit"));
        }
    }
    messages
}

fn message(block: &VariableBlock, outside: Outside, place: Option<Span>) -> Diagnostic {
    let (attribute, limit_at) =
        if outside.is_below { ("min", block.limit_spans[0]) } else { ("max", block.limit_spans[1]) };
    let declared = block.origin.span;
    let mut diagnostic = Diagnostic::error(Code::Value, outside.message);
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

/// Values from outside for scalar variables; what names nothing or is not a number is refused elsewhere.
fn values_given(variables: &[VariableBlock], set: &[(String, String)]) -> HashMap<VarId, f64> {
    let mut known = HashMap::new();
    for (name, text) in set {
        let Some((block, elements)) = variables.iter().find_map(|b| Some((b, Elements::of(&b.name, name)?))) else {
            continue;
        };
        let numbers = given::numbers(&block.kind, text, &elements.sizes(&block.name)).unwrap_or_default();
        let positions = elements.range(&block.name);
        known.extend(positions.zip(numbers).map(|(k, number)| (VarId(block.first.0 + k as u32), number)));
    }
    known
}
