//! Instantiation: from a class and its modifications to the instance tree.
//!
//! For every component: gather the modifications that speak of it (outermost first), replace its class if it is
//! redeclared, evaluate its condition and sizes, then do the same inside (Modelica 3.6, sections 5.6 and 7).

use std::collections::BTreeSet;
use std::rc::Rc;
use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported};
use hyd_syntax::tree::{ClassKind, Component, Element};
use rustc_hash::FxHashMap;

use crate::classes::class::{ClassId, ClassTable, elements};
use crate::classes::modifier::{Applied, Mods, Redeclare, of_child, redeclaration};
use crate::classes::shape::{Shape, ShapeElement};
use crate::instantiation::instance::{InstId, Instance, Scope};
use crate::instantiation::scopes::{Found, Override, Scopes, variability_of};
use crate::instantiation::tree::{InstanceTree, Instances};

/// What instantiation gives: the components of a model, and what names in their texts mean.
pub type Instantiated<'s> = (Rc<InstanceTree>, Scopes<'s>);

/// Instantiates a model.  `Err` gives the table back with its messages.
pub fn instantiate<'s>(
    table: ClassTable<'s>,
    class: ClassId,
    overrides: Vec<Override>,
) -> Result<Instantiated<'s>, Box<ClassTable<'s>>> {
    instantiate_apart(table, class, overrides, BTreeSet::new())
}

/// The same with the arrays of components at these paths made element by element (see [`Scopes::differing`]).
pub fn instantiate_apart<'s>(
    mut table: ClassTable<'s>,
    class: ClassId,
    overrides: Vec<Override>,
    apart: BTreeSet<String>,
) -> Result<Instantiated<'s>, Box<ClassTable<'s>>> {
    let Ok(root) = root_of(&mut table, class) else { return Err(Box::new(table)) };
    let mut scopes = Scopes {
        table,
        instances: Instances::of_root(root),
        overrides,
        found: Found::default(),
        known: FxHashMap::default(),
        packages: FxHashMap::default(),
        enumerations: FxHashMap::default(),
        constructors: FxHashMap::default(),
        declared_names: FxHashMap::default(),
        make_element: Scopes::instantiate_element,
        redeclare: Scopes::redeclare_class,
        depth: 0,
        open_values: Vec::new(),
        evaluating: 0,
        guessed: None,
        work: 0,
        pending: FxHashMap::default(),
        redeclaring: FxHashMap::default(),
        added_inner: Vec::new(),
        adapting: Vec::new(),
        variants: FxHashMap::default(),
        contexts_of_bases: FxHashMap::default(),
        too_many: false,
        apart,
        differing: BTreeSet::new(),
        values_for_parts: FxHashMap::default(),
    };
    // What is wrong with a component has been said.
    let _ = scopes.instantiate_members(scopes.instances.tree().root, &Vec::new(), 0);
    scopes.expand_connectors();
    scopes.name_parts_in_bindings();
    scopes.tell_added_inner();
    if scopes.too_many { Err(Box::new(scopes.table)) } else { Ok((scopes.instances.tree().clone(), scopes)) }
}

/// The top of a model without its components.
fn root_of(table: &mut ClassTable<'_>, class: ClassId) -> Result<Instance, Reported> {
    let def = table.class(class).def.clone();
    if !matches!(def.kind, ClassKind::Model | ClassKind::Block | ClassKind::Class) {
        let kind = def.kind.keyword();
        let message = format!("`{}` is a {kind} and cannot be simulated", table.full_name(class));
        table.report(
            Diagnostic::error(Code::Misplaced, message)
                .at(def.name.span, "declared here")
                .help("a model or a block can be"),
        );
        return Err(Reported);
    }
    if def.partial {
        let message = format!("`{}` is partial and cannot be simulated by itself", table.full_name(class));
        table.report(Diagnostic::error(Code::PartialClass, message).at(def.name.span, "declared partial here"));
        return Err(Reported);
    }
    let shape = table.shape(class)?;
    let root = Instance::new("".into(), None, def.name.span);
    let description = def.description.clone();
    Ok(Instance { class: Some(class), shape: Some(shape), kind: def.kind, description, ..root })
}

/// What a redeclaration says of those that redeclare it further: the modification of its constraining clause, else its own.
fn kept_of_redeclared(applied: &Applied) -> Option<Applied> {
    let Some(Redeclare::Component(component)) = &applied.tree.redeclare else { return None };
    let said = component.constrained_by.as_ref().map_or(&component.modification, |clause| &clause.modification);
    let tree = Arc::new(crate::classes::modifier::AstMod::from_syntax(said));
    Some(Applied { spread: applied.spread.clone(), ..Applied::new(tree, applied.scope) })
}

impl Scopes<'_> {
    /// Makes all components of an instance whose class is set.  Errors are reported; the rest is still made.
    /// The first `outside` modifications stand outside of the class: they cannot reach protected elements.
    pub(crate) fn instantiate_members(&mut self, inst: InstId, mods: &Mods, outside: usize) -> Result<(), Reported> {
        let Some(shape) = self.instances[inst].shape.clone() else { return Ok(()) };
        self.check_targets(inst, &shape, mods, outside);
        self.redeclaring.insert(inst, (Rc::new(mods.clone()), vec![false; shape.elements.len()]));
        for (k, element) in shape.elements.iter().enumerate() {
            if !element.component {
                self.redeclare_in_time(inst, &shape, k);
                self.adapt_local_class(inst, &shape, k);
            }
        }
        self.redeclaring.remove(&inst);
        self.pending.insert(inst, mods.clone());
        let mut result = Ok(());
        for (k, element) in shape.elements.iter().enumerate() {
            // Some were named by those before and are made already.
            let open = element.component && !self.instances[inst].by_name.contains_key(&element.name);
            if open && self.instantiate_element(inst, k, mods).is_err() {
                result = Err(Reported);
            }
        }
        self.pending.remove(&inst);
        self.order_children(inst);
        result
    }

    /// All modifications of element `k`, outermost first: from outside, from `extends` clauses, from the declaration.
    pub(crate) fn mods_of(&mut self, inst: InstId, shape: &Rc<Shape>, k: usize, outer: &Mods) -> Mods {
        let element = &shape.elements[k];
        let array = self.instances[inst].is_array().then_some(inst);
        let mut mods = of_child(outer, &element.name, array);
        for (frame, tree) in &shape.frames[element.frame as usize].modifications {
            let applied = Applied::new(tree.clone(), self.scope_of_modifier(inst, *frame));
            mods.extend(of_child(&vec![applied], &element.name, None));
        }
        mods
    }

    /// Makes component `k` of the instance's shape.
    pub(crate) fn instantiate_element(&mut self, inst: InstId, k: usize, outer: &Mods) -> Result<(), Reported> {
        let Some(shape) = self.instances[inst].shape.clone() else { return Ok(()) };
        let element = &shape.elements[k];
        self.limit_components(inst, &shape, element)?;
        let Some(mut declaration) = self.declared(&shape, element) else { return Ok(()) };
        let original_span = declaration.name.span;
        let own_scope = Scope { inst, frame: element.frame };
        let mut type_scope = own_scope;
        let mut mods = self.mods_of(inst, &shape, k, outer);
        if let Some((position, applied)) = redeclaration(&mods).map(|(p, a)| (p, a.clone())) {
            let Some(Redeclare::Component(new)) = &applied.tree.redeclare else {
                let message = format!("`{}` is a component and is redeclared as a class", element.name);
                self.table.report(
                    Diagnostic::error(Code::Redeclaration, message)
                        .at(applied.tree.span.unwrap_or(original_span), "")
                        .with(original_span, "declared here"),
                );
                return Err(Reported);
            };
            if !declaration.prefixes.replaceable {
                self.table.not_replaceable(&element.name, applied.tree.span, original_span);
                return Err(Reported);
            }
            // 7.3.2: the modification of the constraining clause stays in force, else that of the declaration.
            let kept = match &declaration.constrained_by {
                Some(constraint) => Arc::new(crate::classes::modifier::AstMod::from_syntax(&constraint.modification)),
                None => element.modification.clone(),
            };
            let tree = Arc::new(crate::classes::modifier::AstMod::from_syntax(&new.modification));
            if let Some(first) = mods[position + 1..].iter().find(|m| m.tree.redeclare.is_some() && m.tree.is_final) {
                let declared = first.tree.span;
                self.final_modified(&element.name, applied.tree.span, declared);
            }
            let wanted = declaration.constrained_by.as_ref().map_or(&declaration.class, |c| &c.base);
            self.check_redeclared(own_scope, wanted, &applied, new)?;
            // So does that of a redeclaration that is itself redeclared.
            let between: Vec<Applied> = mods[position + 1..].iter().filter_map(kept_of_redeclared).collect();
            mods.truncate(position);
            mods.push(Applied { spread: applied.spread.clone(), ..Applied::new(tree, applied.scope) });
            mods.extend(between);
            mods.push(Applied::new(kept, own_scope));
            type_scope = applied.scope;
            declaration = Component {
                variability: variability_of(new, &declaration),
                flow: new.flow || declaration.flow,
                stream: new.stream || declaration.stream,
                direction: new.direction.or(declaration.direction),
                prefixes: declaration.prefixes.clone(),
                condition: declaration.condition.clone(),
                dims: if new.dims.is_empty() { declaration.dims.clone() } else { new.dims.clone() },
                description: new.description.clone().or(declaration.description.clone()),
                annotation: new.annotation.clone().or(declaration.annotation.clone()),
                ..(**new).clone()
            };
        } else {
            mods.push(Applied::new(element.modification.clone(), own_scope));
            if let Some(kept) = self.kept_of_replaced(inst, &shape, element) {
                mods.push(kept);
            }
            if let Some(constraint) = &declaration.constrained_by {
                let tree = Arc::new(crate::classes::modifier::AstMod::from_syntax(&constraint.modification));
                mods.push(Applied::new(tree, own_scope));
            }
        }
        self.check_final(&element.name, &mods, declaration.prefixes.is_final);
        let made = self.make(inst, element, &declaration, own_scope, type_scope, mods);
        if made.is_err() {
            self.broken(inst, &element.name, declaration.name.span);
        }
        made
    }

    /// What a declaration said of the element that a `redeclare` element of this class or a base replaces (7.3.2).
    fn kept_of_replaced(&mut self, inst: InstId, shape: &Shape, element: &ShapeElement) -> Option<Applied> {
        let (frame, position) = element.replaced?;
        let owner = self.table.class(shape.frames[frame as usize].class).def.clone();
        let Element::Component(original) = &elements(&owner)[position as usize] else { return None };
        let modification = match &original.constrained_by {
            Some(constraint) => &constraint.modification,
            None => &original.modification,
        };
        let mut tree = crate::classes::modifier::AstMod::from_syntax(modification);
        tree.is_final = false;
        Some(Applied::new(Arc::new(tree), Scope { inst, frame }))
    }

    fn check_final(&mut self, name: &str, mods: &Mods, declared_final: bool) {
        let last = mods.len() - 1;
        for (inner, applied) in mods.iter().enumerate().skip(1) {
            let is_final = applied.tree.is_final || (inner == last && declared_final);
            let Some(outer) = mods[..inner].iter().find(|m| m.tree.binding.is_some() || !m.tree.children.is_empty())
            else {
                continue;
            };
            if is_final {
                self.final_modified(name, outer.tree.span, applied.tree.span);
                return;
            }
        }
    }
}
