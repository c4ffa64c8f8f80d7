//! The class table: every class definition read so far, found by full name, loaded when first named.
//!
//! A class is looked up in its parent's text first, then (for packages) among the files of the library folder, so that a
//! large library costs only what a model uses of it.

use std::rc::Rc;
use std::sync::Arc;

use hyd_index::{IndexVec, typed_index};
use hyd_source::{Code, Diagnostic, FileId, Files, Messages, Reported, Span};
use hyd_syntax::tree::{ClassBody, ClassDef, ClassKind, Element, Import, Name, NestedClass, StoredDefinition};
use rustc_hash::FxHashMap;

use crate::Sources;
use crate::classes::heir::with_constraint;
use crate::classes::shape::Shape;
use crate::classes::trees::Trees;

typed_index!(
    /// A class definition.
    ClassId,
    "class"
);

/// A class definition in its place.
pub struct Class {
    /// What was written.
    pub def: Arc<ClassDef>,
    /// The class it is an element of; `None` at the top.
    pub parent: Option<ClassId>,
    /// For an element that `parent` inherited: the class whose text holds it.
    pub written_in: Option<ClassId>,
    /// For an element that `parent` inherited: the same element of the class whose text holds it.
    pub original: Option<ClassId>,
    /// The class that the name on the right of a short definition means, where the text alone does not say it.
    pub(crate) base: Option<ClassId>,
    /// For a class of an instance: what names that it does not declare itself mean, where that is something else than by the text.
    pub(crate) around: Vec<(Name, ClassId)>,
    /// Names from the top down to this class.
    pub path: Vec<Name>,
    children: FxHashMap<Name, Option<ClassId>>,
    /// Classes among its inherited elements that were asked for.
    inherited: FxHashMap<Name, ClassId>,
    /// It inherits from something (asked for every name that is looked up, so not searched for each time).
    pub(crate) has_bases: bool,
    /// It has import clauses.
    pub(crate) has_imports: bool,
    pub(crate) shape: Option<Result<Rc<Shape>, Reported>>,
}

impl Class {
    /// What a name that the class does not declare itself means around it in its instance, where that is something else than by the text.
    pub(crate) fn meant_around(&self, name: &Name) -> Option<ClassId> {
        self.around.iter().find(|(known, _)| known == name).map(|(_, class)| *class)
    }
}

/// A nested class element of a class definition.
pub fn nested_classes(def: &ClassDef) -> impl Iterator<Item = &NestedClass> {
    elements(def).iter().filter_map(|e| match e {
        Element::Class(nested) => Some(nested),
        _ => None,
    })
}

/// Import clauses of a class definition.
pub fn imports(def: &ClassDef) -> impl Iterator<Item = &Import> {
    elements(def).iter().filter_map(|e| match e {
        Element::Import(import) => Some(import),
        _ => None,
    })
}

/// All elements of a long class (none for the other forms).
pub fn elements(def: &ClassDef) -> &[Element] {
    match &def.body {
        ClassBody::Long { elements, .. } => elements,
        _ => &[],
    }
}

/// All classes read so far and where more come from.
pub struct ClassTable<'s> {
    /// All texts read.
    pub files: Files,
    /// Messages so far, of all that works on this table.
    pub messages: Messages,
    /// The text that is translated; all others belong to libraries.
    pub main: Option<FileId>,
    sources: &'s mut dyn Sources,
    trees: Option<&'s mut Trees>,
    classes: IndexVec<ClassId, Class>,
    top: FxHashMap<Name, Option<ClassId>>,
    open_shapes: Vec<ClassId>,
    /// Classes whose files could not be read; that has been said.
    unreadable: Vec<Name>,
    /// By the paths that were asked for: the class of a file that is called like it but for capitals.
    other_capitals: FxHashMap<Vec<Name>, Name>,
    /// Data files by the names that models give them.
    data: FxHashMap<Name, Result<Arc<str>, String>>,
}

impl<'s> ClassTable<'s> {
    /// An empty table over a source of texts.
    pub fn new(sources: &'s mut dyn Sources) -> Self {
        Self {
            files: Files::new(),
            messages: Messages::new(),
            main: None,
            sources,
            trees: None,
            classes: IndexVec::new(),
            top: FxHashMap::default(),
            open_shapes: Vec::new(),
            unreadable: Vec::new(),
            other_capitals: FxHashMap::default(),
            data: FxHashMap::default(),
        }
    }

    /// The same over trees that are kept from table to table.
    pub fn over(sources: &'s mut dyn Sources, trees: &'s mut Trees) -> Self {
        let files = trees.files().clone();
        Self { files, trees: Some(trees), ..Self::new(sources) }
    }

    /// The class behind an id.
    pub fn class(&self, id: ClassId) -> &Class {
        &self.classes[id]
    }

    /// True while the shape of the class is being put together.
    pub(crate) fn is_open(&self, id: ClassId) -> bool {
        self.open_shapes.contains(&id)
    }

    pub(crate) fn open_shape(&mut self, id: ClassId) {
        self.open_shapes.push(id);
    }

    pub(crate) fn close_shape(&mut self) {
        self.open_shapes.pop();
    }

    pub(crate) fn class_mut(&mut self, id: ClassId) -> &mut Class {
        &mut self.classes[id]
    }

    /// Full dotted name.
    pub fn full_name(&self, id: ClassId) -> String {
        self.classes[id].path.join(".")
    }

    /// Adds a message.
    pub fn report(&mut self, diagnostic: Diagnostic) {
        self.messages.report(diagnostic);
    }

    /// The answer to a question whose messages are not meant for anybody.
    pub fn quietly<T>(&mut self, question: impl FnOnce(&mut Self) -> T) -> T {
        self.messages.begin();
        let answer = question(self);
        self.messages.end();
        answer
    }

    /// Parses a text and returns its tree with its file.
    fn parse(&mut self, name: Arc<str>, text: Arc<str>) -> (FileId, StoredDefinition) {
        let (file, parsed) = match &mut self.trees {
            Some(trees) => {
                let (file, parsed) = trees.parse(&name, &text);
                self.files.adopt(trees.files(), file);
                (file, parsed)
            }
            None => {
                let file = self.files.add(name, text.clone());
                (file, hyd_syntax::parse(file, &text))
            }
        };
        for diagnostic in parsed.diagnostics {
            self.report(diagnostic);
        }
        (file, parsed.value)
    }

    /// Reads the main text: its classes become visible under the package that its `within` names.
    /// Returns the classes of the text in order.
    pub fn add_main(&mut self, name: &str, text: &str) -> Vec<ClassId> {
        let (file, stored) = self.parse(name.into(), text.into());
        self.main = Some(file);
        let within = match stored.within {
            Some(Some(path)) => path.parts,
            _ => Vec::new(),
        };
        let mut parent = None;
        for (k, ident) in within.iter().enumerate() {
            let found = match parent {
                None => self.top(&ident.name),
                Some(p) => self.child(p, &ident.name),
            };
            parent = Some(found.unwrap_or_else(|| {
                // A folder without a `package` file still names its package.
                let path: Vec<Name> = within[..=k].iter().map(|i| i.name.clone()).collect();
                self.add_empty_package(path, parent, ident.span)
            }));
        }
        let mut seen: FxHashMap<Name, Span> = FxHashMap::default();
        let mut classes = Vec::new();
        for def in stored.classes {
            if let Some(&first) = seen.get(&def.name.name) {
                let message = format!("`{}` is declared twice", def.name.name);
                self.report(
                    Diagnostic::error(Code::Redefinition, message)
                        .at(def.name.span, "second declaration")
                        .with(first, "first declaration"),
                );
            }
            seen.insert(def.name.name.clone(), def.name.span);
            classes.push(self.add(def, parent, true));
        }
        classes
    }

    fn add_empty_package(&mut self, path: Vec<Name>, parent: Option<ClassId>, span: Span) -> ClassId {
        let name = path[path.len() - 1].clone();
        let def = ClassDef {
            kind: ClassKind::Package,
            encapsulated: false,
            partial: false,
            expandable: false,
            pure: None,
            name: hyd_syntax::tree::Ident { name, span },
            description: None,
            body: ClassBody::Long {
                elements: Vec::new(),
                equations: Vec::new(),
                algorithms: Vec::new(),
                external: None,
                extends_from: None,
            },
            annotation: None,
            span,
        };
        self.add(Arc::new(def), parent, true)
    }

    /// Registers a class and, if `visible`, its name in its parent.
    pub(crate) fn add(&mut self, def: Arc<ClassDef>, parent: Option<ClassId>, visible: bool) -> ClassId {
        let name = def.name.name.clone();
        let mut path = parent.map_or_else(Vec::new, |p| self.classes[p].path.clone());
        path.push(name.clone());
        let has_bases = elements(&def).iter().any(|e| matches!(e, Element::Extends(_)))
            || matches!(def.body, ClassBody::Short { .. } | ClassBody::Long { extends_from: Some(_), .. });
        let has_imports = imports(&def).next().is_some();
        let id = self.classes.push(Class {
            def,
            parent,
            written_in: None,
            original: None,
            base: None,
            around: Vec::new(),
            path,
            children: FxHashMap::default(),
            inherited: FxHashMap::default(),
            has_bases,
            has_imports,
            shape: None,
        });
        if visible {
            match parent {
                None => self.top.insert(name, Some(id)),
                Some(p) => self.classes[p].children.insert(name, Some(id)),
            };
        }
        id
    }

    /// Remembers a class among the inherited elements of `heir`.
    pub(crate) fn name_inherited(&mut self, heir: ClassId, name: &Name, class: ClassId) {
        self.classes[heir].inherited.insert(name.clone(), class);
    }

    /// A class among the inherited elements of `heir` that was asked for before.
    pub(crate) fn known_inherited(&self, heir: ClassId, name: &Name) -> Option<ClassId> {
        self.classes[heir].inherited.get(name).copied()
    }

    /// All classes that have been read so far.
    pub fn class_ids(&self) -> impl Iterator<Item = ClassId> + use<> {
        let ids: Vec<ClassId> = self.classes.iter_enumerated().map(|(id, _)| id).collect();
        ids.into_iter()
    }

    /// A class at the top.
    pub fn top(&mut self, name: &Name) -> Option<ClassId> {
        if let Some(&known) = self.top.get(name) {
            return known;
        }
        let found = self.load(std::slice::from_ref(name), None);
        self.top.insert(name.clone(), found);
        found
    }

    /// A class written directly in `parent` (not inherited), in its text or as a file of its folder.
    pub fn child(&mut self, parent: ClassId, name: &Name) -> Option<ClassId> {
        if let Some(&known) = self.classes[parent].children.get(name) {
            return known;
        }
        let def = self.classes[parent].def.clone();
        let mut found = None;
        for nested in nested_classes(&def) {
            if nested.class.name.name == *name {
                let constraint = nested.constrained_by.as_ref();
                found = Some(self.add(with_constraint(nested, constraint), Some(parent), true));
                break;
            }
        }
        if let (None, Some(original)) = (found, self.classes[parent].original) {
            // A file of the folder of an inherited package.
            found = self.child(original, name).map(|class| self.add_heir(class, parent, original));
        } else if found.is_none() && def.kind == ClassKind::Package {
            let mut path = self.classes[parent].path.clone();
            path.push(name.clone());
            found = self.load(&path, Some(parent));
        }
        self.classes[parent].children.insert(name.clone(), found);
        found
    }

    /// The class in a file or folder that a library lists under this name, at the top or in `parent`; its own name may be written with other capitals.
    pub fn listed(&mut self, parent: Option<ClassId>, name: &Name) -> Option<ClassId> {
        let named = |table: &mut Self, name: &Name| match parent {
            Some(parent) => table.child(parent, name),
            None => table.top(name),
        };
        if let Some(class) = named(self, name) {
            return Some(class);
        }
        let mut path = parent.map_or_else(Vec::new, |parent| self.classes[parent].path.clone());
        path.push(name.clone());
        let own = self.other_capitals.get(&path)?.clone();
        named(self, &own)
    }

    fn load(&mut self, path: &[Name], parent: Option<ClassId>) -> Option<ClassId> {
        let text = match self.sources.find(path) {
            Ok(text) => text?,
            Err(sentence) => {
                self.report(Diagnostic::error(Code::FileAccess, sentence));
                self.unreadable.extend(path.last().cloned());
                return None;
            }
        };
        let (file, stored) = self.parse(text.name.clone(), text.text);
        let wanted = &path[path.len() - 1];
        // Names of files are compared without case, names of classes are not: this file is that of another class.
        let is_other = |def: &&Arc<ClassDef>| def.name.name.eq_ignore_ascii_case(wanted);
        if stored.classes.iter().all(|def| def.name.name != *wanted)
            && let Some(other) = stored.classes.iter().find(is_other)
        {
            self.other_capitals.insert(path.to_vec(), other.name.name.clone());
            return None;
        }
        self.check_within(&stored, &path[..path.len() - 1]);
        let mut found = None;
        for def in stored.classes {
            let matches = def.name.name == *wanted;
            let id = self.add(def, parent, matches);
            if matches {
                found = Some(id);
            }
        }
        if found.is_none() && !self.messages.iter().any(|d| d.labels.iter().any(|l| l.span.file == file)) {
            let message = format!("the file `{}` should define `{wanted}` and does not", text.name);
            self.report(Diagnostic::error(Code::UnknownClass, message).at(Span::new(file, 0, 0), ""));
        }
        found
    }

    /// The text of a data file, read once.
    pub(crate) fn data_file(&mut self, name: &Name) -> Result<Arc<str>, String> {
        if let Some(known) = self.data.get(name) {
            return known.clone();
        }
        let text = self.sources.data(name);
        self.data.insert(name.clone(), text.clone());
        text
    }

    /// True if the file of a class of this name could not be read, which has been said.
    pub(crate) fn is_unreadable(&self, name: &Name) -> bool {
        self.unreadable.contains(name)
    }

    /// A file that a folder leads to must not say that it belongs to another package (Modelica 3.6, section 13.4.3).
    fn check_within(&mut self, stored: &StoredDefinition, package: &[Name]) {
        let Some(Some(within)) = &stored.within else { return };
        if within.parts.iter().map(|part| &part.name).eq(package) {
            return;
        }
        let place = match package {
            [] => "it stands at the top of a library: leave the name out".to_string(),
            names => format!("its folder is the package `{}`: write `within {0};`", names.join(".")),
        };
        let message = "the file belongs to another package than its `within` says";
        self.report(Diagnostic::error(Code::Misplaced, message).at(within.span, "").help(place));
    }

    /// Names of the classes at the top that have been read, sorted, for suggestions.
    pub(crate) fn top_names(&self) -> Vec<Name> {
        let mut names: Vec<Name> = self.top.iter().filter(|(_, id)| id.is_some()).map(|(n, _)| n.clone()).collect();
        names.sort_unstable();
        names
    }

    /// Full names of the classes of the libraries.
    pub(crate) fn library_names(&mut self) -> Vec<String> {
        self.sources.class_names()
    }
}
