//! Initial states of shots: what a study says of them, and the text that puts them into the model.
//!
//! A lab does not begin its records where the model has its start values.  `[initial]` gives states a value at the beginning of every
//! shot by a formula of what the shot records and of its first samples (`beginnings`), lets it be fitted around that value, or begins
//! where the state is at rest under the inputs of that moment.  The model gets a parameter for each of them.

use std::collections::BTreeMap;
use std::fmt;

use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, MapAccess, Visitor};

use crate::elements::{At, sizes};
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
        name.starts_with("'start of ")
    }

    /// The name of the state without subscripts, and these in their order; none where a subscript is not a number from 1 on.
    pub(crate) fn array(state: &str) -> Option<(String, Vec<usize>)> {
        let mut parts = state.split('[');
        let mut name = parts.next()?.to_string();
        let mut subscripts = Vec::new();
        for part in parts {
            let (inside, rest) = part.split_once(']')?;
            for subscript in inside.split(',') {
                subscripts.push(subscript.trim().parse().ok().filter(|own| *own > 0)?);
            }
            name.push_str(rest);
        }
        Some((name, subscripts))
    }

    /// The name by which a run sets what a parameter of these is: the start value of the state, which the base model has as well.
    pub(crate) fn set_as(parameter: &str) -> String {
        let state = parameter.strip_prefix("'start of ").and_then(|rest| rest.strip_suffix('\''));
        // That of an element of an array has no name of its own.
        let state = state.filter(|state| !state.contains('['));
        state.map_or_else(|| parameter.to_string(), |state| format!("{}.start", state.replace("\\'", "'")))
    }

    /// The states with their modifications, by the names of the arrays that they are elements of.
    pub(crate) fn modifications(all: &[Self]) -> Vec<(String, Vec<String>)> {
        let mut arrays: BTreeMap<String, Vec<(Vec<usize>, &Self)>> = BTreeMap::new();
        for own in all {
            let (name, subscripts) = Self::array(&own.state).unwrap_or_else(|| (own.state.clone(), Vec::new()));
            arrays.entry(name).or_default().push((subscripts, own));
        }
        let of = |(name, elements): (String, Vec<(Vec<usize>, &Self)>)| {
            let sizes = sizes(elements.iter().map(|(subscripts, _)| subscripts.as_slice()));
            let each = if sizes.is_empty() { "" } else { "each " };
            if elements.iter().any(|(_, own)| own.at_rest) {
                return (name, vec![format!("{each}fixed = false")]);
            }
            let at = At { sizes, subscripts: Vec::new() };
            let value = |wanted: &[usize]| {
                let own = elements.iter().find(|(subscripts, _)| subscripts == wanted);
                own.map_or_else(|| "0".to_string(), |(_, own)| Self::parameter(&own.state))
            };
            (name, vec![format!("start = {}", at.array(&value)), format!("{each}fixed = true")])
        };
        arrays.into_iter().map(of).collect()
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
