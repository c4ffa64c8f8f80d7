//! The parameters of a model as fitted, as a file that runs of it can be given.

use std::fmt::Write;

use crate::initial::StartOf;
use crate::problem::Problem;

/// The text of a TOML file with everything that is set for a shot: conditions, what was fitted for all shots, and what was fitted for
/// this one.
pub fn parameter_file(problem: &Problem<'_>, xi: &[f64], shot: usize, title: &str) -> String {
    let number = problem.data.shots[shot].number;
    let title: String = title.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let mut text = format!("# {title}: parameters under the conditions of shot {number}, as fitted\n");
    for (name, value, unit) in problem.parameters_of(xi, shot) {
        let name = StartOf::set_as(&name);
        // A name in quotes may hold anything but quotes and backslashes of its own.
        let name = name.replace('\\', "\\\\").replace('"', "\\\"");
        let unit = if unit.is_empty() { String::new() } else { format!(" # {unit}") };
        // Writing to a String cannot fail.
        let _ = writeln!(text, "\"{name}\" = {value:?}{unit}");
    }
    text
}
