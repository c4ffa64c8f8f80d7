//! Algebraic loops, diagonally dominant.

use super::Builder;
use crate::model::{Equation, Expr, Operator, Range, Role, Statement, Variable};

/// Two or three scalars that need each other.
pub(super) fn pair(b: &mut Builder) {
    let n = b.random.between(2, 3) as usize;
    let unknowns: Vec<usize> = (0..n).map(|_| b.algebraic()).collect();
    let mut equations = Vec::new();
    for k in 0..n {
        let (itself, other) = (Expr::name(unknowns[k]), Expr::name(unknowns[(k + 1) % n]));
        let coupling = match b.random.below(3) {
            0 => Expr::Number(0.4) * other,
            1 => Expr::Number(0.3) * Expr::call("tanh", vec![other]),
            _ => Expr::Number(0.3) * Expr::call("sin", vec![other]),
        };
        let right = b.bounded(2);
        let equation = match b.random.below(3) {
            0 => Equation::Plain(itself + coupling, right),
            1 => Equation::Plain(right - coupling, Expr::Number(1.5) * itself),
            _ => {
                let cubic = Expr::binary(Operator::Power, itself.clone(), Expr::Number(3.0));
                Equation::Plain(itself + Expr::Number(0.2) * cubic, coupling + right)
            }
        };
        equations.push(equation);
    }
    b.push(Statement::Implicit(unknowns.clone(), equations));
    b.readable.extend(unknowns.into_iter().map(Expr::name));
}

/// An array whose elements need their neighbours.
pub(super) fn chain(b: &mut Builder) {
    let n = b.random.between(3, 6);
    let name = b.fresh("c");
    let id = b.model.add(Variable::new(name, Role::Algebraic).sized(&[n as usize]));
    let i = Expr::local("i");
    let near = |by: f64| Expr::at(id, vec![Expr::local("i") + Expr::Number(by)]);
    let before = Expr::at(id, vec![Expr::local("i") - Expr::Number(1.0)]);
    let ends = [1.0, n as f64];
    let term = b.bounded_with(1, std::slice::from_ref(&i));
    let inner = Equation::Plain(Expr::Number(3.0) * Expr::at(id, vec![i]) - before - near(1.0), term);
    let mut equations = vec![Equation::Loop("i".into(), Range::new(2, n - 1), vec![inner])];
    for (k, end) in ends.into_iter().enumerate() {
        let neighbour = if k == 0 { 2.0 } else { end - 1.0 };
        let right = b.bounded(1);
        let left = Expr::Number(2.5) * Expr::at(id, vec![Expr::Number(end)]);
        equations.push(Equation::Plain(left, Expr::at(id, vec![Expr::Number(neighbour)]) + right));
    }
    b.push(Statement::Implicit(vec![id], equations));
    b.readable.push(Expr::at(id, vec![Expr::Number(2.0)]));
}

/// A loop through the derivative of a state: the equations give it together with a scalar.
pub(super) fn mixed(b: &mut Builder) {
    let (y, z) = (b.algebraic(), b.algebraic());
    let state = Expr::name(*b.random.pick(&b.states.clone()));
    let term = b.bounded(2);
    let equations = vec![
        Equation::Plain(Expr::name(y) + Expr::name(z), Expr::Number(2.0) * state),
        Equation::Plain(Expr::name(y) - Expr::Number(0.5) * Expr::call("atan", vec![Expr::name(z)]), term),
    ];
    b.push(Statement::Implicit(vec![y, z], equations));
    b.readable.extend([Expr::name(y), Expr::name(z)]);
}
