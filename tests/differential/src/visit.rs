//! Walks over all expressions of a model.

use crate::model::{Equation, Expr, Id, Model, Range, Statement, Step, Subscript, Target};

fn of_range<'a>(range: &'a Range, f: &mut dyn FnMut(&'a Expr)) {
    f(&range.from);
    f(&range.to);
}

fn of_subscripts<'a>(list: &'a [Subscript], f: &mut dyn FnMut(&'a Expr)) {
    for subscript in list {
        match subscript {
            Subscript::At(e) => f(e),
            Subscript::Slice(range) => of_range(range, f),
            Subscript::All => {}
        }
    }
}

/// The operands of an expression.
pub fn children<'a>(e: &'a Expr, f: &mut dyn FnMut(&'a Expr)) {
    match e {
        Expr::Name(_, list)
        | Expr::Local(_, list)
        | Expr::Pre(_, list)
        | Expr::Edge(_, list)
        | Expr::Change(_, list) => {
            of_subscripts(list, f);
        }
        Expr::Field(e, _) | Expr::Der(e) | Expr::Minus(e) | Expr::Not(e) | Expr::NoEvent(e) | Expr::Delay(e, _) => f(e),
        Expr::Construct(_, fields, _) => fields.iter().for_each(|(_, e)| f(e)),
        Expr::Binary(_, a, b) => {
            f(a);
            f(b);
        }
        Expr::If(branches, otherwise) => {
            for (c, v) in branches {
                f(c);
                f(v);
            }
            f(otherwise);
        }
        Expr::Array(list) | Expr::Builtin(_, list) | Expr::Call(_, list) => list.iter().for_each(f),
        Expr::For(_, body, iterators) => {
            f(body);
            iterators.iter().for_each(|(_, range)| of_range(range, f));
        }
        Expr::Number(_) | Expr::Truth(_) | Expr::Literal(_) | Expr::Time | Expr::Record(_) => {}
        Expr::Sample(..) | Expr::Initial => {}
    }
}

/// Every expression in an expression, itself first.
pub fn within<'a>(e: &'a Expr, f: &mut dyn FnMut(&'a Expr)) {
    f(e);
    children(e, &mut |e| within(e, f));
}

fn of_target<'a>(target: &'a Target, f: &mut dyn FnMut(&'a Expr)) {
    if let Target::Name(_, list) | Target::Local(_, list) = target {
        of_subscripts(list, f);
    }
}

fn of_steps<'a>(list: &'a [Step], f: &mut dyn FnMut(&'a Expr)) {
    for step in list {
        match step {
            Step::Assign(target, e) => {
                of_target(target, f);
                f(e);
            }
            Step::Tuple(targets, e) => {
                targets.iter().for_each(|target| of_target(target, f));
                f(e);
            }
            Step::If(branches, otherwise) => {
                for (c, body) in branches {
                    f(c);
                    of_steps(body, f);
                }
                of_steps(otherwise, f);
            }
            Step::For(_, range, body) => {
                of_range(range, f);
                of_steps(body, f);
            }
            Step::While(c, body) => {
                f(c);
                of_steps(body, f);
            }
            Step::Break | Step::Return => {}
        }
    }
}

fn of_equations<'a>(list: &'a [Equation], f: &mut dyn FnMut(&'a Expr)) {
    for equation in list {
        match equation {
            Equation::Plain(a, b) => {
                f(a);
                f(b);
            }
            Equation::Loop(_, range, body) => {
                of_range(range, f);
                of_equations(body, f);
            }
        }
    }
}

/// The expressions of a statement, outermost ones.
pub fn of_statement<'a>(statement: &'a Statement, f: &mut dyn FnMut(&'a Expr)) {
    match statement {
        Statement::Define(target, e, _) | Statement::Derive(target, e, _) | Statement::Reinit(target, e) => {
            of_target(target, f);
            f(e);
        }
        Statement::Declare(_, e) | Statement::DefineRecord(_, e) => f(e),
        Statement::Tuple(targets, e) => {
            targets.iter().for_each(|target| of_target(target, f));
            f(e);
        }
        Statement::Implicit(_, equations) => of_equations(equations, f),
        Statement::For(_, range, body) => {
            of_range(range, f);
            body.iter().for_each(|s| of_statement(s, f));
        }
        Statement::Each(_, body) => body.iter().for_each(|s| of_statement(s, f)),
        Statement::If(branches, otherwise) => {
            for (c, body) in branches {
                f(c);
                body.iter().for_each(|s| of_statement(s, f));
            }
            otherwise.iter().for_each(|s| of_statement(s, f));
        }
        Statement::When(branches) | Statement::Acts(branches) => {
            for (conditions, body) in branches {
                conditions.iter().for_each(&mut *f);
                body.iter().for_each(|s| of_statement(s, f));
            }
        }
        Statement::Algorithm(steps) => of_steps(steps, f),
        Statement::Network(network) => network.meaning.iter().for_each(|s| of_statement(s, f)),
    }
}

/// Every expression of a model.
pub fn all<'a>(model: &'a Model, f: &mut dyn FnMut(&'a Expr)) {
    let mut deep = |e: &'a Expr| within(e, f);
    model.statements.iter().for_each(|s| of_statement(s, &mut deep));
    for (a, b) in &model.initial {
        deep(a);
        deep(b);
    }
    for variable in &model.variables {
        variable.value.iter().chain(&variable.start_by).for_each(&mut deep);
    }
    model.components.iter().filter_map(|c| c.value.as_ref()).for_each(&mut deep);
    for function in &model.functions {
        function.inputs.iter().chain(&function.outputs).chain(&function.locals).for_each(|local| {
            local.value.iter().for_each(&mut deep);
        });
        of_steps(&function.body, &mut deep);
    }
}

/// Whether some expression of a model is like this.
pub fn any(model: &Model, like: &dyn Fn(&Expr) -> bool) -> bool {
    let mut found = false;
    all(model, &mut |e| found |= like(e));
    found
}

/// Whether there is a loop whose turns the run decides.
pub fn has_while(steps: &[Step]) -> bool {
    steps.iter().any(|step| match step {
        Step::While(..) | Step::Break => true,
        Step::For(_, _, body) => has_while(body),
        Step::If(branches, otherwise) => branches.iter().any(|(_, body)| has_while(body)) || has_while(otherwise),
        _ => false,
    })
}

/// The variables that an expression reads.
pub fn reads(e: &Expr, model: &Model, into: &mut Vec<Id>) {
    within(e, &mut |e| match e {
        Expr::Name(id, _) | Expr::Pre(id, _) | Expr::Edge(id, _) | Expr::Change(id, _) => into.push(*id),
        Expr::Record(component) => {
            into.extend((0..model.variables.len()).filter(|id| model.variables[*id].owner == Some(*component)));
        }
        _ => {}
    });
}

/// The variables that a statement determines or sets back.
pub fn defined(statement: &Statement, into: &mut Vec<Id>) {
    let mut target = |t: &Target| {
        if let Target::Name(id, _) = t {
            into.push(*id);
        }
    };
    match statement {
        Statement::Define(t, ..) | Statement::Derive(t, ..) | Statement::Reinit(t, _) => target(t),
        Statement::Declare(id, _) => into.push(*id),
        Statement::Tuple(list, _) => list.iter().for_each(target),
        Statement::Implicit(list, _) => into.extend(list),
        Statement::For(_, _, body) | Statement::Each(_, body) => body.iter().for_each(|s| defined(s, into)),
        Statement::If(branches, otherwise) => {
            branches.iter().flat_map(|(_, body)| body).chain(otherwise).for_each(|s| defined(s, into));
        }
        Statement::When(branches) | Statement::Acts(branches) => {
            branches.iter().flat_map(|(_, body)| body).for_each(|s| defined(s, into))
        }
        Statement::Algorithm(steps) => assigned(steps, into),
        Statement::Network(network) => network.meaning.iter().for_each(|s| defined(s, into)),
        Statement::DefineRecord(..) => {}
    }
}

fn assigned(steps: &[Step], into: &mut Vec<Id>) {
    for step in steps {
        match step {
            Step::Assign(Target::Name(id, _), _) => into.push(*id),
            Step::For(_, _, body) | Step::While(_, body) => assigned(body, into),
            Step::If(branches, otherwise) => {
                branches.iter().for_each(|(_, body)| assigned(body, into));
                assigned(otherwise, into);
            }
            _ => {}
        }
    }
}
