//! Expressions as MathML (W3C MathML Core), as they stand in books: fractions, roots, subscripts, derivatives, cases.
//!
//! `der(x)` becomes dx/dt, `rho` the letter, `p_R` a p with a subscript, `1e-3` a power of ten.  `noEvent` and `smooth`, which say how a
//! value is computed and not which, are left out.  Parentheses stand where a fraction or a root does not make them needless.

use hyd_syntax::tree::{Arguments, BinaryOp, ComponentRef, Expr, ExprKind, Iterator, UnaryOp};

use crate::html::escape;

/// How tightly forms hold together, from the loosest.
mod level {
    pub(super) const ANY: u8 = 0;
    pub(super) const OR: u8 = 1;
    pub(super) const AND: u8 = 2;
    pub(super) const RELATION: u8 = 3;
    pub(super) const SUM: u8 = 4;
    pub(super) const PRODUCT: u8 = 5;
    pub(super) const FRACTION: u8 = 6;
    pub(super) const PRIMARY: u8 = 7;
}

/// The expression as the children of a `math` element.
pub fn expression(expr: &Expr) -> String {
    at_least(expr, level::ANY)
}

/// The reference.
pub(crate) fn reference(reference: &ComponentRef) -> String {
    let parts: Vec<&str> = reference.parts.iter().map(|part| &*part.name.name).collect();
    match parts.as_slice() {
        ["time"] => return identifier("t"),
        [.., "Constants", "pi"] => return "<mi>\u{3c0}</mi>".into(),
        _ => {}
    }
    let shown = reference.parts.iter().map(|part| {
        let name = identifier(&part.name.name);
        match part.subscripts.as_slice() {
            [] => name,
            subscripts => format!("<msub>{name}<mrow>{}</mrow></msub>", list(subscripts)),
        }
    });
    let shown: Vec<String> = shown.collect();
    match shown.as_slice() {
        [one] => one.clone(),
        several => format!("<mrow>{}</mrow>", several.join("<mo lspace=\"0\" rspace=\"0\">.</mo>")),
    }
}

/// `k = 1, ..., n` for the iterators of a loop or a sum.
pub(crate) fn iterators(iterators: &[Iterator]) -> String {
    let one = |iterator: &Iterator| {
        let name = identifier(&iterator.name.name);
        match iterator.range.as_ref().map(|range| (&range.kind, range)) {
            None => name,
            Some((ExprKind::Range(from, None, to), _)) => {
                format!("{name}<mo>=</mo>{}<mo>,</mo><mo>…</mo><mo>,</mo>{}", expression(from), expression(to))
            }
            Some((_, range)) => format!("{name}<mo>∈</mo>{}", expression(range)),
        }
    };
    iterators.iter().map(one).collect::<Vec<_>>().join("<mo>,</mo>")
}

fn at_least(expr: &Expr, least: u8) -> String {
    let (shown, level) = form(&expr.kind);
    if level >= least { shown } else { parentheses(&shown) }
}

fn parentheses(inner: &str) -> String {
    format!("<mrow><mo>(</mo>{inner}<mo>)</mo></mrow>")
}

fn row(inner: &str) -> String {
    format!("<mrow>{inner}</mrow>")
}

fn list(values: &[Expr]) -> String {
    values.iter().map(expression).collect::<Vec<_>>().join("<mo>,</mo>")
}

/// What an expression looks like, and how tightly that holds together.
fn form(kind: &ExprKind) -> (String, u8) {
    let primary = |shown: String| (shown, level::PRIMARY);
    match kind {
        ExprKind::Integer(value) => primary(format!("<mn>{value}</mn>")),
        ExprKind::Real(value) => number(*value),
        ExprKind::Text(text) => primary(format!("<mtext>\"{}\"</mtext>", escape(text))),
        ExprKind::Boolean(value) => primary(format!("<mi>{value}</mi>")),
        ExprKind::Ref(name) => primary(reference(name)),
        ExprKind::Call(function, arguments) => call(function, arguments),
        ExprKind::Unary(op, value) => {
            let (sign, least) = match op {
                UnaryOp::Minus => ("<mo>−</mo>", level::PRODUCT),
                UnaryOp::Plus => ("<mo>+</mo>", level::PRODUCT),
                UnaryOp::Not => ("<mo>¬</mo>", level::PRIMARY),
            };
            let level = if *op == UnaryOp::Not { level::RELATION } else { level::SUM };
            (row(&format!("{sign}{}", at_least(value, least))), level)
        }
        ExprKind::Binary(op, left, right) => binary(*op, left, right),
        ExprKind::If(branches, otherwise) => (cases(branches, otherwise), level::FRACTION),
        ExprKind::Range(from, step, to) => {
            let parts = [Some(from), step.as_ref(), Some(to)].into_iter().flatten();
            let parts: Vec<String> = parts.map(|part| at_least(part, level::SUM)).collect();
            (row(&parts.join("<mo>:</mo>")), level::OR)
        }
        ExprKind::Array(values) => primary(row(&format!("<mo>{{</mo>{}<mo>}}</mo>", list(values)))),
        ExprKind::ArrayFor(value, over) => {
            let inner = format!("{}<mo>|</mo>{}", expression(value), iterators(over));
            primary(row(&format!("<mo>{{</mo>{inner}<mo>}}</mo>")))
        }
        ExprKind::Matrix(rows) => primary(matrix(rows)),
        ExprKind::Partial(function, given) => {
            let given = given.iter().map(|(name, e)| format!("{}<mo>=</mo>{}", identifier(&name.name), expression(e)));
            let given = parentheses(&given.collect::<Vec<_>>().join("<mo>,</mo>"));
            primary(row(&format!("{}{given}", reference(function))))
        }
        ExprKind::Tuple(slots) => {
            let slots: Vec<String> =
                slots.iter().map(|slot| slot.as_ref().map_or("<mo>·</mo>".to_string(), expression)).collect();
            primary(parentheses(&slots.join("<mo>,</mo>")))
        }
        ExprKind::Field(record, name) => {
            let shown = format!("{}<mo>.</mo>{}", at_least(record, level::PRIMARY), identifier(&name.name));
            primary(row(&shown))
        }
        ExprKind::Colon => primary("<mo>:</mo>".into()),
        ExprKind::End => primary("<mi>end</mi>".into()),
    }
}

fn binary(op: BinaryOp, left: &Expr, right: &Expr) -> (String, u8) {
    let infix = |sign: &str, level: u8, right_level: u8| {
        let shown = format!("{}<mo>{sign}</mo>{}", at_least(left, level), at_least(right, right_level));
        (row(&shown), level)
    };
    match op {
        BinaryOp::Add => infix("+", level::SUM, level::PRODUCT),
        BinaryOp::Sub => infix("−", level::SUM, level::PRODUCT),
        BinaryOp::Mul => infix("⋅", level::PRODUCT, level::PRODUCT),
        BinaryOp::ElementAdd => infix(".+", level::SUM, level::PRODUCT),
        BinaryOp::ElementSub => infix(".−", level::SUM, level::PRODUCT),
        BinaryOp::ElementMul => infix("⊙", level::PRODUCT, level::FRACTION),
        BinaryOp::ElementDiv => infix("⊘", level::PRODUCT, level::FRACTION),
        BinaryOp::Div => {
            (format!("<mfrac>{}{}</mfrac>", row(&expression(left)), row(&expression(right))), level::FRACTION)
        }
        BinaryOp::Pow | BinaryOp::ElementPow => {
            let shown = format!("<msup>{}{}</msup>", at_least(left, level::PRIMARY), row(&expression(right)));
            (shown, level::FRACTION)
        }
        BinaryOp::Equal => infix("=", level::RELATION, level::SUM),
        BinaryOp::NotEqual => infix("≠", level::RELATION, level::SUM),
        BinaryOp::Less => infix("&lt;", level::RELATION, level::SUM),
        BinaryOp::LessEqual => infix("≤", level::RELATION, level::SUM),
        BinaryOp::Greater => infix("&gt;", level::RELATION, level::SUM),
        BinaryOp::GreaterEqual => infix("≥", level::RELATION, level::SUM),
        BinaryOp::And => infix("∧", level::AND, level::RELATION),
        BinaryOp::Or => infix("∨", level::OR, level::AND),
    }
}

fn call(function: &ComponentRef, arguments: &Arguments) -> (String, u8) {
    let name = function.parts.last().map_or("", |part| &*part.name.name);
    let primary = |shown: String| (shown, level::PRIMARY);
    let Arguments::List { positional, named } = arguments else { return reduction(name, function, arguments) };
    if function.parts.len() == 1 && named.is_empty() {
        match (name, positional.as_slice()) {
            ("der", [value]) => {
                let above = row(&format!("<mi>d</mi>{}", at_least(value, level::PRIMARY)));
                return (format!("<mfrac>{above}<mrow><mi>d</mi><mi>t</mi></mrow></mfrac>"), level::FRACTION);
            }
            ("sqrt", [value]) => return primary(format!("<msqrt>{}</msqrt>", expression(value))),
            ("abs", [value]) => return primary(row(&format!("<mo>|</mo>{}<mo>|</mo>", expression(value)))),
            ("exp", [value]) => {
                return (format!("<msup><mi>e</mi>{}</msup>", row(&expression(value))), level::FRACTION);
            }
            ("noEvent", [value]) | ("smooth", [_, value]) => return form(&value.kind),
            _ => {}
        }
    }
    let mut shown: Vec<String> = positional.iter().map(expression).collect();
    shown
        .extend(named.iter().map(|(name, value)| format!("{}<mo>=</mo>{}", identifier(&name.name), expression(value))));
    let inner = parentheses(&shown.join("<mo>,</mo>"));
    primary(row(&format!("<mi>{}</mi><mo>&#x2061;</mo>{inner}", escape(name))))
}

/// `sum(e for k in 1:n)` and its like.
fn reduction(name: &str, function: &ComponentRef, arguments: &Arguments) -> (String, u8) {
    let Arguments::Reduction(value, over) = arguments else { return (String::new(), level::PRIMARY) };
    let sign = match name {
        "sum" => "<mo>∑</mo>".to_string(),
        "product" => "<mo>∏</mo>".to_string(),
        _ => reference(function),
    };
    let under = format!("<munder>{sign}{}</munder>", row(&iterators(over)));
    (row(&format!("{under}{}", at_least(value, level::PRODUCT))), level::SUM)
}

fn cases(branches: &[(Expr, Expr)], otherwise: &Expr) -> String {
    let cell = |inner: &str| format!("<mtd style=\"text-align:left\">{inner}</mtd>");
    let mut rows = String::new();
    for (condition, value) in branches {
        let when = format!("<mtext>if\u{a0}</mtext>{}", expression(condition));
        rows += &format!("<mtr>{}{}</mtr>", cell(&expression(value)), cell(&when));
    }
    rows += &format!("<mtr>{}{}</mtr>", cell(&expression(otherwise)), cell("<mtext>otherwise</mtext>"));
    // A line on the left: a brace that grows takes a font for mathematics, which not every machine has.
    format!("<mtable class=\"cases\">{rows}</mtable>")
}

fn matrix(rows: &[Vec<Expr>]) -> String {
    let cell = |value: &Expr| format!("<mtd>{}</mtd>", expression(value));
    let line = |values: &Vec<Expr>| format!("<mtr>{}</mtr>", values.iter().map(cell).collect::<String>());
    row(&format!("<mo>[</mo><mtable>{}</mtable><mo>]</mo>", rows.iter().map(line).collect::<String>()))
}

/// A number, with a power of ten where it is far from one.
fn number(value: f64) -> (String, u8) {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        return (format!("<mn>{value}</mn>"), level::PRIMARY);
    }
    let shown = format!("{value:e}");
    let (mantissa, exponent) = shown.split_once('e').unwrap_or((&shown, "0"));
    let exponent = match exponent.strip_prefix('-') {
        Some(digits) => format!("<mrow><mo>−</mo><mn>{digits}</mn></mrow>"),
        None => format!("<mn>{exponent}</mn>"),
    };
    let power = format!("<msup><mn>10</mn>{exponent}</msup>");
    if mantissa == "1" {
        return (power, level::FRACTION);
    }
    (row(&format!("<mn>{mantissa}</mn><mo>⋅</mo>{power}")), level::PRODUCT)
}

/// A name: what stands behind its first underscore becomes a subscript, Greek letters are shown.
pub(crate) fn identifier(name: &str) -> String {
    match name.split_once('_') {
        Some((head, tail)) if !head.is_empty() && !tail.is_empty() && !name.starts_with('\'') => {
            let tail: Vec<&str> = tail.split('_').map(letters).collect();
            format!("<msub>{}<mi>{}</mi></msub>", word(head), escape(&tail.join(" ")))
        }
        _ => word(name),
    }
}

fn word(name: &str) -> String {
    let shown = letters(name);
    format!("<mi>{}</mi>", escape(shown))
}

/// The Greek letter of this name, or the name.
pub fn letters(name: &str) -> &str {
    const GREEK: [(&str, &str); 26] = [
        ("alpha", "α"),
        ("beta", "β"),
        ("gamma", "γ"),
        ("delta", "δ"),
        ("epsilon", "ε"),
        ("zeta", "ζ"),
        ("eta", "η"),
        ("theta", "θ"),
        ("kappa", "κ"),
        ("lambda", "λ"),
        ("mu", "μ"),
        ("nu", "ν"),
        ("xi", "ξ"),
        ("pi", "π"),
        ("rho", "ρ"),
        ("sigma", "σ"),
        ("tau", "τ"),
        ("phi", "φ"),
        ("chi", "χ"),
        ("psi", "ψ"),
        ("omega", "ω"),
        ("Phi", "Φ"),
        ("Psi", "Ψ"),
        ("Delta", "Δ"),
        ("Omega", "Ω"),
        ("Theta", "Θ"),
    ];
    GREEK.iter().find(|(word, _)| *word == name).map_or(name, |(_, letter)| letter)
}
