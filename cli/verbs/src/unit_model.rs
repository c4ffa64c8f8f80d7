//! A unit of another tool as a model to look at: what it is given are parameters, and all that it shows are variables.

use std::path::Path;

use hyd_compiler::Severity;
use hyd_fmi_import::{Causality, Unit};
use hyd_run::Failure;

use crate::Listener;
use crate::unit_text::{Purpose, unit_text};

/// Variables of a unit that are read of it.
const MOST_SHOWN: usize = 1000;

/// The text of the model.  What it leaves out goes to the listener.
///
/// # Errors
/// The file is not a unit that can be read, or one for co-simulation alone.
pub fn unit_model(file: &Path, listener: &dyn Listener) -> Result<String, Failure> {
    let unit = Unit::open(file).map_err(|fault| Failure::Fault(fault.to_string()))?;
    let description = &unit.description;
    if description.exchange.is_none() {
        let file = file.display();
        return Err(Failure::Fault(format!(
            "`{file}`: it is for co-simulation alone; run it by `hyd simulate {file} --result run.csv`, and look at run.csv"
        )));
    }
    unit.notes.iter().for_each(|note| listener.sentence(Severity::Warning, note));
    let variables = description.variables.iter();
    let shown = variables.filter(|own| matches!(own.causality, Causality::Output | Causality::Local));
    let shown: Vec<String> = shown.map(|own| own.name.to_string()).collect();
    if shown.len() > MOST_SHOWN {
        let words = format!("the first {MOST_SHOWN} of the {} variables of the unit are shown", shown.len());
        listener.sentence(Severity::Note, &words);
    }
    let name = file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let shown = &shown[..shown.len().min(MOST_SHOWN)];
    let text = unit_text(description, &name, Purpose::View, (shown, &[]));
    text.notes.iter().for_each(|note| listener.sentence(Severity::Note, note));
    Ok(text.text)
}
