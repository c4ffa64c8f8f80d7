//! Which variables are written, drawn and listed.
//!
//! `--variables REGEX` searches in full names (anchor it with `^` and `$`).  Without it, files get everything that changes, and
//! pictures and summaries a few variables of the top level.

use std::collections::HashSet;
use std::sync::{Arc, Mutex};

use hyd_results::{Column, is_variable};
use hyd_system::{Tables, ValueKind, Variability, VariableInfo};
use regex::Regex;

use crate::Failure;

/// Variables that are shown when nobody says which.
const FEW: usize = 12;
/// Elements that stand for an array then.
const FEW_ELEMENTS: usize = 3;
/// Curves that one picture holds.
pub const MOST_CURVES: usize = 100;

/// A choice of variables by name.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    pattern: Option<Arc<Regex>>,
}

/// The last pattern: whoever asks for one run after the other asks with the same, and compiling it takes longer than a short run.  Nobody waits for
/// it: a process that was forked while a thread held the lock would wait for ever.
static LAST: Mutex<Option<Arc<Regex>>> = Mutex::new(None);

fn compiled(pattern: &str) -> Result<Arc<Regex>, regex::Error> {
    if let Ok(last) = LAST.try_lock()
        && let Some(known) = last.as_ref().filter(|known| known.as_str() == pattern)
    {
        return Ok(known.clone());
    }
    let made = Arc::new(Regex::new(pattern)?);
    if let Ok(mut last) = LAST.try_lock() {
        *last = Some(made.clone());
    }
    Ok(made)
}

impl Selection {
    /// From the argument of `--variables`.
    pub fn new(pattern: Option<&str>) -> Result<Self, Failure> {
        let pattern = pattern.map(compiled).transpose();
        let pattern = pattern.map_err(|error| Failure::Usage(format!("--variables: {error}")))?;
        Ok(Self { pattern })
    }

    /// True if `--variables` was given.
    pub fn is_explicit(&self) -> bool {
        self.pattern.is_some()
    }

    /// True if the name matches, or if there is nothing to match.
    pub fn matches(&self, name: &str) -> bool {
        self.pattern.as_ref().is_none_or(|pattern| pattern.is_match(name))
    }

    /// Does the variable become a column of a file?  A pattern may also ask for parameters.
    pub fn keeps(&self, variable: &VariableInfo, name: &str) -> bool {
        if self.is_explicit() { self.matches(name) } else { is_variable(variable, name) }
    }

    /// The same for formats that store parameters and aliases once.
    pub fn keeps_everything(&self, variable: &VariableInfo, name: &str) -> bool {
        if self.is_explicit() { self.matches(name) } else { !variable.protected }
    }

    /// What pictures and summaries show, with units.
    pub fn shown(&self, tables: &Tables) -> Vec<Shown> {
        let mut shown = self.all_shown(tables);
        // Two derivatives may have one name: that of a state and the same one that the text differentiates again.
        let mut names = HashSet::new();
        shown.retain(|shown| names.insert(shown.column.name.clone()));
        shown
    }

    fn all_shown(&self, tables: &Tables) -> Vec<Shown> {
        if self.is_explicit() {
            return self.matching(tables);
        }
        let public = || tables.variables.iter().filter(|variable| is_public(variable));
        let mut few: Vec<Shown> = public().filter(|v| is_top_level(v)).flat_map(representatives).take(FEW).collect();
        if few.is_empty() {
            few = public().flat_map(representatives).take(FEW).collect();
        }
        few
    }

    /// How many values that a file would hold pictures and summaries leave out; none where `--variables` chose them.
    pub fn left_out(&self, tables: &Tables, shown: usize) -> usize {
        if self.is_explicit() {
            return 0;
        }
        let public = tables.variables.iter().filter(|variable| is_public(variable));
        public.map(|variable| variable.sources.len()).sum::<usize>().saturating_sub(shown)
    }

    /// Most names of a model do not match, so that none is kept before it does.
    fn matching(&self, tables: &Tables) -> Vec<Shown> {
        let mut matching = Vec::new();
        for variable in &tables.variables {
            for element in 0..variable.sources.len() {
                if self.keeps(variable, &variable.name.name(element)) {
                    matching.push(shown(variable, element));
                }
            }
        }
        matching
    }
}

/// A variable to be shown.
#[derive(Clone, PartialEq, Debug)]
pub struct Shown {
    /// Name and source of its values.
    pub column: Column,
    /// Its unit, `""` if unknown; truth values have `0/1`.
    pub unit: String,
}

fn shown(variable: &VariableInfo, element: usize) -> Shown {
    let unit = match variable.kind {
        ValueKind::Real => variable.unit.to_string(),
        ValueKind::Boolean => "0/1".to_string(),
        ValueKind::Integer | ValueKind::Enumeration(_) => String::new(),
    };
    Shown { column: Column { name: variable.name.element(element), source: variable.sources[element] }, unit }
}

fn is_public(variable: &VariableInfo) -> bool {
    variable.variability >= Variability::Discrete && !variable.protected
}

fn is_top_level(variable: &VariableInfo) -> bool {
    !variable.name.derivative && variable.name.parts.iter().all(|(text, _)| !text.contains('.'))
}

/// A scalar, or a few elements of an array: the first, the middle one, the last.
fn representatives(variable: &VariableInfo) -> Vec<Shown> {
    let count = variable.sources.len();
    let elements = if count <= FEW_ELEMENTS { (0..count).collect() } else { vec![0, count / 2, count - 1] };
    elements.into_iter().map(|k| shown(variable, k)).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::time::Duration;

    use super::*;

    #[test]
    fn nobody_waits_for_the_last_pattern() {
        let held = LAST.lock();
        let (sender, receiver) = mpsc::channel();
        std::thread::spawn(move || sender.send(Selection::new(Some("^y$")).is_ok_and(|own| own.matches("y"))));
        assert_eq!(receiver.recv_timeout(Duration::from_secs(10)), Ok(true));
        drop(held);
    }
}
