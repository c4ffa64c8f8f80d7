//! Elements of a balance: what names mean in one of the equations that a text gives in a loop, between arrays or in an array of components.
//!
//! An equation is known by its rate, `der(wall[2].T)` where `der(T)` is written in the class of `wall`, or `der(T[3])` where `der(T[i])` is
//! written in a loop: the subscripts of the component and the values of the counters follow from it.

use hyd_syntax::tree::{BinaryOp, ComponentRef, Expr, ExprKind, UnaryOp};

use super::written;

/// One of the equations that a text gives.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Element {
    /// The component with its subscripts, empty for the model itself.
    component: String,
    /// Subscripts of the component, in their order.
    of_component: Vec<usize>,
    /// Names in subscripts and their values.
    counters: Vec<(String, i64)>,
    /// Subscripts of whole arrays, where the equation is one between arrays.
    whole: Vec<usize>,
}

impl Element {
    /// The equation in which what is written as `rate` in the component at `path` (without subscripts) is `full`; none if it cannot be told.
    pub(crate) fn of(path: &str, rate: &str, full: &str) -> Option<Self> {
        let (rate, full) = match (inner(rate), inner(full)) {
            (Some(rate), Some(full)) => (rate, full),
            (None, None) => (rate, full),
            _ => return None,
        };
        let (rate, full) = (Name::read(rate)?, Name::read(full)?);
        let outer = if path.is_empty() { Vec::new() } else { Name::read(path)?.parts };
        if outer.len() + rate.parts.len() != full.parts.len() || outer.iter().any(|part| !part.subscripts.is_empty()) {
            return None;
        }
        let mut element = Self::default();
        let (own, local) = full.parts.split_at(outer.len());
        for (part, known) in own.iter().zip(&outer) {
            let at: Vec<usize> = part.numbers()?;
            if part.name != known.name {
                return None;
            }
            let dot = if element.component.is_empty() { "" } else { "." };
            element.component = format!("{}{dot}{}{}", element.component, part.name, brackets(&at));
            element.of_component.extend(at);
        }
        for (part, known) in local.iter().zip(&rate.parts) {
            let at: Vec<usize> = part.numbers()?;
            if part.name != known.name {
                return None;
            }
            if known.subscripts.is_empty() {
                element.whole.extend(at);
                continue;
            }
            if at.len() != known.subscripts.len() {
                return None;
            }
            for (subscript, at) in known.subscripts.iter().zip(at) {
                element.meets(subscript, i64::try_from(at).ok()?)?;
            }
        }
        Some(element)
    }

    /// Takes up what a subscript says of its counter; none if it says something else than is known.
    fn meets(&mut self, subscript: &Subscript, at: i64) -> Option<()> {
        let unknown: Vec<&String> =
            subscript.names.iter().filter(|name| self.counters.iter().all(|(known, _)| known != *name)).collect();
        match unknown[..] {
            [] => {}
            [name] => {
                // Linear in the counter.
                let mut with = |value: i64| {
                    self.counters.push((name.clone(), value));
                    let found = integer(&subscript.expression, &subscript.text, &self.counters);
                    self.counters.pop();
                    found
                };
                let (zero, one) = (with(0)?, with(1)?);
                let slope = one.checked_sub(zero).filter(|slope| *slope != 0)?;
                self.counters.push((name.clone(), at.checked_sub(zero)? / slope));
            }
            _ => return None,
        }
        (integer(&subscript.expression, &subscript.text, &self.counters)? == at).then_some(())
    }

    /// What a name of the component may be in this equation, by its path in the model: as it is written, and as the element of an array that is
    /// meant as a whole.  Empty where its subscripts are not known.
    pub fn names(&self, written: &str) -> Vec<String> {
        let plain = Name::read(written).and_then(|name| {
            let mut text = String::new();
            for part in &name.parts {
                let at: Option<Vec<usize>> = part
                    .subscripts
                    .iter()
                    .map(|own| integer(&own.expression, &own.text, &self.counters)?.try_into().ok())
                    .collect();
                let dot = if text.is_empty() { "" } else { "." };
                text = format!("{text}{dot}{}{}", part.name, brackets(&at?));
            }
            Some(if self.component.is_empty() { text } else { format!("{}.{text}", self.component) })
        });
        let whole =
            plain.iter().filter(|_| !self.whole.is_empty()).map(|own| format!("{own}{}", brackets(&self.whole)));
        plain.iter().cloned().chain(whole).collect()
    }

    /// Subscripts of the component.
    pub fn of_component(&self) -> &[usize] {
        &self.of_component
    }
}

/// Subscripts as they stand in names of variables.
fn brackets(at: &[usize]) -> String {
    if at.is_empty() {
        return String::new();
    }
    let list: Vec<String> = at.iter().map(usize::to_string).collect();
    format!("[{}]", list.join(","))
}

/// The `x` of `der(x)`.
fn inner(name: &str) -> Option<&str> {
    name.strip_prefix("der(")?.strip_suffix(')')
}

/// A name with its subscripts.
struct Name {
    parts: Vec<Part>,
}

struct Part {
    name: String,
    subscripts: Vec<Subscript>,
}

struct Subscript {
    expression: Expr,
    /// Text in which the spans of the expression count.
    text: String,
    /// Names in it.
    names: Vec<String>,
}

impl Name {
    fn read(name: &str) -> Option<Self> {
        let text = name.to_string();
        let file = hyd_source::Files::new().add("name", name);
        let parsed = hyd_syntax::parse_expression(file, name);
        if !parsed.diagnostics.is_empty() {
            return None;
        }
        let ExprKind::Ref(ComponentRef { parts, .. }) = parsed.value?.kind else { return None };
        let subscript = |expression: &Expr| {
            let mut names = Vec::new();
            super::walk(expression, &mut |part| {
                if let ExprKind::Ref(name) = &part.kind {
                    names.push(written(&text, name.span).to_string());
                }
            });
            names.sort_unstable();
            names.dedup();
            Subscript { expression: expression.clone(), text: text.clone(), names }
        };
        let part = |part: &hyd_syntax::tree::RefPart| Part {
            name: part.name.name.to_string(),
            subscripts: part.subscripts.iter().map(subscript).collect(),
        };
        Some(Self { parts: parts.iter().map(part).collect() })
    }
}

impl Part {
    fn numbers(&self) -> Option<Vec<usize>> {
        let number = |own: &Subscript| integer(&own.expression, &own.text, &[])?.try_into().ok();
        self.subscripts.iter().map(number).collect()
    }
}

/// The value of a subscript.
fn integer(expression: &Expr, text: &str, counters: &[(String, i64)]) -> Option<i64> {
    let value = |inner: &Expr| integer(inner, text, counters);
    match &expression.kind {
        ExprKind::Integer(value) => Some(*value),
        ExprKind::Ref(name) => {
            let name = written(text, name.span);
            counters.iter().find(|(known, _)| known == name).map(|(_, value)| *value)
        }
        ExprKind::Unary(UnaryOp::Minus, inner) => value(inner)?.checked_neg(),
        ExprKind::Unary(UnaryOp::Plus, inner) => value(inner),
        ExprKind::Binary(BinaryOp::Add, left, right) => value(left)?.checked_add(value(right)?),
        ExprKind::Binary(BinaryOp::Sub, left, right) => value(left)?.checked_sub(value(right)?),
        ExprKind::Binary(BinaryOp::Mul, left, right) => value(left)?.checked_mul(value(right)?),
        ExprKind::Tuple(parts) if parts.len() == 1 => value(parts[0].as_ref()?),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::Element;

    #[track_caller]
    fn check(of: (&str, &str, &str), name: &str, expected: &[&str]) {
        let element = Element::of(of.0, of.1, of.2);
        assert_eq!(element.map(|own| own.names(name)).unwrap_or_default(), expected, "{of:?} {name}");
    }

    #[test]
    fn names_are_those_of_the_element() {
        check(("", "der(T)", "der(T)"), "C", &["C"]);
        check(("wall", "der(T)", "der(wall[2].T)"), "port.T", &["wall[2].port.T"]);
        check(("a.b", "der(x)", "der(a[2].b[1,3].x)"), "m", &["a[2].b[1,3].m"]);
        check(("", "der(T[i])", "der(T[3])"), "C[i + 1]", &["C[4]"]);
        check(("", "der(T[5 - i])", "der(T[3])"), "C[i]", &["C[2]"]);
        check(("", "der(T[2*i - 1])", "der(T[5])"), "C[i]", &["C[3]"]);
        check(("rod", "der(T[i, 2])", "der(rod[1].T[4,2])"), "q[i].y", &["rod[1].q[4].y"]);
        check(("", "der(T)", "der(T[3])"), "C", &["C", "C[3]"]);
        check(("", "a[k]", "a[2]"), "m[k]", &["m[2]"]);
    }

    #[test]
    fn what_is_another_equation_is_none() {
        for of in [
            ("", "der(T)", "T"),
            ("", "der(T[2])", "der(T[3])"),
            ("", "der(T[2*i])", "der(T[5])"),
            ("", "der(T[i, i])", "der(T[1,2])"),
            ("wall", "der(T)", "der(floor[2].T)"),
            ("", "der(port.T)", "der(wall.T)"),
        ] {
            assert_eq!(Element::of(of.0, of.1, of.2), None, "{of:?}");
        }
        // A subscript that the rate does not tell.
        check(("", "der(T[i])", "der(T[3])"), "C[j]", &[]);
    }
}
