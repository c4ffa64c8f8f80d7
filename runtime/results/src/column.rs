//! Variables of a system's tables as named columns of numbers.
//!
//! A column is a full name and a source (a place in the row, a parameter or a constant, and a sign), so that eliminated
//! aliases cost a column name and nothing else.  Which variables become columns is the caller's choice.

use std::collections::HashSet;

use hyd_system::{Place, Source, Tables, Variability, VariableInfo};

/// Decides by variable and full name of the element whether it becomes a column.
pub type Keep = Box<dyn FnMut(&VariableInfo, &str) -> bool + Send>;

/// A named value of a run.
#[derive(Clone, PartialEq, Debug)]
pub struct Column {
    /// Full instance path, such as `a[2].b[1,3]` or `der(x)`.
    pub name: String,
    /// Where the value is found.
    pub source: Source,
}

impl Column {
    /// The value in a row of outputs; NaN if the tables address more than there is.
    pub fn value(&self, row: &[f64], parameters: &[f64]) -> f64 {
        source_value(self.source, row, parameters)
    }
}

/// The value behind a source.
pub(crate) fn source_value(source: Source, row: &[f64], parameters: &[f64]) -> f64 {
    let value = match source.place {
        Place::Output(k) => row.get(k as usize).copied().unwrap_or(f64::NAN),
        Place::Parameter(k) => parameters.get(k as usize).copied().unwrap_or(f64::NAN),
        Place::Constant(value) => value,
    };
    if source.negated { -value } else { value }
}

/// True for what changes during a run by declaration: the usual choice of columns.
pub fn is_variable(variable: &VariableInfo, _name: &str) -> bool {
    variable.variability >= Variability::Discrete
}

/// The columns of all elements that `keep` accepts, in the order of the tables.
pub fn columns(tables: &Tables, keep: impl FnMut(&VariableInfo, &str) -> bool) -> Vec<Column> {
    described_columns(tables, keep).into_iter().map(|(column, _)| column).collect()
}

/// The same, each with the variable that it is an element of.
pub fn described_columns(
    tables: &Tables,
    mut keep: impl FnMut(&VariableInfo, &str) -> bool,
) -> Vec<(Column, &VariableInfo)> {
    let mut all = Vec::new();
    // A name is a column once, whatever the tables hold under it.
    let mut known = HashSet::new();
    for variable in &tables.variables {
        for (element, &source) in variable.sources.iter().enumerate() {
            let name = variable.name.element(element);
            if keep(variable, &name) && known.insert(name.clone()) {
                all.push((Column { name, source }, variable));
            }
        }
    }
    all
}
