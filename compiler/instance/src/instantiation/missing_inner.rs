//! `outer` elements that no enclosing model declares an `inner` for: one is added at the top where what is wanted is clear, which a warning
//! says (Modelica 3.6, section 5.4), else that is an error.
//!
//! What is clear: all `outer` elements of the name are components of one class, of which the same is said, and which is a model or a record
//! and not partial.  Where an enclosing model has an `inner` element of the class and another name, or a fitting one of the name without the
//! prefix `inner`, a second one beside it would hardly be meant.

use std::rc::Rc;
use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Edit, Reported, Span};
use hyd_syntax::print_expr;
use hyd_syntax::tree::{
    Argument, ClassBody, ClassKind, Component, ElementPrefixes, Expr, ExprKind, Modification, Name, Variability,
};

use crate::classes::class::ClassId;
use crate::classes::modifier::{AstMod, Mods};
use crate::classes::shape::Shape;
use crate::instantiation::instance::{InstId, Instance, LocalClass, Scope, chain};
use crate::instantiation::scopes::Scopes;
use crate::instantiation::type_of::TypeOf;

/// An `inner` element that was added at the top.
#[derive(Debug)]
pub(crate) struct AddedInner {
    /// The element.
    pub inst: InstId,
    /// What its `outer` elements want.
    wanted: Wanted,
    /// The component with the first `outer` declaration of it, this, and the component of the model's own text that it stands in, if it is
    /// elsewhere.
    parent: InstId,
    outer: Span,
    user: Option<Span>,
    /// An `outer` element outside of arrays without elements means it.
    needed: bool,
    /// Other `outer` elements want another class, which has been said.
    refused: bool,
}

/// The class that an `outer` element wants.
#[derive(Debug)]
struct Wanted {
    /// The class where that is written, wherever it was inherited to and whatever short names it has.
    class: ClassId,
    /// What is said of it for the instance.
    mods: Mods,
    /// A declaration elsewhere that names the class means the same.
    by_text: bool,
}

/// An element around a component that keeps an `inner` one from being added.
enum Near {
    /// One of the name that fits and lacks the prefix `inner`, and where that may stand, if nothing is in its way.
    Unmarked(Span, Option<Span>),
    /// An `inner` one of the class and another name.
    OtherName(Name, Span),
    /// Something else of the name in the model that is run.
    InTheWay(Span),
}

/// Before the type of a declaration that no other prefix precedes.
fn before_type(declaration: &Component) -> Option<Span> {
    let is_bare = declaration.variability == Variability::Continuous
        && declaration.direction.is_none()
        && !(declaration.flow || declaration.stream || declaration.prefixes.replaceable);
    is_bare.then_some(Span { end: declaration.class.span.start, ..declaration.class.span })
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
        self.refuse_beside(parent, declaration, of_class.as_ref().map(|(local, _)| local.class))?;
        let Some((local, shape)) = of_class.filter(|_| declaration.dims.is_empty()) else {
            let said = self.with_other_inner(no_inner(declaration), parent, name);
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
        let wanted = self.wanted(&local);
        let added = AddedInner {
            inst,
            wanted,
            parent,
            outer: declaration.name.span,
            user: self.user_of_outer(parent, declaration.name.span),
            needed: self.has_elements(parent),
            refused: false,
        };
        self.added_inner.push(added);
        let depth = std::mem::take(&mut self.depth);
        let made = self.make_component(inst, local, shape, Mods::new(), &own);
        self.depth = depth;
        if made.is_err() {
            self.instances.edit(inst).broken = true;
        }
        Ok(inst)
    }

    fn has_elements(&self, inst: InstId) -> bool {
        chain(&self.instances, inst).into_iter().all(|around| !self.instances[around].dims.contains(&0))
    }

    fn wanted(&mut self, local: &LocalClass) -> Wanted {
        let class = self.without_short_names(local.class);
        let around = std::iter::successors(Some(class), |&class| self.table.class(class).parent);
        let is_of_text = around.into_iter().all(|class| self.table.class(class).around.is_empty());
        let by_text = local.mods.is_empty() && is_of_text;
        Wanted { class, mods: local.mods.clone(), by_text }
    }

    /// The class that a short definition which says nothing more of it is another name of, where that is written.
    fn without_short_names(&mut self, mut class: ClassId) -> ClassId {
        while let ClassBody::Short { modification, dims, .. } = &self.table.class(class).def.body
            && modification.arguments.is_empty()
            && dims.is_empty()
            && let Ok(shape) = self.table.shape(class)
            && let Some(base) = shape.frames.get(1)
        {
            class = base.class;
        }
        self.table.class(class).original.unwrap_or(class)
    }

    /// Says that no `inner` element can be added beside what is around a component.
    fn refuse_beside(
        &mut self,
        parent: InstId,
        declaration: &Component,
        wanted: Option<ClassId>,
    ) -> Result<(), Reported> {
        let name = &declaration.name.name;
        let Some(near) = self.near_inner(parent, name, wanted) else { return Ok(()) };
        let said = no_inner(declaration);
        let said = match near {
            Near::Unmarked(at, before) => {
                let said = said
                    .with(at, "declared without `inner`")
                    .help(format!("`inner` and `outer` belong together: is `inner` missing at `{name}`?"));
                match before {
                    Some(span) => said.propose(
                        format!("declare `{name}` with `inner`"),
                        vec![Edit { span, text: "inner ".to_string() }],
                    ),
                    None => said,
                }
            }
            Near::OtherName(own, at) => said
                .with(at, "an `inner` of another name")
                .help(format!("`inner` and `outer` must have one name: is `{own}` meant?")),
            Near::InTheWay(at) => said
                .with(at, "something else of this name")
                .help(format!("give this another name and declare `inner ... {name};` in the model that is run")),
        };
        self.table.report(said);
        Err(Reported)
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

    /// An element around a component that is likely the one that `outer name` means, or that is in the way of one.
    fn near_inner(&mut self, parent: InstId, name: &Name, wanted: Option<ClassId>) -> Option<Near> {
        let root = self.instances.tree().root;
        let mut current = self.instances[parent].parent;
        let mut near = None;
        while let Some(above) = current {
            current = self.instances[above].parent;
            let Some(shape) = self.instances[above].shape.clone() else { continue };
            for element in &shape.elements {
                let Some(own) = self.declared(&shape, element) else {
                    if above == root && element.name == *name {
                        let class = self.table.member_class(shape.frames[0].class, name)?;
                        return Some(Near::InTheWay(self.table.class(class).def.name.span));
                    }
                    continue;
                };
                let class = self.class_quietly(Scope { inst: above, frame: element.frame }, &own.class);
                if element.name == *name && !own.prefixes.outer {
                    let fits = wanted.is_none_or(|wanted| {
                        class.is_some_and(|class| self.quietly(|s| s.table.why_not(class, wanted)).is_none())
                    });
                    match fits {
                        true => return Some(Near::Unmarked(own.name.span, before_type(&own))),
                        false if above == root => return Some(Near::InTheWay(own.name.span)),
                        false => {}
                    }
                } else if own.prefixes.inner
                    && near.is_none()
                    && let (Some(class), Some(wanted)) = (class, wanted)
                    && self.is_or_extends(class, wanted)
                {
                    near = Some(Near::OtherName(element.name.clone(), own.name.span));
                }
            }
        }
        near
    }

    /// True if a class is `base`, or inherits from it.  Having the same elements does not make it the one that is meant.
    fn is_or_extends(&mut self, class: ClassId, base: ClassId) -> bool {
        let base = self.without_short_names(base);
        let Ok(shape) = self.quietly(|scopes| scopes.table.shape(class)) else { return false };
        shape.frames.iter().any(|frame| self.without_short_names(frame.class) == base)
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

    /// All `outer` elements that mean an added one must be of its class, and none that is meant otherwise may be around them.
    pub(crate) fn check_added(
        &mut self,
        inner: InstId,
        parent: InstId,
        declaration: &Component,
        type_scope: Scope,
    ) -> Result<(), Reported> {
        let Some(k) = self.added_inner.iter().position(|added| added.inst == inner) else { return Ok(()) };
        let Ok(TypeOf::Class(local, _)) = self.type_of(type_scope, &declaration.class) else { return Ok(()) };
        self.refuse_beside(parent, declaration, Some(local.class))?;
        let wanted = self.wanted(&local);
        let span = declaration.name.span;
        if self.added_inner[k].wanted.is_same(&wanted) {
            if !self.added_inner[k].needed && self.has_elements(parent) {
                let user = self.user_of_outer(parent, span);
                let added = &mut self.added_inner[k];
                (added.parent, added.outer, added.user, added.needed) = (parent, span, user, true);
            }
            return Ok(());
        }
        let added = &mut self.added_inner[k];
        added.refused = true;
        let (first, first_parent, at) = (added.wanted.class, added.parent, added.outer);
        let (first, other) = (self.table.full_name(first), self.table.full_name(wanted.class));
        let name = &declaration.name.name;
        let message = format!("no enclosing model declares `inner {name}`, which is wanted as ");
        let said = match first == other {
            false => Diagnostic::error(Code::UnknownName, format!("{message}`{first}` and as `{other}`"))
                .at(span, format!("`outer` here, a `{other}`"))
                .with(at, format!("and here, a `{first}`")),
            true => {
                let (here, there) = self.where_apart(parent, first_parent);
                let message = format!("{message}two classes that are both `{first}` by the text");
                Diagnostic::error(Code::UnknownName, message)
                    .at(span, "`outer` here")
                    .with(there, "modified or redeclared for this component")
                    .with(here, "and otherwise for this one")
            }
        };
        self.table.report(said.help(format!("declare `inner ... {name};` in the model that is run")));
        Err(Reported)
    }

    /// The declarations of the outermost components around two others in which they part.
    fn where_apart(&self, a: InstId, b: InstId) -> (Span, Span) {
        let (a, b) = (chain(&self.instances, a), chain(&self.instances, b));
        let place = |inst: InstId| self.instances[inst].span;
        let apart = a.iter().zip(&b).map(|(&a, &b)| (place(a), place(b))).find(|(a, b)| a != b);
        apart.unwrap_or((place(a[a.len() - 1]), place(b[b.len() - 1])))
    }

    /// Says which `inner` elements were added, and takes back those that only arrays without elements wanted.
    pub(crate) fn tell_added_inner(&mut self) {
        for k in 0..self.added_inner.len() {
            let added = &self.added_inner[k];
            let (inst, outer, user, by_text) = (added.inst, added.outer, added.user, added.wanted.by_text);
            let (name, class) = (self.instances[inst].name.clone(), self.table.full_name(added.wanted.class));
            if added.refused || self.has_failed(inst) {
                continue;
            }
            if !added.needed {
                let root = self.instances.tree().root;
                self.instances.edit(root).children.retain(|&child| child != inst);
                self.instances.edit(root).by_name.remove(&name);
                continue;
            }
            let message = format!("no enclosing model declares `inner {name}`: `{class}` is added");
            let message = match by_text {
                true => format!("{message} with its defaults"),
                false => format!("{message} as it is modified or redeclared around the `outer` element"),
            };
            let mut said = Diagnostic::warning(Code::AddedInner, message);
            said = match user {
                Some(user) => said.at(user, "needed by this component").with(outer, "`outer` here"),
                None => said.at(outer, "`outer` here"),
            };
            let text = self.instances[inst].shape.clone().and_then(|shape| self.missing_inner_message(&shape));
            let said = said.maybe_help(
                text.map(|text| format!("`{class}` says: {}", text.split_whitespace().collect::<Vec<_>>().join(" "))),
            );
            let own = if by_text { class } else { "...".to_string() };
            self.table.report(said.help(format!("declare `inner {own} {name};` in the model that is run")));
        }
    }

    /// What a class, or the nearest base that says something, wants to be said where its `inner` element is missing (section 18.7).
    fn missing_inner_message(&self, shape: &Rc<Shape>) -> Option<Name> {
        let said = |annotation: &Modification| {
            annotation.arguments.iter().find_map(|argument| match argument {
                Argument::Modify(modify) => {
                    let is_named =
                        matches!(modify.target.parts.as_slice(), [only] if only.name.as_ref() == "missingInnerMessage");
                    modify.modification.binding.as_ref().filter(|_| is_named).and_then(Expr::text).cloned()
                }
                _ => None,
            })
        };
        shape.frames.iter().find_map(|frame| self.table.class(frame.class).def.annotation.as_ref().and_then(said))
    }
}

fn no_inner(declaration: &Component) -> Diagnostic {
    let message = format!("no enclosing model declares `inner {}`", declaration.name.name);
    Diagnostic::error(Code::UnknownName, message).at(declaration.name.span, "`outer` here")
}

impl Wanted {
    /// True for the same class of which the same is said.
    fn is_same(&self, other: &Wanted) -> bool {
        self.class == other.class
            && self.mods.len() == other.mods.len()
            && self.mods.iter().zip(&other.mods).all(|(a, b)| says_the_same(&a.tree, &b.tree, a.scope == b.scope))
    }
}

/// True if two modifications say the same; names mean the same only in one scope.
fn says_the_same(a: &Arc<AstMod>, b: &Arc<AstMod>, in_one_scope: bool) -> bool {
    if Arc::ptr_eq(a, b) && in_one_scope {
        return true;
    }
    let is_bound_alike = match (&a.binding, &b.binding) {
        (None, None) => true,
        (Some(x), Some(y)) => (in_one_scope || is_literal(x)) && print_expr(x) == print_expr(y),
        _ => false,
    };
    let children = a.children.iter().zip(&b.children);
    is_bound_alike
        && a.redeclare.is_none()
        && b.redeclare.is_none()
        && a.children.len() == b.children.len()
        && children.into_iter().all(|((x, a), (y, b))| x == y && says_the_same(a, b, in_one_scope))
}

/// True for an expression without names.
fn is_literal(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Integer(_) | ExprKind::Real(_) | ExprKind::Text(_) | ExprKind::Boolean(_) => true,
        ExprKind::Unary(_, of) => is_literal(of),
        ExprKind::Array(items) => items.iter().all(is_literal),
        _ => false,
    }
}
