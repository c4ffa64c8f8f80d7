//! What the list of a modification can hold: elements and attributes, their values, and elements that can be redeclared.

use hyd_instance::meaning::{KindClass, Meaning, Visible};
use hyd_instance::shape::is_builtin;
use hyd_instance::{ClassId, class::nested_classes};
use hyd_syntax::tree::Name;
use lsp_types::{CompletionItem, CompletionItemKind};

use crate::completion::{class_kind, component_item, elements_of, plain, resolve};
use crate::context::Element;
use crate::session::Question;

const ATTRIBUTES: [&str; 9] =
    ["unit", "displayUnit", "start", "fixed", "min", "max", "nominal", "stateSelect", "quantity"];
/// The literals of `StateSelect`.
pub(crate) const STATE_SELECT: [&str; 5] = ["never", "avoid", "default", "prefer", "always"];

/// Elements and attributes that the list of a modification can speak of.
pub(crate) fn modifiers(
    question: &mut Question<'_>,
    class: Option<ClassId>,
    path: &[String],
    chain: &[String],
) -> Vec<CompletionItem> {
    let attributes = || ATTRIBUTES.map(|name| plain(name, CompletionItemKind::PROPERTY, None)).into();
    if is_predefined(path) {
        return attributes();
    }
    let Some(class) = modified(question, class, path, chain).and_then(|meaning| inside_of(question, &meaning)) else {
        return Vec::new();
    };
    let class = match class {
        KindClass::Class(class) if question.table.builtin_of(class).is_none() => class,
        _ => return attributes(),
    };
    let mut found = elements_of(question, class, false);
    // What is given most often comes first.
    for item in &mut found {
        let rank = if item.kind == Some(CompletionItemKind::PROPERTY) { 0 } else { 1 };
        item.sort_text = Some(format!("{rank}{}", item.label));
    }
    for word in ["redeclare", "each", "final"] {
        let item = plain(word, CompletionItemKind::KEYWORD, None);
        found.push(CompletionItem { sort_text: Some(format!("2{word}")), ..item });
    }
    found
}

fn is_predefined(path: &[String]) -> bool {
    matches!(path, [only] if is_builtin(only))
}

/// What a list modifies.
pub(crate) fn modified(
    question: &mut Question<'_>,
    class: Option<ClassId>,
    path: &[String],
    chain: &[String],
) -> Option<Meaning> {
    let start = resolve(question, class, path)?;
    chain.iter().try_fold(start, |outer, name| {
        let KindClass::Class(of) = inside_of(question, &outer)? else { return None };
        question.table.quietly(|table| table.member(of, &Name::from(name.as_str()), &[]))
    })
}

/// The class whose elements something has.
pub(crate) fn inside_of(question: &mut Question<'_>, what: &Meaning) -> Option<KindClass> {
    match what {
        Meaning::Class(class) => Some(KindClass::Class(*class)),
        Meaning::Component(member) => question.table.kind_of(member).map(|kind| kind.class),
        Meaning::Type(name) => Some(KindClass::Builtin(name.clone())),
        _ => None,
    }
}

/// Values that the element of a modified class can have: literals of an enumeration, `true` and `false`.
pub(crate) fn literals(
    question: &mut Question<'_>,
    class: Option<ClassId>,
    (path, chain): (&[String], &[String]),
    name: &str,
) -> Vec<CompletionItem> {
    let value = |label: &str| plain(label, CompletionItemKind::ENUM_MEMBER, None);
    let truths = || ["true", "false"].map(value).to_vec();
    let of = modified(question, class, path, chain);
    let inside = of.and_then(|of| inside_of(question, &of));
    let is_attribute = match &inside {
        _ if is_predefined(path) => true,
        Some(KindClass::Class(class)) => question.table.builtin_of(*class).is_some(),
        Some(KindClass::Builtin(_)) => true,
        None => false,
    };
    let inside = match inside {
        Some(KindClass::Class(inside)) if !is_attribute => inside,
        _ => {
            return match name {
                "stateSelect" if is_attribute => {
                    STATE_SELECT.iter().map(|literal| value(&format!("StateSelect.{literal}"))).collect()
                }
                "fixed" if is_attribute => truths(),
                _ => Vec::new(),
            };
        }
    };
    let member = question.table.quietly(|table| table.member(inside, &Name::from(name), &[]));
    let Some(Meaning::Component(member)) = member else { return Vec::new() };
    match question.table.kind_of(&member).map(|kind| kind.class) {
        Some(KindClass::Builtin(name)) if &*name == "Boolean" => truths(),
        Some(KindClass::Class(class)) => {
            let Some((listed, literals)) = question.table.literals_of(class) else { return Vec::new() };
            let full = question.table.full_name(listed);
            literals.iter().map(|literal| value(&format!("{full}.{literal}"))).collect()
        }
        _ => Vec::new(),
    }
}

/// Elements of a modified class that can be redeclared.
pub(crate) fn replaceable(
    question: &mut Question<'_>,
    class: Option<ClassId>,
    (path, chain): (&[String], &[String]),
    wanted: Element,
) -> Vec<CompletionItem> {
    let of = modified(question, class, path, chain).and_then(|of| inside_of(question, &of));
    let Some(KindClass::Class(of)) = of else { return Vec::new() };
    let mut found = Vec::new();
    for element in question.table.elements_of(of) {
        match (element, wanted) {
            (Visible::Component(member), Element::Component) if member.component.prefixes.replaceable => {
                found.push(component_item(question, &member));
            }
            (Visible::Class(name, id), Element::Class) => {
                let (def, parent) = (question.table.class(id).def.clone(), question.table.class(id).parent);
                let around = parent.map(|parent| question.table.class(parent).def.clone());
                let is_replaceable = around.is_some_and(|around| {
                    nested_classes(&around).any(|own| own.class.name.name == name && own.prefixes.replaceable)
                });
                if is_replaceable {
                    found.push(plain(&name, class_kind(def.kind), def.description.as_deref().map(str::to_string)));
                }
            }
            _ => {}
        }
    }
    found
}
