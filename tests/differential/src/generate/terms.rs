//! Random expressions.

use super::Builder;
use crate::model::{Expr, Operator};

impl Builder {
    fn leaf(&mut self, more: &[Expr]) -> Expr {
        if !more.is_empty() && self.random.once_in(2) {
            return self.random.pick(more).clone();
        }
        match self.random.below(4) {
            0 => Expr::Number(self.random.number(-2.0, 2.0)),
            _ => self.random.pick(&self.readable).clone(),
        }
    }

    /// A smooth expression of any size, which reads what is readable and what is given.
    pub(super) fn term_with(&mut self, depth: usize, more: &[Expr]) -> Expr {
        if depth == 0 {
            return self.leaf(more);
        }
        let one = |b: &mut Self| b.term_with(depth - 1, more);
        match self.random.below(14) {
            0 | 1 => self.leaf(more),
            2..=4 => one(self) + one(self),
            5 => one(self) - one(self),
            6 => Expr::Minus(Box::new(one(self))),
            7 | 8 => {
                let a = Expr::call("tanh", vec![one(self)]);
                a * one(self)
            }
            9 => {
                let b = self.leaf(more);
                one(self) / (Expr::Number(1.5) + Expr::binary(Operator::Power, b, Expr::Number(2.0)))
            }
            10 => Expr::binary(Operator::Power, Expr::call("sin", vec![one(self)]), Expr::Number(2.0)),
            11 => {
                let square = Expr::binary(Operator::Power, one(self), Expr::Number(2.0));
                match self.random.below(3) {
                    0 => Expr::call("exp", vec![Expr::Minus(Box::new(square))]),
                    1 => Expr::call("sqrt", vec![Expr::Number(1.0) + square]),
                    _ => Expr::call("log", vec![Expr::Number(2.0) + square]),
                }
            }
            12 => {
                let name = *self.random.pick(&["sin", "cos", "tanh", "atan"]);
                Expr::call(name, vec![one(self)])
            }
            _ => {
                let (y, x) = (one(self), self.leaf(more));
                let x = Expr::Number(1.2) + Expr::binary(Operator::Power, x, Expr::Number(2.0));
                Expr::call("atan2", vec![y, x])
            }
        }
    }

    /// A smooth expression.
    pub(super) fn term(&mut self, depth: usize) -> Expr {
        self.term_with(depth, &[])
    }

    /// A smooth expression between -1 and 1.
    pub(super) fn bounded_with(&mut self, depth: usize, more: &[Expr]) -> Expr {
        let name = *self.random.pick(&["sin", "cos", "tanh"]);
        let term = self.term_with(depth, more);
        Expr::call(name, vec![term])
    }

    /// The same without more to read.
    pub(super) fn bounded(&mut self, depth: usize) -> Expr {
        self.bounded_with(depth, &[])
    }

    /// A relation that changes during the run, or may.
    pub(super) fn relation(&mut self) -> Expr {
        let operator = *self.random.pick(&Operator::ORDERS);
        if self.random.once_in(4) {
            return Expr::binary(Operator::Greater, Expr::Time, Expr::Number(0.0));
        }
        if self.random.once_in(4) {
            let k = Expr::local("k");
            let term = k.clone() * self.random.pick(&self.parameters.clone()).clone() * Expr::Time;
            let sum = Expr::For(Some("sum"), Box::new(term), vec![("k".into(), crate::model::Range::new(1, 3))]);
            return Expr::binary(Operator::LessEqual, sum, Expr::Number(2.003));
        }
        if self.random.once_in(2) {
            let limit = Expr::Number(self.instant());
            // What changes right after its instant takes part as `time > 0`.
            let operator = if self.random.once_in(2) { Operator::GreaterEqual } else { Operator::Less };
            return match self.random.below(3) {
                0 if operator == Operator::GreaterEqual => Expr::binary(Operator::LessEqual, limit, Expr::Time),
                _ => Expr::binary(operator, Expr::Time, limit),
            };
        }
        let state = Expr::name(*self.random.pick(&self.states.clone()));
        let limit = Expr::Number(self.random.number(-0.8, 0.8) + 0.003);
        match self.random.below(3) {
            0 => Expr::binary(operator, limit, state),
            1 => Expr::binary(operator, state - Expr::call("sin", vec![Expr::Number(3.0) * Expr::Time]), limit),
            _ => Expr::binary(operator, state, limit),
        }
    }
}
