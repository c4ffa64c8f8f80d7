//! Local classes of an instance whose text names a class that is another one there: `function f = S.f` and `model M extends S.M` where a
//! modification of the instance redeclared `S`.
//!
//! What a class inherits is found once, from texts alone (Modelica 3.6, sections 5.3 and 5.6.1).  A class of an instance whose bases differ for
//! the instance therefore becomes a class of its own: the same text, with the classes that its names mean there (`Class::around`).  Instances
//! for which the names mean the same share it.

use std::collections::BTreeSet;
use std::rc::Rc;

use hyd_syntax::tree::{Argument, ClassBody, ClassDef, ClassKind, Element, Modification, Name, Path};

use crate::classes::class::{ClassId, elements};
use crate::classes::heir::with_constraint;
use crate::classes::modifier::{Applied, AstMod, Mods};
use crate::classes::shape::{Shape, is_builtin};
use crate::instantiation::instance::{InstId, LocalClass, Scope};
use crate::instantiation::scopes::Scopes;

/// What tells classes that [`Scopes::rebase`] makes apart: the class with the element, its name, what names in it mean, and the instances
/// that these are elements of.
pub(crate) type Rebased = (ClassId, Name, Vec<(Name, ClassId)>, Vec<InstId>);

/// Adds the first names of the classes that a class inherits from or is short for, nested classes included; names that it declares itself
/// are left out.
fn names_of_bases<'d>(def: &'d ClassDef, names: &mut Vec<&'d Name>) {
    let first = names.len();
    match &def.body {
        ClassBody::Short { base, modification, .. } => add_base(base, modification, names),
        ClassBody::Long { elements, extends_from, .. } => {
            extends_from.iter().for_each(|modification| add_redeclared(modification, names));
            for element in elements {
                match element {
                    Element::Extends(extends) => add_base(&extends.base, &extends.modification, names),
                    Element::Class(nested) => names_of_bases(&nested.class, names),
                    Element::Import(_) | Element::Component(_) => {}
                }
            }
        }
        ClassBody::Enumeration(_) | ClassBody::DerivativeOf(..) => {}
    }
    let own = |name: &Name| {
        elements(def).iter().any(|element| matches!(element, Element::Class(nested) if nested.class.name.name == *name))
    };
    let added = names.split_off(first);
    names.extend(added.into_iter().filter(|name| !own(name)));
}

fn add_base<'d>(base: &'d Path, modification: &'d Modification, names: &mut Vec<&'d Name>) {
    if !(base.global || base.parts.len() == 1 && is_builtin(&base.parts[0].name)) {
        names.push(&base.parts[0].name);
    }
    add_redeclared(modification, names);
}

/// The classes that a modification puts in place of others.
fn add_redeclared<'d>(modification: &'d Modification, names: &mut Vec<&'d Name>) {
    for argument in &modification.arguments {
        if let Argument::RedeclareClass { class, .. } = argument {
            names_of_bases(&class.class, names);
        }
    }
}

/// The classes that a class inherits from or is short for, each with what its text says of it.
fn bases(def: &ClassDef) -> Vec<(&Path, &Modification)> {
    match &def.body {
        ClassBody::Short { base, modification, .. } => vec![(base, modification)],
        ClassBody::Long { elements, .. } => elements
            .iter()
            .filter_map(|element| match element {
                Element::Extends(extends) => Some((&extends.base, &extends.modification)),
                _ => None,
            })
            .collect(),
        ClassBody::Enumeration(_) | ClassBody::DerivativeOf(..) => Vec::new(),
    }
}

impl Scopes<'_> {
    /// Notes the class that element `k` of an instance is there, while the classes of the instance are redeclared, where its bases are others
    /// than by the text.
    pub(crate) fn rebase(&mut self, inst: InstId, shape: &Rc<Shape>, k: usize) {
        let name = &shape.elements[k].name;
        let is_done = !self.redeclaring.contains_key(&inst) || self.instances[inst].local_classes.contains_key(name);
        if is_done || self.rebasing.contains(&(inst, k)) {
            return;
        }
        // Definitions may go in circles.
        self.rebasing.push((inst, k));
        let made = self.rebased(inst, shape, k);
        self.rebasing.pop();
        if let Some(local) = made {
            self.instances.edit(inst).local_classes.insert(name.clone(), local);
        }
    }

    fn rebased(&mut self, inst: InstId, shape: &Rc<Shape>, k: usize) -> Option<LocalClass> {
        let element = &shape.elements[k];
        let frames = (shape.frames[0].class, shape.frames[element.frame as usize].class);
        let owner = self.table.class(frames.1).def.clone();
        let Some(Element::Class(nested)) = elements(&owner).get(element.position as usize) else { return None };
        if nested.prefixes.outer || nested.class.encapsulated {
            return None;
        }
        let scope = Scope { inst, frame: element.frame };
        let mut names = Vec::new();
        names_of_bases(&nested.class, &mut names);
        let is_long_package =
            nested.class.kind == ClassKind::Package && matches!(nested.class.body, ClassBody::Long { .. });
        let mut around: Vec<(Name, LocalClass)> = Vec::new();
        for name in names {
            if *name != element.name && around.iter().all(|(known, _)| known != name) {
                around.extend(self.other_class_here(scope, name).map(|meant| (name.clone(), meant)));
            }
        }
        // Functions and constants of a package are found without the instance.
        if is_long_package {
            self.add_others_around(scope, &element.name, &mut around);
        }
        // Definitions that go in circles have no shape.
        let by_text = if around.is_empty() { None } else { self.table.member_class(frames.0, &element.name) }?;
        self.table.shape(by_text).ok()?;
        let def = with_constraint(nested, nested.constrained_by.as_ref());
        // What was said of bases for the instance, such as of `M` in `model N extends M` by `Part p(M(b = 2))`; the text has the last word.
        let (mut mods, mut meant_bases) = (Mods::new(), Vec::new());
        for (base, modification) in bases(&def) {
            if base.global || around.iter().all(|(name, _)| *name != base.parts[0].name) {
                continue;
            }
            let meant = self.quietly(|scopes| scopes.find_class(scope, base)).ok()?;
            let own = AstMod::from_syntax(modification);
            mods.extend(meant.mods.iter().map(|said| Applied { tree: said.tree.beyond(&own).into(), ..said.clone() }));
            meant_bases.push(meant);
        }
        let base = meant_bases.first().filter(|_| matches!(def.body, ClassBody::Short { .. })).map(|meant| meant.class);
        let of_names = around.iter().map(|(_, meant)| meant);
        let contexts =
            of_names.chain(&meant_bases).filter_map(|meant| meant.context).filter(|&context| context != inst);
        let contexts: Vec<InstId> = contexts.collect::<BTreeSet<_>>().into_iter().collect();
        let around: Vec<(Name, ClassId)> = around.into_iter().map(|(name, meant)| (name, meant.class)).collect();
        let key = (frames.0, element.name.clone(), around.clone(), contexts.clone());
        let class = match self.rebased.get(&key) {
            Some(&known) => known,
            None => {
                let mut class = self.table.add(def, Some(frames.0), false);
                let added = self.table.class_mut(class);
                (added.written_in, added.base, added.around) = (Some(frames.1), base, around);
                if matches!(nested.class.kind, ClassKind::Package | ClassKind::Function) {
                    class = self.table.modified_by_extends(frames.0, shape, element, class).unwrap_or(class);
                }
                if !contexts.is_empty() {
                    self.contexts_of_bases.insert(class, contexts);
                }
                self.rebased.insert(key, class);
                class
            }
        };
        mods.extend(self.kept_of_class(inst, shape, element, class));
        Some(LocalClass { class, mods, context: Some(inst) })
    }

    /// The class that is visible in the instance of a scope, or in one around it, where that is another one than by the text alone.
    fn other_class_here(&mut self, scope: Scope, name: &Name) -> Option<LocalClass> {
        let mut at = Some(scope);
        while let Some(scope) = at {
            let shape = self.instances[scope.inst].shape.clone()?;
            if shape.visible(name, scope.frame).is_some_and(|element| !element.component) {
                self.redeclare_when_named(scope.inst, &shape, name);
                return self.instances[scope.inst].local_classes.get(name).cloned();
            }
            at = self.instance_around(scope, &shape);
        }
        None
    }

    /// Adds all classes that are visible from a scope within instances and are others there than by the text alone, but `but`.
    fn add_others_around(&mut self, scope: Scope, but: &Name, around: &mut Vec<(Name, LocalClass)>) {
        let mut at = Some(scope);
        while let Some(scope) = at {
            let Some(shape) = self.instances[scope.inst].shape.clone() else { return };
            for element in shape.elements.iter().filter(|element| !element.component && element.name != *but) {
                if around.iter().all(|(known, _)| *known != element.name) {
                    let meant = self.other_class_here(scope, &element.name);
                    around.extend(meant.map(|meant| (element.name.clone(), meant)));
                }
            }
            at = self.instance_around(scope, &shape);
        }
    }

    /// The scope around the class of an instance, where that is an instance, too.
    fn instance_around(&mut self, scope: Scope, shape: &Shape) -> Option<Scope> {
        let around = self.scope_around(scope.inst, shape, scope.frame).ok().flatten()?;
        (self.instances[around.inst].kind != ClassKind::Package).then_some(around)
    }
}
