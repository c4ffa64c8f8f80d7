//! Events: samplers, switches, jumps of states, enumerations, integers, discrete arrays.

use super::Builder;
use crate::model::{Expr, Form, Id, Kind, Operator, Range, Role, Statement, Subscript, Target, Variable};

/// An equation of a `when`.
pub(super) fn assign(id: Id, e: Expr) -> Statement {
    Statement::Define(Target::Name(id, Vec::new()), e, Form::Plain)
}

/// `pre` of a scalar.
pub(super) fn pre(id: Id) -> Expr {
    Expr::Pre(id, Vec::new())
}

impl Builder {
    /// A new discrete variable.
    pub(super) fn discrete(&mut self, letter: &str, kind: Kind, start: f64) -> Id {
        let name = self.fresh(letter);
        self.model.add(Variable::new(name, Role::Discrete).of(kind).starting(start))
    }

    /// `sample` at random.
    pub(super) fn sample(&mut self) -> Expr {
        let interval = self.random.between(3, 12) as f64 / 32.0;
        let start = self.random.between(0, 12) as f64 / 32.0;
        Expr::Sample(start, interval)
    }

    /// What a `when` waits for.
    pub(super) fn trigger(&mut self) -> Vec<Expr> {
        let one = |b: &mut Self| match b.random.below(4) {
            0 => b.relation(),
            1 if !b.truths.is_empty() => b.random.pick(&b.truths).clone(),
            _ => b.sample(),
        };
        let mut list = vec![one(self)];
        if self.random.once_in(3) {
            list.push(one(self));
        }
        if self.random.once_in(8) {
            list.push(Expr::Initial);
        }
        list
    }

    /// A Boolean.
    pub(super) fn truth(&mut self) -> Expr {
        match self.truths.is_empty() || self.random.once_in(2) {
            true => self.relation(),
            false => self.random.pick(&self.truths).clone(),
        }
    }
}

/// Counters and samples of what changes.
pub(super) fn counter(b: &mut Builder) {
    let n = b.discrete("k", Kind::Integer, 0.0);
    let held = b.discrete("h", Kind::Real, 0.5);
    let trigger = b.trigger();
    let count = match b.random.below(3) {
        0 => pre(n) + Expr::Number(1.0),
        1 => Expr::call("mod", vec![Expr::Number(3.0) * pre(n) + Expr::Number(2.0), Expr::Number(7.0)]),
        _ => {
            let small = Expr::binary(Operator::Less, pre(n), Expr::Number(3.0));
            Expr::If(vec![(small, pre(n) + Expr::Number(2.0))], Box::new(Expr::Number(-1.0)))
        }
    };
    let sampled = b.term(2);
    let e = match b.random.below(2) {
        0 => sampled,
        _ => Expr::Number(0.5) * pre(held) + sampled * Expr::name(n),
    };
    b.push(Statement::When(vec![(trigger, vec![assign(n, count), assign(held, e)])]));
    b.wholes.push(Expr::name(n));
    b.readable.push(Expr::call("tanh", vec![Expr::name(held)]));
    b.readable.push(Expr::Number(0.1) * Expr::name(n));
}

/// Booleans by relations, and what they switch.
pub(super) fn switch(b: &mut Builder) {
    let name = b.fresh("b");
    let id = b.model.add(Variable::new(name, Role::Algebraic).of(Kind::Boolean));
    let (first, second) = (b.truth(), b.truth());
    let e = match b.random.below(4) {
        0 => first,
        1 => Expr::Not(Box::new(first)),
        2 => Expr::binary(Operator::And, first, Expr::Not(Box::new(second))),
        _ => Expr::binary(Operator::Or, first, second),
    };
    b.push(Statement::Define(Target::Name(id, Vec::new()), e, Form::Plain));
    b.truths.push(Expr::name(id));
    let (yes, no) = (b.bounded(2), b.bounded(1));
    b.define(Expr::If(vec![(Expr::name(id), yes)], Box::new(no)));
    let n = b.discrete("k", Kind::Integer, 0.0);
    let condition = match b.random.below(3) {
        0 => Expr::Edge(id, Vec::new()),
        1 => Expr::Change(id, Vec::new()),
        _ => Expr::name(id),
    };
    b.push(Statement::When(vec![(vec![condition], vec![assign(n, pre(n) + Expr::Number(1.0))])]));
    b.wholes.push(Expr::name(n));
}

/// A state that is set back.
pub(super) fn bounce(b: &mut Builder) {
    let name = b.fresh("w");
    let x = b.model.add(Variable::new(name, Role::State).starting(b.random.number(-0.5, 0.2)));
    let slope = Expr::Number(b.random.number(0.8, 2.5)) + Expr::Number(0.3) * b.bounded(1);
    b.push(Statement::Derive(Target::Name(x, Vec::new()), slope, Form::Plain));
    let n = b.discrete("k", Kind::Integer, 0.0);
    let limit = Expr::Number(b.random.number(0.4, 0.9) + 0.003);
    let back = match b.random.below(3) {
        0 => Expr::Number(b.random.number(-1.0, 0.1)),
        1 => Expr::Number(-0.5) * pre(x),
        _ => Expr::Number(-0.1) * Expr::name(n) - Expr::Number(0.2),
    };
    let trigger = Expr::binary(Operator::Greater, Expr::name(x), limit);
    let reinit = Statement::Reinit(Target::Name(x, Vec::new()), back);
    let mut branches = vec![(vec![trigger], vec![assign(n, pre(n) + Expr::Number(1.0)), reinit])];
    if b.random.once_in(3) {
        let at = b.sample();
        branches.push((
            vec![at],
            vec![
                assign(n, pre(n) - Expr::Number(1.0)),
                Statement::Reinit(Target::Name(x, Vec::new()), Expr::Number(0.05)),
            ],
        ));
    }
    b.push(Statement::When(branches));
    b.readable.push(Expr::name(x));
    b.wholes.push(Expr::name(n));
}

/// An enumeration that steps from literal to literal, or follows from relations.
pub(super) fn modes(b: &mut Builder) {
    let literal = |k: usize| Expr::Literal(k);
    let is = |id: Id, k: usize| Expr::binary(Operator::Equal, Expr::name(id), Expr::Literal(k));
    let id = if b.random.once_in(2) {
        let id = b.discrete("mode", Kind::Mode, 1.0);
        let was = |k: usize| Expr::binary(Operator::Equal, pre(id), Expr::Literal(k));
        let trigger = b.trigger();
        let next = Expr::If(vec![(was(1), literal(3)), (was(3), literal(2))], Box::new(literal(1)));
        b.push(Statement::When(vec![(trigger, vec![assign(id, next)])]));
        id
    } else {
        let name = b.fresh("mode");
        let id = b.model.add(Variable::new(name, Role::Algebraic).of(Kind::Mode));
        let (first, second) = (b.truth(), b.truth());
        let e = Expr::If(vec![(first, literal(2)), (second, literal(3))], Box::new(literal(1)));
        b.push(Statement::Define(Target::Name(id, Vec::new()), e, Form::Plain));
        id
    };
    let (first, second, third) = (b.bounded(1), b.bounded(2), b.bounded(1));
    b.define(Expr::If(vec![(is(id, 2), first), (is(id, 3), second)], Box::new(third)));
    b.truths.push(Expr::binary(Operator::Greater, Expr::name(id), Expr::Literal(1)));
}

/// Rounding of what changes with time or state, quotients of integers.
pub(super) fn rounding(b: &mut Builder) {
    let name = b.fresh("k");
    let id = b.model.add(Variable::new(name, Role::Algebraic).of(Kind::Integer));
    let factor = Expr::Number(*b.random.pick(&[2.0, 4.0, 8.0]));
    let state = Expr::name(*b.random.pick(&b.states.clone()));
    let e = match b.random.below(6) {
        0 => Expr::call("integer", vec![factor * Expr::Time]),
        1 => Expr::call("integer", vec![Expr::Number(3.0) * state + Expr::Number(0.37)]),
        2 if !b.wholes.is_empty() => {
            let n = b.random.pick(&b.wholes).clone();
            let name = *b.random.pick(&["div", "mod", "rem"]);
            Expr::call(name, vec![n - Expr::Number(4.0), Expr::Number(3.0)])
        }
        3 if !b.wholes.is_empty() => {
            let n = b.random.pick(&b.wholes).clone();
            Expr::call("max", vec![n, Expr::Number(2.0)])
        }
        4 => {
            let (first, second) = (b.truth(), b.truth());
            Expr::If(vec![(first, Expr::Number(3.0)), (second, Expr::Number(-2.0))], Box::new(Expr::Number(5.0)))
        }
        _ => Expr::call("integer", vec![Expr::Number(4.0) * Expr::Time + Expr::Number(0.25)]),
    };
    b.push(Statement::Define(Target::Name(id, Vec::new()), e, Form::Plain));
    b.wholes.push(Expr::name(id));
    let number = Expr::name(id);
    let saw = match b.random.below(4) {
        0 => Expr::call("mod", vec![Expr::Time, Expr::Number(0.25)]),
        1 => Expr::call("floor", vec![Expr::Number(4.0) * Expr::Time]) / Expr::Number(4.0),
        2 => Expr::call("ceil", vec![Expr::Number(4.0) * Expr::Time - Expr::Number(0.125)]),
        _ => Expr::call("rem", vec![Expr::Number(2.0) * Expr::Time, Expr::Number(0.5)]),
    };
    b.define(saw + Expr::Number(0.1) * number);
}

/// A discrete array that shifts.
pub(super) fn memories(b: &mut Builder) {
    let n = b.random.between(2, 4) as usize;
    let name = b.fresh("d");
    let id = b.model.add(Variable::new(name, Role::Discrete).sized(&[n]).starting(0.25));
    let at = |e: Expr| vec![Subscript::At(e)];
    let i = Expr::local("i");
    let first = b.term(2);
    let shift = Expr::Pre(id, at(i.clone() - Expr::Number(1.0)));
    let body = vec![
        Statement::Define(Target::Name(id, at(Expr::Number(1.0))), first, Form::Plain),
        Statement::For(
            "i".into(),
            Range::new(2, n as i64),
            vec![Statement::Define(Target::Name(id, at(i)), Expr::Number(0.9) * shift, Form::Plain)],
        ),
    ];
    let trigger = b.trigger();
    b.push(Statement::When(vec![(trigger, body)]));
    b.readable.push(Expr::call("tanh", vec![Expr::at(id, vec![Expr::Number(n as f64)])]));
}

/// `elsewhen`, and `if` inside of `when`.
pub(super) fn alternatives(b: &mut Builder) {
    let (n, t) = (b.discrete("k", Kind::Integer, 1.0), b.discrete("h", Kind::Real, 0.0));
    let (first, second) = (b.trigger(), b.trigger());
    let one = vec![assign(n, pre(n) + Expr::Number(1.0)), assign(t, Expr::Time)];
    let condition = Expr::binary(Operator::Greater, pre(n), Expr::Number(2.0));
    let yes = vec![assign(n, Expr::Number(0.0)), assign(t, Expr::Number(2.0) * Expr::Time)];
    let term = b.term(1);
    let no = vec![assign(n, pre(n) + Expr::Number(3.0)), assign(t, term)];
    let other = vec![Statement::If(vec![(condition, yes)], no)];
    b.push(Statement::When(vec![(first, one), (second, other)]));
    b.wholes.push(Expr::name(n));
    b.readable.push(Expr::call("sin", vec![Expr::name(t)]));
}
