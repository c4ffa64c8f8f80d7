//! The variables that a page lists: names, units, what may be set within which limits, and where their values are found.

use std::collections::{BTreeMap, BTreeSet};

use hyd_compiler::Compilation;
use hyd_system::{Place, Settable, Tables, ValueKind, Variability};
use serde_json::{Value, json};

/// Variables that a page lists.
const MOST: usize = 20_000;

/// All variables of a model as data, and how many were left out.
pub(crate) fn of_model(compilation: &Compilation, tables: &Tables) -> (Vec<Value>, usize) {
    let limits = Limits::of(compilation);
    let mut listed = Vec::new();
    let mut names = BTreeSet::new();
    let mut left_out = 0;
    for variable in &tables.variables {
        for (element, source) in variable.sources.iter().enumerate() {
            let name = variable.name.element(element);
            if !names.insert(name.clone()) {
                continue;
            }
            if listed.len() >= MOST {
                left_out += 1;
                continue;
            }
            let sign = if source.negated { -1 } else { 1 };
            let mut own = json!({"n": name});
            let Value::Object(fields) = &mut own else { continue };
            match source.place {
                Place::Output(k) => fields.insert("o".into(), json!([k, sign])),
                Place::Parameter(k) => fields.insert("p".into(), json!([k, sign])),
                Place::Constant(value) => fields.insert("c".into(), json!(if source.negated { -value } else { value })),
            };
            let unit = if variable.unit.is_empty() { limits.unit(&name) } else { &variable.unit };
            for (key, text) in [("u", unit), ("d", &*variable.description)] {
                if !text.is_empty() {
                    fields.insert(key.into(), text.into());
                }
            }
            match &variable.kind {
                ValueKind::Real => {}
                ValueKind::Integer => drop(fields.insert("k".into(), "Integer".into())),
                ValueKind::Boolean => drop(fields.insert("k".into(), "Boolean".into())),
                ValueKind::Enumeration(literals) => {
                    let literals: Vec<&str> = literals.iter().map(|own| &**own).collect();
                    fields.insert("k".into(), json!(literals));
                }
            }
            match variable.variability {
                Variability::Constant => drop(fields.insert("v".into(), "constant".into())),
                Variability::Parameter => drop(fields.insert("v".into(), "parameter".into())),
                Variability::Discrete => drop(fields.insert("v".into(), "discrete".into())),
                Variability::Continuous => {}
            }
            match variable.settable {
                Settable::Yes => {
                    fields.insert("s".into(), 1.into());
                    let (min, max) = limits.of_element(&name);
                    for (key, limit) in [("lo", min), ("hi", max)] {
                        if let Some(limit) = limit {
                            fields.insert(key.into(), limit.into());
                        }
                    }
                }
                Settable::Structural => drop(fields.insert("s".into(), 0.into())),
                Settable::No => {}
            }
            if variable.protected {
                fields.insert("x".into(), 1.into());
            }
            listed.push(own);
        }
    }
    (listed, left_out)
}

/// What the flat model knows beyond the tables.
struct Limits {
    by_name: BTreeMap<String, (Option<f64>, Option<f64>)>,
    units: BTreeMap<String, String>,
}

impl Limits {
    fn of(compilation: &Compilation) -> Self {
        let mut found = Self { by_name: BTreeMap::new(), units: BTreeMap::new() };
        let Some(flat) = &compilation.flat else { return found };
        for block in flat.variables.raw.iter().filter(|block| block.settable == Settable::Yes) {
            for k in 0..(block.count as usize).min(MOST) {
                let finite = |value: f64| Some(value).filter(|value| value.is_finite() && value.abs() < f64::MAX / 2.0);
                let limits = (finite(block.min.get(k)), finite(block.max.get(k)));
                if limits != (None, None) {
                    found.by_name.insert(block.name.element(k), limits);
                }
            }
        }
        for (variable, unit) in compilation.inferred_units.iter().take(MOST) {
            found.units.insert(flat.var_name(*variable), unit.clone());
        }
        found
    }

    fn of_element(&self, name: &str) -> (Option<f64>, Option<f64>) {
        self.by_name.get(name).copied().unwrap_or_default()
    }

    /// The unit that follows for a variable that declares none.
    fn unit(&self, name: &str) -> &str {
        self.units.get(name).map_or("", String::as_str)
    }
}

/// The variables of result files beside those of a model.
pub(crate) fn of_files<'a>(names: impl Iterator<Item = (&'a str, &'a str)>, known: &mut Vec<Value>) -> usize {
    let mut listed: BTreeSet<String> = known.iter().filter_map(|own| own["n"].as_str().map(str::to_string)).collect();
    let mut left_out = 0;
    for (name, unit) in names {
        if listed.contains(name) {
            continue;
        }
        if known.len() >= MOST {
            left_out += 1;
            continue;
        }
        listed.insert(name.to_string());
        known.push(if unit.is_empty() { json!({"n": name}) } else { json!({"n": name, "u": unit}) });
    }
    left_out
}
