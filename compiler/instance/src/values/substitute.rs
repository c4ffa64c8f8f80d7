//! Texts with a value in place of a loop variable.
//!
//! Needed where what there is depends on the loop (a connection for all but the first), so that the loop must be written out
//! before anything is lowered.  A loop inside that has a variable of the same name hides it.

use hyd_syntax::tree::{ComponentRef, Equation, Expr, ExprKind, Ident, Iterator, Name, RefPart, Statement, UnaryOp};
use hyd_syntax::visit_mut::{VisitorMut, walk_expr_mut};

use crate::values::value::Value;

/// What names can be replaced in.
pub(crate) trait Text: Clone {
    /// Lets the visitor go through it.
    fn accept(&mut self, visitor: &mut Substitution<'_>);
}

impl Text for Expr {
    fn accept(&mut self, visitor: &mut Substitution<'_>) {
        visitor.expr(self);
    }
}

impl Text for Iterator {
    fn accept(&mut self, visitor: &mut Substitution<'_>) {
        self.range.iter_mut().for_each(|e| visitor.expr(e));
    }
}

impl Text for Statement {
    fn accept(&mut self, visitor: &mut Substitution<'_>) {
        visitor.statement(self);
    }
}

impl Text for Equation {
    fn accept(&mut self, visitor: &mut Substitution<'_>) {
        visitor.equation(self);
    }
}

/// A copy with the value in place of the name.
pub(crate) fn with_value<T: Text>(text: &T, name: &Name, value: &Value) -> T {
    let mut copy = text.clone();
    copy.accept(&mut Substitution { name, value, hidden: Vec::new() });
    copy
}

fn is_name(reference: &ComponentRef, name: &Name) -> bool {
    !reference.global && reference.parts.len() == 1 && reference.parts[0].name.name == *name
}

/// A replacement on its way through the text.
pub(crate) struct Substitution<'a> {
    name: &'a Name,
    value: &'a Value,
    hidden: Vec<Name>,
}

impl VisitorMut for Substitution<'_> {
    fn enter(&mut self, iterators: &mut [Iterator]) {
        iterators.iter_mut().filter_map(|i| i.range.as_mut()).for_each(|e| self.expr(e));
        self.hidden.extend(iterators.iter().map(|i| i.name.name.clone()));
    }

    fn leave(&mut self, iterators: &mut [Iterator]) {
        self.hidden.truncate(self.hidden.len() - iterators.len());
    }

    fn expr(&mut self, expr: &mut Expr) {
        if let ExprKind::Ref(reference) = &expr.kind
            && is_name(reference, self.name)
            && !self.hidden.contains(self.name)
        {
            if let Some(kind) = literal(self.value, expr.span) {
                expr.kind = kind;
            }
            return;
        }
        walk_expr_mut(self, expr);
    }
}

/// A value as it could stand in the text.
pub(crate) fn literal(value: &Value, span: hyd_source::Span) -> Option<ExprKind> {
    let negated = |kind: ExprKind| ExprKind::Unary(UnaryOp::Minus, Box::new(Expr { kind, span }));
    Some(match value {
        Value::Integer(k) if *k < 0 => negated(ExprKind::Integer(k.saturating_abs())),
        Value::Integer(k) => ExprKind::Integer(*k),
        Value::Real(x) if *x < 0.0 => negated(ExprKind::Real(-x)),
        Value::Real(x) => ExprKind::Real(*x),
        Value::Boolean(b) => ExprKind::Boolean(*b),
        Value::Text(text) => ExprKind::Text(text.clone()),
        Value::Enumeration(of, k) => {
            let literal = of.literals.get(*k as usize - 1)?;
            let part = |name: &str| RefPart { name: Ident { name: name.into(), span }, subscripts: Vec::new() };
            let parts = of.name.split('.').map(part).chain([part(literal)]).collect();
            ExprKind::Ref(ComponentRef { global: true, parts, span })
        }
        Value::Array(_) | Value::Record(_) | Value::Object(_) => return None,
    })
}
