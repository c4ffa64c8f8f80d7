//! `hyd check FILE`: translates up to the sorted system and prints the counts.

use hyd_compiler::{Compilation, Goal};
use hyd_flat::Section;
use hyd_system::Variability;

use crate::arguments::Check;
use crate::translate::translate;
use crate::{Failure, output};

/// Runs the verb.
pub(crate) fn check(arguments: &Check) -> Result<(), Failure> {
    let compilation = translate(&arguments.model, Goal::Check)?;
    let mut text = counts(&compilation);
    if arguments.unknown_units {
        text.push_str(&unknown_units(&compilation));
    }
    output::print(&text)
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
