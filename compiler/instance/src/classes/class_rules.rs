//! What a class may hold, and what two declarations of one name in a class mean.
//!
//! An element inherited twice on different ways is one element, and so are equal declarations (Modelica 3.6, section 7.1);
//! a `redeclare` takes the place of an inherited `replaceable` one (7.3).  Anything else is a second declaration.

use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Edit, Reported, Span};
use hyd_syntax::tree::{
    Argument, ClassBody, ClassDef, ClassKind, Component, Element, ElementModification, ElementPrefixes, NestedClass,
};
use rustc_hash::FxHashMap;

use crate::classes::class::{ClassId, ClassTable, elements};
use crate::classes::modifier::AstMod;
use crate::classes::shape::Shape;

impl ClassTable<'_> {
    /// Forms of classes that are outside the profile, literals of an enumeration that are said twice, and equations where
    /// the kind of class has none.
    pub(crate) fn check_body(&mut self, def: &ClassDef) -> Result<(), Reported> {
        let outside = match &def.body {
            ClassBody::DerivativeOf(..) => "a function as a derivative of another (`der(f, x)`)",
            ClassBody::Enumeration(Some(literals)) => {
                let mut known = FxHashMap::default();
                for literal in literals {
                    let Some(first) = known.insert(&literal.name.name, literal) else { continue };
                    let message = format!("the literal `{}` is declared twice", literal.name.name);
                    self.report(
                        Diagnostic::error(Code::Redefinition, message)
                            .at(literal.name.span, "second declaration")
                            .with(first.name.span, "first declaration"),
                    );
                    return Err(Reported);
                }
                return Ok(());
            }
            _ => return self.check_sections(def),
        };
        let message = format!("{outside} is outside the language profile");
        self.report(Diagnostic::error(Code::OutsideProfile, message).at(def.name.span, ""));
        Err(Reported)
    }

    fn check_sections(&mut self, def: &ClassDef) -> Result<(), Reported> {
        let ClassBody::Long { equations, algorithms, .. } = &def.body else { return Ok(()) };
        if !matches!(def.kind, ClassKind::Record | ClassKind::Connector | ClassKind::Package | ClassKind::Type) {
            return Ok(());
        }
        let equation = equations.iter().find_map(|section| section.equations.first()).map(|e| (e.span, "equations"));
        let statement =
            algorithms.iter().find_map(|section| section.statements.first()).map(|s| (s.span, "statements"));
        let Some((span, what)) = equation.or(statement) else { return Ok(()) };
        let message = format!("a {} cannot hold {what}", def.kind.keyword());
        let declared = format!("`{}` is a {}", def.name.name, def.kind.keyword());
        self.report(Diagnostic::error(Code::Misplaced, message).at(span, "").with(def.name.span, declared));
        Err(Reported)
    }

    /// A class that is its own base, with the classes on the way.
    pub(crate) fn circle(&mut self, class: ClassId, open: &[ClassId], from: Option<Span>) -> Reported {
        let start = open.iter().position(|&c| c == class).unwrap_or(0);
        let name = self.full_name(class);
        let declared = self.class(class).def.name.span;
        let mut diagnostic = Diagnostic::error(Code::CircularClass, format!("`{name}` extends itself"))
            .at(from.unwrap_or(declared), "the cycle closes here")
            .with(declared, "declared here");
        if open.len() > start + 1 {
            let mut chain: Vec<String> = open[start..].iter().map(|&c| format!("`{}`", self.full_name(c))).collect();
            chain.push(format!("`{name}`"));
            for &between in &open[start + 1..] {
                diagnostic = diagnostic.with(self.class(between).def.name.span, "on the way");
            }
            diagnostic = diagnostic.help(format!("each extends the next: {}", chain.join(", ")));
        }
        self.report(diagnostic);
        Reported
    }

    /// The second declaration of a name: the same element, a redeclaration, or a mistake.
    pub(crate) fn check_duplicate(
        &mut self,
        shape: &mut Shape,
        known: u32,
        frame: u32,
        position: usize,
        span: Span,
    ) -> Result<(), Reported> {
        let element = &shape.elements[known as usize];
        let (here, there) = (shape.frames[frame as usize].class, shape.frames[element.frame as usize].class);
        let (new, old) = (self.element(here, position), self.element(there, element.position as usize));
        if here == there && element.position == position as u32 || Arc::ptr_eq(&new.0, &old.0) && new.1 == old.1 {
            shape.elements[known as usize].also.push(frame);
            return Ok(());
        }
        let name = element.name.clone();
        if redeclares(new.element()) {
            self.check_replaceable(new.element(), old.element())?;
            // The new declaration takes the place of the inherited one.
            let slot = &mut shape.elements[known as usize];
            slot.replaced = slot.replaced.or(Some((slot.frame, slot.position)));
            slot.frame = frame;
            slot.position = position as u32;
            if let Element::Component(component) = new.element() {
                slot.modification = Arc::new(AstMod::from_syntax(&component.modification));
            }
            return Ok(());
        }
        if redeclares(old.element()) {
            let slot = &mut shape.elements[known as usize];
            slot.replaced = slot.replaced.or(Some((frame, position as u32)));
            return self.check_replaceable(old.element(), new.element());
        }
        if let (Element::Component(a), Element::Component(b)) = (new.element(), old.element())
            && here != there
            && self.same_declaration(a, b)
        {
            shape.elements[known as usize].also.push(frame);
            if !self.same_attributes(a, b) {
                let message = format!("`{name}` is declared twice with different attributes; those of the first count");
                self.report(
                    Diagnostic::warning(Code::Redefinition, message)
                        .at(span, "second declaration")
                        .with(b.name.span, "first declaration"),
                );
            }
            return Ok(());
        }
        if let (Element::Class(a), Element::Class(b)) = (new.element(), old.element())
            && here != there
            && self.same_short_class(a, b)
        {
            shape.elements[known as usize].also.push(frame);
            return Ok(());
        }
        let first = name_span(old.element()).unwrap_or(span);
        self.report(
            Diagnostic::error(Code::Redefinition, format!("`{name}` is declared twice"))
                .at(span, "second declaration")
                .with(first, "first declaration"),
        );
        Err(Reported)
    }

    fn element(&self, class: ClassId, position: usize) -> Place {
        Place(self.class(class).def.clone(), position)
    }

    /// What a `redeclare` element replaces must be `replaceable` and not `final`.
    fn check_replaceable(&mut self, new: &Element, old: &Element) -> Result<(), Reported> {
        let (Some(prefixes), Some(at), Some(declared)) = (prefixes(old), name_span(new), name_span(old)) else {
            return Ok(());
        };
        if prefixes.replaceable && !prefixes.is_final {
            return Ok(());
        }
        let name = match old {
            Element::Component(c) => c.name.name.clone(),
            Element::Class(c) => c.class.name.name.clone(),
            _ => return Ok(()),
        };
        let (code, message) = match prefixes.is_final {
            true => (Code::FinalModified, format!("`{name}` is final and cannot be redeclared")),
            false => (Code::Redeclaration, format!("`{name}` is redeclared but was not declared `replaceable`")),
        };
        let fault = Diagnostic::error(code, message).at(at, "redeclared here").with(declared, "declared here");
        let fault = if prefixes.is_final { fault } else { self.propose_replaceable(fault, &name, declared) };
        self.report(fault);
        Err(Reported)
    }

    /// The text at a place without blanks.
    fn bare_text(&self, span: Option<Span>) -> String {
        span.map(|s| self.files.snippet(s).split_whitespace().collect::<String>()).unwrap_or_default()
    }

    /// Attributes of both declarations say the same.
    fn same_attributes(&self, a: &Component, b: &Component) -> bool {
        self.bare_text(a.modification.span) == self.bare_text(b.modification.span)
    }

    /// Both declarations say the same, blanks and attributes of predefined types aside.
    fn same_declaration(&self, a: &Component, b: &Component) -> bool {
        let text = |span: Option<Span>| self.bare_text(span);
        let own = |c: &Component| {
            let p = &c.prefixes;
            let dims: Vec<String> = c.dims.iter().map(|d| text(Some(d.span))).collect();
            let class: Vec<String> = c.class.parts.iter().map(|part| part.name.to_string()).collect();
            let condition = text(c.condition.as_ref().map(|e| e.span));
            let attributes = c.modification.arguments.iter().all(is_attribute);
            let value = match attributes {
                true => text(c.modification.binding.as_ref().map(|e| e.span)),
                false => text(c.modification.span),
            };
            (class, dims, condition, value, [p.protected, p.is_final, p.inner, p.outer, p.replaceable])
        };
        own(a) == own(b) && a.variability == b.variability && a.flow == b.flow && a.direction == b.direction
    }

    /// Both declarations are short definitions that say the same, comments aside.
    fn same_short_class(&self, a: &NestedClass, b: &NestedClass) -> bool {
        let text = |span: Option<Span>| {
            span.map(|s| self.files.snippet(s).split_whitespace().collect::<String>()).unwrap_or_default()
        };
        let own = |element: &NestedClass| {
            let ClassBody::Short { base, modification, direction, .. } = &element.class.body else { return None };
            let p = &element.prefixes;
            let base: Vec<String> = base.parts.iter().map(|part| part.name.to_string()).collect();
            let constraint = element.constrained_by.as_ref().map(|clause| {
                let base: Vec<String> = clause.base.parts.iter().map(|part| part.name.to_string()).collect();
                (base, text(clause.modification.span))
            });
            let prefixes = [p.protected, p.is_final, p.inner, p.outer, p.replaceable];
            Some((element.class.kind, base, text(modification.span), *direction, constraint, prefixes))
        };
        own(a).is_some() && own(a) == own(b)
    }

    pub(crate) fn not_replaceable(&mut self, name: &str, at: Option<Span>, declared: Span) {
        let message = format!("`{name}` is redeclared but was not declared `replaceable`");
        let mut diagnostic = Diagnostic::error(Code::Redeclaration, message);
        if let Some(span) = at {
            diagnostic = diagnostic.at(span, "redeclared here");
        }
        let diagnostic = self.propose_replaceable(diagnostic.with(declared, "declared here"), name, declared);
        self.report(diagnostic);
    }

    /// A declaration in the user's own text can be made replaceable.
    fn propose_replaceable(&self, diagnostic: Diagnostic, name: &str, declared: Span) -> Diagnostic {
        let text = self.files.text(declared.file);
        let Some(before) = text.get(..declared.start as usize).filter(|_| self.main == Some(declared.file)) else {
            return diagnostic;
        };
        let from = before.rfind([';', '\n']).map_or(0, |at| at + 1);
        let begin = from + (before[from..].len() - before[from..].trim_start().len());
        let edit = Edit { span: Span::new(declared.file, begin, begin), text: "replaceable ".to_string() };
        let words = format!("declare `{name}` as `replaceable`, if it may be another one");
        diagnostic.help(words.clone()).propose(words, vec![edit])
    }
}

/// What guides a solver and says nothing of what a variable is.
fn is_attribute(argument: &Argument) -> bool {
    const GUIDES: [&str; 6] = ["min", "max", "nominal", "start", "stateSelect", "displayUnit"];
    let Argument::Modify(ElementModification { target, .. }) = argument else { return false };
    matches!(target.parts.as_slice(), [only] if GUIDES.contains(&only.name.as_ref()))
}

/// An element of a class definition.
struct Place(Arc<ClassDef>, usize);

impl Place {
    fn element(&self) -> &Element {
        &elements(&self.0)[self.1]
    }
}

fn prefixes(element: &Element) -> Option<&ElementPrefixes> {
    match element {
        Element::Component(c) => Some(&c.prefixes),
        Element::Class(c) => Some(&c.prefixes),
        _ => None,
    }
}

fn name_span(element: &Element) -> Option<Span> {
    match element {
        Element::Component(c) => Some(c.name.span),
        Element::Class(c) => Some(c.class.name.span),
        _ => None,
    }
}

/// `redeclare` was written, or the class extends the inherited one of its name.
fn redeclares(element: &Element) -> bool {
    let extends = |def: &ClassDef| matches!(def.body, ClassBody::Long { extends_from: Some(_), .. });
    match element {
        Element::Component(c) => c.prefixes.redeclare,
        Element::Class(c) => c.prefixes.redeclare || extends(&c.class),
        _ => false,
    }
}
