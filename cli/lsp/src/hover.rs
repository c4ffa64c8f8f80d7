//! What stands at a place: declaration, unit, value and who says it, description, and the equation around it in mathematical form.

use std::sync::Arc;

use hyd_instance::meaning::{Given, KindClass, Meaning, Member};
use hyd_source::Span;
use hyd_syntax::names::{Modifier, Purpose};
use hyd_syntax::print_expr;
use hyd_syntax::tree::{
    Argument, ClassBody, Component, Direction, Equation, EquationKind, Expr, ExprKind, Modification, Variability,
};
use lsp_types::{Hover, HoverContents, MarkupContent, MarkupKind, Position};

use crate::documents::Document;
use crate::hints::{Fact, Known};
use crate::math;
use crate::session::{Question, Session};

/// The answer to a question for a place.
pub(crate) fn hover(session: &mut Session, document: &Document, position: Position, facts: &[Fact]) -> Option<Hover> {
    let byte = session.byte(document, position);
    let (text, span) = session.ask_document(document, |question| {
        let mut parts = Vec::new();
        let mut span = None;
        if let Some(place) = question.place(byte) {
            let ids = question.ids.clone();
            if let Some(meaning) = question.table.meaning(&place, &ids) {
                span = Some(place.ident.span);
                let mut said = described(question, &meaning, facts);
                // The value of a component is told with it.
                if let (Purpose::Modifier(modifier), Meaning::Attribute { .. }) = (&place.purpose, &meaning)
                    && let Some(value) = given_there(modifier)
                {
                    said.push_str(&format!("\n\nvalue: `{}`", question.written(value)));
                }
                parts.push(said);
            }
        }
        if let Some(equation) = equation_at(question, byte)
            && let Some(shown) = math::equation(&equation)
        {
            span = span.or(Some(equation.span));
            parts.push(shown);
        }
        (parts.join("\n\n---\n\n"), span)
    });
    let span = span?;
    let contents = HoverContents::Markup(MarkupContent { kind: MarkupKind::Markdown, value: text });
    Some(Hover { contents, range: Some(session.range(document, span)) })
}

/// The value that a modification gives to the element that a name in it stands for.
fn given_there(modifier: &Modifier) -> Option<&Expr> {
    let mut inside: &Modification = &modifier.within;
    let mut chain = &modifier.chain[..];
    while !chain.is_empty() {
        let (names, found) = inside.arguments.iter().find_map(|argument| match argument {
            Argument::Modify(modify) => {
                let parts = &modify.target.parts;
                // Elements are told apart by where they stand: another argument may have the same name.
                let fits =
                    chain.len() >= parts.len() && chain.iter().zip(parts).all(|(own, part)| own.span == part.span);
                fits.then_some((parts.len(), &modify.modification))
            }
            _ => None,
        })?;
        chain = &chain[names..];
        inside = found;
    }
    inside.binding.as_ref()
}

/// What something is, in Markdown.
pub(crate) fn described(question: &mut Question<'_>, meaning: &Meaning, facts: &[Fact]) -> String {
    match meaning {
        Meaning::Component(member) => component(question, member, facts),
        Meaning::Class(class) => {
            let def = question.table.class(*class).def.clone();
            let partial = if def.partial { "partial " } else { "" };
            let name = question.table.full_name(*class);
            let base = match &def.body {
                ClassBody::Short { base, modification, .. } => {
                    let path: Vec<&str> = base.parts.iter().map(|part| &*part.name).collect();
                    let said = modification.span.map_or("", |span| question.table.files.snippet(span));
                    format!(" = {}{said}", path.join("."))
                }
                _ => String::new(),
            };
            let head = code(&format!("{partial}{} {name}{base}", def.kind.keyword()));
            with_description(head, def.description.as_deref())
        }
        Meaning::Literal { class, position } => {
            let name = question.table.full_name(*class);
            let ClassBody::Enumeration(Some(literals)) = &question.table.class(*class).def.body else {
                return code(&name);
            };
            let Some(literal) = literals.get(*position) else { return code(&name) };
            with_description(code(&format!("{name}.{}", literal.name.name)), literal.description.as_deref())
        }
        Meaning::Iterator(span) => code(&format!("{} (loop variable)", question.table.files.snippet(*span))),
        Meaning::Type(name) => code(&format!("type {name}")) + "\n\npredefined type",
        Meaning::Attribute { name, of } => code(name) + &format!("\n\nattribute of {of}"),
        Meaning::Builtin(builtin) => code(builtin.name()) + "\n\nfunction of the language",
        Meaning::Time => code("Real time(unit = \"s\")") + "\n\nthe independent variable",
    }
}

fn component(question: &mut Question<'_>, member: &Member, facts: &[Fact]) -> String {
    let component = member.component.clone();
    let kind = question.table.kind_of(member);
    let typed = match kind.as_ref().map(|kind| &kind.class) {
        Some(KindClass::Class(class)) => question.table.full_name(*class),
        Some(KindClass::Builtin(name)) => name.to_string(),
        None => component.class.parts.iter().map(|part| &*part.name).collect::<Vec<_>>().join("."),
    };
    let new = member.redeclared();
    let dims = new.as_ref().map(|(new, _)| &new.dims).filter(|dims| !dims.is_empty()).unwrap_or(&component.dims);
    let sizes = dims.iter().map(print_expr).collect::<Vec<_>>();
    let sizes = if sizes.is_empty() { String::new() } else { format!("[{}]", sizes.join(", ")) };
    let head = code(&format!("{}{typed} {}{sizes}", prefixes(&component), component.name.name));
    let described = new.as_ref().and_then(|(new, _)| new.description.as_deref());
    let mut text = with_description(head, described.or(component.description.as_deref()));
    let mut line = |label: &str, said: &str| text.push_str(&format!("\n\n{label}: {said}"));
    let known = |wanted: fn(&Known) -> Option<String>| {
        facts.iter().filter(|fact| fact.span == component.name.span).find_map(|fact| wanted(&fact.what))
    };
    match question.table.given(member, Some("unit")) {
        Some(unit) => line("unit", &shown_text(&unit)),
        None => {
            if let Some(unit) = known(|known| if let Known::Unit(unit) = known { Some(unit.clone()) } else { None }) {
                line("unit", &format!("`{unit}`, which follows from the equations"));
            }
        }
    }
    if let Some(given) = question.table.given(member, None) {
        line("value", &format!("`{}`{}", question.written(&given.value), said_by(question, member, &given)));
    } else if let Some(start) = question.table.given(member, Some("start")) {
        line("start", &format!("`{}`{}", question.written(&start.value), said_by(question, member, &start)));
    }
    if let Some(value) = known(|known| if let Known::Value(value) = known { Some(value.clone()) } else { None }) {
        line("before the run", &format!("`{value}`"));
    }
    let owner = question.table.full_name(member.owner);
    line("declared in", &format!("`{owner}`"));
    if let Some((new, by)) = new {
        let at = place(question, new.name.span);
        line("redeclared in", &format!("`{}` ({at})", question.table.full_name(by)));
    }
    text
}

/// Where a value was given that the declaration does not have.
fn said_by(question: &Question<'_>, member: &Member, given: &Given) -> String {
    let span: Span = given.value.span;
    let own = member.component.span;
    if span.file == own.file && own.start <= span.start && span.end <= own.end {
        return String::new();
    }
    let (at, class) = (place(question, span), question.table.full_name(given.by));
    format!(", modified in `{class}` ({at})")
}

/// File and line.
fn place(question: &Question<'_>, span: Span) -> String {
    let files = &question.table.files;
    let name: &Arc<str> = files.name(span.file);
    let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
    format!("{file}:{}", files.location(span).line)
}

/// A string without its quotes.
fn shown_text(given: &Given) -> String {
    match &given.value.kind {
        ExprKind::Text(text) => format!("`{text}`"),
        _ => format!("`{}`", print_expr(&given.value)),
    }
}

/// The words before the type in a declaration.
pub(crate) fn prefixes(component: &Component) -> String {
    let mut words = Vec::new();
    if component.prefixes.is_final {
        words.push("final");
    }
    if component.flow {
        words.push("flow");
    }
    match component.variability {
        Variability::Constant => words.push("constant"),
        Variability::Parameter => words.push("parameter"),
        Variability::Discrete => words.push("discrete"),
        Variability::Continuous => {}
    }
    match component.direction {
        Some(Direction::Input) => words.push("input"),
        Some(Direction::Output) => words.push("output"),
        None => {}
    }
    words.iter().map(|word| format!("{word} ")).collect()
}

/// The innermost equation with two sides around a byte.
fn equation_at(question: &Question<'_>, byte: usize) -> Option<Equation> {
    let class = question.names.class_around(byte as u32)?;
    let ClassBody::Long { equations, .. } = &question.names.classes.get(class)?.def.body else { return None };
    let mut open: Vec<&Equation> = equations.iter().flat_map(|section| &section.equations).collect();
    while let Some(equation) = open.pop() {
        let span = equation.span;
        if !(span.start as usize <= byte && byte <= span.end as usize) {
            continue;
        }
        match &equation.kind {
            EquationKind::Equal(..) => return Some(equation.clone()),
            EquationKind::For(_, body) => open.extend(body),
            EquationKind::If(branches) => open.extend(branches.iter().flat_map(|(_, body)| body)),
            EquationKind::When(branches) => open.extend(branches.iter().flat_map(|(_, body)| body)),
            EquationKind::Connect(..) | EquationKind::Call(..) => {}
        }
    }
    None
}

fn code(text: &str) -> String {
    format!("```modelica\n{text}\n```")
}

fn with_description(head: String, description: Option<&str>) -> String {
    match description {
        Some(description) if !description.is_empty() => format!("{head}\n\n{description}"),
        _ => head,
    }
}
