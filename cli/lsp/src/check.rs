//! What is wrong with a document: its classes translated one after the other, the one that is being edited first.
//!
//! Complete models are translated as `hyd check` does, with units, balance and structure.  Packages, functions, connectors, records and
//! partial classes cannot be translated by themselves: of them it is known whether their bases and the types of their components exist.
//! Where the text is not understood, only that is said.

use std::collections::HashSet;
use std::path::PathBuf;

use hyd_compiler::Compilation;
use hyd_instance::class::elements;
use hyd_instance::shape::is_builtin;
use hyd_source::{Diagnostic, Files, Severity};
use hyd_syntax::names::Names;
use hyd_syntax::tree::{ClassKind, Element};

use lsp_types::{Range, Uri};

use crate::diagnostics::{Item, item};
use crate::documents::Document;
use crate::hints::{Fact, facts};
use crate::session::{Question, Session};

/// What a check found.
#[derive(Clone, Debug)]
pub(crate) struct Checked {
    /// The address of the document.
    pub(crate) uri: Uri,
    /// The file.
    pub(crate) path: PathBuf,
    /// The state of the document.
    pub(crate) version: i32,
    /// Messages with the changes that they propose, in the order of the text.
    pub(crate) items: Vec<Item>,
    /// The lines of the text.
    pub(crate) lines: u32,
    /// What is known of variables and equations of the document.
    pub(crate) facts: Vec<Fact>,
}

/// How a check goes on.
pub(crate) struct Watch<'w> {
    /// The byte of the last change.
    pub(crate) changed: Option<usize>,
    /// False when nobody waits for the rest any more.
    pub(crate) go_on: &'w dyn Fn() -> bool,
    /// Takes what is known of the class that is edited, while the others are still to come.
    pub(crate) first: &'w mut dyn FnMut(Checked, &str),
}

/// Checks a document.  None where it was given up.
pub(crate) fn check(session: &mut Session, document: &Document, watch: &mut Watch<'_>) -> Option<Checked> {
    let (said, names, files) = session.ask_document(document, |question| {
        check_shapes(question);
        let said: Vec<Diagnostic> = question.table.messages.iter().cloned().collect();
        (said, std::mem::take(&mut question.names), question.table.files.clone())
    });
    let name = document.path.display().to_string();
    let mut gathered = Gathered { seen: HashSet::new(), items: Vec::new() };
    let broken = said.iter().any(|own| own.severity == Severity::Error && own.code.is_syntax());
    let place = names.classes.first().map(|class| class.def.name.span);
    gathered.add((session, document), &files, said, (place, None));
    let mut known = Vec::new();
    let models = if broken { Vec::new() } else { models(&names, watch.changed) };
    for (k, &class) in models.iter().enumerate() {
        if !(watch.go_on)() {
            return None;
        }
        let path = names.path_of(class).join(".");
        let mut compilation = session.compile(&document.path, &document.text, &path);
        compilation.forgive_open_ends();
        let Compilation { files, diagnostics, .. } = &compilation;
        let place = Some(names.classes[class].def.name.span);
        gathered.add((session, document), files, diagnostics.clone(), (place, Some(&path)));
        known.extend(facts(&compilation, &name, &names, names.classes[class].def.span));
        if k == 0 && models.len() > 1 {
            (watch.first)(Checked { facts: known.clone(), ..gathered.checked(document) }, &path);
        }
    }
    (watch.go_on)().then(|| Checked { facts: known, ..gathered.checked(document) })
}

struct Gathered {
    /// Messages by what they say, since classes of one file say many of them again.
    seen: HashSet<String>,
    items: Vec<Item>,
}

impl Gathered {
    fn add(
        &mut self,
        (session, document): (&Session, &Document),
        files: &Files,
        said: Vec<Diagnostic>,
        (place, of): (Option<hyd_source::Span>, Option<&str>),
    ) {
        for diagnostic in said {
            if self.seen.insert(format!("{:?} {} {:?}", diagnostic.code, diagnostic.message, diagnostic.labels)) {
                let item = item(session, document, files, &diagnostic, place);
                self.items.push(Item { of: of.map(str::to_string), ..item });
            }
        }
    }

    fn checked(&self, document: &Document) -> Checked {
        let mut items = self.items.clone();
        items.sort_by_key(|item| (item.diagnostic.range.start, item.diagnostic.range.end));
        Checked {
            uri: document.uri.clone(),
            path: document.path.clone(),
            version: document.version,
            items,
            lines: document.lines.count(),
            facts: Vec::new(),
        }
    }
}

impl Checked {
    /// What is known of one class, with what was known before of all others: moved with the lines that a change at `line` has put in or
    /// taken out.
    pub(crate) fn with_others(mut self, before: &Checked, class: &str, line: u32) -> Self {
        let moved = i64::from(self.lines) - i64::from(before.lines);
        let others = before.items.iter().filter(|item| item.of.as_deref().is_some_and(|of| of != class));
        for item in others {
            let mut item = item.clone();
            let Range { start, end } = &mut item.diagnostic.range;
            if start.line > line {
                let shift = |at: u32| u32::try_from(i64::from(at) + moved).unwrap_or_default();
                (start.line, end.line) = (shift(start.line), shift(end.line));
            }
            // Its changes stand where they stood.
            item.fixes.clear();
            self.items.push(item);
        }
        self.items.sort_by_key(|item| (item.diagnostic.range.start, item.diagnostic.range.end));
        self
    }
}

/// The classes that are translated: complete models of the text and of its packages, the one around the last change first.
fn models(names: &Names, changed: Option<usize>) -> Vec<usize> {
    let in_packages = |mut class: usize| {
        while let Some(parent) = names.classes[class].parent {
            if names.classes[parent].def.kind != ClassKind::Package {
                return false;
            }
            class = parent;
        }
        true
    };
    let is_model = |&class: &usize| {
        let def = &names.classes[class].def;
        !def.partial && matches!(def.kind, ClassKind::Model | ClassKind::Block | ClassKind::Class) && in_packages(class)
    };
    let mut found: Vec<usize> = (0..names.classes.len()).filter(is_model).collect();
    if let Some(byte) = changed.map(|byte| byte as u32) {
        let around = |&class: &usize| {
            let span = names.classes[class].def.span;
            !(span.start <= byte && byte <= span.end)
        };
        found.sort_by_key(around);
    }
    found
}

/// Looks up the bases of all classes that are not translated, and the types of their components.
fn check_shapes(question: &mut Question<'_>) {
    let translated: HashSet<usize> = models(&question.names, None).into_iter().collect();
    let ids = question.ids.clone();
    for (at, id) in ids.iter().enumerate().filter(|(at, _)| !translated.contains(at)) {
        let Some(id) = *id else { continue };
        if question.table.shape(id).is_err() {
            continue;
        }
        let def = question.names.classes[at].def.clone();
        for element in elements(&def) {
            if let Element::Component(component) = element
                && !(component.class.parts.len() == 1 && is_builtin(&component.class.parts[0].name))
            {
                // What is said of it stands among the messages.
                let _ = question.table.find_class_static(id, &component.class, false);
            }
        }
    }
}
