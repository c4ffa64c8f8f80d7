//! Questions about classes and models that are not part of a translation: what vendor annotations say, and where.
//!
//! [`annotated_classes`] goes through the libraries, [`annotated_components`] through the instances of one model; both give
//! the content of `annotation(__hyd(...))` as plain data ([`Note`]), for tools that put classes and places together;
//! [`of_instances`] lets others ask.  What the notes mean is up to those tools.

use std::collections::BTreeSet;
use std::sync::Arc;

use hyd_instance::class::{elements, nested_classes};
use hyd_instance::connection_rules::VENDOR;
use hyd_instance::instance::path;
use hyd_instance::{ClassId, ClassTable, InstId, Override, Scopes, Sources};
use hyd_source::{Diagnostic, Files, Span, dotted};
use hyd_syntax::tree::{Argument, Component, Element, Expr, ExprKind, Modification, Name, UnaryOp};

use crate::choice::choose;

/// A value in an annotation.
#[derive(Clone, PartialEq, Debug)]
pub enum Note {
    /// A number.
    Number(f64),
    /// `true` or `false`.
    Boolean(bool),
    /// A string, or a name that stands for itself.
    Text(Arc<str>),
    /// `{a, b}`
    List(Vec<Note>),
    /// `name(a = ..., b = ...)`
    Record(Vec<(Arc<str>, Note)>),
}

impl Note {
    /// The entry of a record.
    pub fn get(&self, name: &str) -> Option<&Note> {
        match self {
            Note::Record(entries) => entries.iter().find(|(key, _)| &**key == name).map(|(_, note)| note),
            _ => None,
        }
    }

    /// The value as a number.
    pub fn number(&self) -> Option<f64> {
        if let Note::Number(value) = self { Some(*value) } else { None }
    }

    /// The value as text.
    pub fn text(&self) -> Option<&str> {
        if let Note::Text(text) = self { Some(text) } else { None }
    }

    /// The texts of a list; of a single text that one.
    pub fn texts(&self) -> Vec<Arc<str>> {
        match self {
            Note::Text(text) => vec![text.clone()],
            Note::List(notes) => notes.iter().filter_map(|note| note.text().map(Arc::from)).collect(),
            _ => Vec::new(),
        }
    }

    /// The numbers of a list.
    pub fn numbers(&self) -> Vec<f64> {
        if let Note::List(notes) = self { notes.iter().filter_map(Note::number).collect() } else { Vec::new() }
    }
}

/// A class whose annotation holds notes.
#[derive(Clone, Debug)]
pub struct AnnotatedClass {
    /// Full name.
    pub name: String,
    /// Description string.
    pub description: Arc<str>,
    /// What stands in `__hyd(...)`.
    pub note: Note,
    /// Components of the class itself (not inherited) whose annotations hold notes.
    pub components: Vec<AnnotatedComponent>,
    /// File name.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: u32,
}

/// A component whose annotation holds notes.
#[derive(Clone, Debug)]
pub struct AnnotatedComponent {
    /// Instance path; for a component of a class its name.
    pub path: String,
    /// Full name of its class; empty for variables and where only a class was looked at.
    pub class: String,
    /// Description string.
    pub description: Arc<str>,
    /// What stands in `__hyd(...)`.
    pub note: Note,
    /// File name.
    pub file: Arc<str>,
    /// Line, from 1.
    pub line: u32,
}

/// All classes of the libraries whose annotation has an entry `kind`, in the order in which the libraries list them; the
/// first of a name counts.  Texts that cannot be read are left out and reported.
pub fn annotated_classes(sources: &mut dyn Sources, kind: &str) -> (Vec<AnnotatedClass>, Files, Vec<Diagnostic>) {
    let names = sources.class_names();
    let mut table = ClassTable::new(sources);
    let mut found: Vec<AnnotatedClass> = Vec::new();
    for full in names {
        let mut parts = dotted(&full).map(Name::from);
        let first = parts.next().and_then(|name| table.listed(None, &name));
        let class = parts.fold(first, |class, name| class.and_then(|class| table.listed(Some(class), &name)));
        if let Some(class) = class.or_else(|| misspelt(&mut table, &full)) {
            collect_classes(&mut table, class, kind, &mut found);
        }
    }
    (found, table.files, table.messages.into_given())
}

/// The class in a file or folder whose name differs in case and underscores only, which is how classes are looked up: what the file was
/// expected to define is not a fault then.
fn misspelt(table: &mut ClassTable<'_>, full: &str) -> Option<ClassId> {
    let names = |table: &ClassTable<'_>, class: ClassId| table.full_name(class);
    let bare = |name: &str| name.to_lowercase().replace('_', "");
    let ids: Vec<ClassId> = table.class_ids().collect();
    let class = ids.into_iter().find(|&class| {
        let name = names(table, class);
        name != full && bare(&name) == bare(full)
    })?;
    let last = dotted(full).last().unwrap_or(full);
    let expected = format!("should define `{last}` and does not");
    table.messages.withdraw(|diagnostic| diagnostic.message.ends_with(&expected));
    Some(class)
}

fn collect_classes(table: &mut ClassTable<'_>, class: ClassId, kind: &str, found: &mut Vec<AnnotatedClass>) {
    let def = table.class(class).def.clone();
    let name = table.full_name(class);
    let note = def.annotation.as_ref().and_then(vendor_note).filter(|note| note.get(kind).is_some());
    if let Some(note) = note
        && found.iter().all(|known| known.name != name)
    {
        let (file, line) = place(&table.files, def.name.span);
        let components = elements(&def).iter().filter_map(|element| match element {
            Element::Component(component) => noted(&table.files, component, component.name.name.to_string(), ""),
            _ => None,
        });
        let description = def.description.clone().unwrap_or_default();
        found.push(AnnotatedClass { name, description, note, components: components.collect(), file, line });
    }
    let nested: Vec<Name> = nested_classes(&def).map(|nested| nested.class.name.name.clone()).collect();
    for name in nested {
        if let Some(child) = table.child(class, &name) {
            collect_classes(table, child, kind, found);
        }
    }
}

/// All components of a model whose annotation has an entry `kind`, in the order of the instances.  `Err`: the messages of a
/// model that cannot be instantiated.
pub fn annotated_components(
    sources: &mut dyn Sources,
    text: (&str, &str),
    model: Option<&str>,
    kind: &str,
) -> Result<Vec<AnnotatedComponent>, (Files, Vec<Diagnostic>)> {
    of_instances(sources, text, (model, &[]), |scopes| {
        let ids = scopes.instances.tree().components.indices();
        let found = ids.filter_map(|id| component_of(scopes, id));
        found.filter(|component| component.note.get(kind).is_some()).collect()
    })
}

/// What `take` finds in the instances of a model, of which some parameters are set.
///
/// # Errors
/// The messages of a model that cannot be instantiated, with its texts.
pub fn of_instances<T>(
    sources: &mut dyn Sources,
    (name, text): (&str, &str),
    (model, set): (Option<&str>, &[(String, String)]),
    take: impl FnOnce(&mut Scopes<'_>) -> T,
) -> Result<T, (Files, Vec<Diagnostic>)> {
    let mut apart = BTreeSet::new();
    loop {
        let mut table = ClassTable::new(sources);
        let classes = table.add_main(name, text);
        let Some(class) = choose(&mut table, name, &classes, model) else {
            return Err((table.files, table.messages.into_given()));
        };
        let overrides = set.iter().map(|(path, text)| Override { path: path.clone(), text: text.clone(), used: false });
        let made = hyd_instance::instantiate_apart(table, class, overrides.collect(), apart.clone());
        let (_, mut scopes) = made.map_err(|table| {
            let ClassTable { files, messages, .. } = *table;
            (files, messages.into_given())
        })?;
        if !scopes.table.messages.has_errors() {
            return Ok(take(&mut scopes));
        }
        let known = apart.len();
        apart.extend(scopes.differing().iter().cloned());
        if apart.len() == known {
            return Err((scopes.table.files, scopes.table.messages.into_given()));
        }
    }
}

/// What the declaration of an instance notes.
fn component_of(scopes: &Scopes<'_>, id: InstId) -> Option<AnnotatedComponent> {
    let instance = &scopes.instances[id];
    let shape = scopes.instances[instance.parent?].shape.clone()?;
    let element = &shape.elements[*shape.by_name.get(scopes.declared_name(id))? as usize];
    let declared = |frame: u32, position: u32| match elements(shape.def(&scopes.table, frame)).get(position as usize) {
        Some(Element::Component(component)) if component.annotation.is_some() => Some(component.clone()),
        _ => None,
    };
    let component = declared(element.frame, element.position)
        .or_else(|| element.replaced.and_then(|(frame, position)| declared(frame, position)))?;
    let class = instance.class.map_or_else(String::new, |class| scopes.table.full_name(class));
    noted(&scopes.table.files, &component, path(&scopes.instances, id), &class)
}

fn noted(files: &Files, component: &Component, path: String, class: &str) -> Option<AnnotatedComponent> {
    let note = component.annotation.as_ref().and_then(vendor_note)?;
    let (file, line) = place(files, component.name.span);
    let description = component.description.clone().unwrap_or_default();
    Some(AnnotatedComponent { path, class: class.to_string(), description, note, file, line })
}

fn place(files: &Files, span: Span) -> (Arc<str>, u32) {
    (files.name(span.file).clone(), files.location(span).line)
}

/// The content of `__hyd(...)` in an annotation.
fn vendor_note(annotation: &Modification) -> Option<Note> {
    let Note::Record(entries) = record(annotation) else { return None };
    entries.into_iter().find(|(name, _)| &**name == VENDOR).map(|(_, note)| note)
}

fn record(modification: &Modification) -> Note {
    let entries = modification.arguments.iter().filter_map(|argument| match argument {
        Argument::Modify(entry) => {
            let name: Vec<&str> = entry.target.parts.iter().map(|part| &*part.name).collect();
            let note = match &entry.modification.binding {
                // Whoever asks for it finds that it is nothing he can use.
                Some(value) => note_of(value).unwrap_or(Note::Record(Vec::new())),
                None => record(&entry.modification),
            };
            Some((Arc::from(name.join(".")), note))
        }
        _ => None,
    });
    Note::Record(entries.collect())
}

fn note_of(expr: &Expr) -> Option<Note> {
    match &expr.kind {
        ExprKind::Integer(value) => Some(Note::Number(*value as f64)),
        ExprKind::Real(value) => Some(Note::Number(*value)),
        ExprKind::Boolean(value) => Some(Note::Boolean(*value)),
        ExprKind::Text(text) => Some(Note::Text(text.clone())),
        ExprKind::Ref(reference) => {
            let names: Vec<&str> = reference.parts.iter().map(|part| &*part.name.name).collect();
            Some(Note::Text(names.join(".").into()))
        }
        ExprKind::Unary(UnaryOp::Minus, inner) => note_of(inner)?.number().map(|value| Note::Number(-value)),
        ExprKind::Array(parts) => parts.iter().map(note_of).collect::<Option<Vec<_>>>().map(Note::List),
        _ => None,
    }
}
