//! Expressions: chapters 3 and 10 of the specification, node by node.

use super::builtin;
use super::machine::Machine;
use super::value::{Done, Dual, Value};
use crate::model::{Expr, Id, Operator, Range, Role, Subscript};

/// Picks what subscripts name out of an array.
pub(super) fn select(value: &Value, subscripts: &[Vec<usize>], scalar: &[bool]) -> Done<Value> {
    let Some((numbers, rest)) = subscripts.split_first() else { return Ok(value.clone()) };
    let elements = value.elements()?;
    let pick = |k: &usize| {
        let element = elements.get(k.wrapping_sub(1)).ok_or_else(|| format!("subscript {k} of {}", elements.len()))?;
        select(element, rest, &scalar[1..])
    };
    match scalar[0] {
        true => pick(&numbers[0]),
        false => Ok(Value::Array(numbers.iter().map(pick).collect::<Done<_>>()?)),
    }
}

impl Machine<'_> {
    /// The numbers of subscripts of an array of these sizes, and which of them name one element.
    pub(super) fn subscripts(&mut self, list: &[Subscript], sizes: &[usize]) -> Done<(Vec<Vec<usize>>, Vec<bool>)> {
        let (mut numbers, mut scalar) = (Vec::new(), Vec::new());
        for (k, subscript) in list.iter().enumerate() {
            let (some, one) = match subscript {
                Subscript::At(e) => (vec![self.number(e)?.v as usize], true),
                Subscript::All => ((1..=*sizes.get(k).ok_or("too many subscripts")?).collect(), false),
                Subscript::Slice(range) => (self.range(range)?.into_iter().map(|i| i as usize).collect(), false),
            };
            numbers.push(some);
            scalar.push(one);
        }
        Ok((numbers, scalar))
    }

    /// Position of the element with these subscripts.
    pub(super) fn element(&mut self, id: Id, list: &[Subscript]) -> Done<usize> {
        let model = self.model;
        let sizes = &model.variables[id].sizes;
        if list.len() != sizes.len() {
            return Err(format!("`{}` needs {} subscripts", self.model.variables[id].name, sizes.len()));
        }
        let mut place = 0;
        for (subscript, size) in list.iter().zip(sizes) {
            let Subscript::At(e) = subscript else { return Err("a slice where an element is needed".into()) };
            let k = self.number(e)?.v;
            if k < 1.0 || k > *size as f64 {
                return Err(format!("subscript {k} of `{}`", self.model.variables[id].name));
            }
            place = place * size + (k as usize - 1);
        }
        Ok(place)
    }

    fn name(&mut self, id: Id, list: &[Subscript]) -> Done<Value> {
        let full = list.iter().all(|s| matches!(s, Subscript::At(_)));
        if full && list.len() == self.model.variables[id].sizes.len() {
            let k = self.element(id, list)?;
            return Ok(Value::Scalar(self.memory[id][k]));
        }
        let model = self.model;
        let sizes = &model.variables[id].sizes;
        let (numbers, scalar) = self.subscripts(list, sizes)?;
        select(&Value::shaped(&self.memory[id], sizes), &numbers, &scalar)
    }

    /// The values of a range (3.3.3 of 10.4.3).
    pub(super) fn range(&mut self, range: &Range) -> Done<Vec<i64>> {
        let (from, to) = (self.number(&range.from)?.v, self.number(&range.to)?.v);
        let step = range.step.unwrap_or(1) as f64;
        let count = ((to - from) / step).floor() + 1.0;
        Ok((0..count.max(0.0) as i64).map(|k| from as i64 + k * step as i64).collect())
    }

    /// A number.
    pub(super) fn number(&mut self, e: &Expr) -> Done<Dual> {
        self.eval(e)?.scalar()
    }

    /// A truth.
    pub(super) fn truth(&mut self, e: &Expr) -> Done<bool> {
        Ok(self.number(e)?.v != 0.0)
    }

    /// Whether time alone, and what is fixed, decides a value.
    fn is_timed(&self, e: &Expr) -> bool {
        match e {
            Expr::Number(_) | Expr::Truth(_) | Expr::Literal(_) | Expr::Time | Expr::Local(..) => true,
            Expr::Name(id, _) => self.model.variables[*id].role != Role::State && self.timed.get(*id) == Some(&true),
            Expr::Pre(..) => true,
            Expr::Minus(a) => self.is_timed(a),
            Expr::Binary(_, a, b) => self.is_timed(a) && self.is_timed(b),
            Expr::Builtin(_, list) => list.iter().all(|e| self.is_timed(e)),
            _ => false,
        }
    }

    /// Whether nothing of the run decides a value.
    fn is_fixed(&self, e: &Expr) -> bool {
        match e {
            Expr::Number(_) | Expr::Truth(_) | Expr::Literal(_) | Expr::Local(..) => true,
            Expr::Name(id, _) => {
                let role = self.model.variables[*id].role;
                matches!(role, Role::Constant | Role::Parameter | Role::Structural | Role::Free)
            }
            Expr::Minus(a) => self.is_fixed(a),
            Expr::Binary(_, a, b) => self.is_fixed(a) && self.is_fixed(b),
            Expr::Builtin(_, list) => list.iter().all(|e| self.is_fixed(e)),
            _ => false,
        }
    }

    fn answer(&mut self, now: f64, gap: f64, of: &[&Expr]) -> Done<f64> {
        if self.quiet > 0 {
            return Ok(now);
        }
        // What is decided before the run causes no events, and initial equations may decide it.
        if of.iter().all(|e| self.is_fixed(e)) {
            return Ok(now);
        }
        let timed = of.iter().all(|e| self.is_timed(e));
        self.trace.answer(now, gap, timed)
    }

    /// An integer that holds until the next event.
    fn rounded(&mut self, now: f64, x: f64, of: &[&Expr]) -> Done<f64> {
        let gap = (x - x.floor()).min(x.ceil() - x);
        self.answer(now, gap, of)
    }

    fn rounding(&mut self, name: &str, list: &[Expr]) -> Done<Option<Value>> {
        if !matches!(name, "floor" | "integer" | "ceil" | "div" | "rem" | "mod") {
            return Ok(None);
        }
        let of: Vec<&Expr> = list.iter().collect();
        let value = match (name, list) {
            ("floor" | "integer", [a]) => {
                let a = self.number(a)?;
                Dual::fixed(self.rounded(a.v.floor(), a.v, &of)?)
            }
            ("ceil", [a]) => {
                let a = self.number(a)?;
                Dual::fixed(self.rounded(a.v.ceil(), a.v, &of)?)
            }
            ("div" | "rem" | "mod", [a, b]) => {
                let (a, b) = (self.number(a)?, self.number(b)?);
                let q = a.v / b.v;
                let now = if name == "mod" { q.floor() } else { q.trunc() };
                let k = Dual::fixed(self.rounded(now, q, &of)?);
                match name {
                    "div" => k,
                    _ => {
                        let part = Dual::operate(Operator::Multiply, k, b)?;
                        Dual::operate(Operator::Subtract, a, part)?
                    }
                }
            }
            _ => return Ok(None),
        };
        Ok(Some(Value::Scalar(value)))
    }

    fn binary(&mut self, operator: Operator, a: &Expr, b: &Expr) -> Done<Value> {
        let truth = |b: bool| Ok(Value::number(f64::from(b)));
        match operator {
            Operator::And => {
                // Both sides: which relations are looked at must not depend on the others.
                let (a, b) = (self.truth(a)?, self.truth(b)?);
                truth(a && b)
            }
            Operator::Or => {
                let (a, b) = (self.truth(a)?, self.truth(b)?);
                truth(a || b)
            }
            _ if operator.is_relation() => {
                let (x, y) = (self.number(a)?.v, self.number(b)?.v);
                let now = match operator {
                    Operator::Less => x < y,
                    Operator::LessEqual => x <= y,
                    Operator::Greater => x > y,
                    Operator::GreaterEqual => x >= y,
                    Operator::Equal => x == y,
                    _ => x != y,
                };
                if !operator.is_order() {
                    return truth(now);
                }
                Ok(Value::number(self.answer(f64::from(now), x - y, &[a, b])?))
            }
            _ => {
                let (a, b) = (self.eval(a)?, self.eval(b)?);
                Value::operate(operator, &a, &b)
            }
        }
    }

    fn iterate(&mut self, body: &Expr, iterators: &[(String, Range)], into: &mut Vec<Value>) -> Done<()> {
        // The last iterator is the outermost one.
        let Some(((name, range), inner)) = iterators.split_last() else {
            into.push(self.eval(body)?);
            return Ok(());
        };
        for k in self.range(range)? {
            self.locals.push((name.clone(), Value::number(k as f64)));
            let done = if inner.is_empty() {
                self.iterate(body, inner, into)
            } else {
                let mut row = Vec::new();
                self.iterate(body, inner, &mut row).map(|()| into.push(Value::Array(row)))
            };
            self.locals.pop();
            done?;
        }
        Ok(())
    }

    fn delay(&mut self, source: &Expr, delay: f64) -> Done<Value> {
        let site = self.site;
        self.site += 1;
        let value = self.number(source)?.v;
        if self.sources.len() <= site {
            self.sources.resize(site + 1, 0.0);
        }
        self.sources[site] = value;
        // At the start a delayed value is the value itself.
        let past = self.past.get(site).filter(|_| !self.starting);
        Ok(Value::number(past.map_or(value, |past| past.value(self.time - delay, self.after))))
    }

    /// The value of an expression.
    pub(super) fn eval(&mut self, e: &Expr) -> Done<Value> {
        match e {
            Expr::Number(v) => Ok(Value::number(*v)),
            Expr::Truth(b) => Ok(Value::number(f64::from(*b))),
            Expr::Literal(k) => Ok(Value::number(*k as f64)),
            Expr::Time => Ok(Value::Scalar(Dual { v: self.time, d: 1.0 })),
            Expr::Name(id, list) => self.name(*id, list),
            Expr::Local(name, list) => {
                let value = self.locals.iter().rev().find(|(n, _)| n == name);
                let value = value.map(|(_, value)| value.clone()).ok_or_else(|| format!("no variable {name}"))?;
                if list.is_empty() {
                    return Ok(value);
                }
                let mut sizes = Vec::new();
                let mut inner = &value;
                while let Value::Array(list) = inner {
                    sizes.push(list.len());
                    let Some(first) = list.first() else { break };
                    inner = first;
                }
                let (numbers, scalar) = self.subscripts(list, &sizes)?;
                select(&value, &numbers, &scalar)
            }
            Expr::Field(e, name) => match self.eval(e)? {
                Value::Record(fields) => {
                    let field = fields.into_iter().find(|(n, _)| n == name);
                    field.map(|(_, value)| value).ok_or_else(|| format!("no field {name}"))
                }
                _ => Err("a field of no record".into()),
            },
            Expr::Record(component) => {
                let model = self.model;
                let all = model.variables.iter().enumerate();
                let fields = all.filter(|(_, v)| v.owner == Some(*component));
                Ok(Value::Record(fields.map(|(id, v)| (v.name.clone(), Value::Scalar(self.memory[id][0]))).collect()))
            }
            Expr::Construct(class, given, _) => {
                let model = self.model;
                let class = model.records.iter().find(|r| r.name == *class).ok_or("no record class")?;
                let mut fields = Vec::new();
                for (name, default) in &class.fields {
                    let value = match given.iter().find(|(n, _)| n == name) {
                        Some((_, e)) => self.eval(e)?,
                        None => Value::number(*default),
                    };
                    fields.push((name.clone(), value));
                }
                Ok(Value::Record(fields))
            }
            Expr::Pre(id, list) => {
                let k = self.element(*id, list)?;
                Ok(Value::Scalar(Dual::fixed(self.pre[*id][k].v)))
            }
            Expr::Edge(id, list) => {
                let k = self.element(*id, list)?;
                Ok(Value::number(f64::from(self.memory[*id][k].v != 0.0 && self.pre[*id][k].v == 0.0)))
            }
            Expr::Change(id, list) => {
                let k = self.element(*id, list)?;
                Ok(Value::number(f64::from(self.memory[*id][k].v != self.pre[*id][k].v)))
            }
            Expr::Der(e) => Ok(self.eval(e)?.each(&|x| Dual { v: x.d, d: f64::NAN })),
            Expr::Minus(e) => Ok(self.eval(e)?.each(&|x| Dual { v: -x.v, d: -x.d })),
            Expr::Not(e) => Ok(Value::number(f64::from(!self.truth(e)?))),
            Expr::Binary(operator, a, b) => self.binary(*operator, a, b),
            Expr::If(branches, otherwise) => {
                for (condition, value) in branches {
                    if self.truth(condition)? {
                        return self.eval(value);
                    }
                }
                self.eval(otherwise)
            }
            Expr::Array(list) => Ok(Value::Array(list.iter().map(|e| self.eval(e)).collect::<Done<_>>()?)),
            Expr::For(reduction, body, iterators) => {
                let mut list = Vec::new();
                self.iterate(body, iterators, &mut list)?;
                let Some(name) = reduction else { return Ok(Value::Array(list)) };
                let mut numbers = Vec::new();
                Value::Array(list).flat(&mut numbers);
                Ok(Value::Scalar(builtin::reduce(name, &numbers)?))
            }
            // Almost all calls are of functions of one number.
            Expr::Builtin(name, list) if list.len() == 1 && builtin::is_elementary(name) => {
                let value = self.eval(&list[0])?;
                builtin::one(name, &value)
            }
            Expr::Builtin(name, list) => match self.rounding(name, list)? {
                Some(value) => Ok(value),
                None => {
                    let values = list.iter().map(|e| self.eval(e)).collect::<Done<Vec<_>>>()?;
                    builtin::apply(name, &values)
                }
            },
            Expr::Call(name, list) => {
                let values = list.iter().map(|e| self.eval(e)).collect::<Done<Vec<_>>>()?;
                let mut outputs = self.call(name, values)?;
                Ok(outputs.swap_remove(0))
            }
            Expr::NoEvent(e) => {
                self.quiet += 1;
                let value = self.eval(e);
                self.quiet -= 1;
                value
            }
            Expr::Delay(source, delay) => self.delay(source, *delay),
            Expr::Sample(start, interval) => {
                Ok(Value::number(f64::from(self.sampling && due(self.time, *start, *interval))))
            }
            Expr::Initial => Ok(Value::number(f64::from(self.starting))),
        }
    }
}

/// Whether `sample(start, interval)` acts at a time; all three are exact in binary.
pub(super) fn due(time: f64, start: f64, interval: f64) -> bool {
    let turns = (time - start) / interval;
    turns >= 0.0 && turns.fract() == 0.0
}
