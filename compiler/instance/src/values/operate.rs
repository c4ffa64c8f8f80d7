//! Operators of records on values known at translation: calls of the functions that the record declares (Modelica 3.6, chapter 14).
//!
//! Which function is meant is decided as for expressions of the run: the inputs fit by type, with the fewest dimensions more; a number
//! becomes a record by a constructor of one argument where nothing fits otherwise.

use hyd_source::{Code, Reported, Span};
use hyd_syntax::tree::{BinaryOp, ClassKind, Direction, UnaryOp};

use crate::classes::class::ClassId;
use crate::instantiation::instance::{LocalClass, ScalarType, Scope};
use crate::instantiation::scopes::Scopes;
use crate::instantiation::type_of::TypeOf;
use crate::values::evaluate::Env;
use crate::values::value::Value;

/// The class of a record, or of the records of an array.
fn class_of(value: &Value) -> Option<ClassId> {
    match value.first()? {
        Value::Record(fields) => Some(fields.class),
        _ => None,
    }
}

impl Scopes<'_> {
    /// `a op b` where one of them is a record; `None` where the record declares no such operator.
    pub(crate) fn operate_on_values(
        &mut self,
        span: Span,
        op: BinaryOp,
        (a, b): (&Value, &Value),
        (scope, env): (Scope, &Env),
    ) -> Result<Option<Value>, Reported> {
        let classes: Vec<ClassId> = [a, b].into_iter().filter_map(class_of).collect();
        let mut functions: Vec<LocalClass> = Vec::new();
        for &class in &classes {
            for function in self.overloads(class, op.function_name()) {
                if !functions.iter().any(|known| known.class == function.class) {
                    functions.push(function);
                }
            }
        }
        let Some(&class) = classes.first().filter(|_| !functions.is_empty()) else { return Ok(None) };
        let of_elements = op.is_element_by_element();
        let operands = [a.clone(), b.clone()];
        if let Some(function) = self.fitting_function(&functions, &operands, of_elements)? {
            return self.call_on_values(span, &function, &operands, (scope, env)).map(Some);
        }
        let mut made = Vec::with_capacity(2);
        for operand in operands {
            if class_of(&operand).is_some() {
                made.push(operand);
                continue;
            }
            let constructors = self.overloads(class, "'constructor'");
            let one = std::slice::from_ref(&operand);
            let Some(constructor) = self.fitting_function(&constructors, one, of_elements)? else { break };
            made.push(self.call_on_values(span, &constructor, one, (scope, env))?);
        }
        if made.len() == 2
            && let Some(function) = self.fitting_function(&functions, &made, of_elements)?
        {
            return self.call_on_values(span, &function, &made, (scope, env)).map(Some);
        }
        let message = format!("the record declares no {} for these operands", op.function_name());
        Err(self.error(Code::TypeMismatch, span, message))
    }

    /// `-a` or `not a` of a record; `None` where the record declares no such operator.
    pub(crate) fn operate_on_value(
        &mut self,
        span: Span,
        op: UnaryOp,
        a: &Value,
        (scope, env): (Scope, &Env),
    ) -> Result<Option<Value>, Reported> {
        let name = match op {
            UnaryOp::Minus => "'-'",
            UnaryOp::Not => "'not'",
            UnaryOp::Plus => return Ok(Some(a.clone())),
        };
        let Some(class) = class_of(a) else { return Ok(None) };
        let functions = self.overloads(class, name);
        let operand = std::slice::from_ref(a);
        match self.fitting_function(&functions, operand, false)? {
            Some(function) => self.call_on_values(span, &function, operand, (scope, env)).map(Some),
            None => Ok(None),
        }
    }

    /// The function whose inputs the values fit with the fewest dimensions more; `scalar`: only functions of scalars count.
    fn fitting_function(
        &mut self,
        functions: &[LocalClass],
        values: &[Value],
        scalar: bool,
    ) -> Result<Option<LocalClass>, Reported> {
        let mut best: Option<(usize, &LocalClass)> = None;
        for function in functions {
            if self.required_inputs(function)? > values.len() {
                continue;
            }
            let shape = self.table.shape(function.class)?;
            let inst = self.package_of(function)?;
            let components = self.components_of(&shape);
            let inputs = components.iter().filter(|(_, own)| own.direction == Some(Direction::Input));
            let mut outer = Some(0);
            let mut count = 0;
            for ((frame, input), value) in inputs.zip(values) {
                count += 1;
                let rank = input.dims.len() + self.rank_of_type(inst, *frame, input);
                let wanted = self.type_of(Scope { inst, frame: *frame }, &input.class)?;
                let more = value.shape().len().checked_sub(rank).filter(|_| !(scalar && rank > 0));
                let more = more.filter(|_| self.is_value_of(value, &wanted));
                outer = outer.zip(more).map(|(most, more)| most.max(more));
            }
            if count == values.len()
                && let Some(outer) = outer
                && best.is_none_or(|(least, _)| outer < least)
            {
                best = Some((outer, function));
            }
        }
        Ok(best.map(|(_, function)| function.clone()))
    }

    /// True if the elements of a value are of a type, or numbers that become such.
    fn is_value_of(&mut self, value: &Value, wanted: &TypeOf) -> bool {
        let Some(first) = value.first() else { return true };
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

    /// A call with these values of the first inputs.
    fn call_on_values(
        &mut self,
        span: Span,
        function: &LocalClass,
        values: &[Value],
        (scope, env): (Scope, &Env),
    ) -> Result<Value, Reported> {
        let shape = self.table.shape(function.class)?;
        let components = self.components_of(&shape).into_iter().map(|(_, component)| component);
        let inputs = components.filter(|own| own.direction == Some(Direction::Input));
        let given: Vec<_> = inputs.zip(values).map(|(input, value)| (input.name.name, value.clone())).collect();
        match self.call_class(span, (function, &given), (&[], &[]), (scope, env))? {
            Some(outputs) => outputs.into_iter().next().ok_or(Reported),
            None => {
                let name = self.table.full_name(function.class);
                Err(self.not_structural(span, format!("`{name}(...)` cannot be computed before the run")))
            }
        }
    }
}
