//! Equations and the steps of algorithms as text.

use super::Printer;
use crate::model::{Equation, Expr, Form, Range, SELF, Statement, Step, Target};

fn line(depth: usize, text: &str, into: &mut String) {
    *into += &"  ".repeat(depth);
    *into += text;
    into.push('\n');
}

fn stops(steps: &[Step]) -> bool {
    steps.iter().any(|step| match step {
        Step::Break | Step::Return => true,
        Step::If(branches, otherwise) => branches.iter().any(|(_, body)| stops(body)) || stops(otherwise),
        Step::For(_, _, body) | Step::While(_, body) => stops(body),
        _ => false,
    })
}

impl Printer<'_> {
    fn target(&self, target: &Target) -> String {
        match target {
            Target::Name(id, list) => self.name(*id, list),
            Target::Local(name, list) => format!("{name}{}", self.subscripts(list)),
            Target::Field(name, field) => format!("{name}.{field}"),
        }
    }

    fn written(&self, left: Expr, right: &Expr, form: Form) -> String {
        let two = || Expr::Number(2.0);
        let both = |a: Expr, b: Expr| format!("{} = {};", self.side(&a), self.expr(&b));
        match form {
            Form::Plain => both(left, right.clone()),
            Form::Turned => both(right.clone(), left),
            Form::Difference => both(left - right.clone(), Expr::Number(0.0)),
            Form::Doubled => both(two() * left, two() * right.clone()),
            Form::Both => both(left.clone() + left.clone(), right.clone() + left),
        }
    }

    /// The left side of an equation: there no `if` may stand without parentheses.
    fn side(&self, e: &Expr) -> String {
        match e {
            Expr::If(..) => format!("({})", self.expr(e)),
            _ => self.expr(e),
        }
    }

    fn looped(
        &self,
        name: &str,
        range: &Range,
        depth: usize,
        into: &mut String,
        body: &dyn Fn(&Printer, usize, &mut String),
    ) {
        match self.values(range).filter(|_| self.form.unrolled) {
            Some(values) => values.into_iter().for_each(|k| body(&self.with(name, k), depth, into)),
            None => {
                line(depth, &format!("for {name} in {} loop", self.range(range)), into);
                body(self, depth + 1, into);
                line(depth, "end for;", into);
            }
        }
    }

    /// An equation of an algebraic loop.
    pub fn equation(&self, equation: &Equation, depth: usize, into: &mut String) {
        match equation {
            Equation::Plain(a, b) => line(depth, &format!("{} = {};", self.side(a), self.expr(b)), into),
            Equation::Loop(name, range, body) => self.looped(name, range, depth, into, &|printer, depth, into| {
                body.iter().for_each(|e| printer.equation(e, depth, into));
            }),
        }
    }

    /// A statement that stands in an equation section.
    pub fn statement(&self, statement: &Statement, depth: usize, into: &mut String) {
        let all = |list: &[Statement], printer: &Printer, depth: usize, into: &mut String| {
            list.iter().for_each(|s| printer.statement(s, depth, into));
        };
        let name = |target: &Target| match target {
            Target::Name(id, list) => Expr::Name(*id, list.clone()),
            Target::Local(name, list) => Expr::Local(name.clone(), list.clone()),
            Target::Field(name, field) => Expr::Field(Box::new(Expr::local(name)), field.clone()),
        };
        match statement {
            Statement::Define(target, e, form) => line(depth, &self.written(name(target), e, *form), into),
            Statement::Derive(target, e, form) => {
                line(depth, &self.written(Expr::Der(Box::new(name(target))), e, *form), into);
            }
            Statement::DefineRecord(component, e) => {
                line(depth, &format!("{} = {};", self.model.components[*component].name, self.expr(e)), into);
            }
            Statement::Tuple(targets, e) => {
                let targets: Vec<String> = targets.iter().map(|t| self.target(t)).collect();
                line(depth, &format!("({}) = {};", targets.join(", "), self.expr(e)), into);
            }
            Statement::Implicit(_, list) => list.iter().for_each(|e| self.equation(e, depth, into)),
            Statement::For(iterator, range, body) => {
                self.looped(iterator, range, depth, into, &|printer, depth, into| all(body, printer, depth, into));
            }
            Statement::Each(component, body) if self.is_flat(*component) => {
                let range = Range::new(1, self.model.components[*component].count.unwrap_or(1) as i64);
                if self.model.components[*component].count.is_none() {
                    all(body, self, depth, into);
                } else {
                    self.looped(SELF, &range, depth, into, &|printer, depth, into| all(body, printer, depth, into));
                }
            }
            Statement::If(branches, otherwise) => {
                for (k, (c, body)) in branches.iter().enumerate() {
                    let word = if k == 0 { "if" } else { "elseif" };
                    line(depth, &format!("{word} {} then", self.expr(c)), into);
                    all(body, self, depth + 1, into);
                }
                line(depth, "else", into);
                all(otherwise, self, depth + 1, into);
                line(depth, "end if;", into);
            }
            Statement::When(branches) => {
                for (k, (conditions, body)) in branches.iter().enumerate() {
                    let word = if k == 0 { "when" } else { "elsewhen" };
                    let list: Vec<String> = conditions.iter().map(|c| self.expr(c)).collect();
                    let condition =
                        if let [one] = list.as_slice() { one.clone() } else { format!("{{{}}}", list.join(", ")) };
                    line(depth, &format!("{word} {condition} then"), into);
                    all(body, self, depth + 1, into);
                }
                line(depth, "end when;", into);
            }
            Statement::Reinit(target, e) => {
                line(depth, &format!("reinit({}, {});", self.target(target), self.expr(e)), into);
            }
            // These stand elsewhere: in declarations, classes, sections of their own.
            Statement::Declare(..) | Statement::Each(..) => {}
            Statement::Algorithm(_) | Statement::Acts(_) | Statement::Network(_) => {}
        }
    }

    /// A `when` as it stands in an algorithm section.
    pub fn acts(&self, branches: &[(Vec<Expr>, Vec<Statement>)], into: &mut String) {
        for (k, (conditions, body)) in branches.iter().enumerate() {
            let word = if k == 0 { "when" } else { "elsewhen" };
            let list: Vec<String> = conditions.iter().map(|c| self.expr(c)).collect();
            let condition = if let [one] = list.as_slice() { one.clone() } else { format!("{{{}}}", list.join(", ")) };
            line(1, &format!("{word} {condition} then"), into);
            for statement in body {
                if let Statement::Define(target, e, _) = statement {
                    line(2, &format!("{} := {};", self.target(target), self.expr(e)), into);
                }
            }
        }
        line(1, "end when;", into);
    }

    /// Steps of an algorithm.
    pub fn steps(&self, list: &[Step], depth: usize, into: &mut String) {
        list.iter().for_each(|step| self.step(step, depth, into));
    }

    fn step(&self, step: &Step, depth: usize, into: &mut String) {
        match step {
            Step::Assign(target, e) => line(depth, &format!("{} := {};", self.target(target), self.expr(e)), into),
            Step::Tuple(targets, e) => {
                let targets: Vec<String> = targets.iter().map(|t| self.target(t)).collect();
                line(depth, &format!("({}) := {};", targets.join(", "), self.expr(e)), into);
            }
            Step::If(branches, otherwise) => {
                for (k, (c, body)) in branches.iter().enumerate() {
                    let word = if k == 0 { "if" } else { "elseif" };
                    line(depth, &format!("{word} {} then", self.expr(c)), into);
                    self.steps(body, depth + 1, into);
                }
                if !otherwise.is_empty() {
                    line(depth, "else", into);
                    self.steps(otherwise, depth + 1, into);
                }
                line(depth, "end if;", into);
            }
            Step::For(name, range, body) if stops(body) => {
                line(depth, &format!("for {name} in {} loop", self.range(range)), into);
                self.steps(body, depth + 1, into);
                line(depth, "end for;", into);
            }
            Step::For(name, range, body) => {
                self.looped(name, range, depth, into, &|printer, depth, into| printer.steps(body, depth, into));
            }
            Step::While(c, body) => {
                line(depth, &format!("while {} loop", self.expr(c)), into);
                self.steps(body, depth + 1, into);
                line(depth, "end while;", into);
            }
            Step::Break => line(depth, "break;", into),
            Step::Return => line(depth, "return;", into),
        }
    }
}
