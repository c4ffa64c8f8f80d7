//! Giving what is declared another name, all over the workspace.
//!
//! A new name must change what nothing means: the texts with it are asked for every name in them, and must tell what the texts as they are
//! tell.  A class at the top of its file is renamed with the file, which no text beside the disk can show; of it the new name must
//! mean nothing yet where the old one is used.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hyd_instance::Builtin;
use hyd_instance::meaning::Meaning;
use hyd_instance::shape::is_builtin;
use hyd_syntax::is_keyword;
use hyd_syntax::names::{Place, Purpose};
use hyd_syntax::tokens::{Kind, tokens};
use hyd_syntax::tree::{Ident, Name};
use lsp_types::{
    DocumentChangeOperation, DocumentChanges, OneOf, OptionalVersionedTextDocumentIdentifier, Position, Range,
    RenameFile, ResourceOp, TextDocumentEdit, TextEdit, WorkspaceEdit,
};

use crate::documents::{Document, uri_of};
use crate::references::{Use, Wanted, all_uses, files_to_search, wanted};
use crate::session::{Question, Session};

/// Why something was not renamed.
const GIVEN_UP: &str = "the renaming was given up";

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
    let byte = session.byte(document, position);
    let wanted = wanted(session, document, byte).ok_or("nothing that is declared stands here")?;
    if wanted.name == new_name {
        return Ok(WorkspaceEdit::default());
    }
    session.ask_document(document, |question| {
        check_name(question, &wanted, new_name)?;
        in_the_way(question, byte, new_name).map_or(Ok(()), Err)
    })?;
    let files = files_to_search(session, &wanted, &document.path);
    let found = all_uses(session, &wanted, &files, go_on).ok_or(GIVEN_UP)?;
    if let Some(outside) = found.iter().find(|found| !session.is_own(&found.path.display().to_string())) {
        return Err(format!("`{}` is used outside of the workspace, in `{}`", wanted.name, outside.path.display()));
    }
    let concerned = |path: &PathBuf| {
        let text = session.text(path);
        text.is_some_and(|text| text.contains(new_name) || text.contains(&wanted.name))
    };
    let concerned: Vec<PathBuf> = files.into_iter().filter(concerned).collect();
    let renamed = if wanted.heads_file { renamed_file(&wanted, new_name) } else { None };
    for path in &concerned {
        check_heirs(session, path, &wanted, new_name)?;
        if renamed.is_some() {
            check_free(session, path, &wanted, new_name)?;
        }
    }
    if renamed.is_none() {
        check_meanings(session, &concerned, &found, (&wanted, new_name), go_on)?;
    }
    let mut operations = edits(session, &found, new_name);
    if let Some((from, to)) = renamed {
        if !files_too {
            let shown = from.display();
            return Err(format!("`{shown}` is named after its class, and this editor cannot rename files"));
        }
        if to.exists() {
            return Err(format!("there is a file `{}` already", to.display()));
        }
        if let (Some(old_uri), Some(new_uri)) = (session.documents.uri(&from), uri_of(&to)) {
            let rename = RenameFile { old_uri, new_uri, options: None, annotation_id: None };
            operations.push(DocumentChangeOperation::Op(ResourceOp::Rename(rename)));
        }
    }
    Ok(WorkspaceEdit { document_changes: Some(DocumentChanges::Operations(operations)), ..WorkspaceEdit::default() })
}

fn edits(session: &Session, found: &[Use], new_name: &str) -> Vec<DocumentChangeOperation> {
    let mut operations: Vec<DocumentChangeOperation> = Vec::new();
    let mut last: Option<&Path> = None;
    for found in found {
        if last != Some(&found.path) {
            let version = session.documents.get(&found.uri).map(|document| document.version);
            let text_document = OptionalVersionedTextDocumentIdentifier { uri: found.uri.clone(), version };
            operations.push(DocumentChangeOperation::Edit(TextDocumentEdit { text_document, edits: Vec::new() }));
            last = Some(&found.path);
        }
        if let Some(DocumentChangeOperation::Edit(edit)) = operations.last_mut() {
            edit.edits.push(OneOf::Left(TextEdit { range: found.range, new_text: new_name.to_string() }));
        }
    }
    operations
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

/// Whether a word can name anything of the kind at all.
fn check_name(question: &mut Question<'_>, wanted: &Wanted, new_name: &str) -> Result<(), String> {
    let words: Vec<_> = tokens(new_name).collect();
    match &words[..] {
        [word] if word.kind == Kind::Word && word.text.len() == new_name.len() && !is_keyword(word.text) => {}
        _ => return Err(format!("`{new_name}` is not a name")),
    }
    if is_builtin(new_name) {
        return Err(format!("`{new_name}` is a predefined type"));
    }
    if new_name == "time" {
        return Err("`time` is the independent variable".into());
    }
    if wanted.is_class {
        let name = Name::from(new_name);
        if Builtin::from_name(new_name).is_some() {
            return Err(format!("`{new_name}` is a function of the language"));
        }
        if question.table.quietly(|table| table.top(&name)).is_some() {
            return Err(format!("`{new_name}` is the name of a library, or of a class at the top of a file, already"));
        }
    }
    Ok(())
}

/// What has the new name already where the old one is declared.
fn in_the_way(question: &mut Question<'_>, byte: usize, new_name: &str) -> Option<String> {
    let place = question.place(byte)?;
    let ids = question.ids.clone();
    let (name, class) = match question.table.meaning(&place, &ids)? {
        Meaning::Component(member) => (Name::from(new_name), member.owner),
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

/// No class that inherits what is renamed may have an element of the new name.
fn check_heirs(session: &mut Session, path: &Path, wanted: &Wanted, new_name: &str) -> Result<(), String> {
    let Some(text) = session.text(path).filter(|text| text.contains(new_name)) else { return Ok(()) };
    session.ask(path, &text, |question| {
        let (old, new) = (Name::from(&*wanted.name), Name::from(new_name));
        for class in question.ids.clone().into_iter().flatten() {
            let table = &mut question.table;
            let inherits = table.quietly(|table| {
                let inherited = match wanted.is_class {
                    true => table.member_class(class, &old).map(Meaning::Class),
                    false => table.member(class, &old, &[]),
                };
                inherited.and_then(|meaning| table.declared(&meaning)) == Some(wanted.declared)
            });
            let has = |table: &mut hyd_instance::ClassTable<'_>| {
                table.member(class, &new, &[]).is_some() || table.member_class(class, &new).is_some()
            };
            if inherits && table.quietly(has) {
                let name = table.full_name(class);
                return Err(format!("`{name}` inherits `{old}` and has an element `{new_name}` already"));
            }
        }
        Ok(())
    })
}

/// The new name means nothing yet where the old one is used, and the old one not what is renamed where the new one is.
fn check_free(session: &mut Session, path: &Path, wanted: &Wanted, new_name: &str) -> Result<(), String> {
    let Some(text) = session.text(path) else { return Ok(()) };
    session.ask(path, &text, |question| {
        let ids = question.ids.clone();
        let places = std::mem::take(&mut question.names.places);
        for place in &places {
            let is_old = *place.ident.name == *wanted.name;
            if !is_old && *place.ident.name != *new_name {
                continue;
            }
            let other = if is_old { new_name } else { &wanted.name };
            let (here, there) = (place.clone(), with_name(place, other));
            let old = question.table.meaning(if is_old { &here } else { &there }, &ids);
            if old.and_then(|old| question.table.declared(&old)) != Some(wanted.declared) {
                continue;
            }
            let declares = matches!(place.purpose, Purpose::DeclaresClass | Purpose::EndsClass);
            let new = question.table.meaning(if is_old { &there } else { &here }, &ids).filter(|_| !declares);
            if let Some(new) = new {
                return Err(clash(question, place, new_name, &told(question, &new)));
            }
        }
        Ok(())
    })
}

/// A place with another name in it.
fn with_name(place: &Place, name: &str) -> Place {
    let mut place = place.clone();
    let name = Name::from(name);
    place.ident.name = name.clone();
    match &mut place.purpose {
        Purpose::Class(part) => {
            let mut path = (*part.path).clone();
            if let Some(own) = path.parts.get_mut(part.at) {
                own.name = name;
            }
            part.path = Arc::new(path);
        }
        Purpose::Reference(part) => {
            let at = part.at;
            part.parts = renamed(&part.parts, at, name);
        }
        Purpose::Modifier(modifier) => {
            let last = modifier.chain.len().saturating_sub(1);
            modifier.chain = renamed(&modifier.chain, last, name);
        }
        _ => {}
    }
    place
}

fn renamed(parts: &[Ident], at: usize, name: Name) -> Arc<[Ident]> {
    let mut parts = parts.to_vec();
    if let Some(own) = parts.get_mut(at) {
        own.name = name;
    }
    parts.into()
}

/// What a name of a text tells: the place of its declaration, in the text as it will be, or what it is.
type Sense = Option<(String, usize)>;

/// A name with its line, what it tells, and the same in words.
struct Told {
    name: Name,
    line: u32,
    sense: Sense,
    words: String,
}

/// Every name of the texts with the new name in them must mean what it means now.
fn check_meanings(
    session: &mut Session,
    files: &[PathBuf],
    found: &[Use],
    (wanted, new_name): (&Wanted, &str),
    go_on: &dyn Fn() -> bool,
) -> Result<(), String> {
    let mut starts: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for one in found {
        starts.entry(one.path.display().to_string()).or_default().push(one.span.start as usize);
    }
    let grown = new_name.len() as isize - wanted.name.len() as isize;
    let moved = |file: &str, at: usize| {
        let before = starts.get(file).map_or(0, |starts| starts.iter().filter(|&&start| start < at).count());
        at.saturating_add_signed(grown * before as isize)
    };
    let names = [wanted.name.as_str(), new_name];
    let mut now = Vec::new();
    for path in files {
        if !go_on() {
            return Err(GIVEN_UP.into());
        }
        now.push(senses(session, path, names, &moved));
    }
    let kept = session.documents.clone();
    for path in files {
        let (Some(text), Some(uri)) = (session.text(path), session.documents.uri(path)) else { continue };
        let Some(starts) = starts.get(&path.display().to_string()) else { continue };
        let mut text = text.to_string();
        for &start in starts.iter().rev() {
            text.replace_range(start..start + wanted.name.len(), new_name);
        }
        session.documents.put(Document::new(uri, 0, text));
    }
    let compared = files.iter().zip(&now).try_for_each(|(path, now)| {
        if !go_on() {
            return Err(GIVEN_UP.to_string());
        }
        let then = senses(session, path, names, &|_, at| at);
        compare(path, now, &then, (wanted, new_name))
    });
    session.documents = kept;
    compared
}

fn compare(path: &Path, now: &[Told], then: &[Told], (wanted, new_name): (&Wanted, &str)) -> Result<(), String> {
    if now.len() != then.len() {
        return Err(format!("`{}` would be read differently with the name `{new_name}`", path.display()));
    }
    let other = now.iter().zip(then).find(|(now, then)| now.sense.is_some() && now.sense != then.sense);
    let Some((now, then)) = other else { return Ok(()) };
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let line = now.line;
    let words = match &then.sense {
        None => "nothing",
        Some(_) => &*then.words,
    };
    Err(match *now.name == *wanted.name && *then.name == *new_name {
        true => format!("`{new_name}` means {words} where `{}` is used ({file}:{line})", wanted.name),
        false => format!("`{}` ({file}:{line}) means {} and would mean {words}", now.name, now.words),
    })
}

/// What the names of a text tell that are one of `names` or stand behind one of them; `moved`: where a place of a file will be.
fn senses(session: &mut Session, path: &Path, names: [&str; 2], moved: &dyn Fn(&str, usize) -> usize) -> Vec<Told> {
    let Some(text) = session.text(path) else { return Vec::new() };
    session.ask(path, &text, |question| {
        let ids = question.ids.clone();
        let mut places = std::mem::take(&mut question.names.places);
        places.retain(|place| concerns(place, names));
        let tell = |place: &Place| {
            let meaning = question.table.meaning(place, &ids);
            let words = meaning.as_ref().map_or_else(String::new, |meaning| told(question, meaning));
            let sense = meaning.map(|meaning| match question.table.declared(&meaning) {
                Some(span) => {
                    let file = question.table.files.name(span.file).to_string();
                    let at = moved(&file, span.start as usize);
                    (file, at)
                }
                None => (words.clone(), 0),
            });
            let line = question.table.files.location(place.ident.span).line;
            Told { name: place.ident.name.clone(), line, sense, words }
        };
        places.iter().map(tell).collect()
    })
}

/// True where a name or what leads to it is one of these: nothing else can change its meaning.
fn concerns(place: &Place, names: [&str; 2]) -> bool {
    let is_one = |ident: &Ident| names.contains(&&*ident.name);
    is_one(&place.ident)
        || match &place.purpose {
            Purpose::Class(part) => part.path.parts.iter().take(part.at).any(is_one),
            Purpose::Reference(part) => part.parts.iter().take(part.at).any(is_one),
            Purpose::Modifier(modifier) => modifier.of.path.parts.iter().chain(&*modifier.chain).any(is_one),
            Purpose::Argument { function } => function.parts.iter().any(is_one),
            _ => false,
        }
}

fn clash(question: &Question<'_>, place: &Place, new_name: &str, words: &str) -> String {
    let files = &question.table.files;
    let name = files.name(place.ident.span.file);
    let file = name.rsplit(['/', '\\']).next().unwrap_or(name);
    format!("`{new_name}` means {words} at {file}:{}", files.location(place.ident.span).line)
}

/// What a name means, in a few words.
fn told(question: &Question<'_>, meaning: &Meaning) -> String {
    let table = &question.table;
    match meaning {
        Meaning::Class(class) => {
            format!("the {} `{}`", table.class(*class).def.kind.keyword(), table.full_name(*class))
        }
        Meaning::Component(member) => {
            format!("the component `{}` of `{}`", member.component.name.name, table.full_name(member.owner))
        }
        Meaning::Literal { class, .. } => format!("a literal of `{}`", table.full_name(*class)),
        Meaning::Iterator(_) => "a loop variable".into(),
        Meaning::Type(name) => format!("the predefined type `{name}`"),
        Meaning::Attribute { name, of } => format!("the attribute `{name}` of {of}"),
        Meaning::Builtin(builtin) => format!("the function `{}` of the language", builtin.name()),
        Meaning::Time => "the independent variable".into(),
    }
}
