//! Functions: formulas, loops, what only the run decides, recursion, arrays, several outputs.

use super::Builder;
use crate::model::{
    Expr, Function, Kind, Local, Operator, Range, Role, Statement, Step, Subscript, Target, Type, Variable,
};

/// A Real variable of a function.
pub(super) fn real(name: &str) -> Local {
    Local { name: name.into(), kind: Type::Of(Kind::Real), sizes: Vec::new(), value: None }
}

/// An Integer variable of a function.
pub(super) fn whole(name: &str) -> Local {
    Local { kind: Type::Of(Kind::Integer), ..real(name) }
}

/// An assignment.
pub(super) fn set(name: &str, e: Expr) -> Step {
    Step::Assign(Target::Local(name.into(), Vec::new()), e)
}

fn less(a: Expr, b: Expr) -> Expr {
    Expr::binary(Operator::Less, a, b)
}

impl Builder {
    /// A term over the variables of a function alone.
    pub(super) fn inside(&mut self, depth: usize, names: &[&str]) -> Expr {
        let outside = std::mem::replace(&mut self.readable, names.iter().map(|n| Expr::local(n)).collect());
        let term = self.bounded(depth);
        self.readable = outside;
        term
    }

    /// Adds a function.
    pub(super) fn function(
        &mut self,
        inputs: Vec<Local>,
        outputs: Vec<Local>,
        locals: Vec<Local>,
        body: Vec<Step>,
    ) -> String {
        let name = self.fresh("f");
        self.model.functions.push(Function { name: name.clone(), inputs, outputs, locals, body });
        name
    }

    fn called(&mut self, name: String, arguments: Vec<Expr>) {
        let id = self.define(Expr::Call(name.clone(), arguments.clone()));
        if self.random.once_in(3) {
            // Differentiated, and with a state alone.
            let state = Expr::name(*self.random.pick(&self.states.clone()));
            let mut arguments = arguments;
            if let Some(first) = arguments.first_mut() {
                *first = state;
            }
            let rate = self.algebraic();
            let plain = arguments.iter().skip(1).all(|e| matches!(e, Expr::Number(_)));
            let e = if plain { Expr::Der(Box::new(Expr::Call(name, arguments))) } else { Expr::name(id) };
            self.push(Statement::Define(Target::Name(rate, Vec::new()), e, crate::model::Form::Plain));
        }
    }
}

/// Assignments one after the other, with a branch that joins smoothly.
pub(super) fn formula(b: &mut Builder) {
    let first = b.inside(2, &["u", "v"]);
    let second = b.inside(1, &["u", "t"]);
    let mut body = vec![set("t", first), set("y", Expr::local("t") * second)];
    if b.random.once_in(2) {
        // The value and the slope of both branches agree.
        let square = Expr::binary(Operator::Power, Expr::local("t"), Expr::Number(3.0));
        let branch = set("y", Expr::local("y") + square);
        body.push(Step::If(vec![(less(Expr::Number(0.0), Expr::local("t")), vec![branch])], Vec::new()));
    }
    let mut v = real("v");
    let default = b.random.once_in(2);
    v.value = default.then_some(Expr::Number(0.7));
    let name = b.function(vec![real("u"), v], vec![real("y")], vec![real("t")], body);
    let mut arguments = vec![b.term(1)];
    if !default || b.random.once_in(2) {
        arguments.push(b.bounded(1));
    }
    b.called(name, arguments);
}

/// Loops with known ends, nested, with `break` and `return` that the arguments decide.
pub(super) fn accumulation(b: &mut Builder) {
    let i = Expr::local("i");
    let term = b.inside(2, &["u", "i"]);
    let add = set("y", Expr::local("y") + term / (i.clone() + Expr::Number(1.0)));
    let mut turn = vec![add];
    let limit = b.random.between(2, 5) as f64;
    match b.random.below(5) {
        0 => turn.insert(0, Step::If(vec![(less(Expr::Number(limit), i), vec![Step::Break])], Vec::new())),
        1 => turn.push(Step::If(vec![(less(Expr::Number(limit), i), vec![Step::Return])], Vec::new())),
        2 => {
            let inner = set("y", Expr::local("y") + Expr::Number(0.1) * Expr::call("sin", vec![i * Expr::local("j")]));
            turn.push(Step::For("j".into(), Range { to: Expr::local("i"), ..Range::new(1, 1) }, vec![inner]));
        }
        3 => {
            let odd = Expr::binary(Operator::Equal, Expr::call("mod", vec![i, Expr::Number(2.0)]), Expr::Number(1.0));
            turn.push(Step::If(vec![(odd, vec![set("y", Expr::Number(0.5) * Expr::local("y"))])], Vec::new()));
        }
        _ => {}
    }
    let range = match b.random.below(3) {
        0 => Range { step: Some(2), ..Range::new(1, b.random.between(4, 9)) },
        1 => Range { step: Some(-1), ..Range::new(b.random.between(3, 7), 1) },
        _ => Range { to: Expr::local("n"), ..Range::new(1, 1) },
    };
    let body = vec![set("y", Expr::Number(0.0)), Step::For("i".into(), range, turn)];
    let name = b.function(vec![real("u"), whole("n")], vec![real("y")], Vec::new(), body);
    let u = b.term(1);
    let n = b.random.between(1, 7) as f64;
    b.called(name, vec![u, Expr::Number(n)]);
}

/// A loop until it has converged: its turns depend on the run, its result is smooth.
pub(super) fn iteration(b: &mut Builder) {
    let (x, a) = (Expr::local("x"), Expr::local("a"));
    let square = x.clone() * x.clone() - a.clone();
    let near = Expr::binary(Operator::Greater, Expr::call("abs", vec![square]), Expr::Number(1e-12) * a.clone());
    let better = (x.clone() + a.clone() / x) / Expr::Number(2.0);
    let mut turn = vec![set("x", better)];
    if b.random.once_in(2) {
        turn.push(set("k", Expr::local("k") + Expr::Number(1.0)));
        let enough = Expr::binary(Operator::Greater, Expr::local("k"), Expr::Number(30.0));
        turn.push(Step::If(vec![(enough, vec![Step::Break])], Vec::new()));
    }
    let mut body = vec![
        set("a", Expr::Number(1.0) + Expr::local("u") * Expr::local("u")),
        set("k", Expr::Number(0.0)),
        set("x", Expr::Number(1.0)),
        Step::While(near, turn),
    ];
    let line = Expr::call("linspace", vec![Expr::local("u"), Expr::Number(3.0), Expr::Number(4.0)]);
    body.push(set("x", Expr::local("x") + Expr::Number(0.1) * Expr::call("sum", vec![line])));
    let name = b.function(vec![real("u")], vec![real("x")], vec![real("a"), whole("k")], body);
    let u = b.term(1);
    b.called(name, vec![u]);
}

/// A function that calls itself.
pub(super) fn recursion(b: &mut Builder) {
    let n = Expr::local("n");
    let name = format!("f{}", b.serial + 1);
    let again = Expr::Call(name, vec![Expr::call("sin", vec![Expr::local("u")]), n.clone() - Expr::Number(1.0)]);
    let end = less(n.clone(), Expr::Number(1.0));
    let term = b.inside(1, &["u", "n"]);
    let branch = vec![set("y", Expr::local("u"))];
    let other = vec![set("y", Expr::Number(0.5) * again + term)];
    let body = vec![Step::If(vec![(end, branch)], other)];
    let name = b.function(vec![real("u"), whole("n")], vec![real("y")], Vec::new(), body);
    let u = b.term(1);
    let depth = b.random.between(0, 5) as f64;
    b.called(name, vec![u, Expr::Number(depth)]);
}

/// Two outputs, called as a tuple, also from another function.
pub(super) fn several(b: &mut Builder) {
    let (first, second) = (b.inside(2, &["u", "v"]), b.inside(1, &["v", "y"]));
    let body = vec![set("y", first), set("z", second + Expr::local("u"))];
    let mut name = b.function(vec![real("u"), real("v")], vec![real("y"), real("z")], Vec::new(), body);
    if b.random.once_in(2) {
        let call = Expr::Call(name, vec![Expr::local("v"), Expr::Number(0.5) * Expr::local("u")]);
        let targets = vec![Target::Local("z".into(), Vec::new()), Target::Local("w".into(), Vec::new())];
        let body = vec![Step::Tuple(targets, call), set("y", Expr::local("w") - Expr::local("z"))];
        name = b.function(vec![real("u"), real("v")], vec![real("y"), real("z")], vec![real("w")], body);
    }
    let (y, z) = (b.algebraic(), b.algebraic());
    let arguments = vec![b.bounded(1), b.bounded(1)];
    let targets = vec![Target::Name(y, Vec::new()), Target::Name(z, Vec::new())];
    b.push(Statement::Tuple(targets, Expr::Call(name, arguments)));
    b.readable.extend([Expr::name(y), Expr::name(z)]);
}

/// Arrays in and out, subscripts that a loop computes.
pub(super) fn vectors(b: &mut Builder) {
    let n = b.random.between(2, 5) as usize;
    let i = Expr::local("i");
    let element = |name: &str, k: Expr| Expr::Local(name.into(), vec![Subscript::At(k)]);
    let size = Expr::call("size", vec![Expr::local("v"), Expr::Number(1.0)]);
    let mirrored = element("v", size.clone() + Expr::Number(1.0) - i.clone());
    let e = match b.random.below(3) {
        0 => Expr::Number(0.5) * mirrored + element("v", i.clone()),
        1 => Expr::call("sum", vec![Expr::local("v")]) * i.clone() - mirrored,
        _ => Expr::call("sin", vec![element("v", i.clone())]) + element("w", i.clone()),
    };
    let to = Range { to: size, ..Range::new(1, 1) };
    let body = vec![
        Step::Assign(Target::Local("w".into(), Vec::new()), Expr::Number(2.0) * Expr::local("v")),
        Step::For("i".into(), to, vec![Step::Assign(Target::Local("w".into(), vec![Subscript::At(i)]), e)]),
    ];
    let v = Local { sizes: vec![None], ..real("v") };
    let w = Local { sizes: vec![Some(n)], ..real("w") };
    let name = b.function(vec![v], vec![w], Vec::new(), body);
    let elements = Expr::Array((0..n).map(|_| b.bounded(1)).collect());
    let id = {
        let name = b.fresh("a");
        b.model.add(Variable::new(name, Role::Algebraic).sized(&[n]))
    };
    let call = Expr::Call(name, vec![elements]);
    if b.random.once_in(2) {
        b.push(Statement::Declare(id, call));
    } else {
        b.push(Statement::Define(Target::Name(id, Vec::new()), call, crate::model::Form::Plain));
    }
    b.readable.push(Expr::at(id, vec![Expr::Number(n as f64)]));
}
