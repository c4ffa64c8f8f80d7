//! The classes and components of a document as a tree, and those of the workspace by name.

use std::path::Path;

use hyd_instance::class::elements;
use hyd_source::Span;
use hyd_syntax::tree::{ClassBody, ClassDef, ClassKind, Component, Element, Variability};
use lsp_types::{DocumentSymbol, Location, SymbolKind, WorkspaceSymbol};

use crate::documents::Document;
use crate::lines::Lines;
use crate::session::Session;

/// Most symbols of a workspace that are listed at once.
const MOST: usize = 400;
/// Deepest nesting that is shown.
const DEEPEST: usize = 60;

/// The tree of a document.
pub(crate) fn document_symbols(session: &mut Session, document: &Document) -> Vec<DocumentSymbol> {
    let tops = session.ask_document(document, |question| {
        let tops = question.names.classes.iter().filter(|class| class.parent.is_none());
        tops.map(|class| class.def.clone()).collect::<Vec<_>>()
    });
    tops.iter().map(|def| class_symbol(session, document, def, 0)).collect()
}

fn class_symbol(session: &Session, document: &Document, def: &ClassDef, depth: usize) -> DocumentSymbol {
    let own = elements(def).iter().filter_map(|element| match element {
        Element::Class(nested) if depth < DEEPEST => Some(class_symbol(session, document, &nested.class, depth + 1)),
        Element::Component(component) => Some(component_symbol(session, document, component)),
        _ => None,
    });
    let mut children: Vec<DocumentSymbol> = own.collect();
    if let ClassBody::Enumeration(Some(literals)) = &def.body {
        let literal = |literal: &hyd_syntax::tree::EnumLiteral| {
            let (name, span) = (literal.name.name.to_string(), literal.name.span);
            symbol(session, document, (name, None, SymbolKind::ENUM_MEMBER), (span, span))
        };
        children.extend(literals.iter().map(literal));
    }
    let detail = def.description.as_deref().unwrap_or(def.kind.keyword()).to_string();
    let name = (def.name.name.to_string(), Some(detail), class_kind(def.kind));
    DocumentSymbol {
        children: (!children.is_empty()).then_some(children),
        ..symbol(session, document, name, (def.span, def.name.span))
    }
}

fn component_symbol(session: &Session, document: &Document, component: &Component) -> DocumentSymbol {
    let class: Vec<&str> = component.class.parts.iter().map(|part| &*part.name).collect();
    let name = (component.name.name.to_string(), Some(class.join(".")), component_kind(component));
    symbol(session, document, name, (component.span, component.name.span))
}

fn symbol(
    session: &Session,
    document: &Document,
    (name, detail, kind): (String, Option<String>, SymbolKind),
    (whole, own): (Span, Span),
) -> DocumentSymbol {
    // What is selected must lie in the whole, whatever the recovery of a faulty text made of it.
    let range = session.range(document, whole.to(own));
    let selection_range = session.range(document, own);
    // The protocol's type still has the field that tags replaced.
    #[allow(deprecated)]
    DocumentSymbol { name, detail, kind, tags: None, deprecated: None, range, selection_range, children: None }
}

fn class_kind(kind: ClassKind) -> SymbolKind {
    match kind {
        ClassKind::Package => SymbolKind::PACKAGE,
        ClassKind::Function | ClassKind::Operator => SymbolKind::FUNCTION,
        ClassKind::Connector => SymbolKind::INTERFACE,
        ClassKind::Record => SymbolKind::STRUCT,
        ClassKind::Type => SymbolKind::TYPE_PARAMETER,
        ClassKind::Class | ClassKind::Model | ClassKind::Block => SymbolKind::CLASS,
    }
}

fn component_kind(component: &Component) -> SymbolKind {
    match component.variability {
        Variability::Constant => SymbolKind::CONSTANT,
        Variability::Parameter => SymbolKind::PROPERTY,
        Variability::Discrete | Variability::Continuous => SymbolKind::VARIABLE,
    }
}

/// Classes and components of the workspace whose names hold the query, whatever the case; one with dots is held by the whole name.
pub(crate) fn workspace_symbols(session: &mut Session, query: &str, go_on: &dyn Fn() -> bool) -> Vec<WorkspaceSymbol> {
    let query = query.to_lowercase();
    let mut found = Vec::new();
    for path in session.workspace_files(None) {
        if found.len() >= MOST || !go_on() {
            break;
        }
        let Some(text) = session.text(&path) else { continue };
        // Nothing is parsed that cannot have the name.
        let lower = text.to_lowercase();
        if !query.split('.').all(|part| lower.contains(part)) {
            continue;
        }
        file_symbols(session, &path, &text, &query, &mut found);
    }
    found.truncate(MOST);
    found
}

fn file_symbols(
    session: &mut Session,
    path: &Path,
    text: &std::sync::Arc<str>,
    query: &str,
    found: &mut Vec<WorkspaceSymbol>,
) {
    let names = session.parsed(path, text);
    let Some(uri) = session.documents.uri(path) else { return };
    let lines = Lines::new(text);
    let within: Vec<&str> = names.within.iter().map(|part| &*part.name).collect();
    let mut push = |name: &str, around: String, kind: SymbolKind, span: Span| {
        let is_held = match query.contains('.') {
            true => format!("{around}.{name}").to_lowercase().contains(query),
            false => name.to_lowercase().contains(query),
        };
        if is_held {
            let range = lines.range(text, span, session.settings.encoding);
            found.push(WorkspaceSymbol {
                name: name.to_string(),
                kind,
                tags: None,
                container_name: (!around.is_empty()).then_some(around),
                location: lsp_types::OneOf::Left(Location { uri: uri.clone(), range }),
                data: None,
            });
        }
    };
    for (at, class) in names.classes.iter().enumerate() {
        let mut full: Vec<String> = within.iter().map(ToString::to_string).collect();
        full.extend(names.path_of(at).iter().map(ToString::to_string));
        let whole = full.join(".");
        full.pop();
        push(&class.def.name.name, full.join("."), class_kind(class.def.kind), class.def.name.span);
        for element in elements(&class.def) {
            if let Element::Component(component) = element {
                push(&component.name.name, whole.clone(), component_kind(component), component.name.span);
            }
        }
    }
}
