//! The text of a model, in several forms that mean the same.
//!
//! Declarations and equations are shuffled: the language knows no order of them.

mod declaration;
mod expression;
mod statement;

use crate::model::{ComponentId, Expr, Id, Model, Operator, Range, Role, SELF, Shape, Subscript};
use crate::random::Random;

/// How a model is written.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub struct Form {
    /// Loops, comprehensions and reductions written out.
    pub unrolled: bool,
    /// Components of models as variables of the model itself, `p[2].x` as `p_x[2]`.
    pub flat: bool,
    /// Parameters as constants.
    pub constant: bool,
}

/// A number as it is written.
pub fn number(value: f64) -> String {
    format!("{value}")
}

/// The text of a model.
pub fn text(model: &Model, form: Form) -> String {
    let printer = Printer { model, form, inside: None, values: Vec::new() };
    let mut random = Random::new(model.order);
    printer.file(&mut random)
}

/// The name of an element of a variable in results.
pub fn column(model: &Model, form: Form, id: Id, element: usize) -> String {
    let printer = Printer { model, form, inside: None, values: Vec::new() };
    let mut subscripts = Vec::new();
    let mut rest = element;
    for size in model.variables[id].sizes.iter().rev() {
        subscripts.insert(0, Subscript::At(Expr::Number((rest % size + 1) as f64)));
        rest /= size;
    }
    printer.name(id, &subscripts).replace(", ", ",")
}

/// Writes a model.
pub struct Printer<'a> {
    model: &'a Model,
    form: Form,
    /// The component whose class is being written.
    inside: Option<ComponentId>,
    /// Iterators of loops that are written out.
    values: Vec<(String, i64)>,
}

impl<'a> Printer<'a> {
    fn with(&self, name: &str, value: i64) -> Printer<'a> {
        let mut values = self.values.clone();
        values.push((name.to_string(), value));
        Printer { model: self.model, form: self.form, inside: self.inside, values }
    }

    fn value_of(&self, name: &str) -> Option<i64> {
        self.values.iter().rev().find(|(n, _)| n == name).map(|(_, k)| *k)
    }

    /// The values of a range that is known here.
    fn values(&self, range: &Range) -> Option<Vec<i64>> {
        let (from, to, step) = (self.whole(&range.from)?, self.whole(&range.to)?, range.step.unwrap_or(1));
        let mut list = Vec::new();
        let mut k = from;
        while (step > 0 && k <= to) || (step < 0 && k >= to) {
            list.push(k);
            k += step;
        }
        Some(list)
    }

    fn whole(&self, e: &Expr) -> Option<i64> {
        match e {
            Expr::Number(v) => Some(*v as i64),
            Expr::Local(name, list) if list.is_empty() => self.value_of(name),
            Expr::Name(id, list) if list.is_empty() => match &self.model.variables[*id] {
                variable if variable.role == Role::Structural => self.whole(variable.value.as_ref()?),
                _ => None,
            },
            Expr::Binary(Operator::Add, a, b) => Some(self.whole(a)? + self.whole(b)?),
            Expr::Binary(Operator::Subtract, a, b) => Some(self.whole(a)? - self.whole(b)?),
            Expr::Binary(Operator::Multiply, a, b) => Some(self.whole(a)? * self.whole(b)?),
            _ => None,
        }
    }

    /// The truth of a comparison of iterators of loops that are written out.
    fn known(&self, e: &Expr) -> Option<bool> {
        let Expr::Binary(operator, a, b) = e else { return None };
        let numbers = |e: &Expr| matches!(e, Expr::Number(_));
        if !self.form.unrolled || (numbers(a) && numbers(b)) {
            return None;
        }
        let (a, b) = (self.whole(a)?, self.whole(b)?);
        match operator {
            Operator::Less => Some(a < b),
            Operator::Greater => Some(a > b),
            Operator::Equal => Some(a == b),
            Operator::NotEqual => Some(a != b),
            _ => None,
        }
    }

    /// Whether variables of this component are written as variables of the model.
    fn is_flat(&self, component: ComponentId) -> bool {
        self.form.flat && self.model.components[component].shape == Shape::Model
    }

    /// A reference to a variable.
    fn name(&self, id: Id, list: &[Subscript]) -> String {
        let variable = &self.model.variables[id];
        let Some(owner) = variable.owner else { return format!("{}{}", variable.name, self.subscripts(list)) };
        let component = &self.model.components[owner];
        if self.is_flat(owner) {
            return format!("{}_{}{}", component.name, variable.name, self.subscripts(list));
        }
        let (own, rest) = list.split_at(usize::from(component.count.is_some()).min(list.len()));
        let itself = own.iter().all(|s| matches!(s, Subscript::At(Expr::Local(n, _)) if n == SELF));
        if self.inside == Some(owner) && itself {
            return format!("{}{}", variable.name, self.subscripts(rest));
        }
        format!("{}{}.{}{}", component.name, self.subscripts(own), variable.name, self.subscripts(rest))
    }
}
