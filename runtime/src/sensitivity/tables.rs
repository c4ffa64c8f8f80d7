//! Tables of a run with sensitivities: each recorded variable `x` is followed by `d(x)/d(p)` for every parameter.
//!
//! The further values stand behind the outputs in each row, and behind the parameters for what is constant in time, so
//! that every sink writes them like any other variable.

use std::sync::Arc;

use hyd_system::{NamePattern, Place, Settable, Source, Tables, ValueKind, Variability, VariableInfo};

/// Tables before and after.
pub(crate) struct ExtendedTables {
    original: Arc<Tables>,
    /// With the derivatives.
    pub(crate) extended: Arc<Tables>,
}

impl ExtendedTables {
    /// Adds derivatives with respect to the named quantities; `outputs` and `parameters` are the lengths of a row and of
    /// the parameters without them.
    pub(crate) fn new(tables: &Arc<Tables>, names: &[String], (outputs, parameters): (usize, usize)) -> Self {
        let mut extended = Tables::clone(tables);
        for (j, name) in names.iter().enumerate() {
            let unit = tables.find(name).map_or("", |(variable, _)| variable.unit.as_ref());
            let recorded = tables.variables.iter();
            let recorded = recorded.filter(|v| v.variability >= Variability::Discrete && v.kind == ValueKind::Real);
            let place = |source: &Source| {
                let position = |first: usize, k: u32| (first + k as usize * names.len() + j) as u32;
                let place = match source.place {
                    Place::Output(k) => Place::Output(position(outputs, k)),
                    Place::Parameter(k) => Place::Parameter(position(parameters, k)),
                    Place::Constant(_) => Place::Constant(0.0),
                };
                Source { place, negated: source.negated }
            };
            extended.variables.extend(recorded.map(|variable| VariableInfo {
                name: derivative_name(&variable.name, name),
                unit: quotient(&variable.unit, unit).into(),
                display_unit: "".into(),
                description: "".into(),
                settable: Settable::No,
                sources: variable.sources.iter().map(place).collect(),
                ..variable.clone()
            }));
        }
        Self { original: Arc::clone(tables), extended: Arc::new(extended) }
    }

    /// True if these tables were extended.
    pub(crate) fn is_of(&self, tables: &Arc<Tables>) -> bool {
        Arc::ptr_eq(&self.original, tables)
    }
}

/// `d(x)/d(p)` over the elements of `x`.
fn derivative_name(variable: &NamePattern, parameter: &str) -> NamePattern {
    let (open, close) = if variable.derivative { ("d(der(", "))") } else { ("d(", ")") };
    let mut parts = variable.parts.clone();
    match parts.first_mut() {
        Some((text, _)) => *text = format!("{open}{text}").into(),
        None => parts.push((open.into(), Vec::new())),
    }
    parts.push((format!("{close}/d({parameter})").into(), Vec::new()));
    NamePattern { parts, derivative: false }
}

/// Unit of a quotient, `""` where one of the two is not known.
fn quotient(above: &str, below: &str) -> String {
    match (above, below) {
        ("", _) | (_, "") => String::new(),
        (above, "1") => above.to_string(),
        (above, below) if below.contains(['.', '/', '(']) => format!("{above}/({below})"),
        (above, below) if above.contains('/') => format!("({above})/{below}"),
        (above, below) => format!("{above}/{below}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_as_derivatives() {
        let array = NamePattern { parts: vec![("a".into(), vec![2]), (".b".into(), vec![3])], derivative: false };
        assert_eq!(derivative_name(&array, "k[1]").element(4), "d(a[2].b[2])/d(k[1])");
        let rate = NamePattern { derivative: true, ..NamePattern::scalar("x") };
        assert_eq!(derivative_name(&rate, "g").element(0), "d(der(x))/d(g)");
    }

    #[test]
    fn units_divide() {
        let cases =
            [("m", "s", "m/s"), ("m/s", "m", "(m/s)/m"), ("Pa", "m3/s", "Pa/(m3/s)"), ("m", "1", "m"), ("m", "", "")];
        for (above, below, expected) in cases {
            assert_eq!(quotient(above, below), expected);
        }
    }
}
