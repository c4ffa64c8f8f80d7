//! Names of a statement replaced by others, apart from its own loop variables.

use hyd_syntax::tree::{
    Arguments, ComponentRef, Expr, ExprKind, Ident, Iterator, Name, RefPart, Statement, StatementKind,
};

/// What can get another name.
pub enum Found<'a> {
    /// A reference, read or set; its last subscripts stay.  The names are loop variables of the statement.
    Reference(&'a ComponentRef, bool, &'a [Name]),
    /// A call of an operator that speaks of events or derivatives.
    Operator(&'a Expr),
}

/// Operators whose value belongs to the model, not to the statement.
const OPERATORS: [&str; 9] = ["pre", "edge", "change", "initial", "terminal", "sample", "der", "delay", "homotopy"];

/// Asks `name` for the new name of everything found; `None` leaves it as it is.
pub fn rename(statement: &mut Statement, name: &mut dyn FnMut(Found<'_>) -> Option<Name>) {
    Renaming { name, hidden: Vec::new() }.statement(statement);
}

struct Renaming<'f> {
    name: &'f mut dyn FnMut(Found<'_>) -> Option<Name>,
    hidden: Vec<Name>,
}

impl Renaming<'_> {
    fn statements(&mut self, statements: &mut [Statement]) {
        statements.iter_mut().for_each(|statement| self.statement(statement));
    }

    fn statement(&mut self, statement: &mut Statement) {
        match &mut statement.kind {
            StatementKind::Assign(target, value) => {
                self.reference(target, true);
                self.expr(value);
            }
            StatementKind::AssignTuple(targets, _, arguments) => {
                targets.iter_mut().flatten().for_each(|target| self.reference(target, true));
                self.arguments(arguments);
            }
            StatementKind::Call(_, arguments) => self.arguments(arguments),
            StatementKind::If(branches) => {
                for (condition, body) in branches {
                    condition.iter_mut().for_each(|e| self.expr(e));
                    self.statements(body);
                }
            }
            StatementKind::For(iterators, body) => self.inside(iterators, |renaming| renaming.statements(body)),
            StatementKind::While(condition, body) => {
                self.expr(condition);
                self.statements(body);
            }
            StatementKind::When(branches) => {
                for (condition, body) in branches {
                    self.expr(condition);
                    self.statements(body);
                }
            }
            StatementKind::Break | StatementKind::Return => {}
        }
    }

    fn inside(&mut self, iterators: &mut [Iterator], body: impl FnOnce(&mut Self)) {
        let mark = self.hidden.len();
        for iterator in iterators {
            iterator.range.iter_mut().for_each(|e| self.expr(e));
            self.hidden.push(iterator.name.name.clone());
        }
        body(self);
        self.hidden.truncate(mark);
    }

    fn reference(&mut self, reference: &mut ComponentRef, set: bool) {
        let own = !reference.global && self.hidden.contains(&reference.parts[0].name.name);
        if !own && let Some(name) = (self.name)(Found::Reference(reference, set, &self.hidden)) {
            let last = reference.parts.pop();
            let subscripts = last.map(|part| part.subscripts).unwrap_or_default();
            reference.global = false;
            reference.parts = vec![RefPart { name: Ident { name, span: reference.span }, subscripts }];
        }
        reference.parts.iter_mut().flat_map(|part| &mut part.subscripts).for_each(|e| self.expr(e));
    }

    fn arguments(&mut self, arguments: &mut Arguments) {
        match arguments {
            Arguments::List { positional, named } => {
                positional.iter_mut().chain(named.iter_mut().map(|(_, e)| e)).for_each(|e| self.expr(e));
            }
            Arguments::Reduction(body, iterators) => self.inside(iterators, |renaming| renaming.expr(body)),
        }
    }

    fn expr(&mut self, expr: &mut Expr) {
        if let ExprKind::Call(function, _) = &expr.kind
            && function.parts.len() == 1
            && OPERATORS.contains(&function.parts[0].name.name.as_ref())
            && let Some(name) = (self.name)(Found::Operator(expr))
        {
            let part = RefPart { name: Ident { name, span: expr.span }, subscripts: Vec::new() };
            expr.kind = ExprKind::Ref(ComponentRef { global: false, parts: vec![part], span: expr.span });
            return;
        }
        match &mut expr.kind {
            ExprKind::Ref(reference) => self.reference(reference, false),
            ExprKind::Call(_, arguments) => self.arguments(arguments),
            ExprKind::Unary(_, a) | ExprKind::Field(a, _) => self.expr(a),
            ExprKind::Binary(_, a, b) => {
                self.expr(a);
                self.expr(b);
            }
            ExprKind::If(branches, otherwise) => {
                for (condition, value) in branches {
                    self.expr(condition);
                    self.expr(value);
                }
                self.expr(otherwise);
            }
            ExprKind::Range(a, step, b) => {
                self.expr(a);
                step.iter_mut().for_each(|e| self.expr(e));
                self.expr(b);
            }
            ExprKind::ArrayFor(body, iterators) => self.inside(iterators, |renaming| renaming.expr(body)),
            ExprKind::Array(items) => items.iter_mut().for_each(|e| self.expr(e)),
            ExprKind::Matrix(rows) => rows.iter_mut().flatten().for_each(|e| self.expr(e)),
            ExprKind::Tuple(items) => items.iter_mut().flatten().for_each(|e| self.expr(e)),
            ExprKind::Integer(_)
            | ExprKind::Real(_)
            | ExprKind::Text(_)
            | ExprKind::Boolean(_)
            | ExprKind::Colon
            | ExprKind::End => {}
        }
    }
}
