//! Integers in functions, functions before the run, `when` in algorithm sections.

use super::Builder;
use super::events::{assign, pre};
use super::functions::{real, set, whole};
use crate::model::{Expr, Form, Kind, Operator, Range, Role, Statement, Step, Target, Variable};

/// A function of integers whose turns its arguments decide.
fn whole_function(b: &mut Builder) -> String {
    let (a, c) = (Expr::local("a"), Expr::local("c"));
    let positive = Expr::binary(Operator::Greater, a.clone(), Expr::Number(0.0));
    let turn = match b.random.below(3) {
        0 => vec![set("a", Expr::call("div", vec![a.clone(), Expr::Number(2.0)])), set("c", c + Expr::Number(1.0))],
        1 => vec![
            set("c", c + Expr::call("mod", vec![a.clone(), Expr::Number(3.0)])),
            set("a", a.clone() - Expr::Number(2.0)),
        ],
        _ => {
            let odd =
                Expr::binary(Operator::Equal, Expr::call("mod", vec![a.clone(), Expr::Number(2.0)]), Expr::Number(1.0));
            vec![
                Step::If(vec![(odd, vec![set("c", c.clone() + a.clone())])], vec![set("c", c - Expr::Number(1.0))]),
                set("a", a.clone() - Expr::Number(1.0)),
            ]
        }
    };
    let magnitude = Expr::If(
        vec![(
            Expr::binary(Operator::Less, Expr::local("n"), Expr::Number(0.0)),
            Expr::Minus(Box::new(Expr::local("n"))),
        )],
        Box::new(Expr::local("n")),
    );
    let body = vec![set("a", magnitude), set("c", Expr::Number(0.0)), Step::While(positive, turn)];
    b.function(vec![whole("n")], vec![whole("c")], vec![whole("a")], body)
}

/// A function of integers, called with what events change.
fn whole_call(b: &mut Builder, name: String) {
    let n = match b.wholes.is_empty() {
        true => Expr::Number(b.random.between(-3, 9) as f64),
        false => Expr::Number(2.0) * b.random.pick(&b.wholes).clone() + Expr::Number(3.0),
    };
    let letter = b.fresh("k");
    let id = b.model.add(Variable::new(letter, Role::Algebraic).of(Kind::Integer));
    b.push(Statement::Define(Target::Name(id, Vec::new()), Expr::Call(name, vec![n]), Form::Plain));
    b.wholes.push(Expr::name(id));
    b.define(Expr::Number(0.1) * Expr::name(id));
}

/// Both.
pub(super) fn whole_numbers(b: &mut Builder) {
    let name = whole_function(b);
    whole_call(b, name);
}

/// Parameters that functions and comprehensions give.
pub(super) fn before(b: &mut Builder) {
    let i = Expr::local("i");
    let term = b.inside(1, &["u", "i"]);
    let turn = set("y", Expr::Number(0.8) * Expr::local("y") + term);
    let range = Range { to: Expr::local("n"), ..Range::new(1, 1) };
    let body = vec![set("y", Expr::local("u")), Step::For("i".into(), range, vec![turn])];
    let name = b.function(vec![real("u"), whole("n")], vec![real("y")], Vec::new(), body);
    let parameter = b.random.pick(&b.parameters.clone()).clone();
    let letter = b.fresh("p");
    let count = b.random.between(0, 4) as f64;
    let value = Expr::Call(name.clone(), vec![parameter.clone(), Expr::Number(count)]);
    let p = b.model.add(Variable::new(letter, Role::Parameter).valued(value));
    let letter = b.fresh("P");
    let n = b.random.between(2, 4);
    let value = Expr::For(
        None,
        Box::new(Expr::Call(name, vec![parameter / i.clone(), i])),
        vec![("i".into(), Range::new(1, n))],
    );
    let array = b.model.add(Variable::new(letter, Role::Parameter).sized(&[n as usize]).valued(value));
    b.readable.extend([Expr::name(p), Expr::at(array, vec![Expr::Number(n as f64)])]);
}

/// A `when` of an algorithm section.
pub(super) fn acts(b: &mut Builder) {
    let n = b.discrete("k", Kind::Integer, 0.0);
    let held = b.discrete("h", Kind::Real, 0.25);
    let trigger = b.trigger();
    let term = b.term(1);
    // A variable keeps its value until it is assigned, so both mean the value before.
    let before = if b.random.once_in(2) { pre(n) } else { Expr::name(n) };
    let mut branches = vec![(trigger, vec![assign(n, before + Expr::Number(2.0)), assign(held, term * Expr::name(n))])];
    if b.random.once_in(2) {
        branches.push((b.trigger(), vec![assign(n, Expr::Number(-1.0))]));
    }
    b.push(Statement::Acts(branches));
    b.wholes.push(Expr::name(n));
    b.readable.push(Expr::call("tanh", vec![Expr::name(held)]));
}
