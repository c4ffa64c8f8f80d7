//! What repeats itself where an event does not settle: the variables that change from pass to pass, with their values.

use hyd_system::{Place, Source, ValueKind};

use crate::problem::Problem;

/// Passes that are kept.
const KEPT: usize = 12;
/// Variables that are listed, those of discrete kinds first.
const MOST_VARIABLES: usize = 6;
/// Values that are listed of each.
const MOST_VALUES: usize = 6;

/// A variable that changes from pass to pass.
#[derive(Clone, PartialEq, Debug)]
pub struct Changing {
    /// Its name.
    pub name: String,
    /// Its values in the order of the passes, those of one turn of the cycle where there is one.
    pub values: Vec<f64>,
    /// How they are to be read.
    pub kind: ValueKind,
}

/// The last passes of an event iteration.
#[derive(Default)]
pub(crate) struct Cycle {
    rows: Vec<Vec<f64>>,
}

/// What changes in the last passes.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Repeats {
    /// After how many passes the values repeat themselves; none if they do not.
    pub period: Option<usize>,
    /// The variables that change.
    pub variables: Vec<Changing>,
}

impl Cycle {
    /// Keeps the values after pass `pass` of `most` if it is one of the last.
    pub(crate) fn note(&mut self, problem: &mut Problem<'_>, (pass, most): (usize, usize), at: (f64, &[f64], &[f64])) {
        if pass + KEPT < most {
            return;
        }
        let (t, y, yp) = at;
        let mut row = vec![0.0; problem.system.structure().outputs];
        problem.system.outputs(t, y, yp, &mut row);
        self.rows.push(row);
    }

    /// The variables that change among the passes kept.
    pub(crate) fn repeats(&self, problem: &Problem<'_>) -> Repeats {
        let Some(last) = self.rows.last() else { return Repeats::default() };
        let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| a == b || a.is_nan() && b.is_nan());
        let back = |period: &usize| self.rows.len() > *period && same(&self.rows[self.rows.len() - 1 - period], last);
        let period = (1..self.rows.len()).find(back);
        let shown = period.unwrap_or(self.rows.len()).min(MOST_VALUES).min(self.rows.len());
        let rows = &self.rows[self.rows.len() - shown..];
        let mut variables = Vec::new();
        for variable in &problem.system.tables().variables {
            for (k, source) in variable.sources.iter().enumerate() {
                let Source { place: Place::Output(place), negated } = *source else { continue };
                let value = |row: &Vec<f64>| if negated { -row[place as usize] } else { row[place as usize] };
                let values: Vec<f64> = rows.iter().map(value).collect();
                if values.iter().any(|value| *value != values[0]) && !variable.name.derivative {
                    variables.push(Changing { name: variable.name.element(k), values, kind: variable.kind.clone() });
                }
            }
        }
        variables.sort_by_key(|changing| changing.kind == ValueKind::Real);
        variables.truncate(MOST_VARIABLES);
        Repeats { period, variables }
    }
}
