//! Names in a function that nothing declares, for functions that could not be run.
//!
//! A function is read where it is called, up to its first mistake.  Where a call fails, for its arguments or for something
//! inside, the rest of the text is looked through for unknown names, so that one run tells them all.

use hyd_instance::{Builtin, Scope};
use hyd_source::{Code, Diagnostic};
use hyd_syntax::tree::{ClassBody, ComponentRef, Iterator, Name};
use hyd_syntax::visit::{Role, Visitor, walk_reference};

use crate::callee::Callee;
use crate::context::Context;
use crate::flatten::Flattener;

/// Statements that look like calls.
const STATEMENTS: [&str; 2] = ["assert", "terminate"];

impl Flattener<'_, '_> {
    /// Reports the unknown names of a function, once.
    pub(crate) fn look_at_names(&mut self, callee: &Callee) {
        if self.all_notes().any(|notes| notes.looked_at.contains(&callee.inst)) {
            return;
        }
        self.tables().notes.looked_at.insert(callee.inst);
        let own: Vec<Name> = callee.components.iter().map(|(_, c)| c.name.name.clone()).collect();
        for (frame, part) in callee.shape.frames.iter().enumerate() {
            let owner = self.tree.table.class(part.class).def.clone();
            let ClassBody::Long { algorithms, .. } = &owner.body else { continue };
            let mut search = Search { own: &own, loops: Vec::new(), found: Vec::new() };
            algorithms.iter().flat_map(|section| &section.statements).for_each(|s| search.statement(s));
            let scope = Scope { inst: callee.inst, frame: frame as u32 };
            for (reference, role) in search.found {
                self.look_at_name(&reference, role, scope);
            }
        }
    }

    fn look_at_name(&mut self, reference: &ComponentRef, role: Role, scope: Scope) {
        let ((), draft) = self.attempt(|flat| flat.ask_for_name(reference, role, scope));
        // What has been said at this place is not said again.
        let place = |d: &Diagnostic| d.labels.iter().find(|l| l.primary).map(|l| l.span);
        let known = |new: &Diagnostic| self.tree.table.messages.iter().any(|old| place(old) == place(new));
        if !draft.said().iter().any(known) {
            self.keep(draft);
        }
    }

    fn ask_for_name(&mut self, reference: &ComponentRef, role: Role, scope: Scope) {
        match role {
            Role::Called => {
                let _ = self.called_class(reference, &Context::new(scope));
            }
            Role::Assigned | Role::Taken => {
                let name = &reference.parts[0].name.name;
                let message = format!("`{name}` is not declared in this function");
                let _ = self.error(Code::UnknownName, reference.span, message);
            }
            Role::Read | Role::Connected => {
                let _ = self.tree.resolve(scope, reference);
            }
        }
    }
}

/// The references that the declarations of the function and its loops do not explain.
struct Search<'a> {
    own: &'a [Name],
    loops: Vec<Name>,
    found: Vec<(ComponentRef, Role)>,
}

impl Visitor for Search<'_> {
    fn enter(&mut self, iterators: &[Iterator]) {
        iterators.iter().filter_map(|i| i.range.as_ref()).for_each(|e| self.expr(e));
        self.loops.extend(iterators.iter().map(|i| i.name.name.clone()));
    }

    fn leave(&mut self, iterators: &[Iterator]) {
        self.loops.truncate(self.loops.len() - iterators.len());
    }

    fn reference(&mut self, reference: &ComponentRef, role: Role) {
        let first = &reference.parts[0].name.name;
        let single = reference.parts.len() == 1 && !reference.global;
        let known = !reference.global && (self.own.contains(first) || self.loops.contains(first));
        let predefined = single
            && role == Role::Called
            && (Builtin::from_name(first).is_some() || STATEMENTS.contains(&first.as_ref()));
        if !known && !predefined && first.as_ref() != "Boolean" {
            self.found.push((reference.clone(), role));
        }
        walk_reference(self, reference);
    }
}
