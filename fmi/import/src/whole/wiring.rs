//! Which variable of a text is which variable of a unit, and where both stand in the system of the two.

use std::collections::BTreeSet;
use std::sync::Arc;

use hyd_system::{
    DaeSystem, InitialStructure, InputSite, Instants, LearnedSize, NamePattern, Pattern, Place, RootInfo, Settable,
    Source, Structure, Tables, ValueKind, Variability, VariableInfo,
};

use super::jacobian::Positions;
use super::{Part, Sizes, Whole};
use crate::archive::Unit;
use crate::exchange::Exchange;
use crate::fault::Fault;
use crate::host::Host;
use crate::layout::Watched;

/// A unit in a model: names in the text with those in the unit.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Wiring {
    /// Instance path of the block that is the unit; `""` for the model itself.
    pub path: String,
    /// What the text gives the unit.
    pub inputs: Vec<(String, String)>,
    /// What the text reads of the unit.
    pub outputs: Vec<(String, String)>,
    /// Values that the text has for parameters of the unit, and for states at their start.
    pub parameters: Vec<(String, String)>,
    /// Those of the text's names of parameters that nobody has set: their values stand in the declarations of the block.
    pub declared: BTreeSet<String>,
}

pub(super) fn join(text: Box<dyn DaeSystem>, units: &[(Unit, Wiring)], host: &Host) -> Result<Whole, Fault> {
    let own = text.structure();
    let (n, sites) = (own.unknowns, own.inputs.clone());
    let mut parts = Vec::with_capacity(units.len());
    let mut at = n;
    for (unit, wiring) in units {
        let part = part(&*text, &sites, (unit, wiring), host, at)?;
        at = part.x.end;
        parts.push(part);
    }
    let first = at;
    for part in &mut parts {
        (part.y, at) = (at..at + part.reads.len(), at + part.reads.len());
    }
    for part in &mut parts {
        (part.w, at) = (at..at + part.gives.len(), at + part.gives.len());
    }
    let own = text.structure();
    let indicators = parts.iter().map(|part| part.unit.structure().roots).sum();
    let sizes =
        Sizes { unknowns: n, initial: own.initial.unknowns, row: own.outputs, indicators, first, coupled: at - first };
    let taken: Vec<usize> = parts.iter().flat_map(|part| part.reads.iter().map(|&(input, _)| input)).collect();
    let open: Vec<usize> = (0..sites.len()).filter(|input| !taken.contains(input)).collect();
    let (positions, state_pattern, rate_pattern, initial) = Positions::new(own, &parts, sizes);
    let mut differential = own.differential.clone();
    differential.extend((n..at).map(|k| k < first));
    let structure = Structure {
        unknowns: at,
        differential,
        sizes: learned_sizes(own, &parts),
        state_pattern,
        rate_pattern,
        roots: indicators + own.roots,
        outputs: own.outputs + (first - n),
        initial: InitialStructure { unknowns: sizes.initial + sizes.coupled, pattern: initial },
        delays: own.delays.clone(),
        inputs: open.iter().map(|&input| sites[input].clone()).collect(),
    };
    let reads = parts.iter().flat_map(|part| {
        let own = part.reads.iter().zip(part.y.clone()).zip(part.nominals.0.clone());
        own.map(|((&(input, _), at), size)| (input, at, size)).collect::<Vec<_>>()
    });
    let reads = reads.collect();
    let tables = Arc::new(tables(text.tables(), &parts, units, sizes));
    let (states, rates) = (own.state_pattern.entries(), own.rate_pattern.entries());
    Ok(Whole {
        sizes,
        structure,
        tables,
        positions,
        set: BTreeSet::new(),
        open,
        instants: Instants::default(),
        started: vec![0.0; at],
        reads,
        text_nominals: vec![1.0; n],
        row: vec![0.0; sizes.row],
        other_row: vec![0.0; sizes.row],
        residual: vec![0.0; n.max(sizes.initial)],
        other_residual: vec![0.0; n.max(sizes.initial)],
        z: vec![0.0; n.max(sizes.initial)],
        zp: vec![0.0; n],
        state_values: vec![0.0; states.max(own.initial.pattern.entries())],
        rate_values: vec![0.0; rates],
        carried: None,
        text,
        parts,
    })
}

/// One unit, whose states begin at `first` among the unknowns.
fn part(
    text: &dyn DaeSystem,
    sites: &[InputSite],
    (unit, wiring): (&Unit, &Wiring),
    host: &Host,
    first: usize,
) -> Result<Part, Fault> {
    let description = &unit.description;
    let lacks = |name: &str, what: &str| {
        Fault::of(&unit.file, format!("`{}` names `{name}`, which is no {what} of the unit", shown(&wiring.path)))
    };
    let lost = |name: &str| Fault::of(&unit.file, format!("the model has lost `{name}`"));
    let names: Vec<String> = wiring.outputs.iter().map(|(_, own)| own.clone()).collect();
    let watched = Watched::new(description, &names).map_err(|name| lacks(&name, "variable with numbers"))?;
    let inputs: Vec<String> = wiring.inputs.iter().map(|(_, own)| own.clone()).collect();
    let mut exchange = Exchange::part(unit, host, &inputs, &watched)?;
    let mut reads = Vec::with_capacity(names.len());
    for ((name, _), &place) in wiring.outputs.iter().zip(&watched.places) {
        let site = sites.iter().position(|site| *site.name == **name).ok_or_else(|| lost(name))?;
        if sites[site].differentiated {
            let sentence = format!("the equations need the derivative of `{name}`, which the unit does not give");
            return Err(Fault::of(&unit.file, sentence));
        }
        reads.push((site, place));
    }
    let source = |name: &String| {
        let found = text.tables().find(name).and_then(|(variable, element)| variable.sources.get(element).copied());
        found.ok_or_else(|| lost(name))
    };
    let nominal = |name: &str| {
        let bare = name.split('[').next().unwrap_or(name);
        let found = description.variables.iter().find(|own| *own.name == *name || *own.name == *bare);
        found.map_or((1.0, 0.0), |own| (own.nominal.unwrap_or(1.0), own.start.first().copied().unwrap_or(0.0)))
    };
    let (unit_sites, continuous) = exchange.input_sites();
    let mut gives = Vec::with_capacity(inputs.len());
    for (name, own) in &wiring.inputs {
        let site = unit_sites.iter().position(|site| *site.name == **own).ok_or_else(|| lacks(own, "input"))?;
        gives.push((source(name)?, site, (site < continuous).then_some(site)));
    }
    if let Some(missing) = unit_sites.iter().find(|site| !inputs.iter().any(|own| **own == *site.name)) {
        let sentence = format!("`{}` gives the input `{}` no value", shown(&wiring.path), missing.name);
        return Err(Fault::of(&unit.file, sentence));
    }
    let (mut parameters, mut starts) = (Vec::with_capacity(wiring.parameters.len()), Vec::new());
    for (name, own) in &wiring.parameters {
        let place = exchange.tables().find(own).and_then(|(variable, element)| {
            let is_settable = variable.settable == Settable::Yes;
            variable.sources.get(element).filter(|_| is_settable).map(|source| source.place)
        });
        if let Some(Place::Parameter(index)) = place {
            parameters.push((source(name)?, index as usize, wiring.declared.contains(name)));
        } else {
            let start = exchange.start_of(own).ok_or_else(|| lacks(own, "parameter that can be set"))?;
            starts.push((source(name)?, start));
        }
    }
    let states = exchange.structure().unknowns;
    let entries = exchange.whole().1.len();
    Ok(Part {
        x: first..first + states,
        y: 0..0,
        w: 0..0,
        reads,
        gives,
        parameters,
        starts,
        defaults: inputs.iter().map(|own| nominal(own).1).collect(),
        nominals: (watched.nominals.clone(), inputs.iter().map(|own| nominal(own).0).collect()),
        settled: vec![f64::NAN; inputs.len()],
        rates: vec![0.0; states],
        watched: vec![0.0; crate::protocol::values_of(&watched.groups)],
        entries: vec![0.0; entries],
        passed: None,
        unit: exchange,
    })
}

/// The path of a unit in a message.
fn shown(path: &str) -> &str {
    if path.is_empty() { "the model" } else { path }
}

/// Tables of the text, with the states of the units behind what it has.
fn tables(text: &Tables, parts: &[Part], units: &[(Unit, Wiring)], sizes: Sizes) -> Tables {
    let mut tables = text.clone();
    let mut at = sizes.row as u32;
    for (part, (unit, wiring)) in parts.iter().zip(units) {
        let own = part.unit.tables();
        for k in 0..part.x.len() {
            let (variable, element) = own.unknowns[k];
            let info = &own.variables[variable as usize];
            let name = info.name.element(element as usize);
            let name = if wiring.path.is_empty() { name } else { format!("{}.{name}", wiring.path) };
            let known = position(text, &name);
            let state = known.unwrap_or((tables.variables.len() as u32, 0));
            if known.is_none() {
                tables.variables.push(VariableInfo {
                    name: NamePattern::scalar(name),
                    kind: ValueKind::Real,
                    variability: Variability::Continuous,
                    settable: Settable::No,
                    sources: vec![Source { place: Place::Output(at), negated: false }],
                    ..info.clone()
                });
            }
            tables.unknowns.push(state);
            at += 1;
        }
        let file: Arc<str> = unit.file.as_str().into();
        let root = |k: usize| RootInfo {
            text: format!("event indicator {} of the unit", k + 1).into(),
            file: file.clone(),
            line: 1,
        };
        let before = tables.roots.len() - text.roots.len();
        let own: Vec<RootInfo> = (0..part.unit.structure().roots).map(root).collect();
        tables.roots.splice(before..before, own);
    }
    let named = |pairs: &[(String, String)]| pairs.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    let read = units.iter().flat_map(|(_, wiring)| named(&wiring.outputs));
    let given = units.iter().flat_map(|(_, wiring)| named(&wiring.inputs));
    for name in read.chain(given) {
        tables.initial_unknowns.push(name.as_str().into());
        tables.unknowns.push(position(text, &name).unwrap_or_default());
    }
    tables
}

/// Where a variable stands in tables.
fn position(tables: &Tables, name: &str) -> Option<(u32, u32)> {
    let (found, element) = tables.find(name)?;
    let at = tables.variables.iter().position(|variable| std::ptr::eq(variable, found))?;
    Some((at as u32, element as u32))
}

/// A pattern that is made of pairs row, column.
pub(super) fn pattern(rows: usize, pairs: &[(u32, u32)]) -> Pattern {
    Pattern::from_pairs(rows, rows, pairs)
}

/// States of the text and of the units that have no nominal values, no group of one among those of another.
fn learned_sizes(own: &Structure, parts: &[Part]) -> Vec<LearnedSize> {
    let mut sizes = own.sizes.clone();
    for part in parts {
        let next = sizes.iter().map(|size| size.group + 1).max().unwrap_or(0);
        let first = part.x.start as u32;
        let theirs = &part.unit.structure().sizes;
        sizes.extend(theirs.iter().map(|size| LearnedSize { unknown: first + size.unknown, group: next + size.group }));
    }
    sizes
}
