//! Record values taken apart: the expression of one field of a record expression.
//!
//! A binding or an equation between records means one between their fields (Modelica 3.6, sections 4.9 and 12.6):
//! `d = Data(a = 1)` gives `d.a = 1`, `d = e` gives `d.a = e.a`.

use hyd_source::{Code, Diagnostic, Reported, Span, did_you_mean};
use hyd_syntax::tree::{Arguments, ComponentRef, Expr, ExprKind, Ident, Name, RefPart};

use crate::build::InstanceTree;
use crate::class::ClassId;
use crate::shape::{Shape, ShapeElement, is_builtin};

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

impl InstanceTree<'_> {
    /// The constructor calls of an expression name fields that their record has, each once, and leave out only those with a
    /// default (12.6.1).
    pub fn check_constructor(&mut self, class: ClassId, expr: &Expr) -> Result<(), Reported> {
        match &expr.kind {
            ExprKind::Call(_, Arguments::List { positional, named }) => {
                self.check_fields(class, expr.span, positional, named)
            }
            ExprKind::Array(items) => items.iter().try_for_each(|item| self.check_constructor(class, item)),
            ExprKind::ArrayFor(body, _) => self.check_constructor(class, body),
            ExprKind::If(branches, otherwise) => {
                branches.iter().try_for_each(|(_, value)| self.check_constructor(class, value))?;
                self.check_constructor(class, otherwise)
            }
            ExprKind::Tuple(items) => items.iter().flatten().try_for_each(|item| self.check_constructor(class, item)),
            _ => Ok(()),
        }
    }

    fn check_fields(
        &mut self,
        class: ClassId,
        span: Span,
        positional: &[Expr],
        named: &[(Ident, Expr)],
    ) -> Result<(), Reported> {
        let shape = self.table.shape(class)?;
        let fields: Vec<_> = shape.elements.iter().filter(|e| e.component).collect();
        let record = self.table.full_name(class);
        let declared = self.table.class(class).def.name.span;
        let fault = |message: String, at: Span| {
            Diagnostic::error(Code::BadArguments, message).at(at, "").with(declared, "the record is declared here")
        };
        if let Some(extra) = positional.get(fields.len()) {
            let message = format!("`{record}` has {} fields, but {} values are given", fields.len(), positional.len());
            self.table.report(fault(message, extra.span));
            return Err(Reported);
        }
        for (name, value) in named {
            let Some(k) = fields.iter().position(|e| e.name == name.name) else {
                let help = did_you_mean(&name.name, fields.iter().map(|e| e.name.as_ref()));
                let message = format!("`{record}` has no field `{}`", name.name);
                self.table.report(fault(message, name.span).maybe_help(help));
                return Err(Reported);
            };
            if k < positional.len() {
                let message = format!("the field `{}` has a value already, by its position", name.name);
                self.table.report(fault(message, name.span.to(value.span)));
                return Err(Reported);
            }
        }
        for (k, field) in fields.iter().enumerate().skip(positional.len()) {
            let given = named.iter().any(|(name, _)| name.name == field.name);
            let modified = shape.frames[field.frame as usize].modifications.iter().any(|(_, tree)| {
                tree.children.iter().any(|(name, inner)| *name == field.name && inner.binding.is_some())
            });
            let default = field.modification.binding.is_some() || modified || self.is_class_field(&shape, k, &fields);
            if !given && !default {
                let message = format!("the field `{}` has no value", field.name);
                self.table.report(fault(message, span));
                return Err(Reported);
            }
        }
        Ok(())
    }

    /// A field that is itself a record may get its values from its own declarations.
    fn is_class_field(&self, shape: &Shape, k: usize, fields: &[&ShapeElement]) -> bool {
        let declaration = self.declared(shape, fields[k]);
        declaration
            .is_some_and(|c| !(c.class.parts.len() == 1 && is_builtin(&c.class.parts[0].name)) && c.dims.is_empty())
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
