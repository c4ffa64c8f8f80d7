//! Completion: members behind a dot, elements that are modified, names that can be used at a place, units in strings, annotations.

use hyd_instance::Builtin;
use hyd_instance::class::elements;
use hyd_instance::meaning::{Kind, KindClass, Meaning, Visible};
use hyd_instance::{ClassId, class::nested_classes};
use hyd_syntax::print_expr;
use hyd_syntax::tree::{ClassKind, Element, Name, Variability};
use lsp_types::{CompletionItem, CompletionItemKind, Documentation, MarkupContent, MarkupKind, Position};

use crate::context::{Context, Head, Slot, context};
use crate::documents::Document;
use crate::hover::prefixes;
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
const ATTRIBUTES: [&str; 9] =
    ["unit", "displayUnit", "start", "fixed", "min", "max", "nominal", "stateSelect", "quantity"];
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
    session.ask_document(document, |question| {
        // A class is over behind its last name: what is typed there belongs around it.
        let class = question.class_around(byte);
        candidates(question, class, &context)
    })
}

fn candidates(question: &mut Question<'_>, class: Option<ClassId>, context: &Context) -> Vec<CompletionItem> {
    match &context.place {
        Slot::Comment | Slot::Declared => Vec::new(),
        Slot::Text(attribute) => match attribute.as_deref() {
            Some("unit" | "displayUnit") => {
                let unit = |unit: &&str| plain(unit, CompletionItemKind::UNIT, None);
                UNITS.iter().map(unit).collect()
            }
            _ => Vec::new(),
        },
        Slot::Argument(Head::Annotation(inside)) => annotations(inside),
        Slot::Argument(Head::Modified { class: path, chain }) => modifiers(question, class, path, chain),
        _ if !context.chain.is_empty() => members(question, class, &context.chain),
        Slot::Class => classes(question, class),
        Slot::Argument(Head::Call(function)) => {
            let mut found = arguments(question, class, function);
            found.extend(names(question, class));
            found
        }
        Slot::Expression => names(question, class),
        Slot::Statement => {
            let mut found = names(question, class);
            found.extend(KEYWORDS.iter().map(|word| plain(word, CompletionItemKind::KEYWORD, None)));
            found
        }
    }
}

fn plain(label: &str, kind: CompletionItemKind, detail: Option<String>) -> CompletionItem {
    CompletionItem { label: label.to_string(), kind: Some(kind), detail, ..CompletionItem::default() }
}

/// What the names before the dot mean, one inside the other.
fn resolve(question: &mut Question<'_>, class: Option<ClassId>, chain: &[String]) -> Option<Meaning> {
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
        Some(Meaning::Type(_)) => ["never", "avoid", "default", "prefer", "always"]
            .map(|l| plain(l, CompletionItemKind::ENUM_MEMBER, None))
            .into(),
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
fn elements_of(question: &mut Question<'_>, class: ClassId, inside: bool) -> Vec<CompletionItem> {
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

fn component_item(question: &mut Question<'_>, member: &hyd_instance::meaning::Member) -> CompletionItem {
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

fn class_kind(kind: ClassKind) -> CompletionItemKind {
    match kind {
        ClassKind::Package => CompletionItemKind::MODULE,
        ClassKind::Function | ClassKind::Operator => CompletionItemKind::FUNCTION,
        ClassKind::Connector => CompletionItemKind::INTERFACE,
        ClassKind::Record | ClassKind::Type => CompletionItemKind::STRUCT,
        ClassKind::Class | ClassKind::Model | ClassKind::Block => CompletionItemKind::CLASS,
    }
}

/// Everything that one name can mean here.
fn names(question: &mut Question<'_>, class: Option<ClassId>) -> Vec<CompletionItem> {
    let mut found = class.map_or_else(Vec::new, |class| elements_of(question, class, true));
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

fn modifiers(
    question: &mut Question<'_>,
    class: Option<ClassId>,
    path: &[String],
    chain: &[String],
) -> Vec<CompletionItem> {
    let attributes = || ATTRIBUTES.map(|name| plain(name, CompletionItemKind::PROPERTY, None)).into();
    if let [only] = path
        && matches!(only.as_str(), "Real" | "Integer" | "Boolean" | "String")
    {
        return attributes();
    }
    let mut meaning = resolve(question, class, path);
    for name in chain {
        let Some(outer) = meaning else { return Vec::new() };
        meaning = question.table.quietly(|table| {
            let of = match &outer {
                Meaning::Class(class) => Some(*class),
                Meaning::Component(member) => match table.kind_of(member)?.class {
                    KindClass::Class(class) => Some(class),
                    KindClass::Builtin(_) => None,
                },
                _ => None,
            };
            table.member(of?, &Name::from(name.as_str()), &[])
        });
    }
    let class = match meaning {
        Some(Meaning::Class(class)) => class,
        Some(Meaning::Component(member)) => match question.table.kind_of(&member).map(|kind| kind.class) {
            Some(KindClass::Class(class)) => class,
            Some(KindClass::Builtin(_)) => return attributes(),
            None => return Vec::new(),
        },
        _ => return Vec::new(),
    };
    if question.table.builtin_of(class).is_some() {
        return attributes();
    }
    let mut found = elements_of(question, class, false);
    // What is given most often comes first.
    for item in &mut found {
        let rank = if item.kind == Some(CompletionItemKind::PROPERTY) { 0 } else { 1 };
        item.sort_text = Some(format!("{rank}{}", item.label));
    }
    found
}

fn arguments(question: &mut Question<'_>, class: Option<ClassId>, function: &[String]) -> Vec<CompletionItem> {
    let Some(Meaning::Class(function)) = resolve(question, class, function) else { return Vec::new() };
    let inputs = crate::signature::inputs(question, function);
    let item = |member: &hyd_instance::meaning::Member| component_item(question, member);
    inputs.iter().map(item).collect()
}

fn annotations(inside: &[String]) -> Vec<CompletionItem> {
    let inside: Vec<&str> = inside.iter().map(String::as_str).collect();
    let known: &[&str] = match inside[..] {
        [] => &["experiment", "Documentation", "Evaluate", "Inline", "choices", "Dialog", "Icon", "Diagram", "__hyd"],
        ["experiment"] => &["StartTime", "StopTime", "Interval", "Tolerance"],
        ["Documentation"] => &["info", "revisions"],
        ["__hyd"] => &["open", "effect", "place", "prior", "plot"],
        ["Dialog"] => &["tab", "group", "enable"],
        _ => &[],
    };
    known.iter().map(|name| plain(name, CompletionItemKind::PROPERTY, None)).collect()
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
