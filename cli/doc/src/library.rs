//! All classes of some texts, by full name.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use hyd_source::Files;
use hyd_syntax::tree::{
    Argument, ClassBody, ClassDef, ComponentRef, Element, Expr, ExprKind, Modification, Path, StoredDefinition,
};
use hyd_syntax::visit::{Role, Visitor, walk_reference};

use crate::lookup::Bases;

/// A text of a library.
#[derive(Clone, Debug)]
pub struct Source {
    /// Name of its file, as shown.
    pub name: String,
    /// What it says.
    pub text: String,
    /// Its classes are shown; otherwise they are only there to be looked up.
    pub shown: bool,
    /// Of the text of a package: its classes in the order in which they are to be shown, as far as `package.order` lists them.
    pub order: Vec<String>,
}

/// A class and where it stands.
#[derive(Debug)]
pub(crate) struct Entry {
    /// `Hyd.Units.Length`.
    pub(crate) name: String,
    pub(crate) class: Arc<ClassDef>,
    /// Index of the text.
    pub(crate) source: usize,
    /// Index of the class around it.
    pub(crate) parent: Option<usize>,
    pub(crate) children: Vec<usize>,
}

/// The classes of some texts.
#[derive(Debug)]
pub struct Library {
    pub(crate) sources: Vec<Source>,
    /// In the order of the texts; packages before what is in them.
    pub(crate) entries: Vec<Entry>,
    pub(crate) by_name: BTreeMap<String, usize>,
    /// By class, found when they are first needed.
    pub(crate) bases: RefCell<Vec<Bases>>,
}

impl Library {
    /// Parses the texts; packages come before the files of their folders.  What a text with errors still holds is taken.
    pub fn new(sources: Vec<Source>) -> Self {
        let mut library = Self { sources, entries: Vec::new(), by_name: BTreeMap::new(), bases: RefCell::default() };
        for source in 0..library.sources.len() {
            let mut files = Files::new();
            let text = &library.sources[source].text;
            let file = files.add(library.sources[source].name.clone(), text.clone());
            let StoredDefinition { within, classes } = hyd_syntax::parse(file, text).value;
            let within = within.flatten().map(|path| hyd_syntax::print_path(&path)).unwrap_or_default();
            for class in classes {
                library.add(&within, class, source);
            }
        }
        library.place();
        library.bases = RefCell::new(vec![Bases::Unknown; library.entries.len()]);
        library
    }

    fn add(&mut self, within: &str, class: Arc<ClassDef>, source: usize) {
        let name = join(within, &class.name.name);
        // Of two classes of one name the first counts, as in the search for classes.
        if self.by_name.contains_key(&name) {
            return;
        }
        self.by_name.insert(name.clone(), self.entries.len());
        self.entries.push(Entry {
            name: name.clone(),
            class: class.clone(),
            source,
            parent: None,
            children: Vec::new(),
        });
        for element in elements(&class) {
            if let Element::Class(nested) = element {
                self.add(&name, nested.class.clone(), source);
            }
        }
    }

    /// Finds the class around each class.
    fn place(&mut self) {
        for k in 0..self.entries.len() {
            let parent = self.entries[k].name.rsplit_once('.').and_then(|(outer, _)| self.by_name.get(outer)).copied();
            self.entries[k].parent = parent;
            if let Some(parent) = parent {
                self.entries[parent].children.push(k);
            }
        }
    }

    /// The text that a class stands in.
    pub(crate) fn text(&self, class: usize) -> &str {
        &self.sources[self.entries[class].source].text
    }

    /// The classes within a class: as its package orders them, then those it does not list; packages first where it says nothing.
    pub(crate) fn within(&self, class: usize) -> Vec<usize> {
        let mut children = self.entries[class].children.clone();
        let source = self.entries[class].source;
        // Only the outermost class of a text is the package that the order is of.
        let is_own = class == 0 || self.entries[class - 1].source != source;
        let order = if is_own { self.sources[source].order.as_slice() } else { &[] };
        let rank = |child: usize| {
            let name = &*self.entries[child].class.name.name;
            order.iter().position(|own| own == name).unwrap_or(order.len())
        };
        children.sort_by_key(|&child| (rank(child), self.entries[child].children.is_empty()));
        children
    }

    /// Indices of the classes that are shown.
    pub(crate) fn shown(&self) -> impl Iterator<Item = usize> {
        (0..self.entries.len()).filter(|k| self.sources[self.entries[*k].source].shown)
    }

    /// The classes that each class names as the type of a component or as a base, and the functions it calls.
    pub(crate) fn uses(&self) -> Vec<BTreeSet<usize>> {
        let of = |k: usize| {
            let found = elements(&self.entries[k].class).iter().filter_map(|element| match element {
                Element::Component(component) => self.find(&component.class, k),
                Element::Extends(extends) => self.find(&extends.base, k),
                Element::Import(_) | Element::Class(_) => None,
            });
            let called = self.called(k);
            found.chain(called).filter(|other| *other != k).collect()
        };
        (0..self.entries.len()).map(of).collect()
    }
}

/// Collects what is called.
#[derive(Default)]
struct Calls(Vec<Path>);

impl Visitor for Calls {
    fn reference(&mut self, reference: &ComponentRef, role: Role) {
        if role == Role::Called {
            let parts = reference.parts.iter().map(|part| part.name.clone()).collect();
            self.0.push(Path { global: reference.global, parts, span: reference.span });
        }
        walk_reference(self, reference);
    }
}

impl Library {
    /// The functions that the equations, statements and bindings of a class call.
    pub(crate) fn called(&self, class: usize) -> BTreeSet<usize> {
        let mut calls = Calls::default();
        if let ClassBody::Long { elements, equations, algorithms, .. } = &self.entries[class].class.body {
            equations.iter().flat_map(|section| &section.equations).for_each(|equation| calls.equation(equation));
            algorithms.iter().flat_map(|section| &section.statements).for_each(|statement| calls.statement(statement));
            for element in elements {
                if let Element::Component(component) = element {
                    component.modification.binding.iter().for_each(|value| calls.expr(value));
                }
            }
        }
        calls.0.iter().filter_map(|path| self.find(path, class)).collect()
    }
}

fn join(outer: &str, inner: &str) -> String {
    if outer.is_empty() { inner.to_string() } else { format!("{outer}.{inner}") }
}

/// The elements of a class with a body; none for a short class.
pub(crate) fn elements(class: &ClassDef) -> &[Element] {
    match &class.body {
        ClassBody::Long { elements, .. } => elements,
        _ => &[],
    }
}

/// The value of an argument of an annotation, by its path: `["Documentation", "info"]`.
pub(crate) fn annotated<'a>(annotation: Option<&'a Modification>, path: &[&str]) -> Option<&'a Expr> {
    let (first, rest) = path.split_first()?;
    let argument = annotation?.arguments.iter().find_map(|argument| match argument {
        Argument::Modify(modify) => match modify.target.parts.as_slice() {
            [name] if *name.name == **first => Some(&modify.modification),
            _ => None,
        },
        _ => None,
    })?;
    if rest.is_empty() {
        return argument.binding.as_ref();
    }
    match &argument.binding {
        // `__hyd = effect(...)` does not occur; `effect(...)` may stand as a call where annotations hold values.
        Some(_) => None,
        None => annotated(Some(argument), rest),
    }
}

/// The text of a string.
pub(crate) fn text_of(expr: &Expr) -> Option<&str> {
    match &expr.kind {
        ExprKind::Text(text) => Some(text),
        _ => None,
    }
}
