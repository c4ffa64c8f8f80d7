//! `outer` elements that no enclosing model declares an `inner` for: one is added at the top where what is wanted is clear, which a warning
//! says (Modelica 3.6, section 5.4), else that is an error.
//!
//! What is clear: all `outer` elements of the name are components of one class, which is a model or a record and not partial.  Where an
//! enclosing model has an `inner` element of a fitting class and another name, or the element without `inner`, a second one beside it would
//! hardly be meant.

use std::rc::Rc;

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{Argument, ClassKind, Component, ElementPrefixes, ExprKind, Modification, Name};

use crate::classes::class::ClassId;
use crate::classes::modifier::Mods;
use crate::classes::shape::Shape;
use crate::instantiation::instance::{InstId, Instance, LocalClass, Scope};
use crate::instantiation::scopes::Scopes;
use crate::instantiation::type_of::TypeOf;

/// An `inner` element that was added at the top.
#[derive(Debug)]
pub(crate) struct AddedInner {
    /// The element.
    inst: InstId,
    /// Its class where that is written, wherever it was inherited to.
    class: ClassId,
    /// The first `outer` declaration of it, and the component of the model's own text that this stands in, if it is elsewhere.
    outer: Span,
    user: Option<Span>,
    /// Other `outer` elements want another class, which has been said.
    refused: bool,
}

impl Scopes<'_> {
    /// The `inner` element for an `outer` one that has none around it: made at the top, or a message.
    pub(crate) fn add_inner(
        &mut self,
        parent: InstId,
        declaration: &Component,
        type_scope: Scope,
    ) -> Result<InstId, Reported> {
        let name = &declaration.name.name;
        let of_class = match self.type_of(type_scope, &declaration.class) {
            Ok(TypeOf::Class(local, shape)) if self.can_be_added(&local, &shape) => Some((local, shape)),
            _ => None,
        };
        let near = self.near_inner(parent, name, of_class.as_ref().map(|(local, _)| local.class));
        let Some((local, shape)) = of_class.filter(|_| near.is_none() && declaration.dims.is_empty()) else {
            let message = format!("no enclosing model declares `inner {name}`");
            let said = Diagnostic::error(Code::UnknownName, message).at(declaration.name.span, "`outer` here");
            let said = match near {
                Some((own, at)) if own == *name => said
                    .with(at, "declared without `inner`")
                    .help(format!("`inner` and `outer` belong together: is `inner` missing at `{own}`?")),
                Some((own, at)) => said
                    .with(at, "an `inner` of another name")
                    .help(format!("`inner` and `outer` must have one name: is `{own}` meant?")),
                None => self.with_other_inner(said, parent, name),
            };
            self.table.report(said);
            return Err(Reported);
        };
        let root = self.instances.tree().root;
        let inst = self.instances.add(Instance::new(name.clone(), Some(root), declaration.name.span));
        let prefixes = ElementPrefixes { inner: true, ..ElementPrefixes::default() };
        let own = Component {
            prefixes,
            modification: Modification::default(),
            condition: None,
            annotation: None,
            ..declaration.clone()
        };
        self.fill(inst, root, &own);
        self.instances.edit(root).children.push(inst);
        self.instances.edit(root).by_name.insert(name.clone(), inst);
        let class = self.table.class(local.class).original.unwrap_or(local.class);
        let user = self.user_of_outer(parent, declaration.name.span);
        let added = AddedInner { inst, class, outer: declaration.name.span, user, refused: false };
        self.added_inner.push(added);
        let depth = std::mem::take(&mut self.depth);
        let made = self.make_component(inst, local, shape, Mods::new(), &own);
        self.depth = depth;
        if made.is_err() {
            self.instances.edit(inst).broken = true;
        }
        Ok(inst)
    }

    /// The component of the model's own text that a declaration of another file stands in.
    fn user_of_outer(&self, parent: InstId, declared: Span) -> Option<Span> {
        let root = &self.instances[self.instances.tree().root];
        let own = root.class.map(|class| self.table.class(class).def.name.span.file)?;
        let at = self.instances[parent].span;
        match at.file == own {
            true => (declared.file != own && self.instances[parent].parent.is_some()).then_some(at),
            false => self.users_line(parent),
        }
    }

    fn can_be_added(&self, local: &LocalClass, shape: &Shape) -> bool {
        let def = &self.table.class(local.class).def;
        let has_defaults =
            matches!(def.kind, ClassKind::Model | ClassKind::Block | ClassKind::Class | ClassKind::Record);
        has_defaults && !def.partial && shape.builtin.is_none()
    }

    /// An element around a component that is likely the one that `outer name` means: of its name without `inner`, or an `inner` one of
    /// another name and a class that fits.
    fn near_inner(&mut self, parent: InstId, name: &Name, wanted: Option<ClassId>) -> Option<(Name, Span)> {
        let mut current = self.instances[parent].parent;
        let mut near = None;
        while let Some(above) = current {
            current = self.instances[above].parent;
            let Some(shape) = self.instances[above].shape.clone() else { continue };
            for element in &shape.elements {
                let Some(own) = self.declared(&shape, element) else { continue };
                if element.name == *name && !own.prefixes.outer {
                    return Some((name.clone(), own.name.span));
                }
                let scope = Scope { inst: above, frame: element.frame };
                if own.prefixes.inner && near.is_none() && self.fits(scope, &own, wanted) {
                    near = Some((element.name.clone(), own.name.span));
                }
            }
        }
        near
    }

    /// True if a component is of a class that can stand for `wanted`.
    fn fits(&mut self, scope: Scope, component: &Component, wanted: Option<ClassId>) -> bool {
        let Some(wanted) = wanted else { return false };
        let found = self.class_quietly(scope, &component.class);
        found.is_some_and(|found| self.quietly(|scopes| scopes.table.why_not(found, wanted)).is_none())
    }

    /// Adds `inner` elements of other names that are around a component to the message about one that is not there.
    fn with_other_inner(&mut self, said: Diagnostic, parent: InstId, name: &Name) -> Diagnostic {
        let mut found: Vec<(String, Span)> = Vec::new();
        let mut current = self.instances[parent].parent;
        while let Some(above) = current {
            if let Some(shape) = self.instances[above].shape.clone() {
                let declared = shape.elements.iter().filter_map(|element| self.declared(&shape, element));
                let inner = declared.filter(|own| own.prefixes.inner);
                found.extend(inner.map(|own| (own.name.name.to_string(), own.name.span)));
            }
            current = self.instances[above].parent;
        }
        let names: Vec<String> = found.iter().map(|(own, _)| format!("`{own}`")).collect();
        match found.as_slice() {
            [] => said.help(format!("declare `inner ... {name};` in the model that is run")),
            [(own, at)] => said
                .with(*at, "an `inner` of another name")
                .help(format!("`inner` and `outer` must have one name: is `{own}` meant?")),
            _ => said.help(format!("`inner` and `outer` must have one name; there are {}", names.join(", "))),
        }
    }

    /// All `outer` elements that mean an added one must be of its class.
    pub(crate) fn check_added(
        &mut self,
        inner: InstId,
        declaration: &Component,
        type_scope: Scope,
    ) -> Result<(), Reported> {
        let Some(k) = self.added_inner.iter().position(|added| added.inst == inner) else { return Ok(()) };
        let Ok(TypeOf::Class(local, _)) = self.type_of(type_scope, &declaration.class) else { return Ok(()) };
        let class = self.table.class(local.class).original.unwrap_or(local.class);
        let added = &mut self.added_inner[k];
        if class == added.class {
            return Ok(());
        }
        added.refused = true;
        let (first, at) = (added.class, added.outer);
        let (first, other) = (self.table.full_name(first), self.table.full_name(class));
        let name = &declaration.name.name;
        let message =
            format!("no enclosing model declares `inner {name}`, which is wanted as `{first}` and as `{other}`");
        let said = Diagnostic::error(Code::UnknownName, message)
            .at(declaration.name.span, format!("`outer` here, a `{other}`"))
            .with(at, format!("and here, a `{first}`"));
        self.table.report(said.help(format!("declare `inner ... {name};` in the model that is run")));
        Err(Reported)
    }

    /// Says which `inner` elements were added.
    pub(crate) fn tell_added_inner(&mut self) {
        for added in std::mem::take(&mut self.added_inner) {
            if added.refused || self.has_failed(added.inst) {
                continue;
            }
            let (name, class) = (self.instances[added.inst].name.clone(), self.table.full_name(added.class));
            let message = format!("no enclosing model declares `inner {name}`: `{class}` is added with its defaults");
            let mut said = Diagnostic::warning(Code::AddedInner, message);
            said = match added.user {
                Some(user) => said.at(user, "needed by this component").with(added.outer, "`outer` here"),
                None => said.at(added.outer, "`outer` here"),
            };
            let text = self.instances[added.inst].shape.clone().and_then(|shape| self.missing_inner_message(&shape));
            let said = said.maybe_help(
                text.map(|text| format!("`{class}` says: {}", text.split_whitespace().collect::<Vec<_>>().join(" "))),
            );
            self.table.report(said.help(format!("declare `inner {class} {name};` in the model that is run")));
        }
    }

    /// What a class, or the nearest base that says something, wants to be said where its `inner` element is missing (section 18.7).
    fn missing_inner_message(&self, shape: &Rc<Shape>) -> Option<Name> {
        let said = |annotation: &Modification| {
            annotation.arguments.iter().find_map(|argument| match argument {
                Argument::Modify(modify) => {
                    let is_named =
                        matches!(modify.target.parts.as_slice(), [only] if only.name.as_ref() == "missingInnerMessage");
                    match modify.modification.binding.as_ref().map(|value| &value.kind) {
                        Some(ExprKind::Text(text)) if is_named => Some(text.clone()),
                        _ => None,
                    }
                }
                _ => None,
            })
        };
        shape.frames.iter().find_map(|frame| self.table.class(frame.class).def.annotation.as_ref().and_then(said))
    }
}
