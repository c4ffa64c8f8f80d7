//! `hyd build FILE --fmu 3.0 -o UNIT.fmu`: the model as a unit for other tools.
//!
//! What the payload does not say is gathered from the flat model here: which variables are inputs and outputs, bounds, what unit strings
//! mean.  The rest is done by `hyd_fmi`.

use std::collections::BTreeMap;
use std::sync::Arc;

use hyd_compiler::FlatModel;
use hyd_flat::{BlockId, EVERY_INPUT, Section, Target, TextBlock, VariableBlock};
use hyd_fmi::{
    Bounds, DeclaredType, End, Facts, KnownUnit, Parts, Terminal, Text, Version, describe, identifier, pack, token,
};
use hyd_payload::{Backend, Loaded, Model, executable, format};
use hyd_results::write_whole;
use hyd_symbolic::Node;
use hyd_system::{DaeSystem, Settable, ValueKind};

use crate::arguments::{Build, FmiVersion};
use crate::build::{Prebuilt, not_written, translated};
use crate::{Failure, output};

/// Parameters that a note names.
const MOST_FIXED: usize = 5;

const LIBRARY: Prebuilt = Prebuilt {
    file: if cfg!(windows) {
        "hyd_unit.dll"
    } else if cfg!(target_vendor = "apple") {
        "libhyd_unit.dylib"
    } else {
        "libhyd_unit.so"
    },
    variable: "HYD_UNIT",
    name: "library of units",
    is_it: executable::is_library,
};

/// The library that units carry a copy of, where it is at hand.
pub(crate) fn own_library() -> Option<std::path::PathBuf> {
    LIBRARY.place().ok()
}

/// Makes the unit.
pub(crate) fn build(arguments: &Build, version: FmiVersion) -> Result<(), Failure> {
    let library = LIBRARY.read(&arguments.output)?;
    let (compilation, payload) = translated(arguments, &[EVERY_INPUT.to_string()])?;
    if let Some(site) = payload.structure.inputs.iter().find(|site| site.differentiated) {
        return Err(Failure::Fault(format!(
            "the equations need the derivative of the input `{}`, which no other tool hands over; make the derivative an input of its own",
            site.name
        )));
    }
    let version = match version {
        FmiVersion::Two => Version::Two,
        FmiVersion::Three => Version::Three,
    };
    let flat = compilation.flat.as_deref();
    let flat = flat.ok_or_else(|| Failure::Fault("the translation gave no flat model".to_string()))?;
    let facts = facts(flat, &payload)?;
    let inputs: Vec<f64> = payload.structure.inputs.iter().map(|site| start_of(&facts, &payload, &site.name)).collect();
    let bytes = format::write(&payload);
    let known_by = token(&bytes);
    let descriptions = describe(&payload, &facts, version, &known_by);
    let descriptions = descriptions.ok_or_else(|| Failure::Fault("a state of the model has no name".to_string()))?;
    let name = &payload.tables.model;
    let parts = Parts {
        description: &descriptions.model,
        terminals: descriptions.terminals.as_deref(),
        library: &library,
        payload: &bytes,
        inputs: &inputs,
        texts: &facts.texts,
    };
    let path = &arguments.output;
    let archive = pack(version, name, parts).map_err(|error| not_written(path, &error))?;
    write_whole(path, &archive).map_err(|error| not_written(path, &error))?;
    let exchange = payload.structure.delays.is_empty();
    if !exchange {
        let note = "the model has delays, so the unit is for co-simulation only: it has no finite state that others could integrate";
        output::sentence("note", note, arguments.model.message_format);
    }
    let (later, unknown) = texts_left_out(flat);
    for note in [fixed_parameters(&payload), fixed_texts(flat), later, unknown].into_iter().flatten() {
        output::sentence("note", &note, arguments.model.message_format);
    }
    let kinds = if exchange { "model exchange and co-simulation" } else { "co-simulation" };
    output::print(&match arguments.json {
        true => format!(
            "{}\n",
            serde_json::json!({"status": "done", "model": **name, "unit": path.display().to_string(), "bytes": archive.len(),
                "version": version.text(), "model_exchange": exchange, "identifier": identifier(name), "token": known_by})
        ),
        false => format!(
            "{name}: unit of FMI {} in {}, {} kB, {kinds}\n",
            version.text(),
            path.display(),
            archive.len() >> 10
        ),
    })
}

/// A sentence on the parameters that others cannot set, because the translation has used them; none where there are none.
fn fixed_parameters(payload: &Model) -> Option<String> {
    let fixed = payload.tables.variables.iter().filter(|info| info.settable == Settable::Structural && !info.protected);
    let names: Vec<String> = fixed.map(|info| format!("`{}`", info.name.parts[0].0)).collect();
    Some(format!(
        "fixed in the unit, because they decide sizes or structure: {}; `hyd build --set NAME=VALUE` makes a unit with other values",
        some_of(&names)?
    ))
}

/// A sentence on the Strings that others cannot set; none where there are none.
fn fixed_texts(flat: &FlatModel) -> Option<String> {
    let open = flat.texts.iter().filter(|text| text.is_open);
    let whole = |text: &TextBlock| text.name.parts.iter().map(|(part, _)| &**part).collect::<String>();
    let names: Vec<String> = open.map(|text| format!("`{}`", whole(text))).collect();
    Some(format!(
        "constant in the unit, because they are Strings: {}; `hyd build --set NAME=VALUE` makes a unit with other values",
        some_of(&names)?
    ))
}

/// Sentences on the Strings that the unit does not have.
fn texts_left_out(flat: &FlatModel) -> (Option<String>, Option<String>) {
    let named = |names: &[String]| some_of(&names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>());
    let why = |why: &str, names: &[String]| {
        Some(format!("not in the unit, because they are Strings {why}: {}", named(names)?))
    };
    (
        why("that follow from what can be set or is found at the start", &flat.open_texts),
        why("without a value, or with one that differs along an array of components", &flat.unknown_texts),
    )
}

/// The first of some names; none where there are none.
fn some_of(names: &[String]) -> Option<String> {
    let shown = names.get(..MOST_FIXED.min(names.len())).filter(|shown| !shown.is_empty())?.join(", ");
    let more = match names.len().saturating_sub(MOST_FIXED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    Some(format!("{shown}{more}"))
}

/// The start value of an input by its full name.
fn start_of(facts: &Facts, payload: &Model, name: &str) -> f64 {
    let variables = payload.tables.variables.iter().enumerate();
    let found = variables.filter(|(k, _)| facts.ends.get(k) == Some(&End::Input)).find_map(|(k, info)| {
        let element = (0..info.sources.len()).find(|&element| info.name.element(element) == name)?;
        let start = facts.bounds.get(&(k, element)).and_then(|bounds| bounds.start);
        Some(start.unwrap_or(if matches!(info.kind, ValueKind::Enumeration(_)) { 1.0 } else { 0.0 }))
    });
    found.unwrap_or(0.0)
}

fn facts(flat: &FlatModel, payload: &Model) -> Result<Facts, Failure> {
    let loaded = Loaded::new(payload.clone(), Backend::Native).map(Arc::new).map_err(Failure::Fault)?;
    let mut system = loaded.instantiate();
    let start = payload.experiment.start.unwrap_or(0.0);
    for input in 0..payload.structure.inputs.len() {
        system.hold_input(input, 0.0, (0.0, start));
    }
    system
        .bind(start)
        .map_err(|failure| Failure::Fault(format!("the start values cannot be computed: {}", failure.reason)))?;
    let positions = positions(flat, payload);
    let mut facts = Facts {
        parameters: system.parameters().to_vec(),
        tool: concat!("hyd ", env!("CARGO_PKG_VERSION")).to_string(),
        ..Facts::default()
    };
    for (list, end) in [(&flat.outputs, End::Output), (&flat.inputs, End::Input)] {
        facts.ends.extend(list.iter().filter_map(|block| positions.get(block)).map(|&k| (k, end)));
    }
    for (&block, &variable) in &positions {
        let block = &flat.variables[block];
        bounds(block, variable, &mut facts);
        facts.types.extend(block.declared.as_deref().map(|declared| (variable, type_of(declared))));
    }
    for (variable, element, value) in input_starts(flat, &positions) {
        facts.bounds.entry((variable, element)).or_default().start = Some(value);
    }
    facts.terminals = terminals(flat, &positions);
    for block in &flat.texts {
        let description = block.description.as_deref().unwrap_or_default().to_string();
        let elements = block.values.iter().enumerate();
        facts.texts.extend(elements.map(|(k, value)| Text {
            name: block.name.element(k),
            // A zero would end it before its end, and a description can hold no other of these either.
            value: value.chars().filter(|&c| !matches!(c, '\0'..='\x08' | '\x0b' | '\x0c' | '\x0e'..='\x1f')).collect(),
            description: description.clone(),
        }));
    }
    for info in &payload.tables.variables {
        for unit in [&info.unit, &info.display_unit].into_iter().filter(|unit| !unit.is_empty()) {
            if let Ok(known) = hyd_units::parse_unit(unit) {
                let powers = known.dimension.0.map(|power| power.as_whole());
                let whole = powers.iter().all(Option::is_some);
                let powers = whole.then(|| powers.map(Option::unwrap_or_default));
                let (unit, angle) = (unit.to_string(), hyd_units::plane_angle(unit).unwrap_or_default());
                facts.units.insert(unit, KnownUnit { powers, angle, factor: known.factor, offset: known.offset });
            }
        }
    }
    Ok(facts)
}

/// Where the blocks of the flat model stand in the tables.
fn positions(flat: &FlatModel, payload: &Model) -> BTreeMap<BlockId, usize> {
    let named = payload.tables.variables.iter().enumerate().filter(|(_, info)| !info.name.derivative);
    let by_name: std::collections::HashMap<String, usize> =
        named.filter(|(_, info)| !info.sources.is_empty()).map(|(k, info)| (info.name.element(0), k)).collect();
    let blocks = flat.variables.iter_enumerated().filter(|(_, block)| block.count > 0);
    blocks.filter_map(|(id, block)| Some((id, *by_name.get(&block.name.element(0))?))).collect()
}

/// Connectors, element by element where they are arrays.
fn terminals(flat: &FlatModel, positions: &BTreeMap<BlockId, usize>) -> Vec<Terminal> {
    let mut found = Vec::new();
    for terminal in &flat.terminals {
        let count = terminal.name.count();
        for k in 0..count {
            let mut members = Vec::new();
            for &(block, member) in &terminal.members {
                let Some(&variable) = positions.get(&block) else { continue };
                let each = flat.variables[block].count as usize / count;
                members.extend((k * each..(k + 1) * each).map(|element| ((variable, element), member)));
            }
            found.push(Terminal {
                name: terminal.name.element(k),
                class: terminal.class.to_string(),
                description: terminal.description.as_deref().unwrap_or_default().to_string(),
                outside: terminal.outside,
                members,
            });
        }
    }
    found
}

fn type_of(declared: &hyd_flat::DeclaredType) -> DeclaredType {
    let text = |text: &Option<Arc<str>>| text.as_deref().unwrap_or_default().to_string();
    let literals = declared.literals.iter().map(ToString::to_string).collect();
    DeclaredType { name: text(&declared.class), quantity: text(&declared.quantity), literals }
}

fn bounds(block: &VariableBlock, variable: usize, facts: &mut Facts) {
    for element in 0..block.count as usize {
        let finite = |value: f64| value.is_finite().then_some(value);
        let (min, max) = (finite(block.min.get(element)), finite(block.max.get(element)));
        let nominal = block.nominal.get(element);
        if min.is_some() || max.is_some() || nominal.is_some() {
            facts.bounds.insert((variable, element), Bounds { min, max, nominal, start: None });
        }
    }
}

/// Start values of inputs that are numbers: variable, element, value.
fn input_starts(flat: &FlatModel, positions: &BTreeMap<BlockId, usize>) -> Vec<(usize, usize, f64)> {
    let mut found = Vec::new();
    for equation in flat.equations.iter().filter(|equation| equation.section == Section::Start) {
        let template = flat.templates.get(equation.template);
        for k in 0..equation.count as usize {
            let operands = equation.operands_of(k, template.arity as usize);
            let slot = |node| match flat.templates.arena.node(node) {
                Node::Slot(slot) => operands.get(hyd_index::TypedIndex::index(slot)),
                _ => None,
            };
            let Some(Target::Start(v)) = slot(template.left).map(|operand| operand.target()) else { continue };
            let (block, element) = flat.locate(v);
            let Some(&variable) = positions.get(&block).filter(|_| flat.inputs.contains(&block)) else { continue };
            let value = match (flat.templates.arena.as_constant(template.right), slot(template.right)) {
                (Some(value), _) => Some(value),
                (None, Some(operand)) => match operand.target() {
                    Target::Const(c) if operand.negated() => Some(-flat.constants[c]),
                    Target::Const(c) => Some(flat.constants[c]),
                    _ => None,
                },
                _ => None,
            };
            found.extend(value.map(|value| (variable, element, value)));
        }
    }
    found
}
