//! The description of a model: `modelDescription.xml` of both versions, and the list of its connectors.
//!
//! Source: Functional Mock-up Interface 2.0.4, sections 2.2, 3.3, 4.3; 3.0.2, sections 2.4, 3.3, 4.3.  One list of variables serves both;
//! what differs is how an element is called and how others are referred to: by position in 2.0, by number in 3.0.

use std::collections::{BTreeMap, BTreeSet};

use hyd_payload::Model;
use hyd_payload::program::Area;
use hyd_system::{MemberKind, Place, ValueKind};

use crate::archive::identifier;
use crate::around::{Around, is_elsewhere, place_of};
use crate::catalogue::{Catalogue, Meaning};
use crate::dependencies::{Dependencies, dependencies};
use crate::facts::{Facts, Text, Version};
use crate::terminals::{self, Names};
use crate::types::{Types, limits};
use crate::units::Units;
use crate::variables::{Causality, Changes, Entry, Variables};
use crate::xml::{Attributes, Document, list, number};

/// Categories of messages, with what they are for.
const CATEGORIES: [(&str, &str); 3] = [
    ("logStatusWarning", "Assertions of level warning that do not hold"),
    ("logStatusError", "What ends a run"),
    ("logEvents", "Events that the importer handles, and what they change"),
];

/// What is written on a model.
#[derive(Clone, Debug)]
pub struct Descriptions {
    /// `modelDescription.xml`
    pub model: Vec<u8>,
    /// `terminalsAndIcons.xml`, where the model has connectors.
    pub terminals: Option<Vec<u8>>,
}

/// The descriptions of a model.  `token`: what the library is to know the unit by.  None where states have no names, which a model of
/// this program always has.
pub fn describe(model: &Model, facts: &Facts, version: Version, token: &str) -> Option<Descriptions> {
    let catalogue = Catalogue::new(model, facts.texts.len())?;
    let mut variables = Variables::new(model, facts, &catalogue, version)?;
    let units = Units::of(&mut variables.entries, facts);
    let types = Types::of(&variables.entries, &facts.texts);
    let writer = Description { model, catalogue: &catalogue, version, variables: &variables, types: &types };
    let mut document = Document::new();
    let structured = variables
        .entries
        .iter()
        .all(|entry| is_structured(&entry.name) && entry.aliases.iter().all(|(name, _)| is_structured(name)))
        && facts.texts.iter().all(|text| is_structured(&text.name));
    let root = Attributes::default()
        .with("fmiVersion", version.text())
        .with("modelName", &model.tables.model)
        .with(if version == Version::Two { "guid" } else { "instantiationToken" }, token)
        .text("description", &model.identity.description)
        .with("generationTool", &facts.tool)
        .with("variableNamingConvention", if structured { "structured" } else { "flat" });
    let root = match version {
        Version::Two => root.with("numberOfEventIndicators", model.structure.roots),
        Version::Three => root,
    };
    document.element("fmiModelDescription", root, |document| {
        writer.interfaces(document);
        units.write(document, facts);
        types.write(document, version);
        document.element("LogCategories", Attributes::default(), |document| {
            for (name, text) in CATEGORIES {
                document.empty("Category", Attributes::default().with("name", name).with("description", text));
            }
        });
        writer.experiment(document);
        document.element("ModelVariables", Attributes::default(), |document| {
            variables.entries.iter().for_each(|entry| match version {
                Version::Two => writer.variable_two(document, entry),
                Version::Three => writer.variable_three(document, entry),
            });
            facts.texts.iter().enumerate().for_each(|(k, text)| writer.text(document, k, text));
        });
        writer.structure(document);
    });
    let written = names_of_members(model, facts, &catalogue, version);
    let names = Names::new(&variables.entries, &written);
    Some(Descriptions { model: document.finish(), terminals: terminals::write(facts, version, &names) })
}

/// The names of the variables that connectors have; elements of an array that is one variable have its name.
fn names_of_members(
    model: &Model,
    facts: &Facts,
    catalogue: &Catalogue,
    version: Version,
) -> BTreeMap<(usize, usize), String> {
    let members = facts.terminals.iter().flat_map(|terminal| &terminal.members);
    let name = |&((variable, element), _): &((usize, usize), MemberKind)| {
        let pattern = &model.tables.variables.get(variable)?.name;
        let whole = version == Version::Three && catalogue.is_array(variable);
        let name = if whole { pattern.parts[0].0.to_string() } else { pattern.element(element) };
        Some(((variable, element), name))
    };
    members.filter_map(name).collect()
}

struct Description<'a> {
    model: &'a Model,
    catalogue: &'a Catalogue,
    version: Version,
    variables: &'a Variables,
    types: &'a Types,
}

impl Description<'_> {
    /// What the unit can do; systems with delays have no finite state, so no integrator outside can solve them.
    fn interfaces(&self, document: &mut Document) {
        let name = identifier(&self.model.tables.model);
        let exchange = self.model.structure.delays.is_empty();
        let both = || Attributes::default().with("modelIdentifier", &name);
        match self.version {
            Version::Two => {
                let states = |attributes: Attributes| {
                    attributes.with("canNotUseMemoryManagementFunctions", true).with("canGetAndSetFMUstate", true)
                };
                if exchange {
                    let attributes = states(both()).with("canSerializeFMUstate", true);
                    document.empty("ModelExchange", attributes.with("providesDirectionalDerivative", true));
                }
                let attributes = both().with("canHandleVariableCommunicationStepSize", true);
                let attributes = states(attributes.with("canInterpolateInputs", true));
                document.empty("CoSimulation", attributes.with("canSerializeFMUstate", true));
            }
            Version::Three => {
                let states = |attributes: Attributes| attributes.with("canGetAndSetFMUState", true);
                if exchange {
                    let attributes = states(both()).with("canSerializeFMUState", true);
                    let attributes = attributes.with("providesDirectionalDerivatives", true);
                    document.empty("ModelExchange", attributes.with("needsCompletedIntegratorStep", true));
                }
                let attributes = states(both())
                    .with("canSerializeFMUState", true)
                    .with("canHandleVariableCommunicationStepSize", true)
                    .with("providesIntermediateUpdate", true)
                    .with("mightReturnEarlyFromDoStep", true)
                    .with("canReturnEarlyAfterIntermediateUpdate", true)
                    .with("hasEventMode", true);
                document.empty("CoSimulation", attributes);
            }
        }
    }

    fn experiment(&self, document: &mut Document) {
        let experiment = &self.model.experiment;
        let attributes = Attributes::default()
            .with("startTime", number(experiment.start.unwrap_or(0.0)))
            .with("stopTime", number(experiment.stop.unwrap_or(experiment.start.unwrap_or(0.0) + 1.0)))
            .with("tolerance", number(experiment.tolerance.unwrap_or(1e-6)));
        document.empty("DefaultExperiment", attributes.maybe("stepSize", experiment.interval.map(number)));
    }

    /// Attributes that both versions share.
    fn common(&self, entry: &Entry) -> Attributes {
        let attributes = Attributes::default()
            .with("name", &entry.name)
            .with("valueReference", entry.reference)
            .text("description", &entry.description)
            .with("causality", entry.causality.text())
            .with("variability", entry.changes.text());
        match entry.causality {
            Causality::Independent | Causality::Input => attributes,
            _ => attributes.with("initial", if entry.start.is_empty() { "calculated" } else { "exact" }),
        }
    }

    /// Type and attributes of the value.
    fn value(&self, entry: &Entry, attributes: Attributes) -> (&'static str, Attributes) {
        let two = self.version == Version::Two;
        let start = list(entry.start.iter().map(|&value| match entry.kind {
            ValueKind::Real => number(value),
            ValueKind::Boolean => (value != 0.0).to_string(),
            ValueKind::Integer | ValueKind::Enumeration(_) => format!("{value:.0}"),
        }));
        let attributes = attributes.maybe("declaredType", self.types.name_of(entry));
        let quantity = &entry.declared.quantity;
        match &entry.kind {
            ValueKind::Real => {
                let attributes = attributes.text("quantity", quantity);
                let attributes = attributes.text("unit", &entry.unit).text("displayUnit", &entry.display_unit);
                let attributes = limits(attributes, &entry.kind, &entry.bounds).text("start", &start);
                (if two { "Real" } else { "Float64" }, attributes)
            }
            ValueKind::Integer => {
                let attributes = limits(attributes.text("quantity", quantity), &entry.kind, &entry.bounds);
                (if two { "Integer" } else { "Int64" }, attributes.text("start", &start))
            }
            ValueKind::Boolean => ("Boolean", attributes.text("start", &start)),
            ValueKind::Enumeration(_) => ("Enumeration", attributes.text("quantity", quantity).text("start", &start)),
        }
    }

    fn variable_two(&self, document: &mut Document, entry: &Entry) {
        let (name, mut attributes) = self.value(entry, Attributes::default());
        if let Some(state) = entry.rate_of {
            let owner = |other: &Entry| other.reference == state && !other.is_alias;
            let position = self.variables.entries.iter().position(owner);
            attributes = attributes.maybe("derivative", position.map(|k| k + 1));
        }
        let attributes = attributes.flag("reinit", entry.reinit);
        document.element("ScalarVariable", self.common(entry), |document| document.empty(name, attributes));
    }

    fn variable_three(&self, document: &mut Document, entry: &Entry) {
        let (name, attributes) = self.value(entry, self.common(entry));
        let attributes = attributes.maybe("derivative", entry.rate_of).flag("reinit", entry.reinit);
        document.element(name, attributes, |document| {
            for size in &entry.sizes {
                document.empty("Dimension", Attributes::default().with("start", size));
            }
            for (name, description) in &entry.aliases {
                document.empty("Alias", Attributes::default().with("name", name).text("description", description));
            }
        });
    }

    fn text(&self, document: &mut Document, k: usize, text: &Text) {
        let common = Attributes::default()
            .with("name", &text.name)
            .with("valueReference", self.catalogue.text(k))
            .text("description", &text.description)
            .with("causality", Causality::Local.text())
            .with("variability", Changes::Never.text())
            .with("initial", "exact");
        let value = |name| Attributes::default().exact(name, &text.value);
        match self.version {
            Version::Two => {
                document.element("ScalarVariable", common, |document| document.empty("String", value("start")));
            }
            Version::Three => document.element("String", common, |document| document.empty("Start", value("value"))),
        }
    }

    /// Outputs, rates and what is unknown at the start, with what they depend on as far as it is known.
    fn structure(&self, document: &mut Document) {
        let entries = &self.variables.entries;
        let owners = entries.iter().enumerate().filter(|(_, entry)| !entry.is_alias);
        let position: BTreeMap<u32, usize> = owners.map(|(k, entry)| (entry.reference, k + 1)).collect();
        let refer = |reference: u32| match self.version {
            Version::Two => position.get(&reference).copied().unwrap_or_default() as u64,
            Version::Three => u64::from(reference),
        };
        let named = |reference: u64| {
            let name = if self.version == Version::Two { "index" } else { "valueReference" };
            Attributes::default().with(name, reference)
        };
        let known = dependencies(self.model);
        let around = Around::new(self.model, self.catalogue, entries, known.as_ref());
        let outputs: Vec<(u64, Option<String>)> = entries
            .iter()
            .enumerate()
            .filter(|(_, entry)| entry.causality == Causality::Output)
            .map(|(k, entry)| {
                let own = if self.version == Version::Two { k as u64 + 1 } else { u64::from(entry.reference) };
                (own, self.of_output((known.as_ref(), &around), entry, &refer))
            })
            .collect();
        let rates = self.rates((known.as_ref(), &around), &refer);
        let states = self.variables.rates.iter().flat_map(|&(rate, state)| [state, rate]).map(&refer);
        let calculated = entries.iter().enumerate().filter(|(_, entry)| entry.causality == Causality::Calculated);
        let calculated = calculated
            .map(|(k, entry)| if self.version == Version::Two { k as u64 + 1 } else { u64::from(entry.reference) });
        let mut unknown: Vec<u64> = outputs.iter().map(|own| own.0).chain(states).chain(calculated).collect();
        // What is set is not found.
        let set = entries.iter().enumerate().filter(|(_, entry)| !entry.start.is_empty());
        let set: BTreeSet<u64> = set
            .map(|(k, entry)| if self.version == Version::Two { k as u64 + 1 } else { u64::from(entry.reference) })
            .collect();
        unknown.retain(|own| !set.contains(own));
        unknown.sort_unstable();
        unknown.dedup();
        let depending = |document: &mut Document, name: &str, unknowns: &[(u64, Option<String>)]| {
            for (reference, depends) in unknowns {
                document.empty(name, named(*reference).maybe("dependencies", depends.as_ref()));
            }
        };
        let plain = |document: &mut Document, name: &str, list: &[u64]| {
            list.iter().for_each(|&reference| document.empty(name, named(reference)));
        };
        document.element("ModelStructure", Attributes::default(), |document| match self.version {
            Version::Two => {
                if !outputs.is_empty() {
                    document.element("Outputs", Attributes::default(), |d| depending(d, "Unknown", &outputs));
                }
                if !rates.is_empty() {
                    document.element("Derivatives", Attributes::default(), |d| depending(d, "Unknown", &rates));
                }
                if !unknown.is_empty() {
                    document.element("InitialUnknowns", Attributes::default(), |d| plain(d, "Unknown", &unknown));
                }
            }
            Version::Three => {
                depending(document, "Output", &outputs);
                depending(document, "ContinuousStateDerivative", &rates);
                plain(document, "InitialUnknown", &unknown);
                let indicators: Vec<u64> = self.variables.indicators.iter().map(|&k| u64::from(k)).collect();
                plain(document, "EventIndicator", &indicators);
            }
        });
    }

    /// Each rate with the states, inputs and the time that it may depend on, if that is known.
    fn rates(
        &self,
        (known, around): (Option<&Dependencies>, &Around),
        refer: &impl Fn(u32) -> u64,
    ) -> Vec<(u64, Option<String>)> {
        let known = known.map(|known| (known.of_rates(), known.states()));
        let of = |(k, &(rate, _)): (usize, &(u32, u32))| {
            let depends = known.as_ref().map(|(of_rates, states)| {
                let mut all = BTreeSet::new();
                for state in (0..of_rates.len()).filter(|&state| self.variables.rate_entry[state] == k) {
                    all.extend(of_rates[state].iter().map(|&state| refer(self.state_reference(state))));
                    let place = hyd_payload::Place { area: Area::Rate, index: states[state] as u32 };
                    all.extend(around.reaching(place).map(refer));
                }
                ascending(all.into_iter())
            });
            (refer(rate), depends)
        };
        self.variables.rates.iter().enumerate().map(of).collect()
    }

    /// The number of a state, by its place among the states.
    fn state_reference(&self, state: usize) -> u32 {
        self.variables.rates[self.variables.rate_entry[state]].1
    }

    /// What an output depends on, if that is known: one that is a state on this alone, so that no importer takes it for a direct feedthrough of an input.
    fn of_output(
        &self,
        (known, around): (Option<&Dependencies>, &Around),
        entry: &Entry,
        refer: &impl Fn(u32) -> u64,
    ) -> Option<String> {
        let known = known?;
        let row = &self.model.row;
        let Meaning::Element(variable, first) = self.catalogue.meaning(entry.reference)? else { return None };
        let count = entry.sizes.iter().product::<u32>() as usize;
        let mut all = BTreeSet::new();
        for source in self.model.tables.variables[variable].sources.get(first..first + count)? {
            let Place::Output(output) = source.place else { continue };
            if is_elsewhere(self.model, output) {
                let place = place_of(self.model, output);
                let states = around.states_reaching(place)?;
                all.extend(states.into_iter().map(|state| refer(self.state_reference(state))));
                all.extend(around.reaching(place).map(refer));
                continue;
            }
            let found = (output - row.assigned) as usize;
            let n = row.unknowns as usize;
            if found < n
                && let Some(state) = known.state(found)
            {
                all.insert(refer(self.state_reference(state)));
                continue;
            }
            let (area, unknown) = match found.checked_sub(n) {
                Some(k) => (Area::Rate, *row.states.get(k)? as usize),
                None => (Area::Unknown, found),
            };
            all.extend(known.of_found(unknown).into_iter().map(|state| refer(self.state_reference(state))));
            all.extend(around.reaching(hyd_payload::Place { area, index: unknown as u32 }).map(refer));
        }
        Some(ascending(all.into_iter()))
    }
}

/// Numbers without repetition, as a list.
fn ascending(all: impl Iterator<Item = u64>) -> String {
    list(all.collect::<BTreeSet<u64>>().iter().map(u64::to_string))
}

/// True if the name has the form that the naming convention `structured` asks for.
fn is_structured(name: &str) -> bool {
    let inner = name.strip_prefix("der(").and_then(|rest| rest.strip_suffix(')')).unwrap_or(name);
    let mut rest = inner;
    loop {
        let Some(after) = without_word(rest) else { return false };
        rest = after;
        if let Some(indexed) = rest.strip_prefix('[') {
            let Some((inside, after)) = indexed.split_once(']') else { return false };
            let number = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
            if !inside.split(',').all(number) {
                return false;
            }
            rest = after;
        }
        match rest.strip_prefix('.') {
            Some(after) => rest = after,
            None => return rest.is_empty(),
        }
    }
}

/// What follows the word at the beginning, quoted or not.
fn without_word(text: &str) -> Option<&str> {
    if let Some(quoted) = text.strip_prefix('\'') {
        let (inside, after) = quoted.split_once('\'')?;
        return (!inside.is_empty() && inside.is_ascii() && !inside.contains(['\\', '"', '?'])).then_some(after);
    }
    let end = text.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(text.len());
    (end > 0 && !text.starts_with(|c: char| c.is_ascii_digit())).then(|| &text[end..])
}

#[cfg(test)]
mod tests {
    use super::is_structured;

    #[test]
    fn names_of_the_structured_form_are_known() {
        for name in ["x", "der(a.b[1,2].c)", "a[3].'b c'.d", "_x1"] {
            assert!(is_structured(name), "{name}");
        }
        for name in ["", "1x", "a..b", "a[]", "a[x]", "der(der(x))", "a.b c", "a[1"] {
            assert!(!is_structured(name), "{name}");
        }
    }
}
