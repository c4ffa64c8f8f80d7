//! Which inputs reach which rates and outputs, so that an importer sees no feedthrough where there is none.
//!
//! Followed through the routines of the model ([`hyd_payload::Reach`]), events included.  Where that would take too long, inputs may reach
//! everything.

use std::collections::{BTreeMap, BTreeSet};

use hyd_payload::program::{Area, Place};
use hyd_payload::{Model, Reach, Reached};

use crate::catalogue::{Catalogue, Meaning};
use crate::dependencies::Dependencies;
use crate::variables::{Causality, Entry};

/// Most places that are looked at: a second.
const MOST_WORK: u64 = 300_000_000;
/// Passes of one beginning.
const PASSES: u64 = 4;

/// What inputs and states reach.
pub(crate) struct Around {
    /// Number of the time.
    time: u32,
    /// By the number of an input; none: perhaps everything.
    inputs: Vec<(u32, Option<Reached>)>,
    /// By the order of the states, where outputs that are assigned ask for it.
    states: Option<Vec<Reached>>,
}

impl Around {
    /// Of these variables.
    pub(crate) fn new(model: &Model, catalogue: &Catalogue, entries: &[Entry], known: Option<&Dependencies>) -> Self {
        let listed = entries.iter().filter(|entry| entry.causality == Causality::Input && !entry.is_alias);
        let time = entries.iter().find(|entry| entry.causality == Causality::Independent);
        let time = time.map_or(crate::catalogue::TIME, |entry| entry.reference);
        let listed: Vec<&Entry> = listed.collect();
        let Some(known) = known else {
            return Self { time, inputs: listed.iter().map(|entry| (entry.reference, None)).collect(), states: None };
        };
        let reach = Reach::new(model, known.rows());
        let affordable = |beginnings: usize| reach.work() * PASSES * beginnings as u64 <= MOST_WORK;
        let sites = model.structure.inputs.iter().enumerate().map(|(k, site)| (&*site.name, k as u32));
        let sites: BTreeMap<&str, u32> = sites.collect();
        let follow = affordable(listed.len());
        let of_input = |entry: &&Entry| {
            let begin = places(model, catalogue, entry, &sites).filter(|_| follow);
            (entry.reference, begin.map(|begin| reach.from(begin)))
        };
        let inputs = listed.iter().map(of_input).collect();
        let is_assigned = |entry: &Entry| {
            let Some(Meaning::Element(variable, first)) = catalogue.meaning(entry.reference) else { return false };
            let source = model.tables.variables[variable].sources.get(first);
            source.is_some_and(|source| matches!(source.place, hyd_system::Place::Output(k) if is_elsewhere(model, k)))
        };
        let asked = entries.iter().any(|entry| entry.causality == Causality::Output && is_assigned(entry));
        let of_state = |&state: &usize| reach.from([Place { area: Area::Unknown, index: state as u32 }]);
        let states = (asked && affordable(known.states().len())).then(|| known.states().iter().map(of_state).collect());
        Self { time, inputs, states }
    }

    /// The numbers of inputs that may reach a place, and of the time.
    pub(crate) fn reaching(&self, place: Place) -> impl Iterator<Item = u32> {
        let reaches = move |(_, reached): &&(u32, Option<Reached>)| reached.as_ref().is_none_or(|own| own.holds(place));
        self.inputs.iter().filter(reaches).map(|(reference, _)| *reference).chain([self.time])
    }

    /// The states that reach a place, by their order; none where that is not known.
    pub(crate) fn states_reaching(&self, place: Place) -> Option<BTreeSet<usize>> {
        let reached = self.states.as_ref()?;
        Some(reached.iter().enumerate().filter(|(_, own)| own.holds(place)).map(|(k, _)| k).collect())
    }
}

/// Where the elements of an input stand; none for what the tables do not know.
fn places(model: &Model, catalogue: &Catalogue, entry: &Entry, sites: &BTreeMap<&str, u32>) -> Option<Vec<Place>> {
    let Meaning::Element(variable, first) = catalogue.meaning(entry.reference)? else { return None };
    let info = &model.tables.variables[variable];
    let count = entry.sizes.iter().product::<u32>() as usize;
    let mut found = Vec::new();
    for element in first..first + count {
        let site = sites.get(info.name.element(element).as_str())?;
        let (values, rates) = (&model.area.inputs, &model.area.input_rates);
        found.push(Place::data(values.start + site));
        if rates.start + site < rates.end {
            found.push(Place::data(rates.start + site));
        }
    }
    Some(found)
}

/// True for a result that is neither an unknown nor a rate.
pub(crate) fn is_elsewhere(model: &Model, output: u32) -> bool {
    let row = &model.row;
    output < row.assigned || output as usize >= row.len() - row.discrete as usize
}

/// Where a result that is neither an unknown nor a rate stands.
pub(crate) fn place_of(model: &Model, output: u32) -> Place {
    let row = &model.row;
    let first = row.len() as u32 - row.discrete;
    match output.checked_sub(first) {
        Some(k) => Place::data(model.area.discrete.start + k),
        None => Place { area: Area::Work, index: output },
    }
}
