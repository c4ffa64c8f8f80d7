//! Who uses a declaration, in a document or all over the workspace, and giving it another name.

use std::path::{Path, PathBuf};

use hyd_instance::meaning::Meaning;
use hyd_source::Span;
use hyd_syntax::is_keyword;
use hyd_syntax::names::Purpose;
use hyd_syntax::tokens::{Kind, tokens};
use lsp_types::{
    DocumentChangeOperation, DocumentChanges, DocumentHighlight, DocumentHighlightKind, Location, OneOf,
    OptionalVersionedTextDocumentIdentifier, Position, Range, RenameFile, ResourceOp, TextDocumentEdit, TextEdit, Uri,
    WorkspaceEdit,
};

use crate::documents::Document;
use crate::lines::Lines;
use crate::session::{Question, Session};

/// What is looked for.
struct Wanted {
    /// The name.
    name: String,
    /// The name in the declaration.
    declared: Span,
    /// The file of the declaration.
    file: String,
    /// The name at the place that was asked for.
    here: Span,
    /// It is a class at the top of its file.
    heads_file: bool,
}

/// One use.
struct Use {
    path: PathBuf,
    uri: Uri,
    range: Range,
    declares: bool,
}

fn wanted(session: &mut Session, document: &Document, byte: usize) -> Option<Wanted> {
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
        Some(Wanted { name, declared, file, here: place.ident.span, heads_file })
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

fn all_uses(session: &mut Session, wanted: &Wanted, around: &Path, go_on: &dyn Fn() -> bool) -> Option<Vec<Use>> {
    let mut files = session.workspace_files(Some(around));
    let declaring = PathBuf::from(&wanted.file);
    if !files.contains(&declaring) && declaring.is_file() {
        files.push(declaring);
    }
    let mut found = Vec::new();
    for path in files {
        if !go_on() {
            return None;
        }
        let spans = uses_in(session, &path, wanted);
        let (Some(text), Some(uri)) = (session.text(&path), session.documents.uri(&path)) else { continue };
        let lines = Lines::new(&text);
        found.extend(spans.into_iter().map(|(span, declares)| Use {
            path: path.clone(),
            uri: uri.clone(),
            range: lines.range(&text, span, session.settings.encoding),
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
    let found = all_uses(session, &wanted, &document.path, go_on).unwrap_or_default();
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

/// The name that a renaming at a place would change.  `Err`: why it cannot be.
pub(crate) fn prepare_rename(session: &mut Session, document: &Document, position: Position) -> Result<Range, String> {
    let byte = session.byte(document, position);
    let wanted = wanted(session, document, byte).ok_or("nothing that is declared stands here")?;
    match session.is_own(&wanted.file) {
        true => Ok(session.range(document, wanted.here)),
        false => Err(format!("`{}` is declared in a library outside of the workspace", wanted.name)),
    }
}

/// The changes that give what stands at a place another name.  `files_too`: a file that is named after its class is renamed with it.
pub(crate) fn rename(
    session: &mut Session,
    document: &Document,
    (position, new_name, files_too): (Position, &str, bool),
    go_on: &dyn Fn() -> bool,
) -> Result<WorkspaceEdit, String> {
    prepare_rename(session, document, position)?;
    let new_name = new_name.trim();
    let words: Vec<_> = tokens(new_name).collect();
    match &words[..] {
        [word] if word.kind == Kind::Word && word.text.len() == new_name.len() && !is_keyword(word.text) => {}
        _ => return Err(format!("`{new_name}` is not a name")),
    }
    let byte = session.byte(document, position);
    let wanted = wanted(session, document, byte).ok_or("nothing that is declared stands here")?;
    if let Some(what) = session.ask_document(document, |question| in_the_way(question, byte, new_name)) {
        return Err(what);
    }
    let found = all_uses(session, &wanted, &document.path, go_on).ok_or("the renaming was given up")?;
    if let Some(outside) = found.iter().find(|found| !session.is_own(&found.path.display().to_string())) {
        return Err(format!("`{}` is used outside of the workspace, in `{}`", wanted.name, outside.path.display()));
    }
    let mut operations: Vec<DocumentChangeOperation> = Vec::new();
    let mut last: Option<PathBuf> = None;
    for found in &found {
        if last.as_ref() != Some(&found.path) {
            let version = session.documents.get(&found.uri).map(|document| document.version);
            let text_document = OptionalVersionedTextDocumentIdentifier { uri: found.uri.clone(), version };
            operations.push(DocumentChangeOperation::Edit(TextDocumentEdit { text_document, edits: Vec::new() }));
            last = Some(found.path.clone());
        }
        if let Some(DocumentChangeOperation::Edit(edit)) = operations.last_mut() {
            edit.edits.push(OneOf::Left(TextEdit { range: found.range, new_text: new_name.to_string() }));
        }
    }
    if wanted.heads_file
        && let Some((from, to)) = renamed_file(&wanted, new_name)
    {
        if !files_too {
            let shown = from.display();
            return Err(format!("`{shown}` is named after its class, and this editor cannot rename files"));
        }
        if to.exists() {
            return Err(format!("there is a file `{}` already", to.display()));
        }
        if let (Some(old_uri), Some(new_uri)) = (session.documents.uri(&from), crate::documents::uri_of(&to)) {
            let rename = RenameFile { old_uri, new_uri, options: None, annotation_id: None };
            operations.push(DocumentChangeOperation::Op(ResourceOp::Rename(rename)));
        }
    }
    Ok(WorkspaceEdit { document_changes: Some(DocumentChanges::Operations(operations)), ..WorkspaceEdit::default() })
}

/// The file, or for a package its folder, that has the name of the class.
fn renamed_file(wanted: &Wanted, new_name: &str) -> Option<(PathBuf, PathBuf)> {
    let file = PathBuf::from(&wanted.file);
    let (stem, extension) = (file.file_stem()?.to_str()?, file.extension()?.to_str()?);
    if stem.eq_ignore_ascii_case(&wanted.name) {
        return Some((file.clone(), file.with_file_name(format!("{new_name}.{extension}"))));
    }
    let folder = file.parent().filter(|_| stem.eq_ignore_ascii_case("package"))?;
    let is_named = folder.file_name()?.to_str()?.eq_ignore_ascii_case(&wanted.name);
    is_named.then(|| (folder.to_path_buf(), folder.with_file_name(new_name)))
}

/// What has the new name already where the old one is declared.
fn in_the_way(question: &mut Question<'_>, byte: usize, new_name: &str) -> Option<String> {
    let place = question.place(byte)?;
    let ids = question.ids.clone();
    let (name, class) = match question.table.meaning(&place, &ids)? {
        Meaning::Component(member) => (hyd_syntax::tree::Name::from(new_name), member.owner),
        Meaning::Class(class) => (new_name.into(), question.table.class(class).parent?),
        Meaning::Iterator(_) if !matches!(place.purpose, Purpose::Class(_)) => {
            (new_name.into(), place.class.and_then(|at| ids.get(at).copied().flatten())?)
        }
        _ => return None,
    };
    let table = &mut question.table;
    let taken =
        table.quietly(|table| table.member(class, &name, &[]).is_some() || table.member_class(class, &name).is_some());
    taken.then(|| format!("`{}` has an element `{new_name}` already", question.table.full_name(class)))
}
