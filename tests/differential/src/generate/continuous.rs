//! Scalars, constraints, derivatives of expressions, delays, branches, algorithm sections.

use super::Builder;
use crate::model::{Expr, Form, Operator, Range, Role, Start, Statement, Step, Target, Variable};

/// Some scalars one after the other.
pub(super) fn scalars(b: &mut Builder) {
    for _ in 0..b.random.between(1, 4) {
        let e = match b.random.below(5) {
            0 => {
                let condition = b.relation();
                Expr::If(vec![(condition, b.bounded(2))], Box::new(b.bounded(1)))
            }
            1 => {
                let branches = vec![(b.relation(), b.bounded(1)), (b.relation(), b.bounded(1))];
                Expr::If(branches, Box::new(b.bounded(2)))
            }
            _ => b.term(3),
        };
        b.define(e);
    }
}

/// A state, and another variable that follows from it; the text differentiates the one or the other.
pub(super) fn constraint(b: &mut Builder) {
    let (name, other) = (b.fresh("z"), b.fresh("w"));
    let mut state = Variable::new(name, Role::State).starting(b.random.number(-1.0, 1.0));
    if b.random.once_in(2) {
        state.select = Some(*b.random.pick(&["always", "prefer", "avoid", "default"]));
    }
    let mut follows = Variable::new(other, Role::Algebraic);
    if b.random.once_in(2) {
        follows.select = Some(*b.random.pick(&["avoid", "default", "never"]));
    }
    let x = b.model.add(state);
    let w = b.model.add(follows);
    let rate = b.model.add(Variable::new(b.model.variables[w].name.clone() + "_rate", Role::Algebraic));
    let (gain, offset) = (b.random.number(0.5, 2.0), b.random.number(-1.0, 1.0));
    let cubic = Expr::binary(Operator::Power, Expr::name(x), Expr::Number(3.0));
    let e = match b.random.below(3) {
        0 => Expr::Number(gain) * Expr::name(x) + Expr::Number(offset),
        1 => Expr::name(x) + Expr::Number(0.1) * cubic,
        _ => Expr::call("sinh", vec![Expr::name(x)]) + Expr::call("sin", vec![Expr::Time]),
    };
    let form = b.form();
    b.push(Statement::Define(Target::Name(w, Vec::new()), e, form));
    let term = b.bounded(2);
    b.push(Statement::Derive(Target::Name(x, Vec::new()), term - Expr::name(x), Form::Plain));
    // The derivative of what follows, as an equation of its own.
    b.push(Statement::Define(Target::Name(rate, Vec::new()), Expr::Der(Box::new(Expr::name(w))), Form::Plain));
    b.readable.push(Expr::name(x));
    b.readable.push(Expr::name(w));
}

/// The derivative of an expression.
pub(super) fn derivative(b: &mut Builder) {
    let state = Expr::name(*b.random.pick(&b.states.clone()));
    let inner = match b.random.below(4) {
        0 => Expr::binary(Operator::Power, state, Expr::Number(2.0)),
        1 => Expr::call("sin", vec![Expr::Number(2.0) * state]) * Expr::Time,
        2 => Expr::call("exp", vec![Expr::Minus(Box::new(Expr::binary(Operator::Power, state, Expr::Number(2.0))))]),
        _ => state.clone() * Expr::call("atan", vec![state]),
    };
    let id = b.algebraic();
    let form = b.form();
    b.push(Statement::Define(Target::Name(id, Vec::new()), Expr::Der(Box::new(inner)), form));
}

/// Two states of second order.
pub(super) fn oscillator(b: &mut Builder) {
    let (name, speed) = (b.fresh("s"), b.fresh("v"));
    let s = b.model.add(Variable::new(name, Role::State).starting(b.random.number(-1.0, 1.0)));
    let v = b.model.add(Variable::new(speed, Role::State).starting(b.random.number(-1.0, 1.0)));
    b.push(Statement::Derive(Target::Name(s, Vec::new()), Expr::name(v), Form::Plain));
    let stiffness = Expr::Number(b.random.number(1.0, 30.0));
    let damping = Expr::Number(b.random.number(0.1, 2.0));
    let force = b.bounded(2);
    let e = force - stiffness * Expr::name(s) - damping * Expr::name(v);
    let form = b.form();
    b.push(Statement::Derive(Target::Name(v, Vec::new()), e, form));
    b.readable.extend([Expr::name(s), Expr::name(v)]);
    b.states.push(s);
}

/// Delayed values, also one in the derivative of its own state.
pub(super) fn past(b: &mut Builder) {
    let delay = b.random.between(1, 12) as f64 / 16.0;
    match b.random.below(3) {
        0 => {
            let name = b.fresh("l");
            let x = b.model.add(Variable::new(name, Role::State).starting(b.random.number(-1.0, 1.0)));
            let e = Expr::Number(b.random.number(-1.5, 0.5)) * Expr::Delay(Box::new(Expr::name(x)), delay);
            let term = b.bounded(1);
            b.push(Statement::Derive(Target::Name(x, Vec::new()), e + term, Form::Plain));
            b.readable.push(Expr::name(x));
        }
        1 => {
            let source = b.bounded(2);
            b.define(Expr::Delay(Box::new(source), delay) + Expr::Number(0.5));
        }
        _ => {
            let n = b.random.between(2, 4) as usize;
            let name = b.fresh("q");
            let id = b.model.add(Variable::new(name, Role::Algebraic).sized(&[n]));
            let i = Expr::local("i");
            let source = b.bounded_with(1, std::slice::from_ref(&i));
            let e = i.clone() * Expr::Delay(Box::new(source + i.clone()), delay);
            let define = Statement::Define(Target::Name(id, vec![crate::model::Subscript::At(i)]), e, Form::Plain);
            b.push(Statement::For("i".into(), Range::new(1, n as i64), vec![define]));
            b.readable.push(Expr::at(id, vec![Expr::Number(n as f64)]));
        }
    }
}

/// An `if` of equations.
pub(super) fn branches(b: &mut Builder) {
    let (y, z) = (b.algebraic(), b.algebraic());
    let defines = |b: &mut Builder| {
        let (first, second, form) = (b.bounded(2), b.bounded(1), b.form());
        vec![
            Statement::Define(Target::Name(y, Vec::new()), first, form),
            Statement::Define(Target::Name(z, Vec::new()), Expr::name(y) + second, Form::Plain),
        ]
    };
    let first = (b.relation(), defines(b));
    let mut list = vec![first];
    if b.random.once_in(2) {
        list.push((b.relation(), defines(b)));
    }
    let otherwise = defines(b);
    b.push(Statement::If(list, otherwise));
    b.readable.extend([Expr::name(y), Expr::name(z)]);
}

/// An algorithm section.
pub(super) fn section(b: &mut Builder) {
    let (y, z) = (b.algebraic(), b.algebraic());
    let target = |id| Target::Name(id, Vec::new());
    let (first, second) = (b.bounded(1), b.bounded(1));
    let mut steps = vec![Step::Assign(target(y), first)];
    let i = Expr::local("i");
    let body = match b.random.below(3) {
        0 => Step::Assign(target(y), Expr::Number(0.5) * Expr::name(y) + second / (i + Expr::Number(1.0))),
        1 => {
            let condition = Expr::binary(Operator::Greater, i.clone(), Expr::Number(2.0));
            let one = Step::Assign(target(y), Expr::name(y) + Expr::Number(0.1) * i);
            let other = Step::Assign(target(y), Expr::name(y) * second);
            Step::If(vec![(condition, vec![one])], vec![other])
        }
        _ => Step::Assign(target(y), Expr::name(y) + Expr::call("sin", vec![i * second])),
    };
    let last = b.random.between(1, 5);
    steps.push(Step::For("i".into(), Range::new(1, last), vec![body]));
    if b.random.once_in(2) {
        let branch = vec![Step::Assign(target(z), Expr::name(y) * Expr::Number(2.0))];
        let condition = b.relation();
        let other = b.bounded(1);
        steps.push(Step::If(vec![(condition, branch)], vec![Step::Assign(target(z), other)]));
    } else {
        let e = b.bounded_with(2, &[Expr::name(y)]);
        steps.push(Step::Assign(target(z), e));
    }
    b.push(Statement::Algorithm(steps));
    b.readable.extend([Expr::name(y), Expr::name(z)]);
}

/// Values that nothing reads: they have kinks without events.
pub(super) fn observers(b: &mut Builder) {
    for _ in 0..b.random.between(1, 3) {
        let (x, y) = (b.term(2), b.term(1));
        let id = b.algebraic();
        let e = match b.random.below(6) {
            0 => Expr::call("abs", vec![x]),
            1 => Expr::call("max", vec![x, y]),
            2 => Expr::call("min", vec![x, y]),
            3 => Expr::call("sign", vec![Expr::Number(0.5) + x.clone()]) * (Expr::Number(0.5) + x),
            4 => {
                let relation = Expr::binary(Operator::Greater, x.clone(), Expr::Number(0.1));
                let e = Expr::If(vec![(relation, x.clone() - Expr::Number(0.1))], Box::new(Expr::Number(0.1) - x));
                Expr::NoEvent(Box::new(e))
            }
            _ => Expr::call("max", vec![Expr::Array(vec![x, y, Expr::Number(0.25)])]),
        };
        b.push(Statement::Define(Target::Name(id, Vec::new()), e, Form::Plain));
    }
    debug_assert!(b.model.variables.iter().all(|v| v.role != Role::Free || v.fixed == Start::Guess));
}
