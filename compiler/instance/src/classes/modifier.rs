//! Modifications: who says what about an element, outermost first.
//!
//! The syntax of a modification becomes a tree by element name once per text ([`AstMod`]).  When a component is
//! instantiated, the trees that speak of it are gathered with the scope their expressions belong to ([`Applied`]) and
//! handed down; for each question (binding, attribute, redeclaration) the outermost one that answers wins
//! (Modelica 3.6, section 7.2.4).

use std::sync::Arc;

use hyd_source::Span;
use hyd_syntax::tree::{Argument, Component, Expr, Modification, Name, NestedClass, Path};

use crate::instantiation::instance::{InstId, Scope};

/// A redeclaration inside a modification.
#[derive(Clone, Debug)]
pub enum Redeclare {
    /// `redeclare Type name`
    Component(Arc<Component>),
    /// `redeclare model A = B`
    Class(Arc<NestedClass>),
}

/// A modification as a tree by element name.
#[derive(Debug, Default)]
pub struct AstMod {
    /// `= expression`
    pub binding: Option<Arc<Expr>>,
    /// `each`
    pub each: bool,
    /// `final`
    pub is_final: bool,
    /// A redeclaration of the element.
    pub redeclare: Option<Redeclare>,
    /// Modifications of its elements, in the order written.
    pub children: Vec<(Name, Arc<AstMod>)>,
    /// Where it is written.
    pub span: Option<Span>,
}

impl AstMod {
    /// From the syntax.
    pub fn from_syntax(modification: &Modification) -> AstMod {
        AstMod {
            binding: modification.binding.clone().map(Arc::new),
            children: modification.arguments.iter().map(argument).collect(),
            span: modification.span,
            ..AstMod::default()
        }
    }

    /// An element that two arguments give a value or a class.
    pub fn said_twice(&self) -> Option<(&Name, Span, Span)> {
        let says = |tree: &AstMod| tree.binding.is_some() || tree.redeclare.is_some();
        self.children.iter().enumerate().find_map(|(k, (name, tree))| {
            let (_, first) = self.children[..k].iter().find(|(other, first)| other == name && says(first))?;
            says(tree).then_some((name, first.span?, tree.span?))
        })
    }

    /// What it says beyond what another one says.
    pub(crate) fn beyond(&self, other: &AstMod) -> AstMod {
        let said = |name: &Name| other.children.iter().find(|(known, _)| known == name).map(|(_, child)| child);
        let children = self.children.iter().filter_map(|(name, child)| match said(name) {
            None => Some((name.clone(), child.clone())),
            Some(other) if other.redeclare.is_some() => None,
            Some(other) => Some((name.clone(), Arc::new(child.beyond(other)))),
        });
        AstMod {
            binding: self.binding.clone().filter(|_| other.binding.is_none()),
            each: self.each,
            is_final: self.is_final,
            redeclare: self.redeclare.clone(),
            children: children.collect(),
            span: self.span,
        }
    }

    /// A bare `= expression`.
    pub fn of_binding(expr: Expr) -> AstMod {
        AstMod { span: Some(expr.span), binding: Some(Arc::new(expr)), ..AstMod::default() }
    }
}

fn argument(argument: &Argument) -> (Name, Arc<AstMod>) {
    match argument {
        Argument::Modify(modify) => {
            let mut inner = AstMod::from_syntax(&modify.modification);
            inner.is_final = modify.is_final;
            inner.span = Some(modify.span);
            nest(&modify.target, inner, modify.each)
        }
        Argument::RedeclareComponent { each, component, .. } => {
            let name = component.name.name.clone();
            let span = Some(component.span);
            let redeclare = Some(Redeclare::Component(Arc::new((**component).clone())));
            (
                name,
                Arc::new(AstMod {
                    each: *each,
                    redeclare,
                    span,
                    is_final: component.prefixes.is_final,
                    ..AstMod::default()
                }),
            )
        }
        Argument::RedeclareClass { each, class, .. } => {
            let name = class.class.name.name.clone();
            let span = Some(class.class.span);
            let redeclare = Some(Redeclare::Class(Arc::new((**class).clone())));
            (
                name,
                Arc::new(AstMod {
                    each: *each,
                    redeclare,
                    span,
                    is_final: class.prefixes.is_final,
                    ..AstMod::default()
                }),
            )
        }
    }
}

/// `a.b = e` is `a(b = e)`; `each` belongs to the first name.
fn nest(target: &Path, inner: AstMod, each: bool) -> (Name, Arc<AstMod>) {
    let mut current = inner;
    let last = target.parts.len() - 1;
    for k in (0..last).rev() {
        let child = (target.parts[k + 1].name.clone(), Arc::new(current));
        current = AstMod { span: Some(target.span), children: vec![child], ..AstMod::default() };
    }
    current.each = each;
    (target.parts[0].name.clone(), Arc::new(current))
}

/// A modification that speaks of one element, with the scope of its expressions.
#[derive(Clone, Debug)]
pub struct Applied {
    /// What it says.
    pub tree: Arc<AstMod>,
    /// Where its names are looked up.
    pub scope: Scope,
    /// Arrays of components between the scope and the element whose subscripts the values carry (no `each`).
    pub spread: Vec<InstId>,
    /// It is said of the class of the component, so of each element where that is an array.
    pub of_class: bool,
}

impl Applied {
    /// What a tree says whose names are looked up in `scope`.
    pub fn new(tree: Arc<AstMod>, scope: Scope) -> Self {
        Self { tree, scope, spread: Vec::new(), of_class: false }
    }
}

/// All modifications of one element, outermost first.
pub type Mods = Vec<Applied>;

/// The modifications of element `name` among those of its parent.  `array`: the parent, if it is an array of components.
pub fn of_child(mods: &Mods, name: &str, array: Option<InstId>) -> Mods {
    let mut result = Vec::new();
    for applied in mods {
        for (child, tree) in &applied.tree.children {
            if child.as_ref() == name {
                let mut spread = applied.spread.clone();
                match (array, tree.each) {
                    (Some(array), false) if !applied.of_class => spread.push(array),
                    // `each` with no array beside it speaks of the nearest one outside.
                    (None, true) => drop(spread.pop()),
                    _ => {}
                }
                result.push(Applied { tree: tree.clone(), scope: applied.scope, spread, of_class: false });
            }
        }
    }
    result
}

/// The outermost redeclaration.
pub fn redeclaration(mods: &Mods) -> Option<(usize, &Applied)> {
    mods.iter().enumerate().find(|(_, applied)| applied.tree.redeclare.is_some())
}

/// The outermost binding.
pub fn binding(mods: &Mods) -> Option<&Applied> {
    mods.iter().find(|applied| applied.tree.binding.is_some())
}
