//! Parameters against their `min` and `max`, with the values of the text and those set from outside, dependent ones included.
//!
//! Modelica 3.6, section 4.9.1: values outside the limits are an error.  What variables do during a run is not known
//! here, but where they begin often is.

use std::cell::OnceCell;
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
/// states is a warning, unless it is computed from what the user gives: other tools take such libraries.  These parameters come second.
pub(crate) fn check_limits(
    sorted: &SortedSystem,
    set: &[(String, String)],
    own: &BTreeSet<FileId>,
) -> (Vec<Diagnostic>, Vec<VarId>) {
    let flat = &sorted.system.flat;
    let limited = |block: &&VariableBlock| {
        let bounded = (0..block.count as usize).any(|k| block.min.get(k).is_finite() || block.max.get(k).is_finite());
        block.variability <= Variability::Parameter && bounded && block.kind != ValueKind::Boolean
    };
    let blocks: Vec<&VariableBlock> = flat.variables.raw.iter().filter(limited).collect();
    if blocks.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let set = values_given(&flat.variables.raw, set);
    let values = parameter_values(sorted, &|v| set.get(&v).copied());
    let mut found: Vec<Found> = Vec::new();
    let mut waived = Vec::new();
    let known = OnceCell::new();
    let given_by_user =
        |v: VarId, place: Option<Span>| set.contains_key(&v) || place.is_some_and(|place| own.contains(&place.file));
    for block in blocks {
        for k in 0..block.count as usize {
            let v = VarId(block.first.0 + k as u32);
            let limits = (block.min.get(k), block.max.get(k));
            let Some(outside) = given::outside(|| block.name.element(k), &block.kind, values[v], limits) else {
                continue;
            };
            let bindings = known.get_or_init(|| bindings(sorted));
            let place = bindings.get(&v).map(|binding| binding.span).filter(|_| !set.contains_key(&v));
            let limit_at = block.limit_spans[usize::from(!outside.is_below)];
            let is_foreign = |span: Option<Span>| span.is_some_and(|span| !own.contains(&span.file));
            let of_library = is_foreign(place) && is_foreign(limit_at) && !depends_on(bindings, v, &given_by_user);
            if of_library {
                waived.push(v);
            }
            let same = |known: &&mut Found| place.is_some() && known.places == (place, limit_at);
            if let Some(known) = found.iter_mut().find(same) {
                known.more += 1;
                continue;
            }
            if found.iter().filter(|known| known.of_library == of_library).count() == MOST {
                continue;
            }
            let mut told = message(block, outside, place);
            if of_library {
                told.severity = Severity::Warning;
                told.notes.push("value and limit are stated in libraries: the value is taken as it is".to_string());
            }
            found.push(Found { told, places: (place, limit_at), of_library, more: 0 });
        }
    }
    let messages = found.into_iter().map(|Found { mut told, more, .. }| {
        if more > 0 {
            told.notes.push(format!("{more} more with this value and this limit"));
        }
        told
    });
    (messages.collect(), waived)
}

/// A message in the making.
struct Found {
    told: Diagnostic,
    /// Where value and limit are stated.
    places: (Option<Span>, Option<Span>),
    of_library: bool,
    /// Further parameters with value and limit from the same places.
    more: usize,
}

/// Where the value of a parameter stands, and what it is computed from.
struct Binding {
    span: Span,
    reads: Vec<VarId>,
}

fn bindings(sorted: &SortedSystem) -> HashMap<VarId, Binding> {
    let flat = &sorted.system.flat;
    let mut found = HashMap::new();
    for block in flat.equations.iter().filter(|block| block.section == Section::Binding) {
        let template = flat.templates.get(block.template);
        let arena = &flat.templates.arena;
        let (left, right) =
            (hyd_symbolic::slots(arena, &[template.left]), hyd_symbolic::slots(arena, &[template.right]));
        for k in 0..block.count as usize {
            let operands = block.operands_of(k, template.arity as usize);
            let variable = |slot: &hyd_symbolic::SlotId| match operands.get(slot.0 as usize)?.target() {
                Target::Var(v) => Some(v),
                _ => None,
            };
            for v in left.iter().filter_map(variable) {
                let reads = right.iter().filter_map(variable).collect();
                found.entry(v).or_insert(Binding { span: block.origin.span, reads });
            }
        }
    }
    found
}

/// Whether a parameter, or one that its value is computed from, is such.
fn depends_on(bindings: &HashMap<VarId, Binding>, v: VarId, is_such: &dyn Fn(VarId, Option<Span>) -> bool) -> bool {
    let mut seen = BTreeSet::new();
    let mut open = vec![v];
    while let Some(v) = open.pop() {
        if !seen.insert(v.0) {
            continue;
        }
        let binding = bindings.get(&v);
        if is_such(v, binding.map(|binding| binding.span)) {
            return true;
        }
        open.extend(binding.into_iter().flat_map(|binding| &binding.reads));
    }
    false
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
