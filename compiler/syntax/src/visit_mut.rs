//! Going through expressions, equations and statements of a tree in order to change them.
//!
//! The same walk as [`crate::visit`], with everything mutable: who renames or replaces overrides what it changes and calls the
//! `walk_..._mut` of the same name to go on inside.

use crate::tree::{
    Arguments, ComponentRef, Equation, EquationKind, Expr, ExprKind, Iterator, Statement, StatementKind,
};
use crate::visit::Role;

/// What is done at each place.
pub trait VisitorMut {
    /// A reference, its subscripts included.
    fn reference(&mut self, reference: &mut ComponentRef, role: Role) {
        let _ = role;
        walk_reference_mut(self, reference);
    }

    /// An expression.
    fn expr(&mut self, expr: &mut Expr) {
        walk_expr_mut(self, expr);
    }

    /// An equation.
    fn equation(&mut self, equation: &mut Equation) {
        walk_equation_mut(self, equation);
    }

    /// A statement.
    fn statement(&mut self, statement: &mut Statement) {
        walk_statement_mut(self, statement);
    }

    /// Loop variables that are visible until [`VisitorMut::leave`].
    fn enter(&mut self, iterators: &mut [Iterator]) {
        iterators.iter_mut().filter_map(|i| i.range.as_mut()).for_each(|e| self.expr(e));
    }

    /// The end of what was entered last.
    fn leave(&mut self, iterators: &mut [Iterator]) {
        let _ = iterators;
    }
}

/// The subscripts of a reference.
pub fn walk_reference_mut<V: VisitorMut + ?Sized>(visitor: &mut V, reference: &mut ComponentRef) {
    reference.parts.iter_mut().flat_map(|part| &mut part.subscripts).for_each(|e| visitor.expr(e));
}

/// The arguments of a call.
pub fn walk_arguments_mut<V: VisitorMut + ?Sized>(visitor: &mut V, arguments: &mut Arguments) {
    match arguments {
        Arguments::List { positional, named } => {
            positional.iter_mut().chain(named.iter_mut().map(|(_, e)| e)).for_each(|e| visitor.expr(e));
        }
        Arguments::Reduction(body, iterators) => {
            visitor.enter(iterators);
            visitor.expr(body);
            visitor.leave(iterators);
        }
    }
}

/// The parts of an expression.
pub fn walk_expr_mut<V: VisitorMut + ?Sized>(visitor: &mut V, expr: &mut Expr) {
    match &mut expr.kind {
        ExprKind::Ref(reference) => visitor.reference(reference, Role::Read),
        ExprKind::Call(function, arguments) => {
            visitor.reference(function, Role::Called);
            walk_arguments_mut(visitor, arguments);
        }
        ExprKind::Partial(_, given) => given.iter_mut().for_each(|(_, e)| visitor.expr(e)),
        ExprKind::Unary(_, a) | ExprKind::Field(a, _) => visitor.expr(a),
        ExprKind::Binary(_, a, b) => {
            visitor.expr(a);
            visitor.expr(b);
        }
        ExprKind::If(branches, otherwise) => {
            branches.iter_mut().flat_map(|(c, v)| [c, v]).for_each(|e| visitor.expr(e));
            visitor.expr(otherwise);
        }
        ExprKind::Range(a, step, b) => {
            visitor.expr(a);
            step.iter_mut().for_each(|e| visitor.expr(e));
            visitor.expr(b);
        }
        ExprKind::ArrayFor(body, iterators) => {
            visitor.enter(iterators);
            visitor.expr(body);
            visitor.leave(iterators);
        }
        ExprKind::Array(items) => items.iter_mut().for_each(|e| visitor.expr(e)),
        ExprKind::Matrix(rows) => rows.iter_mut().flatten().for_each(|e| visitor.expr(e)),
        ExprKind::Tuple(items) => items.iter_mut().flatten().for_each(|e| visitor.expr(e)),
        ExprKind::Integer(_)
        | ExprKind::Real(_)
        | ExprKind::Text(_)
        | ExprKind::Boolean(_)
        | ExprKind::Colon
        | ExprKind::End => {}
    }
}

/// The parts of an equation.
pub fn walk_equation_mut<V: VisitorMut + ?Sized>(visitor: &mut V, equation: &mut Equation) {
    match &mut equation.kind {
        EquationKind::Equal(a, b) => {
            visitor.expr(a);
            visitor.expr(b);
        }
        EquationKind::Connect(a, b) => {
            visitor.reference(a, Role::Connected);
            visitor.reference(b, Role::Connected);
        }
        EquationKind::For(iterators, body) => {
            visitor.enter(iterators);
            body.iter_mut().for_each(|e| visitor.equation(e));
            visitor.leave(iterators);
        }
        EquationKind::If(branches) => {
            for (condition, body) in branches {
                condition.iter_mut().for_each(|e| visitor.expr(e));
                body.iter_mut().for_each(|e| visitor.equation(e));
            }
        }
        EquationKind::When(branches) => {
            for (condition, body) in branches {
                visitor.expr(condition);
                body.iter_mut().for_each(|e| visitor.equation(e));
            }
        }
        EquationKind::Call(function, arguments) => {
            visitor.reference(function, Role::Called);
            walk_arguments_mut(visitor, arguments);
        }
    }
}

/// The parts of a statement.
pub fn walk_statement_mut<V: VisitorMut + ?Sized>(visitor: &mut V, statement: &mut Statement) {
    let all = |visitor: &mut V, body: &mut [Statement]| body.iter_mut().for_each(|s| visitor.statement(s));
    match &mut statement.kind {
        StatementKind::Assign(target, value) => {
            visitor.reference(target, Role::Assigned);
            visitor.expr(value);
        }
        StatementKind::AssignTuple(targets, function, arguments) => {
            targets.iter_mut().flatten().for_each(|target| visitor.reference(target, Role::Taken));
            visitor.reference(function, Role::Called);
            walk_arguments_mut(visitor, arguments);
        }
        StatementKind::Call(function, arguments) => {
            visitor.reference(function, Role::Called);
            walk_arguments_mut(visitor, arguments);
        }
        StatementKind::If(branches) => {
            for (condition, body) in branches {
                condition.iter_mut().for_each(|e| visitor.expr(e));
                all(visitor, body);
            }
        }
        StatementKind::For(iterators, body) => {
            visitor.enter(iterators);
            all(visitor, body);
            visitor.leave(iterators);
        }
        StatementKind::While(condition, body) => {
            visitor.expr(condition);
            all(visitor, body);
        }
        StatementKind::When(branches) => {
            for (condition, body) in branches {
                visitor.expr(condition);
                all(visitor, body);
            }
        }
        StatementKind::Break | StatementKind::Return => {}
    }
}
