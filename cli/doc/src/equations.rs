//! Equations and statements as HTML: formulas as MathML, connections and asserts as text, loops and cases indented.

use hyd_syntax::tree::{
    Arguments, ClassBody, ComponentRef, Equation, EquationKind, Expr, ExprKind, Statement, StatementKind,
};
use hyd_syntax::{print_expr, print_reference};

use crate::html::escape;
use crate::library::Library;
use crate::mathml;

/// The equations of a class itself, without those of its bases; empty if it has none.
pub(crate) fn own(library: &Library, class: usize) -> String {
    let ClassBody::Long { equations, algorithms, .. } = &library.entries[class].class.body else {
        return String::new();
    };
    let mut out = String::new();
    for section in equations {
        let inner: String = section.equations.iter().map(equation).collect();
        out += &titled(section.initial.then_some("At the start"), &inner);
    }
    for section in algorithms {
        let inner: String = section.statements.iter().map(statement).collect();
        out += &titled(Some(if section.initial { "In order, at the start" } else { "In order" }), &inner);
    }
    out
}

fn titled(title: Option<&str>, inner: &str) -> String {
    match title {
        _ if inner.is_empty() => String::new(),
        None => inner.to_string(),
        Some(title) => format!("<div class=\"when\">{title}</div><div class=\"block\">{inner}</div>"),
    }
}

fn formula(inner: &str) -> String {
    format!("<div class=\"equation\"><math displaystyle=\"true\"><mrow>{inner}</mrow></math></div>\n")
}

fn inline(inner: &str) -> String {
    format!("<math><mrow>{inner}</mrow></math>")
}

fn plain(text: &str) -> String {
    format!("<div class=\"connection\"><code>{}</code></div>\n", escape(text))
}

fn block(head: &str, inner: &str) -> String {
    format!("<div class=\"when\">{head}</div><div class=\"block\">{inner}</div>\n")
}

fn equation(equation: &Equation) -> String {
    let all = |list: &[Equation]| list.iter().map(self::equation).collect::<String>();
    match &equation.kind {
        EquationKind::Equal(left, right) => {
            formula(&format!("{}<mo>=</mo>{}", mathml::expression(left), mathml::expression(right)))
        }
        EquationKind::Connect(a, b) => plain(&format!("{} — {}", print_reference(a), print_reference(b))),
        EquationKind::For(over, inner) => block(&format!("for {}", inline(&mathml::iterators(over))), &all(inner)),
        EquationKind::If(branches) => branches
            .iter()
            .enumerate()
            .map(|(k, (condition, inner))| choice(k, condition.as_ref(), &all(inner)))
            .collect(),
        EquationKind::When(branches) => {
            branches.iter().map(|(condition, inner)| block(&instant(condition), &all(inner))).collect()
        }
        EquationKind::Call(function, arguments) => call(function, arguments),
    }
}

fn statement(statement: &Statement) -> String {
    let all = |list: &[Statement]| list.iter().map(self::statement).collect::<String>();
    let assign = |left: String, right: String| formula(&format!("{left}<mo>≔</mo>{right}"));
    match &statement.kind {
        StatementKind::Assign(target, value) => assign(mathml::reference(target), mathml::expression(value)),
        StatementKind::AssignTuple(targets, function, arguments) => {
            let targets: Vec<String> =
                targets.iter().map(|t| t.as_ref().map_or("<mo>·</mo>".into(), mathml::reference)).collect();
            let value = as_expression(function, arguments);
            assign(format!("<mo>(</mo>{}<mo>)</mo>", targets.join("<mo>,</mo>")), mathml::expression(&value))
        }
        StatementKind::Call(function, arguments) => call(function, arguments),
        StatementKind::If(branches) => branches
            .iter()
            .enumerate()
            .map(|(k, (condition, inner))| choice(k, condition.as_ref(), &all(inner)))
            .collect(),
        StatementKind::For(over, inner) => block(&format!("for {}", inline(&mathml::iterators(over))), &all(inner)),
        StatementKind::While(condition, inner) => {
            block(&format!("while {}", inline(&mathml::expression(condition))), &all(inner))
        }
        StatementKind::When(branches) => {
            branches.iter().map(|(condition, inner)| block(&instant(condition), &all(inner))).collect()
        }
        StatementKind::Break => plain("break"),
        StatementKind::Return => plain("return"),
    }
}

fn choice(k: usize, condition: Option<&Expr>, inner: &str) -> String {
    let head = match condition {
        None => "otherwise".to_string(),
        Some(condition) => {
            format!("{}if {}", if k == 0 { "" } else { "else " }, inline(&mathml::expression(condition)))
        }
    };
    block(&head, inner)
}

fn instant(condition: &Expr) -> String {
    format!("at the instant {}", inline(&mathml::expression(condition)))
}

/// `assert` and its like are sentences, so they stay text.
fn call(function: &ComponentRef, arguments: &Arguments) -> String {
    plain(&print_expr(&as_expression(function, arguments)))
}

fn as_expression(function: &ComponentRef, arguments: &Arguments) -> Expr {
    Expr { kind: ExprKind::Call(function.clone(), arguments.clone()), span: function.span }
}
