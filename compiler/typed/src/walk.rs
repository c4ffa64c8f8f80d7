//! Going through typed expressions.

use hyd_instance::Builtin;
use hyd_source::Diagnostic;
use hyd_syntax::tree::Name;

use crate::expression::{Callee, Expr, Iterator, Kind, Local, Variable};
use crate::statement::{Statement, StatementKind};

/// What is done at each place of an expression.
trait Visitor {
    /// A variable.
    fn variable(&mut self, variable: &Variable) {
        let _ = variable;
    }

    /// A local name that the expression does not declare itself.
    fn local(&mut self, local: &Local) {
        let _ = local;
    }

    /// Any expression, before what is inside; false if that is not to be looked at.
    fn enter(&mut self, expr: &Expr) -> bool {
        let _ = expr;
        true
    }
}

fn walk<V: Visitor>(visitor: &mut V, expr: &Expr) {
    Walk { visitor, own: Vec::new() }.expr(expr);
}

struct Walk<'v, V> {
    visitor: &'v mut V,
    own: Vec<Name>,
}

impl<V: Visitor> Walk<'_, V> {
    fn all<'e>(&mut self, list: impl IntoIterator<Item = &'e Expr>) {
        list.into_iter().for_each(|e| self.expr(e));
    }

    fn loops(&mut self, iterators: &[Iterator], body: &Expr) {
        self.all(iterators.iter().map(|i| &i.range));
        self.own.extend(iterators.iter().map(|i| i.name.name.clone()));
        self.expr(body);
        self.own.truncate(self.own.len() - iterators.len());
    }

    fn expr(&mut self, expr: &Expr) {
        if !self.visitor.enter(expr) {
            return;
        }
        match &expr.kind {
            Kind::Variable(variable) => {
                self.visitor.variable(variable);
                self.all(variable.steps.iter().flat_map(|(_, subscripts)| subscripts));
            }
            Kind::Local(local) => {
                if !self.own.contains(local.name()) {
                    self.visitor.local(local);
                }
                self.all(local.parts.iter().flat_map(|(_, subscripts)| subscripts));
            }
            // Sizes are known whatever the values are.
            Kind::Builtin(builtin, list) if builtin.asks_for_no_value() => self.all(list.iter().skip(1)),
            Kind::Builtin(_, list) | Kind::Array(list) => self.all(list),
            Kind::Format(value, _) => self.expr(value),
            Kind::Reduction(_, body, iterators) | Kind::ArrayFor(body, iterators) => self.loops(iterators, body),
            Kind::Call(call) | Kind::Function(call) => {
                if let Callee::Local(local) = &call.function
                    && !self.own.contains(local.name())
                {
                    self.visitor.local(local);
                }
                self.all(&call.positional);
                self.all(call.named.iter().map(|(_, e)| e));
            }
            Kind::Unary(_, a) | Kind::Field(a, _) => self.expr(a),
            Kind::Binary(_, a, b) => {
                self.expr(a);
                self.expr(b);
            }
            Kind::If(branches, otherwise) => {
                for (condition, value) in branches {
                    self.expr(condition);
                    self.expr(value);
                }
                self.expr(otherwise);
            }
            Kind::Range(a, step, b) => {
                self.expr(a);
                self.all(step.as_deref());
                self.expr(b);
            }
            Kind::Matrix(rows) => self.all(rows.iter().flatten()),
            Kind::Tuple(items) => self.all(items.iter().flatten()),
            Kind::Record(made) => self.all(&made.given),
            Kind::Integer(_)
            | Kind::Real(_)
            | Kind::Boolean(_)
            | Kind::Text(_)
            | Kind::Literal(..)
            | Kind::Values(..)
            | Kind::Time
            | Kind::Colon
            | Kind::End
            | Kind::Class(..)
            | Kind::Failed(..) => {}
        }
    }
}

/// True if `test` holds for a variable anywhere in the expression, apart from those asked only for their sizes.
pub fn any_variable(expr: &Expr, test: &mut dyn FnMut(&Variable) -> bool) -> bool {
    struct Search<'f>(&'f mut dyn FnMut(&Variable) -> bool, bool);
    impl Visitor for Search<'_> {
        fn variable(&mut self, variable: &Variable) {
            self.1 = self.1 || (self.0)(variable);
        }

        fn enter(&mut self, _: &Expr) -> bool {
            !self.1
        }
    }
    let mut search = Search(test, false);
    walk(&mut search, expr);
    search.1
}

/// True if `test` holds for a local name that the expression does not declare itself.
pub fn any_local(expr: &Expr, test: &mut dyn FnMut(&Local) -> bool) -> bool {
    struct Search<'f>(&'f mut dyn FnMut(&Local) -> bool, bool);
    impl Visitor for Search<'_> {
        fn local(&mut self, local: &Local) {
            self.1 = self.1 || (self.0)(local);
        }

        fn enter(&mut self, _: &Expr) -> bool {
            !self.1
        }
    }
    let mut search = Search(test, false);
    walk(&mut search, expr);
    search.1
}

/// True if `test` holds for an expression anywhere inside, itself included.
pub fn any(expr: &Expr, test: &mut dyn FnMut(&Expr) -> bool) -> bool {
    struct Search<'f>(&'f mut dyn FnMut(&Expr) -> bool, bool);
    impl Visitor for Search<'_> {
        fn enter(&mut self, expr: &Expr) -> bool {
            self.1 = self.1 || (self.0)(expr);
            !self.1
        }
    }
    let mut search = Search(test, false);
    walk(&mut search, expr);
    search.1
}

/// True if the local name alone stands in the expression.
pub fn mentions(expr: &Expr, name: &Name) -> bool {
    any_local(expr, &mut |local| local.parts.len() == 1 && local.name() == name)
}

/// True if an operator whose value comes from the run, or `time`, stands anywhere in the expression.
pub fn reads_run(expr: &Expr) -> bool {
    any(expr, &mut |part| match &part.kind {
        Kind::Builtin(builtin, _) => Builtin::reads_run(*builtin),
        Kind::Time => true,
        _ => false,
    })
}

/// Goes through statements with all expressions in them, those of inner statements included; `failed` gets what has no meaning.
pub fn walk_statements(statements: &[Statement], expr: &mut dyn FnMut(&Expr), failed: &mut dyn FnMut(&[Diagnostic])) {
    for statement in statements {
        match &statement.kind {
            StatementKind::Assign(target, value) => [target, value].into_iter().for_each(&mut *expr),
            StatementKind::AssignTuple(targets, call) => targets.iter().flatten().chain([call]).for_each(&mut *expr),
            StatementKind::Call(call) => expr(call),
            StatementKind::Assert(assertion) => {
                [&assertion.condition, &assertion.text].into_iter().for_each(&mut *expr)
            }
            StatementKind::Terminate(text) => expr(text),
            StatementKind::Reinit(state, value) => [state, value].into_iter().for_each(&mut *expr),
            StatementKind::If(branches) => {
                for (condition, body) in branches {
                    condition.iter().for_each(&mut *expr);
                    walk_statements(body, expr, failed);
                }
            }
            StatementKind::For(iterators, body) => {
                iterators.iter().map(|i| &i.range).for_each(&mut *expr);
                walk_statements(body, expr, failed);
            }
            StatementKind::While(condition, body) => {
                expr(condition);
                walk_statements(body, expr, failed);
            }
            StatementKind::When(branches) => {
                for (condition, body) in branches {
                    expr(condition);
                    walk_statements(body, expr, failed);
                }
            }
            StatementKind::Failed(said) => failed(said),
            StatementKind::Break | StatementKind::Return => {}
        }
    }
}
