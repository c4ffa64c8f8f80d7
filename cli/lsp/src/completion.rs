//! Completion: members behind a dot, elements that are modified, names that can be used at a place, units in strings, annotations.

use hyd_instance::Builtin;
use hyd_instance::class::elements;
use hyd_instance::meaning::{Kind, KindClass, Meaning, Member, Visible};
use hyd_instance::{ClassId, class::nested_classes};
use hyd_syntax::print_expr;
use hyd_syntax::tree::{ClassKind, Element, ExprKind, Name, Variability};
use lsp_types::{
    CompletionItem, CompletionItemKind, CompletionTextEdit, Documentation, MarkupContent, MarkupKind, Position, Range,
    TextEdit,
};

use crate::annotations;
use crate::context::{Context, Head, Slot, Text, context};
use crate::documents::Document;
use crate::hover::prefixes;
use crate::modifiers::{STATE_SELECT, inside_of, literals, modified, modifiers, replaceable};
use crate::session::{Question, Session};

/// Units that people write often; any product of powers of these is one, too.
pub(crate) const UNITS: [&str; 52] = [
    "1",
    "m",
    "mm",
    "m2",
    "m3",
    "s",
    "ms",
    "kg",
    "g",
    "kg/s",
    "kg/m3",
    "A",
    "mA",
    "K",
    "degC",
    "mol",
    "rad",
    "deg",
    "Hz",
    "1/s",
    "N",
    "N.m",
    "N/m",
    "N.s/m",
    "N.m/rad",
    "N.m.s/rad",
    "m/s",
    "m/s2",
    "rad/s",
    "rad/s2",
    "Pa",
    "bar",
    "Pa.s",
    "m3/s",
    "l/min",
    "J",
    "J/kg",
    "J/(kg.K)",
    "W",
    "W/K",
    "W/(m.K)",
    "W/(m2.K)",
    "V",
    "Ohm",
    "S",
    "F",
    "H",
    "C",
    "Wb",
    "T",
    "kg.m2",
    "m3/Pa",
];
const KEYWORDS: [&str; 33] = [
    "model",
    "block",
    "connector",
    "record",
    "type",
    "package",
    "function",
    "partial",
    "extends",
    "import",
    "parameter",
    "constant",
    "input",
    "output",
    "flow",
    "discrete",
    "inner",
    "outer",
    "replaceable",
    "redeclare",
    "final",
    "protected",
    "public",
    "equation",
    "algorithm",
    "initial equation",
    "connect",
    "for",
    "if",
    "when",
    "end",
    "annotation",
    "while",
];

/// What can stand at a place.
pub(crate) fn completion(session: &mut Session, document: &Document, position: Position) -> Vec<CompletionItem> {
    let byte = session.byte(document, position);
    let context = context(&document.text, byte);
    let mut found = session.ask_document(document, |question| {
        // A class is over behind its last name: what is typed there belongs around it.
        let class = question.class_around(byte);
        candidates(question, class, &context)
    });
    if let Slot::Text(_) = context.place {
        // For an editor a word of a text may begin behind any dot or stroke of a unit.
        let start = document.lines.position(&document.text, byte - context.partial.len(), session.settings.encoding);
        for item in &mut found {
            let edit = TextEdit { range: Range { start, end: position }, new_text: item.label.clone() };
            item.text_edit = Some(CompletionTextEdit::Edit(edit));
            item.filter_text = Some(item.label.clone());
        }
    }
    found
}

fn candidates(question: &mut Question<'_>, class: Option<ClassId>, context: &Context) -> Vec<CompletionItem> {
    match &context.place {
        Slot::Comment | Slot::Declared => Vec::new(),
        Slot::Text(text) => units(question, class, text),
        Slot::Annotation(entry) => match annotations::proposals(entry) {
            Some(found) => without(found, &context.given),
            None => names(question, class, &context.loops),
        },
        Slot::Argument(Head::Modified { class: path, chain }) => {
            without(modifiers(question, class, path, chain), &context.given)
        }
        Slot::Value(Head::Modified { class: path, chain }, name) => {
            let mut found = literals(question, class, (path, chain), name);
            found.extend(names(question, class, &context.loops));
            once(found)
        }
        Slot::Redeclared(Head::Modified { class: path, chain }, element) => {
            replaceable(question, class, (path, chain), *element)
        }
        _ if context.connects => ends(question, class, &context.chain),
        _ if !context.chain.is_empty() => members(question, class, &context.chain),
        Slot::Class => classes(question, class),
        Slot::Argument(Head::Call(function)) => {
            let mut found = without(arguments(question, class, function), &context.given);
            found.extend(names(question, class, &context.loops));
            found
        }
        Slot::Expression | Slot::Value(..) | Slot::Redeclared(..) => names(question, class, &context.loops),
        Slot::Statement => {
            let mut found = names(question, class, &context.loops);
            found.extend(KEYWORDS.iter().map(|word| plain(word, CompletionItemKind::KEYWORD, None)));
            found
        }
    }
}

pub(crate) fn plain(label: &str, kind: CompletionItemKind, detail: Option<String>) -> CompletionItem {
    CompletionItem { label: label.to_string(), kind: Some(kind), detail, ..CompletionItem::default() }
}

/// What is not among what a list gives already.
fn without(mut found: Vec<CompletionItem>, given: &[String]) -> Vec<CompletionItem> {
    found.retain(|item| !given.contains(&item.label));
    found
}

/// Units for a string; those to display a value in measure what its unit does.
fn units(question: &mut Question<'_>, class: Option<ClassId>, text: &Text) -> Vec<CompletionItem> {
    let dimension = match text.attribute.as_deref() {
        Some("unit") => None,
        Some("displayUnit") => {
            let own = text.unit.clone().or_else(|| unit_of(question, class, text.of.as_ref()?));
            own.and_then(|unit| hyd_units::parse_unit(&unit).ok()).map(|unit| unit.dimension)
        }
        _ => return Vec::new(),
    };
    let fits = |unit: &&&str| {
        dimension.is_none_or(|wanted| hyd_units::parse_unit(unit).is_ok_and(|unit| unit.dimension == wanted))
    };
    UNITS.iter().filter(fits).map(|unit| plain(unit, CompletionItemKind::UNIT, None)).collect()
}

/// The unit of what a list modifies, as its declaration or its type says.
fn unit_of(question: &mut Question<'_>, class: Option<ClassId>, of: &Head) -> Option<String> {
    let Head::Modified { class: path, chain } = of else { return None };
    let given = match modified(question, class, path, chain)? {
        Meaning::Component(member) => question.table.given(&member, Some("unit")),
        Meaning::Class(class) => question.table.given_by_class(class, "unit"),
        _ => None,
    };
    match given?.value.kind {
        ExprKind::Text(ref unit) => Some(unit.to_string()),
        _ => None,
    }
}

/// What the names before the dot mean, one inside the other.
pub(crate) fn resolve(question: &mut Question<'_>, class: Option<ClassId>, chain: &[String]) -> Option<Meaning> {
    let (first, rest) = chain.split_first()?;
    let table = &mut question.table;
    table.quietly(|table| {
        let first = Name::from(first.as_str());
        let start = match class {
            Some(class) => table.named(class, &first),
            None => table.top(&first).map(Meaning::Class),
        };
        rest.iter().try_fold(start?, |meaning, name| table.inside(&meaning, &Name::from(name.as_str())))
    })
}

fn members(question: &mut Question<'_>, class: Option<ClassId>, chain: &[String]) -> Vec<CompletionItem> {
    match resolve(question, class, chain) {
        Some(Meaning::Component(member)) => match question.table.kind_of(&member) {
            Some(Kind { class: KindClass::Class(class), .. }) => elements_of(question, class, false),
            _ => Vec::new(),
        },
        Some(Meaning::Class(class)) => inside_class(question, class),
        Some(Meaning::Type(_)) => STATE_SELECT.map(|l| plain(l, CompletionItemKind::ENUM_MEMBER, None)).into(),
        _ => Vec::new(),
    }
}

/// Classes, constants and literals behind the name of a class.
fn inside_class(question: &mut Question<'_>, class: ClassId) -> Vec<CompletionItem> {
    let mut found = Vec::new();
    let children = question.table.quietly(|table| table.child_names(class));
    for name in children {
        // A package of files is not read to list them: only what is known by its text has a kind.
        let known = nested_classes(&question.table.class(class).def).find(|nested| nested.class.name.name == name);
        let (kind, detail) = match known {
            Some(nested) => (class_kind(nested.class.kind), nested.class.description.as_deref().map(str::to_string)),
            None => (CompletionItemKind::CLASS, None),
        };
        found.push(plain(&name, kind, detail));
    }
    let constants = question.table.elements_of(class).into_iter().filter_map(|element| match element {
        Visible::Component(member) if member.component.variability <= Variability::Constant => Some(member),
        _ => None,
    });
    let constants: Vec<_> = constants.collect();
    for member in constants {
        found.push(component_item(question, &member));
    }
    if let Some((_, literals)) = question.table.literals_of(class) {
        found.extend(literals.iter().map(|literal| plain(literal, CompletionItemKind::ENUM_MEMBER, None)));
    }
    found
}

/// The elements of a class that can be named from outside; from inside all.
pub(crate) fn elements_of(question: &mut Question<'_>, class: ClassId, inside: bool) -> Vec<CompletionItem> {
    let mut found = Vec::new();
    for element in question.table.elements_of(class) {
        match element {
            Visible::Component(member) if inside || !member.component.prefixes.protected => {
                found.push(component_item(question, &member));
            }
            Visible::Component(_) => {}
            Visible::Class(name, id) if inside => {
                let def = question.table.class(id).def.clone();
                found.push(plain(&name, class_kind(def.kind), def.description.as_deref().map(str::to_string)));
            }
            Visible::Class(..) => {}
        }
    }
    found
}

pub(crate) fn component_item(question: &mut Question<'_>, member: &Member) -> CompletionItem {
    let component = &member.component;
    let class: Vec<&str> = component.class.parts.iter().map(|part| &*part.name).collect();
    let unit = question.table.given(member, Some("unit")).map(|unit| print_expr(&unit.value));
    let unit = unit.map_or(String::new(), |unit| format!(" [{}]", unit.trim_matches('"')));
    let detail = format!("{}{}{unit}", prefixes(component), class.join("."));
    let kind = match component.variability {
        Variability::Constant => CompletionItemKind::CONSTANT,
        Variability::Parameter => CompletionItemKind::PROPERTY,
        Variability::Discrete | Variability::Continuous => CompletionItemKind::VARIABLE,
    };
    let documentation = component.description.as_deref().map(|text| {
        Documentation::MarkupContent(MarkupContent { kind: MarkupKind::PlainText, value: text.to_string() })
    });
    CompletionItem { documentation, ..plain(&component.name.name, kind, Some(detail)) }
}

pub(crate) fn class_kind(kind: ClassKind) -> CompletionItemKind {
    match kind {
        ClassKind::Package => CompletionItemKind::MODULE,
        ClassKind::Function | ClassKind::Operator => CompletionItemKind::FUNCTION,
        ClassKind::Connector => CompletionItemKind::INTERFACE,
        ClassKind::Record | ClassKind::Type => CompletionItemKind::STRUCT,
        ClassKind::Class | ClassKind::Model | ClassKind::Block => CompletionItemKind::CLASS,
    }
}

/// Everything that one name can mean here.
fn names(question: &mut Question<'_>, class: Option<ClassId>, loops: &[String]) -> Vec<CompletionItem> {
    let inner = loops.iter().rev();
    let mut found: Vec<CompletionItem> =
        inner.map(|name| plain(name, CompletionItemKind::VARIABLE, Some("loop variable".into()))).collect();
    found.extend(class.map_or_else(Vec::new, |class| elements_of(question, class, true)));
    let mut around = class;
    while let Some(outer) = around.and_then(|class| question.table.class(class).parent) {
        if question.table.class(outer).def.kind == ClassKind::Package {
            let def = question.table.class(outer).def.clone();
            let constants = elements(&def).iter().filter_map(|element| match element {
                Element::Component(component) => Some(component.name.name.clone()),
                _ => None,
            });
            found.extend(constants.map(|name| plain(&name, CompletionItemKind::CONSTANT, None)));
        }
        around = Some(outer);
    }
    found.extend(classes(question, class));
    found.extend(Builtin::names().map(|name| plain(name, CompletionItemKind::FUNCTION, None)));
    found.push(plain("time", CompletionItemKind::VARIABLE, Some("Real [s]".into())));
    once(found)
}

fn classes(question: &mut Question<'_>, class: Option<ClassId>) -> Vec<CompletionItem> {
    let mut found: Vec<CompletionItem> = ["Real", "Integer", "Boolean", "String"]
        .map(|name| plain(name, CompletionItemKind::STRUCT, Some("predefined type".into())))
        .into();
    let names = question.table.class_names_in(class);
    found.extend(names.iter().map(|name| plain(name, CompletionItemKind::CLASS, None)));
    once(found)
}

/// The first of each name.
fn once(found: Vec<CompletionItem>) -> Vec<CompletionItem> {
    let mut seen = std::collections::HashSet::new();
    found.into_iter().filter(|item| seen.insert(item.label.clone())).collect()
}

/// How deep a component is looked into for connectors.
const DEEPEST_END: usize = 4;

/// Connectors, and components that hold connectors: of a class, or of what is named before the dot.
fn ends(question: &mut Question<'_>, class: Option<ClassId>, chain: &[String]) -> Vec<CompletionItem> {
    let inside = match chain {
        [] => class,
        _ => match resolve(question, class, chain).and_then(|of| inside_of(question, &of)) {
            Some(KindClass::Class(of)) => Some(of),
            _ => None,
        },
    };
    let mut found = Vec::new();
    for element in inside.map_or_else(Vec::new, |inside| question.table.elements_of(inside)) {
        let Visible::Component(member) = element else { continue };
        let visible = chain.is_empty() || !member.component.prefixes.protected;
        if visible && is_end(question, &member, 0) {
            found.push(component_item(question, &member));
        }
    }
    found
}

fn is_end(question: &mut Question<'_>, member: &Member, depth: usize) -> bool {
    let Some(KindClass::Class(class)) = question.table.kind_of(member).map(|kind| kind.class) else { return false };
    if question.table.class(class).def.kind == ClassKind::Connector {
        return true;
    }
    if depth >= DEEPEST_END {
        return false;
    }
    let elements = question.table.elements_of(class);
    elements.into_iter().any(|element| match element {
        Visible::Component(inner) => !inner.component.prefixes.protected && is_end(question, &inner, depth + 1),
        Visible::Class(..) => false,
    })
}

fn arguments(question: &mut Question<'_>, class: Option<ClassId>, function: &[String]) -> Vec<CompletionItem> {
    let Some(Meaning::Class(function)) = resolve(question, class, function) else { return Vec::new() };
    let inputs = crate::signature::inputs(question, function);
    let item = |member: &Member| component_item(question, member);
    inputs.iter().map(item).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn all_proposed_units_are_units() {
        for unit in super::UNITS {
            assert!(hyd_units::parse_unit(unit).is_ok(), "{unit}");
        }
    }
}
