//! Type definitions: the types that declarations of the model name, with what all their variables have in common.
//!
//! Source: Functional Mock-up Interface 2.0.4, section 2.2.3; 3.0.2, section 2.4.5.  Variables repeat what their type says, because many
//! importers look at variables alone.

use std::collections::{BTreeMap, BTreeSet};

use hyd_system::ValueKind;

use crate::facts::{Bounds, DeclaredType, Text, Version};
use crate::variables::Entry;
use crate::xml::{Attributes, Document, number};

/// What tells types apart: name, quantity and literals.
type Key = (String, String, Vec<String>);

/// A type with what its variables share.
struct Definition {
    name: String,
    kind: ValueKind,
    quantity: String,
    unit: String,
    display_unit: String,
    bounds: Bounds,
    literals: Vec<String>,
}

/// The types of all variables.
pub(crate) struct Types {
    definitions: Vec<Definition>,
    of: BTreeMap<Key, usize>,
}

impl Types {
    /// Those that the declarations of the variables name, and all enumerations.  A type must not have the name of a variable.
    pub(crate) fn of(entries: &[Entry], texts: &[Text]) -> Self {
        let taken = entries.iter().flat_map(|entry| {
            let aliases = entry.aliases.iter().map(|(name, _)| name.as_str());
            aliases.chain([entry.name.as_str()])
        });
        let taken = taken.chain(texts.iter().map(|text| text.name.as_str()));
        let mut taken: BTreeSet<String> = taken.map(String::from).collect();
        let mut types = Self { definitions: Vec::new(), of: BTreeMap::new() };
        for entry in entries {
            let key = key(entry);
            if let Some(&known) = types.of.get(&key) {
                types.definitions[known].share(entry);
                continue;
            }
            let enumeration = matches!(entry.kind, ValueKind::Enumeration(_));
            let DeclaredType { name, quantity, literals } = entry.declared.clone();
            let own = (!name.is_empty() && !taken.contains(&name)).then_some(name);
            let name = match own {
                Some(name) => name,
                None if enumeration => {
                    // An importer must know the literals, whatever the type is called.
                    let mut names = (1..).map(|k| format!("Enumeration{k}"));
                    names.find(|name| !taken.contains(name)).unwrap_or_default()
                }
                None => continue,
            };
            taken.insert(name.clone());
            types.of.insert(key, types.definitions.len());
            let (unit, display_unit) = (entry.unit.clone(), entry.display_unit.clone());
            let (kind, bounds) = (entry.kind.clone(), entry.bounds);
            types.definitions.push(Definition { name, kind, quantity, unit, display_unit, bounds, literals });
        }
        types
    }

    /// The name of a variable's type, if it is defined.
    pub(crate) fn name_of(&self, entry: &Entry) -> Option<&str> {
        self.of.get(&key(entry)).map(|&k| self.definitions[k].name.as_str())
    }

    pub(crate) fn write(&self, document: &mut Document, version: Version) {
        if self.definitions.is_empty() {
            return;
        }
        document.element("TypeDefinitions", Attributes::default(), |document| {
            for definition in &self.definitions {
                let named = Attributes::default().with("name", &definition.name);
                match version {
                    Version::Two => document.element("SimpleType", named, |document| {
                        definition.write(document, definition.element(version), Attributes::default());
                    }),
                    Version::Three => definition.write(document, definition.element(version), named),
                }
            }
        });
    }
}

fn key(entry: &Entry) -> Key {
    let literals = match &entry.kind {
        ValueKind::Enumeration(literals) => literals.iter().map(ToString::to_string).collect(),
        ValueKind::Real | ValueKind::Integer | ValueKind::Boolean => Vec::new(),
    };
    let DeclaredType { name, quantity, .. } = &entry.declared;
    (name.clone(), quantity.clone(), literals)
}

impl Definition {
    /// Keeps what a further variable has, too.
    fn share(&mut self, entry: &Entry) {
        let both = |kept: Option<f64>, other: Option<f64>| kept.filter(|_| kept == other);
        for (kept, other) in [(&mut self.unit, &entry.unit), (&mut self.display_unit, &entry.display_unit)] {
            if kept != other {
                kept.clear();
            }
        }
        let (kept, other) = (&mut self.bounds, &entry.bounds);
        kept.min = both(kept.min, other.min);
        kept.max = both(kept.max, other.max);
        kept.nominal = both(kept.nominal, other.nominal);
    }

    fn element(&self, version: Version) -> &'static str {
        match (&self.kind, version) {
            (ValueKind::Real, Version::Two) => "Real",
            (ValueKind::Real, Version::Three) => "Float64Type",
            (ValueKind::Integer, Version::Two) => "Integer",
            (ValueKind::Integer, Version::Three) => "Int64Type",
            (ValueKind::Boolean, Version::Two) => "Boolean",
            (ValueKind::Boolean, Version::Three) => "BooleanType",
            (ValueKind::Enumeration(_), Version::Two) => "Enumeration",
            (ValueKind::Enumeration(_), Version::Three) => "EnumerationType",
        }
    }

    fn write(&self, document: &mut Document, element: &'static str, attributes: Attributes) {
        let attributes = match self.kind {
            ValueKind::Boolean => attributes,
            _ => attributes.text("quantity", &self.quantity),
        };
        match &self.kind {
            ValueKind::Real => {
                // A display unit needs a unit.
                let display = if self.unit.is_empty() { "" } else { &self.display_unit };
                let attributes = attributes.text("unit", &self.unit).text("displayUnit", display);
                document.empty(element, limits(attributes, &self.kind, &self.bounds));
            }
            ValueKind::Integer => document.empty(element, limits(attributes, &self.kind, &self.bounds)),
            ValueKind::Boolean => document.empty(element, attributes),
            ValueKind::Enumeration(literals) => document.element(element, attributes, |document| {
                for (k, literal) in literals.iter().enumerate() {
                    let item = Attributes::default().with("name", literal).with("value", k + 1);
                    let description = self.literals.get(k).map_or("", String::as_str);
                    document.empty("Item", item.text("description", description));
                }
            }),
        }
    }
}

/// Limits and usual size of a number.  Version 2.0 has no word for a value that is not a number of its type.
pub(crate) fn limits(attributes: Attributes, kind: &ValueKind, bounds: &Bounds) -> Attributes {
    let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
    match kind {
        ValueKind::Real => attributes
            .maybe("min", finite(bounds.min).map(number))
            .maybe("max", finite(bounds.max).map(number))
            .maybe("nominal", finite(bounds.nominal).filter(|nominal| *nominal > 0.0).map(number)),
        ValueKind::Integer => attributes
            .maybe("min", finite(bounds.min).map(|value| format!("{value:.0}")))
            .maybe("max", finite(bounds.max).map(|value| format!("{value:.0}"))),
        ValueKind::Boolean | ValueKind::Enumeration(_) => attributes,
    }
}
