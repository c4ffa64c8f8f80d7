//! Makes a model smaller while something remains true of it.
//!
//! Statements go with the variables that only they define, expressions become one of their operands or a number, what
//! nothing reads any more goes.  Whether the rest still makes sense is left to whoever asks.

use crate::model::{Equation, Expr, Id, Model, Role, Start, Statement, Step, Subscript};
use crate::visit;

/// Tries at most.
const MOST_TRIES: usize = 600;

/// A smaller model of which `holds` is true, as it is of the one given.
pub fn shrink(model: &Model, holds: &mut dyn FnMut(&Model) -> bool) -> Model {
    let mut best = model.clone();
    let mut tries = 0;
    loop {
        let mut smaller = false;
        let mut k = 0;
        while tries < MOST_TRIES {
            let Some(candidate) = candidate(&best, k) else { break };
            k += 1;
            let Some(candidate) = candidate else { continue };
            tries += 1;
            if holds(&candidate) {
                best = candidate;
                smaller = true;
                k = k.saturating_sub(2);
            }
        }
        if !smaller || tries >= MOST_TRIES {
            return best;
        }
    }
}

/// The candidate of this number: `None` past the last, `Some(None)` where there is none.
fn candidate(model: &Model, k: usize) -> Option<Option<Model>> {
    let statements = model.statements.len();
    if k < statements {
        return Some(without_statement(model, statements - 1 - k));
    }
    let k = k - statements;
    if k == 0 {
        return Some(Some(without_rest(model)));
    }
    if k == 1 {
        return Some(with_plain_start(model));
    }
    if k == 2 {
        let mut plain = model.clone();
        plain.variables.iter_mut().for_each(|v| {
            v.select = None;
            v.start_by = None;
        });
        return Some(Some(plain));
    }
    let k = k - 3;
    let mut count = 0;
    let mut copy = model.clone();
    let mut found = None;
    each_slot(&mut copy, &mut |e| {
        let choices = choices(e);
        if found.is_none() && k < count + choices.len() {
            let choice = choices[k - count].clone();
            found = Some(choice != *e);
            *e = choice;
        }
        count += choices.len();
    });
    found.map(|changed| changed.then_some(copy))
}

/// What an expression may become.
fn choices(e: &Expr) -> Vec<Expr> {
    match e {
        Expr::Number(_) | Expr::Truth(_) | Expr::Literal(_) | Expr::Time | Expr::Sample(..) | Expr::Initial => {
            Vec::new()
        }
        Expr::Name(_, list) if list.is_empty() => vec![Expr::Number(0.5)],
        Expr::Name(..) => vec![Expr::Number(0.5)],
        Expr::Local(..) | Expr::Record(_) => Vec::new(),
        _ => {
            let mut list = Vec::new();
            visit::children(e, &mut |child| list.push(child.clone()));
            list.push(Expr::Number(0.5));
            list.push(Expr::Number(2.0));
            list.push(Expr::Truth(true));
            list.push(Expr::Truth(false));
            list
        }
    }
}

/// The model without a statement, without all others that define the same, and without these variables.
fn without_statement(model: &Model, k: usize) -> Option<Model> {
    let mut gone = Vec::new();
    visit::defined(&model.statements[k], &mut gone);
    let mut records = Vec::new();
    if let Statement::DefineRecord(component, _) = &model.statements[k] {
        records.push(*component);
        gone.extend((0..model.variables.len()).filter(|id| model.variables[*id].owner == Some(*component)));
    }
    // What a state only sets back needs not go.
    let touches = |s: &Statement| {
        let mut ids = Vec::new();
        visit::defined(s, &mut ids);
        ids.iter().any(|id| gone.contains(id))
    };
    let stays = |(j, s): &(usize, &Statement)| *j != k && !touches(s);
    let rest: Vec<Statement> = model.statements.iter().enumerate().filter(stays).map(|(_, s)| s.clone()).collect();
    let mut smaller = Model { statements: rest, ..model.clone() };
    smaller.initial.retain(|(a, b)| {
        let mut read = Vec::new();
        visit::reads(a, model, &mut read);
        visit::reads(b, model, &mut read);
        !read.iter().any(|id| gone.contains(id))
    });
    gone.iter().for_each(|id| smaller.variables[*id].dropped = true);
    // Components whose class has no statement any more.
    for (id, component) in smaller.components.iter_mut().enumerate() {
        let owned = smaller.variables.iter().filter(|v| v.owner == Some(id));
        component.dropped |= records.contains(&id) || (owned.clone().all(|v| v.dropped) && owned.count() > 0);
    }
    let dead: Vec<bool> = smaller.components.iter().map(|c| c.dropped).collect();
    smaller.variables.iter_mut().filter(|v| v.owner.is_some_and(|o| dead[o])).for_each(|v| v.dropped = true);
    (!reads_dropped(&smaller)).then_some(smaller)
}

fn read_by(model: &Model) -> Vec<Id> {
    let mut read = Vec::new();
    for statement in &model.statements {
        visit::of_statement(statement, &mut |e| visit::reads(e, model, &mut read));
    }
    for (a, b) in &model.initial {
        visit::reads(a, model, &mut read);
        visit::reads(b, model, &mut read);
    }
    for variable in model.variables.iter().filter(|v| !v.dropped) {
        variable.value.iter().chain(&variable.start_by).for_each(|e| visit::reads(e, model, &mut read));
        read.extend(variable.size_by);
    }
    model.components.iter().filter(|c| !c.dropped).filter_map(|c| c.value.as_ref()).for_each(|e| {
        visit::reads(e, model, &mut read);
    });
    read
}

fn reads_dropped(model: &Model) -> bool {
    read_by(model).iter().any(|id| model.variables[*id].dropped)
}

/// Without what nothing reads or calls.
fn without_rest(model: &Model) -> Model {
    let mut smaller = model.clone();
    let read = read_by(model);
    for (id, variable) in smaller.variables.iter_mut().enumerate() {
        let parameter = matches!(variable.role, Role::Parameter | Role::Structural | Role::Constant);
        if parameter && variable.owner.is_none() && !read.contains(&id) {
            variable.dropped = true;
        }
    }
    let called = |name: &str| visit::any(model, &|e| matches!(e, Expr::Call(n, _) if n == name)) || tuples(model, name);
    smaller.functions.retain(|f| called(&f.name));
    for id in 0..smaller.components.len() {
        let of = |v: &usize| smaller.variables[*v].owner == Some(id);
        let ids: Vec<usize> = (0..smaller.variables.len()).filter(of).collect();
        if smaller.components[id].parameter && !ids.iter().any(|id| read.contains(id)) {
            smaller.components[id].dropped = true;
            ids.iter().for_each(|id| smaller.variables[*id].dropped = true);
        }
    }
    smaller
}

fn tuples(model: &Model, name: &str) -> bool {
    let calls = |e: &Expr| matches!(e, Expr::Call(n, _) if n == name);
    model.statements.iter().any(|s| matches!(s, Statement::Tuple(_, e) if calls(e)))
}

/// Without initial equations: all starts are conditions, free parameters have values.
fn with_plain_start(model: &Model) -> Option<Model> {
    let mut plain = model.clone();
    plain.initial.clear();
    for variable in &mut plain.variables {
        if variable.role == Role::Free {
            variable.role = Role::Parameter;
            variable.value = Some(Expr::Number(variable.start));
            variable.fixed = Start::None;
        } else if variable.fixed == Start::Guess {
            variable.fixed = Start::Fixed;
        }
    }
    (!model.initial.is_empty()).then_some(plain)
}

/// Calls `f` for every expression that may be exchanged, outer ones first.
fn each_slot(model: &mut Model, f: &mut dyn FnMut(&mut Expr)) {
    model.statements.iter_mut().for_each(|s| in_statement(s, f));
    model.functions.iter_mut().for_each(|function| in_steps(&mut function.body, f));
}

fn deep(e: &mut Expr, f: &mut dyn FnMut(&mut Expr)) {
    f(e);
    match e {
        Expr::Name(_, list) | Expr::Local(_, list) => {
            for subscript in list {
                if let Subscript::At(e) = subscript {
                    deep(e, f);
                }
            }
        }
        Expr::Field(e, _) | Expr::Der(e) | Expr::Minus(e) | Expr::Not(e) | Expr::NoEvent(e) | Expr::Delay(e, _) => {
            deep(e, f);
        }
        Expr::Construct(_, fields, _) => fields.iter_mut().for_each(|(_, e)| deep(e, f)),
        Expr::Binary(_, a, b) => {
            deep(a, f);
            deep(b, f);
        }
        Expr::If(branches, otherwise) => {
            for (c, v) in branches {
                deep(c, f);
                deep(v, f);
            }
            deep(otherwise, f);
        }
        Expr::Array(list) | Expr::Builtin(_, list) | Expr::Call(_, list) => list.iter_mut().for_each(|e| deep(e, f)),
        Expr::For(_, body, _) => deep(body, f),
        _ => {}
    }
}

fn in_statement(statement: &mut Statement, f: &mut dyn FnMut(&mut Expr)) {
    let bodies = |list: &mut Vec<Statement>, f: &mut dyn FnMut(&mut Expr)| {
        // A statement of many may go when the rest still makes sense.
        list.iter_mut().for_each(|s| in_statement(s, f));
    };
    match statement {
        Statement::Define(_, e, _)
        | Statement::Derive(_, e, _)
        | Statement::Reinit(_, e)
        | Statement::Declare(_, e) => {
            deep(e, f);
        }
        Statement::DefineRecord(_, e) | Statement::Tuple(_, e) => deep(e, f),
        Statement::Implicit(_, list) => in_equations(list, f),
        Statement::For(_, _, body) | Statement::Each(_, body) => bodies(body, f),
        Statement::If(branches, otherwise) => {
            for (c, body) in branches {
                deep(c, f);
                bodies(body, f);
            }
            bodies(otherwise, f);
        }
        Statement::When(branches) | Statement::Acts(branches) => {
            for (conditions, body) in branches {
                conditions.iter_mut().for_each(|c| deep(c, f));
                bodies(body, f);
            }
        }
        Statement::Algorithm(steps) => in_steps(steps, f),
        // Its text stays as it is.
        Statement::Network(_) => {}
    }
}

fn in_equations(list: &mut [Equation], f: &mut dyn FnMut(&mut Expr)) {
    for equation in list {
        match equation {
            Equation::Plain(a, b) => {
                deep(a, f);
                deep(b, f);
            }
            Equation::Loop(_, _, body) => in_equations(body, f),
        }
    }
}

fn in_steps(list: &mut [Step], f: &mut dyn FnMut(&mut Expr)) {
    for step in list {
        match step {
            Step::Assign(_, e) | Step::Tuple(_, e) => deep(e, f),
            Step::If(branches, otherwise) => {
                for (c, body) in branches {
                    deep(c, f);
                    in_steps(body, f);
                }
                in_steps(otherwise, f);
            }
            Step::For(_, _, body) => in_steps(body, f),
            Step::While(..) | Step::Break | Step::Return => {}
        }
    }
}
