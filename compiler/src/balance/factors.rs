//! What multiplies that which comes into a balance, where the equation is solved for the rate.

use hyd_syntax::tree::{BinaryOp, Expr, ExprKind, UnaryOp};

use super::{rate_of, sides, terms_of, walk, written};

/// What may multiply that which comes into a balance which is solved for the rate.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Factor {
    /// The factor: `E/V`, `1/m`.
    pub text: String,
    /// Its inverse: `V/E`, `m`.
    pub inverse: String,
    /// SI unit of what it multiplies, if the model decides it.
    pub unit: Option<String>,
}

/// What may multiply that which comes in, if the equation has one side or one term that is a rate or a name alone; units are not known yet; what the
/// divisors make comes first.
pub(crate) fn factors(equation: &str) -> Vec<Factor> {
    let Some((left, right, text)) = sides(equation) else { return Vec::new() };
    let terms = terms_of(&left, &right);
    let is_name = |term: &Expr| matches!(term.kind, ExprKind::Ref(_));
    // A named rate stands alone on its side; that of a variable may stand among the others.
    let is_rate =
        |term: &Expr| rate_of(term).is_some() || (is_name(term) && [left.span, right.span].contains(&term.span));
    let (rates, others): (Vec<&Expr>, Vec<&Expr>) =
        terms.into_iter().map(|(term, _)| term).partition(|term| is_rate(term));
    if rates.len() != 1 {
        return Vec::new();
    }
    let is_nothing = |term: &&&Expr| match term.kind {
        ExprKind::Integer(value) => value == 0,
        ExprKind::Real(value) => value == 0.0,
        _ => false,
    };
    let products: Vec<Product> = others
        .iter()
        .filter(|term| !is_nothing(term))
        .map(|term| {
            let mut product = Product::default();
            product.read(term, (false, false), &text);
            product
        })
        .collect();
    // Divisors of all, or of the only term that has any: `(F - d*v)/m - g`.
    let divided: Vec<&Product> = products.iter().filter(|product| !product.divisors.is_empty()).collect();
    let (divisors, turned) = match divided[..] {
        [one] => (one.divisors.clone(), one.turned.clone()),
        _ => (common(&products, |product| &product.divisors), common(&products, |product| &product.turned)),
    };
    let multipliers = match &products[..] {
        [one] if one.sums == 1 => one.multipliers.clone(),
        [_, _, ..] if divided.len() != 1 => common(&products, |product| &product.multipliers),
        _ => Vec::new(),
    };
    let written = |above: &[String], below: &[String]| {
        let above = if above.is_empty() { "1".to_string() } else { above.join("*") };
        match below {
            [] => above,
            [one] => format!("{above}/{one}"),
            _ => format!("{above}/({})", below.join("*")),
        }
    };
    let factor = |above: &[String], below: &[String]| Factor {
        text: written(above, below),
        inverse: written(below, above),
        unit: None,
    };
    let has_call =
        |parts: &[String]| parts.iter().any(|own| products.iter().any(|product| product.calls.contains(own)));
    let mut found = Vec::new();
    if has_call(&divisors) || has_call(&turned) {
        return found;
    }
    if !divisors.is_empty() {
        found.push(factor(&turned, &divisors));
    }
    if !multipliers.is_empty() && !has_call(&multipliers) {
        found.push(factor(&[turned, multipliers].concat(), &divisors));
    }
    found
}

/// A term as a product, without its sign.
#[derive(Default)]
struct Product {
    /// Factors but for sums in parentheses.
    multipliers: Vec<String>,
    /// Divisors.
    divisors: Vec<String>,
    /// Divisors of divisors, which belong to these: `1 + e` of `F/(m/(1 + e))`.
    turned: Vec<String>,
    /// How many sums in parentheses it multiplies.
    sums: usize,
    /// Those of the factors and divisors in which functions are called, whose names mean something in the text alone.
    calls: Vec<String>,
}

impl Product {
    /// `place`: the expression is a divisor; it stands somewhere in what divides.
    fn read(&mut self, expression: &Expr, (is_divisor, is_below): (bool, bool), text: &str) {
        match &expression.kind {
            ExprKind::Binary(BinaryOp::Mul, left, right) => {
                self.read(left, (is_divisor, is_below), text);
                self.read(right, (is_divisor, is_below), text);
            }
            ExprKind::Binary(BinaryOp::Div, left, right) => {
                self.read(left, (is_divisor, is_below), text);
                self.read(right, (!is_divisor, true), text);
            }
            ExprKind::Unary(UnaryOp::Minus | UnaryOp::Plus, inner) => self.read(inner, (is_divisor, is_below), text),
            ExprKind::Integer(1) => {}
            // A sum within a divisor is a part of the capacity, on whichever side of the line it ends up.
            ExprKind::Binary(BinaryOp::Add | BinaryOp::Sub, ..) if !is_below => self.sums += 1,
            _ => {
                let side = match (is_divisor, is_below) {
                    (true, _) => &mut self.divisors,
                    (false, true) => &mut self.turned,
                    (false, false) => &mut self.multipliers,
                };
                // Parentheses are part of the text of an expression.
                let own = written(text, expression.span);
                side.push(own.into());
                let mut has_call = false;
                walk(expression, &mut |part| has_call |= matches!(part.kind, ExprKind::Call(..)));
                self.calls.extend(has_call.then(|| own.to_string()));
            }
        }
    }
}

/// What all products have, as often as all have it.
fn common(products: &[Product], of: impl Fn(&Product) -> &Vec<String>) -> Vec<String> {
    let Some((first, rest)) = products.split_first() else { return Vec::new() };
    let mut rest: Vec<Vec<String>> = rest.iter().map(|product| of(product).clone()).collect();
    let mut found = Vec::new();
    for own in of(first) {
        let places: Option<Vec<usize>> = rest.iter().map(|other| other.iter().position(|text| text == own)).collect();
        if let Some(places) = places {
            rest.iter_mut().zip(places).for_each(|(other, k)| {
                other.remove(k);
            });
            found.push(own.clone());
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::factors;

    #[track_caller]
    fn check(equation: &str, expected: &[(&str, &str)]) {
        let found = factors(equation);
        let said: Vec<(&str, &str)> = found.iter().map(|own| (&*own.text, &*own.inverse)).collect();
        assert_eq!(said, expected, "{equation}");
    }

    #[test]
    fn divisors_and_what_else_multiplies_a_sum() {
        check("der(p) = E/V*(q - k*p);", &[("1/V", "V"), ("E/V", "V/E")]);
        check(
            "der(p) = -(q - k*p)*E/(V_0 + A*s)",
            &[("1/(V_0 + A*s)", "(V_0 + A*s)"), ("E/(V_0 + A*s)", "(V_0 + A*s)/E")],
        );
        check("(F - d*v)/m = der(v)", &[("1/m", "m")]);
        check("-der(v) = (d*v - F)/m", &[("1/m", "m")]);
        check("a = (F - d*v)/m", &[("1/m", "m")]);
        check("der(h) = q/A", &[("1/A", "A")]);
        check("der(v) = (F - d*v)/(m/(1 + e))", &[("(1 + e)/m", "m/(1 + e)")]);
        check("der(v) = (F - d*v)/(m_1*m_2/(m_1 + m_2))", &[("(m_1 + m_2)/(m_1*m_2)", "m_1*m_2/(m_1 + m_2)")]);
        check("der(i) = 1/L*(u - R*i)", &[("1/L", "L")]);
        check("der(T) = k*(T_a - T)/(m*c)", &[("1/(m*c)", "m*c"), ("k/(m*c)", "m*c/k")]);
    }

    #[test]
    fn what_all_terms_have() {
        check("der(h) = q/A - k/A*sqrt(h)", &[("1/A", "A")]);
        check("der(T) = P/(m*c) - h*(T - T_a)/(c*m)", &[("1/(m*c)", "m*c")]);
        check("der(p) = E/V*q_1 - E/V*q_2", &[("1/V", "V"), ("E/V", "V/E")]);
        check("der(p) = q/(2*C) - k*p/(2*C)", &[("1/(2*C)", "2*C")]);
        // Gravity beside one force that is divided.
        check("der(v) = (F - d*v)/m - g", &[("1/m", "m")]);
        check("0 = q/A - der(h)", &[("1/A", "A")]);
        check("0 = q/A - k/A*h - der(h)", &[("1/A", "A")]);
        // What a rate is called is known elsewhere.
        check("a = F/m - g", &[("1/m", "m")]);
        check("der(x) = (if x > 0 then a else b)/c", &[("1/c", "c")]);
    }

    #[test]
    fn where_nothing_says_what_is_stored() {
        for equation in [
            "m*der(v) = F",
            "der(h) = q",
            "der(h) = k*q",
            "der(T) = P/C - (T - T_a)/tau",
            "der(v) = F - d*v",
            "a = b",
            "v*a = b/c",
            "der(h) = (q - k*h)/area(h)",
        ] {
            check(equation, &[]);
        }
    }
}
