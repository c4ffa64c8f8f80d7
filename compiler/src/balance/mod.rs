//! Balances among the equations of a model: what is stored equals what comes in.
//!
//! A balance is an equation `left = right` in which the rate of one variable stands as a factor of exactly one term of the two sums:
//! Newton's law `m*der(v) = F - d*v`, the node of a circuit `C*der(u) = i`, a tank `A*der(h) = q`, heat `C*der(T) = P`.  The rate may
//! have a name of its own (`a = der(v)`).  Recognised is the form of the text alone; factors of the rate are taken to be positive,
//! as masses, capacities and areas are.
//!
//! Many write a balance solved for the rate: `der(p) = E/V*(q - k*p)`, `der(v) = (F - d*v)/m`, `der(h) = q/A - k/A*sqrt(h)`.  Then what comes in
//! stands behind a factor, and there may be two readings: divisors of all terms (`1/A`), or these and what else multiplies the sum (`E/V`).
//! The form does not say which; units do, and both are given.

use hyd_source::Files;
use hyd_syntax::tree::{Arguments, BinaryOp, ClassBody, ComponentRef, EquationKind, Expr, ExprKind, UnaryOp};

use crate::injection::InjectionSite;

pub use elements::Element;
pub use factors::Factor;
pub(crate) use factors::factors;

mod elements;
mod factors;

/// An equation that says what a stored quantity follows from.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Balance {
    /// The equation.
    pub site: InjectionSite,
    /// The equations that its text gives, as far as they can be told apart and are known by [`InjectionSite::elements`].
    pub elements: Vec<Element>,
    /// The variable whose rate stands in it, by its name in the component: `v`, `port.T`, `T[i]`.
    pub state: String,
    /// The rate as it is written: `der(v)`, or the name of a variable that is the rate.
    pub rate: String,
    /// The term that stores: `m*der(v)`.
    pub storage: String,
    /// Names of the component in that term, as bytes of it from and to.
    pub names: Vec<(usize, usize)>,
    /// What is added on the right side takes away from what is stored.
    pub is_reversed: bool,
    /// Where the equation is solved for the rate: what may stand between the rate and what comes in.
    pub scaled: Vec<Scaled>,
    /// The variable of which `state` is the rate: the position of a velocity, the charge of a current.
    pub integral: Option<String>,
    /// Names that stand in the equation.
    pub mentions: Vec<String>,
}

/// A reading of an equation that is solved for the rate.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Scaled {
    /// What multiplies that which comes in: `E/V`, `1/m`.
    pub factor: Factor,
    /// The term that stores then: `V/E*der(p)`, `m*der(v)`.
    pub storage: String,
    /// Names of the component in that term, as bytes of it from and to.
    pub names: Vec<(usize, usize)>,
}

/// The balances among the equations to which terms can be added, in their order.
pub fn balances(sites: &[InjectionSite]) -> Vec<Balance> {
    let read: Vec<Option<(Expr, Expr, String)>> = sites.iter().map(|site| sides(&site.text)).collect();
    let read = || sites.iter().zip(&read).filter_map(|(site, sides)| Some((site, sides.as_ref()?)));
    // `der(x) = y` and `y = der(x)`: component, x, y.
    let mut named: Vec<(&str, String, String)> = Vec::new();
    for (site, (left, right, text)) in read() {
        for (one, other) in [(left, right), (right, left)] {
            if let (Some(of), ExprKind::Ref(name)) = (rate_of(one), &other.kind) {
                named.push((&site.path, written(text, of.span).into(), written(text, name.span).into()));
            }
        }
    }
    let mut found = Vec::new();
    for (site, (left, right, text)) in read().filter(|(site, _)| site.refused.is_none()) {
        let is_name = |side: &Expr| rate_of(side).is_some() || matches!(side.kind, ExprKind::Ref(_));
        if is_name(left) && is_name(right) && (rate_of(left).is_some() || rate_of(right).is_some()) {
            // It says what the rate is called.
            continue;
        }
        let terms = terms_of(left, right);
        let own = |name: &&(&str, String, String)| *name.0 == *site.path;
        let mut stores = Vec::new();
        for (term, is_negative) in terms {
            let mut rates = Vec::new();
            walk(term, &mut |part| {
                if let Some(of) = rate_of(part) {
                    rates.push((part.span, written(text, of.span).to_string()));
                } else if let ExprKind::Ref(name) = &part.kind {
                    let name = written(text, name.span);
                    let state = named
                        .iter()
                        .filter(own)
                        .find(|(_, _, called)| called == name && is_of_second_order(&named, site, called));
                    rates.extend(state.map(|(_, state, _)| (part.span, state.clone())));
                }
            });
            stores.extend(rates.into_iter().map(|rate| (term, is_negative, rate)));
        }
        let [(term, is_negative, (span, state))] = &stores[..] else { continue };
        let Some(turns) = factor(term, *span) else { continue };
        let names = names_in(term);
        let factors = site.factors.iter().filter(|_| term.span == *span);
        let scaled = factors.filter_map(|factor| scaled(factor, written(text, *span))).collect();
        let mut mentions = Vec::new();
        for side in [left, right] {
            walk(side, &mut |part| {
                if let ExprKind::Ref(name) = &part.kind {
                    mentions.push(written(text, name.span).to_string());
                }
            });
        }
        let rate = written(text, *span);
        let element = |names: &Vec<String>| {
            let mut found = names.iter().filter_map(|name| Element::of(&site.path, rate, name));
            // One that stands in it twice does not say which of the two is meant.
            found.next().filter(|_| found.next().is_none())
        };
        let integral = named.iter().filter(own).find(|(_, _, rate)| rate == state).map(|(_, of, _)| of.clone());
        found.push(Balance {
            site: site.clone(),
            elements: site.elements.iter().filter_map(element).collect(),
            state: state.clone(),
            rate: rate.to_string(),
            storage: written(text, term.span).to_string(),
            names,
            is_reversed: is_negative ^ turns,
            scaled,
            integral,
            mentions,
        });
    }
    found
}

/// The terms of an equation, all on the left side, and whether each is taken away.
fn terms_of<'e>(left: &'e Expr, right: &'e Expr) -> Vec<(&'e Expr, bool)> {
    let mut terms = Vec::new();
    sum(left, false, &mut terms);
    sum(right, true, &mut terms);
    terms
}

/// Names in a term, as bytes of it from and to.
fn names_in(term: &Expr) -> Vec<(usize, usize)> {
    let begin = term.span.start as usize;
    let mut names = Vec::new();
    walk(term, &mut |part| {
        if let ExprKind::Ref(name) = &part.kind {
            names.push((name.span.start as usize - begin, name.span.end as usize - begin));
        }
    });
    names
}

/// The reading of a balance with a factor.
fn scaled(factor: &Factor, rate: &str) -> Option<Scaled> {
    let storage = format!("{}*{rate}", factor.inverse);
    let (term, _, _) = sides(&format!("{storage} = 0"))?;
    Some(Scaled { factor: factor.clone(), names: names_in(&term), storage })
}

/// True if the variable is a rate only, not one that is integrated elsewhere: `a = der(v)`, but not the `v` of `der(s) = v; m*der(v) = F`.
fn is_of_second_order(named: &[(&str, String, String)], site: &InjectionSite, called: &str) -> bool {
    // A velocity is a rate, too, but the terms it stands in do not store it.
    let states = named.iter().filter(|(path, ..)| *path == &*site.path);
    let of = |name: &str| states.clone().find(|(_, _, rate)| rate == name).map(|(_, of, _)| of.clone());
    let is_state = states.clone().any(|(_, state, _)| state == called);
    !is_state && of(called).is_some_and(|velocity| of(&velocity).is_some())
}

/// The sides of an equation, with the text in which their spans count.
pub(crate) fn sides(equation: &str) -> Option<(Expr, Expr, String)> {
    let text = format!("model T equation {};\nend T;\n", equation.trim().trim_end_matches(';'));
    let file = Files::new().add("equation", text.as_str());
    let parsed = hyd_syntax::parse(file, &text);
    let ClassBody::Long { equations, .. } = &parsed.value.classes.first()?.body else { return None };
    match &equations.first()?.equations.first()?.kind {
        EquationKind::Equal(left, right) if parsed.diagnostics.is_empty() => Some((left.clone(), right.clone(), text)),
        _ => None,
    }
}

pub(crate) fn written(text: &str, span: hyd_source::Span) -> &str {
    &text[span.start as usize..span.end as usize]
}

/// The `x` of `der(x)`.
pub(crate) fn rate_of(expression: &Expr) -> Option<&ComponentRef> {
    let ExprKind::Call(function, Arguments::List { positional, .. }) = &expression.kind else { return None };
    let [of] = &positional[..] else { return None };
    match &of.kind {
        ExprKind::Ref(name) if function.parts.len() == 1 && &*function.parts[0].name.name == "der" => Some(name),
        _ => None,
    }
}

/// The terms of a sum, and whether each is taken away.
fn sum<'e>(expression: &'e Expr, is_negative: bool, terms: &mut Vec<(&'e Expr, bool)>) {
    match &expression.kind {
        ExprKind::Binary(BinaryOp::Add, left, right) => {
            sum(left, is_negative, terms);
            sum(right, is_negative, terms);
        }
        ExprKind::Binary(BinaryOp::Sub, left, right) => {
            sum(left, is_negative, terms);
            sum(right, !is_negative, terms);
        }
        ExprKind::Unary(UnaryOp::Minus, inner) => sum(inner, !is_negative, terms),
        ExprKind::Unary(UnaryOp::Plus, inner) => sum(inner, is_negative, terms),
        ExprKind::Tuple(parts) if parts.len() == 1 => match &parts[0] {
            Some(inner) => sum(inner, is_negative, terms),
            None => terms.push((expression, is_negative)),
        },
        _ => terms.push((expression, is_negative)),
    }
}

/// Whether what stands at `span` turns its sign on the way to the whole product; none if it is not a factor of it.
fn factor(expression: &Expr, span: hyd_source::Span) -> Option<bool> {
    if expression.span == span {
        return Some(false);
    }
    match &expression.kind {
        ExprKind::Binary(BinaryOp::Mul, left, right) => {
            let other = if factor(left, span).is_some() { right } else { left };
            let inner = factor(left, span).or_else(|| factor(right, span))?;
            Some(inner ^ is_negative(other))
        }
        ExprKind::Binary(BinaryOp::Div, left, right) => Some(factor(left, span)? ^ is_negative(right)),
        ExprKind::Unary(UnaryOp::Minus, inner) => Some(!factor(inner, span)?),
        ExprKind::Tuple(parts) if parts.len() == 1 => factor(parts[0].as_ref()?, span),
        _ => None,
    }
}

fn is_negative(expression: &Expr) -> bool {
    match &expression.kind {
        ExprKind::Unary(UnaryOp::Minus, inner) => !is_negative(inner),
        ExprKind::Tuple(parts) if parts.len() == 1 => parts[0].as_ref().is_some_and(is_negative),
        _ => false,
    }
}

/// All parts of an expression.  What a condition chooses or a function is given counts, too.
pub(crate) fn walk<'e>(expression: &'e Expr, visit: &mut dyn FnMut(&'e Expr)) {
    visit(expression);
    match &expression.kind {
        ExprKind::Call(_, Arguments::List { positional, named }) => {
            positional.iter().chain(named.iter().map(|(_, value)| value)).for_each(|part| walk(part, visit));
        }
        ExprKind::Unary(_, inner) | ExprKind::Field(inner, _) => walk(inner, visit),
        ExprKind::Binary(_, left, right) => {
            walk(left, visit);
            walk(right, visit);
        }
        ExprKind::If(branches, last) => {
            for (condition, value) in branches {
                walk(condition, visit);
                walk(value, visit);
            }
            walk(last, visit);
        }
        ExprKind::Tuple(parts) => parts.iter().flatten().for_each(|part| walk(part, visit)),
        ExprKind::Array(parts) => parts.iter().for_each(|part| walk(part, visit)),
        _ => {}
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{Balance, balances};
    use crate::{Goal, Options, SourceText, Sources, injection_sites};

    struct Nothing;

    impl Sources for Nothing {
        fn find(&mut self, _: &[std::sync::Arc<str>]) -> Result<Option<SourceText>, String> {
            Ok(None)
        }
    }

    fn options() -> Options {
        Options { model: None, set: Vec::new(), goal: Goal::Check, clock: || 0.0 }
    }

    fn of(text: &str) -> Vec<Balance> {
        let (sites, compilation) = injection_sites(&mut Nothing, "model.mo", text, &options());
        assert!(!compilation.has_errors(), "{:?}", compilation.diagnostics);
        balances(&sites)
    }

    #[test]
    fn what_stores_is_found_whatever_the_side() {
        let model = |equations: &str| {
            format!(
                "model M\n  parameter Real m = 2; parameter Real n = 3; Real x(start = 1); Real v(start = 0); Real a;\n\
                 equation\n{equations}end M;\n"
            )
        };
        for (equations, storage, is_reversed, integral) in [
            ("der(x) = v;\nm*der(v) = -n*x;\na = 0;\n", "m*der(v)", false, Some("x")),
            ("v = der(x);\n0 = -n*x - m*der(v);\na = 0;\n", "m*der(v)", false, Some("x")),
            ("v = der(x);\nn*x + (m + n)*der(v) = 0;\na = 0;\n", "(m + n)*der(v)", false, Some("x")),
            ("v = der(x);\n-n*x = m*der(v);\na = 0;\n", "m*der(v)", true, Some("x")),
            ("v = der(x);\nn*x = m*(-der(v));\na = 0;\n", "m*(-der(v))", false, Some("x")),
            ("der(x) = v;\nder(v) = a;\nm*a = -n*x;\n", "m*a", false, Some("x")),
            ("der(x) = v;\nder(v) = -n*x/m;\na = 0;\n", "der(v)", false, Some("x")),
            ("v = 1;\na = 2;\nder(x)*m = if time < 1 then v else a;\n", "der(x)*m", false, None),
        ] {
            let found = of(&model(equations));
            let [one] = &found[..] else { panic!("{equations}{found:?}") };
            let said = (one.storage.as_str(), one.is_reversed, one.integral.as_deref());
            assert_eq!(said, (storage, is_reversed, integral), "{equations}");
            assert_eq!(one.state, if integral.is_some() { "v" } else { "x" }, "{equations}");
        }
        // Two rates in one equation, a rate inside a function, what only says that something is a rate.
        for equations in ["der(x) = v;\nm*der(v) + n*der(a) = -x;\nder(a) = v;\n", "sin(der(x)) = v;\nv = 1;\na = 2;\n"]
        {
            let found = of(&model(equations));
            assert!(found.is_empty(), "{found:?}");
        }
    }
}
