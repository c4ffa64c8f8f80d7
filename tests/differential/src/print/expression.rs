//! Expressions as text, with no more parentheses than the grammar needs.

use super::{Printer, number};
use crate::model::{Expr, Operator, Range, Subscript};

/// How tightly operators bind, from `or` to primaries.
mod level {
    pub(super) const OR: u8 = 1;
    pub(super) const AND: u8 = 2;
    pub(super) const NOT: u8 = 3;
    pub(super) const RELATION: u8 = 4;
    pub(super) const SUM: u8 = 5;
    pub(super) const PRODUCT: u8 = 6;
    pub(super) const POWER: u8 = 7;
    pub(super) const PRIMARY: u8 = 8;
}

fn binding(operator: Operator) -> u8 {
    match operator {
        Operator::Or => level::OR,
        Operator::And => level::AND,
        Operator::Add | Operator::Subtract => level::SUM,
        Operator::Multiply | Operator::Divide | Operator::MultiplyEach | Operator::DivideEach => level::PRODUCT,
        Operator::Power | Operator::PowerEach => level::POWER,
        _ => level::RELATION,
    }
}

impl Printer<'_> {
    /// An expression as it stands alone.
    pub fn expr(&self, e: &Expr) -> String {
        self.at(e, 0)
    }

    /// A range.
    pub fn range(&self, range: &Range) -> String {
        let (from, to) = (self.at(&range.from, level::SUM), self.at(&range.to, level::SUM));
        match range.step {
            None => format!("{from}:{to}"),
            Some(step) => format!("{from}:{step}:{to}"),
        }
    }

    /// Subscripts in brackets, nothing if there are none.
    pub fn subscripts(&self, list: &[Subscript]) -> String {
        if list.is_empty() {
            return String::new();
        }
        let one = |subscript: &Subscript| match subscript {
            Subscript::At(e) => self.expr(e),
            Subscript::Slice(range) => self.range(range),
            Subscript::All => ":".to_string(),
        };
        format!("[{}]", list.iter().map(one).collect::<Vec<_>>().join(", "))
    }

    fn list(&self, list: &[Expr]) -> String {
        list.iter().map(|e| self.expr(e)).collect::<Vec<_>>().join(", ")
    }

    fn iterators(&self, list: &[(String, Range)]) -> String {
        list.iter().map(|(name, range)| format!("{name} in {}", self.range(range))).collect::<Vec<_>>().join(", ")
    }

    /// An expression where operators must bind at least so tightly.
    fn at(&self, e: &Expr, least: u8) -> String {
        let (text, own) = self.bare(e);
        if own < least { format!("({text})") } else { text }
    }

    fn bare(&self, e: &Expr) -> (String, u8) {
        let primary = |text: String| (text, level::PRIMARY);
        match e {
            Expr::Number(v) if *v < 0.0 => (number(*v), level::SUM),
            Expr::Number(v) => primary(number(*v)),
            Expr::Truth(b) => primary(b.to_string()),
            Expr::Literal(k) => primary(format!("Mode.{}", crate::model::LITERALS[k - 1])),
            Expr::Time => primary("time".into()),
            Expr::Name(id, list) => primary(self.name(*id, list)),
            Expr::Local(name, list) => match self.value_of(name) {
                Some(k) if list.is_empty() && k < 0 => (k.to_string(), level::SUM),
                Some(k) if list.is_empty() => primary(k.to_string()),
                _ => primary(format!("{name}{}", self.subscripts(list))),
            },
            Expr::Field(e, name) => primary(format!("{}.{name}", self.at(e, level::PRIMARY))),
            Expr::Record(component) => primary(self.model.components[*component].name.clone()),
            Expr::Construct(class, fields, named) => {
                let one = |(name, e): &(String, Expr)| match named {
                    true => format!("{name} = {}", self.expr(e)),
                    false => self.expr(e),
                };
                primary(format!("{class}({})", fields.iter().map(one).collect::<Vec<_>>().join(", ")))
            }
            Expr::Pre(id, list) => primary(format!("pre({})", self.name(*id, list))),
            Expr::Edge(id, list) => primary(format!("edge({})", self.name(*id, list))),
            Expr::Change(id, list) => primary(format!("change({})", self.name(*id, list))),
            Expr::Der(e) => primary(format!("der({})", self.expr(e))),
            // A sign binds as a sum does, and what follows it as a product.
            Expr::Minus(e) => (format!("-{}", self.at(e, level::PRODUCT)), level::SUM),
            Expr::Not(e) => (format!("not {}", self.at(e, level::RELATION)), level::NOT),
            Expr::Binary(operator, a, b) => {
                let own = binding(*operator);
                let (left, right) = match own {
                    level::RELATION | level::POWER => (own + 1, own + 1),
                    _ => (own, own + 1),
                };
                (format!("{} {} {}", self.at(a, left), operator.text(), self.at(b, right)), own)
            }
            // What a loop that is written out decides: the other branch may have subscripts that do not exist.
            Expr::If(branches, otherwise) if branches.len() == 1 && self.known(&branches[0].0).is_some() => {
                self.bare(if self.known(&branches[0].0) == Some(true) { &branches[0].1 } else { otherwise })
            }
            Expr::If(branches, otherwise) => {
                let mut text = String::new();
                for (k, (c, v)) in branches.iter().enumerate() {
                    let word = if k == 0 { "if" } else { " elseif" };
                    text += &format!("{word} {} then {}", self.expr(c), self.expr(v));
                }
                (format!("{text} else {}", self.expr(otherwise)), 0)
            }
            Expr::Array(list) => primary(format!("{{{}}}", self.list(list))),
            Expr::For(reduction, body, iterators) => match (self.unrolled(body, iterators), reduction) {
                (Some(all), None) => primary(all.whole),
                (Some(all), Some("sum")) if !all.flat.is_empty() => (all.flat.join(" + "), level::SUM),
                (Some(all), Some(name)) => primary(format!("{name}({{{}}})", all.flat.join(", "))),
                (None, None) => primary(format!("{{{} for {}}}", self.expr(body), self.iterators(iterators))),
                (None, Some(name)) => primary(format!("{name}({} for {})", self.expr(body), self.iterators(iterators))),
            },
            Expr::Builtin(name, list) => primary(format!("{name}({})", self.list(list))),
            Expr::Call(name, list) => primary(format!("{name}({})", self.list(list))),
            Expr::NoEvent(e) => primary(format!("noEvent({})", self.expr(e))),
            Expr::Delay(e, delay) => primary(format!("delay({}, {})", self.expr(e), number(*delay))),
            Expr::Sample(start, interval) => primary(format!("sample({}, {})", number(*start), number(*interval))),
            Expr::Initial => primary("initial()".into()),
        }
    }

    fn unrolled(&self, body: &Expr, iterators: &[(String, Range)]) -> Option<Unrolled> {
        if !self.form.unrolled {
            return None;
        }
        let Some(((name, range), inner)) = iterators.split_last() else {
            // In a sum every term binds as a product does.
            return Some(Unrolled { whole: self.expr(body), flat: vec![self.at(body, level::PRODUCT)] });
        };
        let mut rows = Vec::new();
        let mut flat = Vec::new();
        for k in self.values(range)? {
            let inside = self.with(name, k);
            let one = inside.unrolled(body, inner)?;
            rows.push(one.whole);
            flat.extend(one.flat);
        }
        if rows.is_empty() { None } else { Some(Unrolled { whole: format!("{{{}}}", rows.join(", ")), flat }) }
    }
}

/// A comprehension written out: as an array, and all elements.
struct Unrolled {
    whole: String,
    flat: Vec<String>,
}
