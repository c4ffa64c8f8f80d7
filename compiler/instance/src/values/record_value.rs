//! Records as values before the run: constructors, fields, variables of functions, components.

use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{Arguments, ClassKind, Component, Expr, ExprKind, Ident, Name};

use crate::classes::modifier::AstMod;
use crate::instantiation::instance::{InstId, LocalClass, Scope};
use crate::instantiation::scopes::Scopes;
use crate::instantiation::type_of::TypeOf;
use crate::values::constructor::{RecordField, RecordMaker, Said, construct, declared};
use crate::values::evaluate::Env;
use crate::values::value::{Fields, Value, widen};

/// Values of fields before the run.
struct Values<'t, 's, 'e> {
    scopes: &'t mut Scopes<'s>,
    /// Where the arguments stand, or the declaration of a variable.
    scope: Scope,
    env: &'e Env,
    /// Fields of which nothing is said are set later.
    set_later: bool,
}

impl Values<'_, '_, '_> {
    fn fitted(&mut self, value: Value, field: &RecordField) -> Value {
        let real = matches!(
            self.scopes.type_of(field.type_scope, &field.declaration.class),
            Ok(TypeOf::Scalar(crate::ScalarType::Real))
        );
        if real { widen(value) } else { value }
    }

    fn inside(&self, fields: &[(Name, Value)]) -> Env {
        Env { names: fields.to_vec(), calls: self.env.calls + 1, ..Env::default() }
    }
}

impl<'s> RecordMaker<'s> for Values<'_, 's, '_> {
    type Value = Value;
    type Fail = Reported;

    fn scopes(&mut self) -> &mut Scopes<'s> {
        self.scopes
    }

    fn given(&mut self, expr: &Expr, field: &RecordField) -> Result<Value, Reported> {
        let value = self.scopes.evaluate(expr, self.scope, self.env)?;
        Ok(self.fitted(value, field))
    }

    fn said(
        &mut self,
        expr: &Expr,
        scope: Scope,
        fields: Option<&[(Name, Value)]>,
        field: &RecordField,
    ) -> Result<Value, Reported> {
        let value = match fields {
            Some(fields) => {
                let env = self.inside(fields);
                self.scopes.evaluate(expr, scope, &env)?
            }
            None if scope.inst == self.scope.inst => self.scopes.evaluate(expr, scope, self.env)?,
            None => self.scopes.evaluate(expr, scope, &Env { calls: self.env.calls + 1, ..Env::default() })?,
        };
        Ok(self.fitted(value, field))
    }

    fn part(&mut self, span: Span, value: Value, at: &[usize]) -> Result<Value, Reported> {
        value.element(at).cloned().ok_or_else(|| {
            let message = "this gives too few elements to an array of records";
            self.scopes.error(Code::ArrayShape, span, message)
        })
    }

    fn sizes(&mut self, field: &RecordField, fields: &[(Name, Value)]) -> Result<Vec<usize>, Reported> {
        let env = self.inside(fields);
        self.scopes.local_sizes(&field.declaration, field.scope, &env)
    }

    fn unset(&mut self, field: &RecordField, fields: &[(Name, Value)]) -> Result<Option<Value>, Reported> {
        if self.set_later {
            let env = self.inside(fields);
            return self.scopes.unset(&field.declaration, field.scope, &env);
        }
        let message = format!("the field `{}` has no value", field.name);
        let span = field.declaration.name.span;
        self.scopes.table.report(Diagnostic::error(Code::BadArguments, message).at(span, "declared here"));
        Err(Reported)
    }

    fn record(&mut self, local: &LocalClass, fields: Vec<(Name, Value)>) -> Value {
        Value::Record(Arc::new(Fields { class: local.class, list: fields }))
    }

    fn array(&mut self, span: Span, items: Vec<Value>) -> Result<Value, Reported> {
        let array = Value::array(items);
        self.scopes.spend_on(&array, span)?;
        Ok(array)
    }

    fn no_elements(&mut self, _: Span, local: &LocalClass, sizes: &[usize]) -> Result<Value, Reported> {
        Ok(Value::array_of_records(Vec::new(), Some(local.class), || sizes[1..].to_vec()))
    }
}

impl Scopes<'_> {
    /// The record of a constructor call.
    pub(crate) fn constructed_value(
        &mut self,
        local: &LocalClass,
        span: Span,
        (positional, named): (&[Expr], &[(Ident, Expr)]),
        (scope, env): (Scope, &Env),
        only: Option<&Name>,
    ) -> Result<Value, Reported> {
        if env.calls >= crate::values::interpret::MAX_CALLS {
            return Err(self.too_deep(span));
        }
        let given = self.constructor_arguments(local, span, positional, named)?;
        construct(&mut Values { scopes: self, scope, env, set_later: false }, local, given, only)
    }

    /// `record.field`
    pub(crate) fn evaluate_field(
        &mut self,
        record: &Expr,
        name: &Ident,
        scope: Scope,
        env: &Env,
    ) -> Result<Value, Reported> {
        let constructor = match &record.kind {
            ExprKind::Call(function, Arguments::List { positional, named })
                if self.predefined(scope, function).is_none_or(|builtin| !builtin.is_known_before_run()) =>
            {
                self.constructed(scope, function)?.map(|local| (local, positional, named))
            }
            _ => None,
        };
        let value = match constructor {
            Some((local, positional, named)) => {
                let arguments = (positional.as_slice(), named.as_slice());
                self.constructed_value(&local, record.span, arguments, (scope, env), Some(&name.name))?
            }
            None => self.evaluate(record, scope, env)?,
        };
        self.field_of_value(record.span, &value, name)
    }

    /// A field of a record, or of each record of an array.
    pub(crate) fn field_of_value(&mut self, span: Span, value: &Value, name: &Ident) -> Result<Value, Reported> {
        if let Some(field) = value.field(&name.name) {
            return Ok(field);
        }
        let message = match value {
            Value::Record(_) => format!("the field `{}` does not exist or has no value yet", name.name),
            Value::Array(_) => format!("not all elements have a field `{}` with a value", name.name),
            other => format!("{} has no field `{}`", other.type_name(), name.name),
        };
        Err(self.no_meaning(span, message))
    }

    /// A variable of a function that is a record, before it is set; `None` for one of another type.
    pub(crate) fn unset_record(
        &mut self,
        component: &Component,
        scope: Scope,
        env: &Env,
    ) -> Result<Option<Value>, Reported> {
        let TypeOf::Class(local, _) = self.type_of(scope, &component.class)? else { return Ok(None) };
        if self.table.class(local.class).def.kind != ClassKind::Record {
            return Ok(None);
        }
        if component.dims.iter().any(|dim| matches!(dim.kind, ExprKind::Colon)) {
            let sizes = || vec![0; component.dims.len() - 1];
            return Ok(Some(Value::array_of_records(Vec::new(), Some(local.class), sizes)));
        }
        let sizes = self.local_sizes(component, scope, env)?;
        let tree = Arc::new(AstMod::from_syntax(&component.modification));
        let said = [Said { tree, scope, at: Vec::new() }];
        let span = component.name.span;
        declared(&mut Values { scopes: self, scope, env, set_later: true }, &local, &said, &sizes, span).map(Some)
    }

    /// The value of a component that is a record, at the subscripts of the steps that lead to it.
    pub(crate) fn value_of_record(
        &mut self,
        span: Span,
        steps: &[(InstId, &[Expr])],
        scope: Scope,
        env: &Env,
    ) -> Result<Value, Reported> {
        // One element after the other: what is said may differ between them.
        for (k, &(inst, subscripts)) in steps.iter().enumerate() {
            let sizes = self.instances[inst].dims.clone();
            if subscripts.len() >= sizes.len() && subscripts.iter().all(|s| self.is_one(s)) {
                continue;
            }
            let place = subscripts.iter().position(|s| !self.is_one(s)).unwrap_or(subscripts.len());
            let Some(&size) = sizes.get(place) else { return Err(self.no_meaning(span, "too many subscripts")) };
            let chosen = match subscripts.get(place) {
                Some(subscript) => self.positions_of(subscript, size, scope, env)?,
                None => Value::array((1..=size as i64).map(Value::Integer).collect()),
            };
            let single = !matches!(chosen, Value::Array(_));
            let mut items = Vec::new();
            for value in chosen.items().iter() {
                let number = match value {
                    Value::Integer(k) => *k,
                    Value::Enumeration(_, k) => i64::from(*k),
                    Value::Boolean(b) => i64::from(*b) + 1,
                    _ => return Err(self.no_meaning(span, "a subscript must be an Integer")),
                };
                let mut own = subscripts.to_vec();
                let expr = Expr { kind: ExprKind::Integer(number), span };
                match own.get_mut(place) {
                    Some(old) => *old = expr,
                    None => own.push(expr),
                }
                let mut inner = steps.to_vec();
                inner[k] = (inst, &own);
                items.push(self.value_of_record(span, &inner, scope, env)?);
            }
            return match (single, items.pop()) {
                (true, Some(only)) => Ok(only),
                (_, last) => {
                    items.extend(last);
                    let class = self.instances[steps[steps.len() - 1].0].class;
                    Ok(Value::array_of_records(items, class, || sizes[place + 1..].to_vec()))
                }
            };
        }
        let (record, _) = steps[steps.len() - 1];
        let mut fields = Vec::new();
        for child in self.instances[record].children.clone() {
            let mut inner = steps.to_vec();
            inner.push((child, &[]));
            let value = self.evaluate_steps(span, &inner, scope, env)?;
            fields.push((self.instances[child].name.clone(), value));
        }
        let class = self.instances[record].class.ok_or(Reported)?;
        Ok(Value::Record(Arc::new(Fields { class, list: fields })))
    }

    fn is_one(&self, subscript: &Expr) -> bool {
        matches!(subscript.kind, ExprKind::Integer(_))
    }
}
