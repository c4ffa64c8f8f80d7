//! Initial states of shots: what a study says of them, and the text that puts them into the model.
//!
//! A lab does not begin its records where the model has its start values.  `[initial]` gives states a value at the beginning of every
//! shot by a formula of what the shot records and of its first samples (`beginnings`), lets it be fitted around that value, or begins
//! where the state is at rest under the inputs of that moment.  The model gets a parameter for each of them.

use std::fmt;

use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, MapAccess, Visitor};

use crate::study::formula::written;

/// What a study says of a state.
#[derive(Clone, Debug)]
pub enum Initial {
    /// A formula of its value.
    Formula(String),
    /// All of it.
    Stated(StatedInitial),
}

/// What a study says of a state, in full.
#[derive(Deserialize, Clone, Debug)]
#[serde(deny_unknown_fields)]
pub struct StatedInitial {
    /// Formula of its value.
    #[serde(default, deserialize_with = "written")]
    pub value: Option<String>,
    /// Standard deviation of the true value around it, in the unit of the state; without it the value is exact.
    pub absolute: Option<f64>,
    /// True where its derivative is zero at the beginning.
    #[serde(default)]
    pub at_rest: bool,
}

impl Initial {
    /// The formula of the value; none for a state at rest.
    pub fn formula(&self) -> Option<&str> {
        match self {
            Self::Formula(formula) => Some(formula),
            Self::Stated(stated) => stated.value.as_deref(),
        }
    }

    /// Standard deviation around that value, where there is one.
    pub fn absolute(&self) -> Option<f64> {
        match self {
            Self::Formula(_) => None,
            Self::Stated(stated) => stated.absolute,
        }
    }
}

// By hand, so that a key that does not belong there is reported by its name.
impl<'de> Deserialize<'de> for Initial {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Initial;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a formula as text, a number, or a table with `value` or `at_rest`")
            }

            fn visit_str<E>(self, formula: &str) -> Result<Initial, E> {
                Ok(Initial::Formula(formula.to_string()))
            }

            fn visit_f64<E>(self, number: f64) -> Result<Initial, E> {
                Ok(Initial::Formula(format!("{number:e}")))
            }

            fn visit_i64<E>(self, number: i64) -> Result<Initial, E> {
                Ok(Initial::Formula(number.to_string()))
            }

            fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Initial, M::Error> {
                StatedInitial::deserialize(MapAccessDeserializer::new(map)).map(Initial::Stated)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// A state whose beginning a study sets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StartOf {
    /// Full name of the state.
    pub state: String,
    /// True where its derivative is zero at the beginning.
    pub at_rest: bool,
}

impl StartOf {
    /// Name of the parameter that the beginning of a state becomes: quoted, because nobody calls a variable like that.
    pub fn parameter(state: &str) -> String {
        format!("'start of {}'", state.replace('\'', "\\'"))
    }

    /// True for the names of such parameters.
    pub(crate) fn is_parameter(name: &str) -> bool {
        Self::set_as(name) != name
    }

    /// The name by which a run sets what a parameter of these is: the start value of the state, which the base model has as well.
    pub(crate) fn set_as(parameter: &str) -> String {
        let state = parameter.strip_prefix("'start of ").and_then(|rest| rest.strip_suffix('\''));
        state.map_or_else(|| parameter.to_string(), |state| format!("{}.start", state.replace("\\'", "'")))
    }

    /// The modifications of the state.
    pub(crate) fn modifications(&self) -> Vec<String> {
        match self.at_rest {
            true => vec!["fixed = false".to_string()],
            false => vec![format!("start = {}", Self::parameter(&self.state)), "fixed = true".to_string()],
        }
    }
}

/// Declarations of the parameters that `known`, the text of the base, does not have; with a value from `values`, literals by name, so that
/// a run of the text alone does not begin at zero, where no shot does.
pub(crate) fn declarations(starts: &[StartOf], known: &str, values: &[(String, String)]) -> String {
    let new = starts.iter().filter(|start| !start.at_rest && !known.contains(&StartOf::parameter(&start.state)));
    let line = |start: &StartOf| {
        let name = StartOf::parameter(&start.state);
        let value = values.iter().find(|(own, _)| *own == name).map_or("0", |(_, literal)| literal);
        format!("  parameter Real {name} = {value} \"{} at the beginning\";\n", start.state)
    };
    new.map(line).collect()
}

/// Initial equations of the states at rest.
pub(crate) fn equations(starts: &[StartOf]) -> String {
    let lines: String =
        starts.iter().filter(|start| start.at_rest).map(|start| format!("  der({}) = 0;\n", start.state)).collect();
    if lines.is_empty() { lines } else { format!("initial equation\n{lines}") }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::Initial;

    #[test]
    fn a_value_is_a_formula_or_a_number() {
        #[derive(serde::Deserialize)]
        struct Own {
            x: Initial,
        }
        let of = |text: &str| toml::from_str::<Own>(text).map(|own| own.x);
        for (text, formula) in [
            ("x = \"x0_m\"", "x0_m"),
            ("x = 2", "2"),
            ("x = -0.25", "-2.5e-1"),
            ("x = { value = 0.0, absolute = 0.5 }", "0e0"),
            ("x = { value = \"2*a\" }", "2*a"),
        ] {
            assert_eq!(of(text).unwrap().formula(), Some(formula), "{text}");
        }
        assert_eq!(of("x = { at_rest = true }").unwrap().formula(), None);
        assert!(of("x = true").unwrap_err().to_string().contains("a formula as text, a number, or a table"));
        assert!(of("x = { valu = 1 }").is_err());
    }
}
