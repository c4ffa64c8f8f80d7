//! Assignments of functions that are computed at translation: to names, elements and fields.

use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{ComponentRef, Expr, ExprKind, Name};

use crate::build::InstanceTree;
use crate::evaluate::Env;
use crate::instance::Scope;
use crate::value::{Value, widen};

/// A part of what is assigned to: a name and the positions in each dimension.
struct Part {
    name: Name,
    positions: Vec<(Span, Value)>,
}

impl InstanceTree<'_> {
    /// `a := v`, `a[i] := v`, `a[1:2, :] := v`, `r[i].a := v`.
    pub(crate) fn set_local(
        &mut self,
        target: &ComponentRef,
        value: Value,
        scope: Scope,
        env: &mut Env,
    ) -> Result<(), Reported> {
        let name: &Name = &target.parts[0].name.name;
        let Some(at) = env.names.iter().rposition(|(n, _)| n == name) else {
            if target.parts.len() == 1 && target.parts[0].subscripts.is_empty() {
                env.names.push((name.clone(), value));
                return Ok(());
            }
            let message = format!("`{name}` has no value yet that a part could be set of");
            self.table.report(Diagnostic::error(Code::NoValue, message).at(target.span, ""));
            return Err(Reported);
        };
        // Subscripts may read the array that is written to.
        let mut parts = Vec::with_capacity(target.parts.len());
        let mut place = Some(env.names[at].1.clone());
        for (k, part) in target.parts.iter().enumerate() {
            if k > 0 {
                place = place.as_ref().and_then(|value| value.first()?.field(&part.name.name));
            }
            let sizes = place.as_ref().map_or_else(Vec::new, Value::shape);
            let mut positions = Vec::with_capacity(part.subscripts.len());
            for (k, subscript) in part.subscripts.iter().enumerate() {
                let Some(&size) = sizes.get(k) else {
                    self.table.report(Diagnostic::error(Code::ArrayShape, "too many subscripts").at(target.span, ""));
                    return Err(Reported);
                };
                positions.push((subscript.span, self.positions_of(subscript, size, scope, env)?));
            }
            parts.push(Part { name: part.name.name.clone(), positions });
        }
        self.set_elements(target.span, &mut env.names[at].1, &parts[0].positions, &parts[1..], value)
    }

    /// Sets a field of a record, or of each record of an array.
    fn set_field(
        &mut self,
        span: Span,
        whole: &mut Value,
        field: &Part,
        inner: &[Part],
        value: Value,
    ) -> Result<(), Reported> {
        match (whole, value) {
            (Value::Record(fields), value) => {
                let fields = Arc::make_mut(fields);
                match fields.iter_mut().find(|(name, _)| *name == field.name) {
                    Some((_, old)) => self.set_elements(span, old, &field.positions, inner, value),
                    None if field.positions.is_empty() && inner.is_empty() => {
                        fields.push((field.name.clone(), value));
                        Ok(())
                    }
                    None => Err(self.no_meaning(span, format!("the field `{}` has no value yet", field.name))),
                }
            }
            (Value::Array(items), Value::Array(values)) if items.len() == values.len() => {
                let items = Arc::make_mut(items).iter_mut().zip(values.iter());
                for (item, value) in items {
                    self.set_field(span, item, field, inner, value.clone())?;
                }
                Ok(())
            }
            _ => Err(self.no_meaning(span, format!("there is no field `{}` of this size to set", field.name))),
        }
    }

    /// What a subscript names of a dimension: one position from 1 or an array of them.
    pub(crate) fn positions_of(
        &mut self,
        subscript: &Expr,
        size: usize,
        scope: Scope,
        env: &Env,
    ) -> Result<Value, Reported> {
        if matches!(subscript.kind, ExprKind::Colon) {
            return Ok(Value::array((1..=size as i64).map(Value::Integer).collect()));
        }
        let mut inner = env.clone();
        inner.ends.push(size);
        self.evaluate(subscript, scope, &inner)
    }

    fn set_elements(
        &mut self,
        span: Span,
        whole: &mut Value,
        positions: &[(Span, Value)],
        inner: &[Part],
        value: Value,
    ) -> Result<(), Reported> {
        let Some(((place_of, first), rest)) = positions.split_first() else {
            if let Some((field, deeper)) = inner.split_first() {
                return self.set_field(span, whole, field, deeper, value);
            }
            // A Real stays a Real when it is set to an integer, and so do the fields of a record.
            *whole = like(whole, value);
            return Ok(());
        };
        let Value::Array(items) = whole else {
            self.table.report(Diagnostic::error(Code::ArrayShape, "too many subscripts").at(span, ""));
            return Err(Reported);
        };
        let count = items.len();
        let mut place = |tree: &mut Self, k: &Value, value: Value| -> Result<(), Reported> {
            let position = match k {
                Value::Integer(k) => *k,
                Value::Enumeration(_, k) => i64::from(*k),
                Value::Boolean(b) => i64::from(*b) + 1,
                _ => 0,
            };
            match position
                .checked_sub(1)
                .and_then(|k| usize::try_from(k).ok())
                .and_then(|k| Arc::make_mut(items).get_mut(k))
            {
                Some(item) => tree.set_elements(span, item, rest, inner, value),
                None => {
                    let message = format!("subscript {position} is outside 1..{count}");
                    tree.table.report(Diagnostic::error(Code::ArrayShape, message).at(*place_of, ""));
                    Err(Reported)
                }
            }
        };
        match (first, value) {
            (Value::Array(list), Value::Array(values)) if list.len() == values.len() => {
                list.iter().zip(values.iter()).try_for_each(|(k, v)| place(self, k, v.clone()))
            }
            (Value::Array(list), value) => {
                let given = value.shape().first().copied().unwrap_or(1);
                let message = format!("{given} values are given to {} elements", list.len());
                self.table.report(Diagnostic::error(Code::ArrayShape, message).at(span, ""));
                Err(Reported)
            }
            (single, value) => place(self, single, value),
        }
    }
}

/// A value in the place of another one: integers become Real where that was Real.
fn like(old: &Value, value: Value) -> Value {
    match (old, value) {
        (Value::Record(old), Value::Record(new)) => {
            let field = |(name, value): &(Name, Value)| {
                let before = old.iter().find(|(n, _)| n == name);
                (name.clone(), before.map_or_else(|| value.clone(), |(_, before)| like(before, value.clone())))
            };
            Value::Record(Arc::new(new.iter().map(field).collect()))
        }
        (old, value) if matches!(old.first(), Some(Value::Real(_))) => widen(value),
        (_, value) => value,
    }
}
