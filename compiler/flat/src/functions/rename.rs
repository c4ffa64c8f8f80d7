//! Names of a statement replaced by others, apart from its own loop variables.

use hyd_instance::Builtin;
use hyd_syntax::tree::{ComponentRef, Ident, Name, RefPart};
use hyd_typed::{Expr, Iterator, Kind, Local, Statement, StatementKind};

/// What can get another name.
pub(crate) enum Found<'a> {
    /// A variable, a local name or `time`, read or set; its last subscripts stay.  The names are loop variables of the statement.
    Reference(&'a Expr, bool, &'a [Name]),
    /// A call of an operator that speaks of events or derivatives.
    Operator(&'a Expr),
}

/// Asks `name` for the new name of everything found; `None` leaves it as it is.
pub(crate) fn rename(statement: &mut Statement, name: &mut dyn FnMut(Found<'_>) -> Option<Name>) {
    Renaming { name, hidden: Vec::new() }.statement(statement);
}

/// True if the value belongs to the model, not to the statement.
fn belongs_to_model(builtin: Builtin) -> bool {
    builtin.reads_run() || matches!(builtin, Builtin::Delay | Builtin::Homotopy)
}

/// A local name that stands alone, with subscripts.
pub(crate) fn local_name(name: Name, subscripts: Vec<Expr>, like: &Expr) -> Expr {
    let ident = Ident { name, span: like.span };
    let written = subscripts.iter().map(Expr::written).collect();
    let part = RefPart { name: ident.clone(), subscripts: written };
    let reference = ComponentRef { global: false, parts: vec![part], span: like.span };
    let kind = Kind::Local(Local { parts: vec![(ident, subscripts)], reference: reference.into() });
    Expr { kind, ty: like.ty.clone(), span: like.span }
}

struct Renaming<'f> {
    name: &'f mut dyn FnMut(Found<'_>) -> Option<Name>,
    hidden: Vec<Name>,
}

impl Renaming<'_> {
    fn statements(&mut self, list: &mut [Statement]) {
        list.iter_mut().for_each(|statement| self.statement(statement));
    }

    fn statement(&mut self, statement: &mut Statement) {
        match &mut statement.kind {
            StatementKind::Assign(target, value) => {
                self.target(target);
                self.expr(value);
            }
            StatementKind::AssignTuple(targets, call) => {
                targets.iter_mut().flatten().for_each(|target| self.target(target));
                self.expr(call);
            }
            StatementKind::Call(call) => self.expr(call),
            StatementKind::Assert(assertion) => {
                self.expr(&mut assertion.condition);
                self.expr(&mut assertion.text);
            }
            StatementKind::Terminate(text) => self.expr(text),
            StatementKind::Reinit(state, value) => {
                self.expr(state);
                self.expr(value);
            }
            StatementKind::If(branches) => {
                for (condition, body) in branches {
                    condition.iter_mut().for_each(|condition| self.expr(condition));
                    self.statements(body);
                }
            }
            StatementKind::For(iterators, body) => {
                self.enter(iterators);
                self.statements(body);
                self.leave(iterators);
            }
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
            StatementKind::Break | StatementKind::Return | StatementKind::Failed(_) => {}
        }
    }

    fn enter(&mut self, iterators: &mut [Iterator]) {
        for iterator in iterators {
            self.expr(&mut iterator.range);
            self.hidden.push(iterator.name.name.clone());
        }
    }

    fn leave(&mut self, iterators: &[Iterator]) {
        self.hidden.truncate(self.hidden.len() - iterators.len());
    }

    fn target(&mut self, target: &mut Expr) {
        self.reference(target, true);
    }

    fn reference(&mut self, expr: &mut Expr, set: bool) {
        let own = matches!(&expr.kind, Kind::Local(local) if self.hidden.contains(local.name()));
        if !own && let Some(name) = (self.name)(Found::Reference(expr, set, &self.hidden)) {
            let last = match &mut expr.kind {
                Kind::Variable(variable) => variable.steps.pop().map(|(_, subscripts)| subscripts),
                Kind::Local(local) => local.parts.pop().map(|(_, subscripts)| subscripts),
                _ => None,
            };
            *expr = local_name(name, last.unwrap_or_default(), expr);
        }
        match &mut expr.kind {
            Kind::Variable(variable) => {
                variable.steps.iter_mut().flat_map(|(_, subscripts)| subscripts).for_each(|e| self.expr(e));
            }
            Kind::Local(local) => {
                local.parts.iter_mut().flat_map(|(_, subscripts)| subscripts).for_each(|e| self.expr(e));
            }
            _ => {}
        }
    }

    fn expr(&mut self, expr: &mut Expr) {
        if matches!(expr.kind, Kind::Variable(_) | Kind::Local(_) | Kind::Time) {
            self.reference(expr, false);
            return;
        }
        if matches!(expr.kind, Kind::Builtin(builtin, _) if belongs_to_model(builtin))
            && let Some(name) = (self.name)(Found::Operator(expr))
        {
            *expr = local_name(name, Vec::new(), expr);
            return;
        }
        match &mut expr.kind {
            Kind::Builtin(_, list) | Kind::Array(list) => list.iter_mut().for_each(|e| self.expr(e)),
            Kind::Format(value, _) => self.expr(value),
            Kind::Reduction(_, body, iterators) | Kind::ArrayFor(body, iterators) => {
                self.enter(iterators);
                self.expr(body);
                self.leave(iterators);
            }
            Kind::Call(call) => {
                let named = call.named.iter_mut().map(|(_, e)| e);
                call.positional.iter_mut().chain(named).for_each(|e| self.expr(e));
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
                step.iter_mut().for_each(|step| self.expr(step));
                self.expr(b);
            }
            Kind::Matrix(rows) => rows.iter_mut().flatten().for_each(|e| self.expr(e)),
            Kind::Tuple(items) => items.iter_mut().flatten().for_each(|e| self.expr(e)),
            _ => {}
        }
    }
}
