//! Which names a class mentions, and whether they are read or only set.
//!
//! A mention is the first identifier of a reference, of a class name or of a modified element, wherever it stands: in
//! declarations, equations, statements, annotations and nested classes.

use hyd_syntax::tree::{
    Argument, ClassBody, ClassDef, Component, ComponentRef, Constraint, Element, Modification, Name, NestedClass, Path,
};
use hyd_syntax::visit::{Role, Visitor, walk_reference};
use rustc_hash::FxHashMap;

/// How often a name is read, and how often it is only the target of `name := value`.
#[derive(Clone, Copy, Default, Debug)]
pub(super) struct Uses {
    /// Mentions that need the value or the meaning of the name.
    pub read: u32,
    /// Assignments to it.
    pub set: u32,
}

/// The names that a text mentions.
#[derive(Default, Debug)]
pub(super) struct Mentions {
    uses: FxHashMap<Name, Uses>,
}

impl Mentions {
    /// How a name is used.
    pub(super) fn of(&self, name: &Name) -> Uses {
        self.uses.get(name).copied().unwrap_or_default()
    }

    /// True if the name occurs.
    pub(super) fn has(&self, name: &Name) -> bool {
        self.uses.contains_key(name)
    }

    /// Takes over what a nested class mentions.
    pub(super) fn merge(&mut self, inner: &Mentions) {
        for (name, uses) in &inner.uses {
            let mine = self.uses.entry(name.clone()).or_default();
            mine.read += uses.read;
            mine.set += uses.set;
        }
    }

    /// What a class mentions outside its nested classes, apart from import clauses.
    pub(super) fn add_class(&mut self, def: &ClassDef) {
        self.maybe_modification(def.annotation.as_ref());
        match &def.body {
            ClassBody::Long { elements, equations, algorithms, extends_from, external, .. } => {
                self.maybe_modification(extends_from.as_ref());
                elements.iter().for_each(|element| self.element(element));
                equations.iter().flat_map(|section| &section.equations).for_each(|e| self.equation(e));
                algorithms.iter().flat_map(|section| &section.statements).for_each(|s| self.statement(s));
                // A function outside may read and write all that it is given.
                let call = external.as_ref().and_then(|external| external.call.as_ref());
                call.iter().flat_map(|call| &call.arguments).for_each(|e| self.expr(e));
            }
            ClassBody::Short { base, dims, modification, .. } => {
                self.path(base);
                dims.iter().for_each(|e| self.expr(e));
                self.modification(modification);
            }
            ClassBody::Enumeration(_) => {}
            ClassBody::DerivativeOf(path, _) => self.path(path),
        }
    }

    fn read(&mut self, name: &Name) {
        self.uses.entry(name.clone()).or_default().read += 1;
    }

    fn path(&mut self, path: &Path) {
        if let (false, Some(first)) = (path.global, path.parts.first()) {
            self.read(&first.name);
        }
    }

    fn element(&mut self, element: &Element) {
        match element {
            Element::Import(_) => {}
            Element::Extends(extends) => {
                self.path(&extends.base);
                self.modification(&extends.modification);
                self.maybe_modification(extends.annotation.as_ref());
            }
            Element::Class(nested) => self.constraint(nested.constrained_by.as_ref()),
            Element::Component(component) => self.component(component),
        }
    }

    fn constraint(&mut self, constraint: Option<&Constraint>) {
        if let Some(constraint) = constraint {
            self.path(&constraint.base);
            self.modification(&constraint.modification);
        }
    }

    fn component(&mut self, component: &Component) {
        self.path(&component.class);
        component.dims.iter().chain(&component.condition).for_each(|e| self.expr(e));
        self.modification(&component.modification);
        self.constraint(component.constrained_by.as_ref());
        self.maybe_modification(component.annotation.as_ref());
    }

    fn maybe_modification(&mut self, modification: Option<&Modification>) {
        if let Some(modification) = modification {
            self.modification(modification);
        }
    }

    fn modification(&mut self, modification: &Modification) {
        modification.binding.iter().for_each(|e| self.expr(e));
        for argument in &modification.arguments {
            match argument {
                Argument::Modify(inner) => {
                    self.path(&inner.target);
                    self.modification(&inner.modification);
                }
                Argument::RedeclareComponent { component, .. } => {
                    self.read(&component.name.name);
                    self.component(component);
                }
                Argument::RedeclareClass { class, .. } => self.redeclared(class),
            }
        }
    }

    fn redeclared(&mut self, class: &NestedClass) {
        self.read(&class.class.name.name);
        self.constraint(class.constrained_by.as_ref());
        self.add_class(&class.class);
    }
}

impl Visitor for Mentions {
    fn reference(&mut self, reference: &ComponentRef, role: Role) {
        if let (false, Some(first)) = (reference.global, reference.parts.first()) {
            match role {
                Role::Assigned => self.uses.entry(first.name.name.clone()).or_default().set += 1,
                // Of several results some are often taken only because of their place.
                _ => self.read(&first.name.name),
            }
        }
        walk_reference(self, reference);
    }
}
