//! The variables of a unit: name, number, type, causality, variability, start value.
//!
//! Parameters that can be set are parameters; what follows from them is a calculated parameter; what was fixed at translation is a
//! constant with its value.  A variable that equals another one is an alias of it: in 2.0 it has the same number, in 3.0 it stands
//! inside the other.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use hyd_payload::Model;
use hyd_system::{Place, Settable, Source, ValueKind, Variability, VariableInfo};

use crate::catalogue::{Catalogue, Starts, StateVariables, TIME};
use crate::facts::{Bounds, DeclaredType, End, Facts, Version};

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Causality {
    Independent,
    Parameter,
    Calculated,
    Input,
    Output,
    Local,
}

impl Causality {
    pub(crate) fn text(self) -> &'static str {
        match self {
            Causality::Independent => "independent",
            Causality::Parameter => "parameter",
            Causality::Calculated => "calculatedParameter",
            Causality::Input => "input",
            Causality::Output => "output",
            Causality::Local => "local",
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Changes {
    Never,
    Fixed,
    Discrete,
    Continuous,
}

impl Changes {
    pub(crate) fn text(self) -> &'static str {
        match self {
            Changes::Never => "constant",
            Changes::Fixed => "fixed",
            Changes::Discrete => "discrete",
            Changes::Continuous => "continuous",
        }
    }
}

/// A variable of the unit.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub(crate) name: String,
    pub(crate) reference: u32,
    pub(crate) kind: ValueKind,
    pub(crate) declared: DeclaredType,
    pub(crate) causality: Causality,
    pub(crate) changes: Changes,
    /// Values at the start; empty if they are calculated.
    pub(crate) start: Vec<f64>,
    /// Sizes of an array.
    pub(crate) sizes: Vec<u32>,
    pub(crate) unit: String,
    pub(crate) display_unit: String,
    pub(crate) description: String,
    pub(crate) bounds: Bounds,
    /// The number of the state that it is the rate of.
    pub(crate) rate_of: Option<u32>,
    /// An event may give the state another value.
    pub(crate) reinit: bool,
    /// It has the number of another one.
    pub(crate) is_alias: bool,
    /// Other names of the same, with their descriptions.
    pub(crate) aliases: Vec<(String, String)>,
}

impl Entry {
    fn plain(name: String, reference: u32, description: String) -> Self {
        Self {
            name,
            reference,
            kind: ValueKind::Real,
            declared: DeclaredType::default(),
            causality: Causality::Local,
            changes: Changes::Continuous,
            start: Vec::new(),
            sizes: Vec::new(),
            unit: String::new(),
            display_unit: String::new(),
            description,
            bounds: Bounds::default(),
            rate_of: None,
            reinit: false,
            is_alias: false,
            aliases: Vec::new(),
        }
    }
}

/// All variables, and the numbers of states' rates in the order of the states.
pub(crate) struct Variables {
    pub(crate) entries: Vec<Entry>,
    /// Numbers of the rates and of their states, as they stand in the description; an array counts once.
    pub(crate) rates: Vec<(u32, u32)>,
    /// For each state the position in `rates` that it belongs to.
    pub(crate) rate_entry: Vec<usize>,
    pub(crate) indicators: Vec<u32>,
}

impl Variables {
    /// None where the rate of a state has no name.
    pub(crate) fn new(model: &Model, facts: &Facts, catalogue: &Catalogue, version: Version) -> Option<Self> {
        let mut entries = vec![Entry {
            unit: "s".into(),
            causality: Causality::Independent,
            ..Entry::plain("time".into(), TIME, "Time".into())
        }];
        let tables = &model.tables;
        let starts = Starts::new(model);
        let hidden: BTreeSet<usize> = starts.parameter_of.values().copied().collect();
        for (k, info) in tables.variables.iter().enumerate().filter(|(k, _)| !hidden.contains(k)) {
            if version == Version::Three && catalogue.is_array(k) {
                entries.push(array(facts, (k, info), catalogue.element(k, 0)));
            } else {
                let one = |element: usize| scalar(facts, (k, info, element), catalogue.element(k, element));
                entries.extend((0..info.sources.len()).map(one));
            }
        }
        let whole = |variable: usize, element: usize| match version {
            Version::Three if catalogue.is_array(variable) => catalogue.element(variable, 0),
            _ => catalogue.element(variable, element),
        };
        let of_reference: BTreeMap<u32, usize> =
            entries.iter().enumerate().map(|(k, entry)| (entry.reference, k)).collect();
        for (&variable, &parameter) in &starts.parameter_of {
            for (element, source) in tables.variables[parameter].sources.iter().enumerate() {
                let owner = of_reference.get(&whole(variable, element)).map(|&k| &mut entries[k]);
                if let (Some(entry), Some(value)) = (owner, value_of(facts, source)) {
                    entry.start.push(value);
                }
            }
        }
        let (mut rates, mut rate_entry) = (Vec::new(), Vec::new());
        match catalogue.varying_states() {
            Some(count) => {
                for k in 0..count {
                    let (state, rate) = catalogue.state(k);
                    let n = k + 1;
                    let text = "State number N, chosen during the run among the candidates of the model";
                    entries.push(Entry::plain(format!("hyd.state[{n}]"), state, text.replace('N', &n.to_string())));
                    let entry = Entry::plain(format!("der(hyd.state[{n}])"), rate, "Its rate".into());
                    entries.push(Entry { rate_of: Some(state), ..entry });
                    rates.push((rate, state));
                    rate_entry.push(k);
                }
            }
            None => {
                for (k, &((variable, element), rate)) in StateVariables::new(model)?.pairs.iter().enumerate() {
                    let state = whole(variable, element);
                    let rate = match rate {
                        Some((variable, element)) => whole(variable, element),
                        None => {
                            let rate = catalogue.nameless_rate(k)?;
                            let name = tables.variables[variable].name.element(element);
                            entries.push(nameless_rate(&entries, &name, k, rate));
                            rate
                        }
                    };
                    let pair = (rate, state);
                    if rates.last() != Some(&pair) {
                        rates.push(pair);
                    }
                    rate_entry.push(rates.len() - 1);
                }
            }
        }
        let position: BTreeMap<u32, usize> =
            entries.iter().enumerate().map(|(k, entry)| (entry.reference, k)).collect();
        for &(rate, state) in &rates {
            entries[position[&rate]].rate_of = Some(state);
        }
        let reinits = &model.routines.events.reinit_unknowns;
        for &unknown in reinits {
            if let Some(&(variable, element)) = tables.unknowns.get(unknown as usize) {
                let reference = whole(variable as usize, element as usize);
                if rates.iter().any(|&(_, state)| state == reference) {
                    entries[position[&reference]].reinit = true;
                }
            }
        }
        let indicators: Vec<u32> = (0..model.structure.roots).map(|k| catalogue.indicator(k)).collect();
        for (k, &reference) in indicators.iter().enumerate().filter(|_| version == Version::Three) {
            let text =
                tables.roots.get(k).map_or_else(String::new, |root| format!("Changes its sign with {}", root.text));
            entries.push(Entry::plain(format!("hyd.indicator[{}]", k + 1), reference, text));
        }
        merge_aliases(model, &mut entries, &rates, (catalogue, version));
        name_once(&mut entries);
        Some(Self { entries, rates, rate_entry, indicators })
    }
}

/// The rate of a state, number `k` of all, that no variable of the model shows.
fn nameless_rate(entries: &[Entry], state: &str, k: usize, reference: u32) -> Entry {
    let plain = format!("der({state})");
    let taken = entries.iter().any(|entry| entry.name == plain);
    let name = if taken { format!("hyd.rate[{}]", k + 1) } else { plain };
    Entry::plain(name, reference, format!("Rate of {state}"))
}

/// Local scalars that equal another one become its aliases; in 3.0 that is another local one.
fn merge_aliases(
    model: &Model,
    entries: &mut Vec<Entry>,
    rates: &[(u32, u32)],
    (catalogue, version): (&Catalogue, Version),
) {
    // Same place, same sign.
    let mut owners: BTreeMap<(u32, bool), u32> = BTreeMap::new();
    let source = |reference: u32| match catalogue.meaning(reference) {
        Some(crate::Meaning::Element(variable, element)) => {
            let Source { place, negated } = model.tables.variables[variable].sources[element];
            if let Place::Output(k) = place { Some((k, negated)) } else { None }
        }
        _ => None,
    };
    let own: BTreeSet<u32> = rates.iter().flat_map(|&(rate, state)| [rate, state]).collect();
    let stays = |entry: &Entry| {
        own.contains(&entry.reference) || entry.causality != Causality::Local || !entry.start.is_empty()
    };
    // A further name of an output counts as an output of its own for some importers of 3.0, which then miss it in the structure of the model.
    let owns = |entry: &Entry| stays(entry) && (version == Version::Two || entry.causality == Causality::Local);
    for entry in entries.iter().filter(|entry| entry.sizes.is_empty() && owns(entry)) {
        if let Some(place) = source(entry.reference) {
            owners.entry(place).or_insert(entry.reference);
        }
    }
    let mut aliases: BTreeMap<u32, Vec<(String, String)>> = BTreeMap::new();
    let mut kinds: BTreeMap<u32, (ValueKind, Changes, String)> = BTreeMap::new();
    let facts = |entry: &Entry| (entry.kind.clone(), entry.changes, entry.unit.clone());
    kinds.extend(entries.iter().map(|entry| (entry.reference, facts(entry))));
    entries.retain_mut(|entry| {
        if !entry.sizes.is_empty() || stays(entry) {
            return true;
        }
        let Some(place) = source(entry.reference) else { return true };
        let owner = *owners.entry(place).or_insert(entry.reference);
        if owner == entry.reference || kinds[&owner] != facts(entry) {
            return true;
        }
        match version {
            Version::Two => (entry.reference, entry.is_alias) = (owner, true),
            Version::Three => {
                let alias = (std::mem::take(&mut entry.name), std::mem::take(&mut entry.description));
                aliases.entry(owner).or_default().push(alias);
                return false;
            }
        }
        true
    });
    for entry in entries {
        if let Some(others) = aliases.remove(&entry.reference) {
            entry.aliases = others;
        }
    }
}

/// Derivatives that the text takes more than once stand in the tables more than once, with one name and one meaning: they are listed once.
fn name_once(entries: &mut Vec<Entry>) {
    let mut seen: BTreeSet<String> = BTreeSet::new();
    entries.retain(|entry| entry.is_alias || seen.insert(entry.name.clone()));
    entries.retain(|entry| !entry.is_alias || seen.insert(entry.name.clone()));
    for entry in entries {
        entry.aliases.retain(|(name, _)| seen.insert(name.clone()));
    }
}

fn scalar(facts: &Facts, (k, info, element): (usize, &VariableInfo, usize), reference: u32) -> Entry {
    let sources = std::slice::from_ref(&info.sources[element]);
    let bounds = facts.bounds.get(&(k, element)).copied().unwrap_or_default();
    entry(facts, (k, info, info.name.element(element)), sources, (reference, bounds))
}

fn array(facts: &Facts, (k, info): (usize, &VariableInfo), reference: u32) -> Entry {
    let (text, sizes) = &info.name.parts[0];
    let name = if info.name.derivative { format!("der({text})") } else { text.to_string() };
    let one = |element: usize| facts.bounds.get(&(k, element)).copied().unwrap_or_default();
    let first = one(0);
    let all = (1..info.sources.len()).map(one);
    // An attribute that not all elements share is left out.
    let bounds = all.fold(first, |kept, next| Bounds {
        min: kept.min.filter(|_| kept.min == next.min),
        max: kept.max.filter(|_| kept.max == next.max),
        nominal: kept.nominal.filter(|_| kept.nominal == next.nominal),
        start: kept.start,
    });
    let mut entry = entry(facts, (k, info, name), &info.sources, (reference, bounds));
    if entry.causality == Causality::Input {
        let start = |element: usize| one(element).start.unwrap_or_else(|| neutral(&info.kind));
        entry.start = (0..info.sources.len()).map(start).collect();
    }
    Entry { sizes: sizes.clone(), ..entry }
}

/// A value that does not change during a run.
fn value_of(facts: &Facts, source: &Source) -> Option<f64> {
    let value = match source.place {
        Place::Constant(value) => value,
        Place::Parameter(k) => *facts.parameters.get(k as usize)?,
        Place::Output(_) => return None,
    };
    let value = if source.negated { -value } else { value };
    value.is_finite().then_some(value)
}

/// The value of an input without a start value.
fn neutral(kind: &ValueKind) -> f64 {
    if matches!(kind, ValueKind::Enumeration(_)) { 1.0 } else { 0.0 }
}

fn entry(
    facts: &Facts,
    (k, info, name): (usize, &VariableInfo, String),
    sources: &[Source],
    (reference, bounds): (u32, Bounds),
) -> Entry {
    let values: Option<Vec<f64>> = sources.iter().map(|source| value_of(facts, source)).collect();
    let constant = info.variability == Variability::Constant || info.settable == Settable::Structural;
    let parameters = sources.iter().all(|source| matches!(source.place, Place::Parameter(_)));
    let moving = match (&info.kind, info.variability) {
        (ValueKind::Real, Variability::Continuous) => Changes::Continuous,
        _ => Changes::Discrete,
    };
    let settable = info.settable == Settable::Yes && parameters;
    let (causality, changes, start) = match (facts.ends.get(&k), info.variability, values) {
        (Some(End::Input), Variability::Discrete | Variability::Continuous, _) => {
            (Causality::Input, moving, vec![bounds.start.unwrap_or_else(|| neutral(&info.kind)); sources.len()])
        }
        (_, Variability::Constant | Variability::Parameter, Some(values)) if constant => {
            (Causality::Local, Changes::Never, values)
        }
        (_, Variability::Parameter, Some(values)) if settable => (Causality::Parameter, Changes::Fixed, values),
        (Some(End::Output), Variability::Discrete | Variability::Continuous, _) => {
            (Causality::Output, moving, Vec::new())
        }
        (_, Variability::Constant | Variability::Parameter, _) => {
            (if info.protected { Causality::Local } else { Causality::Calculated }, Changes::Fixed, Vec::new())
        }
        (_, Variability::Discrete | Variability::Continuous, _) => (Causality::Local, moving, Vec::new()),
    };
    let real = info.kind == ValueKind::Real;
    let text = |text: &Arc<str>| if real { text.to_string() } else { String::new() };
    Entry {
        kind: info.kind.clone(),
        declared: facts.types.get(&k).cloned().unwrap_or_default(),
        causality,
        changes,
        start,
        unit: text(&info.unit),
        display_unit: text(&info.display_unit),
        bounds,
        ..Entry::plain(name, reference, info.description.to_string())
    }
}
