//! Arrays: loops over them, comprehensions, reductions, slices, linear algebra, states.

use super::Builder;
use crate::model::{Expr, Form, Id, Kind, Range, Role, Statement, Subscript, Target, Variable};

/// Subscripts of an element.
pub(super) fn at(list: Vec<Expr>) -> Vec<Subscript> {
    list.into_iter().map(Subscript::At).collect()
}

impl Builder {
    /// A size and how a range ends there.
    pub(super) fn length(&mut self) -> (usize, Option<Id>, Expr) {
        match self.size.filter(|_| self.random.once_in(2)) {
            Some((id, n)) => (n, Some(id), Expr::name(id)),
            None => {
                let n = self.random.between(2, 6) as usize;
                (n, None, Expr::Number(n as f64))
            }
        }
    }

    /// A new array of Reals.
    pub(super) fn array(&mut self, role: Role, n: usize, by: Option<Id>) -> Id {
        let name = self.fresh("a");
        let variable = Variable { size_by: by, ..Variable::new(name, role).sized(&[n]) };
        self.model.add(variable)
    }

    /// One of its elements.
    pub(super) fn element(&mut self, id: Id, n: usize) -> Expr {
        let k = self.random.between(1, n as i64) as f64;
        Expr::at(id, vec![Expr::Number(k)])
    }
}

/// An array by a loop, each element from the one before.
pub(super) fn looped(b: &mut Builder) {
    let (n, by, end) = b.length();
    let id = b.array(Role::Algebraic, n, by);
    let first = b.bounded(1);
    b.push(Statement::Define(Target::Name(id, at(vec![Expr::Number(1.0)])), first, Form::Plain));
    let i = Expr::local("i");
    let before = Expr::at(id, vec![i.clone() - Expr::Number(1.0)]);
    let term = b.bounded_with(2, std::slice::from_ref(&i));
    let e = match b.random.below(3) {
        0 => Expr::Number(0.7) * before + term,
        1 => term / i.clone() - before,
        _ => Expr::call("sin", vec![before + i.clone()]) + term,
    };
    let form = b.form();
    let define = Statement::Define(Target::Name(id, at(vec![i])), e, form);
    let range = Range { from: Expr::Number(2.0), step: None, to: end };
    b.push(Statement::For("i".into(), range, vec![define]));
    let one = b.element(id, n);
    b.readable.push(one);
    b.readable.push(Expr::call("sum", vec![Expr::name(id)]) / Expr::Number(n as f64));
}

/// An array by two loops with steps.
pub(super) fn strided(b: &mut Builder) {
    let n = b.random.between(4, 9) as usize;
    let id = b.array(Role::Algebraic, n, None);
    let i = Expr::local("i");
    for first in 1..=2i64 {
        let last = n as i64 - (n as i64 - first) % 2;
        let range = match b.random.below(3) {
            // Ends past its last value or on it.
            0 => Range { step: Some(2), ..Range::new(first, n as i64) },
            1 => Range { step: Some(-2), ..Range::new(last, first) },
            // Ends below its last value.
            _ => Range { step: Some(-2), ..Range::new(last, first - 1) },
        };
        let term = b.bounded_with(2, std::slice::from_ref(&i));
        let form = b.form();
        let define = Statement::Define(Target::Name(id, at(vec![i.clone()])), term * i.clone(), form);
        b.push(Statement::For("i".into(), range, vec![define]));
    }
    let one = b.element(id, n);
    b.readable.push(one);
}

/// A matrix by nested loops, with conditions on the iterators.
pub(super) fn matrix(b: &mut Builder) {
    let (rows, columns) = (b.random.between(2, 4) as usize, b.random.between(2, 4) as usize);
    let name = b.fresh("m");
    let id = b.model.add(Variable::new(name, Role::Algebraic).sized(&[rows, columns]));
    let (i, j) = (Expr::local("i"), Expr::local("j"));
    let both = [i.clone(), j.clone()];
    let (first, second) = (b.bounded_with(2, &both), b.bounded_with(1, &both));
    let e = match b.random.below(3) {
        0 => {
            Expr::If(vec![(Expr::binary(crate::model::Operator::Equal, i.clone(), j.clone()), first)], Box::new(second))
        }
        1 => Expr::If(
            vec![(Expr::binary(crate::model::Operator::Greater, i.clone(), j.clone()), first)],
            Box::new(second),
        ),
        _ => first * i.clone() - second / j.clone(),
    };
    let define = Statement::Define(Target::Name(id, at(vec![i, j])), e, Form::Plain);
    let (range_i, range_j) = (Range::new(1, rows as i64), Range::new(1, columns as i64));
    let inner = Statement::For("j".into(), range_j, vec![define]);
    b.push(Statement::For("i".into(), range_i, vec![inner]));
    let element = Expr::at(id, vec![Expr::Number(rows as f64), Expr::Number(1.0)]);
    b.readable.push(element);
    let row = Expr::Name(id, vec![Subscript::At(Expr::Number(1.0)), Subscript::All]);
    b.define(Expr::call("sum", vec![row]));
}

/// Arrays by comprehensions.
pub(super) fn comprehension(b: &mut Builder) {
    let (n, by, end) = b.length();
    let i = Expr::local("i");
    let term = b.bounded_with(2, std::slice::from_ref(&i));
    if b.random.once_in(3) {
        let name = b.fresh("m");
        let id = b.model.add(Variable::new(name, Role::Algebraic).sized(&[n, 2]));
        // The last iterator is the outermost one.
        let iterators = vec![("j".to_string(), Range::new(1, 2)), ("i".to_string(), Range::new(1, n as i64))];
        let e = Expr::For(None, Box::new(Expr::Number(10.0) * i + Expr::local("j") + term), iterators);
        b.push(Statement::Declare(id, e));
        b.readable.push(Expr::at(id, vec![Expr::Number(1.0), Expr::Number(2.0)]) / Expr::Number(12.0));
        return;
    }
    let id = b.array(Role::Algebraic, n, by);
    let range = Range { from: Expr::Number(1.0), step: None, to: end };
    let e = Expr::For(None, Box::new(i * term), vec![("i".to_string(), range)]);
    if b.random.once_in(2) {
        b.push(Statement::Declare(id, e));
    } else {
        b.push(Statement::Define(Target::Name(id, Vec::new()), e, Form::Plain));
    }
    let one = b.element(id, n);
    b.readable.push(one);
}

/// Sums and products over iterators.
pub(super) fn reduction(b: &mut Builder) {
    let (_, _, end) = b.length();
    let i = Expr::local("i");
    let range = match b.random.below(3) {
        0 => Range { step: Some(2), ..Range::new(1, b.random.between(3, 8)) },
        1 => Range { step: Some(-1), ..Range::new(b.random.between(2, 5), 1) },
        _ => Range { from: Expr::Number(1.0), step: None, to: end },
    };
    let term = b.bounded_with(2, std::slice::from_ref(&i));
    let e = match b.random.below(3) {
        0 => Expr::For(Some("sum"), Box::new(term / i), vec![("i".into(), range)]),
        1 => Expr::For(
            Some("product"),
            Box::new(Expr::Number(1.0) + Expr::Number(0.3) * term),
            vec![("i".into(), range)],
        ),
        _ => {
            let iterators = vec![("i".to_string(), range), ("j".to_string(), Range::new(1, 3))];
            Expr::For(Some("sum"), Box::new(term / (i + Expr::local("j"))), iterators)
        }
    };
    let id = b.define(e);
    if b.random.once_in(2) {
        let range = Range::new(1, 4);
        let term = b.bounded_with(1, &[Expr::local("k"), Expr::name(id)]);
        let largest = b.algebraic();
        let name = *b.random.pick(&["max", "min"]);
        let e = Expr::For(Some(name), Box::new(term * Expr::local("k")), vec![("k".into(), range)]);
        b.push(Statement::Define(Target::Name(largest, Vec::new()), e, Form::Plain));
    }
}

/// Products of matrices and vectors.
pub(super) fn algebra(b: &mut Builder) {
    let (rows, columns) = (b.random.between(2, 3) as usize, b.random.between(2, 3) as usize);
    let row = |b: &mut Builder| Expr::Array((0..columns).map(|_| Expr::Number(b.random.number(-1.0, 1.0))).collect());
    let values = Expr::Array((0..rows).map(|_| row(b)).collect());
    let name = b.fresh("A");
    let matrix = b.model.add(Variable::new(name, Role::Parameter).sized(&[rows, columns]).valued(values));
    let v = b.array(Role::Algebraic, columns, None);
    let elements = Expr::Array((0..columns).map(|_| b.bounded(1)).collect());
    b.push(Statement::Declare(v, elements));
    let w = b.array(Role::Algebraic, rows, None);
    let product = Expr::name(matrix) * Expr::name(v);
    let e = match b.random.below(4) {
        0 => product,
        1 => Expr::Number(2.0) * product + Expr::call("ones", vec![Expr::Number(rows as f64)]),
        2 => Expr::name(v) * Expr::call("transpose", vec![Expr::name(matrix)]),
        _ => {
            let line = vec![Expr::Number(0.0), Expr::Time, Expr::Number(rows as f64)];
            product - Expr::call("linspace", line)
        }
    };
    b.push(Statement::Define(Target::Name(w, Vec::new()), e, Form::Plain));
    let one = b.element(w, rows);
    b.readable.push(one);
    b.define(Expr::name(v) * Expr::name(v));
}

/// Parts of arrays.
pub(super) fn slices(b: &mut Builder) {
    let n = b.random.between(4, 7) as usize;
    let id = b.array(Role::Algebraic, n, None);
    let i = Expr::local("i");
    let term = b.bounded_with(2, std::slice::from_ref(&i));
    b.push(Statement::Declare(id, Expr::For(None, Box::new(term), vec![("i".into(), Range::new(1, n as i64))])));
    let from = b.random.between(1, 2);
    let part = b.array(Role::Algebraic, 3, None);
    let range = match b.random.below(3) {
        0 => Range { step: Some(-1), ..Range::new(from + 2, from) },
        1 if n >= 6 => Range { step: Some(2), ..Range::new(from, from + 4) },
        _ => Range::new(from, from + 2),
    };
    let slice = Expr::Name(id, vec![Subscript::Slice(Box::new(range))]);
    b.push(Statement::Define(Target::Name(part, Vec::new()), slice, Form::Plain));
    let together = b.array(Role::Algebraic, n + 3, None);
    let both = Expr::call("cat", vec![Expr::Number(1.0), Expr::name(part), Expr::name(id)]);
    b.push(Statement::Declare(together, both));
    let one = b.element(together, n + 3);
    b.readable.push(one);
}

/// An array of states, coupled to its neighbours.
pub(super) fn states(b: &mut Builder) {
    let (n, by, end) = b.length();
    let start = b.random.number(-1.0, 1.0);
    let id = b.array(Role::State, n, by);
    let variable = std::mem::replace(&mut b.model.variables[id], Variable::new("", Role::State));
    b.model.variables[id] = variable.of(Kind::Real).starting(start);
    let i = Expr::local("i");
    let itself = Expr::at(id, vec![i.clone()]);
    let term = b.bounded_with(2, std::slice::from_ref(&i));
    if b.random.once_in(3) {
        let whole = Expr::Minus(Box::new(Expr::name(id)));
        let e =
            Expr::For(None, Box::new(term), vec![("i".into(), Range { from: Expr::Number(1.0), step: None, to: end })]);
        b.push(Statement::Derive(Target::Name(id, Vec::new()), whole + e, Form::Plain));
    } else {
        let form = b.form();
        let head = b.bounded(1) - Expr::at(id, vec![Expr::Number(1.0)]);
        b.push(Statement::Derive(Target::Name(id, at(vec![Expr::Number(1.0)])), head, Form::Plain));
        let before = Expr::at(id, vec![i.clone() - Expr::Number(1.0)]);
        let rate = Expr::Number(b.random.number(0.5, 6.0));
        let e = rate * (before - itself) + term;
        let derive = Statement::Derive(Target::Name(id, at(vec![i])), e, form);
        let range = Range { from: Expr::Number(2.0), step: None, to: end };
        b.push(Statement::For("i".into(), range, vec![derive]));
    }
    let one = b.element(id, n);
    b.readable.push(one);
}
