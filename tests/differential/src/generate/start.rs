//! Starts that initial equations determine: free parameters, states at rest.

use super::Builder;
use crate::model::{Expr, Form, Kind, Operator, Role, Start, Statement, Target, Variable};

impl Builder {
    /// Makes some starts unknown, with as many initial equations.
    pub(super) fn starts(&mut self) {
        if self.random.once_in(4) {
            self.at_rest();
        }
        if self.random.once_in(4) {
            self.free();
        }
        if self.random.once_in(6) {
            self.start_by_equation();
        }
    }

    /// A state whose derivative vanishes at the start, or has a value.
    fn at_rest(&mut self) {
        let name = self.fresh("x");
        let variable = Variable { start: 0.1, fixed: Start::Guess, ..Variable::new(name, Role::State) };
        let id = self.model.add(variable);
        let term = self.bounded(2);
        let rate = self.random.number(0.5, 3.0);
        let e = term - Expr::Number(rate) * Expr::name(id);
        self.push(Statement::Derive(Target::Name(id, Vec::new()), e, Form::Plain));
        let derivative = Expr::Der(Box::new(Expr::name(id)));
        let value = if self.random.once_in(2) { 0.0 } else { self.random.number(-0.5, 0.5) };
        self.model.initial.push((derivative, Expr::Number(value)));
    }

    /// A parameter that a condition on a state determines.
    fn free(&mut self) {
        let (name, state) = (self.fresh("g"), self.fresh("x"));
        let guess = self.random.number(0.5, 1.5);
        let variable = Variable { start: guess, fixed: Start::Guess, ..Variable::new(name, Role::Free) };
        let g = self.model.add(variable);
        let x = self.model.add(Variable::new(state, Role::State).starting(self.random.number(0.5, 1.5)));
        let term = self.bounded(1);
        let e = term - Expr::name(g) * Expr::name(x);
        self.push(Statement::Derive(Target::Name(x, Vec::new()), e, Form::Plain));
        match self.random.below(2) {
            0 => {
                let value = self.random.number(-1.0, 0.5);
                self.model.initial.push((Expr::Der(Box::new(Expr::name(x))), Expr::Number(value)));
            }
            _ => {
                let cubic = Expr::binary(Operator::Power, Expr::name(g), Expr::Number(3.0));
                let right = Expr::Number(self.random.number(0.5, 3.0));
                self.model.initial.push((Expr::name(g) + cubic, right));
            }
        }
        if self.random.once_in(2) {
            let condition = Expr::binary(Operator::Greater, Expr::name(g), Expr::Number(0.777));
            let (yes, no) = (self.bounded(1), self.bounded(1));
            let id = self.algebraic();
            let branch = |e| vec![Statement::Define(Target::Name(id, Vec::new()), e, Form::Plain)];
            self.push(Statement::If(vec![(condition, branch(yes))], branch(no)));
        }
        if self.random.once_in(2) {
            // What depends on a free parameter waits for it.
            self.define(Expr::Number(2.0) * Expr::name(g) + Expr::Time);
        }
        debug_assert!(self.model.variables[g].kind == Kind::Real);
    }

    /// A state whose start value an initial equation gives.
    fn start_by_equation(&mut self) {
        let name = self.fresh("x");
        let id = self.model.add(Variable { start: 0.2, fixed: Start::Guess, ..Variable::new(name, Role::State) });
        let term = self.bounded(2);
        self.push(Statement::Derive(Target::Name(id, Vec::new()), term - Expr::name(id), Form::Plain));
        let parameter = self.random.pick(&self.parameters.clone()).clone();
        let right = Expr::Number(1.5) * parameter;
        self.model.initial.push((Expr::name(id) + Expr::Number(0.2) * Expr::call("sin", vec![Expr::name(id)]), right));
    }
}
