//! Changes within expressions: signs of terms, quotients, powers and roots, the order of arguments.

use hyd_source::Span;
use hyd_syntax::tree::{Arguments, BinaryOp, Expr, ExprKind, UnaryOp};
use hyd_syntax::visit::{Visitor, walk_expr};

use hyd_system::significant;

use super::{Found, Rank, is_named, number};

/// Times the longest delay that the text allows.
pub(super) const BOUNDS: [f64; 2] = [2.0, 10.0];

impl Found<'_> {
    /// Changes of an expression that is one side of an equation, or the value of a variable.
    pub(super) fn value(&mut self, expr: &Expr) {
        if self.trouble.run || self.trouble.start {
            self.signs(expr);
        }
        self.expression(expr);
    }

    /// Changes of any expression.
    pub(super) fn expression(&mut self, expr: &Expr) {
        struct Slips<'a, 'b>(&'a mut Found<'b>);
        impl Visitor for Slips<'_, '_> {
            fn expr(&mut self, expr: &Expr) {
                self.0.slip(expr);
                walk_expr(self, expr);
            }
        }
        Slips(self).expr(expr);
    }

    fn slip(&mut self, expr: &Expr) {
        let trouble = self.trouble;
        let is_marked = self.is_marked(expr.span);
        let parts =
            |found: &Self, a: &Expr, b: &Expr| (found.snippet(a.span).to_string(), found.snippet(b.span).to_string());
        match &expr.kind {
            ExprKind::Call(function, Arguments::List { positional, named }) if named.is_empty() => {
                self.call(expr, function, positional);
            }
            ExprKind::Binary(BinaryOp::Div, a, b) if trouble.text && is_marked => {
                let (a, b) = parts(self, a, b);
                self.write(Rank::Marked, expr.span, &format!("div({}, {})", bare(&a), bare(&b)));
            }
            // Even powers have values on both sides of zero.
            ExprKind::Binary(BinaryOp::Pow, a, n)
                if (trouble.run || trouble.start) && is_marked && number(n).is_none_or(|n| n.fract() != 0.0) =>
            {
                let base = self.snippet(a.span).to_string();
                let power = self.text[a.span.end as usize..expr.span.end as usize].to_string();
                self.write(Rank::Marked, expr.span, &format!("sign({})*abs({}){power}", bare(&base), bare(&base)));
            }
            ExprKind::Binary(BinaryOp::Equal, a, b) if (trouble.text || trouble.run) && is_marked => {
                let (a, b) = parts(self, a, b);
                self.write(Rank::Marked, expr.span, &format!("{a} >= {b}"));
                self.write(Rank::Marked, expr.span, &format!("{a} <= {b}"));
            }
            ExprKind::Array(items) if trouble.run || trouble.start => self.rising(expr, items),
            _ => {}
        }
    }

    /// Numbers of a list in rising order.
    fn rising(&mut self, expr: &Expr, items: &[Expr]) {
        let Some(mut given) = items.iter().map(|own| Some((number(own)?, own.span))).collect::<Option<Vec<_>>>() else {
            return;
        };
        if given.is_sorted_by(|a, b| a.0 <= b.0) {
            return;
        }
        given.sort_by(|a, b| a.0.total_cmp(&b.0));
        let texts: Vec<&str> = given.iter().map(|(_, span)| self.snippet(*span)).collect();
        let text = format!("{{{}}}", texts.join(", "));
        self.write(Rank::Exchanged, expr.span, &text);
    }

    /// The end of the run as the text says it.
    fn stop_time(&self) -> Option<String> {
        let rest = self.text.split_once("StopTime")?.1.trim_start().strip_prefix('=')?.trim_start();
        let number: String = rest.chars().take_while(|c| c.is_ascii_alphanumeric() || "+-.".contains(*c)).collect();
        number.parse::<f64>().is_ok().then_some(number)
    }

    fn call(&mut self, expr: &Expr, function: &hyd_syntax::tree::ComponentRef, positional: &[Expr]) {
        let is_marked = self.is_marked(expr.span);
        let texts: Vec<String> = positional.iter().map(|own| self.snippet(own.span).to_string()).collect();
        let is_run = self.trouble.run || self.trouble.start;
        match &texts[..] {
            [a, b] if is_named(function, "div") && (self.trouble.text || is_run) => {
                self.write(Rank::Marked, expr.span, &format!("{a}/{b}"));
            }
            [_, time] if is_named(function, "delay") && self.trouble.text && is_marked => {
                if let Some(stop) = self.stop_time() {
                    self.write(Rank::Marked, expr.span, &format!("delay({}, {time}, {stop})", texts[0]));
                }
            }
            [value, time, bound] if is_named(function, "delay") && is_run && is_marked => {
                for factor in BOUNDS {
                    let bound = match number(&positional[2]) {
                        Some(number) => significant(factor * number),
                        None => format!("{factor}*({})", bare(bound)),
                    };
                    self.write(Rank::Marked, expr.span, &format!("delay({value}, {time}, {bound})"));
                }
            }
            [a] if is_named(function, "sqrt") && is_run && is_marked => {
                if !self.is_stored(&positional[0]) {
                    self.write(Rank::Marked, expr.span, &format!("sign({a})*sqrt(abs({a}))"));
                }
                let rank = if self.is_stored(&positional[0]) { Rank::UsedUp } else { Rank::Marked };
                self.write(rank, expr.span, &format!("sqrt(max({a}, 0))"));
            }
            [a] if (is_named(function, "asin") || is_named(function, "acos")) && is_run && is_marked => {
                let name = &function.parts[0].name.name;
                self.write(Rank::Marked, expr.span, &format!("{name}(max(-1, min(1, {a})))"));
            }
            _ if self.trouble.text && is_marked => {
                for k in 1..positional.len() {
                    let (x, y) = (positional[k - 1].span, positional[k].span);
                    let edits = vec![self.replaced(x, texts[k].clone()), self.replaced(y, texts[k - 1].clone())];
                    let message = format!("exchange the arguments `{}` and `{}`", texts[k - 1], texts[k]);
                    self.push(Rank::Exchanged, message, edits);
                }
            }
            _ => {}
        }
    }

    /// The sign of each term of a sum turned round, also in the branches of a condition.
    pub(super) fn signs(&mut self, expr: &Expr) {
        let text = self.text;
        let turned = |found: &mut Self, from: u32, to: u32, sign: &str, term: Span| {
            let edit = found.edit(from, to, sign);
            let (line, term) = (found.line(from), found.snippet(term).split_whitespace().collect::<Vec<_>>().join(" "));
            found.push(Rank::Sign, format!("change the sign of `{term}` in line {line}"), vec![edit]);
        };
        match &expr.kind {
            ExprKind::Binary(op @ (BinaryOp::Add | BinaryOp::Sub), a, b) if a.span.start == expr.span.start => {
                let between = &text[a.span.end as usize..b.span.start as usize];
                let (sign, other) = if *op == BinaryOp::Add { ('+', "-") } else { ('-', "+") };
                if let Some(at) = between.find(sign) {
                    let at = a.span.end + at as u32;
                    turned(self, at, at + 1, other, b.span);
                }
                self.signs(a);
            }
            ExprKind::Unary(UnaryOp::Minus, _) if text[expr.span.start as usize..].starts_with('-') => {
                turned(self, expr.span.start, expr.span.start + 1, "", expr.span);
            }
            ExprKind::If(branches, otherwise) => {
                branches.iter().for_each(|(_, value)| self.signs(value));
                self.signs(otherwise);
            }
            ExprKind::Integer(0) | ExprKind::Boolean(_) | ExprKind::Text(_) | ExprKind::Unary(UnaryOp::Not, _) => {}
            ExprKind::Binary(op, ..)
                if !matches!(op, BinaryOp::Add | BinaryOp::Sub | BinaryOp::Mul | BinaryOp::Div | BinaryOp::Pow) => {}
            // A number is meant as it stands.
            _ if number(expr).is_some() => {
                let is_definition = std::mem::replace(&mut self.is_definition, true);
                turned(self, expr.span.start, expr.span.start, "-", expr.span);
                self.is_definition = is_definition;
            }
            _ => turned(self, expr.span.start, expr.span.start, "-", expr.span),
        }
    }

    /// True for a product of states, by the derivatives that the text takes, without a sum or difference: what is stored is used up, where what drives
    /// a flow changes its direction.
    pub(super) fn is_stored(&self, expr: &Expr) -> bool {
        struct Stored<'a> {
            text: &'a str,
            is_stored: bool,
            is_sum: bool,
        }
        impl Visitor for Stored<'_> {
            fn expr(&mut self, expr: &Expr) {
                match &expr.kind {
                    ExprKind::Binary(BinaryOp::Add | BinaryOp::Sub, ..) => self.is_sum = true,
                    ExprKind::Ref(_) => {
                        let name = &self.text[expr.span.start as usize..expr.span.end as usize];
                        self.is_stored |= self.text.contains(&format!("der({name})"));
                    }
                    _ => {}
                }
                walk_expr(self, expr);
            }
        }
        let mut own = Stored { text: self.text, is_stored: false, is_sum: false };
        own.expr(expr);
        own.is_stored && !own.is_sum
    }

    /// The reads of a name within an expression, apart from those of its value before the event.
    pub(super) fn reads(&self, expr: &Expr, name: &str) -> Vec<Span> {
        struct Reads<'a> {
            text: &'a str,
            name: &'a str,
            found: Vec<Span>,
        }
        impl Visitor for Reads<'_> {
            fn expr(&mut self, expr: &Expr) {
                match &expr.kind {
                    ExprKind::Ref(_) if self.text[expr.span.start as usize..expr.span.end as usize] == *self.name => {
                        self.found.push(expr.span);
                    }
                    ExprKind::Call(function, _) if is_named(function, "pre") => {}
                    _ => walk_expr(self, expr),
                }
            }
        }
        let mut reads = Reads { text: self.text, name, found: Vec::new() };
        reads.expr(expr);
        reads.found
    }
}

/// An expression without parentheses around it, where they are around all of it.
fn bare(text: &str) -> &str {
    let inside = text.strip_prefix('(').and_then(|own| own.strip_suffix(')'));
    inside.filter(|own| !own.contains(['(', ')'])).unwrap_or(text)
}
