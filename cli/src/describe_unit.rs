//! `hyd unit X.fmu`: what a unit of another tool has, and the block of a model that it becomes.

use std::fmt::Write;
use std::path::Path;

use hyd_compiler::did_you_mean;
use hyd_fmi_import::{Causality, Changes, Description, Kind, Member, Number, Unit, Variable, Version};
use hyd_results::write_whole;
use hyd_verbs::unit::is_unit;
use hyd_verbs::unit_text::{Purpose, unit_text};
use serde_json::{Value, json};

use crate::arguments::UnitFile;
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn describe(arguments: &UnitFile) -> Result<(), Failure> {
    let file = &arguments.file;
    if !is_unit(file) {
        return Err(Failure::Usage(format!("`{}` is not a unit of another tool (*.fmu)", file.display())));
    }
    let unit = Unit::open(file).map_err(|fault| Failure::Fault(fault.to_string()))?;
    let description = &unit.description;
    for name in &arguments.read {
        known(description, name)?;
    }
    for note in &unit.notes {
        output::sentence("warning", note, hyd_run::MessageFormat::Text);
    }
    if let Some(path) = &arguments.output {
        if description.exchange.is_none() {
            return Err(Failure::Fault(format!(
                "`{}`: the unit is for co-simulation alone, and a block of a model must be one for model exchange; nothing was written",
                file.display()
            )));
        }
        let text = unit_text(description, &seen_from(file, path)?, Purpose::Block, (&arguments.read, &[]));
        if path.symlink_metadata().is_ok() {
            return Err(Failure::Fault(format!("`{}` exists already; nothing was written", path.display())));
        }
        let failed = |error| Failure::Fault(format!("`{}` cannot be written: {error}", path.display()));
        write_whole(path, text.text.as_bytes()).map_err(failed)?;
        for note in &text.notes {
            output::sentence("note", note, hyd_run::MessageFormat::Text);
        }
        return output::print(&format!("block {} in {}\n", text.class, path.display()));
    }
    match arguments.json {
        true => output::print(&format!("{:#}\n", data(description))),
        false => output::print(&told(description)),
    }
}

/// Refuses a name that the unit does not have.
fn known(description: &Description, name: &str) -> Result<(), Failure> {
    let names = || description.variables.iter().map(|own| &*own.name);
    if names().any(|own| own == name) {
        return Ok(());
    }
    let hint = did_you_mean(name, names()).map_or_else(String::new, |hint| format!("; {hint}"));
    Err(Failure::Usage(format!("--read {name}: the unit has no such variable{hint}")))
}

/// The unit as a text in another place names it.
fn seen_from(unit: &Path, text: &Path) -> Result<String, Failure> {
    let folder =
        |path: &Path| path.parent().filter(|own| !own.as_os_str().is_empty()).unwrap_or(Path::new(".")).to_path_buf();
    let whole = |path: &Path| {
        path.canonicalize().map_err(|error| Failure::Fault(format!("`{}` cannot be read: {error}", path.display())))
    };
    let (unit, folder) = (whole(unit)?, whole(&folder(text))?);
    let below = unit.strip_prefix(&folder).ok().and_then(Path::to_str).map(str::to_string);
    below.ok_or_else(|| {
        let sentence = "a text names files of its own folder; put the unit there, or the text beside the unit";
        Failure::Usage(format!("-o {}: {sentence}", text.display()))
    })
}

/// What a variable is for, in the order of the report.
const GROUPS: [(&str, Causality); 5] = [
    ("inputs", Causality::Input),
    ("outputs", Causality::Output),
    ("parameters", Causality::Parameter),
    ("structural parameters", Causality::Structural),
    ("calculated parameters", Causality::Calculated),
];

fn kinds(description: &Description) -> Vec<&'static str> {
    let own = [(description.exchange.is_some(), "model exchange"), (description.stepping.is_some(), "co-simulation")];
    own.into_iter().filter(|(has, _)| *has).map(|(_, name)| name).collect()
}

fn version(description: &Description) -> &'static str {
    if description.version == Version::Two { "2.0" } else { "3.0" }
}

fn told(description: &Description) -> String {
    let mut text = String::new();
    let tool = if description.tool.is_empty() { String::new() } else { format!(" by {}", description.tool) };
    // Writing to a String cannot fail.
    let _ = writeln!(text, "{}: unit of FMI {}{tool}", description.model, version(description));
    let _ = writeln!(text, "{}", kinds(description).join(" and "));
    let locals = description.variables.iter().filter(|own| own.causality == Causality::Local).count();
    let _ = writeln!(
        text,
        "{} states, {} event indicators, {locals} variables of its own",
        description.state_count(),
        description.indicators
    );
    for (title, causality) in GROUPS {
        let list: Vec<&Variable> = description.variables.iter().filter(|own| own.causality == causality).collect();
        if list.is_empty() {
            continue;
        }
        let _ = writeln!(text, "\n{title}");
        let width = list.iter().map(|own| shown(own).chars().count()).max().unwrap_or(0);
        for own in list {
            let line = format!("  {:width$}  {:>14}  {:8}  {}", shown(own), start(own), own.unit, own.description);
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }
    for (title, outside) in [("connectors", true), ("connectors of components within", false)] {
        let list: Vec<_> = description.terminals.iter().filter(|own| (own.rule != "none") == outside).collect();
        if list.is_empty() {
            continue;
        }
        let _ = writeln!(text, "\n{title}");
        for terminal in list {
            let kind = if terminal.kind.is_empty() { String::new() } else { format!(" ({})", terminal.kind) };
            let members: Vec<String> = terminal.members.iter().map(member).collect();
            let _ = writeln!(text, "  {}{kind}: {}", terminal.name, members.join(", "));
        }
    }
    text
}

/// A variable of a connector, with what it is there.
fn member(member: &Member) -> String {
    let kind = member.kind.trim_start_matches("_hyd_");
    if kind.is_empty() { member.variable.clone() } else { format!("{} ({kind})", member.variable) }
}

/// The name of a variable with its sizes.
fn shown(variable: &Variable) -> String {
    let sizes: Vec<String> = variable.sizes.iter().map(u32::to_string).collect();
    if sizes.is_empty() { variable.name.to_string() } else { format!("{}[{}]", variable.name, sizes.join(",")) }
}

fn start(variable: &Variable) -> String {
    let one = |value: f64| match &variable.kind {
        Kind::Number(Number::Boolean) => (value != 0.0).to_string(),
        Kind::Enumeration(literals) => {
            let literal = literals.iter().find(|(_, own)| *own as f64 == value);
            literal.map_or_else(|| value.to_string(), |(name, _)| name.to_string())
        }
        _ => value.to_string(),
    };
    match (&variable.text, variable.start.as_slice()) {
        (Some(text), _) => text.clone(),
        (None, &[value]) => one(value),
        (None, []) => String::new(),
        (None, &[first, ..]) => format!("{}, ...", one(first)),
    }
}

fn data(description: &Description) -> Value {
    let one = |own: &Variable| {
        json!({
            "name": &*own.name,
            "causality": word(own.causality),
            "type": kind(&own.kind),
            "variability": changes(own.changes),
            "sizes": own.sizes,
            "unit": &*own.unit,
            "start": own.start,
            "description": &*own.description,
        })
    };
    let member = |own: &Member| json!({"variable": own.variable, "name": own.name, "kind": own.kind});
    let terminal = |own: &hyd_fmi_import::Terminal| {
        let members: Vec<Value> = own.members.iter().map(member).collect();
        let variables: Vec<&str> = own.members.iter().map(|member| member.variable.as_str()).collect();
        json!({"name": own.name, "kind": own.kind, "rule": own.rule, "variables": variables, "members": members})
    };
    json!({
        "model": &*description.model,
        "version": version(description),
        "tool": description.tool,
        "kinds": kinds(description),
        "states": description.state_count(),
        "event_indicators": description.indicators,
        "variables": description.variables.iter().map(one).collect::<Vec<_>>(),
        "terminals": description.terminals.iter().map(terminal).collect::<Vec<_>>(),
    })
}

fn word(causality: Causality) -> &'static str {
    match causality {
        Causality::Parameter => "parameter",
        Causality::Structural => "structuralParameter",
        Causality::Calculated => "calculatedParameter",
        Causality::Input => "input",
        Causality::Output => "output",
        Causality::Local => "local",
        Causality::Independent => "independent",
    }
}

fn changes(changes: Changes) -> &'static str {
    match changes {
        Changes::Constant => "constant",
        Changes::Fixed => "fixed",
        Changes::Tunable => "tunable",
        Changes::Discrete => "discrete",
        Changes::Continuous => "continuous",
    }
}

fn kind(kind: &Kind) -> String {
    match kind {
        Kind::Number(number) => format!("{number:?}"),
        Kind::Enumeration(_) => "Enumeration".to_string(),
        Kind::Text => "String".to_string(),
        Kind::Binary => "Binary".to_string(),
        Kind::Clock => "Clock".to_string(),
    }
}
