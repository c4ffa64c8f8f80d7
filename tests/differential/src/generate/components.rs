//! Components of models and arrays of them.

use super::Builder;
use crate::model::{Component, Expr, Form, Kind, Operator, Role, SELF, Shape, Statement, Target, Variable};
use crate::model::{Id, Subscript};

fn own(count: Option<usize>) -> Vec<Expr> {
    count.map(|_| Expr::local(SELF)).into_iter().collect()
}

fn place(count: Option<usize>) -> Vec<Subscript> {
    own(count).into_iter().map(Subscript::At).collect()
}

impl Builder {
    fn part(&mut self, count: Option<usize>) -> usize {
        let (name, class) = (self.fresh("part"), self.fresh("Part"));
        let inherits = self.random.once_in(3);
        let uneven = count.is_some() && self.random.once_in(3);
        let shape = Shape::Model;
        self.model.components.push(Component {
            name,
            class,
            count,
            shape,
            parameter: false,
            value: None,
            inherits,
            uneven,
            dropped: false,
        });
        self.model.components.len() - 1
    }

    fn owned(&mut self, owner: usize, variable: Variable) -> Id {
        let mut sizes: Vec<usize> = self.model.components[owner].count.into_iter().collect();
        sizes.extend(&variable.sizes);
        self.model.add(Variable { owner: Some(owner), sizes, ..variable })
    }

    /// Parts with a parameter, an input, a state, a variable and a counter.
    fn parts(&mut self, count: Option<usize>) {
        let owner = self.part(count);
        let n = count.unwrap_or(1);
        let whole = |list: Vec<Expr>| match count {
            Some(_) => Expr::Array(list),
            None => list.into_iter().next().unwrap_or(Expr::Number(0.0)),
        };
        let values = whole((0..n).map(|_| Expr::Number(self.random.number(0.4, 2.0))).collect());
        let k = self.owned(owner, Variable::new("k", Role::Parameter).valued(values));
        let u = self.owned(owner, Variable::new("u", Role::Algebraic));
        let start = self.random.number(-1.0, 1.0);
        let x = self.owned(owner, Variable::new("x", Role::State).starting(start));
        let y = self.owned(owner, Variable::new("y", Role::Algebraic));
        let inputs = whole((0..n).map(|_| self.bounded(2)).collect());
        self.push(Statement::Declare(u, inputs));
        let at = |id: Id| Expr::at(id, own(count));
        let target = |id: Id| Target::Name(id, place(count));
        let mut inside = vec![at(k), at(u), at(x)];
        // By `inner` and `outer`.
        let around = |b: &Self, e: &Expr| match e {
            Expr::Name(id, list) => list.is_empty() && b.model.variables[*id].owner.is_none(),
            _ => false,
        };
        if self.random.once_in(3) {
            inside.extend(self.readable.clone().into_iter().filter(|e| around(self, e)).take(3));
        }
        let outside = std::mem::replace(&mut self.readable, inside);
        let (term, form) = (self.bounded(2), self.form());
        let mut body = vec![Statement::Define(target(y), term, form)];
        self.readable.push(at(y));
        let (term, form) = (self.bounded(1), self.form());
        let decay = Expr::Minus(Box::new(at(k) * at(x)));
        body.push(Statement::Derive(target(x), decay + at(u) + term, form));
        if self.random.once_in(2) {
            let n = self.owned(owner, Variable::new("n", Role::Discrete).of(Kind::Integer).starting(0.0));
            let trigger = match self.random.below(2) {
                0 => Expr::Sample(self.random.between(1, 9) as f64 / 32.0, self.random.between(3, 9) as f64 / 32.0),
                _ => Expr::binary(Operator::Greater, at(x), Expr::Number(self.random.number(-0.6, 0.6) + 0.003)),
            };
            let count = Expr::Pre(n, place(count)) + Expr::Number(1.0);
            body.push(Statement::When(vec![(vec![trigger], vec![Statement::Define(target(n), count, Form::Plain)])]));
        }
        self.readable = outside;
        self.push(Statement::Each(owner, body));
        let last: Vec<Expr> = count.map(|n| Expr::Number(n as f64)).into_iter().collect();
        self.readable.extend([Expr::at(x, last.clone()), Expr::at(y, last)]);
        if count.is_some() {
            self.define(Expr::call("sum", vec![Expr::name(x)]) / Expr::Number(n as f64));
        }
    }
}

/// An array of components.
pub(super) fn array(b: &mut Builder) {
    let n = b.random.between(2, 4) as usize;
    b.parts(Some(n));
}

/// One component.
pub(super) fn single(b: &mut Builder) {
    b.parts(None);
}
