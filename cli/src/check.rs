//! `hyd check FILE`: translates up to the sorted system and prints the counts.
//!
//! A component whose connectors are open cannot be sorted by itself; if it brings as many equations as it must (Modelica 3.6,
//! section 4.7), that is all that can be said of it, and no fault.

use hyd_compiler::{Compilation, Goal};
use hyd_run::RunArguments;
use hyd_verbs::check::{counts, own_equations};
use hyd_verbs::{Request, Trials, run_diagnostic, start_warning};

use crate::arguments::Check;
use crate::fix::fix;
use crate::translate::{compiled, report};
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn check(arguments: &Check) -> Result<(), Failure> {
    let mut compilation = compiled(&arguments.model, Goal::Check)?;
    let mut ends = compilation.forgive_open_ends();
    report(&compilation.files, &compilation.diagnostics, arguments.model.message_format);
    let model = &arguments.model;
    let libraries = model.libraries.libraries();
    let request = Request { class: model.model.clone(), set: model.set.clone(), goal: Goal::Run };
    let run = RunArguments { stop: arguments.stop, ..RunArguments::default() };
    let trials = Trials {
        file: &model.file,
        libraries: &libraries,
        request: &request,
        strict_units: model.strict_units,
        run: &run,
    };
    let mut failure = None;
    if arguments.fix && !compilation.has_errors() && ends.is_empty() {
        // Start values show only where the start is looked for, other faults where the model runs.
        compilation = compiled(model, Goal::Run)?;
        let mut found = Vec::from_iter(start_warning(&compilation));
        if found.is_empty() {
            failure = trials.failure(&compilation);
            let flat = compilation.flat.as_deref();
            found.extend(failure.iter().map(|error| run_diagnostic(error, &compilation.files, flat, None)));
        }
        report(&compilation.files, &found, model.message_format);
        compilation.diagnostics.extend(found);
    }
    if arguments.fix
        && let Some(after) = fix(model, &compilation, &trials, failure.as_ref())?
    {
        compilation = after;
        ends = compilation.forgive_open_ends();
        report(&compilation.files, &compilation.diagnostics, arguments.model.message_format);
    }
    if compilation.has_errors() {
        return Err(Failure::Reported);
    }
    let mut text = text(&compilation);
    if !ends.is_empty() {
        text.push_str(&format!(
            "  balanced as a component: {}, and {} to be connected where it is used\n",
            equations(own_equations(&compilation)),
            ends.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
        ));
    }
    if arguments.unknown_units {
        text.push_str(&unknown_units(&compilation));
    }
    output::print(&text)
}

fn equations(count: usize) -> String {
    if count == 1 { "1 equation".to_string() } else { format!("{count} equations") }
}

/// The variables whose unit is neither declared nor follows from others; an array is one line.
fn unknown_units(compilation: &Compilation) -> String {
    let mut text = String::from("unknown unit\n");
    for (name, count) in &compilation.undecided_units {
        let more = if *count > 1 { format!(" and {} more of its array", count - 1) } else { String::new() };
        text.push_str(&format!("  {name}{more}\n"));
    }
    text
}

fn text(compilation: &Compilation) -> String {
    let mut text = format!("{}\n", compilation.model_name.as_deref().unwrap_or("(no model)"));
    for (what, count) in counts(compilation) {
        text.push_str(&format!("  {what:<28}{count:>9}\n"));
    }
    text
}
