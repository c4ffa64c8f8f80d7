//! The variables of a function with what short definitions and `extends` clauses say of them.
//!
//! `function f = g(k = c)` gives the input `k` of `g` a default that is looked up where `f` stands (Modelica 3.6, sections 4.6 and 7.2.1),
//! not among the variables of the function.

use hyd_source::Reported;
use hyd_syntax::tree::{Argument, ClassBody, Component, ComponentRef, Direction, Element, Modification, Name};
use hyd_syntax::visit::{Role, Visitor, walk_reference};

use crate::classes::class::elements;
use crate::classes::shape::Shape;
use crate::instantiation::instance::{InstId, Scope};
use crate::instantiation::scopes::Scopes;

/// A variable of a function.
#[derive(Clone, Debug)]
pub struct FunctionComponent {
    /// The frame in which it is declared.
    pub frame: u32,
    /// Its declaration, with the value that counts.
    pub component: Component,
    /// Where the names of the value are looked up, if not in the function.
    pub value_scope: Option<Scope>,
}

/// The names that an expression reads.
struct Names<'n>(Vec<&'n Name>, bool);

impl Names<'_> {
    fn modification(&mut self, modification: &Modification) {
        modification.binding.iter().for_each(|value| self.expr(value));
        for argument in &modification.arguments {
            if let Argument::Modify(inner) = argument {
                self.modification(&inner.modification);
            }
        }
    }
}

impl Visitor for Names<'_> {
    fn reference(&mut self, reference: &ComponentRef, _: Role) {
        let first = &reference.parts[0].name.name;
        self.1 |= !reference.global && self.0.contains(&first);
        walk_reference(self, reference);
    }
}

/// Variables so that the sizes and values of declarations come behind those that they read, whatever the order of the text is (Modelica 3.6, section
/// 12.4.4); inputs keep their places among each other, and so do those that read each other in a cycle.
pub fn in_order_of_values(components: Vec<FunctionComponent>) -> Vec<FunctionComponent> {
    let reads = |FunctionComponent { component: own, value_scope, .. }: &FunctionComponent,
                 others: &[FunctionComponent]| {
        if own.dims.is_empty() && (value_scope.is_some() || own.modification.span.is_none()) {
            return false;
        }
        let name = &own.name.name;
        let others = others.iter().filter(|other| other.component.modification.binding.is_some());
        let mut names =
            Names(others.map(|other| &other.component.name.name).filter(|other| *other != name).collect(), false);
        !names.0.is_empty() && {
            own.dims.iter().for_each(|dim| names.expr(dim));
            if value_scope.is_none() {
                names.modification(&own.modification);
            }
            names.1
        }
    };
    let is_input = |own: &FunctionComponent| own.component.direction == Some(Direction::Input);
    if !(0..components.len()).any(|k| !is_input(&components[k]) && reads(&components[k], &components[k + 1..])) {
        return components;
    }
    let (mut ordered, mut open): (Vec<_>, Vec<_>) = components.into_iter().partition(is_input);
    while !open.is_empty() {
        let next = (0..open.len()).find(|&k| !reads(&open[k], &open)).unwrap_or(0);
        ordered.push(open.remove(next));
    }
    ordered
}

impl Scopes<'_> {
    /// Components of a function with the frame in which each is declared.
    pub(crate) fn components_of(&self, shape: &Shape) -> Vec<(u32, Component)> {
        let mut components = Vec::new();
        for element in shape.elements.iter().filter(|e| e.component) {
            let owner = &self.table.class(shape.frames[element.frame as usize].class).def;
            if let Element::Component(component) = &elements(owner)[element.position as usize] {
                components.push((element.frame, component.clone()));
            }
        }
        components
    }

    /// The variables of a function in the order of the text; `inst` is the scope of its text.
    pub fn function_components(&mut self, inst: InstId, shape: &Shape) -> Result<Vec<FunctionComponent>, Reported> {
        let mut all = Vec::new();
        for (frame, mut component) in self.components_of(shape) {
            let said = shape.frames[frame as usize].modifications.iter().find_map(|(from, tree)| {
                let (_, inner) = tree.children.iter().find(|(name, _)| *name == component.name.name)?;
                Some((*from, inner.binding.clone()?))
            });
            let mut value_scope = None;
            if let Some((from, value)) = said {
                component.modification.binding = Some((*value).clone());
                let class = shape.frames[from as usize].class;
                if matches!(self.table.class(class).def.body, ClassBody::Short { .. }) {
                    value_scope = self.scope_around(inst, shape, from)?;
                }
            }
            all.push(FunctionComponent { frame, component, value_scope });
        }
        Ok(all)
    }
}
