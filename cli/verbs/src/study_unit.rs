//! A unit of another tool as the model of a study: a text that declares what the study names of it, and the study in names of that text.

use std::path::Path;

use hyd_compiler::did_you_mean;
use hyd_discovery::{Bench, Study};
use hyd_fmi_import::{Causality, Unit, Variable};

use crate::Failure;
use crate::joined::element_names;
use crate::unit_text::{Purpose, UnitText, identifier, unit_text, written_name};

/// Writes the text.  `class`: what the study calls the model.
///
/// # Errors
/// A sentence: it is another model, is not for model exchange, or has no variable that a channel names.
pub(crate) fn text(file: &Path, unit: &Unit, class: &str, study: &mut Study) -> Result<UnitText, Failure> {
    let refused = |sentence: String| Failure::Fault(format!("`{}`: {sentence}", file.display()));
    let description = &unit.description;
    if *description.model != *class {
        let sentence = format!("it is a unit of the model `{}`, and the study names `{class}`", description.model);
        return Err(refused(sentence));
    }
    if description.exchange.is_none() {
        return Err(refused("it is for co-simulation alone, and a study needs model exchange".into()));
    }
    if let Some(state) = study.initial.keys().next() {
        let place = study.place(&["initial", state]);
        return Err(Failure::Fault(format!(
            "{place}a unit begins where its own start values are; `[initial]` is for texts"
        )));
    }
    let elements: Vec<String> = description.variables.iter().flat_map(element_names).collect();
    let mut read: Vec<String> = Vec::new();
    for channel in study.channels.values_mut() {
        let (written, names) = in_text(&channel.variable, &description.variables);
        for name in names {
            let bare = name.split('[').next().unwrap_or(&name);
            let of = |own: &&Variable| *own.name == *name || *own.name == *bare;
            let Some(variable) = description.variables.iter().find(of) else {
                let hint = did_you_mean(&name, elements.iter().map(String::as_str));
                let hint = hint.map_or_else(String::new, |hint| format!("; {hint}"));
                return Err(refused(format!(
                    "the unit has no variable `{name}`{hint}; channels show variables of the unit, because its insides cannot be looked at"
                )));
            };
            if matches!(variable.causality, Causality::Output | Causality::Local) {
                read.push(variable.name.to_string());
            }
        }
        channel.variable = written;
    }
    let name = file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(unit_text(description, &name, Purpose::Bench, (&read, &study.shots.trigger_moves)))
}

/// Gives inputs the names that the text has for them: at its top, where a name with dots is a single one.
pub(crate) fn name_inputs(unit: &Unit, study: &mut Study, bench: &mut Bench) {
    let is_input = |name: &str| {
        let mut inputs = unit.description.variables.iter().filter(|own| own.causality == Causality::Input);
        inputs.any(|own| *own.name == *name)
    };
    let named = |name: String| if is_input(&name) { identifier(&name) } else { name };
    study.inputs = std::mem::take(&mut study.inputs).into_iter().map(|(name, own)| (named(name), own)).collect();
    for shot in &mut bench.shots {
        shot.inputs = std::mem::take(&mut shot.inputs).into_iter().map(|(name, own)| (named(name), own)).collect();
    }
}

/// What a search makes of the connectors that the unit describes, in a sentence; none where there are none.
pub(crate) fn connectors(unit: &Unit, study: &Study) -> Option<String> {
    let description = &unit.description;
    let causality = |name: &str| description.variables.iter().find(|own| *own.name == *name).map(|own| own.causality);
    let shown = |name: &str| {
        let written = written_name(name);
        let has = |expression: &str| {
            *expression == *written || in_text(expression, &description.variables).1.iter().any(|own| own == name)
        };
        study.channels.iter().find(|(_, own)| has(&own.variable)).map(|(channel, _)| channel.clone())
    };
    let mut sentences = Vec::new();
    for terminal in &description.terminals {
        let mut uses = Vec::new();
        for member in &terminal.members {
            let name = &member.variable;
            match (causality(name), shown(name)) {
                (Some(Causality::Input), _) => uses.push(format!("what comes in as `{name}`")),
                (_, Some(channel)) => uses.push(format!("`{name}`, which channel {channel} shows")),
                _ => {}
            }
        }
        if !uses.is_empty() {
            sentences.push(format!("`{}`: {}", terminal.name, uses.join(" and ")));
        }
    }
    match (description.terminals.len(), sentences.as_slice()) {
        (0, _) => None,
        (count, []) => Some(format!(
            "none of the {count} connectors of the unit is given or shown anything, so nothing is searched there"
        )),
        (_, own) => Some(format!("connectors of the unit at which effects are searched: {}", own.join("; "))),
    }
}

/// An expression with the names of a unit written as its text has them, and these names.
fn in_text(expression: &str, variables: &[Variable]) -> (String, Vec<String>) {
    let whole = expression.trim();
    if variables.iter().any(|own| *own.name == *whole) {
        return (written_name(whole), vec![whole.to_string()]);
    }
    let mut names = Vec::new();
    let letters: Vec<char> = expression.chars().collect();
    let mut at = 0;
    while at < letters.len() {
        let begins = letters[at].is_ascii_alphabetic() || letters[at] == '_';
        if !begins {
            // Numbers such as 1e3 are no names.
            let is_number = letters[at].is_ascii_digit() || letters[at] == '.';
            at += 1;
            while is_number && at < letters.len() && (letters[at].is_ascii_alphanumeric() || letters[at] == '.') {
                at += 1;
            }
            continue;
        }
        let first = at;
        while at < letters.len()
            && (letters[at].is_ascii_alphanumeric() || matches!(letters[at], '_' | '.' | '[' | ']'))
        {
            at += 1;
        }
        let name: String = letters[first..at].iter().collect();
        let is_call = letters[at..].iter().find(|c| !c.is_whitespace()) == Some(&'(');
        if !is_call && name != "time" {
            names.push(name);
        }
    }
    (expression.to_string(), names)
}
