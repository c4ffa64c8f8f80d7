//! Classes as elements of the class that inherits them.
//!
//! An inherited class is not the class of its text but the same text read in the heir (Modelica 3.6, sections 5.6.1 and 7.1):
//! with `package Oil extends Water(rho = 850)` a function `Oil.f` reads `Oil.rho`.  So a class found among inherited elements
//! becomes a class of its own, whose names are looked up in the heir first and then around the text it is written in.
//! Redeclarations of the `extends` clauses on the way replace it.

use std::rc::Rc;
use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{
    Argument, ClassBody, ClassDef, ClassKind, Constraint, Element, ElementModification, Ident, Modification, Name,
    NestedClass, Path,
};

use crate::classes::class::{ClassId, ClassTable, elements};
use crate::classes::modifier::{AstMod, Redeclare};
use crate::classes::shape::{Shape, ShapeElement};

/// One level of name lookup: the class whose elements are seen, and the class whose text is read.  They differ where the
/// text was inherited.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Level {
    /// Its elements are seen.
    pub members: ClassId,
    /// Its imports count, and what is around it comes next.
    pub text: ClassId,
}

impl ClassTable<'_> {
    /// The level around another one; `None` at the top and around an encapsulated class.
    pub(crate) fn outwards(&self, level: Level) -> Option<Level> {
        let class = self.class(level.text);
        if class.def.encapsulated {
            return None;
        }
        let members = class.parent?;
        Some(Level { members, text: class.written_in.unwrap_or(members) })
    }

    /// A class among the elements of `class`, own or inherited.
    pub fn member_class(&mut self, class: ClassId, name: &Name) -> Option<ClassId> {
        if let Some(own) = self.child(class, name) {
            return Some(own);
        }
        if let Some(known) = self.known_inherited(class, name) {
            return Some(known);
        }
        if self.class(class).shape.is_none() && self.is_open(class) {
            return None;
        }
        if !self.class(class).has_bases {
            return None;
        }
        let shape = self.shape(class).ok()?;
        self.inherited(class, &shape, name)
    }

    /// A class seen at a level of name lookup.
    pub(crate) fn seen(&mut self, level: Level, name: &Name) -> Option<ClassId> {
        if level.members != level.text
            && let Ok(shape) = self.shape(level.members)
            && shape.by_name.contains_key(name)
            && let Some(frame) = shape.frames.iter().position(|f| f.class == level.text)
            && shape.visible(name, frame as u32).is_none()
        {
            return None;
        }
        self.member_class(level.members, name)
    }

    fn inherited(&mut self, heir: ClassId, shape: &Rc<Shape>, name: &Name) -> Option<ClassId> {
        let element = shape.by_name.get(name).map(|&k| &shape.elements[k as usize]);
        let found = match element {
            Some(element) if element.component => return None,
            Some(element) => {
                if let Some(class) = self.redeclared_by_extends(heir, shape, element) {
                    self.name_inherited(heir, name, class);
                    return Some(class);
                }
                let base = shape.frames[element.frame as usize].class;
                self.child(base, name).map(|original| (original, base))
            }
            // A file of the folder of a base.
            None => shape.frames[1..].iter().find_map(|f| self.child(f.class, name).map(|class| (class, f.class))),
        };
        let (original, base) = found?;
        let mut class = self.add_heir(original, heir, base);
        if let Some(modified) = element.and_then(|element| self.modified_by_extends(heir, shape, element, class)) {
            class = modified;
        }
        self.name_inherited(heir, name, class);
        Some(class)
    }

    /// `extends Medium(Density(start = 10))`: the inherited class with the modification, as a short definition of its name.
    pub(crate) fn modified_by_extends(
        &mut self,
        heir: ClassId,
        shape: &Shape,
        element: &ShapeElement,
        class: ClassId,
    ) -> Option<ClassId> {
        let mut modified = None;
        // The outermost comes first; it has the last word.
        for (frame, tree) in shape.frames[element.frame as usize].modifications.iter().rev() {
            let child = tree.children.iter().find(|(n, t)| *n == element.name && !t.children.is_empty());
            let Some(modification) = child.and_then(|(_, tree)| to_syntax(tree)) else { continue };
            let base = modified.unwrap_or(class);
            let original = self.class(class).def.clone();
            let span = modification.span.unwrap_or(original.span);
            let name = Ident { name: element.name.clone(), span };
            let body = ClassBody::Short {
                direction: None,
                flow: false,
                base: Path { global: false, parts: vec![name], span },
                dims: Vec::new(),
                modification,
            };
            let def = ClassDef { body, annotation: None, partial: false, ..(*original).clone() };
            let added = self.add(Arc::new(def), Some(heir), false);
            self.class_mut(added).base = Some(base);
            if *frame != 0 {
                self.class_mut(added).written_in = Some(shape.frames[*frame as usize].class);
            }
            modified = Some(added);
        }
        modified
    }

    /// `original`, which `base` holds, as an element of `heir`.
    pub(crate) fn add_heir(&mut self, original: ClassId, heir: ClassId, base: ClassId) -> ClassId {
        let (def, named) = (self.class(original).def.clone(), self.class(original).base);
        let first = self.class(original).original.unwrap_or(original);
        let class = self.add(def, Some(heir), false);
        let added = self.class_mut(class);
        added.written_in = Some(base);
        added.original = Some(first);
        added.base = named;
        class
    }

    /// The class that a redeclaration in an `extends` clause puts in place of an inherited one, the outermost first.
    fn redeclared_by_extends(&mut self, heir: ClassId, shape: &Shape, element: &ShapeElement) -> Option<ClassId> {
        let modifications = &shape.frames[element.frame as usize].modifications;
        let (frame, tree) = modifications.iter().find_map(|(frame, tree)| {
            let (_, tree) = tree.children.iter().find(|(n, t)| *n == element.name && t.redeclare.is_some())?;
            Some((*frame, tree.clone()))
        })?;
        let Some(Redeclare::Class(new)) = &tree.redeclare else { return None };
        let owner = self.class(shape.frames[element.frame as usize].class).def.clone();
        let Element::Class(original) = &elements(&owner)[element.position as usize] else { return None };
        if !original.prefixes.replaceable {
            self.not_replaceable(&element.name, tree.span, original.class.name.span);
            return None;
        }
        let def = with_constraint(new, original.constrained_by.as_ref());
        let by = shape.frames[frame as usize].class;
        let named = self.named_outside(by, &def);
        let class = self.add(def, Some(heir), false);
        self.class_mut(class).base = named;
        // A short definition is not a scope of its own (4.5.1): what its modification says is read in what is around.
        let around = match &self.class(by).def.body {
            ClassBody::Short { .. } => self.outwards(Level { members: by, text: by }),
            _ => None,
        };
        if let Some(around) = around {
            let added = self.class_mut(class);
            added.parent = Some(around.members);
            added.written_in = Some(around.text);
        } else if frame != 0 {
            self.class_mut(class).written_in = Some(shape.frames[frame as usize].class);
        }
        Some(class)
    }

    /// The class that a redeclaration in the modification of a short definition names: the definition is not a scope of its own (4.5.1), so a
    /// name that it redeclares means what is around.  `None` where the text of the redeclaration says it.
    fn named_outside(&mut self, class: ClassId, new: &ClassDef) -> Option<ClassId> {
        let ClassBody::Short { base, .. } = &new.body else { return None };
        let first = &base.parts[0].name;
        let of_instance = self.class(class).meant_around(first);
        if let Some(found) = of_instance.filter(|_| !base.global) {
            return base.parts[1..].iter().try_fold(found, |class, part| self.member_class(class, &part.name));
        }
        let around = &self.class(class).def;
        // What packages name further inside is found from classes alone, which know nothing of redeclarations for an instance.
        if base.global || around.kind == ClassKind::Package || !matches!(around.body, ClassBody::Short { .. }) {
            return None;
        }
        let mut level = self.outwards(Level { members: class, text: class });
        while let Some(around) = level {
            if let Some(found) = self.seen(around, first).or_else(|| self.imported(around.text, first)) {
                return base.parts[1..].iter().try_fold(found, |class, part| self.member_class(class, &part.name));
            }
            level = self.outwards(around);
        }
        None
    }

    /// The class that `redeclare model extends X` extends: the inherited `X`.
    pub(crate) fn extended(&mut self, class: ClassId, span: Span) -> Result<ClassId, Reported> {
        let (name, parent) = (self.class(class).def.name.name.clone(), self.class(class).parent);
        let text = self.class(class).written_in.or(parent);
        let found = match (parent, text) {
            (Some(parent), Some(text)) if !self.is_open(parent) => {
                let shape = self.shape(parent)?;
                let from = shape.frames.iter().position(|f| f.class == text).unwrap_or(0);
                let bases = shape.frames[from].visible.iter().skip(1).map(|&f| shape.frames[f as usize].class);
                let bases: Vec<ClassId> = bases.collect();
                let found = bases.into_iter().find_map(|base| Some((self.child(base, &name)?, base)));
                let around = self.class(class).around.clone();
                found.map(|(original, base)| {
                    let extended = self.add_heir(original, parent, base);
                    // What differs for an instance does so for what is extended, too.
                    self.class_mut(extended).around = around;
                    extended
                })
            }
            _ => None,
        };
        found.ok_or_else(|| {
            let message = format!("there is no inherited class `{name}` to extend");
            self.report(Diagnostic::error(Code::Redeclaration, message).at(span, "extended here"));
            Reported
        })
    }

    /// The name of a class where it is written, wherever it was inherited to: enumerations are the same type there.
    pub(crate) fn original_name(&self, class: ClassId) -> String {
        self.full_name(self.class(class).original.unwrap_or(class))
    }
}

/// The new class of a redeclaration with the modifiers of the constraining clause behind its own (7.3.2).
pub(crate) fn with_constraint(new: &NestedClass, constraint: Option<&Constraint>) -> Arc<ClassDef> {
    let (Some(constraint), ClassBody::Short { modification, .. }) = (constraint, &new.class.body) else {
        return new.class.clone();
    };
    if constraint.modification.arguments.is_empty() {
        return new.class.clone();
    }
    let own: Vec<&Name> = modification.arguments.iter().map(argument_name).collect();
    let kept = constraint.modification.arguments.iter().filter(|a| !own.contains(&argument_name(a)));
    let mut merged: Modification = modification.clone();
    merged.arguments.extend(kept.cloned());
    let mut def = (*new.class).clone();
    if let ClassBody::Short { modification, .. } = &mut def.body {
        *modification = merged;
    }
    Arc::new(def)
}

fn argument_name(argument: &hyd_syntax::tree::Argument) -> &Name {
    use hyd_syntax::tree::Argument;
    match argument {
        Argument::Modify(modify) => &modify.target.parts[0].name,
        Argument::RedeclareComponent { component, .. } => &component.name.name,
        Argument::RedeclareClass { class, .. } => &class.class.name.name,
    }
}

/// The modification that a tree came from; nothing if it redeclares.
fn to_syntax(tree: &AstMod) -> Option<Modification> {
    let argument = |(name, child): &(Name, Arc<AstMod>)| {
        if child.redeclare.is_some() {
            return None;
        }
        let span = child.span.or(tree.span)?;
        let target = Path { global: false, parts: vec![Ident { name: name.clone(), span }], span };
        Some(Argument::Modify(ElementModification {
            each: child.each,
            is_final: child.is_final,
            target,
            modification: to_syntax(child)?,
            description: None,
            span,
        }))
    };
    let arguments = tree.children.iter().map(argument).collect::<Option<Vec<_>>>()?;
    Some(Modification { arguments, binding: tree.binding.as_deref().cloned(), span: tree.span })
}
