//! More of arrays: operators by element, parts that are assigned, plates of states, branches in loops, arrays of Booleans.

use super::Builder;
use super::arrays::at;
use crate::model::{Expr, Form, Kind, Operator, Range, Role, Statement, Subscript, Target, Variable};

fn define(id: usize, list: Vec<Expr>, e: Expr) -> Statement {
    Statement::Define(Target::Name(id, at(list)), e, Form::Plain)
}

/// Operators and functions that go element by element.
pub(super) fn elementwise(b: &mut Builder) {
    let n = b.random.between(2, 4) as usize;
    let v = b.array(Role::Algebraic, n, None);
    let w = b.array(Role::Algebraic, n, None);
    let elements = Expr::Array((0..n).map(|_| b.bounded(1)).collect());
    b.push(Statement::Declare(v, elements));
    let (x, two) = (Expr::name(v), Expr::Number(2.0));
    let e = match b.random.below(6) {
        0 => Expr::binary(Operator::MultiplyEach, x.clone(), Expr::call("cos", vec![x])),
        1 => Expr::binary(
            Operator::DivideEach,
            x.clone(),
            Expr::call("ones", vec![Expr::Number(n as f64)]) + Expr::binary(Operator::PowerEach, x, two),
        ),
        2 => Expr::binary(Operator::PowerEach, Expr::call("exp", vec![x]), Expr::Number(0.5)),
        3 => {
            let condition = b.relation();
            Expr::If(vec![(condition, x.clone())], Box::new(Expr::Minus(Box::new(x)) * two))
        }
        4 => Expr::Minus(Box::new(x.clone())) + Expr::call("fill", vec![b.bounded(1), Expr::Number(n as f64)]),
        _ => x.clone() * (x.clone() * x) / Expr::Number(3.0),
    };
    let declared = b.random.once_in(2);
    b.push(if declared { Statement::Declare(w, e) } else { define(w, Vec::new(), e) });
    let one = b.element(w, n);
    b.readable.push(one);
}

/// A vector by parts.
pub(super) fn parts(b: &mut Builder) {
    let n = b.random.between(4, 6) as usize;
    let id = b.array(Role::Algebraic, n, None);
    let split = b.random.between(2, n as i64 - 1);
    let i = Expr::local("i");
    for (from, to) in [(1, split), (split + 1, n as i64)] {
        let term = b.bounded_with(1, std::slice::from_ref(&i));
        let e = Expr::For(None, Box::new(term * i.clone()), vec![("i".into(), Range::new(from, to))]);
        let range = if to == n as i64 && b.random.once_in(2) {
            Range { step: Some(-1), ..Range::new(to, from) }
        } else {
            Range::new(from, to)
        };
        let part = vec![Subscript::Slice(Box::new(range))];
        b.push(Statement::Define(Target::Name(id, part), e, Form::Plain));
    }
    let one = b.element(id, n);
    b.readable.push(one);
    b.readable.push(Expr::call("sum", vec![Expr::name(id)]) / Expr::Number(n as f64 * n as f64));
}

/// A plate of states, each coupled to its neighbours, with other equations at the border.
pub(super) fn plate(b: &mut Builder) {
    let (rows, columns) = (b.random.between(2, 4), b.random.between(2, 4));
    let name = b.fresh("T");
    let start = b.random.number(-0.5, 0.5);
    let id = b.model.add(Variable::new(name, Role::State).sized(&[rows as usize, columns as usize]).starting(start));
    let (i, j) = (Expr::local("i"), Expr::local("j"));
    let here = || Expr::at(id, vec![Expr::local("i"), Expr::local("j")]);
    let one = || Expr::Number(1.0);
    let side = |condition: Expr, i: Expr, j: Expr| {
        Expr::If(vec![(condition, Expr::at(id, vec![i, j]) - here())], Box::new(Expr::Number(0.0)))
    };
    let compare = |op, a: &Expr, k: i64| Expr::binary(op, a.clone(), Expr::Number(k as f64));
    let up = side(compare(Operator::Greater, &i, 1), i.clone() - one(), j.clone());
    let down = side(compare(Operator::Less, &i, rows), i.clone() + one(), j.clone());
    let left = side(compare(Operator::NotEqual, &j, 1), i.clone(), j.clone() - one());
    let term = b.bounded_with(1, &[i.clone(), j.clone()]);
    let e = up + down + left - here() + term;
    let derive = Statement::Derive(Target::Name(id, at(vec![i, j])), e, Form::Plain);
    let inner = Statement::For("j".into(), Range::new(1, columns), vec![derive]);
    b.push(Statement::For("i".into(), Range::new(1, rows), vec![inner]));
    b.readable.push(Expr::at(id, vec![Expr::Number(rows as f64), Expr::Number(columns as f64)]));
}

/// Branches in a loop, decided by the iterator and by the run.
pub(super) fn branches(b: &mut Builder) {
    let n = b.random.between(3, 6);
    let id = b.array(Role::Algebraic, n as usize, None);
    let i = Expr::local("i");
    let one = |b: &mut Builder| {
        let term = b.bounded_with(1, &[Expr::local("i")]);
        vec![define(id, vec![Expr::local("i")], term)]
    };
    let inner = Statement::If(vec![(b.relation(), one(b))], one(b));
    let by = match b.random.below(3) {
        0 => Expr::binary(Operator::Less, i, Expr::Number(b.random.between(2, n) as f64)),
        1 => Expr::binary(Operator::Equal, Expr::call("mod", vec![i, Expr::Number(2.0)]), Expr::Number(0.0)),
        _ => Expr::binary(Operator::NotEqual, i, Expr::Number(2.0)),
    };
    let statement = Statement::If(vec![(by, one(b))], vec![inner]);
    b.push(Statement::For("i".into(), Range::new(1, n), vec![statement]));
    let element = b.element(id, n as usize);
    b.readable.push(element);
}

/// An array of Booleans, and how many are true.
pub(super) fn truths(b: &mut Builder) {
    let n = b.random.between(2, 4);
    let name = b.fresh("b");
    let id = b.model.add(Variable::new(name, Role::Algebraic).of(Kind::Boolean).sized(&[n as usize]));
    let i = Expr::local("i");
    let state = Expr::name(*b.random.pick(&b.states.clone()));
    let limit = Expr::Number(b.random.number(0.1, 0.3) + 0.0037) * i.clone() - Expr::Number(0.4);
    let relation = match b.random.below(2) {
        0 => Expr::binary(Operator::Greater, state, limit),
        _ => Expr::binary(Operator::GreaterEqual, Expr::Number(8.0) * Expr::Time, Expr::Number(2.0) * i.clone()),
    };
    b.push(Statement::For("i".into(), Range::new(1, n), vec![define(id, vec![i.clone()], relation)]));
    let name = b.fresh("k");
    let count = b.model.add(Variable::new(name, Role::Algebraic).of(Kind::Integer));
    let one = Expr::If(vec![(Expr::at(id, vec![i]), Expr::Number(1.0))], Box::new(Expr::Number(0.0)));
    b.push(define(count, Vec::new(), Expr::For(Some("sum"), Box::new(one), vec![("i".into(), Range::new(1, n))])));
    b.truths.push(Expr::at(id, vec![Expr::Number(n as f64)]));
    b.wholes.push(Expr::name(count));
    b.define(Expr::Number(0.2) * Expr::name(count) + Expr::Time);
}

/// States of an array that are set back one by one, and counters of it.
pub(super) fn jumps(b: &mut Builder) {
    let n = b.random.between(2, 3);
    let name = b.fresh("w");
    let x = b.model.add(Variable::new(name, Role::State).sized(&[n as usize]).starting(0.0));
    let name = b.fresh("k");
    let k = b.model.add(Variable::new(name, Role::Discrete).of(Kind::Integer).sized(&[n as usize]).starting(0.0));
    let i = Expr::local("i");
    let slope = Expr::Number(b.random.number(0.6, 1.1)) + Expr::Number(0.37) * i.clone();
    let derive = Statement::Derive(Target::Name(x, at(vec![i.clone()])), slope, Form::Plain);
    let trigger =
        Expr::binary(Operator::Greater, Expr::at(x, vec![i.clone()]), Expr::Number(b.random.number(0.5, 0.9) + 0.003));
    let count = Expr::Pre(k, at(vec![i.clone()])) + Expr::Number(1.0);
    let back = Expr::Number(-0.05) * Expr::at(k, vec![i.clone()]);
    let body = vec![define(k, vec![i.clone()], count), Statement::Reinit(Target::Name(x, at(vec![i])), back)];
    let when = Statement::When(vec![(vec![trigger], body)]);
    if b.random.once_in(2) {
        b.push(Statement::For("i".into(), Range::new(1, n), vec![derive, when]));
    } else {
        b.push(Statement::For("i".into(), Range::new(1, n), vec![derive]));
        b.push(Statement::For("i".into(), Range::new(1, n), vec![when]));
    }
    let last = Expr::Number(n as f64);
    b.readable.push(Expr::at(x, vec![last.clone()]));
    b.wholes.push(Expr::at(k, vec![last]));
}
