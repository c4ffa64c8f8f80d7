//! Modifications that reach nothing, something protected, or something twice; `each` where there is no array.

use std::rc::Rc;
use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Files, Span, did_you_mean};
use hyd_syntax::tokens::{Token, tokens};

use crate::classes::modifier::{Applied, AstMod, Mods};
use crate::classes::shape::Shape;
use crate::instantiation::instance::InstId;
use crate::instantiation::scopes::Scopes;

impl Scopes<'_> {
    /// Every modification must speak of an element that can be reached from where it stands; the first `outside` ones of
    /// `mods` stand outside of the class.
    pub(crate) fn check_targets(&mut self, inst: InstId, shape: &Rc<Shape>, mods: &Mods, outside: usize) {
        for applied in mods {
            self.check_each(inst, applied);
        }
        for (frame, tree) in shape.frames.iter().flat_map(|f| f.modifications.iter()).cloned().collect::<Vec<_>>() {
            let scope = crate::instantiation::instance::Scope { inst, frame };
            self.check_each(inst, &Applied::new(tree, scope));
        }
        let frames = shape.frames.iter().flat_map(|f| f.modifications.iter().map(|(_, tree)| tree));
        let all: Vec<Arc<AstMod>> = mods.iter().map(|m| &m.tree).chain(frames).cloned().collect();
        for (k, tree) in all.iter().enumerate() {
            self.check_said_twice(tree);
            for (name, child) in &tree.children {
                match shape.by_name.get(name) {
                    Some(&element) if k < outside => self.check_reachable(inst, shape, element, child.span),
                    Some(_) => {}
                    None if shape.builtin.is_some() => {}
                    None => self.names_nothing(inst, shape, name, child.span),
                }
            }
        }
    }

    fn names_nothing(&mut self, inst: InstId, shape: &Shape, name: &str, span: Option<Span>) {
        let instance = &self.instances[inst];
        let class = instance.class.map(|c| self.table.full_name(c)).unwrap_or_default();
        let declared = instance.class.map(|c| self.table.class(c).def.name.span);
        let mut diagnostic =
            Diagnostic::error(Code::UnknownModifier, format!("`{class}` has no element `{name}` to modify"));
        if let Some(span) = span {
            diagnostic = diagnostic.at(span, "names nothing");
        }
        if let Some(declared) = declared {
            diagnostic = diagnostic.with(declared, format!("`{class}` is declared here"));
        }
        let names = || shape.elements.iter().map(|e| e.name.as_ref());
        let diagnostic = match span {
            Some(span) => {
                let place = name_in(&self.table.files, span, name);
                diagnostic.meant(place, name, names())
            }
            None => diagnostic.maybe_help(did_you_mean(name, names())),
        };
        self.table.report(diagnostic);
    }

    /// Protected elements are modified by the class itself and by those that extend it, not from outside (7.2.2).
    fn check_reachable(&mut self, inst: InstId, shape: &Shape, k: u32, span: Option<Span>) {
        let element = &shape.elements[k as usize];
        let declared = self.declared(shape, element);
        let protected = shape.frames[element.frame as usize].protected
            || declared.as_ref().is_some_and(|component| component.prefixes.protected);
        if !protected {
            return;
        }
        let (name, owner) = (&element.name, &self.instances[inst].name);
        let message = format!("`{name}` is protected in `{owner}` and cannot be modified from outside");
        let mut diagnostic = Diagnostic::error(Code::Misplaced, message);
        if let Some(span) = span {
            diagnostic = diagnostic.at(span, "");
        }
        if let Some(component) = declared {
            diagnostic = diagnostic.with(component.name.span, "declared here");
        }
        self.table.report(diagnostic);
    }

    /// `each` speaks of the elements of an array between the modification and what it modifies (7.2.5).
    pub(crate) fn check_each(&mut self, inst: InstId, applied: &Applied) {
        let Some((_, tree)) = applied.tree.children.iter().find(|(_, tree)| tree.each) else { return };
        let mut current = Some(inst);
        while let Some(above) = current {
            if self.instances[above].is_array() {
                return;
            }
            current = self.instances[above].parent.filter(|_| above != applied.scope.inst);
        }
        let mut diagnostic = Diagnostic::error(Code::Misplaced, "`each` needs an array of components");
        if let Some(span) = tree.span {
            diagnostic = diagnostic.at(span, "");
        }
        let name = self.instances[inst].name.clone();
        if !name.is_empty() {
            let declared = self.instances[inst].span;
            diagnostic = diagnostic.with(declared, format!("`{name}` is not an array"));
        }
        self.table.report(diagnostic);
    }

    /// One modification may speak of an element once.
    pub(crate) fn check_said_twice(&mut self, tree: &AstMod) {
        if let Some((name, first, second)) = tree.said_twice() {
            let message = format!("`{name}` is modified twice");
            self.table.report(
                Diagnostic::error(Code::Redefinition, message).at(second, "second time").with(first, "first time"),
            );
        }
    }
}

/// The place of an element's name in the modification of it, before which may stand `each`, `final`, or the type of a redeclaration; the whole
/// place where it is not found.
pub(crate) fn name_in(files: &Files, whole: Span, name: &str) -> Span {
    let text = files.snippet(whole);
    let words: Vec<Token<'_>> = tokens(text).filter(|token| !token.is_comment()).collect();
    let end = words.iter().position(|token| token.is_one_of(&["(", "=", ":="])).unwrap_or(words.len());
    let redeclares = words[..end].iter().any(|token| token.is_one_of(&["redeclare", "replaceable"]));
    let mut own = words[..end].iter().filter(|token| token.is(name));
    // Of `redeclare A b` the type comes first, of `a.b = 1` the element.
    let found = if redeclares { own.next_back() } else { own.next() };
    found.map_or(whole, |token| {
        let start = whole.start as usize + token.at;
        Span::new(whole.file, start, start + name.len())
    })
}
