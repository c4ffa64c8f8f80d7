//! Components that together prescribe a potential or a flow twice: ideal sources side by side, or flows of sources in a row.
//!
//! Two voltage sources in parallel leave one equation too many for the potentials and one too few for the currents; by numbers all
//! agrees.  The smallest over-determined set says which components it is, the under-determined rest that what is missing
//! is the other kind.  Where nothing but potentials or nothing but flows of connectors are at stake, the components are
//! named instead of the equations.

use std::collections::BTreeMap;

use hyd_flat::{BlockId, Potential, VarId};
use hyd_index::TypedIndex;
use hyd_source::{Code, Diagnostic};
use hyd_structure::{Matching, smallest_overdetermined, smallest_underdetermined};
use rustc_hash::FxHashSet;

use crate::explain::faults::{list_names, variable_of};
use crate::incidence::{Pattern, Unknowns};
use crate::system::{EquationSystem, Resolution};

/// Most components that are marked.
const MOST_MARKED: usize = 8;

/// The message for a singular system in which potentials are prescribed twice and flows not at all, or the other way round.
pub(crate) fn prescribed_twice(
    system: &EquationSystem,
    pattern: &Pattern,
    unknowns: &Unknowns,
    matching: &Matching,
) -> Option<Diagnostic> {
    // A component lacks what is connected to it.
    if !system.flat.open_ends.is_empty() {
        return None;
    }
    let over = smallest_overdetermined(&pattern.incidence, matching)?;
    let under = smallest_underdetermined(&pattern.incidence, matching)?;
    let blocks = |columns: &[hyd_structure::Column]| -> FxHashSet<BlockId> {
        let variables = columns.iter().filter_map(|&column| variable_of(unknowns.targets[column]));
        variables.map(|v: VarId| system.flat.locate(v).0).collect()
    };
    let (many, few) = (blocks(&over.columns), blocks(&under.columns));
    if over.columns.is_empty() {
        return without_difference(system, &few);
    }
    let has_potential = |set: &FxHashSet<BlockId>| system.flat.potentials.iter().any(|own| set.contains(&own.block));
    let has_flow = |set: &FxHashSet<BlockId>| system.flat.flows.iter().any(|own| set.contains(own));
    let of_potentials = has_potential(&many) && !has_flow(&many) && has_flow(&few) && !has_potential(&few);
    let of_flows = has_flow(&many) && !has_potential(&many) && has_potential(&few) && !has_flow(&few);
    if !of_potentials && !of_flows {
        return None;
    }
    let mut components: Vec<String> = Vec::new();
    for row in &over.rows {
        let block = &system.flat.equations[system.equations[pattern.rows[row.index()]].block as usize];
        let name = block.origin.path.to_string();
        if !system.flat.is_connection(block) && !name.is_empty() && !components.contains(&name) {
            components.push(name);
        }
    }
    if components.len() < 2 {
        return None;
    }
    let names = list_names(components.iter().cloned());
    // Of connectors with several potentials, such as an orientation beside a position, one with a unit tells the domain.
    let of_components = |own: &&Potential| components.contains(&component_of(system, own));
    let at_stake = system.flat.potentials.iter().filter(of_components);
    let mut units = at_stake.filter_map(|own| system.flat.variables[own.block].unit.as_deref());
    let words = words(units.find(|unit| !unit.is_empty()).unwrap_or_default());
    let (message, help) = match of_potentials {
        true => (
            format!(
                "{names} together prescribe a {} twice, and nothing determines their {}s",
                words.potential, words.flow
            ),
            format!(
                "put a component between two of them that lets the {}s differ, such as {}",
                words.potential, words.between
            ),
        ),
        false => (
            format!(
                "{names} together prescribe a {} twice, and nothing determines their {}s",
                words.flow, words.potential
            ),
            format!("connect a component that takes up the difference of the {}s, such as {}", words.flow, words.store),
        ),
    };
    Some(marked(Diagnostic::error(Code::Singular, message), system, &components).help(help))
}

/// What engineers call potentials and flows of a domain, and what stands between them.
struct Words {
    potential: &'static str,
    flow: &'static str,
    between: &'static str,
    store: &'static str,
}

/// The words for potentials of a unit.
fn words(unit: &str) -> Words {
    let (potential, flow, between, store) = match unit {
        "V" => ("voltage", "current", "a resistance", "a resistance or a capacitor"),
        "m" | "m/s" => (
            "motion",
            "force",
            "a spring; in a loop of rigid joints, one of them with more freedom",
            "a mass, or a spring to what is fixed",
        ),
        "rad" | "rad/s" => (
            "motion",
            "torque",
            "an elastic shaft; in a loop of rigid joints, one of them with more freedom",
            "an inertia, or a spring to what is fixed",
        ),
        "K" | "degC" => (
            "temperature",
            "heat flow",
            "a thermal resistance",
            "a heat capacity, or replace one of them by a fixed temperature",
        ),
        "Pa" | "bar" => (
            "pressure",
            "flow",
            "an orifice or a pipe",
            "a vessel, or replace one of them by a boundary that fixes the pressure",
        ),
        _ => ("potential", "flow", "a resistance", "a resistance or a store"),
    };
    Words { potential, flow, between, store }
}

/// The same where several components connect nodes between which there is no difference of potentials, such as two ideal sensors side by side: what
/// the second one says is known, and contains no unknown.
fn without_difference(system: &EquationSystem, few: &FxHashSet<BlockId>) -> Option<Diagnostic> {
    // Both ends of a component at one potential, and its flow open.
    let mut ends: BTreeMap<String, Vec<Option<VarId>>> = BTreeMap::new();
    for potential in &system.flat.potentials {
        let v = system.flat.variables[potential.block].first;
        let kept = match system.resolution[v] {
            Resolution::Own => Some(v),
            Resolution::Alias { of, negated: false } => Some(of),
            _ => None,
        };
        ends.entry(component_of(system, potential)).or_default().push(kept);
    }
    let is_open = |name: &str| {
        few.iter().any(|&block| {
            let own = system.flat.variables[block].name.element(0);
            own.strip_prefix(name).is_some_and(|rest| rest.starts_with('.'))
        })
    };
    let mut by_node: BTreeMap<VarId, Vec<String>> = BTreeMap::new();
    for (name, ends) in ends {
        if let [Some(one), Some(other)] = ends[..]
            && one == other
            && is_open(&name)
        {
            by_node.entry(one).or_default().push(name);
        }
    }
    let components = by_node.into_values().find(|all| all.len() > 1)?;
    let names = list_names(components.iter().cloned());
    let message = format!(
        "{names} are connected in parallel, or in a ring, without a difference of potential, and nothing determines how the flow divides \
         between them"
    );
    let help = "connect them in series, or give one of them a resistance";
    Some(marked(Diagnostic::error(Code::Singular, message), system, &components).help(help))
}

/// The component of a potential, by name.
fn component_of(system: &EquationSystem, potential: &Potential) -> String {
    let name = system.flat.variables[potential.block].name.element(0);
    let parts: Vec<&str> = name.split('.').collect();
    parts[..parts.len().saturating_sub(potential.depth as usize)].join(".")
}

/// Marks where components are declared.
fn marked(mut diagnostic: Diagnostic, system: &EquationSystem, components: &[String]) -> Diagnostic {
    for potential in &system.flat.potentials {
        let is_new = diagnostic.labels.iter().all(|label| label.span != potential.declared);
        if is_new && components.contains(&component_of(system, potential)) && diagnostic.labels.len() < MOST_MARKED {
            diagnostic = diagnostic.at(potential.declared, "");
        }
    }
    diagnostic
}
