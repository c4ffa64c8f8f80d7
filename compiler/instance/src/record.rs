//! Record values taken apart: the expression of one field of a record expression.
//!
//! A binding or an equation between records means one between their fields (Modelica 3.6, sections 4.9 and 12.6):
//! `d = Data(a = 1)` gives `d.a = 1`, `d = e` gives `d.a = e.a`.

use hyd_syntax::tree::{Arguments, ComponentRef, Expr, ExprKind, Ident, Name, RefPart};

/// What is known of a field of a record expression.
pub enum Field {
    /// Its expression.
    Expr(Expr),
    /// The constructor does not name it: the default of the declaration stays.
    Default,
    /// The expression is of a kind that cannot be taken apart.
    Unknown,
}

/// The call that makes the record, if there is one: it may be a constructor or a function.
pub fn making_call(expr: &Expr) -> Option<&ComponentRef> {
    match &expr.kind {
        ExprKind::Call(function, _) => Some(function),
        ExprKind::Array(items) => items.first().and_then(making_call),
        ExprKind::ArrayFor(body, _) => making_call(body),
        ExprKind::If(_, otherwise) => making_call(otherwise),
        ExprKind::Tuple(items) => match items.as_slice() {
            [Some(only)] => making_call(only),
            _ => None,
        },
        _ => None,
    }
}

/// Field `name`, number `position` of the record (from 0), of `expr`.  `constructor`: calls in it make records
/// field by field, else they are functions whose result has the field.
pub fn field(expr: &Expr, name: &Name, position: usize, constructor: bool) -> Field {
    match &expr.kind {
        ExprKind::Ref(reference) => {
            let mut reference = reference.clone();
            let ident = Ident { name: name.clone(), span: reference.span };
            reference.parts.push(RefPart { name: ident, subscripts: Vec::new() });
            Field::Expr(Expr { kind: ExprKind::Ref(reference), span: expr.span })
        }
        ExprKind::Call(..) if !constructor => {
            let ident = Ident { name: name.clone(), span: expr.span };
            Field::Expr(Expr { kind: ExprKind::Field(Box::new(expr.clone()), ident), span: expr.span })
        }
        ExprKind::Call(_, Arguments::List { positional, named }) => {
            let given =
                positional.get(position).or_else(|| named.iter().find(|(n, _)| n.name == *name).map(|(_, e)| e));
            given.cloned().map_or(Field::Default, Field::Expr)
        }
        ExprKind::Array(items) => {
            let mut fields = Vec::with_capacity(items.len());
            for item in items {
                match field(item, name, position, constructor) {
                    Field::Expr(e) => fields.push(e),
                    other => return other,
                }
            }
            Field::Expr(Expr { kind: ExprKind::Array(fields), span: expr.span })
        }
        ExprKind::ArrayFor(body, iterators) => match field(body, name, position, constructor) {
            Field::Expr(e) => {
                Field::Expr(Expr { kind: ExprKind::ArrayFor(Box::new(e), iterators.clone()), span: expr.span })
            }
            other => other,
        },
        ExprKind::If(branches, otherwise) => {
            let Field::Expr(last) = field(otherwise, name, position, constructor) else { return Field::Unknown };
            let mut parts = Vec::with_capacity(branches.len());
            for (condition, value) in branches {
                let Field::Expr(e) = field(value, name, position, constructor) else { return Field::Unknown };
                parts.push((condition.clone(), e));
            }
            Field::Expr(Expr { kind: ExprKind::If(parts, Box::new(last)), span: expr.span })
        }
        ExprKind::Tuple(items) => match items.as_slice() {
            [Some(only)] => field(only, name, position, constructor),
            _ => Field::Unknown,
        },
        _ => Field::Unknown,
    }
}
