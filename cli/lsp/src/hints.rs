//! Hints in the text: units that follow for variables that declare none, values of parameters that are computed, and the variable that
//! an equation determines.
//!
//! They are what a translation of the class found, so they come with its check.

use hyd_compiler::Compilation;
use hyd_equations::{SortedSystem, parameter_values};
use hyd_flat::{BlockId, EquationBlock, FlatModel, Section, Target, VarId};
use hyd_source::{Files, Span};
use hyd_syntax::tree::ExprKind;
use hyd_system::Variability;
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
    /// The value of a parameter.
    Value(f64),
    /// The variable that an equation determines.
    Determines(String),
}

/// What a translation tells of the declarations and equations that stand in the class itself, in this file.
pub(crate) fn facts(compilation: &Compilation, file: &str) -> Vec<Fact> {
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
        values(sorted, files, &is_here, &mut found);
        determined(sorted, &is_here, &mut found);
    }
    found.sort_by_key(|fact| fact.span);
    found.dedup();
    found
}

fn values(sorted: &SortedSystem, files: &Files, is_here: &dyn Fn(&str, Span) -> bool, found: &mut Vec<Fact>) {
    let flat: &FlatModel = &sorted.system.flat;
    let values = parameter_values(sorted, &|_| None);
    for block in flat.variables.iter().filter(|block| block.count == 1 && block.made.is_none()) {
        let span = block.origin.span;
        if block.variability > Variability::Parameter || !is_here(&block.origin.path, span) {
            continue;
        }
        let value = values[block.first];
        if value.is_finite() && !is_written(files, span) {
            found.push(Fact { span, what: Known::Value(value) });
        }
    }
}

/// Characters behind a name in which its value is looked for.
const LONGEST: usize = 200;

/// The value stands behind the name as a number already.
fn is_written(files: &Files, name: Span) -> bool {
    let rest = files.text(name.file).get(name.end as usize..).unwrap_or_default();
    // A number is not longer, and a line may be as long as machines write it.
    let line: &str = rest.char_indices().nth(LONGEST).map_or(rest, |(end, _)| &rest[..end]);
    let line = line.lines().next().unwrap_or_default();
    let Some((_, value)) = line.split_once('=') else { return true };
    let value = value.split([';', '"']).next().unwrap_or_default();
    let parsed = hyd_syntax::parse_expression(name.file, value).value;
    match parsed.map(|value| value.kind) {
        Some(ExprKind::Unary(_, value)) => matches!(value.kind, ExprKind::Integer(_) | ExprKind::Real(_)),
        Some(ExprKind::Integer(_) | ExprKind::Real(_) | ExprKind::Boolean(_) | ExprKind::Text(_)) | None => true,
        Some(_) => false,
    }
}

/// The variable that each equation of the class determines, where it determines one alone.
fn determined(sorted: &SortedSystem, is_here: &dyn Fn(&str, Span) -> bool, found: &mut Vec<Fact>) {
    let flat: &FlatModel = &sorted.system.flat;
    let written = |equation: hyd_equations::EqId| -> Option<&EquationBlock> {
        let block = &flat.equations[sorted.system.equations[equation].block as usize];
        let shown = block.section == Section::Continuous && !block.made && block.count == 1;
        (shown && !flat.is_connection(block) && is_here(&block.origin.path, block.origin.span)).then_some(block)
    };
    let is_declared = |target: Target| match target {
        Target::Var(v) | Target::Der(v) => {
            let (block, _): (BlockId, usize) = flat.locate(v);
            flat.variables[block].made.is_none()
        }
        _ => false,
    };
    let name = |target: Target| match target {
        Target::Der(v) => format!("der({})", flat.var_name(v)),
        Target::Var(v) => flat.var_name(v),
        _ => String::new(),
    };
    let plan = &sorted.simulation;
    for assignment in plan.assignments.iter().filter(|assignment| is_declared(assignment.target)) {
        if let Some(block) = written(assignment.equation) {
            found.push(Fact { span: block.origin.span, what: Known::Determines(name(assignment.target)) });
        }
    }
    for block in plan.blocks.iter() {
        if let ([unknown], [residual], []) = (block.unknowns, block.residuals, block.assignments) {
            let unknown = &plan.unknowns[*unknown as usize];
            let (Target::Var(v), Some(text)) = (unknown.target, written(plan.residuals[*residual as usize].equation))
            else {
                continue;
            };
            let target = if unknown.differential { Target::Der(v) } else { Target::Var(v) };
            if is_declared(target) {
                found.push(Fact { span: text.origin.span, what: Known::Determines(name(target)) });
            }
        }
    }
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
        Known::Value(value) => (format!("= {}", number(*value)), None, "the value before the run"),
        Known::Determines(name) => (format!("→ {name}"), None, "the variable that this equation determines"),
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
