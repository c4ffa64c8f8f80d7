//! What one thread works with: the documents as they were handed to it, the settings, and syntax trees kept from question to question.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use hyd_compiler::{Compilation, Extras, Goal, Options, compile_over};
use hyd_instance::{ClassId, ClassTable, Trees};
use hyd_run::read_text;
use hyd_source::{Code, Files, Span};
use hyd_syntax::names::{Names, Place, names};
use hyd_syntax::print_expr;
use hyd_syntax::tree::Expr;
use hyd_verbs::LibraryPath;
use hyd_verbs::library::built_in_texts;
use lsp_types::{Location, Position, Range, Uri};

use crate::documents::{Document, Documents};
use crate::lines::{Encoding, Lines};

/// What stands before the names of texts of the built-in library.
const BUILT_IN: &str = "<built-in>/";
/// Most files of a workspace that are looked through.
const MOST_FILES: usize = 20_000;
/// Deepest folder of a workspace.
const DEEPEST: usize = 24;

/// What the client and the command line say.
#[derive(Clone, Debug, Default)]
pub(crate) struct Settings {
    /// Folders with libraries, or libraries.
    pub(crate) libraries: Vec<PathBuf>,
    /// Folders that are open in the editor.
    pub(crate) folders: Vec<PathBuf>,
    /// Models may name data files elsewhere.
    pub(crate) allow_outside: bool,
    /// Units that do not fit are errors in libraries, too.
    pub(crate) strict_units: bool,
    /// Columns of positions.
    pub(crate) encoding: Encoding,
    /// Where texts of the built-in library are laid down for editors to open.
    pub(crate) built_in: PathBuf,
}

/// One thread's view of everything.
pub(crate) struct Session {
    /// The settings.
    pub(crate) settings: Arc<Settings>,
    /// The open documents.
    pub(crate) documents: Documents,
    trees: Trees,
    /// Pages on codes that have been laid down.
    pages: RefCell<BTreeMap<Code, Option<Uri>>>,
}

/// A text with its classes, and all that can be asked of them.
pub(crate) struct Question<'q> {
    /// The classes.
    pub(crate) table: ClassTable<'q>,
    /// The names of the text.
    pub(crate) names: Names,
    /// The classes of the text, in the order of [`Names::classes`].
    pub(crate) ids: Vec<Option<ClassId>>,
}

impl Session {
    /// A session over nothing.
    pub(crate) fn new(settings: Arc<Settings>) -> Self {
        Self { settings, documents: Documents::default(), trees: Trees::new(), pages: RefCell::default() }
    }

    /// Forgets all trees, as after a fault of the server whose traces may be anywhere.
    pub(crate) fn forget(&mut self) {
        self.trees = Trees::new();
    }

    /// Where the classes come from that a file with this text may name.
    fn sources(&self, path: &Path, text: &str) -> LibraryPath {
        let mut sources = LibraryPath::new();
        if self.settings.allow_outside {
            sources.allow_outside();
        }
        sources.open_texts(self.documents.texts().clone());
        sources.add_main_file(path, text);
        // What lies in the workspace can be named, as if each of its folders was given as a library.
        for folder in self.settings.libraries.iter().chain(&self.settings.folders) {
            // Whether a folder can be used was told when the settings came; it may vanish and come back.
            let _ = sources.add_folder(folder);
        }
        sources
    }

    /// Asks something about a text.
    pub(crate) fn ask<T>(&mut self, path: &Path, text: &Arc<str>, question: impl FnOnce(&mut Question<'_>) -> T) -> T {
        let mut sources = self.sources(path, text);
        let name: Arc<str> = path.display().to_string().into();
        let (_, parsed) = self.trees.parse(&name, text);
        let names = names(&parsed.value, text);
        let mut table = ClassTable::over(&mut sources, &mut self.trees);
        let top = table.add_main(&name, text);
        let ids = table.ids_of(&names, &top);
        question(&mut Question { table, names, ids })
    }

    /// The same of an open document.
    pub(crate) fn ask_document<T>(&mut self, document: &Document, question: impl FnOnce(&mut Question<'_>) -> T) -> T {
        self.ask(&document.path, &document.text, question)
    }

    /// The names of a text, where nothing needs to be looked up.
    pub(crate) fn parsed(&mut self, path: &Path, text: &Arc<str>) -> Names {
        let (_, parsed) = self.trees.parse(&path.display().to_string().into(), text);
        names(&parsed.value, text)
    }

    /// Translates a class of a text up to the sorted system.
    pub(crate) fn compile(&mut self, path: &Path, text: &Arc<str>, class: &str) -> Compilation {
        let mut sources = self.sources(path, text);
        let options = Options { model: Some(class.into()), set: Vec::new(), goal: Goal::Check, clock: || 0.0 };
        let extras = Extras { strict_units: self.settings.strict_units, ..Extras::default() };
        let name = path.display().to_string();
        compile_over(&mut sources, &mut self.trees, &name, text, &options, &extras)
    }

    /// The text of a file: that of the editor if it is open there.
    pub(crate) fn text(&self, path: &Path) -> Option<Arc<str>> {
        match self.documents.texts().get(path) {
            Some(text) => Some(text.clone()),
            None => read_text(path).ok().map(Arc::from),
        }
    }

    /// The model files of the workspace and of the package around a file, each once.
    pub(crate) fn workspace_files(&self, around: Option<&Path>) -> Vec<PathBuf> {
        let mut folders = self.settings.folders.clone();
        if let Some(file) = around
            && !folders.iter().any(|folder| file.starts_with(folder))
        {
            folders.extend(self.package_folder(file));
        }
        let mut found = BTreeSet::new();
        folders.iter().for_each(|folder| collect(folder, 0, &mut found));
        found.extend(self.documents.iter().map(|document| document.path.clone()));
        found.into_iter().collect()
    }

    /// The folder of the outermost package that a file says it belongs to.
    fn package_folder(&self, file: &Path) -> Option<PathBuf> {
        let text = self.text(file)?;
        let hyd_syntax::Head { within, .. } = hyd_syntax::head(&text);
        let is_package = file.file_stem().is_some_and(|stem| stem.eq_ignore_ascii_case("package"));
        let ups = within.len().saturating_sub(usize::from(!is_package));
        let mut folder = file.parent()?;
        for _ in 0..ups {
            folder = folder.parent()?;
        }
        (!within.is_empty() || is_package).then(|| folder.to_path_buf())
    }

    /// The address of a file by its name in a file table; a text of the built-in library is laid down first.
    pub(crate) fn uri(&self, name: &str) -> Option<Uri> {
        match name.strip_prefix(BUILT_IN) {
            None => self.documents.uri(Path::new(name)),
            Some(inner) => {
                let path = self.settings.built_in.join(inner);
                let (_, text) = built_in_texts().find(|(own, _)| *own == inner)?;
                lay_down(&path, text)?;
                self.documents.uri(&path)
            }
        }
    }

    /// The page that explains a code, laid down for editors to open.
    pub(crate) fn page(&self, code: Code) -> Option<Uri> {
        let make = || {
            let path = self.settings.built_in.join("codes").join(format!("{}.md", code.number()));
            lay_down(&path, &format!("# {code}: {}\n\n{}\n", code.title(), code.explanation()))?;
            self.documents.uri(&path)
        };
        self.pages.borrow_mut().entry(code).or_insert_with(make).clone()
    }

    /// The place of a stretch of text.
    pub(crate) fn location(&self, files: &Files, span: Span) -> Option<Location> {
        let uri = self.uri(files.name(span.file))?;
        let text = files.text(span.file);
        Some(Location { uri, range: Lines::new(text).range(text, span, self.settings.encoding) })
    }

    /// The byte of a document at a position.
    pub(crate) fn byte(&self, document: &Document, position: Position) -> usize {
        document.lines.byte(&document.text, position, self.settings.encoding)
    }

    /// The range of a stretch of a document.
    pub(crate) fn range(&self, document: &Document, span: Span) -> Range {
        document.lines.range(&document.text, span, self.settings.encoding)
    }

    /// True for files that are the user's: in the workspace, or open and not of the built-in library.
    pub(crate) fn is_own(&self, name: &str) -> bool {
        let path = Path::new(name);
        !name.starts_with(BUILT_IN)
            && !path.starts_with(&self.settings.built_in)
            && (self.settings.folders.is_empty() || self.settings.folders.iter().any(|folder| path.starts_with(folder)))
    }
}

/// Writes a file that editors open, whole or not at all.  What another version of the program has laid down there is replaced.
fn lay_down(path: &Path, text: &str) -> Option<()> {
    if std::fs::read_to_string(path).ok().as_deref() == Some(text) {
        return Some(());
    }
    std::fs::create_dir_all(path.parent()?).ok()?;
    hyd_results::write_whole(path, text.as_bytes()).ok()
}

impl Question<'_> {
    /// The name at a byte of the text.
    pub(crate) fn place(&self, byte: usize) -> Option<Place> {
        self.names.at(byte as u32).cloned()
    }

    /// An expression as its text has it, `10e6` and not `10000000.0`, if that stands on one line.
    pub(crate) fn written(&self, expr: &Expr) -> String {
        let printed = print_expr(expr);
        let text = self.table.files.snippet(expr.span);
        // Whatever the place of an expression covers, a text that reads as the same is shown.
        let read = (!text.contains('\n')).then(|| hyd_syntax::parse_expression(expr.span.file, text).value).flatten();
        if read.is_some_and(|read| print_expr(&read) == printed) { text.to_string() } else { printed }
    }

    /// The class around a byte of the text.
    pub(crate) fn class_around(&self, byte: usize) -> Option<ClassId> {
        self.names.class_around(byte as u32).and_then(|at| self.ids.get(at).copied().flatten())
    }
}

/// Model files in a folder and below; hidden folders and links to folders are passed over, so that a search ends.
fn collect(folder: &Path, depth: usize, found: &mut BTreeSet<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        if depth > DEEPEST || found.len() > MOST_FILES {
            return;
        }
        let (path, Ok(kind)) = (entry.path(), entry.file_type()) else { continue };
        let hidden = entry.file_name().as_encoded_bytes().starts_with(b".");
        if kind.is_dir() && !hidden && entry.file_name() != "target" && entry.file_name() != "node_modules" {
            collect(&path, depth + 1, found);
        } else if kind.is_file() && path.extension().is_some_and(|extension| extension == "hyd" || extension == "mo") {
            found.insert(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::lay_down;

    /// Two threads that answer at once lay down the same page, and both can lead to it.
    #[test]
    fn a_page_is_laid_down_by_several_at_once() {
        let folder = std::env::temp_dir().join(format!("hyd-lsp-at-once-{}", std::process::id()));
        for round in 0..50 {
            let path = folder.join(format!("{round}.md"));
            let failed = std::thread::scope(|scope| {
                let threads = [(); 4].map(|()| scope.spawn(|| lay_down(&path, "a page\n").is_none()));
                threads.into_iter().any(|thread| thread.join().expect("no panic"))
            });
            assert!(!failed, "round {round}");
        }
        std::fs::remove_dir_all(&folder).expect("a folder of the test");
    }
}
