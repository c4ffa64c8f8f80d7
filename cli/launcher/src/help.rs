//! What `--help` and `--version` say of the model: its description, its parameters with units, values and limits.

use std::fmt::Write as _;
use std::sync::Arc;

use hyd_payload::{Loaded, Model};
use hyd_system::{DaeSystem, Place, Settable, ValueKind, VariableInfo, significant};

/// Parameters that are listed.
const MOST: usize = 400;

/// The line at the head.
pub(crate) fn about(model: &Model) -> String {
    let description = &model.identity.description;
    match description.is_empty() {
        true => format!("Simulates the model {}", model.tables.model),
        false => format!("Simulates the model {}: {description}", model.tables.model),
    }
}

/// Model, hash of its texts, compiler.
pub(crate) fn version(model: &Model) -> String {
    let identity = &model.identity;
    format!("{} (texts {:016x}), built by hyd {}\n", model.tables.model, identity.sources, identity.compiler)
}

/// All parameters that can be set.
pub(crate) fn parameters(loaded: &Arc<Loaded>) -> String {
    let model = &loaded.model;
    let mut instance = loaded.instantiate();
    let start = model.experiment.start.unwrap_or(0.0);
    // Values that depend on others are known once all are computed; where that fails the list says so.
    let known = instance.bind(start).is_ok();
    let mut rows = Vec::new();
    for (index, variable) in model.tables.variables.iter().enumerate() {
        if variable.settable == Settable::Yes && !variable.protected && !variable.sources.is_empty() {
            rows.push(row(model, index, variable, known.then(|| instance.parameters())));
        }
    }
    let mut text = String::new();
    let structural = model.tables.variables.iter().filter(|variable| variable.settable == Settable::Structural);
    let structural: Vec<String> = structural.filter(|v| !v.protected).map(bare).collect();
    // Writing to a string cannot fail.
    let _ = writeln!(text, "Also: sweep [PLAN.toml] ... runs the model many times; `sweep --help` tells how.");
    if !rows.is_empty() {
        let _ = writeln!(text, "\nParameters (--set NAME=VALUE):");
    }
    let width = |k: usize| rows.iter().take(MOST).map(|row: &[String; 4]| row[k].chars().count()).max().unwrap_or(0);
    let widths = [width(0), width(1), width(2)];
    for [name, value, limits, description] in rows.iter().take(MOST) {
        let line = format!("  {name:<0$}  {value:<1$}  {limits:<2$}  {description}", widths[0], widths[1], widths[2]);
        let _ = writeln!(text, "{}", line.trim_end());
    }
    if let Some(more @ 1..) = rows.len().checked_sub(MOST) {
        let _ = writeln!(text, "  and {more} more");
    }
    if !structural.is_empty() {
        let _ = writeln!(text, "\nFixed when the executable was built, because they decide sizes or structure:");
        let _ = writeln!(text, "  {}", structural.join(", "));
    }
    let _ = write!(
        text,
        "\nExit codes: 0 done; 1 the model or the data is at fault; 2 wrong usage; 3 the solver gave up or was stopped."
    );
    text
}

/// Name, value with unit, limits, description.
fn row(model: &Model, index: usize, variable: &VariableInfo, values: Option<&[f64]>) -> [String; 4] {
    let count = variable.sources.len();
    let sizes: Vec<String> = variable.name.parts.iter().flat_map(|(_, sizes)| sizes).map(u32::to_string).collect();
    let name = if sizes.is_empty() { bare(variable) } else { format!("{}[{}]", bare(variable), sizes.join(",")) };
    let text = |k: usize| match variable.sources[k].place {
        Place::Parameter(place) => values.and_then(|values| values.get(place as usize)).map(|&value| {
            let value = if variable.sources[k].negated { -value } else { value };
            shown(&variable.kind, value)
        }),
        Place::Constant(value) => Some(shown(&variable.kind, value)),
        Place::Output(_) => None,
    };
    let texts: Vec<Option<String>> = (0..count.min(4)).map(text).collect();
    let same = texts.iter().all(|t| *t == texts[0]);
    let value = match (count, same, texts.into_iter().collect::<Option<Vec<String>>>()) {
        (_, _, None) => String::new(),
        (1, _, Some(list)) | (2.., true, Some(list)) if count <= 4 => list[0].clone(),
        (_, _, Some(list)) if count <= 4 => format!("{{{}}}", list.join(", ")),
        (_, _, Some(list)) => format!("{{{}, ...}}", list.join(", ")),
    };
    let unit = if variable.unit.is_empty() || &*variable.unit == "1" { "" } else { &variable.unit };
    [name, format!("{value} {unit}").trim().to_string(), limits(model, index), variable.description.to_string()]
}

/// `[min, max]` of the first element; an open side is left out.
fn limits(model: &Model, index: usize) -> String {
    let limit = model.parameters.limits.iter().find(|limit| limit.variable as usize == index && limit.element == 0);
    match limit {
        None => String::new(),
        Some(limit) if limit.max.is_infinite() => format!(">= {}", significant(limit.min)),
        Some(limit) if limit.min.is_infinite() => format!("<= {}", significant(limit.max)),
        Some(limit) => format!("{} .. {}", significant(limit.min), significant(limit.max)),
    }
}

fn shown(kind: &ValueKind, value: f64) -> String {
    match kind {
        ValueKind::Boolean => (value != 0.0).to_string(),
        ValueKind::Enumeration(literals) => literals
            .get((value - 1.0).max(0.0) as usize)
            .map_or_else(|| value.to_string(), |literal| literal.to_string()),
        _ => significant(value),
    }
}

fn bare(variable: &VariableInfo) -> String {
    variable.name.parts.iter().map(|(text, _)| &**text).collect()
}
