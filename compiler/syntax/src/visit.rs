//! Going through expressions, equations and statements of a tree: one walk for all who look for something in them.
//!
//! A [`Visitor`] overrides what it wants to know of and calls the `walk_...` of the same name to go on inside.  Loop variables
//! are announced by [`Visitor::enter`] before the text they are visible in and taken back by [`Visitor::leave`] (Modelica 3.6,
//! sections 10.3.4.1 and 11.2.2).  [`crate::visit_mut`] does the same with the right to change things.

use crate::tree::{
    Arguments, ComponentRef, Equation, EquationKind, Expr, ExprKind, Iterator, Statement, StatementKind,
};

/// What a reference is there for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Role {
    /// Its value is read.
    Read,
    /// It names what is called.
    Called,
    /// The left side of `:=`.
    Assigned,
    /// One of several left sides of `(a, b) := f()`.
    Taken,
    /// An end of a connection.
    Connected,
}

/// What is done at each place.
pub trait Visitor {
    /// A reference, its subscripts included.
    fn reference(&mut self, reference: &ComponentRef, role: Role) {
        let _ = role;
        walk_reference(self, reference);
    }

    /// An expression.
    fn expr(&mut self, expr: &Expr) {
        walk_expr(self, expr);
    }

    /// An equation.
    fn equation(&mut self, equation: &Equation) {
        walk_equation(self, equation);
    }

    /// A statement.
    fn statement(&mut self, statement: &Statement) {
        walk_statement(self, statement);
    }

    /// Loop variables that are visible until [`Visitor::leave`].
    fn enter(&mut self, iterators: &[Iterator]) {
        iterators.iter().filter_map(|i| i.range.as_ref()).for_each(|e| self.expr(e));
    }

    /// The end of what was entered last.
    fn leave(&mut self, iterators: &[Iterator]) {
        let _ = iterators;
    }
}

/// The subscripts of a reference.
pub fn walk_reference<V: Visitor + ?Sized>(visitor: &mut V, reference: &ComponentRef) {
    reference.parts.iter().flat_map(|part| &part.subscripts).for_each(|e| visitor.expr(e));
}

/// The arguments of a call.
pub fn walk_arguments<V: Visitor + ?Sized>(visitor: &mut V, arguments: &Arguments) {
    match arguments {
        Arguments::List { positional, named } => {
            positional.iter().chain(named.iter().map(|(_, e)| e)).for_each(|e| visitor.expr(e));
        }
        Arguments::Reduction(body, iterators) => {
            visitor.enter(iterators);
            visitor.expr(body);
            visitor.leave(iterators);
        }
    }
}

/// The parts of an expression.
pub fn walk_expr<V: Visitor + ?Sized>(visitor: &mut V, expr: &Expr) {
    match &expr.kind {
        ExprKind::Ref(reference) => visitor.reference(reference, Role::Read),
        ExprKind::Call(function, arguments) => {
            visitor.reference(function, Role::Called);
            walk_arguments(visitor, arguments);
        }
        ExprKind::Partial(function, given) => {
            visitor.reference(function, Role::Called);
            given.iter().for_each(|(_, e)| visitor.expr(e));
        }
        ExprKind::Unary(_, a) | ExprKind::Field(a, _) => visitor.expr(a),
        ExprKind::Binary(_, a, b) => {
            visitor.expr(a);
            visitor.expr(b);
        }
        ExprKind::If(branches, otherwise) => {
            branches.iter().flat_map(|(c, v)| [c, v]).for_each(|e| visitor.expr(e));
            visitor.expr(otherwise);
        }
        ExprKind::Range(a, step, b) => {
            visitor.expr(a);
            step.iter().for_each(|e| visitor.expr(e));
            visitor.expr(b);
        }
        ExprKind::ArrayFor(body, iterators) => {
            visitor.enter(iterators);
            visitor.expr(body);
            visitor.leave(iterators);
        }
        ExprKind::Array(items) => items.iter().for_each(|e| visitor.expr(e)),
        ExprKind::Matrix(rows) => rows.iter().flatten().for_each(|e| visitor.expr(e)),
        ExprKind::Tuple(items) => items.iter().flatten().for_each(|e| visitor.expr(e)),
        ExprKind::Integer(_)
        | ExprKind::Real(_)
        | ExprKind::Text(_)
        | ExprKind::Boolean(_)
        | ExprKind::Colon
        | ExprKind::End => {}
    }
}

/// The parts of an equation.
pub fn walk_equation<V: Visitor + ?Sized>(visitor: &mut V, equation: &Equation) {
    match &equation.kind {
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
            body.iter().for_each(|e| visitor.equation(e));
            visitor.leave(iterators);
        }
        EquationKind::If(branches) => {
            for (condition, body) in branches {
                condition.iter().for_each(|e| visitor.expr(e));
                body.iter().for_each(|e| visitor.equation(e));
            }
        }
        EquationKind::When(branches) => {
            for (condition, body) in branches {
                visitor.expr(condition);
                body.iter().for_each(|e| visitor.equation(e));
            }
        }
        EquationKind::Call(function, arguments) => {
            visitor.reference(function, Role::Called);
            walk_arguments(visitor, arguments);
        }
    }
}

/// The parts of a statement.
pub fn walk_statement<V: Visitor + ?Sized>(visitor: &mut V, statement: &Statement) {
    let all = |visitor: &mut V, body: &[Statement]| body.iter().for_each(|s| visitor.statement(s));
    match &statement.kind {
        StatementKind::Assign(target, value) => {
            visitor.reference(target, Role::Assigned);
            visitor.expr(value);
        }
        StatementKind::AssignTuple(targets, function, arguments) => {
            targets.iter().flatten().for_each(|target| visitor.reference(target, Role::Taken));
            visitor.reference(function, Role::Called);
            walk_arguments(visitor, arguments);
        }
        StatementKind::Call(function, arguments) => {
            visitor.reference(function, Role::Called);
            walk_arguments(visitor, arguments);
        }
        StatementKind::If(branches) => {
            for (condition, body) in branches {
                condition.iter().for_each(|e| visitor.expr(e));
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
