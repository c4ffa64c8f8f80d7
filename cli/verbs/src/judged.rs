//! What a run shows that an assertion has ended: conditions of `when` that were true throughout, and how what is compared came to where it is.

use hyd_compiler::{Compilation, held_conditions, judged_courses};
use hyd_flat::Made;
use hyd_results::Trajectory;
use hyd_source::{Diagnostic, Label, Span};

use crate::trials::Trials;

/// A run that fails at the start says nothing of conditions.
const FEWEST_ROWS: usize = 2;
/// Of more conditions none is named: in a state machine many hold for long.
const MOST: usize = 2;

impl Trials<'_> {
    /// Says in the message of a failed assertion from where to where the variables went that it compares, and which conditions of `when` held all
    /// through the run, as far as it can be repeated in the steps that trying allows.
    pub fn tell_course(&self, compilation: &Compilation, diagnostic: &mut Diagnostic) {
        let Some(flat) = compilation.flat.as_deref() else { return };
        let mut rows = Trajectory::new();
        if self.recorded(compilation, &mut rows).is_none() || rows.len() < FEWEST_ROWS {
            return;
        }
        let ends = |name: &str| rows.series(name).map(|series| (series.at(0), series.at(rows.len() - 1)));
        if let Some(at) = diagnostic.labels.iter().find(|label| label.primary).map(|label| label.span) {
            diagnostic.notes.splice(0..0, judged_courses(flat, at, &ends));
        }
        if !flat.variables.iter().any(|block| block.made == Some(Made::Event)) {
            return;
        }
        let value = |row: usize, name: &str| rows.series(name).map(|series| series.at(row));
        let held: Vec<(String, Span)> = held_conditions(flat, rows.times(), &value);
        if held.len() > MOST {
            return;
        }
        for (text, span) in held {
            let words =
                format!("`{text}` holds from the start, and a `when` acts only when its condition becomes true");
            diagnostic.notes.insert(0, words);
            diagnostic.labels.push(Label { span, message: String::new(), primary: false });
        }
    }
}
