//! Record values taken apart: the expression of one field of a record expression.
//!
//! A binding or an equation between records means one between their fields (Modelica 3.6, sections 4.9 and 12.6):
//! `d = Data(a = 1)` gives `d.a = 1`, `d = e` gives `d.a = e.a`.  What has no name of its own, such as the default of a field that
//! a constructor call leaves out, stays a field of the call.

use hyd_source::{Code, Reported};
use hyd_syntax::tree::{Arguments, ClassKind, ComponentRef, Expr, ExprKind, Ident, Name, RefPart};

use crate::builtins::Builtin;
use crate::classes::class::ClassId;
use crate::instantiation::instance::{LocalClass, Scope};
use crate::instantiation::lookup::Resolved;
use crate::instantiation::scopes::Scopes;

/// The same expression with other parts where its values come from; `None` if it has no parts of that kind.
/// `fills`: a call is one of `fill`, which repeats a record like any other value.
fn with_parts(
    expr: &Expr,
    fills: bool,
    part: &mut dyn FnMut(&Expr) -> Result<Expr, Reported>,
) -> Result<Option<Expr>, Reported> {
    let kind = match &expr.kind {
        ExprKind::Array(items) => ExprKind::Array(items.iter().map(part).collect::<Result<_, _>>()?),
        ExprKind::ArrayFor(body, iterators) => ExprKind::ArrayFor(Box::new(part(body)?), iterators.clone()),
        ExprKind::If(branches, otherwise) => {
            let mut parts = Vec::with_capacity(branches.len());
            for (condition, value) in branches {
                parts.push((condition.clone(), part(value)?));
            }
            ExprKind::If(parts, Box::new(part(otherwise)?))
        }
        ExprKind::Tuple(items) => match items.as_slice() {
            [Some(only)] => return part(only).map(Some),
            _ => return Ok(None),
        },
        ExprKind::Call(function, Arguments::List { positional, named }) if fills => {
            let mut positional = positional.clone();
            if let Some(first) = positional.first_mut() {
                *first = part(first)?;
            }
            ExprKind::Call(function.clone(), Arguments::List { positional, named: named.clone() })
        }
        _ => return Ok(None),
    };
    Ok(Some(Expr { kind, span: expr.span }))
}

impl Scopes<'_> {
    /// The record whose constructor is called, if it is one.
    pub fn constructed(&mut self, scope: Scope, function: &ComponentRef) -> Result<Option<LocalClass>, Reported> {
        let Resolved::Class(local) = self.resolve(scope, function)? else { return Ok(None) };
        let is_record = self.table.class(local.class).def.kind == ClassKind::Record;
        Ok((is_record && !self.has_constructors(local.class)).then_some(local))
    }

    fn as_array(&mut self, scope: Scope, expr: &Expr) -> Option<Expr> {
        let ExprKind::Call(function, arguments) = &expr.kind else { return None };
        self.array_of_call(scope, function, arguments, expr.span)
    }

    fn fills(&mut self, scope: Scope, expr: &Expr) -> bool {
        matches!(&expr.kind, ExprKind::Call(function, _) if self.predefined(scope, function) == Some(Builtin::Fill))
    }

    /// True if the field of a constructor's record is a String.
    pub fn is_text_field(&mut self, scope: Scope, record: &Expr, name: &Name) -> bool {
        let ExprKind::Call(function, _) = &record.kind else { return false };
        let found = self.quietly(|scopes| match scopes.constructed(scope, function)? {
            Some(local) => {
                let shape = scopes.table.shape(local.class)?;
                let element = shape.by_name.get(name).map(|&k| &shape.elements[k as usize]);
                Ok::<_, Reported>(element.and_then(|element| scopes.declared(&shape, element)))
            }
            None => Ok(None),
        });
        matches!(found, Ok(Some(field)) if field.class.parts.len() == 1 && &*field.class.parts[0].name == "String")
    }

    /// The expression can be a record, and the constructor calls in it fit their records.
    pub fn check_record(&mut self, scope: Scope, expr: &Expr) -> Result<(), Reported> {
        if let Some(array) = self.as_array(scope, expr) {
            return self.check_record(scope, &array);
        }
        let fills = self.fills(scope, expr);
        let parts = with_parts(expr, fills, &mut |part| {
            self.check_record(scope, part)?;
            Ok(part.clone())
        })?;
        match &expr.kind {
            _ if parts.is_some() => Ok(()),
            // Operators may be those of the record.
            ExprKind::Ref(_) | ExprKind::Field(..) | ExprKind::Binary(..) | ExprKind::Unary(..) => Ok(()),
            ExprKind::Call(function, Arguments::List { positional, named }) => {
                match self.constructed(scope, function)? {
                    Some(local) => self.constructor_arguments(&local, expr.span, positional, named).map(|_| ()),
                    None => Ok(()),
                }
            }
            _ => {
                let message = "a value of a record must be a record, its constructor, or a function that gives one";
                Err(self.error(Code::TypeMismatch, expr.span, message))
            }
        }
    }

    /// The field `name` of a record expression that has been checked.
    pub fn field_of(&mut self, scope: Scope, expr: &Expr, name: &Name) -> Result<Expr, Reported> {
        if let Some(array) = self.as_array(scope, expr) {
            return self.field_of(scope, &array, name);
        }
        let fills = self.fills(scope, expr);
        if let Some(whole) = with_parts(expr, fills, &mut |part| self.field_of(scope, part, name))? {
            return Ok(whole);
        }
        match &expr.kind {
            ExprKind::Ref(reference) => {
                let mut reference = reference.clone();
                let ident = Ident { name: name.clone(), span: reference.span };
                reference.parts.push(RefPart { name: ident, subscripts: Vec::new() });
                return Ok(Expr { kind: ExprKind::Ref(reference), span: expr.span });
            }
            ExprKind::Call(function, Arguments::List { positional, named }) => {
                if let Some(local) = self.constructed(scope, function)? {
                    let inputs = self.inputs_of_constructor(&local)?;
                    let by_place = inputs.iter().position(|i| i.name == *name).and_then(|k| positional.get(k));
                    let by_name = || named.iter().find(|(n, _)| n.name == *name).map(|(_, e)| e);
                    if let Some(given) = by_place.or_else(by_name) {
                        return Ok(given.clone());
                    }
                    if !self.table.shape(local.class)?.by_name.contains_key(name) {
                        let record = self.table.full_name(local.class);
                        let message = format!("`{record}` has no field `{name}`, which is needed here");
                        return Err(self.error(Code::TypeMismatch, expr.span, message));
                    }
                }
            }
            _ => {}
        }
        let ident = Ident { name: name.clone(), span: expr.span };
        Ok(Expr { kind: ExprKind::Field(Box::new(expr.clone()), ident), span: expr.span })
    }

    /// True if the expression is a call of the constructor of `class` that leaves the field to its default.
    pub(crate) fn leaves_out(
        &mut self,
        scope: Scope,
        expr: &Expr,
        class: ClassId,
        name: &Name,
    ) -> Result<bool, Reported> {
        if self.as_array(scope, expr).is_some() {
            return Ok(false);
        }
        match &expr.kind {
            ExprKind::Tuple(items) => match items.as_slice() {
                [Some(only)] => self.leaves_out(scope, only, class, name),
                _ => Ok(false),
            },
            ExprKind::Call(function, Arguments::List { positional, named }) if !self.fills(scope, expr) => {
                let Some(local) = self.constructed(scope, function)? else { return Ok(false) };
                let inputs = self.inputs_of_constructor(&local)?;
                let by_place = inputs.iter().take(positional.len()).any(|input| input.name == *name);
                Ok(local.class == class && !by_place && named.iter().all(|(n, _)| n.name != *name))
            }
            _ => Ok(false),
        }
    }
}
