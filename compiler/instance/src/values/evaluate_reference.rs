//! Values of references: what is named, and the elements that subscripts take of it.
//!
//! Dimensions stand in the order of the steps of a reference: those of arrays of components first, those of the variable last (Modelica
//! 3.6, section 10.6.9).

use hyd_source::{Code, Reported, Span};
use hyd_syntax::tree::{ClassKind, ComponentRef, Expr, ExprKind};

use crate::instantiation::instance::{InstId, Scope, path};
use crate::instantiation::lookup::Resolved;
use crate::instantiation::scopes::Scopes;
use crate::values::evaluate::Env;
use crate::values::value::{Items, Value, first_if_uniform};

/// A reference to a part of a value.
struct Part<'p> {
    span: Span,
    /// Arrays of components over which the value is spread.
    spread: &'p [InstId],
    scope: Scope,
    env: &'p Env,
}

impl Scopes<'_> {
    pub(crate) fn evaluate_ref(
        &mut self,
        reference: &ComponentRef,
        scope: Scope,
        env: &Env,
    ) -> Result<Value, Reported> {
        if !reference.global
            && let Some(value) = env.get(&reference.parts[0].name.name)
        {
            let mut value = value.clone();
            for (k, part) in reference.parts.iter().enumerate() {
                let mut subscripts = Vec::new();
                if k > 0 {
                    // Subscripts of a field stand behind those that the record kept.
                    let all = Expr { kind: ExprKind::Colon, span: reference.span };
                    subscripts = vec![all; if part.subscripts.is_empty() { 0 } else { value.shape().len() }];
                    value = self.field_of_value(reference.span, &value, &part.name)?;
                }
                subscripts.extend(part.subscripts.iter().cloned());
                value = self.subscript(reference.span, value, &subscripts, scope, env)?;
            }
            return Ok(value);
        }
        if crate::instantiation::size::names_boolean(reference) {
            return Ok(Value::array(vec![Value::Boolean(false), Value::Boolean(true)]));
        }
        if let Some(named) = self.parts_named(reference, scope, env) {
            return self.evaluate(&named, scope, env);
        }
        match self.resolve(scope, reference)? {
            Resolved::Literal(enumeration, k) => Ok(Value::Enumeration(enumeration, k)),
            Resolved::Time => Err(self.not_structural(reference.span, "`time` is not known before the run".into())),
            Resolved::Class(local) => match self.enumeration(local.class) {
                Some(enumeration) => Ok(Value::array(
                    (1..=enumeration.literals.len() as u32)
                        .map(|k| Value::Enumeration(enumeration.clone(), k))
                        .collect(),
                )),
                None => {
                    let name = self.table.full_name(local.class);
                    Err(self.no_meaning(reference.span, format!("the class `{name}` is not a value")))
                }
            },
            Resolved::Variable(steps) => self.evaluate_steps(reference.span, &steps, scope, env),
        }
    }

    pub(crate) fn evaluate_steps(
        &mut self,
        span: Span,
        steps: &[(InstId, &[Expr])],
        scope: Scope,
        env: &Env,
    ) -> Result<Value, Reported> {
        let (last, _) = steps[steps.len() - 1];
        let instance = &self.instances[last];
        if instance.primitive.is_none() && instance.kind == ClassKind::Record && !self.is_broken(last) {
            return self.value_of_record(span, steps, scope, env);
        }
        let value = self.value_of(last, span)?;
        let binding = self.instances[last].primitive.as_ref().and_then(|p| p.binding.as_ref());
        let mut spread = binding.map_or_else(Vec::new, |b| b.spread.clone());
        // The elements of parts have been taken; a value set from outside is the same for all elements.
        spread.retain(|&inst| self.instances[inst].part_of.is_none());
        if self.override_of(last).is_some() {
            spread.clear();
        }
        // Arrays of components around the reference that it does not name: one value for all of their elements.
        let mut current = value;
        for inst in spread.iter().copied().filter(|inst| !steps.iter().any(|(step, _)| step == inst)) {
            current = match first_if_uniform(&current, self.instances[inst].dims.len()) {
                Some(same) => same,
                None => {
                    let name = path(&self.instances, last);
                    self.differing.insert(path(&self.instances, inst));
                    let message = format!("`{name}` differs between the elements of an array of components");
                    return Err(self.not_structural(span, message));
                }
            };
        }
        let part = Part { span, spread: &spread, scope, env };
        self.elements_of(&part, current, steps)
    }

    /// What a reference takes of a value, dimension by dimension: those of arrays of components first, its own last.  A value that is
    /// the same for all elements of an array of components (`each`) stands there as often as the reference names elements.
    fn elements_of(&mut self, part: &Part<'_>, value: Value, steps: &[(InstId, &[Expr])]) -> Result<Value, Reported> {
        let Some((&(inst, subscripts), rest)) = steps.split_first() else { return Ok(value) };
        if rest.is_empty() {
            return self.subscript(part.span, value, subscripts, part.scope, part.env);
        }
        let sizes = self.instances[inst].dims.clone();
        if subscripts.len() > sizes.len() {
            return Err(self.no_meaning(part.span, "too many subscripts"));
        }
        self.elements_of_dimension(part, value, (inst, &sizes, subscripts), rest)
    }

    fn elements_of_dimension(
        &mut self,
        part: &Part<'_>,
        value: Value,
        (inst, sizes, subscripts): (InstId, &[usize], &[Expr]),
        rest: &[(InstId, &[Expr])],
    ) -> Result<Value, Reported> {
        let Some((&size, sizes)) = sizes.split_first() else { return self.elements_of(part, value, rest) };
        let (chosen, subscripts) = match subscripts.split_first() {
            Some((first, others)) => (self.positions_of(first, size, part.scope, part.env)?, others),
            None => (Value::array((1..=size as i64).map(Value::Integer).collect()), subscripts),
        };
        if !part.spread.contains(&inst) {
            let places = vec![Value::Integer(0); size];
            chosen.flatten().into_iter().try_for_each(|k| self.pick(part.span, &places, k).map(|_| ()))?;
            let one = self.elements_of_dimension(part, value, (inst, sizes, subscripts), rest)?;
            return Ok(match chosen {
                Value::Array(all) => Value::filled(one, &[all.len()]),
                _ => one,
            });
        }
        let Value::Array(items) = value else { return Err(self.no_meaning(part.span, "too many subscripts")) };
        match chosen {
            Value::Array(all) => {
                let element = |k: &Value| {
                    let item = self.pick(part.span, &items, k)?;
                    self.elements_of_dimension(part, item, (inst, sizes, subscripts), rest)
                };
                let list = all.iter().map(element).collect::<Result<_, _>>()?;
                Ok(Value::array_of(list, || items.sizes()))
            }
            single => {
                let item = self.pick(part.span, &items, &single)?;
                self.elements_of_dimension(part, item, (inst, sizes, subscripts), rest)
            }
        }
    }

    fn subscript(
        &mut self,
        span: Span,
        value: Value,
        subscripts: &[Expr],
        scope: Scope,
        env: &Env,
    ) -> Result<Value, Reported> {
        let Some((first, rest)) = subscripts.split_first() else { return Ok(value) };
        let Value::Array(items) = value else {
            return Err(self.no_meaning(span, "too many subscripts"));
        };
        if matches!(first.kind, ExprKind::Colon) {
            let list: Vec<Value> =
                items.iter().map(|v| self.subscript(span, v.clone(), rest, scope, env)).collect::<Result<_, _>>()?;
            return self.array_of_subscripted(list, &items, rest, scope, env);
        }
        let mut inner = env.clone();
        inner.ends.push(items.len());
        let picked = self.evaluate(first, scope, &inner)?;
        match picked {
            Value::Array(chosen) => {
                let element = |k: &Value| {
                    let item = self.pick(span, &items, k)?;
                    self.subscript(span, item, rest, scope, env)
                };
                let list: Vec<Value> = chosen.iter().map(element).collect::<Result<_, _>>()?;
                self.array_of_subscripted(list, &items, rest, scope, env)
            }
            single => {
                let item = self.pick(first.span, &items, &single)?;
                self.subscript(span, item, rest, scope, env)
            }
        }
    }

    /// What subscripts have taken of the elements of an array; `rest` are the subscripts of an element, which say its sizes where there is none.
    fn array_of_subscripted(
        &mut self,
        list: Vec<Value>,
        of: &Items,
        rest: &[Expr],
        scope: Scope,
        env: &Env,
    ) -> Result<Value, Reported> {
        let mut sizes = Vec::new();
        if list.is_empty() {
            for (k, size) in of.sizes().into_iter().enumerate() {
                match rest.get(k) {
                    None => sizes.push(size),
                    Some(subscript) => {
                        if let Value::Array(chosen) = self.positions_of(subscript, size, scope, env)? {
                            sizes.push(chosen.len());
                        }
                    }
                }
            }
        }
        Ok(Value::array_of_records(list, of.record_class(), || sizes))
    }

    pub(crate) fn pick(&mut self, span: Span, items: &[Value], index: &Value) -> Result<Value, Reported> {
        let k = match index {
            Value::Integer(k) => *k,
            Value::Enumeration(_, k) => i64::from(*k),
            Value::Boolean(b) if items.len() == 2 => i64::from(*b) + 1,
            other => {
                return Err(self.no_meaning(span, format!("a subscript must be an Integer, not {}", other.type_name())));
            }
        };
        match usize::try_from(k - 1).ok().and_then(|k| items.get(k)) {
            Some(item) => Ok(item.clone()),
            None => {
                let message = format!("subscript {k} is outside 1..{}", items.len());
                Err(self.error(Code::ArrayShape, span, message))
            }
        }
    }
}
