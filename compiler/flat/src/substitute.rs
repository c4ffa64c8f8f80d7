//! Equations with a number in place of a loop variable.
//!
//! Needed where what there is depends on the loop (a connection for all but the first), so that the loop must be written out
//! before anything is lowered.  A loop inside that has a variable of the same name hides it.

use hyd_syntax::tree::{Arguments, ComponentRef, Equation, EquationKind, Expr, ExprKind, Iterator, Name, UnaryOp};

/// A part of the text in which names can be replaced.
pub trait Part: Clone {
    /// Replaces `name` by the number, in place.
    fn replace(&mut self, name: &Name, value: i64);
}

/// A copy with the number in place of the name.
pub fn with_value<P: Part>(part: &P, name: &Name, value: i64) -> P {
    let mut copy = part.clone();
    copy.replace(name, value);
    copy
}

/// True if the name stands in the expression, not hidden.
pub fn mentions(expr: &Expr, name: &Name) -> bool {
    crate::walk::any_ref(expr, &mut |reference| is_name(reference, name))
}

fn is_name(reference: &ComponentRef, name: &Name) -> bool {
    !reference.global && reference.parts.len() == 1 && reference.parts[0].name.name == *name
}

impl Part for Expr {
    fn replace(&mut self, name: &Name, value: i64) {
        match &mut self.kind {
            ExprKind::Ref(reference) if is_name(reference, name) => {
                self.kind = number(value, self.span);
            }
            ExprKind::Ref(reference) => reference.replace(name, value),
            ExprKind::Call(function, arguments) => {
                function.replace(name, value);
                arguments.replace(name, value);
            }
            ExprKind::Unary(_, a) | ExprKind::Field(a, _) => a.replace(name, value),
            ExprKind::Binary(_, a, b) => {
                a.replace(name, value);
                b.replace(name, value);
            }
            ExprKind::If(branches, otherwise) => {
                for (condition, inner) in branches {
                    condition.replace(name, value);
                    inner.replace(name, value);
                }
                otherwise.replace(name, value);
            }
            ExprKind::Range(a, step, b) => {
                a.replace(name, value);
                step.iter_mut().for_each(|e| e.replace(name, value));
                b.replace(name, value);
            }
            ExprKind::Array(items) => items.iter_mut().for_each(|e| e.replace(name, value)),
            ExprKind::ArrayFor(body, iterators) => replace_inside(body.as_mut(), iterators, name, value),
            ExprKind::Matrix(rows) => rows.iter_mut().flatten().for_each(|e| e.replace(name, value)),
            ExprKind::Tuple(items) => items.iter_mut().flatten().for_each(|e| e.replace(name, value)),
            ExprKind::Integer(_)
            | ExprKind::Real(_)
            | ExprKind::Text(_)
            | ExprKind::Boolean(_)
            | ExprKind::Colon
            | ExprKind::End => {}
        }
    }
}

impl Part for ComponentRef {
    fn replace(&mut self, name: &Name, value: i64) {
        self.parts.iter_mut().flat_map(|part| &mut part.subscripts).for_each(|e| e.replace(name, value));
    }
}

impl Part for Iterator {
    fn replace(&mut self, name: &Name, value: i64) {
        self.range.iter_mut().for_each(|e| e.replace(name, value));
    }
}

impl Part for Arguments {
    fn replace(&mut self, name: &Name, value: i64) {
        match self {
            Arguments::List { positional, named } => {
                positional.iter_mut().chain(named.iter_mut().map(|(_, e)| e)).for_each(|e| e.replace(name, value));
            }
            Arguments::Reduction(body, iterators) => replace_inside(body.as_mut(), iterators, name, value),
        }
    }
}

impl Part for Equation {
    fn replace(&mut self, name: &Name, value: i64) {
        match &mut self.kind {
            EquationKind::Equal(a, b) => {
                a.replace(name, value);
                b.replace(name, value);
            }
            EquationKind::Connect(a, b) => {
                a.replace(name, value);
                b.replace(name, value);
            }
            EquationKind::For(iterators, body) => {
                iterators.iter_mut().for_each(|i| i.replace(name, value));
                if !iterators.iter().any(|i| i.name.name == *name) {
                    body.iter_mut().for_each(|e| e.replace(name, value));
                }
            }
            EquationKind::If(branches) => {
                for (condition, body) in branches {
                    condition.iter_mut().for_each(|e| e.replace(name, value));
                    body.iter_mut().for_each(|e| e.replace(name, value));
                }
            }
            EquationKind::When(branches) => {
                for (condition, body) in branches {
                    condition.replace(name, value);
                    body.iter_mut().for_each(|e| e.replace(name, value));
                }
            }
            EquationKind::Call(function, arguments) => {
                function.replace(name, value);
                arguments.replace(name, value);
            }
        }
    }
}

/// Replaces in the ranges, and in the body unless an iterator hides the name.
fn replace_inside(body: &mut Expr, iterators: &mut [Iterator], name: &Name, value: i64) {
    iterators.iter_mut().for_each(|i| i.replace(name, value));
    if !iterators.iter().any(|i| i.name.name == *name) {
        body.replace(name, value);
    }
}

fn number(value: i64, span: hyd_source::Span) -> ExprKind {
    let magnitude = ExprKind::Integer(value.saturating_abs());
    if value >= 0 { magnitude } else { ExprKind::Unary(UnaryOp::Minus, Box::new(Expr { kind: magnitude, span })) }
}
