//! Names of a statement replaced by others, apart from its own loop variables.

use hyd_instance::Builtin;
use hyd_syntax::tree::{ComponentRef, Expr, ExprKind, Ident, Iterator, Name, RefPart, Statement};
use hyd_syntax::visit::Role;
use hyd_syntax::visit_mut::{VisitorMut, walk_expr_mut, walk_reference_mut};

/// What can get another name.
pub(crate) enum Found<'a> {
    /// A reference, read or set; its last subscripts stay.  The names are loop variables of the statement.
    Reference(&'a ComponentRef, bool, &'a [Name]),
    /// A call of an operator that speaks of events or derivatives.
    Operator(&'a Expr),
}

/// Asks `name` for the new name of everything found; `None` leaves it as it is.
pub(crate) fn rename(statement: &mut Statement, name: &mut dyn FnMut(Found<'_>) -> Option<Name>) {
    Renaming { name, hidden: Vec::new() }.statement(statement);
}

/// True if the value belongs to the model, not to the statement.
fn belongs_to_model(builtin: Builtin) -> bool {
    builtin.reads_run() || matches!(builtin, Builtin::Delay | Builtin::Homotopy)
}

struct Renaming<'f> {
    name: &'f mut dyn FnMut(Found<'_>) -> Option<Name>,
    hidden: Vec<Name>,
}

impl VisitorMut for Renaming<'_> {
    fn enter(&mut self, iterators: &mut [Iterator]) {
        for iterator in iterators {
            iterator.range.iter_mut().for_each(|e| self.expr(e));
            self.hidden.push(iterator.name.name.clone());
        }
    }

    fn leave(&mut self, iterators: &mut [Iterator]) {
        self.hidden.truncate(self.hidden.len() - iterators.len());
    }

    fn reference(&mut self, reference: &mut ComponentRef, role: Role) {
        if role == Role::Called {
            return;
        }
        let set = matches!(role, Role::Assigned | Role::Taken);
        let own = !reference.global && self.hidden.contains(&reference.parts[0].name.name);
        if !own && let Some(name) = (self.name)(Found::Reference(reference, set, &self.hidden)) {
            let last = reference.parts.pop();
            let subscripts = last.map(|part| part.subscripts).unwrap_or_default();
            reference.global = false;
            reference.parts = vec![RefPart { name: Ident { name, span: reference.span }, subscripts }];
        }
        walk_reference_mut(self, reference);
    }

    fn expr(&mut self, expr: &mut Expr) {
        if let ExprKind::Call(function, _) = &expr.kind
            && function.parts.len() == 1
            && Builtin::from_name(&function.parts[0].name.name).is_some_and(belongs_to_model)
            && let Some(name) = (self.name)(Found::Operator(expr))
        {
            let part = RefPart { name: Ident { name, span: expr.span }, subscripts: Vec::new() };
            expr.kind = ExprKind::Ref(ComponentRef { global: false, parts: vec![part], span: expr.span });
            return;
        }
        walk_expr_mut(self, expr);
    }
}
