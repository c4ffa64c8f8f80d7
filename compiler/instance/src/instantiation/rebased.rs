//! Local classes of an instance whose text names a class that is another one there: `function f = S.f` and `model M extends S.M` where a
//! modification of the instance redeclared `S`.
//!
//! What a class inherits is found once, from texts alone (Modelica 3.6, sections 5.3 and 5.6.1).  A class of an instance whose bases differ for
//! the instance therefore becomes a class of its own: the same text, with the classes that its names mean there (`Class::around`).  Instances
//! for which the names mean the same share it.

use std::collections::BTreeSet;
use std::rc::Rc;

use hyd_syntax::tree::{Argument, ClassBody, ClassDef, ClassKind, Element, Modification, Name, NestedClass, Path};

use crate::classes::class::{ClassId, elements};
use crate::classes::heir::with_constraint;
use crate::classes::modifier::{Applied, AstMod, Mods};
use crate::classes::shape::{Shape, ShapeElement, is_builtin};
use crate::instantiation::instance::{InstId, LocalClass, Scope};
use crate::instantiation::scopes::Scopes;

/// What tells variants of a local class apart: the class with the element, its name, what names in it mean, and the instances that these
/// are elements of.
pub(crate) type VariantKey = (ClassId, Name, Vec<(Name, ClassId)>, Vec<InstId>);

/// A text that says what a local class inherits from, and the frame that it stands in: that of the class itself, or of one that it extends
/// by its own name.
struct Written {
    class: NestedClass,
    frame: u32,
}

/// The bases of a local class that are others in its instance.
#[derive(Default)]
struct Bases {
    classes: Vec<LocalClass>,
    /// What was said of them for the instance, such as of `M` in `model N extends M` by `Part p(M(b = 2))`.
    mods: Mods,
    /// The base of a short definition.
    of_short: Option<ClassId>,
}

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
    /// Notes the class that element `k` of an instance is there, while the classes of the instance are redeclared, where its bases differ in
    /// this instance from what the text alone says.
    pub(crate) fn adapt_local_class(&mut self, inst: InstId, shape: &Rc<Shape>, k: usize) {
        let name = &shape.elements[k].name;
        let is_done = !self.redeclaring.contains_key(&inst) || self.instances[inst].local_classes.contains_key(name);
        if is_done || self.adapting.contains(&(inst, k)) {
            return;
        }
        // Definitions may go in circles.
        self.adapting.push((inst, k));
        let made = self.local_variant(inst, shape, k);
        self.adapting.pop();
        if let Some(local) = made {
            self.instances.edit(inst).local_classes.insert(name.clone(), local);
        }
    }

    /// Element `k` of an instance with the bases that it has there; `None` where these are those of the text.
    fn local_variant(&mut self, inst: InstId, shape: &Rc<Shape>, k: usize) -> Option<LocalClass> {
        let element = &shape.elements[k];
        let texts = self.texts_of(shape, k);
        let own = texts.first()?;
        if own.class.prefixes.outer || own.class.class.encapsulated {
            return None;
        }
        let around = self.differing_names(inst, element, &texts);
        // Definitions that go in circles have no shape.
        let by_text = match around.is_empty() {
            true => None,
            false => self.table.member_class(shape.frames[0].class, &element.name),
        }?;
        self.table.shape(by_text).ok()?;
        let bases = self.bases_here(inst, &texts, &around);
        let elsewhere = around.iter().map(|(_, meant)| meant).chain(&bases.classes);
        let contexts: BTreeSet<InstId> =
            elsewhere.filter_map(|meant| meant.context).filter(|&context| context != inst).collect();
        let around: Vec<(Name, ClassId)> = around.into_iter().map(|(name, meant)| (name, meant.class)).collect();
        let key = (shape.frames[0].class, element.name.clone(), around, contexts.into_iter().collect());
        let class = match self.variants.get(&key) {
            Some(&known) => known,
            None => self.add_variant(shape, element, &own.class, bases.of_short, key),
        };
        let mut mods = bases.mods;
        mods.extend(self.kept_of_class(inst, shape, element, class));
        Some(LocalClass { class, mods, context: Some(inst) })
    }

    /// The texts that say what element `k` inherits from, its own first.
    fn texts_of(&self, shape: &Shape, k: usize) -> Vec<Written> {
        let element = &shape.elements[k];
        let text = |frame: u32, is_it: &dyn Fn(usize, &NestedClass) -> bool| {
            let owner = &self.table.class(shape.frames[frame as usize].class).def;
            let nested = elements(owner).iter().enumerate().find_map(|(position, element)| match element {
                Element::Class(nested) if is_it(position, nested) => Some(nested.clone()),
                _ => None,
            });
            nested.map(|class| Written { class, frame })
        };
        let mut texts: Vec<Written> =
            text(element.frame, &|position, _| position == element.position as usize).into_iter().collect();
        // `model extends N`: what `N` inherits from stands in a base.
        while let Some(Written { class, frame }) = texts.last()
            && let ClassBody::Long { extends_from: Some(_), .. } = &class.class.body
        {
            let bases = &shape.frames[*frame as usize].visible[1..];
            let named = |_: usize, nested: &NestedClass| nested.class.name.name == element.name;
            let Some(extended) = bases.iter().find_map(|&base| text(base, &named)) else { break };
            texts.push(extended);
        }
        texts
    }

    /// The names that say what a local class inherits from and mean others in its instance than by the text.
    fn differing_names(&mut self, inst: InstId, element: &ShapeElement, texts: &[Written]) -> Vec<(Name, LocalClass)> {
        let mut around: Vec<(Name, LocalClass)> = Vec::new();
        for Written { class, frame } in texts {
            let scope = Scope { inst, frame: *frame };
            let mut names = Vec::new();
            names_of_bases(&class.class, &mut names);
            for name in names {
                if *name != element.name && around.iter().all(|(known, _)| known != name) {
                    around.extend(self.other_class_here(scope, name).map(|meant| (name.clone(), meant)));
                }
            }
            let is_long = matches!(class.class.body, ClassBody::Long { .. });
            // Functions and constants of a package are found without the instance.
            if is_long && class.class.kind == ClassKind::Package {
                self.add_others_around(scope, &element.name, &mut around);
            }
        }
        around
    }

    /// The bases whose names mean others in an instance; one that does not exist there is said where the class is used.
    fn bases_here(&mut self, inst: InstId, texts: &[Written], around: &[(Name, LocalClass)]) -> Bases {
        let mut found = Bases::default();
        for Written { class: nested, frame } in texts {
            let def = with_constraint(nested, nested.constrained_by.as_ref());
            for (base, modification) in bases(&def) {
                if base.global || around.iter().all(|(name, _)| *name != base.parts[0].name) {
                    continue;
                }
                let scope = Scope { inst, frame: *frame };
                let Ok(meant) = self.quietly(|scopes| scopes.find_class(scope, base)) else { continue };
                // The text has the last word.
                let own = AstMod::from_syntax(modification);
                let said = meant.mods.iter();
                found.mods.extend(said.map(|said| Applied { tree: said.tree.beyond(&own).into(), ..said.clone() }));
                if texts.len() == 1 && matches!(def.body, ClassBody::Short { .. }) {
                    found.of_short = Some(meant.class);
                }
                found.classes.push(meant);
            }
        }
        found
    }

    /// Makes the class of an element whose names mean what the key says.
    fn add_variant(
        &mut self,
        shape: &Rc<Shape>,
        element: &ShapeElement,
        nested: &NestedClass,
        base: Option<ClassId>,
        key: VariantKey,
    ) -> ClassId {
        let (of, text) = (shape.frames[0].class, shape.frames[element.frame as usize].class);
        let mut class = self.table.add(with_constraint(nested, nested.constrained_by.as_ref()), Some(of), false);
        let added = self.table.class_mut(class);
        (added.written_in, added.base, added.around) = (Some(text), base, key.2.clone());
        if matches!(nested.class.kind, ClassKind::Package | ClassKind::Function) {
            class = self.table.modified_by_extends(of, shape, element, class).unwrap_or(class);
        }
        if !key.3.is_empty() {
            self.contexts_of_bases.insert(class, key.3.clone());
        }
        self.variants.insert(key, class);
        class
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

    /// Adds all classes that are visible from a scope within instances and differ there from what the text alone says, but `but`.
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
