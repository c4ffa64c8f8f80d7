//! `--set NAME=VALUE`: found by full name, refused with a reason that points into the text.
//!
//! What decides sizes or structure was used by the compiler; everything else is run-time data of the system.

use hyd_compiler::{Code, Diagnostic};
use hyd_flat::{FlatModel, VariableBlock};
use hyd_source::did_you_mean;
use hyd_system::by_part::by_part;
use hyd_system::given::{self, Elements};
use hyd_system::{Settable, Variability};

/// Messages for assignments that are not used: no such parameter, not settable, not a value of its type.
pub fn refuse_unknown(flat: &FlatModel, set: &[(String, String)], used: &[String]) -> Vec<Diagnostic> {
    let mut wrong = Vec::new();
    let open: Vec<(String, String)> = set.iter().filter(|(name, _)| !used.contains(name)).cloned().collect();
    let set = match by_part(&open, flat.variables.iter().map(|block| &block.name)) {
        Ok(set) => set,
        Err(message) => return vec![Diagnostic::error(Code::Value, message)],
    };
    for (name, value) in &set {
        let found = flat.variables.raw.iter().find_map(|block| Some((block, Elements::of(&block.name, name)?)));
        match found {
            None => wrong.push(unknown(flat, name)),
            Some((block, elements)) => wrong.extend(refuse(block, elements, name, value)),
        }
    }
    wrong
}

fn unknown(flat: &FlatModel, name: &str) -> Diagnostic {
    let settable = flat.variables.raw.iter().filter(|block| block.settable == Settable::Yes && block.count > 0);
    let names: Vec<String> = settable.map(|block| block.name.element(0)).collect();
    let whole = name.split('[').next().unwrap_or(name);
    let array = flat.variables.raw.iter().find(|block| Elements::of(&block.name, whole) == Some(Elements::All));
    if let Some(block) = array.filter(|_| name.ends_with(']')) {
        let sizes: Vec<&u32> = block.name.parts.iter().flat_map(|(_, sizes)| sizes).collect();
        let message = format!("`{name}` is outside of `{whole}`, which has the sizes {sizes:?}");
        return Diagnostic::error(Code::NoSuchParameter, message).with(block.origin.span, "declared here");
    }
    let hint = did_you_mean(name, names.iter().map(String::as_str)).or_else(|| {
        // Perhaps only the component before the name is missing.
        let inside = names.iter().find(|full| full.rsplit('.').next() == Some(name));
        inside.map(|full| format!("did you mean `{full}`?"))
    });
    Diagnostic::error(Code::NoSuchParameter, format!("the model has no parameter `{name}`")).maybe_help(hint)
}

fn refuse(block: &VariableBlock, elements: Elements, name: &str, value: &str) -> Option<Diagnostic> {
    let reason = match block.settable {
        Settable::Yes => {
            return given::numbers(&block.kind, value, &elements.sizes(&block.name)).err().map(|reason| {
                Diagnostic::error(Code::Value, format!("`{name}` cannot be set to `{value}`: {reason}"))
                    .with(block.origin.span, "declared here")
            });
        }
        Settable::Structural => {
            "it decides sizes or structure, so it must be set before translation, and this value was not taken"
        }
        Settable::No if block.variability == Variability::Constant => "it is a constant",
        Settable::No if block.variability == Variability::Parameter => {
            "it is final, or its value follows from other parameters by declaration"
        }
        Settable::No => "it is a variable, not a parameter",
    };
    let message = format!("`{name}` cannot be set: {reason}");
    Some(Diagnostic::error(Code::NoSuchParameter, message).with(block.origin.span, "declared here"))
}
