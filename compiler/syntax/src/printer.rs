//! Trees back to Modelica text, with as few parentheses as the grammar allows.
//!
//! Used by messages, by the pages of libraries and wherever text of a model is written; `hyd fmt` works on tokens
//! instead.  Reading the printed text gives the same tree (spans apart); layout and comments of the original are not
//! kept.

use crate::build_expr::{BINARY, level};
use crate::tree::{Arguments, ComponentRef, Expr, ExprKind, Iterator, Path, UnaryOp};

/// The expression as Modelica text on one line.
pub fn print_expr(expr: &Expr) -> String {
    let mut out = String::new();
    write_expr(&mut out, expr, 0);
    out
}

/// The reference as Modelica text: `a[1].b`.
pub fn print_reference(reference: &ComponentRef) -> String {
    let mut out = String::new();
    write_reference(&mut out, reference);
    out
}

/// The dotted name: `Hyd.Units.Pressure`.
pub fn print_path(path: &Path) -> String {
    let parts: Vec<&str> = path.parts.iter().map(|part| &*part.name).collect();
    format!("{}{}", if path.global { "." } else { "" }, parts.join("."))
}

/// A string literal with its quotes: whatever the text holds, reading the literal gives it back.
pub fn print_string(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            '\r' => out.push_str("\\r"),
            '\u{7}' => out.push_str("\\a"),
            '\u{8}' => out.push_str("\\b"),
            '\u{c}' => out.push_str("\\f"),
            '\u{b}' => out.push_str("\\v"),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// Writes `expr` where only what binds at least as tightly as `least` can stand without parentheses.
fn write_expr(out: &mut String, expr: &Expr, least: u8) {
    let open = binding(&expr.kind) < least;
    if open {
        out.push('(');
    }
    match &expr.kind {
        ExprKind::Unary(op, value) => write_unary(out, *op, value),
        ExprKind::Binary(op, left, right) => {
            let (word, _, level) = BINARY.iter().find(|(_, other, _)| other == op).copied().unwrap_or(BINARY[0]);
            let chains = level != level::RELATION && level != level::POWER;
            write_expr(out, left, if chains { level } else { level + 1 });
            let tight = level >= level::PRODUCT && !(word.starts_with('.') && ends_with_digit(out));
            out.push_str(&if tight { word.to_string() } else { format!(" {word} ") });
            write_expr(out, right, level + 1);
        }
        ExprKind::Range(start, step, stop) => {
            for part in [Some(start), step.as_ref()].into_iter().flatten() {
                write_expr(out, part, level::OR);
                out.push(':');
            }
            write_expr(out, stop, level::OR);
        }
        ExprKind::If(branches, otherwise) => write_if(out, branches, otherwise),
        other => write_primary(out, other),
    }
    if open {
        out.push(')');
    }
}

/// How tightly an expression holds together.
fn binding(kind: &ExprKind) -> u8 {
    match kind {
        ExprKind::If(..) => 0,
        ExprKind::Range(..) => level::RANGE,
        ExprKind::Unary(UnaryOp::Not, _) => level::NOT,
        ExprKind::Unary(..) => level::SUM,
        ExprKind::Binary(op, ..) => BINARY.iter().find(|(_, other, _)| other == op).map_or(0, |entry| entry.2),
        _ => level::PRIMARY,
    }
}

fn ends_with_digit(out: &str) -> bool {
    out.ends_with(|c: char| c.is_ascii_digit())
}

fn write_unary(out: &mut String, op: UnaryOp, value: &Expr) {
    let (word, least) = match op {
        UnaryOp::Minus => ("-", level::PRODUCT),
        UnaryOp::Plus => ("+", level::PRODUCT),
        UnaryOp::Not => ("not ", level::RELATION),
    };
    out.push_str(word);
    write_expr(out, value, least);
}

fn write_if(out: &mut String, branches: &[(Expr, Expr)], otherwise: &Expr) {
    for (k, (condition, value)) in branches.iter().enumerate() {
        out.push_str(if k == 0 { "if " } else { " elseif " });
        write_expr(out, condition, 0);
        out.push_str(" then ");
        write_expr(out, value, 0);
    }
    out.push_str(" else ");
    write_expr(out, otherwise, 0);
}

fn write_primary(out: &mut String, kind: &ExprKind) {
    match kind {
        ExprKind::Integer(value) => out.push_str(&value.to_string()),
        ExprKind::Real(value) => out.push_str(&format!("{value:?}")),
        ExprKind::Text(text) => out.push_str(&print_string(text)),
        ExprKind::Boolean(value) => out.push_str(&value.to_string()),
        ExprKind::Ref(reference) => write_reference(out, reference),
        ExprKind::Call(function, arguments) => {
            write_reference(out, function);
            write_arguments(out, arguments);
        }
        ExprKind::Partial(function, given) => {
            out.push_str("function ");
            write_reference(out, function);
            out.push('(');
            for (k, (name, value)) in given.iter().enumerate() {
                out.push_str(if k == 0 { "" } else { ", " });
                out.push_str(&name.name);
                out.push_str(" = ");
                write_expr(out, value, 0);
            }
            out.push(')');
        }
        ExprKind::Array(values) => {
            out.push('{');
            write_list(out, values);
            out.push('}');
        }
        ExprKind::ArrayFor(value, iterators) => {
            out.push('{');
            write_expr(out, value, 0);
            out.push_str(" for ");
            write_iterators(out, iterators);
            out.push('}');
        }
        ExprKind::Matrix(rows) => {
            out.push('[');
            for (k, row) in rows.iter().enumerate() {
                out.push_str(if k == 0 { "" } else { "; " });
                write_list(out, row);
            }
            out.push(']');
        }
        ExprKind::Tuple(slots) => {
            out.push('(');
            for (k, slot) in slots.iter().enumerate() {
                out.push_str(if k == 0 { "" } else { ", " });
                slot.iter().for_each(|value| write_expr(out, value, 0));
            }
            out.push(')');
        }
        ExprKind::Field(record, name) => {
            write_expr(out, record, level::PRIMARY);
            out.push('.');
            out.push_str(&name.name);
        }
        ExprKind::Colon => out.push(':'),
        ExprKind::End => out.push_str("end"),
        ExprKind::Unary(..) | ExprKind::Binary(..) | ExprKind::Range(..) | ExprKind::If(..) => {}
    }
}

fn write_list(out: &mut String, values: &[Expr]) {
    for (k, value) in values.iter().enumerate() {
        out.push_str(if k == 0 { "" } else { ", " });
        write_expr(out, value, 0);
    }
}

fn write_reference(out: &mut String, reference: &ComponentRef) {
    for (k, part) in reference.parts.iter().enumerate() {
        out.push_str(if k == 0 && !reference.global { "" } else { "." });
        out.push_str(&part.name.name);
        write_subscripts(out, &part.subscripts);
    }
}

fn write_subscripts(out: &mut String, subscripts: &[Expr]) {
    if !subscripts.is_empty() {
        out.push('[');
        write_list(out, subscripts);
        out.push(']');
    }
}

fn write_arguments(out: &mut String, arguments: &Arguments) {
    out.push('(');
    match arguments {
        Arguments::List { positional, named } => {
            write_list(out, positional);
            for (k, (name, value)) in named.iter().enumerate() {
                out.push_str(if k == 0 && positional.is_empty() { "" } else { ", " });
                out.push_str(&name.name);
                out.push_str(" = ");
                write_expr(out, value, 0);
            }
        }
        Arguments::Reduction(value, iterators) => {
            write_expr(out, value, 0);
            out.push_str(" for ");
            write_iterators(out, iterators);
        }
    }
    out.push(')');
}

fn write_iterators(out: &mut String, iterators: &[Iterator]) {
    for (k, iterator) in iterators.iter().enumerate() {
        out.push_str(if k == 0 { "" } else { ", " });
        out.push_str(&iterator.name.name);
        if let Some(range) = &iterator.range {
            out.push_str(" in ");
            write_expr(out, range, 0);
        }
    }
}
