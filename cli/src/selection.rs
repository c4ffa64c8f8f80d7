//! Which variables are written, drawn and listed.
//!
//! `--variables REGEX` searches in full names (anchor it with `^` and `$`).  Without it, files get everything that changes, and
//! pictures and summaries a few variables of the top level.

use hyd_results::{Column, columns, is_variable};
use hyd_system::{Tables, ValueKind, Variability, VariableInfo};
use regex::Regex;

use crate::Failure;

/// Variables that are shown when nobody says which.
const FEW: usize = 12;
/// Elements that stand for an array then.
const FEW_ELEMENTS: usize = 3;
/// Curves that one picture holds.
pub(crate) const MOST_CURVES: usize = 100;

/// A choice of variables by name.
#[derive(Clone, Debug, Default)]
pub(crate) struct Selection {
    pattern: Option<Regex>,
}

impl Selection {
    /// From the argument of `--variables`.
    pub(crate) fn new(pattern: Option<&str>) -> Result<Self, Failure> {
        let pattern = pattern.map(Regex::new).transpose();
        let pattern = pattern.map_err(|error| Failure::Usage(format!("--variables: {error}")))?;
        Ok(Self { pattern })
    }

    /// True if `--variables` was given.
    pub(crate) fn is_explicit(&self) -> bool {
        self.pattern.is_some()
    }

    /// True if the name matches, or if there is nothing to match.
    pub(crate) fn matches(&self, name: &str) -> bool {
        self.pattern.as_ref().is_none_or(|pattern| pattern.is_match(name))
    }

    /// Does the variable become a column of a file?  A pattern may also ask for parameters.
    pub(crate) fn keeps(&self, variable: &VariableInfo, name: &str) -> bool {
        if self.is_explicit() { self.matches(name) } else { is_variable(variable, name) }
    }

    /// What pictures and summaries show, with units.
    pub(crate) fn shown(&self, tables: &Tables) -> Vec<Shown> {
        if self.is_explicit() {
            return shown_columns(tables, |variable, name| self.keeps(variable, name));
        }
        let mut few =
            shown_columns(tables, |variable, name| is_top_level(variable, name) && stands_for(variable, name));
        if few.is_empty() {
            few = shown_columns(tables, |variable, name| is_public(variable) && stands_for(variable, name));
        }
        few.truncate(FEW);
        few
    }
}

/// A variable to be shown.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Shown {
    /// Name and source of its values.
    pub(crate) column: Column,
    /// Its unit, `""` if unknown; truth values have none.
    pub(crate) unit: String,
}

fn shown_columns(tables: &Tables, mut keep: impl FnMut(&VariableInfo, &str) -> bool) -> Vec<Shown> {
    let mut units = Vec::new();
    let columns = columns(tables, |variable, name| {
        let kept = keep(variable, name);
        if kept {
            units.push(match variable.kind {
                ValueKind::Real => variable.unit.to_string(),
                ValueKind::Boolean => "0/1".to_string(),
                ValueKind::Integer | ValueKind::Enumeration(_) => String::new(),
            });
        }
        kept
    });
    columns.into_iter().zip(units).map(|(column, unit)| Shown { column, unit }).collect()
}

fn is_public(variable: &VariableInfo) -> bool {
    variable.variability >= Variability::Discrete && !variable.protected
}

fn is_top_level(variable: &VariableInfo, name: &str) -> bool {
    is_public(variable) && !variable.name.derivative && !name.contains('.')
}

/// True for scalars and for a few elements of an array: the first, the middle one, the last.
fn stands_for(variable: &VariableInfo, name: &str) -> bool {
    let count = variable.name.count();
    count <= FEW_ELEMENTS || [0, count / 2, count - 1].iter().any(|&k| variable.name.element(k) == name)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use hyd_system::{NamePattern, Place, Settable, Source};

    use super::*;

    fn tables() -> Tables {
        let variable = |name: &str, size: u32, variability, protected| {
            let parts = vec![(Arc::from(name), if size > 0 { vec![size] } else { Vec::new() })];
            VariableInfo {
                name: NamePattern { parts, derivative: false },
                unit: "Pa".into(),
                display_unit: "".into(),
                description: "".into(),
                kind: ValueKind::Real,
                variability,
                settable: Settable::No,
                protected,
                sources: vec![Source { place: Place::Output(0), negated: false }; size.max(1) as usize],
            }
        };
        let variables = vec![
            variable("k", 0, Variability::Parameter, false),
            variable("p", 100, Variability::Continuous, false),
            variable("hidden", 0, Variability::Continuous, true),
            variable("part.q", 0, Variability::Continuous, false),
            variable("on", 0, Variability::Discrete, false),
        ];
        Tables { variables, ..Default::default() }
    }

    fn names(pattern: Option<&str>) -> Vec<String> {
        Selection::new(pattern).unwrap().shown(&tables()).into_iter().map(|shown| shown.column.name).collect()
    }

    #[test]
    fn the_default_is_few_and_public() {
        assert_eq!(names(None), ["p[1]", "p[51]", "p[100]", "on"]);
    }

    #[test]
    fn a_pattern_chooses_anything() {
        assert_eq!(names(Some(r"^(k|part\..*|p\[1.\])$")).len(), 12);
        assert_eq!(names(Some("hidden")), ["hidden"]);
        assert!(matches!(Selection::new(Some("(")), Err(Failure::Usage(_))));
    }
}
