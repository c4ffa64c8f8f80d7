//! Statements run over values at translation (Modelica 3.6, chapter 11): those of functions and of initial algorithms.
//!
//! The run is bounded in work (`work`) and in depth of calls, so that a mistake ends in a message.

use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{Arguments, ComponentRef, Expr, ExprKind, Name, Statement, StatementKind};

use crate::instantiation::instance::Scope;
use crate::instantiation::scopes::Scopes;
use crate::instantiation::work::STATEMENT;
use crate::values::evaluate::Env;
use crate::values::value::{Fields, Value, widen};

/// Deepest nesting of calls at translation.
pub(crate) const MAX_CALLS: usize = 128;

/// How a list of statements ended.
#[derive(PartialEq, Eq)]
pub(crate) enum Flow {
    Next,
    Break,
    Return,
}

/// A part of what is assigned to: a name and the positions in each dimension.
struct Part {
    name: Name,
    positions: Vec<(Span, Value)>,
}

impl Scopes<'_> {
    pub(crate) fn run_statements(
        &mut self,
        statements: &[Statement],
        scope: Scope,
        env: &mut Env,
    ) -> Result<Flow, Reported> {
        for statement in statements {
            self.spend(STATEMENT, statement.span)?;
            let flow = self.run_statement(statement, scope, env)?;
            if flow != Flow::Next {
                return Ok(flow);
            }
        }
        Ok(Flow::Next)
    }

    fn run_statement(&mut self, statement: &Statement, scope: Scope, env: &mut Env) -> Result<Flow, Reported> {
        match &statement.kind {
            StatementKind::Assign(target, value) => {
                let value = self.evaluate(value, scope, env)?;
                self.set_local(target, value, scope, env)?;
            }
            StatementKind::AssignTuple(targets, function, arguments) => {
                let outputs = self.call_of(statement.span, function, arguments, scope, env)?;
                for (target, value) in targets.iter().zip(outputs) {
                    if let Some(target) = target {
                        self.set_local(target, value, scope, env)?;
                    }
                }
            }
            StatementKind::If(branches) => {
                for (condition, body) in branches {
                    let taken = match condition {
                        Some(condition) => self.holds(condition, scope, env)?,
                        None => true,
                    };
                    if taken {
                        return self.run_statements(body, scope, env);
                    }
                }
            }
            StatementKind::For(iterators, body) => {
                return self.run_loop(iterators, body, scope, env);
            }
            StatementKind::While(condition, body) => {
                while self.holds(condition, scope, env)? {
                    self.spend(STATEMENT, statement.span)?;
                    match self.run_statements(body, scope, env)? {
                        Flow::Next => {}
                        Flow::Break => break,
                        Flow::Return => return Ok(Flow::Return),
                    }
                }
            }
            StatementKind::Break => return Ok(Flow::Break),
            StatementKind::Return => return Ok(Flow::Return),
            StatementKind::Call(function, arguments) => {
                self.run_call(statement.span, function, arguments, scope, env)?
            }
            StatementKind::When(_) => {
                let message = "`when` is not allowed in a function";
                return Err(self.error(Code::Misplaced, statement.span, message));
            }
        }
        Ok(Flow::Next)
    }

    fn run_call(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
        scope: Scope,
        env: &Env,
    ) -> Result<(), Reported> {
        if function.parts[0].name.name.as_ref() != "assert" {
            return self.call_of(span, function, arguments, scope, env).map(|_| ());
        }
        let Arguments::List { positional, .. } = arguments else { return Ok(()) };
        let [condition, text, ..] = positional.as_slice() else { return Ok(()) };
        if self.holds(condition, scope, env)? {
            return Ok(());
        }
        let text = match self.evaluate(text, scope, env)? {
            Value::Text(text) => text.to_string(),
            other => other.text(),
        };
        self.table.report(Diagnostic::error(Code::Value, text).at(span, "this assertion fails before the run"));
        Err(Reported)
    }

    fn call_of(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
        scope: Scope,
        env: &Env,
    ) -> Result<Vec<Value>, Reported> {
        if let Arguments::List { positional, named } = arguments
            && let Some(outputs) = self.call_function(span, function, positional, named, scope, env)?
        {
            return Ok(outputs);
        }
        Err(self.error(Code::BadArguments, span, "a function is needed here"))
    }

    fn holds(&mut self, condition: &Expr, scope: Scope, env: &Env) -> Result<bool, Reported> {
        match self.evaluate(condition, scope, env)? {
            Value::Boolean(holds) => Ok(holds),
            other => {
                let message = format!("a condition must be Boolean, not {}", other.type_name());
                Err(self.error(Code::TypeMismatch, condition.span, message))
            }
        }
    }

    fn run_loop(
        &mut self,
        iterators: &[hyd_syntax::tree::Iterator],
        body: &[Statement],
        scope: Scope,
        env: &mut Env,
    ) -> Result<Flow, Reported> {
        let Some((iterator, rest)) = iterators.split_first() else { return self.run_statements(body, scope, env) };
        for value in self.values_of(iterator, scope, env)?.items().iter() {
            env.names.push((iterator.name.name.clone(), value.clone()));
            let flow = self.run_loop(rest, body, scope, env);
            if let Some(at) = env.names.iter().rposition(|(n, _)| *n == iterator.name.name) {
                env.names.remove(at);
            }
            match flow? {
                Flow::Next => {}
                // The loops of further iterators stand inside (11.2.2.3): this one is left, and those around it go on.
                Flow::Break => break,
                Flow::Return => return Ok(Flow::Return),
            }
        }
        Ok(Flow::Next)
    }

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
            return Err(self.error(Code::NoValue, target.span, message));
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
                    return Err(self.error(Code::ArrayShape, target.span, "too many subscripts"));
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
                let fields = &mut Arc::make_mut(fields).list;
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
            return Err(self.error(Code::ArrayShape, span, "too many subscripts"));
        };
        let count = items.len();
        let mut place = |scopes: &mut Self, k: &Value, value: Value| -> Result<(), Reported> {
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
                Some(item) => scopes.set_elements(span, item, rest, inner, value),
                None => {
                    let message = format!("subscript {position} is outside 1..{count}");
                    Err(scopes.error(Code::ArrayShape, *place_of, message))
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
                Err(self.error(Code::ArrayShape, span, message))
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
                let before = old.list.iter().find(|(n, _)| n == name);
                (name.clone(), before.map_or_else(|| value.clone(), |(_, before)| like(before, value.clone())))
            };
            Value::Record(Arc::new(Fields { class: old.class, list: new.list.iter().map(field).collect() }))
        }
        (old, value) if matches!(old.first(), Some(Value::Real(_))) => widen(value),
        (_, value) => value,
    }
}
