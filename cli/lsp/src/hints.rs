//! Hints in the text: units that follow for variables that declare none, values of parameters that are computed, the variable that
//! an equation determines, and the causality of connectors: which potentials a component determines and which it is given (Cellier 1991,
//! *Continuous System Modeling*, on bond graphs).
//!
//! They are what a translation of the class found, so they come with its check.

use std::collections::{BTreeMap, HashMap, HashSet};

use hyd_compiler::Compilation;
use hyd_equations::{EqId, Resolution, SortedSystem, parameter_values};
use hyd_flat::{BlockId, EquationBlock, FlatModel, Section, Target, VarId};
use hyd_source::Span;
use hyd_syntax::names::{Names, Purpose};
use hyd_syntax::tree::{Component, ExprKind};
use hyd_system::{ValueKind, Variability};
use lsp_types::{InlayHint, InlayHintKind, InlayHintLabel, InlayHintTooltip, Range};

use crate::documents::Document;
use crate::session::Session;

/// Something that is known of a place of the text.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Fact {
    /// The declaration's name, or the equation.
    pub(crate) span: Span,
    /// What is known.
    pub(crate) what: Known,
}

/// What is known.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Known {
    /// The unit of a variable that declares none.
    Unit(String),
    /// The value of a parameter, as a text would have it.
    Value(String),
    /// What an equation determines: variables.
    Determines(String),
    /// Potentials of a component's connectors: those that its equations determine, and those that it is given by others.
    Causality { given: Vec<String>, taken: Vec<String> },
}

/// What a translation tells of the declarations and equations that stand in the class itself, in this file with these names.
pub(crate) fn facts(compilation: &Compilation, file: &str, names: &Names, class: Span) -> Vec<Fact> {
    let Some(flat) = &compilation.flat else { return Vec::new() };
    let files = &compilation.files;
    let is_here = |path: &str, span: Span| path.is_empty() && **files.name(span.file) == *file;
    let declared = |v: VarId| {
        let (block, k) = flat.locate(v);
        let block = &flat.variables[block];
        (k == 0 && block.made.is_none() && is_here(&block.origin.path, block.origin.span)).then_some(block)
    };
    let mut found: Vec<Fact> = Vec::new();
    for (v, unit) in &compilation.inferred_units {
        if let Some(block) = declared(*v)
            && block.unit.is_none()
        {
            found.push(Fact { span: block.origin.span, what: Known::Unit(unit.clone()) });
        }
    }
    if let Some(sorted) = compilation.sorted.as_deref() {
        values(sorted, &literals(names), &is_here, &mut found);
        determined(sorted, &is_here, &mut found);
        let is_own = |span: Span| is_here("", span) && class.start <= span.start && span.end <= class.end;
        causalities(sorted, &is_own, &mut found);
    }
    found.sort_by_key(|fact| fact.span);
    found.dedup();
    found
}

/// Where the declarations stand whose value is a literal already, or is not given.
fn literals(names: &Names) -> HashSet<u32> {
    let is_literal = |component: &Component| match component.modification.binding.as_ref().map(|value| &value.kind) {
        Some(ExprKind::Unary(_, value)) => matches!(value.kind, ExprKind::Integer(_) | ExprKind::Real(_)),
        Some(kind) => {
            matches!(kind, ExprKind::Integer(_) | ExprKind::Real(_) | ExprKind::Boolean(_) | ExprKind::Text(_))
        }
        None => true,
    };
    let written = names.places.iter().filter_map(|place| match &place.purpose {
        Purpose::DeclaresComponent(component) if is_literal(component) => Some(place.ident.span.start),
        _ => None,
    });
    written.collect()
}

fn values(sorted: &SortedSystem, literals: &HashSet<u32>, is_here: &dyn Fn(&str, Span) -> bool, found: &mut Vec<Fact>) {
    let flat: &FlatModel = &sorted.system.flat;
    let values = parameter_values(sorted, &|_| None);
    for block in flat.variables.iter().filter(|block| block.count == 1 && block.made.is_none()) {
        let span = block.origin.span;
        if block.variability > Variability::Parameter || !is_here(&block.origin.path, span) {
            continue;
        }
        let value = values[block.first];
        if value.is_finite() && !literals.contains(&span.start) {
            found.push(Fact { span, what: Known::Value(shown(&block.kind, value)) });
        }
    }
}

/// A value as a text would have it.
fn shown(kind: &ValueKind, value: f64) -> String {
    match kind {
        ValueKind::Boolean => (value != 0.0).to_string(),
        ValueKind::Enumeration(literals) => {
            // Literals are counted from 1; a number that is none has no name.
            let literal = (value >= 1.0).then(|| literals.get(value as usize - 1)).flatten();
            literal.map_or_else(|| number(value), |literal| literal.to_string())
        }
        ValueKind::Real | ValueKind::Integer => number(value),
    }
}

/// Names of variables that are listed for one equation.
const MOST_NAMES: usize = 3;

/// The variables that each equation of the class determines, also for all elements of arrays and at events, where each of its scalar equations
/// determines one alone.
fn determined(sorted: &SortedSystem, is_here: &dyn Fn(&str, Span) -> bool, found: &mut Vec<Fact>) {
    let flat: &FlatModel = &sorted.system.flat;
    let block_of = |equation: EqId| &flat.equations[sorted.system.equations[equation].block as usize];
    let written = |equation: EqId| -> Option<&EquationBlock> {
        let block = block_of(equation);
        let shown = matches!(block.section, Section::Continuous | Section::Discrete) && !block.made;
        (shown && !flat.is_connection(block) && is_here(&block.origin.path, block.origin.span)).then_some(block)
    };
    // By the place of the equation: the derivatives and variables that its parts determine, and the number of its parts.
    let mut determined: BTreeMap<Span, (Vec<(bool, VarId)>, usize)> = BTreeMap::new();
    let mut add = |equation: EqId, target: Target| {
        let (Target::Var(v) | Target::Der(v)) = target else { return };
        let (block, _): (BlockId, usize) = flat.locate(v);
        if let (None, Some(text)) = (flat.variables[block].made, written(equation)) {
            let known = &mut determined.entry(text.origin.span).or_default().0;
            let one = (matches!(target, Target::Der(_)), v);
            if !known.contains(&one) {
                known.push(one);
            }
        }
    };
    let plan = &sorted.simulation;
    for assignment in plan.assignments.iter().chain(&sorted.discrete) {
        add(assignment.equation, assignment.target);
    }
    for block in plan.blocks.iter() {
        if let ([unknown], [residual], []) = (block.unknowns, block.residuals, block.assignments) {
            let unknown = &plan.unknowns[*unknown as usize];
            if let Target::Var(v) = unknown.target {
                let target = if unknown.differential { Target::Der(v) } else { Target::Var(v) };
                add(plan.residuals[*residual as usize].equation, target);
            }
        }
    }
    for block in &flat.equations {
        if let Some((_, parts)) = determined.get_mut(&block.origin.span) {
            *parts = (*parts).max(block.count as usize);
        }
    }
    for (span, (mut targets, parts)) in determined {
        // Of an array equation of which some parts belong to a system, nothing short can be said.
        if parts == 1 || targets.len() == parts {
            targets.sort_unstable_by_key(|&(is_derivative, v)| (v, is_derivative));
            found.push(Fact { span, what: Known::Determines(named(flat, &targets)) });
        }
    }
}

/// The equation that determines each variable, or its derivative, by itself.
fn sources(sorted: &SortedSystem) -> HashMap<VarId, EqId> {
    let plan = &sorted.simulation;
    let assigned = sorted.bindings.iter().chain(plan.assignments.iter()).chain(&sorted.discrete);
    let assigned = assigned.map(|own| (own.target, own.equation));
    let solved = plan.blocks.iter().filter_map(|block| match (block.unknowns, block.residuals, block.assignments) {
        ([unknown], [residual], []) => {
            Some((plan.unknowns[*unknown as usize].target, plan.residuals[*residual as usize].equation))
        }
        _ => None,
    });
    let of_variable = |(target, equation)| match target {
        Target::Var(v) | Target::Der(v) => Some((v, equation)),
        _ => None,
    };
    assigned.chain(solved).filter_map(of_variable).collect()
}

/// For each component of the class: which of the potentials of its connectors its own equations determine.  Those that follow from several
/// equations together are left out.
fn causalities(sorted: &SortedSystem, is_own: &dyn Fn(Span) -> bool, found: &mut Vec<Fact>) {
    let flat: &FlatModel = &sorted.system.flat;
    let sources = sources(sorted);
    let mut by_component: BTreeMap<Span, (Vec<String>, Vec<String>)> = BTreeMap::new();
    for potential in flat.potentials.iter().filter(|potential| potential.depth == 2 && is_own(potential.declared)) {
        let block = &flat.variables[potential.block];
        let full = flat.var_name(block.first);
        let mut parts = full.rsplitn(3, '.');
        let (Some(variable), Some(connector), Some(component)) = (parts.next(), parts.next(), parts.next()) else {
            continue;
        };
        if block.count != 1 || component.contains(['.', '[']) {
            continue;
        }
        let kept = match sorted.system.resolution[block.first] {
            Resolution::Own => block.first,
            Resolution::Alias { of, .. } => of,
            Resolution::Value(_) => continue,
        };
        let Some(&equation) = sources.get(&kept) else { continue };
        let text = &flat.equations[sorted.system.equations[equation].block as usize];
        let behind = text.origin.path.strip_prefix(component);
        let is_inside = behind.is_some_and(|behind| behind.is_empty() || behind.starts_with('.'));
        let (given, taken) = by_component.entry(potential.declared).or_default();
        let list = if is_inside && !flat.is_connection(text) { given } else { taken };
        list.push(format!("{connector}.{variable}"));
    }
    let facts = by_component.into_iter();
    found.extend(facts.map(|(span, (given, taken))| Fact { span, what: Known::Causality { given, taken } }));
}

/// The names of variables, arrays by their own names where all elements are meant.
fn named(flat: &FlatModel, targets: &[(bool, VarId)]) -> String {
    let mut names: Vec<String> = Vec::new();
    let mut left = targets;
    while let Some(&(is_derivative, v)) = left.first() {
        let (block, k): (BlockId, usize) = flat.locate(v);
        let count = flat.variables[block].count as usize;
        let is_whole = k == 0
            && count > 1
            && left.len() >= count
            && left[..count].iter().all(|&(own, v)| own == is_derivative && flat.locate(v).0 == block);
        let full = flat.var_name(v);
        let (name, taken) = match full.rfind('[').filter(|_| is_whole && full.ends_with(']')) {
            Some(subscripts) => (full[..subscripts].to_string(), count),
            None => (full, 1),
        };
        names.push(if is_derivative { format!("der({name})") } else { name });
        left = &left[taken..];
    }
    listed(&names)
}

/// The first few names.
fn listed(names: &[String]) -> String {
    let mut shown = names.iter().take(MOST_NAMES).cloned().collect::<Vec<_>>();
    if names.len() > MOST_NAMES {
        shown.push("…".into());
    }
    shown.join(", ")
}

/// The hints of a range of a document.
pub(crate) fn hints(session: &Session, document: &Document, facts: &[Fact], range: Range) -> Vec<InlayHint> {
    let bytes = document.lines.bytes(&document.text, range, session.settings.encoding);
    let inside = facts.iter().filter(|fact| {
        let end = fact.span.end as usize;
        bytes.start <= end && end <= bytes.end && end <= document.text.len()
    });
    inside.map(|fact| hint(session, document, fact)).collect()
}

fn hint(session: &Session, document: &Document, fact: &Fact) -> InlayHint {
    let position = session.range(document, fact.span).end;
    let (label, kind, tooltip) = match &fact.what {
        Known::Unit(unit) => {
            let unit = if unit == "1" { "no unit" } else { unit };
            (format!("[{unit}]"), Some(InlayHintKind::TYPE), "the unit that follows from the equations")
        }
        Known::Value(value) => (format!("= {value}"), None, "the value before the run"),
        Known::Determines(names) => (format!("→ {names}"), None, "what this equation determines"),
        Known::Causality { given, taken } => {
            let side =
                |arrow: &str, names: &[String]| (!names.is_empty()).then(|| format!("{arrow} {}", listed(names)));
            let sides: Vec<String> = [side("→", given), side("←", taken)].into_iter().flatten().collect();
            let meaning = "potentials of its connectors: → determined by this component, ← given to it by others";
            (sides.join(" "), None, meaning)
        }
    };
    InlayHint {
        position,
        label: InlayHintLabel::String(label),
        kind,
        text_edits: None,
        tooltip: Some(InlayHintTooltip::String(tooltip.into())),
        padding_left: Some(true),
        padding_right: None,
        data: None,
    }
}

/// Six digits, which is what fits beside a text.
pub(crate) fn number(value: f64) -> String {
    let rounded = format!("{value:.5e}").parse().unwrap_or(value);
    match rounded {
        0.0 => "0".into(),
        value if (1e-3..1e6).contains(&f64::abs(value)) => format!("{value}"),
        value => format!("{value:e}"),
    }
}
