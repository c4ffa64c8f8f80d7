//! Functions of the user computed at translation: their algorithms run over values.
//!
//! A call with known arguments in a size, a condition, an attribute or a constant is computed here (Modelica 3.6, chapter 12).
//! The run is bounded in work (`work`) and in depth of calls, so that a mistake ends in a message.

use std::sync::Arc;

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{
    Arguments, ClassBody, ClassKind, Component, ComponentRef, Direction, Expr, ExprKind, Name, Statement, StatementKind,
};

use crate::instantiation::instance::{InstId, Scope};
use crate::instantiation::lookup::Resolved;
use crate::instantiation::scopes::Scopes;
use crate::instantiation::work::{ELEMENT, STATEMENT, volume};
use crate::values::evaluate::Env;
use crate::values::external_call::{is_set_by_call, value_so_far};
use crate::values::function_components::{FunctionComponent, in_order_of_values};
use crate::values::value::{Value, widen};

/// Deepest nesting of calls at translation.
pub(crate) const MAX_CALLS: usize = 128;

/// Arguments of a call and where they are evaluated.
struct Given<'a> {
    positional: &'a [Expr],
    named: &'a [(hyd_syntax::tree::Ident, Expr)],
    scope: Scope,
    env: &'a Env,
}

/// How a list of statements ended.
#[derive(PartialEq, Eq)]
enum Flow {
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
    /// The outputs of a call of a user's function; `None` if the name is not a function that has an algorithm.
    pub(crate) fn call_function(
        &mut self,
        span: Span,
        function: &ComponentRef,
        positional: &[Expr],
        named: &[(hyd_syntax::tree::Ident, Expr)],
        scope: Scope,
        env: &Env,
    ) -> Result<Option<Vec<Value>>, Reported> {
        let Resolved::Class(local) = self.resolve(scope, function)? else { return Ok(None) };
        let local = self.constructor_of_object(&local)?.unwrap_or(local);
        let mut def = self.table.class(local.class).def.clone();
        let mut local = local;
        if def.kind == ClassKind::Record
            && let Some(constructor) = self.constructor_for(&local, positional, named)?
        {
            def = self.table.class(constructor.class).def.clone();
            local = constructor;
        }
        if def.kind == ClassKind::Record {
            let record = self.constructed_value(&local, span, (positional, named), (scope, env), None)?;
            return Ok(Some(vec![record]));
        }
        if def.kind != ClassKind::Function {
            return Ok(None);
        }
        if env.calls >= MAX_CALLS {
            return Err(self.too_deep(span));
        }
        let shape = self.table.shape(local.class)?;
        let inst = self.package_of(&local)?;
        let components = in_order_of_values(self.function_components(inst, &shape)?);
        let mut inner = Env { calls: env.calls + 1, ..Env::default() };
        let given = Given { positional, named, scope, env };
        self.set_components(span, &components, inst, &given, &mut inner)?;
        let components: Vec<(u32, Component)> = components.into_iter().map(|own| (own.frame, own.component)).collect();
        for (frame, part) in shape.frames.iter().enumerate() {
            let owner = self.table.class(part.class).def.clone();
            let ClassBody::Long { algorithms, external, .. } = &owner.body else { continue };
            if let Some(external) = external {
                if self.is_column_reader(external) {
                    return self.column_outputs(span, &components, &inner.names).map(Some);
                }
                let own = Scope { inst, frame: frame as u32 };
                let Some(call) = &external.call else { return Ok(None) };
                let mut arguments = Vec::with_capacity(call.arguments.len());
                for argument in &call.arguments {
                    // What the function sets has the value of its declaration, if any.
                    let set = is_set_by_call(argument, &components).map(|name| value_so_far(&inner, name));
                    arguments.push(match set {
                        Some(value) => value.unwrap_or(Value::Integer(0)),
                        None => self.evaluate(argument, own, &inner)?,
                    });
                }
                let Some(set) = self.call_external(span, call, &components, own, &arguments)? else { return Ok(None) };
                for (target, value) in set {
                    self.set_local(&target, value, own, &mut inner)?;
                }
            }
            for section in algorithms {
                let own = Scope { inst, frame: frame as u32 };
                if self.run_statements(&section.statements, own, &mut inner)? == Flow::Return {
                    break;
                }
            }
        }
        self.outputs_of(span, &def.name.name, &components, &inner).map(Some)
    }

    pub(crate) fn too_deep(&mut self, span: Span) -> Reported {
        let message = format!("functions call each other deeper than {MAX_CALLS} levels at translation");
        self.error(Code::Limit, span, message)
    }

    /// Gives inputs what the call says or their defaults, and the others their defaults.
    fn set_components(
        &mut self,
        span: Span,
        components: &[FunctionComponent],
        inst: InstId,
        given: &Given<'_>,
        inner: &mut Env,
    ) -> Result<(), Reported> {
        let mut position = 0;
        for FunctionComponent { frame, component, value_scope } in components {
            let own = Scope { inst, frame: *frame };
            let name = component.name.name.clone();
            let is_input = component.direction == Some(Direction::Input);
            let argument = if is_input {
                position += 1;
                let by_name = || given.named.iter().find(|(n, _)| n.name == name).map(|(_, e)| e);
                given.positional.get(position - 1).or_else(by_name)
            } else {
                None
            };
            let value = match (argument, &component.modification.binding) {
                (Some(expr), _) => self.evaluate(expr, given.scope, given.env)?,
                (None, Some(default)) => match *value_scope {
                    Some(around) => self.evaluate(default, around, &Env::default())?,
                    None => self.evaluate(default, own, inner)?,
                },
                (None, None) if is_input => {
                    let message = format!("the input `{name}` has no value");
                    return Err(self.error(Code::BadArguments, span, message));
                }
                (None, None) => match self.unset(component, own, inner)? {
                    Some(value) => value,
                    None => continue,
                },
            };
            inner.names.push((name, fitted(component, value)));
        }
        Ok(())
    }

    /// Values of the outputs after a call.
    fn outputs_of(
        &mut self,
        span: Span,
        function: &str,
        components: &[(u32, Component)],
        inner: &Env,
    ) -> Result<Vec<Value>, Reported> {
        let mut outputs = Vec::new();
        for (_, output) in components.iter().filter(|(_, c)| c.direction == Some(Direction::Output)) {
            let Some((_, value)) = inner.names.iter().find(|(n, _)| *n == output.name.name) else {
                let message = format!("`{function}` does not set its output `{}`", output.name.name);
                return Err(self.error(Code::BadArguments, span, message));
            };
            outputs.push(fitted(output, value.clone()));
        }
        Ok(outputs)
    }

    /// An array before its elements are set, or a record; nothing for a scalar, which must be set before it is read.
    pub(crate) fn unset(&mut self, component: &Component, scope: Scope, env: &Env) -> Result<Option<Value>, Reported> {
        if let Some(record) = self.unset_record(component, scope, env)? {
            return Ok(Some(record));
        }
        let span = match (component.dims.first(), component.dims.last()) {
            (Some(first), Some(last)) => first.span.to(last.span),
            _ => component.name.span,
        };
        let zero = match component.class.parts[0].name.as_ref() {
            "Integer" => Value::Integer(0),
            "Boolean" => Value::Boolean(false),
            "String" => Value::Text("".into()),
            _ => Value::Real(0.0),
        };
        if component.dims.iter().any(|dim| matches!(dim.kind, hyd_syntax::tree::ExprKind::Colon)) {
            return Ok(None);
        }
        let sizes = self.local_sizes(component, scope, env)?;
        if sizes.is_empty() {
            return Ok(None);
        }
        let count = volume(&sizes).unwrap_or(0);
        self.spend(ELEMENT * count as u64, span)?;
        let value = sizes.iter().rev().fold(zero, |value, &size| Value::array(vec![value; size]));
        Ok(Some(value))
    }

    /// The sizes of a variable of a function.
    pub(crate) fn local_sizes(
        &mut self,
        component: &Component,
        scope: Scope,
        env: &Env,
    ) -> Result<Vec<usize>, Reported> {
        let mut sizes = Vec::with_capacity(component.dims.len());
        for dim in &component.dims {
            let size = match self.evaluate(dim, scope, env)? {
                Value::Integer(k) => usize::try_from(k).ok(),
                // An enumeration or Boolean as a size: one element per value.
                Value::Array(items)
                    if items.iter().all(|v| matches!(v, Value::Enumeration(..) | Value::Boolean(_))) =>
                {
                    Some(items.len())
                }
                _ => None,
            };
            sizes.extend(size);
        }
        if sizes.len() != component.dims.len() || volume(&sizes).is_none() {
            let span = component.dims.first().map_or(component.name.span, |dim| dim.span);
            let message = format!("the size of `{}` is not an integer in range", component.name.name);
            return Err(self.error(Code::ArrayShape, span, message));
        }
        sizes.extend(self.sizes_of_type(component, scope)?);
        Ok(sizes)
    }

    fn run_statements(&mut self, statements: &[Statement], scope: Scope, env: &mut Env) -> Result<Flow, Reported> {
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

/// A value as the declaration's type holds it: integers become Real where it says so.
fn fitted(component: &Component, value: Value) -> Value {
    let class = component.class.parts[component.class.parts.len() - 1].name.as_ref();
    if class == "Real" { widen(value) } else { value }
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
