//! Expressions as people write them, on one line: `der(x)` with a fraction of differentials, powers raised, Greek letters shown.

use hyd_doc::mathml::letters;
use hyd_syntax::print_expr;
use hyd_syntax::tree::{Arguments, BinaryOp, ComponentRef, Equation, EquationKind, Expr, ExprKind, UnaryOp};

/// How tightly forms hold together.
mod level {
    pub(super) const ANY: u8 = 0;
    pub(super) const RELATION: u8 = 2;
    pub(super) const SUM: u8 = 3;
    pub(super) const PRODUCT: u8 = 4;
    pub(super) const POWER: u8 = 5;
    pub(super) const PRIMARY: u8 = 6;
}

/// An equation; none for those that are more than two sides.
pub(crate) fn equation(equation: &Equation) -> Option<String> {
    match &equation.kind {
        EquationKind::Equal(left, right) => Some(format!("{} = {}", expression(left), expression(right))),
        _ => None,
    }
}

/// An expression.
pub(crate) fn expression(expr: &Expr) -> String {
    at_least(expr, level::ANY)
}

fn at_least(expr: &Expr, least: u8) -> String {
    let (shown, level) = form(expr);
    if level < least { format!("({shown})") } else { shown }
}

fn form(expr: &Expr) -> (String, u8) {
    match &expr.kind {
        ExprKind::Ref(name) => (reference(name), level::PRIMARY),
        ExprKind::Unary(UnaryOp::Minus, value) => (format!("−{}", at_least(value, level::PRODUCT)), level::SUM),
        ExprKind::Unary(UnaryOp::Not, value) => (format!("¬{}", at_least(value, level::PRIMARY)), level::RELATION),
        ExprKind::Binary(op, left, right) => binary(*op, left, right),
        ExprKind::Call(function, Arguments::List { positional, named }) if named.is_empty() => {
            call(function, positional)
        }
        ExprKind::If(branches, otherwise) => {
            let one = |(condition, value): &(Expr, Expr)| format!("{} if {}", expression(value), expression(condition));
            let branches: Vec<String> = branches.iter().map(one).collect();
            (format!("{{ {}; else {} }}", branches.join("; "), expression(otherwise)), level::PRIMARY)
        }
        _ => (print_expr(expr), level::PRIMARY),
    }
}

fn binary(op: BinaryOp, left: &Expr, right: &Expr) -> (String, u8) {
    let infix = |sign: &str, own: u8, right_least: u8| {
        (format!("{}{sign}{}", at_least(left, own), at_least(right, right_least)), own)
    };
    match op {
        BinaryOp::Add => infix(" + ", level::SUM, level::PRODUCT),
        BinaryOp::Sub => infix(" − ", level::SUM, level::PRODUCT),
        BinaryOp::Mul => infix("·", level::PRODUCT, level::PRODUCT),
        BinaryOp::Div => infix("/", level::PRODUCT, level::POWER),
        BinaryOp::Pow => match &right.kind {
            ExprKind::Integer(power) => (format!("{}{}", at_least(left, level::PRIMARY), raised(*power)), level::POWER),
            _ => infix("^", level::PRIMARY, level::PRIMARY),
        },
        BinaryOp::Equal => infix(" = ", level::RELATION, level::SUM),
        BinaryOp::NotEqual => infix(" ≠ ", level::RELATION, level::SUM),
        BinaryOp::Less => infix(" < ", level::RELATION, level::SUM),
        BinaryOp::LessEqual => infix(" ≤ ", level::RELATION, level::SUM),
        BinaryOp::Greater => infix(" > ", level::RELATION, level::SUM),
        BinaryOp::GreaterEqual => infix(" ≥ ", level::RELATION, level::SUM),
        BinaryOp::And => infix(" ∧ ", level::RELATION, level::RELATION),
        BinaryOp::Or => infix(" ∨ ", level::ANY, level::ANY),
        BinaryOp::ElementAdd
        | BinaryOp::ElementSub
        | BinaryOp::ElementMul
        | BinaryOp::ElementDiv
        | BinaryOp::ElementPow => {
            let sign = match op {
                BinaryOp::ElementAdd => " .+ ",
                BinaryOp::ElementSub => " .− ",
                BinaryOp::ElementMul => " .* ",
                BinaryOp::ElementDiv => " ./ ",
                _ => " .^ ",
            };
            infix(sign, level::SUM, level::PRIMARY)
        }
    }
}

fn call(function: &ComponentRef, values: &[Expr]) -> (String, u8) {
    let name = function.parts.last().map_or("", |part| &*part.name.name);
    let shown = match (function.parts.len(), name, values) {
        (1, "der", [value]) => format!("d{}/dt", at_least(value, level::PRIMARY)),
        (1, "sqrt", [value]) => format!("√{}", at_least(value, level::PRIMARY)),
        (1, "abs", [value]) => format!("|{}|", expression(value)),
        (1, "noEvent", [value]) | (1, "smooth", [_, value]) => return form(value),
        _ => {
            let values: Vec<String> = values.iter().map(expression).collect();
            format!("{name}({})", values.join(", "))
        }
    };
    (shown, level::PRIMARY)
}

fn reference(reference: &ComponentRef) -> String {
    let part = |part: &hyd_syntax::tree::RefPart| {
        let name = letter(&part.name.name);
        let subscripts: Vec<String> = part.subscripts.iter().map(expression).collect();
        if subscripts.is_empty() { name } else { format!("{name}[{}]", subscripts.join(", ")) }
    };
    match &reference.parts[..] {
        [only] if &*only.name.name == "time" => "t".into(),
        [.., before, last] if &*before.name.name == "Constants" => letter(&last.name.name),
        parts => parts.iter().map(part).collect::<Vec<_>>().join("."),
    }
}

/// A name with its first word as a Greek letter where it is one.
fn letter(name: &str) -> String {
    let (first, rest) = name.split_once('_').map_or((name, None), |(first, rest)| (first, Some(rest)));
    let shown = letters(first);
    rest.map_or_else(|| shown.to_string(), |rest| format!("{shown}_{rest}"))
}

fn raised(power: i64) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digit = |c: char| c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize]);
    power.to_string().chars().map(digit).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn expressions_are_written_as_people_do() {
        for (text, shown) in [
            ("L*der(i) + R*i", "L·di/dt + R·i"),
            ("(a + b)*c/(d*e)", "(a + b)·c/(d·e)"),
            ("-rho_0*v^2/2", "−ρ_0·v²/2"),
            ("a - (b - c)", "a − (b − c)"),
            ("Hyd.Constants.pi*r^2*sqrt(p.v[2])", "π·r²·√p.v[2]"),
            ("noEvent(if x > 0 then x else abs(y))", "{ x if x > 0; else |y| }"),
            ("x^(1/3)", "x^(1/3)"),
        ] {
            let mut files = hyd_source::Files::new();
            let file = files.add("e", text);
            let parsed = hyd_syntax::parse_expression(file, text).value.unwrap();
            assert_eq!(expression(&parsed), shown);
        }
    }
}
