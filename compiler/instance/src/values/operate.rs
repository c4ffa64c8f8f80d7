//! Operators of records on values known at translation: calls of the functions that the record declares (Modelica 3.6, chapter 14).

use hyd_source::{Reported, Span};
use hyd_syntax::tree::{BinaryOp, ClassKind, Direction, UnaryOp};

use crate::classes::class::ClassId;
use crate::instantiation::instance::{LocalClass, ScalarType, Scope};
use crate::instantiation::scopes::Scopes;
use crate::instantiation::type_of::TypeOf;
use crate::values::evaluate::Env;
use crate::values::operators::{Operands, operate_on_one, operate_on_two};
use crate::values::value::Value;

/// Values as operands.
struct Values<'t, 's, 'e> {
    scopes: &'t mut Scopes<'s>,
    /// Where the operator stands.
    scope: Scope,
    env: &'e Env,
}

impl Scopes<'_> {
    /// `a op b` where one of them is a record; `None` where the record declares no such operator.
    pub(crate) fn binary_of_records(
        &mut self,
        span: Span,
        op: BinaryOp,
        operands: (&Value, &Value),
        (scope, env): (Scope, &Env),
    ) -> Result<Option<Value>, Reported> {
        operate_on_two(&mut Values { scopes: self, scope, env }, span, op, operands)
    }

    /// `-a` or `not a` of a record; `None` where the record declares no such operator.
    pub(crate) fn unary_of_record(
        &mut self,
        span: Span,
        op: UnaryOp,
        a: &Value,
        (scope, env): (Scope, &Env),
    ) -> Result<Option<Value>, Reported> {
        operate_on_one(&mut Values { scopes: self, scope, env }, span, op, a)
    }

    /// True if the elements of a value are of a type, or numbers that become such.
    fn is_value_of(&mut self, value: &Value, wanted: &TypeOf) -> bool {
        let Some(first) = value.first() else {
            return value.record_class().is_none() || matches!(wanted, TypeOf::Class(..));
        };
        let scalar = match wanted {
            TypeOf::Scalar(scalar) => scalar.clone(),
            TypeOf::Class(local, shape) => match (&shape.builtin, first) {
                (Some(builtin), _) => ScalarType::of_builtin(builtin),
                (None, Value::Enumeration(of, _)) => return self.enumeration(local.class).as_ref() == Some(of),
                (None, Value::Record(fields)) => {
                    let is_record = self.table.class(local.class).def.kind == ClassKind::Record;
                    let names = shape.elements.iter().filter(|e| e.component).map(|e| &e.name);
                    return is_record && names.eq(fields.list.iter().map(|(name, _)| name));
                }
                (None, _) => return false,
            },
        };
        matches!(
            (scalar, first),
            (ScalarType::Real, Value::Real(_) | Value::Integer(_))
                | (ScalarType::Integer, Value::Integer(_))
                | (ScalarType::Boolean, Value::Boolean(_))
                | (ScalarType::Text, Value::Text(_))
        )
    }
}

impl<'s> Operands<'s> for Values<'_, 's, '_> {
    type Operand = Value;
    /// Its type and its dimensions.
    type Input = (TypeOf, usize);

    fn scopes(&mut self) -> &mut Scopes<'s> {
        self.scopes
    }

    fn class_of(&self, operand: &Value) -> Option<ClassId> {
        operand.record_class()
    }

    fn inputs(&mut self, function: &LocalClass) -> Result<Vec<(TypeOf, usize)>, Reported> {
        let shape = self.scopes.table.shape(function.class)?;
        let inst = self.scopes.package_of(function)?;
        let mut inputs = Vec::new();
        for (frame, own) in self.scopes.components_of(&shape) {
            if own.direction == Some(Direction::Input) {
                let rank = own.dims.len() + self.scopes.rank_of_type(inst, frame, &own);
                inputs.push((self.scopes.type_of(Scope { inst, frame }, &own.class)?, rank));
            }
        }
        Ok(inputs)
    }

    fn rank(&self, input: &(TypeOf, usize)) -> usize {
        input.1
    }

    fn more(&mut self, operand: &Value, (wanted, rank): &(TypeOf, usize)) -> Option<usize> {
        let more = operand.shape().len().checked_sub(*rank)?;
        self.scopes.is_value_of(operand, wanted).then_some(more)
    }

    fn call(&mut self, span: Span, function: &LocalClass, operands: Vec<Value>) -> Result<Value, Reported> {
        let shape = self.scopes.table.shape(function.class)?;
        let components = self.scopes.components_of(&shape).into_iter().map(|(_, component)| component);
        let inputs = components.filter(|own| own.direction == Some(Direction::Input));
        let given: Vec<_> = inputs.zip(operands).map(|(input, value)| (input.name.name, value)).collect();
        match self.scopes.call_class(span, (function, &given), (&[], &[]), (self.scope, self.env))? {
            Some(outputs) => outputs.into_iter().next().ok_or(Reported),
            None => {
                let name = self.scopes.table.full_name(function.class);
                Err(self.scopes.not_structural(span, format!("`{name}(...)` cannot be computed before the run")))
            }
        }
    }
}
