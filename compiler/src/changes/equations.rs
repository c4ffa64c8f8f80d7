//! Changes of equations and connections: ranges of loops, what holds at the start only, what is done when, ends of connections.

use std::collections::{BTreeMap, BTreeSet};

use hyd_source::Span;
use hyd_syntax::tree::{
    Arguments, BinaryOp, Component, ComponentRef, Equation, EquationKind, EquationSection, Expr, ExprKind,
};

use hyd_system::significant;

use hyd_syntax::visit::{Visitor, walk_expr};

use super::{Found, Rank, is_named, number};

/// Speeds from which on a bounce is taken for rest.
const RESTS: [&str; 3] = ["0.01", "0.1", "0.001"];
/// Half the widths of a hysteresis that are tried, as a part of the bound.
const HYSTERESES: [f64; 3] = [1e-3, 0.02, 0.2];
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
        if self.trouble.accumulates && !section.initial {
            self.rest(&section.equations, settings);
        }
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
                    self.push(Rank::Start, format!("remove the initial equation `{text}`"), vec![edit]);
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
                    self.push(Rank::LeftOut, format!("remove `{text}`"), vec![edit]);
                }
                (EquationKind::Connect(..), false) if self.trouble.too_many => {
                    let text = self.said(equation.span);
                    let edit = self.replaced(whole, "");
                    self.push(Rank::LeftOut, format!("remove `{text}`"), vec![edit]);
                }
                _ => {}
            }
        }
    }

    fn equation(&mut self, equation: &Equation) {
        match &equation.kind {
            EquationKind::Equal(left, right) => {
                self.used_up(equation, left, right);
                if self.units.len() == 1 && self.units.contains(&self.line(equation.span.start)) {
                    [left, right].into_iter().for_each(|side| self.other_quantities(side));
                }
                self.is_definition = self.is_definition_of(left, right);
                self.value(right);
                if !matches!(left.kind, ExprKind::Ref(_)) {
                    // The other side of a balance has its signs.
                    self.is_definition |= self.snippet(left.span).contains("der(");
                    self.value(left);
                }
                self.is_definition = false;
                self.before_the_event(left, right);
                self.hysteresis(equation, left, right);
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

    /// True for an equation that says how two variables belong together: a variable and another one of its name in a connector, or a rate.
    fn is_definition_of(&self, left: &Expr, right: &Expr) -> bool {
        let ExprKind::Ref(of) = &right.kind else { return false };
        let last = |of: &ComponentRef| of.parts.last().map(|part| part.name.name.to_string());
        match &left.kind {
            ExprKind::Ref(own) => last(own) == last(of),
            _ => self.snippet(left.span).contains("der("),
        }
    }

    /// What is computed from the square root of something stored ends where nothing is left of that.
    fn used_up(&mut self, equation: &Equation, left: &Expr, right: &Expr) {
        if !self.trouble.run || !self.is_marked(equation.span) {
            return;
        }
        for argument in self.roots(right) {
            let text = self.snippet(argument).to_string();
            let whole = (right.span.start as usize, right.span.end as usize);
            let (before, after) =
                (&self.text[whole.0..argument.start as usize], &self.text[argument.end as usize..whole.1]);
            let law = format!("{} = if {text} > 0 then {before}max({text}, 0){after} else 0", self.snippet(left.span));
            // What stands beside the root may go on.
            let is_product = !matches!(right.kind, ExprKind::Binary(BinaryOp::Add | BinaryOp::Sub, ..));
            self.write(if is_product { Rank::Marked } else { Rank::UsedUp }, equation.span, &law);
        }
    }

    /// Arguments of square roots that are stored: products of states without a sum or difference.
    fn roots(&self, expr: &Expr) -> Vec<Span> {
        struct Roots<'a, 'b>(&'a Found<'b>, Vec<Span>);
        impl Visitor for Roots<'_, '_> {
            fn expr(&mut self, expr: &Expr) {
                if let ExprKind::Call(function, Arguments::List { positional, named }) = &expr.kind
                    && let ([argument], true) = (&positional[..], named.is_empty() && is_named(function, "sqrt"))
                    && self.0.is_stored(argument)
                {
                    self.1.push(argument.span);
                }
                walk_expr(self, expr);
            }
        }
        let mut roots = Roots(self, Vec::new());
        roots.expr(expr);
        roots.1
    }

    /// A bounce that comes to rest: the Boolean that the usual recipe has, with limits of the speed from which on it rests.
    fn rest(&mut self, equations: &[Equation], settings: &BTreeSet<&str>) {
        let rate = |name: &str| {
            equations.iter().find_map(|own| match &own.kind {
                EquationKind::Equal(left, right) => {
                    let ExprKind::Call(function, Arguments::List { positional, .. }) = &left.kind else { return None };
                    let [of] = &positional[..] else { return None };
                    (is_named(function, "der") && self.snippet(of.span) == name).then_some(right)
                }
                _ => None,
            })
        };
        let mut found = Vec::new();
        for equation in equations {
            let EquationKind::When(branches) = &equation.kind else { continue };
            for (condition, own) in branches.iter().flat_map(|(when, body)| body.iter().map(move |own| (when, own))) {
                let EquationKind::Call(function, Arguments::List { positional, .. }) = &own.kind else { continue };
                // Nothing moves what it rests on, and nothing lifts it.
                let is_still = |bound: &Expr| is_setting(bound, settings);
                let rests_on = matches!(&condition.kind, ExprKind::Binary(_, a, b) if is_still(a) || is_still(b));
                if let ([speed, value], true) = (&positional[..], is_named(function, "reinit"))
                    && let Some(rate) = rate(self.snippet(speed.span))
                {
                    let rank = if rests_on && is_still(rate) { Rank::Rest } else { Rank::RestForNow };
                    found.push((speed.span, value.span, rate.span, own.span, rank));
                }
            }
        }
        let [(speed, value, rate, call, rank)] = found[..] else { return };
        let Some(begin) = self.begin_of_sections else { return };
        let name = ["rests", "is_at_rest"].into_iter().find(|name| !self.text.contains(name));
        let Some(name) = name else { return };
        let [said, rebound, law] = [speed, value, rate].map(|span| self.snippet(span).to_string());
        for limit in RESTS {
            let edits = vec![
                self.edit(begin, begin, format!("  Boolean {name}(start = false, fixed = true);\n")),
                self.replaced(rate, format!("if {name} then 0 else {law}")),
                self.edit(call.start, call.start, format!("{name} = abs({rebound}) < {limit};\n    ")),
                self.replaced(value, format!("if {name} then 0 else {rebound}")),
            ];
            let words = format!(
                "let `{said}` come to rest by a Boolean `{name}` once it is less than {limit} after an impact: `der({said}) = if {name} then 0 else {law}`"
            );
            self.push(rank, words, edits);
        }
    }

    /// Flows of two connectors that are set equal: a flow counts into the component, so what goes in at one comes out at the other.
    fn both_inwards(&mut self, equation: &Equation, left: &Expr, right: &Expr) {
        let (ExprKind::Ref(a), ExprKind::Ref(b)) = (&left.kind, &right.kind) else { return };
        let ([one, flow], [other, same]) = (&a.parts[..], &b.parts[..]) else { return };
        let is_pair = one.name.name != other.name.name && flow.name.name == same.name.name;
        // What a component is given or gives is a number, whatever it is called.
        let is_signal = |component: &ComponentRef| self.signals.contains(self.snippet(component.span));
        if is_pair
            && FLOWS.contains(&&*flow.name.name)
            && (self.trouble.run || self.trouble.start)
            && !is_signal(a)
            && !is_signal(b)
        {
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
        // One of several that read each other breaks the cycle.
        let others: Vec<String> = self.names.iter().filter(|own| !names.contains(own)).cloned().collect();
        if self.cycle && names.iter().any(|own| self.names.contains(own)) {
            for other in others {
                let reads = self.reads(right, &other);
                let edits: Vec<_> =
                    reads.into_iter().map(|span| self.replaced(span, format!("pre({other})"))).collect();
                if !edits.is_empty() {
                    let words = format!(
                        "let `{}` read `{other}` as it was before the event: `pre({other})`",
                        names.join("`, `")
                    );
                    self.push(Rank::Marked, words, edits);
                }
            }
        }
        if !edits.is_empty() {
            let names: Vec<String> = names.iter().map(|own| format!("pre({own})")).collect();
            self.push(Rank::Marked, format!("read the value from before the event: `{}`", names.join("`, `")), edits);
        }
    }

    /// A comparison that switches back a little later than on.
    fn hysteresis(&mut self, equation: &Equation, left: &Expr, right: &Expr) {
        if !matches!(left.kind, ExprKind::Ref(_)) || !self.trouble.run || !self.is_marked(right.span) {
            return;
        }
        let name = self.snippet(left.span).to_string();
        for width in HYSTERESES {
            if let Some(text) = self.with_hysteresis(right, &name, width) {
                self.write(Rank::Moment, right.span, &text);
            }
        }
        self.switched(equation.span.start, right);
    }

    /// A comparison with a number that switches the Boolean `name` on beyond it and off below, as text.
    fn with_hysteresis(&self, comparison: &Expr, name: &str, width: f64) -> Option<String> {
        let ExprKind::Binary(op, value, bound) = &comparison.kind else { return None };
        let size = number(bound).filter(|size| *size != 0.0)?;
        let (on, off) = (size + width * size.abs(), size - width * size.abs());
        let (sign, on, off) = match op {
            BinaryOp::Greater | BinaryOp::GreaterEqual => (">", on, off),
            BinaryOp::Less | BinaryOp::LessEqual => ("<", off, on),
            _ => return None,
        };
        let value = self.snippet(value.span);
        // Time does not turn round.
        if value == "time" {
            return None;
        }
        Some(format!("{value} {sign} {} or pre({name}) and {value} {sign} {}", significant(on), significant(off)))
    }

    /// A law with two branches whose condition becomes a Boolean with a hysteresis.
    fn switched(&mut self, before: u32, right: &Expr) {
        let ExprKind::If(branches, _) = &right.kind else { return };
        let [(condition, _)] = &branches[..] else { return };
        let Some(begin) = self.begin_of_sections else { return };
        let Some(name) = ["is_on", "is_beyond"].into_iter().find(|name| !self.text.contains(name)) else { return };
        for width in HYSTERESES {
            let Some(text) = self.with_hysteresis(condition, name, width) else { return };
            let edits = vec![
                self.edit(begin, begin, format!("  Boolean {name}(start = false, fixed = true);\n")),
                self.edit(before, before, format!("{name} = {text};\n  ")),
                self.replaced(condition.span, name),
            ];
            let old = self.said(condition.span);
            self.push(Rank::Moment, format!("give `{old}` a hysteresis: `{name} = {text}`"), edits);
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
        // Messages may name no more than the end that was meant.
        let is_meant = |end: &ComponentRef| self.open.iter().any(|open| is_near(open, self.snippet(end.span)));
        if !self.is_marked(a.span)
            && !self.names.contains(self.snippet(a.span))
            && !self.names.contains(self.snippet(b.span))
            && ![a, b].into_iter().any(|end| self.names.contains(&*end.parts[0].name.name))
            && ![a, b].into_iter().any(is_meant)
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
                let other = if span == a.span { &y } else { &x };
                let rank = match is_near(&old, name) {
                    true if number_of(name).is_some() && number_of(name) == number_of(other) => Rank::Twins,
                    true => Rank::Ends,
                    false if self.open.contains(name) => Rank::Open,
                    false => Rank::OtherEnds,
                };
                self.write(rank, span, name);
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
        // What nobody reads is what is missing; outputs are called `y` nearly everywhere.
        let unread = components.iter().map(|own| format!("{}.y", own.name.name)).filter(|own| !ends.contains(own));
        let unread: Vec<String> = unread.collect();
        let component = |end: &str| end.split(['.', '[']).next().unwrap_or_default().to_string();
        for open in self.open.clone() {
            if components.iter().all(|own| *own.name.name != *component(&open)) {
                continue;
            }
            let others = unread.iter().map(|own| (Rank::Unread, own)).chain(ends.iter().map(|own| (Rank::Joined, own)));
            for (rank, other) in others.filter(|(_, other)| component(other) != component(&open)) {
                let text = format!("connect({open}, {other})");
                let edit = self.edit(first.span.start, first.span.start, format!("{text};\n  "));
                self.push(rank, format!("add `{text}`"), vec![edit]);
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

/// True for the same socket of another component that is called almost the same, such as that of `lamp_2` for that of `lamp_1`.
fn is_near(one: &str, other: &str) -> bool {
    one.rsplit('.').next() == other.rsplit('.').next() && hyd_source::edit_distance(one, other) <= NEAR
}

/// The digits at the end of the component of a connector: 2 of `lamp_2.p`.
fn number_of(end: &str) -> Option<&str> {
    let component = end.rsplit_once('.')?.0;
    let name = component.trim_end_matches(|c: char| c.is_ascii_digit());
    Some(&component[name.len()..]).filter(|digits| !digits.is_empty())
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
