//! Changes of equations and connections: ranges of loops, what holds at the start only, what is done when, ends of connections.

use std::collections::{BTreeMap, BTreeSet};

use hyd_source::Span;
use hyd_syntax::tree::{
    Arguments, BinaryOp, Component, ComponentRef, Equation, EquationKind, EquationSection, Expr, ExprKind,
};

use hyd_system::significant;

use hyd_syntax::visit::{Visitor, walk_expr};

use super::{Found, Rank, is_named, number};

/// Half the width of a hysteresis, as a part of the bound.
const HYSTERESIS: f64 = 1e-3;
/// Names that differ by so many letters are taken for each other.
const NEAR: usize = 2;
/// Names that variables have which add up to zero where parts are joined.
const FLOWS: [&str; 9] = ["f", "i", "q", "Q", "tau", "m_flow", "V_flow", "H_flow", "Q_flow"];

impl Found<'_> {
    /// Changes of the equations of a section.
    /// `starts`: the start values that declarations say, `settings`: parameters and constants of the class.
    pub(super) fn section(
        &mut self,
        section: &EquationSection,
        starts: &BTreeMap<String, String>,
        settings: &BTreeSet<&str>,
    ) {
        let first = section.equations.first().map(|own| own.span);
        for equation in &section.equations {
            self.equation(equation);
            let whole = self.with_semicolon(equation.span);
            match (&equation.kind, section.initial) {
                (EquationKind::Equal(left, _), true) if self.trouble.start => {
                    if let ExprKind::Call(function, Arguments::List { positional, .. }) = &left.kind
                        && let ([of], true) = (&positional[..], is_named(function, "der"))
                        && let Some(start) = starts.get(self.snippet(of.span))
                    {
                        let text = format!("{} = {start}", self.snippet(of.span));
                        self.write(Rank::Start, equation.span, &text);
                    }
                    let edit = self.replaced(whole, "");
                    let text = self.said(equation.span);
                    self.push(Rank::Start, format!("leave the initial equation `{text}` out"), vec![edit]);
                }
                (EquationKind::Equal(left, right), false) if self.trouble.too_many => {
                    let text = self.snippet(equation.span).to_string();
                    // Only what says a value that does not change can have been meant for the start.
                    let is_value = matches!(left.kind, ExprKind::Ref(_)) && is_setting(right, settings);
                    if let Some(first) = first.filter(|_| is_value) {
                        let edits = vec![
                            self.edit(first.start, first.start, format!("initial equation\n  {text};\nequation\n  ")),
                            self.replaced(whole, ""),
                        ];
                        let text = self.said(equation.span);
                        self.push(Rank::Start, format!("let `{text}` hold at the start only"), edits);
                    }
                    let text = self.said(equation.span);
                    let edit = self.replaced(whole, "");
                    self.push(Rank::LeftOut, format!("leave `{text}` out"), vec![edit]);
                }
                (EquationKind::Connect(..), false) if self.trouble.too_many => {
                    let text = self.said(equation.span);
                    let edit = self.replaced(whole, "");
                    self.push(Rank::LeftOut, format!("leave `{text}` out"), vec![edit]);
                }
                _ => {}
            }
        }
    }

    fn equation(&mut self, equation: &Equation) {
        match &equation.kind {
            EquationKind::Equal(left, right) => {
                self.value(right);
                if !matches!(left.kind, ExprKind::Ref(_)) {
                    self.value(left);
                }
                self.before_the_event(left, right);
                self.hysteresis(left, right);
                self.both_inwards(equation, left, right);
            }
            EquationKind::Connect(a, b) => self.ends(a, b),
            EquationKind::For(iterators, body) => {
                iterators.iter().filter_map(|own| own.range.as_ref()).for_each(|range| self.range(range));
                body.iter().for_each(|own| self.equation(own));
            }
            EquationKind::If(branches) => {
                branches.iter().flat_map(|(_, body)| body).for_each(|own| self.equation(own));
                self.otherwise(equation, branches);
            }
            EquationKind::When(branches) => self.when(equation, branches),
            EquationKind::Call(..) => {}
        }
    }

    /// Flows of two connectors that are set equal: a flow counts into the component, so what goes in at one comes out at the other.
    fn both_inwards(&mut self, equation: &Equation, left: &Expr, right: &Expr) {
        let (ExprKind::Ref(a), ExprKind::Ref(b)) = (&left.kind, &right.kind) else { return };
        let ([one, flow], [other, same]) = (&a.parts[..], &b.parts[..]) else { return };
        let is_pair = one.name.name != other.name.name && flow.name.name == same.name.name;
        if is_pair && FLOWS.contains(&&*flow.name.name) && (self.trouble.run || self.trouble.start) {
            let text = format!("{} + {} = 0", self.snippet(left.span), self.snippet(right.span));
            self.write(Rank::Marked, equation.span, &text);
        }
    }

    /// Bounds of a loop, one more or less.
    fn range(&mut self, range: &Expr) {
        let ExprKind::Range(from, None, to) = &range.kind else { return };
        if !self.trouble.text && !self.trouble.too_many && !self.trouble.too_few {
            return;
        }
        let (lower, upper) = (|by| self.stepped(from, by), |by| self.stepped(to, by));
        let (first, last) = (self.snippet(from.span).to_string(), self.snippet(to.span).to_string());
        let tried = [
            (lower(1), last.clone()),
            (first.clone(), upper(-1)),
            (first, upper(1)),
            (lower(-1), last),
            (lower(1), upper(1)),
        ];
        for (first, last) in tried {
            self.write(Rank::Loop, range.span, &format!("{first}:{last}"));
        }
    }

    /// A bound with 1 added or taken away, as text.
    fn stepped(&self, bound: &Expr, by: i64) -> String {
        let with = |rest: &str, offset: i64| match offset {
            0 => rest.to_string(),
            1.. => format!("{rest} + {offset}"),
            _ => format!("{rest} - {}", offset.unsigned_abs()),
        };
        match &bound.kind {
            ExprKind::Integer(value) => value.saturating_add(by).to_string(),
            ExprKind::Binary(op @ (BinaryOp::Add | BinaryOp::Sub), rest, offset) => match offset.kind {
                ExprKind::Integer(value) if *op == BinaryOp::Add => {
                    with(self.snippet(rest.span), value.saturating_add(by))
                }
                ExprKind::Integer(value) => with(self.snippet(rest.span), by.saturating_sub(value)),
                _ => with(self.snippet(bound.span), by),
            },
            _ => with(self.snippet(bound.span), by),
        }
    }

    /// A variable that its own equation reads is read as it was before the event.
    fn before_the_event(&mut self, left: &Expr, right: &Expr) {
        if !self.trouble.text && !self.trouble.start {
            return;
        }
        let names: Vec<String> = match &left.kind {
            ExprKind::Ref(_) => vec![self.snippet(left.span).to_string()],
            ExprKind::Tuple(items) => items.iter().flatten().map(|own| self.snippet(own.span).to_string()).collect(),
            _ => return,
        };
        let mut edits = Vec::new();
        for name in &names {
            let reads = self.reads(right, name);
            edits.extend(reads.into_iter().map(|span| self.replaced(span, format!("pre({name})"))));
        }
        if !edits.is_empty() {
            let names: Vec<String> = names.iter().map(|own| format!("pre({own})")).collect();
            self.push(Rank::Marked, format!("read the value from before the event: `{}`", names.join("`, `")), edits);
        }
    }

    /// A comparison that switches back a little later than on.
    fn hysteresis(&mut self, left: &Expr, right: &Expr) {
        let (ExprKind::Ref(_), ExprKind::Binary(op, value, bound)) = (&left.kind, &right.kind) else { return };
        let Some(size) = number(bound).filter(|_| self.trouble.run && self.is_marked(right.span)) else { return };
        let (value, name) = (self.snippet(value.span).to_string(), self.snippet(left.span).to_string());
        let (on, off) = (size + HYSTERESIS * size.abs(), size - HYSTERESIS * size.abs());
        let (sign, on, off) = match op {
            BinaryOp::Greater | BinaryOp::GreaterEqual => (">", on, off),
            BinaryOp::Less | BinaryOp::LessEqual => ("<", off, on),
            _ => return,
        };
        let text = format!("{value} {sign} {} or pre({name}) and {value} {sign} {}", significant(on), significant(off));
        if size != 0.0 {
            self.write(Rank::Moment, right.span, &text);
        }
    }

    /// An `if` equation without `else`: what it determines is zero otherwise.
    fn otherwise(&mut self, equation: &Equation, branches: &[(Option<Expr>, Vec<Equation>)]) {
        if !self.trouble.too_few || branches.iter().any(|(condition, _)| condition.is_none()) {
            return;
        }
        let Some((_, body)) = branches.first() else { return };
        let mut zeros = String::new();
        for own in body {
            let EquationKind::Equal(left, _) = &own.kind else { return };
            zeros.push_str(&format!("{} = 0; ", self.snippet(left.span)));
        }
        let whole = self.snippet(equation.span);
        let Some(at) = whole.rfind("end") else { return };
        let at = equation.span.start + at as u32;
        let edit = self.edit(at, at, format!("else {zeros}"));
        self.push(Rank::Marked, format!("without the condition: `{}`", zeros.trim_end()), vec![edit]);
    }

    /// A `when` that is asked at the start, too; or the law in it held at all times.
    fn when(&mut self, equation: &Equation, branches: &[(Expr, Vec<Equation>)]) {
        for (condition, body) in branches {
            self.expression(condition);
            for own in body {
                match &own.kind {
                    EquationKind::Equal(left, right) => {
                        self.expression(right);
                        self.before_the_event(left, right);
                    }
                    EquationKind::When(_) | EquationKind::Connect(..) => {}
                    _ => self.equation(own),
                }
            }
        }
        let is_of_the_end = |name: &ComponentRef| is_named(name, "assert") || is_named(name, "terminate");
        let judges = |own: &Equation| matches!(&own.kind, EquationKind::Call(name, _) if is_of_the_end(name));
        if !self.trouble.run || branches.iter().flat_map(|(_, body)| body).any(judges) {
            return;
        }
        for (condition, _) in branches {
            let text = self.snippet(condition.span).to_string();
            if !text.contains("initial(") {
                let asked = match text.strip_prefix('{') {
                    Some(rest) => format!("{{initial(), {rest}"),
                    None => format!("{{initial(), {text}}}"),
                };
                self.write(Rank::AtOnce, condition.span, &asked);
            }
        }
        if let [(condition, body)] = branches
            && let [Equation { kind: EquationKind::Equal(left, right), .. }] = &body[..]
            && matches!(left.kind, ExprKind::Ref(_))
            && !self.snippet(right.span).contains("pre(")
        {
            let (condition, left, right) =
                (self.snippet(condition.span), self.snippet(left.span), self.snippet(right.span));
            let law = format!("{left} = if {condition} then {right} else 0");
            let edit = self.replaced(equation.span, law.clone());
            self.push(Rank::Moment, format!("let the law hold at all times: `{law}`"), vec![edit]);
        }
    }

    /// A connection with another end: one that messages name.
    fn ends(&mut self, a: &ComponentRef, b: &ComponentRef) {
        if !self.trouble.too_few && !self.trouble.too_many && !self.trouble.start && !self.trouble.text {
            return;
        }
        if !self.is_marked(a.span)
            && !self.names.contains(self.snippet(a.span))
            && !self.names.contains(self.snippet(b.span))
        {
            return;
        }
        let is_name =
            |own: &String| own.contains('.') && own.chars().all(|c| c.is_alphanumeric() || "._[]".contains(c));
        let names: Vec<String> = self.names.iter().filter(|own| is_name(own)).cloned().collect();
        for span in [a.span, b.span] {
            let (old, [x, y]) = (self.snippet(span).to_string(), [a, b].map(|end| self.snippet(end.span).to_string()));
            // What is connected nowhere else would be left open.
            if self.text.matches(old.as_str()).count() < 2 {
                continue;
            }
            for name in names.iter().filter(|name| **name != x && **name != y) {
                // The same socket of another component, such as that of `lamp_2` for that of `lamp_1`.
                let is_near =
                    old.rsplit('.').next() == name.rsplit('.').next() && hyd_source::edit_distance(&old, name) <= NEAR;
                self.write(if is_near { Rank::Ends } else { Rank::OtherEnds }, span, name);
            }
        }
    }

    /// A connection of what nothing is connected to.
    pub(super) fn missing(&mut self, sections: &[EquationSection], components: &[&Component]) {
        let Some(first) = sections.iter().filter(|own| !own.initial).find_map(|own| own.equations.first()) else {
            return;
        };
        let mut ends: Vec<String> = self.open.clone();
        for equation in sections.iter().flat_map(|own| &own.equations) {
            if let EquationKind::Connect(a, b) = &equation.kind {
                ends.extend([a, b].map(|end| self.snippet(end.span).to_string()));
            }
        }
        ends.sort();
        ends.dedup();
        let component = |end: &str| end.split(['.', '[']).next().unwrap_or_default().to_string();
        for open in self.open.clone() {
            if components.iter().all(|own| *own.name.name != *component(&open)) {
                continue;
            }
            for other in ends.iter().filter(|other| component(other) != component(&open)) {
                let text = format!("connect({open}, {other})");
                let edit = self.edit(first.span.start, first.span.start, format!("{text};\n  "));
                self.push(Rank::Joined, format!("add `{text}`"), vec![edit]);
            }
        }
    }

    /// The two sockets of a component exchanged in all its connections.
    pub(super) fn sockets(&mut self, sections: &[EquationSection]) {
        if !self.trouble.run || self.trouble.start {
            return;
        }
        let mut used: BTreeMap<String, BTreeMap<String, Vec<Span>>> = BTreeMap::new();
        for equation in sections.iter().flat_map(|section| &section.equations) {
            let EquationKind::Connect(a, b) = &equation.kind else { continue };
            for end in [a, b] {
                if let [component, socket] = &end.parts[..]
                    && component.subscripts.is_empty()
                    && socket.subscripts.is_empty()
                {
                    let component = used.entry(component.name.name.to_string()).or_default();
                    component.entry(socket.name.name.to_string()).or_default().push(socket.name.span);
                }
            }
        }
        for (component, sockets) in used {
            let sockets: Vec<(String, Vec<Span>)> = sockets.into_iter().collect();
            if let [(a, at_a), (b, at_b)] = &sockets[..] {
                let mut edits: Vec<_> = at_a.iter().map(|span| self.replaced(*span, b.clone())).collect();
                edits.extend(at_b.iter().map(|span| self.replaced(*span, a.clone())));
                self.push(
                    Rank::Exchanged,
                    format!("connect `{component}` the other way round: exchange `{a}` and `{b}`"),
                    edits,
                );
            }
        }
    }
}

/// True for an expression of numbers and of these parameters.
fn is_setting(expr: &Expr, settings: &BTreeSet<&str>) -> bool {
    struct Reads<'a>(&'a BTreeSet<&'a str>, bool);
    impl Visitor for Reads<'_> {
        fn expr(&mut self, expr: &Expr) {
            self.1 &= match &expr.kind {
                ExprKind::Ref(of) => matches!(&of.parts[..], [only] if self.0.contains(&*only.name.name)),
                ExprKind::Integer(_) | ExprKind::Real(_) | ExprKind::Unary(..) | ExprKind::Binary(..) => true,
                _ => false,
            };
            walk_expr(self, expr);
        }
    }
    let mut reads = Reads(settings, true);
    reads.expr(expr);
    reads.1
}
