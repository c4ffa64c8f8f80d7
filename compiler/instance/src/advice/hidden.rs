//! Names that hide others: loop variables and components with the name of a component, import or constant around them.
//!
//! Hiding is legal Modelica (sections 5.3 and 11.2.2); it is reported because the reader of the inner text easily takes the
//! name for the outer one.  Classes that hide classes are usual in libraries and not reported.

use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Span};
use hyd_syntax::tree::{ClassBody, ClassDef, Element, Import, ImportKind, Iterator, Name, Variability};
use hyd_syntax::visit::Visitor;
use rustc_hash::FxHashMap;

use crate::classes::class::{elements, nested_classes};

/// A name that can be hidden: what it is, and where it is declared.
type Outer = FxHashMap<Name, (&'static str, Span)>;

/// The warnings about the classes of a text.
pub(super) fn hidden(classes: &[Arc<ClassDef>]) -> Vec<Diagnostic> {
    let mut search = Search::default();
    for def in classes {
        search.class(def, &Outer::default());
    }
    search.found
}

#[derive(Default)]
struct Search {
    found: Vec<Diagnostic>,
    /// Components of the class whose text is looked at.
    components: Outer,
    /// Loop variables around the place looked at.
    loops: Vec<(Name, Span)>,
}

impl Search {
    fn class(&mut self, def: &ClassDef, around: &Outer) {
        let mut visible = if def.encapsulated { Outer::default() } else { around.clone() };
        for element in elements(def) {
            if let Element::Import(import) = element {
                visible.extend(imported(import).map(|(name, span)| (name, ("import", span))));
            }
        }
        let mut components = Outer::default();
        for element in elements(def) {
            let Element::Component(component) = element else { continue };
            let (name, span) = (&component.name.name, component.name.span);
            if let Some((what, declared)) = visible.get(name).copied() {
                self.warn(format!("`{name}` hides the {what} `{name}`"), span, declared);
            }
            components.insert(name.clone(), ("component", span));
        }
        let mut inner = visible.clone();
        for element in elements(def) {
            if let Element::Component(component) = element
                && component.variability == Variability::Constant
            {
                inner.insert(component.name.name.clone(), ("constant", component.name.span));
            }
        }
        self.components = visible;
        self.components.extend(components);
        self.body(def);
        for nested in nested_classes(def) {
            self.class(&nested.class, &inner);
        }
    }

    fn body(&mut self, def: &ClassDef) {
        let ClassBody::Long { elements, equations, algorithms, .. } = &def.body else { return };
        for element in elements {
            if let Element::Component(component) = element {
                component.modification.binding.iter().for_each(|e| self.expr(e));
            }
        }
        equations.iter().flat_map(|section| &section.equations).for_each(|e| self.equation(e));
        algorithms.iter().flat_map(|section| &section.statements).for_each(|s| self.statement(s));
    }

    fn warn(&mut self, message: String, span: Span, declared: Span) {
        let warning = Diagnostic::warning(Code::Hidden, message);
        self.found.push(warning.at(span, "this one is meant from here on").with(declared, "declared here"));
    }
}

impl Visitor for Search {
    fn enter(&mut self, iterators: &[Iterator]) {
        for iterator in iterators {
            iterator.range.iter().for_each(|e| self.expr(e));
            let (name, span) = (&iterator.name.name, iterator.name.span);
            let outer = self.loops.iter().rev().find(|(n, _)| n == name).map(|(_, span)| ("loop variable", *span));
            if let Some((what, declared)) = outer.or_else(|| self.components.get(name).copied()) {
                self.warn(format!("the loop variable `{name}` hides the {what} `{name}`"), span, declared);
            }
            self.loops.push((name.clone(), span));
        }
    }

    fn leave(&mut self, iterators: &[Iterator]) {
        self.loops.truncate(self.loops.len() - iterators.len());
    }
}

/// The names that an import clause makes visible by name.
fn imported(import: &Import) -> impl std::iter::Iterator<Item = (Name, Span)> {
    let names = match &import.what {
        ImportKind::Qualified => import.path.parts.last().into_iter().collect(),
        ImportKind::Renamed(alias) => vec![alias],
        ImportKind::Several(names) => names.iter().collect(),
        ImportKind::All => Vec::new(),
    };
    names.into_iter().map(|ident| (ident.name.clone(), ident.span)).collect::<Vec<_>>().into_iter()
}
