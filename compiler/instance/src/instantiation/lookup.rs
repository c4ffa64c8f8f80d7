//! Name lookup: classes lexically and through instances, components from a scope.
//!
//! Modelica 3.6, section 5.3: the first identifier is looked for among the elements of the class (inherited ones included),
//! then its imports, then the same in the enclosing classes, where only constants count as components; the others follow
//! from there.

use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{
    ClassBody, ClassKind, ComponentRef, Element, Expr, Ident, ImportKind, Name, NestedClass, Path, Variability,
};

use crate::classes::class::{ClassId, elements, imports};
use crate::classes::heir::Level;
use crate::classes::modifier::{AstMod, Mods};
use crate::classes::shape::{Shape, ShapeElement, is_builtin};
use crate::instantiation::instance::{InstId, LocalClass, Scope};
use crate::instantiation::redeclare::applied_of;
use crate::instantiation::scopes::Scopes;
use crate::values::value::EnumType;

/// What a reference names.
#[derive(Clone, Debug)]
pub enum Resolved<'e> {
    /// A component: every step from the outermost named instance inwards, with the subscripts written there.
    Variable(Vec<(InstId, &'e [Expr])>),
    /// A literal of an enumeration.
    Literal(Arc<EnumType>, u32),
    /// A class (a function, a record, a type).
    Class(LocalClass),
    /// `time`
    Time,
}

/// The literals of a predefined enumeration.
pub(crate) fn predefined_enumeration(name: &str) -> Option<Arc<EnumType>> {
    let literals: &[&str] = match name {
        "StateSelect" => &["never", "avoid", "default", "prefer", "always"],
        "AssertionLevel" => &["warning", "error"],
        _ => return None,
    };
    let literals = literals.iter().map(|&literal| literal.into()).collect();
    Some(Arc::new(EnumType { name: name.into(), literals, descriptions: Vec::new() }))
}

/// The level of what stands in no class.
const TOP: usize = usize::MAX;

impl Scopes<'_> {
    /// The class a name means in a scope, redeclarations included.
    pub fn find_class(&mut self, scope: Scope, path: &Path) -> Result<LocalClass, Reported> {
        let first = &path.parts[0];
        if !path.global
            && let Some(found) = self.first_class(scope, &first.name)
        {
            return match path.parts.len() {
                1 => Ok(found),
                _ => {
                    let class = self.table.descend(found.class, &path.parts[1..])?;
                    Ok(self.read_in(found.context, class))
                }
            };
        }
        let from = self.instances[scope.inst].shape.as_ref().map(|s| s.frames[scope.frame as usize].class);
        let Some(class) = from else {
            self.table.unknown_class(None, &path.parts);
            return Err(Reported);
        };
        self.table.find_class_static(class, path, false).map(LocalClass::plain)
    }

    /// A class by its name, for checks: builtin types and what is not found give nothing.
    pub(crate) fn class_quietly(&mut self, scope: Scope, path: &Path) -> Option<ClassId> {
        if path.parts.len() == 1 && is_builtin(&path.parts[0].name) {
            return None;
        }
        self.quietly(|scopes| scopes.find_class(scope, path)).ok().map(|local| local.class)
    }

    /// The class an identifier means in a scope: an element of the instance, or of what is around its class.
    pub(crate) fn first_class(&mut self, scope: Scope, name: &Name) -> Option<LocalClass> {
        self.class_at(scope, name, &mut 0)
    }

    /// The same, with the number of levels that were left on the way added.
    fn class_at(&mut self, scope: Scope, name: &Name, depth: &mut usize) -> Option<LocalClass> {
        let shape = self.instances[scope.inst].shape.clone()?;
        if let Some(element) = shape.visible(name, scope.frame).filter(|e| !e.component) {
            if let Some(inner) = self.inner_class(scope.inst, &shape, element) {
                return self.class_at(inner, name, depth);
            }
            self.redeclare_when_named(scope.inst, &shape, name);
            if let Some(local) = self.instances[scope.inst].local_classes.get(name) {
                return Some(local.clone());
            }
            let package = self.instances[scope.inst].kind == ClassKind::Package;
            let context = (!package).then_some(scope.inst);
            let class = self.table.member_class(shape.frames[0].class, name)?;
            let mods = self.kept_of_class(scope.inst, &shape, element, class);
            return Some(LocalClass { class, mods, context });
        }
        let from = shape.frames[scope.frame as usize].class;
        let mut level = Level { members: if scope.frame == 0 { from } else { shape.frames[0].class }, text: from };
        loop {
            let found = self.table.seen(level, name).or_else(|| self.table.imported(level.text, name));
            if let Some(class) = found {
                return Some(self.local_of(scope.inst, class));
            }
            let Some(next) = self.table.outwards(level) else { break };
            *depth += 1;
            if let Some(around) = self.scope_of_level(scope.inst, next) {
                return self.class_at(around, name, depth);
            }
            if let Some(class) = self.table.class(level.text).meant_around(name) {
                return Some(LocalClass::plain(class));
            }
            level = next;
        }
        *depth = TOP;
        self.table.top(name).map(LocalClass::plain)
    }

    /// A class of a package that is an element of the instance `context`: where its text is part of that of the instance's class, its names
    /// mean what they mean in the instance.
    fn read_in(&self, context: Option<InstId>, class: ClassId) -> LocalClass {
        LocalClass { context: context.filter(|&inst| self.is_written_in(inst, class)), ..LocalClass::plain(class) }
    }

    /// For an `outer` class: where the `inner` class of that name is declared.
    fn inner_class(&self, inst: InstId, shape: &Shape, element: &ShapeElement) -> Option<Scope> {
        let prefixes = |shape: &Shape, element: &ShapeElement| {
            let owner = self.table.class(shape.frames[element.frame as usize].class);
            match elements(&owner.def).get(element.position as usize) {
                Some(Element::Class(nested)) => Some(nested.prefixes.clone()),
                _ => None,
            }
        };
        let own = prefixes(shape, element)?;
        if !own.outer || own.inner {
            return None;
        }
        let mut current = self.instances[inst].parent;
        while let Some(above) = current {
            if let Some(shape) = &self.instances[above].shape
                && let Some(&k) = shape.by_name.get(&element.name)
                && prefixes(shape, &shape.elements[k as usize]).is_some_and(|p| p.inner)
            {
                return Some(Scope { inst: above, frame: shape.elements[k as usize].frame });
            }
            current = self.instances[above].parent;
        }
        None
    }

    /// What a reference names; gives a message if nothing.
    pub fn resolve<'e>(&mut self, scope: Scope, reference: &'e ComponentRef) -> Result<Resolved<'e>, Reported> {
        let first = &reference.parts[0];
        let name = &first.name.name;
        if !reference.global {
            if let Some(inst) = self.component_of(scope, name)? {
                return self.steps(inst, reference, 0);
            }
            if name.as_ref() == "time" && reference.parts.len() == 1 {
                return Ok(Resolved::Time);
            }
        }
        if let Some(found) = self.through_classes(scope, reference)? {
            return Ok(found);
        }
        self.unknown_name(scope, reference);
        Err(Reported)
    }

    /// Follows the parts after `at` through the components of `inst`.
    fn steps<'e>(&mut self, inst: InstId, reference: &'e ComponentRef, at: usize) -> Result<Resolved<'e>, Reported> {
        let last = reference.parts.len() - 1;
        let first = self.step(inst, reference, at, at == last)?;
        let mut steps = vec![first];
        let mut current = first.0;
        for (k, part) in reference.parts.iter().enumerate().skip(at + 1) {
            let name = &part.name.name;
            // A component that is being made has its elements when they are named.
            if !self.instances[current].by_name.contains_key(name) && self.pending.contains_key(&current) {
                self.component_of(Scope { inst: current, frame: 0 }, name)?;
            }
            match self.instances[current].by_name.get(name) {
                Some(&next) => {
                    if self.instances[next].protected
                        && !self.instances[current].protected
                        && self.instances[next].parent == Some(current)
                    {
                        self.protected(next, current, part.name.span);
                        return Err(Reported);
                    }
                    current = next;
                }
                None if self.instances[current].absent => {
                    let what = &self.instances[current];
                    let message = format!("`{}` does not exist here: its condition is false", what.name);
                    let declared = what.span;
                    self.table.report(
                        Diagnostic::error(Code::UnknownName, message)
                            .at(reference.span, "")
                            .with(declared, "declared with a condition here"),
                    );
                    return Err(Reported);
                }
                None if self.is_broken(current) => return Err(Reported),
                None => {
                    if let Some(class) = self.class_through(current, name).filter(|_| k == last) {
                        return Ok(Resolved::Class(class));
                    }
                    self.unknown_member(current, name, part.name.span);
                    return Err(Reported);
                }
            }
            let step = self.step(current, reference, k, k == last)?;
            current = step.0;
            steps.push(step);
        }
        Ok(Resolved::Variable(steps))
    }

    /// A function among the elements of a component's class, which reads the component (Modelica 3.6, section 5.3.2).
    fn class_through(&mut self, inst: InstId, name: &Name) -> Option<LocalClass> {
        let shape = self.instances[inst].shape.clone()?;
        shape.by_name.get(name).filter(|&&k| !shape.elements[k as usize].component)?;
        let local = self.first_class(Scope { inst, frame: 0 }, name)?;
        (self.table.class(local.class).def.kind == ClassKind::Function).then_some(local)
    }

    /// What part `k` of a reference, which names `inst`, means: the element of an array made in parts takes its subscripts.
    fn step<'e>(
        &mut self,
        inst: InstId,
        reference: &'e ComponentRef,
        k: usize,
        last: bool,
    ) -> Result<(InstId, &'e [Expr]), Reported> {
        let subscripts = reference.parts[k].subscripts.as_slice();
        if self.instances[inst].parts.is_empty() || last && subscripts.is_empty() {
            return Ok((inst, subscripts));
        }
        match self.part_at(inst, subscripts) {
            Some(part) => Ok((part, &[])),
            None => Err(self.no_such_part(inst, subscripts, reference.span)),
        }
    }

    fn protected(&mut self, inst: InstId, parent: InstId, span: Span) {
        let (name, what) = (&self.instances[inst].name, &self.instances[parent].name);
        let message = format!("`{name}` is protected in `{what}` and cannot be used from outside");
        let declared = self.instances[inst].span;
        self.table.report(Diagnostic::error(Code::Misplaced, message).at(span, "").with(declared, "declared here"));
    }

    fn unknown_member(&mut self, inst: InstId, name: &str, span: Span) {
        let message = format!("`{}` has no element `{name}`", self.instances[inst].name);
        if self.table.messages.is_repeated(&message, span) {
            return;
        }
        let names: Vec<Name> = self.instances[inst].by_name.keys().cloned().collect();
        let mut sorted: Vec<&str> = names.iter().map(|n| n.as_ref()).collect();
        sorted.sort_unstable();
        let declared = self.instances[inst].span;
        self.table.report(
            Diagnostic::error(Code::UnknownName, message).at(span, "not found").with(declared, "declared here").meant(
                span,
                name,
                sorted.iter().copied(),
            ),
        );
    }

    /// References that start with a class: literals, package constants, functions.
    fn through_classes<'e>(
        &mut self,
        scope: Scope,
        reference: &'e ComponentRef,
    ) -> Result<Option<Resolved<'e>>, Reported> {
        let first = &reference.parts[0].name;
        if reference.parts.len() == 2
            && let Some(enumeration) = predefined_enumeration(&first.name)
        {
            return self.literal(enumeration, reference, 1).map(Some);
        }
        let mut depth = 0;
        let found = match reference.global {
            true => self.table.top(&first.name).map(LocalClass::plain),
            false => self.class_at(scope, &first.name, &mut depth),
        };
        // A package is not a value: a constant of that name further out is meant, and one further in hides it.
        let is_package =
            |scopes: &Self, local: &LocalClass| scopes.table.class(local.class).def.kind == ClassKind::Package;
        let within = match (reference.parts.len(), depth) {
            (1, _) => usize::MAX,
            // Nobody calls a constant like a library, and looking for one would be dear.
            (_, TOP) => 0,
            _ => depth,
        };
        if !reference.global
            && let Some(local) = &found
            && is_package(self, local)
            && let Some(inst) = self.enclosing_constant(scope, &first.name, within)?
        {
            return self.steps(inst, reference, 0).map(Some);
        }
        let Some(mut local) = found else {
            return match self.enclosing_constant(scope, &first.name, usize::MAX)? {
                Some(inst) => self.steps(inst, reference, 0).map(Some),
                None => Ok(None),
            };
        };
        for (k, part) in reference.parts.iter().enumerate().skip(1) {
            if let Some(enumeration) = self.enumeration(local.class) {
                return self.literal(enumeration, reference, k).map(Some);
            }
            if let Some(class) = self.table.member_class(local.class, &part.name.name) {
                local = self.read_in(local.context, class);
                continue;
            }
            if let Some(inst) = self.package_constant(&local, &part.name.name)? {
                return self.steps(inst, reference, k).map(Some);
            }
            let class = self.table.full_name(local.class);
            if self.table.shape(local.class)?.by_name.contains_key(&part.name.name) {
                let message = format!("`{class}` is a class: `{}` exists only in components of it", part.name.name);
                self.table.report(
                    Diagnostic::error(Code::UnknownName, message)
                        .at(part.name.span, "")
                        .help(format!("declare a component, such as `{class} part;`, and use its element")),
                );
                return Err(Reported);
            }
            let last = &reference.parts[reference.parts.len() - 1].name.name;
            let message = format!("`{class}` has no element `{}`", part.name.name);
            let error = Diagnostic::error(Code::UnknownName, message).at(part.name.span, "not found");
            let error = self.table.meant_inside(error, local.class, &part.name, last);
            self.table.report(error);
            return Err(Reported);
        }
        Ok(Some(Resolved::Class(local)))
    }

    /// A constant of what is around the class, by its simple name, or through an import, so many levels out at most.
    fn enclosing_constant(&mut self, scope: Scope, name: &Name, mut levels: usize) -> Result<Option<InstId>, Reported> {
        let Some(shape) = self.instances[scope.inst].shape.clone() else { return Ok(None) };
        let text = shape.frames[scope.frame as usize].class;
        let mut level = Level { members: shape.frames[0].class, text };
        loop {
            if levels == 0 {
                return Ok(None);
            }
            if let Some(inst) = self.imported_constant(level.text, name)? {
                return Ok(Some(inst));
            }
            let Some(next) = self.table.outwards(level) else { return Ok(None) };
            levels -= 1;
            if let Some(around) = self.scope_of_level(scope.inst, next) {
                let own = self.component_of(around, name)?;
                return match own.filter(|&inst| self.instances[inst].variability <= Variability::Constant) {
                    Some(inst) => Ok(Some(inst)),
                    None => self.enclosing_constant(around, name, levels),
                };
            }
            let package = self.local_of(scope.inst, next.members);
            if let Some(inst) = self.package_constant(&package, name)? {
                return Ok(Some(inst));
            }
            level = next;
        }
    }

    fn imported_constant(&mut self, class: ClassId, name: &Name) -> Result<Option<InstId>, Reported> {
        let def = self.table.class(class).def.clone();
        for import in imports(&def) {
            let parts = &import.path.parts;
            let (package, element): (&[Ident], &Name) = match &import.what {
                ImportKind::Qualified if parts.len() > 1 && parts[parts.len() - 1].name == *name => {
                    (&parts[..parts.len() - 1], name)
                }
                ImportKind::Renamed(alias) if parts.len() > 1 && alias.name == *name => {
                    (&parts[..parts.len() - 1], &parts[parts.len() - 1].name)
                }
                ImportKind::Several(names) if names.iter().any(|n| n.name == *name) => (parts, name),
                ImportKind::All => (parts, name),
                _ => continue,
            };
            if let Some(package) = self.table.absolute(package)
                && let Some(inst) = self.package_constant(&LocalClass::plain(package), element)?
            {
                return Ok(Some(inst));
            }
        }
        Ok(None)
    }

    /// A constant (or parameter with a value) declared in a package.
    pub(crate) fn package_constant(&mut self, local: &LocalClass, name: &Name) -> Result<Option<InstId>, Reported> {
        let shape = self.table.shape(local.class)?;
        let Some(&k) = shape.by_name.get(name) else { return Ok(None) };
        if !shape.elements[k as usize].component {
            return Ok(None);
        }
        let inst = self.package_of(local)?;
        if let Some(&known) = self.instances[inst].by_name.get(name) {
            return Ok(Some(known));
        }
        (self.make_element)(self, inst, k as usize, &Vec::new())?;
        let Some(&made) = self.instances[inst].by_name.get(name) else { return Ok(None) };
        Ok((self.instances[made].variability <= Variability::Parameter).then_some(made))
    }

    fn literal<'e>(
        &mut self,
        enumeration: Arc<EnumType>,
        reference: &ComponentRef,
        at: usize,
    ) -> Result<Resolved<'e>, Reported> {
        let part = &reference.parts[at].name;
        match enumeration.literals.iter().position(|l| *l == part.name) {
            Some(k) if at + 1 == reference.parts.len() => Ok(Resolved::Literal(enumeration, k as u32 + 1)),
            _ => {
                let message = format!("`{}` has no literal `{}`", enumeration.name, part.name);
                let error = Diagnostic::error(Code::UnknownName, message).at(part.span, "not found");
                let literals = enumeration.literals.iter().map(|l| l.as_ref());
                self.table.report(error.meant(part.span, &part.name, literals));
                Err(Reported)
            }
        }
    }

    /// The enumeration a class is, if it is one (through short definitions).
    pub fn enumeration(&mut self, class: ClassId) -> Option<Arc<EnumType>> {
        if let Some(known) = self.enumerations.get(&class) {
            return known.clone();
        }
        let mut found = None;
        if let Ok(shape) = self.table.shape(class)
            && let Some(frame) = shape.frames.last()
            && let ClassBody::Enumeration(Some(literals)) = &self.table.class(frame.class).def.body
        {
            let name = self.table.original_name(frame.class).into();
            let descriptions = literals.iter().map(|literal| literal.description.clone()).collect();
            let literals = literals.iter().map(|literal| literal.name.name.clone()).collect();
            found = Some(Arc::new(EnumType { name, literals, descriptions }));
        }
        self.enumerations.insert(class, found.clone());
        found
    }

    /// What the constraining clause said of a class that a `redeclare` element of this class or a base replaces.
    /// Its own modifiers come first.
    pub(crate) fn kept_of_class(
        &mut self,
        inst: InstId,
        shape: &Shape,
        element: &ShapeElement,
        class: ClassId,
    ) -> Mods {
        let Some((frame, position)) = element.replaced else { return Mods::new() };
        let owner = self.table.class(shape.frames[frame as usize].class).def.clone();
        match elements(&owner).get(position as usize) {
            Some(Element::Class(NestedClass { constrained_by: Some(constraint), .. })) => {
                let mut tree = AstMod::from_syntax(&constraint.modification);
                if let ClassBody::Short { modification, .. } = &self.table.class(class).def.body {
                    let own = AstMod::from_syntax(modification);
                    tree.children.retain(|(name, _)| own.children.iter().all(|(other, _)| other != name));
                }
                vec![applied_of(tree, Scope { inst, frame })]
            }
            _ => Mods::new(),
        }
    }
}
