//! Which class of a text is meant: the one that is named, else its last complete model.

use hyd_instance::class::nested_classes;
use hyd_instance::{ClassId, ClassTable};
use hyd_source::{Code, Diagnostic, did_you_mean, dotted};
use hyd_syntax::tree::{ClassDef, ClassKind, Name};

/// The class to instantiate: the one named, else the last complete model of the text.
pub(crate) fn choose(
    table: &mut ClassTable<'_>,
    file: &str,
    classes: &[ClassId],
    wanted: Option<&str>,
) -> Option<ClassId> {
    match wanted {
        Some(name) => find(table, classes, name),
        None => {
            let found = classes.iter().rev().find_map(|&class| last_model(table, class));
            if found.is_none() {
                let (message, help) = match classes {
                    [] => (format!("`{file}` holds no model: it is empty"), None),
                    _ => (
                        format!("`{file}` holds no complete model, only packages, functions or partial classes"),
                        Some("`--model` takes a model from a library".to_string()),
                    ),
                };
                table.report(Diagnostic::error(Code::UnknownClass, message).maybe_help(help));
            }
            found
        }
    }
}

fn complete_model(def: &ClassDef) -> bool {
    matches!(def.kind, ClassKind::Model | ClassKind::Block | ClassKind::Class) && !def.partial
}

/// The last complete model in a class of the text: itself, or for packages the last inside.
fn last_model(table: &mut ClassTable<'_>, class: ClassId) -> Option<ClassId> {
    let def = table.class(class).def.clone();
    if complete_model(&def) {
        return Some(class);
    }
    if def.kind != ClassKind::Package {
        return None;
    }
    let names: Vec<Name> = nested_classes(&def).map(|n| n.class.name.name.clone()).collect();
    names.iter().rev().find_map(|name| {
        let child = table.child(class, name)?;
        last_model(table, child)
    })
}

/// A class by its name in the text or its full name.
fn find(table: &mut ClassTable<'_>, classes: &[ClassId], name: &str) -> Option<ClassId> {
    let parts: Vec<Name> = dotted(name).map(Name::from).collect();
    let mut found = classes.iter().copied().find(|&class| table.class(class).def.name.name == parts[0]);
    if found.is_none() {
        found = table.top(&parts[0]);
    }
    let mut current = found;
    for part in &parts[1..] {
        current = current.and_then(|class| table.member_class(class, part));
    }
    if current.is_none() {
        let mut names: Vec<String> = Vec::new();
        for &class in classes {
            let own = table.class(class).def.name.name.to_string();
            names.extend(table.child_names(class).iter().map(|child| format!("{own}.{child}")));
            names.push(own);
        }
        let mut help = did_you_mean(name, names.iter().map(String::as_str));
        if help.is_none() {
            // Perhaps only the package before the name is missing.
            let last = |full: &'_ String| dotted(full).last().unwrap_or_default().to_string();
            let ends: Vec<String> = names.iter().map(last).collect();
            let close = did_you_mean(name, ends.iter().map(String::as_str));
            let full = names
                .iter()
                .zip(&ends)
                .find(|(_, end)| close.as_ref().is_some_and(|c| c.contains(&format!("`{end}`"))));
            help = full.map(|(full, _)| format!("did you mean `{full}`?"));
        }
        let message = format!("there is no class `{name}` in the text or the libraries");
        table.report(Diagnostic::error(Code::UnknownClass, message).maybe_help(help));
    }
    current
}
