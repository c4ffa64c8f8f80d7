//! Who uses a declaration, in a document or all over the workspace.

use std::path::{Path, PathBuf};

use hyd_instance::meaning::Meaning;
use hyd_source::Span;
use lsp_types::{DocumentHighlight, DocumentHighlightKind, Location, Position, Range, Uri};

use crate::documents::Document;
use crate::lines::Lines;
use crate::session::{Question, Session};

/// What is looked for.
pub(crate) struct Wanted {
    /// The name.
    pub(crate) name: String,
    /// The name in the declaration.
    pub(crate) declared: Span,
    /// The file of the declaration.
    pub(crate) file: String,
    /// The name at the place that was asked for.
    pub(crate) here: Span,
    /// It is a class at the top of its file.
    pub(crate) heads_file: bool,
    /// It is a class.
    pub(crate) is_class: bool,
}

/// One use.
pub(crate) struct Use {
    /// The file.
    pub(crate) path: PathBuf,
    /// Its address.
    pub(crate) uri: Uri,
    /// The name.
    pub(crate) range: Range,
    /// The same in the text of the file.
    pub(crate) span: Span,
    declares: bool,
}

/// What stands at a byte of a document, if it is declared somewhere.
pub(crate) fn wanted(session: &mut Session, document: &Document, byte: usize) -> Option<Wanted> {
    session.ask_document(document, |question| {
        let place = question.place(byte)?;
        let ids = question.ids.clone();
        let meaning = question.table.meaning(&place, &ids)?;
        let declared = question.table.declared(&meaning)?;
        let files = &question.table.files;
        let name = files.snippet(declared).to_string();
        // A name of an import stands for what is imported, but is not its name.
        if *place.ident.name != *name {
            return None;
        }
        let heads_file = match &meaning {
            Meaning::Class(class) => {
                let file = |id| question.table.class(id).def.name.span.file;
                let own = question.table.class(*class);
                own.parent.is_none_or(|parent| file(parent) != declared.file)
            }
            _ => false,
        };
        let file = files.name(declared.file).to_string();
        let is_class = matches!(meaning, Meaning::Class(_));
        Some(Wanted { name, declared, file, here: place.ident.span, heads_file, is_class })
    })
}

/// The uses in one text.
fn uses_in(session: &mut Session, path: &Path, wanted: &Wanted) -> Vec<(Span, bool)> {
    let Some(text) = session.text(path) else { return Vec::new() };
    if !text.contains(&wanted.name) {
        return Vec::new();
    }
    session.ask(path, &text, |question| uses(question, wanted))
}

fn uses(question: &mut Question<'_>, wanted: &Wanted) -> Vec<(Span, bool)> {
    let ids = question.ids.clone();
    let places = std::mem::take(&mut question.names.places);
    let named = places.iter().filter(|place| *place.ident.name == *wanted.name);
    let mut found: Vec<(Span, bool)> = named
        .filter_map(|place| {
            let meaning = question.table.meaning(place, &ids)?;
            let declared = question.table.declared(&meaning)?;
            let declares = place.ident.span == wanted.declared;
            (declared == wanted.declared).then_some((place.ident.span, declares))
        })
        .collect();
    found.sort();
    found.dedup();
    found
}

/// The files that may use what is wanted: those around a file, and the one that declares it.
pub(crate) fn files_to_search(session: &Session, wanted: &Wanted, around: &Path) -> Vec<PathBuf> {
    let mut files = session.workspace_files(Some(around));
    let declaring = PathBuf::from(&wanted.file);
    if !files.contains(&declaring) && declaring.is_file() {
        files.push(declaring);
    }
    files
}

/// The uses in some files; none where it was given up.
pub(crate) fn all_uses(
    session: &mut Session,
    wanted: &Wanted,
    files: &[PathBuf],
    go_on: &dyn Fn() -> bool,
) -> Option<Vec<Use>> {
    let mut found = Vec::new();
    for path in files {
        if !go_on() {
            return None;
        }
        let spans = uses_in(session, path, wanted);
        let (Some(text), Some(uri)) = (session.text(path), session.documents.uri(path)) else { continue };
        let lines = Lines::new(&text);
        found.extend(spans.into_iter().map(|(span, declares)| Use {
            path: path.clone(),
            uri: uri.clone(),
            range: lines.range(&text, span, session.settings.encoding),
            span,
            declares,
        }));
    }
    Some(found)
}

/// All uses of what stands at a place.
pub(crate) fn references(
    session: &mut Session,
    document: &Document,
    (position, with_declaration): (Position, bool),
    go_on: &dyn Fn() -> bool,
) -> Vec<Location> {
    let byte = session.byte(document, position);
    let Some(wanted) = wanted(session, document, byte) else { return Vec::new() };
    let files = files_to_search(session, &wanted, &document.path);
    let found = all_uses(session, &wanted, &files, go_on).unwrap_or_default();
    let kept = found.into_iter().filter(|found| with_declaration || !found.declares);
    kept.map(|found| Location { uri: found.uri, range: found.range }).collect()
}

/// The uses in the document itself.
pub(crate) fn highlights(session: &mut Session, document: &Document, position: Position) -> Vec<DocumentHighlight> {
    let byte = session.byte(document, position);
    let Some(wanted) = wanted(session, document, byte) else { return Vec::new() };
    let spans = uses_in(session, &document.path, &wanted);
    let kind = |declares| if declares { DocumentHighlightKind::WRITE } else { DocumentHighlightKind::READ };
    let one = |(span, declares)| DocumentHighlight { range: session.range(document, span), kind: Some(kind(declares)) };
    spans.into_iter().map(one).collect()
}
