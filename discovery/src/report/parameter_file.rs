//! The parameters of a model as fitted, as a file that runs of it can be given.

use std::fmt::Write;

use hyd_system::ValueKind;

use crate::problem::Problem;
use crate::study::initial::StartOf;

impl Problem<'_> {
    /// The text of a TOML file with everything that is set for a shot: conditions, what was fitted for all shots, and what was fitted for
    /// this one.
    pub fn parameter_file(&self, xi: &[f64], shot: usize, title: &str) -> String {
        let number = self.data.shots[shot].number;
        let mut text = format!("# {}: parameters under the conditions of shot {number}, as fitted\n", plain(title));
        for (k, value) in self.values(xi, shot).into_iter().enumerate() {
            text.push_str(&line(self, k, value));
        }
        text
    }

    /// The name by which a run sets the parameter at a position of the list of places.
    pub fn set_as(&self, place: usize) -> String {
        StartOf::set_as(self.places[place].name())
    }
}

/// A text without what would end a comment.
pub(super) fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// The line of a parameter, which is given by its position in the list of places.
pub(super) fn line(problem: &Problem<'_>, at: usize, value: f64) -> String {
    let place = &problem.places[at];
    let unit = problem.machine.unit(place);
    let mut line = format!("{} = {}", quoted(&problem.set_as(at)), toml_value(&problem.machine.kind(place), value));
    if !unit.is_empty() {
        // Writing to a String cannot fail.
        let _ = write!(line, " # {}", plain(&unit));
    }
    line + "\n"
}

/// A text in quotes, which may hold anything but quotes and backslashes of its own.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// A value as runs read it in such a file.
fn toml_value(kind: &ValueKind, value: f64) -> String {
    match kind {
        ValueKind::Enumeration(literals) => {
            let found = (value as usize).checked_sub(1).and_then(|k| literals.get(k));
            found.map_or_else(|| format!("{value:?}"), |own| quoted(own))
        }
        ValueKind::Real => format!("{value:?}"),
        _ => literal(kind, value).unwrap_or_else(|| format!("{value:?}")),
    }
}

/// A value as texts of models write it; none for literals of enumerations, whose type has no name here, and for what is no value of
/// the type.
pub(super) fn literal(kind: &ValueKind, value: f64) -> Option<String> {
    match kind {
        ValueKind::Real => Some(format!("{value:e}")),
        ValueKind::Integer => (value.fract() == 0.0).then(|| format!("{value:.0}")),
        ValueKind::Boolean => Some((value != 0.0).to_string()),
        ValueKind::Enumeration(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::{ValueKind, literal, toml_value};

    #[test]
    fn values_are_written_as_their_types_are_read() {
        let mode = ValueKind::Enumeration(["off".into(), "on".into()].into());
        for (kind, value, text, toml) in [
            (ValueKind::Real, -2.5e-7, Some("-2.5e-7"), "-2.5e-7"),
            (ValueKind::Real, 3.0, Some("3e0"), "3.0"),
            (ValueKind::Integer, 3.0, Some("3"), "3"),
            (ValueKind::Integer, 3.5, None, "3.5"),
            (ValueKind::Boolean, 1.0, Some("true"), "true"),
            (mode, 2.0, None, "\"on\""),
        ] {
            assert_eq!((literal(&kind, value).as_deref(), &*toml_value(&kind, value)), (text, toml));
        }
    }
}
