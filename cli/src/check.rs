//! `hyd check FILE`: translates up to the sorted system and prints the counts.
//!
//! A component whose connectors are open cannot be sorted by itself; if it brings as many equations as it must (Modelica 3.6,
//! section 4.7), that is all that can be said of it, and no fault.

use hyd_compiler::{Compilation, Goal};
use hyd_flat::{EquationBlock, FlatModel, Section};
use hyd_system::Variability;

use crate::arguments::Check;
use crate::fix::fix;
use crate::translate::{compiled, report};
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn check(arguments: &Check) -> Result<(), Failure> {
    let mut compilation = compiled(&arguments.model, Goal::Check)?;
    let mut ends = compilation.forgive_open_ends();
    report(&compilation.files, &compilation.diagnostics, arguments.model.message_format);
    if arguments.fix
        && let Some(after) = fix(&arguments.model, &compilation)?
    {
        compilation = after;
        ends = compilation.forgive_open_ends();
        report(&compilation.files, &compilation.diagnostics, arguments.model.message_format);
    }
    if compilation.has_errors() {
        return Err(Failure::Reported);
    }
    let mut text = counts(&compilation);
    if !ends.is_empty() {
        text.push_str(&format!(
            "  balanced as a component: {}, and {} to be connected where it is used\n",
            own_equations(&compilation),
            ends.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
        ));
    }
    if arguments.unknown_units {
        text.push_str(&unknown_units(&compilation));
    }
    output::print(&text)
}

/// How many equations the component brings: those of connections, and of connectors left open, are not its own.
fn own_equations(compilation: &Compilation) -> String {
    let own = |flat: &FlatModel| {
        let is_own = |block: &&EquationBlock| block.section == Section::Continuous && !flat.is_connection(block);
        flat.equations.iter().filter(is_own).map(|block| block.count as usize).sum()
    };
    match compilation.flat.as_deref().map_or(0, own) {
        1 => "1 equation".to_string(),
        count => format!("{count} equations"),
    }
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

fn counts(compilation: &Compilation) -> String {
    let mut text = format!("{}\n", compilation.model_name.as_deref().unwrap_or("(no model)"));
    let mut line = |what: &str, count: usize| text.push_str(&format!("  {what:<28}{count:>9}\n"));
    if let Some(flat) = &compilation.flat {
        let scalars = |chosen: &dyn Fn(Variability) -> bool| -> usize {
            flat.variables.raw.iter().filter(|b| chosen(b.variability)).map(|b| b.count as usize).sum()
        };
        line("parameters and constants", scalars(&|v| v <= Variability::Parameter));
        line("continuous variables", scalars(&|v| v == Variability::Continuous));
        line("discrete variables", scalars(&|v| v == Variability::Discrete));
        line("continuous equations", flat.count(Section::Continuous));
        line("discrete equations", flat.count(Section::Discrete));
        line("initial equations", flat.count(Section::Initial));
        line("equation templates", flat.templates.len());
        line("variables of unknown unit", compilation.undecided_units.iter().map(|(_, count)| count).sum());
    }
    if let Some(sorted) = &compilation.sorted {
        let plan = &sorted.simulation;
        let states = plan.unknowns.iter().filter(|unknown| unknown.differential).count();
        line("states", states);
        line("iteration variables", plan.unknowns.len() - states);
        line("explicit assignments", plan.assignments.len());
        line("initial unknowns", sorted.initial.unknowns.len());
        line("event relations", sorted.relations.len());
    }
    text
}
