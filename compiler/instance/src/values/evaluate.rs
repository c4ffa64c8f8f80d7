//! Values at translation: expressions of constants and parameters, asked for by sizes, conditions, ranges and attributes.
//!
//! The value of a parameter is its binding evaluated in the binding's scope, cached per instance; circles are reported.  A
//! parameter asked for here becomes structural: it cannot change on the translated model.

use hyd_source::{Code, Diagnostic, Reported, Span};
use hyd_syntax::tree::{Arguments, BinaryOp, ComponentRef, Expr, ExprKind, Ident, Iterator, Name, UnaryOp};
use hyd_system::{TextFormat, ValueKind};

use crate::builtins::Builtin;
use crate::instantiation::instance::Scope;
use crate::instantiation::lookup::Resolved;
use crate::instantiation::scopes::Scopes;
use crate::instantiation::work::{ELEMENT, TURN};
use crate::values::arithmetic::binary;
use crate::values::function_value::FunctionValue;
use crate::values::range::{self, ZERO_STEP};
use crate::values::value::Value;

/// Deepest nesting of expressions whose values need each other: an expression may be 1000 deep by itself.
const MAX_EVALUATING: usize = 1500;

/// Loop variables and their values, innermost last.
#[derive(Clone, Debug, Default)]
pub struct Env {
    /// Names and values.
    pub names: Vec<(Name, Value)>,
    /// Sizes that `end` means, innermost last.
    pub ends: Vec<usize>,
    /// Nesting of function calls.
    pub calls: usize,
    /// Inputs that are functions.
    pub functions: Vec<(Name, FunctionValue)>,
}

impl Env {
    pub(crate) fn get(&self, name: &str) -> Option<&Value> {
        self.names.iter().rev().find(|(n, _)| n.as_ref() == name).map(|(_, v)| v)
    }
}

impl Scopes<'_> {
    /// Evaluates an expression of constants and parameters.
    pub fn evaluate(&mut self, expr: &Expr, scope: Scope, env: &Env) -> Result<Value, Reported> {
        if self.evaluating >= MAX_EVALUATING {
            let message = format!("values that need each other are nested deeper than {MAX_EVALUATING} expressions");
            self.table.report(Diagnostic::error(Code::Limit, message).at(expr.span, "needed here"));
            return Err(Reported);
        }
        self.evaluating += 1;
        let value = self.evaluate_kind(expr, scope, env);
        self.evaluating -= 1;
        if let Ok(array @ Value::Array(_)) = &value {
            self.spend_on(array, expr.span)?;
        }
        value
    }

    fn evaluate_kind(&mut self, expr: &Expr, scope: Scope, env: &Env) -> Result<Value, Reported> {
        match &expr.kind {
            ExprKind::Integer(k) => Ok(Value::Integer(*k)),
            ExprKind::Real(x) => Ok(Value::Real(*x)),
            ExprKind::Text(text) => Ok(Value::Text(text.clone())),
            ExprKind::Boolean(b) => Ok(Value::Boolean(*b)),
            ExprKind::Ref(reference) => self.evaluate_ref(reference, scope, env),
            ExprKind::Call(function, arguments) => match self.array_of_call(scope, function, arguments, expr.span) {
                Some(array) => self.evaluate_kind(&array, scope, env),
                None => self.evaluate_call(expr.span, function, arguments, scope, env),
            },
            ExprKind::Unary(op, a) => {
                let value = self.evaluate(a, scope, env)?;
                if let Some(result) = self.unary_of_record(expr.span, *op, &value, (scope, env))? {
                    return Ok(result);
                }
                let result = match (op, &value) {
                    (UnaryOp::Plus, _) => Some(value.clone()),
                    (UnaryOp::Minus, v) => v.negate(),
                    (UnaryOp::Not, Value::Boolean(b)) => Some(Value::Boolean(!b)),
                    _ => None,
                };
                result.ok_or_else(|| {
                    self.no_meaning(expr.span, format!("the operator has no meaning for {}", value.type_name()))
                })
            }
            ExprKind::Binary(op, a, b) => {
                let (x, y) = (self.evaluate(a, scope, env)?, self.evaluate(b, scope, env)?);
                if let (BinaryOp::Mul, Value::Array(_), [_, columns, ..]) = (op, &x, y.shape().as_slice()) {
                    let elements: usize = x.shape().iter().product();
                    self.spend(ELEMENT * (elements as u64).saturating_mul(*columns as u64), expr.span)?;
                }
                if let Some(result) = self.binary_of_records(expr.span, *op, (&x, &y), (scope, env))? {
                    return Ok(result);
                }
                binary(*op, &x, &y).ok_or_else(|| {
                    if let (Value::Integer(_), Value::Integer(_)) = (&x, &y) {
                        let message = "the result is not an Integer that can be represented";
                        return self.error(Code::Value, expr.span, message);
                    }
                    let message = format!("the operator has no meaning for {} and {}", x.type_name(), y.type_name());
                    self.no_meaning(expr.span, message)
                })
            }
            ExprKind::If(branches, otherwise) => {
                for (condition, value) in branches {
                    match self.evaluate(condition, scope, env)? {
                        Value::Boolean(true) => return self.evaluate(value, scope, env),
                        Value::Boolean(false) => {}
                        other => {
                            return Err(self.no_meaning(
                                condition.span,
                                format!("a condition must be Boolean, not {}", other.type_name()),
                            ));
                        }
                    }
                }
                self.evaluate(otherwise, scope, env)
            }
            ExprKind::Range(start, step, stop) => {
                let (first, last) = (self.evaluate(start, scope, env)?, self.evaluate(stop, scope, env)?);
                let by = step.as_ref().map(|step| self.evaluate(step, scope, env)).transpose()?;
                let step = by.clone().unwrap_or(Value::Integer(1));
                if step.as_real() == Some(0.0) {
                    return Err(self.error(Code::Value, expr.span, ZERO_STEP));
                }
                let values = range::values(&first, &step, &last, by.is_some()).map(Value::array);
                values.ok_or_else(|| self.no_meaning(expr.span, "this range has no meaning or too many values"))
            }
            ExprKind::Array(items) => {
                items.iter().map(|e| self.evaluate(e, scope, env)).collect::<Result<_, _>>().map(Value::array)
            }
            ExprKind::ArrayFor(body, iterators) => self.comprehension(body, iterators, scope, env),
            ExprKind::Matrix(rows) => {
                // `[A]` of a matrix, or of an array with more dimensions, is `A` (10.4.2).
                if let [row] = rows.as_slice()
                    && let [only] = row.as_slice()
                {
                    let value = self.evaluate(only, scope, env)?;
                    if value.shape().len() >= 2 {
                        return Ok(value);
                    }
                }
                let mut values = Vec::with_capacity(rows.len());
                for row in rows {
                    let items: Vec<Value> =
                        row.iter().map(|e| self.evaluate(e, scope, env)).collect::<Result<_, _>>()?;
                    values.push(items);
                }
                crate::builtins::matrix(&values).ok_or_else(|| {
                    let message = "the parts of this matrix have sizes that do not go together";
                    self.error(Code::ArrayShape, expr.span, message)
                })
            }
            ExprKind::Tuple(items) => match items.as_slice() {
                [Some(only)] => self.evaluate(only, scope, env),
                _ => Err(self.no_meaning(expr.span, "a list of results is not a value")),
            },
            ExprKind::Partial(..) => {
                Err(self.no_meaning(expr.span, "a function is a value only as the argument of another one"))
            }
            ExprKind::Field(record, name) => self.evaluate_field(record, name, scope, env),
            ExprKind::Colon => Err(self.no_meaning(expr.span, "`:` is not a value")),
            ExprKind::End => match env.ends.last() {
                Some(&size) => Ok(Value::Integer(size as i64)),
                None => Err(self.no_meaning(expr.span, "`end` is allowed only in subscripts")),
            },
        }
    }

    /// The values of a loop variable.
    pub(crate) fn values_of(&mut self, iterator: &Iterator, scope: Scope, env: &Env) -> Result<Value, Reported> {
        match &iterator.range {
            Some(range) => self.evaluate(range, scope, env),
            None => Err(self.no_range(iterator)),
        }
    }

    /// Says that a loop variable has no values: they do not follow from what it is a subscript of.
    pub fn no_range(&mut self, iterator: &Iterator) -> Reported {
        let message = format!("the range of `{}` must be written", iterator.name.name);
        self.error(Code::NotStructural, iterator.name.span, message)
    }

    /// Runs `body` for all values of the iterators, the first iterator outermost.
    pub fn for_each(
        &mut self,
        iterators: &[Iterator],
        scope: Scope,
        env: &Env,
        body: &mut dyn FnMut(&mut Self, &Env) -> Result<(), Reported>,
    ) -> Result<(), Reported> {
        let Some((iterator, rest)) = iterators.split_first() else { return body(self, env) };
        let span = iterator.range.as_ref().map_or(iterator.name.span, |range| range.span);
        for value in self.values_of(iterator, scope, env)?.items().iter() {
            self.spend(TURN, span)?;
            let mut inner = env.clone();
            inner.names.push((iterator.name.name.clone(), value.clone()));
            self.for_each(rest, scope, &inner, body)?;
        }
        Ok(())
    }

    /// `{e for i in A, j in B}` is `{{e for i in A} for j in B}`: the last iterator is the outermost (10.4.1).
    fn comprehension(
        &mut self,
        body: &Expr,
        iterators: &[Iterator],
        scope: Scope,
        env: &Env,
    ) -> Result<Value, Reported> {
        let Some((last, inner)) = iterators.split_last() else { return self.evaluate(body, scope, env) };
        let mut items = Vec::new();
        self.for_each(std::slice::from_ref(last), scope, env, &mut |scopes, env| {
            items.push(scopes.comprehension(body, inner, scope, env)?);
            Ok(())
        })?;
        if items.is_empty() {
            return Ok(Value::array_of(items, || self.sizes_of_turn(body, last, inner, scope, env)));
        }
        Ok(Value::array(items))
    }

    /// Sizes of what a turn of a loop without turns would give, as far as they are known without one.
    fn sizes_of_turn(
        &mut self,
        body: &Expr,
        last: &Iterator,
        inner: &[Iterator],
        scope: Scope,
        env: &Env,
    ) -> Vec<usize> {
        let mut env = env.clone();
        env.names.push((last.name.name.clone(), Value::Integer(1)));
        let turn = Expr { kind: ExprKind::ArrayFor(Box::new(body.clone()), inner.to_vec()), span: body.span };
        self.quietly(|scopes| scopes.shape_of(&turn, scope, &env)).unwrap_or_default()
    }

    fn evaluate_call(
        &mut self,
        span: Span,
        function: &ComponentRef,
        arguments: &Arguments,
        scope: Scope,
        env: &Env,
    ) -> Result<Value, Reported> {
        let name = function.parts.iter().map(|p| p.name.name.as_ref()).collect::<Vec<_>>().join(".");
        let known = self.predefined(scope, function).filter(|builtin| builtin.is_known_before_run());
        let mut values = Vec::new();
        match arguments {
            Arguments::List { positional, named } => {
                let Some(builtin) = known else {
                    return match self.call_function(span, function, positional, named, scope, env)? {
                        Some(outputs) => outputs.into_iter().next().ok_or(Reported),
                        None => {
                            Err(self.not_structural(span, format!("`{name}(...)` cannot be computed before the run")))
                        }
                    };
                };
                if builtin == Builtin::Text {
                    return self.evaluate_text(span, positional, named, scope, env);
                }
                if builtin == Builtin::InstanceName {
                    return self.instance_name(span, scope);
                }
                if builtin.asks_for_connections() {
                    return self.about_connections(builtin, span, positional, scope, env);
                }
                if builtin == Builtin::Size {
                    return self.evaluate_size(span, positional, scope, env);
                }
                for argument in positional {
                    values.push(self.evaluate(argument, scope, env)?);
                }
            }
            Arguments::Reduction(body, iterators) => {
                let mut items = Vec::new();
                self.for_each(iterators, scope, env, &mut |scopes, inner| {
                    items.push(scopes.evaluate(body, scope, inner)?);
                    Ok(())
                })?;
                values.push(Value::array(items));
            }
        }
        match known.and_then(|builtin| crate::builtins::value(builtin, &values)) {
            Some(value) => Ok(value),
            None => {
                if matches!(name.as_str(), "div" | "mod" | "rem") && values.get(1).and_then(Value::as_real) == Some(0.0)
                {
                    return Err(self.error(Code::Value, span, "division by zero"));
                }
                Err(self.not_structural(span, format!("`{name}(...)` cannot be computed before the run")))
            }
        }
    }

    fn evaluate_size(&mut self, span: Span, arguments: &[Expr], scope: Scope, env: &Env) -> Result<Value, Reported> {
        let shape = match arguments.first().map(|e| &e.kind) {
            Some(ExprKind::Ref(reference)) if env.get(&reference.parts[0].name.name).is_none() => {
                if let Some(named) = self.parts_named(reference, scope, env) {
                    let rest = arguments[1..].iter().cloned();
                    let arguments: Vec<Expr> = std::iter::once(named).chain(rest).collect();
                    return self.evaluate_size(span, &arguments, scope, env);
                }
                match self.resolve(scope, reference)? {
                    Resolved::Variable(steps) if steps.iter().all(|(_, s)| s.is_empty()) => {
                        let sizes = |scopes: &Self| -> Vec<usize> {
                            steps.iter().flat_map(|(inst, _)| scopes.instances[*inst].dims.clone()).collect()
                        };
                        // Of a declaration `A[:, size(A, 1)]` the first size is known while the second is asked for.
                        if let Some(ExprKind::Integer(k)) = arguments.get(1).map(|e| &e.kind)
                            && let Some(position) = usize::try_from(*k).ok().and_then(|k| k.checked_sub(1))
                            && let Some(&known) = sizes(self).get(position)
                        {
                            return Ok(Value::Integer(known as i64));
                        }
                        for (inst, _) in &steps {
                            self.want_made(*inst, span)?;
                        }
                        sizes(self)
                    }
                    _ => self.evaluate(&arguments[0], scope, env)?.shape(),
                }
            }
            Some(_) if self.depends_on_run(&arguments[0], scope, env) => self.shape_of(&arguments[0], scope, env)?,
            // Sizes cost nothing, however long the array.
            Some(_) => self.evaluate_kind(&arguments[0], scope, env)?.shape(),
            None => Vec::new(),
        };
        match arguments.get(1) {
            None => Ok(Value::array(shape.iter().map(|&s| Value::Integer(s as i64)).collect())),
            Some(k) => {
                let k = self.evaluate(k, scope, env)?;
                let sizes: Vec<Value> = shape.iter().map(|&s| Value::Integer(s as i64)).collect();
                self.pick(span, &sizes, &k)
            }
        }
    }

    /// `cardinality(c)`, `Connections.isRoot(r)` and `Connections.rooted(r)`: what is known of one connector or record.
    fn about_connections(
        &mut self,
        builtin: Builtin,
        span: Span,
        arguments: &[Expr],
        scope: Scope,
        env: &Env,
    ) -> Result<Value, Reported> {
        let steps = self.connected_component(builtin, span, arguments, scope)?;
        let values = self.known_of_connections(builtin, span, steps[steps.len() - 1].0)?;
        let Some(first) = values.first() else {
            return Ok(if builtin == Builtin::Cardinality { Value::Integer(0) } else { Value::Boolean(false) });
        };
        if values.iter().all(|value| value == first) {
            return Ok(first.clone());
        }
        let mut at = 0;
        for (size, subscript) in self.subscripts_of_chain(builtin, span, &steps)? {
            let k = match self.positions_of(&subscript, size, scope, env)? {
                Value::Integer(k) if k >= 1 && k as usize <= size => k as usize - 1,
                _ => return Err(self.no_meaning(span, format!("`{}` takes one connector", builtin.name()))),
            };
            at = at * size + k;
        }
        values.get(at).cloned().ok_or(Reported)
    }

    /// The text of a value known at translation.
    pub(crate) fn evaluate_text(
        &mut self,
        span: Span,
        positional: &[Expr],
        named: &[(Ident, Expr)],
        scope: Scope,
        env: &Env,
    ) -> Result<Value, Reported> {
        let format = self.text_format(span, positional, named, scope, env)?;
        let value = self.evaluate(&positional[0], scope, env)?;
        let kind = match &value {
            Value::Real(_) => ValueKind::Real,
            Value::Integer(_) => ValueKind::Integer,
            Value::Boolean(_) => ValueKind::Boolean,
            Value::Enumeration(e, _) => ValueKind::Enumeration(e.literals.clone().into()),
            Value::Text(_) => return Ok(value),
            Value::Array(_) | Value::Record(_) | Value::Object(_) => {
                return Err(self.error(Code::ArrayShape, span, "`String` takes a scalar"));
            }
        };
        Ok(Value::Text(format.text(value.as_stored().unwrap_or(0.0), &kind).into()))
    }

    /// The format that the further arguments of `String(x, ...)` ask for.
    pub fn text_format(
        &mut self,
        span: Span,
        positional: &[Expr],
        named: &[(Ident, Expr)],
        scope: Scope,
        env: &Env,
    ) -> Result<TextFormat, Reported> {
        let mut format = TextFormat::default();
        if positional.is_empty() {
            return Err(self.error(Code::BadArguments, span, "`String` takes a value"));
        }
        // By position: a format alone, or minimum length and side.
        const BY_POSITION: [&str; 2] = ["minimumLength", "leftJustified"];
        let mut given: Vec<(String, &Expr)> = Vec::new();
        for (k, expr) in positional[1..].iter().enumerate() {
            let name = if expr.text().is_some() { "format" } else { BY_POSITION.get(k).copied().unwrap_or("") };
            given.push((name.into(), expr));
        }
        given.extend(named.iter().map(|(name, expr)| (name.name.to_string(), expr)));
        for (name, expr) in given {
            let value = self.evaluate(expr, scope, env)?;
            let number = value.as_integer().and_then(|k| u32::try_from(k).ok());
            match (name.as_str(), number, &value) {
                ("significantDigits", Some(k), _) => format.significant_digits = k,
                ("minimumLength", Some(k), _) => format.minimum_length = k,
                ("leftJustified", _, Value::Boolean(left)) => format.left_justified = *left,
                ("format", _, Value::Text(text)) => format.format = Some(text.to_string()),
                _ => {
                    let message = format!("`String` has no argument `{name}` of type {}", value.type_name());
                    return Err(self.error(Code::BadArguments, expr.span, message));
                }
            }
        }
        Ok(format)
    }
}
