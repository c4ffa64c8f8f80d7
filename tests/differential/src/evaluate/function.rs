//! Functions of the model and the steps of algorithms (chapters 11.2 and 12).

use super::machine::Machine;
use super::value::{Done, Value};
use crate::model::{Local, Step, Subscript, Type};

/// How a list of steps ended.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Flow {
    /// At its end.
    On,
    /// By `break`.
    Break,
    /// By `return`.
    Return,
}

/// More turns than any function of the generator takes.
const MOST_TURNS: usize = 100_000;

impl Machine<'_> {
    /// Calls a function; all of its outputs.
    pub(super) fn call(&mut self, name: &str, arguments: Vec<Value>) -> Done<Vec<Value>> {
        let model = self.model;
        let function = model.functions.iter().find(|f| f.name == name).ok_or_else(|| format!("no function {name}"))?;
        self.depth += 1;
        if self.depth > 60 {
            return Err("too many calls inside each other".into());
        }
        let outside = std::mem::take(&mut self.locals);
        self.quiet += 1;
        let done = self.body(function, arguments);
        self.quiet -= 1;
        self.locals = outside;
        self.depth -= 1;
        done
    }

    fn body(&mut self, function: &crate::model::Function, arguments: Vec<Value>) -> Done<Vec<Value>> {
        let mut arguments = arguments.into_iter();
        for input in &function.inputs {
            let value = match (arguments.next(), &input.value) {
                (Some(value), _) => value,
                (None, Some(e)) => self.eval(e)?,
                (None, None) => return Err(format!("{} lacks an argument", function.name)),
            };
            self.locals.push((input.name.clone(), value));
        }
        for local in function.outputs.iter().chain(&function.locals) {
            let value = self.initial_local(local)?;
            self.locals.push((local.name.clone(), value));
        }
        self.steps(&function.body)?;
        let output = |local: &Local| {
            let found = self.locals.iter().find(|(n, _)| *n == local.name);
            found.map(|(_, v)| v.clone()).ok_or_else(|| "no output".to_string())
        };
        function.outputs.iter().map(output).collect()
    }

    fn initial_local(&mut self, local: &Local) -> Done<Value> {
        if let Some(e) = &local.value {
            return self.eval(e);
        }
        let zero = match &local.kind {
            Type::Of(_) => Value::number(0.0),
            Type::Record(name) => {
                let class = self.model.records.iter().find(|r| r.name == *name).ok_or("no record class")?;
                Value::Record(class.fields.iter().map(|(n, v)| (n.clone(), Value::number(*v))).collect())
            }
        };
        Ok(local.sizes.iter().rev().fold(zero, |value, n| Value::Array(vec![value; n.unwrap_or(0)])))
    }

    /// Runs steps.
    pub(super) fn steps(&mut self, list: &[Step]) -> Done<Flow> {
        for step in list {
            let flow = self.step(step)?;
            if flow != Flow::On {
                return Ok(flow);
            }
        }
        Ok(Flow::On)
    }

    fn step(&mut self, step: &Step) -> Done<Flow> {
        match step {
            Step::Assign(target, e) => {
                let value = self.eval(e)?;
                self.assign(target, value)?;
            }
            Step::Tuple(targets, e) => {
                let crate::model::Expr::Call(name, list) = e else { return Err("no call".into()) };
                let values = list.iter().map(|e| self.eval(e)).collect::<Done<Vec<_>>>()?;
                let outputs = self.call(name, values)?;
                targets.iter().zip(outputs).try_for_each(|(target, value)| self.assign(target, value))?;
            }
            Step::If(branches, otherwise) => {
                for (condition, body) in branches {
                    if self.truth(condition)? {
                        return self.steps(body);
                    }
                }
                return self.steps(otherwise);
            }
            Step::For(name, range, body) => {
                let mut flow = Flow::On;
                self.each(name, range, &mut |machine| {
                    flow = machine.steps(body)?;
                    Ok(flow == Flow::On)
                })?;
                if flow == Flow::Return {
                    return Ok(flow);
                }
            }
            Step::While(condition, body) => {
                while self.truth(condition)? {
                    self.turns += 1;
                    if self.turns > MOST_TURNS {
                        return Err("a loop without end".into());
                    }
                    match self.steps(body)? {
                        Flow::On => {}
                        Flow::Break => break,
                        Flow::Return => return Ok(Flow::Return),
                    }
                }
            }
            Step::Break => return Ok(Flow::Break),
            Step::Return => return Ok(Flow::Return),
        }
        Ok(Flow::On)
    }

    fn local(&mut self, name: &str) -> Done<&mut Value> {
        let found = self.locals.iter_mut().rev().find(|(n, _)| n == name);
        found.map(|(_, value)| value).ok_or_else(|| format!("no variable {name}"))
    }

    /// Gives a variable of a function, or an element of it, a value.
    pub(super) fn assign_local(&mut self, name: &str, list: &[Subscript], value: Value) -> Done<()> {
        let mut places = Vec::new();
        for subscript in list {
            let Subscript::At(e) = subscript else { return Err("assignment to a slice".into()) };
            places.push(self.number(e)?.v as usize);
        }
        let mut place = self.local(name)?;
        for k in places {
            let Value::Array(elements) = place else { return Err("a subscript of a number".into()) };
            place = elements.get_mut(k.wrapping_sub(1)).ok_or("a subscript outside")?;
        }
        *place = value;
        Ok(())
    }

    /// Gives a field of a record a value.
    pub(super) fn assign_field(&mut self, name: &str, field: &str, value: Value) -> Done<()> {
        let Value::Record(fields) = self.local(name)? else { return Err("a field of no record".into()) };
        let place = fields.iter_mut().find(|(n, _)| n == field).ok_or("no field")?;
        place.1 = value;
        Ok(())
    }
}
