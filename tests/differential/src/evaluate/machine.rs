//! The state of an evaluation, and statements in their order.

use super::past::Past;
use super::trace::Trace;
use super::value::{Done, Dual, Value};
use crate::model::{Expr, Id, Kind, Model, Range, Role, SELF, Statement, Subscript, Target};

/// A model with the values of its variables.
pub(super) struct Machine<'a> {
    pub model: &'a Model,
    /// Values of all variables; the derivative of a state is the second part of its number.
    pub memory: Vec<Vec<Dual>>,
    /// Values before the event, or before the last round of it.
    pub pre: Vec<Vec<Dual>>,
    /// Variables that time alone changes, or events.
    pub timed: Vec<bool>,
    pub time: f64,
    pub trace: Trace,
    /// Within functions, `noEvent` and `when`, relations cause no events.
    pub quiet: usize,
    /// The initial equations are being solved.
    pub starting: bool,
    /// An event is being handled.
    pub event: bool,
    /// The first round of an event: `sample` acts.
    pub sampling: bool,
    /// Delayed values jump at this instant, and it is the one after the jump.
    pub after: bool,
    /// Iterators, variables of functions.
    pub locals: Vec<(String, Value)>,
    /// Truth of the conditions of `when` before this round, and in it.
    pub before: Vec<bool>,
    pub conditions: Vec<bool>,
    /// What `reinit` asks for.
    pub reinits: Vec<(Id, usize, f64)>,
    /// The next `delay`, the present values of the delayed expressions, and their past.
    pub site: usize,
    pub sources: Vec<f64>,
    pub past: Vec<Past>,
    /// Calls inside each other, and turns of loops.
    pub depth: usize,
    pub turns: usize,
    /// Derivatives of expressions are asked for.
    pub derives: bool,
}

impl<'a> Machine<'a> {
    pub(super) fn new(model: &'a Model) -> Self {
        let memory: Vec<Vec<Dual>> =
            model.variables.iter().map(|v| vec![Dual::fixed(v.start); v.count().max(1)]).collect();
        let mut timed: Vec<bool> = model
            .variables
            .iter()
            .map(|v| v.kind != Kind::Real || !matches!(v.role, Role::State | Role::Algebraic))
            .collect();
        // One pass suffices: statements stand in the order of computation.
        for statement in &model.statements {
            if let Statement::Define(Target::Name(id, _), e, _) | Statement::Declare(id, e) = statement {
                timed[*id] |= matches!(e, Expr::Time | Expr::Number(_));
            }
        }
        Self {
            model,
            pre: memory.clone(),
            memory,
            timed,
            time: 0.0,
            trace: Trace::default(),
            quiet: 0,
            starting: false,
            event: false,
            sampling: false,
            after: true,
            locals: Vec::new(),
            before: Vec::new(),
            conditions: Vec::new(),
            reinits: Vec::new(),
            site: 0,
            sources: Vec::new(),
            past: Vec::new(),
            depth: 0,
            turns: 0,
            derives: crate::visit::any(model, &|e| matches!(e, Expr::Der(_))),
        }
    }

    /// Computes everything from the states, the time and what is held.
    pub(super) fn evaluate(&mut self) -> Done<()> {
        self.once()?;
        if self.derives {
            // Now the derivatives of the states are known to whatever was computed before them.
            self.once()?;
        }
        Ok(())
    }

    fn once(&mut self) -> Done<()> {
        let model = self.model;
        self.trace.rewind(0);
        self.conditions.clear();
        self.reinits.clear();
        (self.site, self.turns) = (0, 0);
        if self.event {
            for (id, variable) in model.variables.iter().enumerate() {
                if variable.role == Role::Discrete {
                    self.memory[id].clone_from(&self.pre[id]);
                }
            }
        }
        self.statements(&model.statements)
    }

    fn statements(&mut self, list: &[Statement]) -> Done<()> {
        list.iter().try_for_each(|statement| self.statement(statement))
    }

    /// Goes over the values of an iterator.
    pub(super) fn each(
        &mut self,
        name: &str,
        range: &Range,
        body: &mut dyn FnMut(&mut Self) -> Done<bool>,
    ) -> Done<()> {
        for k in self.range(range)? {
            self.locals.push((name.to_string(), Value::number(k as f64)));
            let more = body(self);
            self.locals.pop();
            if !more? {
                break;
            }
        }
        Ok(())
    }

    fn statement(&mut self, statement: &Statement) -> Done<()> {
        match statement {
            Statement::Define(target, e, _) => {
                let value = self.eval(e)?;
                self.assign(target, value)
            }
            Statement::Declare(id, e) => {
                let value = self.eval(e)?;
                self.store(*id, &value)
            }
            Statement::DefineRecord(component, e) => {
                let Value::Record(fields) = self.eval(e)? else { return Err("no record".into()) };
                let model = self.model;
                for (name, value) in fields {
                    let all = model.variables.iter().enumerate();
                    let field = all.into_iter().find(|(_, v)| v.owner == Some(*component) && v.name == name);
                    let (id, _) = field.ok_or("no field")?;
                    self.store(id, &value)?;
                }
                Ok(())
            }
            Statement::Tuple(targets, e) => {
                let Expr::Call(name, list) = e else { return Err("no call".into()) };
                let values = list.iter().map(|e| self.eval(e)).collect::<Done<Vec<_>>>()?;
                let outputs = self.call(name, values)?;
                targets.iter().zip(outputs).try_for_each(|(target, value)| self.assign(target, value))
            }
            Statement::Derive(target, e, _) => self.derive(target, e),
            Statement::Implicit(unknowns, equations) => self.implicit(unknowns, equations),
            Statement::For(name, range, body) => {
                self.each(name, range, &mut |machine| machine.statements(body).map(|()| true))
            }
            Statement::Each(component, body) => {
                let range = Range::new(1, self.model.components[*component].count.unwrap_or(1) as i64);
                self.each(SELF, &range, &mut |machine| machine.statements(body).map(|()| true))
            }
            Statement::If(branches, otherwise) => {
                for (condition, body) in branches {
                    if self.truth(condition)? {
                        return self.statements(body);
                    }
                }
                self.statements(otherwise)
            }
            Statement::When(branches) | Statement::Acts(branches) => self.when(branches),
            Statement::Reinit(target, e) => {
                let value = self.number(e)?.v;
                let Target::Name(id, list) = target else { return Err("reinit of no state".into()) };
                let k = self.element(*id, list)?;
                self.reinits.push((*id, k, value));
                Ok(())
            }
            Statement::Algorithm(steps) => {
                self.quiet += usize::from(crate::visit::has_while(steps));
                let done = self.steps(steps);
                self.quiet -= usize::from(crate::visit::has_while(steps));
                done.map(|_| ())
            }
            Statement::Network(network) => self.statements(&network.meaning),
        }
    }

    fn derive(&mut self, target: &Target, e: &Expr) -> Done<()> {
        let mut numbers = Vec::new();
        self.eval(e)?.flat(&mut numbers);
        let Target::Name(id, list) = target else { return Err("derivative of no state".into()) };
        if list.is_empty() {
            if numbers.len() != self.memory[*id].len() {
                return Err("sizes of a derivative do not agree".into());
            }
            self.memory[*id].iter_mut().zip(numbers).for_each(|(x, f)| x.d = f.v);
        } else {
            let k = self.element(*id, list)?;
            self.memory[*id][k].d = numbers[0].v;
        }
        Ok(())
    }

    fn when(&mut self, branches: &[(Vec<Expr>, Vec<Statement>)]) -> Done<()> {
        let mut acts = None;
        for (k, (conditions, _)) in branches.iter().enumerate() {
            for condition in conditions {
                let now = self.truth(condition)?;
                let before = self.before.get(self.conditions.len()).copied();
                self.conditions.push(now);
                // At the start only `initial()` acts.
                let rises = match self.starting {
                    true => now && *condition == Expr::Initial,
                    false => now && before == Some(false),
                };
                if rises && self.event && acts.is_none() {
                    acts = Some(k);
                }
            }
        }
        let Some(k) = acts else { return Ok(()) };
        self.quiet += 1;
        let done = self.statements(&branches[k].1);
        self.quiet -= 1;
        done
    }

    /// Gives a variable or a whole array its value.
    pub(super) fn store(&mut self, id: Id, value: &Value) -> Done<()> {
        let mut numbers = Vec::new();
        value.flat(&mut numbers);
        if numbers.len() != self.memory[id].len() {
            return Err(format!("sizes of `{}` do not agree", self.model.variables[id].name));
        }
        self.memory[id] = numbers;
        Ok(())
    }

    /// Gives a part of a vector its value.
    fn store_part(&mut self, id: Id, list: &[Subscript], value: &Value) -> Done<()> {
        let model = self.model;
        let (places, _) = self.subscripts(list, &model.variables[id].sizes)?;
        let [places] = places.as_slice() else { return Err("a part of a matrix".into()) };
        let mut numbers = Vec::new();
        value.flat(&mut numbers);
        if numbers.len() != places.len() {
            return Err("sizes of a part do not agree".into());
        }
        for (place, number) in places.iter().zip(numbers) {
            *self.memory[id].get_mut(place.wrapping_sub(1)).ok_or("a part outside")? = number;
        }
        Ok(())
    }

    /// Gives a variable of the model, a part of it, or one of a function its value.
    pub(super) fn assign(&mut self, target: &Target, value: Value) -> Done<()> {
        match target {
            Target::Name(id, list) if list.is_empty() => self.store(*id, &value),
            Target::Name(id, list) => {
                if list.iter().all(|s| matches!(s, Subscript::At(_))) {
                    let k = self.element(*id, list)?;
                    self.memory[*id][k] = value.scalar()?;
                    return Ok(());
                }
                self.store_part(*id, list, &value)
            }
            Target::Local(name, list) => self.assign_local(name, list, value),
            Target::Field(name, field) => self.assign_field(name, field, value),
        }
    }
}
