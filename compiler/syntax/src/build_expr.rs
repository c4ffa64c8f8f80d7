//! Expressions: flat lists of operands and operators to trees, by precedence climbing (Richards 1979) with one table.
//!
//! The table is that of Modelica 3.6, section 3.2.  A sign binds like a binary `+` or `-` and may stand only before the
//! first term of a sum (`-a^2` is `-(a^2)`, `a*-b` is not Modelica), `not` stands before a relation; relations and powers do
//! not chain.  What breaks these rules is reported with a hint, and a tree is built nevertheless.

use std::iter::Peekable;

use hyd_source::Span;
use pest::iterators::Pairs;

use crate::build::{Builder, unescape};
use crate::grammar::{Node, Rule};
use crate::tree::{
    Arguments, BinaryOp, ComponentRef, Expr, ExprKind, External, ExternalCall, Iterator, RefPart, UnaryOp,
};

type Nodes<'t> = Peekable<Pairs<'t, Rule>>;

/// Precedence levels, loosest first; shared with the printer.
pub(crate) mod level {
    pub(crate) const RANGE: u8 = 1;
    pub(crate) const OR: u8 = 2;
    pub(crate) const AND: u8 = 3;
    pub(crate) const NOT: u8 = 4;
    pub(crate) const RELATION: u8 = 5;
    pub(crate) const SUM: u8 = 6;
    pub(crate) const PRODUCT: u8 = 7;
    pub(crate) const POWER: u8 = 8;
    pub(crate) const PRIMARY: u8 = 9;
}

/// All binary operators with their text and level.
pub(crate) const BINARY: [(&str, BinaryOp, u8); 18] = [
    ("+", BinaryOp::Add, level::SUM),
    ("-", BinaryOp::Sub, level::SUM),
    ("*", BinaryOp::Mul, level::PRODUCT),
    ("/", BinaryOp::Div, level::PRODUCT),
    ("^", BinaryOp::Pow, level::POWER),
    (".+", BinaryOp::ElementAdd, level::SUM),
    (".-", BinaryOp::ElementSub, level::SUM),
    (".*", BinaryOp::ElementMul, level::PRODUCT),
    ("./", BinaryOp::ElementDiv, level::PRODUCT),
    (".^", BinaryOp::ElementPow, level::POWER),
    ("==", BinaryOp::Equal, level::RELATION),
    ("<>", BinaryOp::NotEqual, level::RELATION),
    ("<", BinaryOp::Less, level::RELATION),
    ("<=", BinaryOp::LessEqual, level::RELATION),
    (">", BinaryOp::Greater, level::RELATION),
    (">=", BinaryOp::GreaterEqual, level::RELATION),
    ("and", BinaryOp::And, level::AND),
    ("or", BinaryOp::Or, level::OR),
];

fn binary(text: &str) -> Option<(BinaryOp, u8)> {
    BINARY.iter().find(|(word, ..)| *word == text).map(|&(_, op, level)| (op, level))
}

/// Chains with more operators than this are put together from pieces.
const LONG_CHAIN: usize = 64;
/// Operators of a piece.
const PIECE: usize = 32;

fn join_two(op: BinaryOp, left: Expr, right: Expr) -> Expr {
    let span = left.span.to(right.span);
    Expr { kind: ExprKind::Binary(op, Box::new(left), Box::new(right)), span }
}

/// `first op a op b ...` of one level, from left to right; a long chain as a balanced tree of pieces, whose depth grows with
/// the logarithm of its length.  A piece that would begin with `- b` or `/ b` begins with `+ (-b)` or `* (1/b)`.
fn join(first: Expr, chain: Vec<(BinaryOp, Expr)>) -> Expr {
    if chain.len() <= LONG_CHAIN {
        return chain.into_iter().fold(first, |left, (op, right)| join_two(op, left, right));
    }
    let mut pieces: Vec<(BinaryOp, Expr)> = Vec::new();
    let mut current = (BinaryOp::Add, first, 0);
    for (op, term) in chain {
        let starts = match op {
            BinaryOp::Sub => BinaryOp::Add,
            BinaryOp::ElementSub => BinaryOp::ElementAdd,
            BinaryOp::Div => BinaryOp::Mul,
            BinaryOp::ElementDiv => BinaryOp::ElementMul,
            op => op,
        };
        let (before, left, count) = current;
        current = if count < PIECE {
            (before, join_two(op, left, term), count + 1)
        } else {
            pieces.push((before, left));
            let span = term.span;
            let start = match op {
                BinaryOp::Sub | BinaryOp::ElementSub => {
                    Expr { kind: ExprKind::Unary(UnaryOp::Minus, Box::new(term)), span }
                }
                BinaryOp::Div | BinaryOp::ElementDiv => join_two(op, Expr { kind: ExprKind::Integer(1), span }, term),
                _ => term,
            };
            (starts, start, 0)
        };
    }
    pieces.push((current.0, current.1));
    while pieces.len() > 1 {
        let mut pairs = Vec::with_capacity(pieces.len().div_ceil(2));
        let mut rest = pieces.into_iter();
        while let Some((op, left)) = rest.next() {
            pairs.push(match rest.next() {
                Some((inner, right)) => (op, join_two(inner, left, right)),
                None => (op, left),
            });
        }
        pieces = pairs;
    }
    let (_, whole) = pieces.remove(0);
    whole
}

impl<'t> Builder<'t> {
    /// An `expression` node.
    pub(crate) fn expression(&mut self, node: Node<'t>) -> Expr {
        let span = self.span(&node);
        let mut nodes = node.into_inner().peekable();
        match nodes.peek().map(Node::as_rule) {
            Some(Rule::if_expression) => {
                let inner = nodes.next().map(Node::into_inner);
                self.if_expression(inner.into_iter().flatten().peekable(), span)
            }
            _ => self.range(&mut nodes, span),
        }
    }

    fn if_expression(&mut self, nodes: impl std::iter::Iterator<Item = Node<'t>>, span: Span) -> Expr {
        let mut parts: Vec<Expr> = Vec::new();
        for node in nodes.filter(|node| node.as_rule() == Rule::expression) {
            parts.push(self.expression(node));
        }
        let otherwise = parts.pop().unwrap_or(Expr { kind: ExprKind::Colon, span });
        let mut branches = Vec::with_capacity(parts.len() / 2);
        let mut parts = parts.into_iter();
        while let (Some(condition), Some(value)) = (parts.next(), parts.next()) {
            branches.push((condition, value));
        }
        Expr { kind: ExprKind::If(branches, Box::new(otherwise)), span }
    }

    /// `a`, `a : b` or `a : step : b`.
    fn range(&mut self, nodes: &mut Nodes<'t>, span: Span) -> Expr {
        let mut parts = vec![self.climb(nodes, level::OR)];
        while nodes.peek().is_some_and(|n| n.as_str() == ":") {
            let colon = nodes.next().map(|n| self.span(&n));
            if parts.len() == 3 {
                let colon = colon.unwrap_or(span);
                self.error(colon, "a range has at most three parts: `start : step : stop`");
            }
            parts.push(self.climb(nodes, level::OR));
        }
        parts.truncate(3);
        let mut parts = parts.into_iter();
        let first = parts.next().unwrap_or(Expr { kind: ExprKind::Colon, span });
        let kind = match (parts.next().map(Box::new), parts.next().map(Box::new)) {
            (None, _) => return first,
            (Some(stop), None) => ExprKind::Range(Box::new(first), None, stop),
            (Some(step), Some(stop)) => ExprKind::Range(Box::new(first), Some(step), stop),
        };
        Expr { kind, span }
    }

    /// Everything that binds at least as tightly as `least`.
    fn climb(&mut self, nodes: &mut Nodes<'t>, least: u8) -> Expr {
        let mut left = self.signed(nodes, least);
        while let Some((op, precedence)) = nodes.peek().and_then(|n| binary(n.as_str())) {
            if precedence < least {
                break;
            }
            // All terms of one level, so that long sums and products do not make deep trees.
            let mut chain: Vec<(BinaryOp, Expr)> = Vec::new();
            let mut next = Some((op, precedence));
            while let Some((op, _)) = next.filter(|(_, level)| *level == precedence) {
                nodes.next();
                let right = self.climb(nodes, precedence + 1);
                self.check_chain(nodes, precedence);
                chain.push((op, right));
                next = nodes.peek().and_then(|n| binary(n.as_str()));
            }
            left = join(left, chain);
        }
        left
    }

    /// Reports `a < b < c` and `a ^ b ^ c` at the second operator.
    fn check_chain(&mut self, nodes: &mut Nodes<'t>, precedence: u8) {
        let Some(next) = nodes.peek().filter(|n| binary(n.as_str()).is_some_and(|(_, l)| l == precedence)) else {
            return;
        };
        let (span, text) = (self.span(next), next.as_str());
        if precedence == level::RELATION {
            let message = format!("a comparison cannot be followed by another one: unexpected `{text}`");
            self.error(span, message).notes.push("write `a < b and b < c`".into());
        } else if precedence == level::POWER {
            let message = format!("powers cannot be chained: unexpected `{text}`");
            self.error(span, message).notes.push("use parentheses: `(a^b)^c` or `a^(b^c)`".into());
        }
    }

    /// An operand with the signs or `not` before it; `least` is the level of the place where it stands.
    fn signed(&mut self, nodes: &mut Nodes<'t>, least: u8) -> Expr {
        let mut signs: Vec<(UnaryOp, Span)> = Vec::new();
        // After `not` a sign begins the relation that is negated: `not -a < b` is `not (-a < b)`.
        let begins_relation = |signs: &[(UnaryOp, Span)], sign: &Node<'t>| {
            sign.as_str() != "not" && matches!(signs.last(), Some((UnaryOp::Not, _)))
        };
        while let Some(sign) = nodes.next_if(|n| n.as_rule() == Rule::prefix && !begins_relation(&signs, n)) {
            let op = match sign.as_str() {
                "not" => UnaryOp::Not,
                "+" | ".+" => UnaryOp::Plus,
                _ => UnaryOp::Minus,
            };
            let span = self.span(&sign);
            self.check_sign(op, sign.as_str(), span, signs.last().map_or(least, |&(before, _)| after_sign(before)));
            signs.push((op, span));
        }
        let Some(&(last, _)) = signs.last() else { return self.operand(nodes) };
        let mut value = self.climb(nodes, after_sign(last).max(least));
        for (op, span) in signs.into_iter().rev() {
            let span = span.to(value.span);
            value = Expr { kind: ExprKind::Unary(op, Box::new(value)), span };
        }
        value
    }

    fn check_sign(&mut self, op: UnaryOp, text: &str, span: Span, place: u8) {
        if op == UnaryOp::Not && place > level::NOT {
            self.error(span, "`not` cannot stand here").notes.push("put it in parentheses: `(not a)`".into());
        } else if op != UnaryOp::Not && place > level::SUM {
            let message = format!("the sign `{text}` cannot follow another operator");
            self.error(span, message).notes.push(format!("put it in parentheses: `({text}a)`"));
        }
    }

    fn operand(&mut self, nodes: &mut Nodes<'t>) -> Expr {
        let Some(node) = nodes.next() else {
            let end = Span::new(self.file, self.text.len(), self.text.len());
            return Expr { kind: ExprKind::Colon, span: end };
        };
        let span = self.span(&node);
        let kind = match node.as_rule() {
            Rule::reference => {
                let reference = self.reference(node);
                return self.call(reference, nodes, span);
            }
            Rule::call_word => {
                let part = RefPart { name: self.ident(&node), subscripts: Vec::new() };
                return self.call(ComponentRef { global: false, parts: vec![part], span }, nodes, span);
            }
            Rule::number => self.number(&node, span),
            Rule::string => ExprKind::Text(unescape(node.as_str()).into()),
            Rule::boolean => ExprKind::Boolean(node.as_str() == "true"),
            Rule::end_value => {
                if self.subscripts == 0 {
                    self.error(span, "`end` as a value has a meaning only in an index, such as `x[end]`");
                }
                ExprKind::End
            }
            Rule::array => self.array(node),
            Rule::matrix => ExprKind::Matrix(
                node.into_inner().filter(|n| n.as_rule() == Rule::row).map(|row| self.expressions(row)).collect(),
            ),
            _ => return self.paren(node),
        };
        Expr { kind, span }
    }

    fn call(&mut self, reference: ComponentRef, nodes: &mut Nodes<'t>, span: Span) -> Expr {
        match nodes.next_if(|n| n.as_rule() == Rule::arguments) {
            Some(arguments) => {
                let span = span.to(self.span(&arguments));
                let arguments = self.arguments(arguments);
                Expr { kind: ExprKind::Call(reference, arguments), span }
            }
            None => Expr { kind: ExprKind::Ref(reference), span },
        }
    }

    fn number(&mut self, node: &Node<'t>, span: Span) -> ExprKind {
        let text = node.as_str();
        if !text.contains(['.', 'e', 'E']) {
            if let Ok(value) = text.parse() {
                return ExprKind::Integer(value);
            }
            self.error(span, format!("the Integer `{text}` is larger than {}", i64::MAX))
                .notes
                .push("write it as a Real, with a decimal point".into());
            return ExprKind::Integer(i64::MAX);
        }
        let value: f64 = text.parse().unwrap_or(f64::INFINITY);
        if value.is_infinite() {
            self.error(span, format!("the number `{text}` is too large for a Real"));
            return ExprKind::Real(f64::MAX);
        }
        ExprKind::Real(value)
    }

    /// One expression in parentheses is that expression with a span that covers them; otherwise a result list.
    fn paren(&mut self, node: Node<'t>) -> Expr {
        let span = self.span(&node);
        let mut slots: Vec<Option<Expr>> = vec![None];
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::comma => slots.push(None),
                Rule::expression => {
                    let value = self.expression(part);
                    let last = slots.len() - 1;
                    slots[last] = Some(value);
                }
                _ => {}
            }
        }
        match slots.pop() {
            Some(Some(only)) if slots.is_empty() => Expr { kind: only.kind, span },
            Some(None) if slots.is_empty() => Expr { kind: ExprKind::Tuple(slots), span },
            last => {
                slots.extend(last);
                Expr { kind: ExprKind::Tuple(slots), span }
            }
        }
    }

    fn array(&mut self, node: Node<'t>) -> ExprKind {
        let span = self.span(&node);
        let mut values = Vec::new();
        let mut iterators = None;
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::expression => values.push(self.expression(part)),
                Rule::for_clause => iterators = Some(self.iterators(part)),
                _ => {}
            }
        }
        if values.is_empty() && self.annotations == 0 {
            self.error(span, "an array constructor needs at least one element")
                .notes
                .push("an empty array is written `fill(0.0, 0)`".into());
        }
        match (iterators, values.pop()) {
            (Some(iterators), Some(value)) => ExprKind::ArrayFor(Box::new(value), iterators),
            (_, last) => {
                values.extend(last);
                ExprKind::Array(values)
            }
        }
    }

    /// All `expression` children.
    pub(crate) fn expressions(&mut self, node: Node<'t>) -> Vec<Expr> {
        node.into_inner().filter(|n| n.as_rule() == Rule::expression).map(|n| self.expression(n)).collect()
    }

    /// A `for_clause` node.
    pub(crate) fn iterators(&mut self, node: Node<'t>) -> Vec<Iterator> {
        let mut iterators = Vec::new();
        for part in node.into_inner().filter(|n| n.as_rule() == Rule::iterator) {
            let mut parts = part.into_inner();
            let Some(name) = parts.next().map(|n| self.ident(&n)) else { continue };
            let range = parts.find(|n| n.as_rule() == Rule::expression).map(|n| self.expression(n));
            iterators.push(Iterator { name, range });
        }
        iterators
    }

    /// An `arguments` node.
    pub(crate) fn arguments(&mut self, node: Node<'t>) -> Arguments {
        let mut positional = Vec::new();
        let mut named = Vec::new();
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::expression => {
                    let span = self.span(&part);
                    positional.push(self.expression(part));
                    if !named.is_empty() {
                        self.error(span, "an argument without a name cannot follow named ones");
                    }
                }
                Rule::named_argument => {
                    let mut parts = part.into_inner();
                    let Some(name) = parts.next().map(|n| self.ident(&n)) else { continue };
                    for value in parts {
                        match value.as_rule() {
                            Rule::expression => named.push((name.clone(), self.expression(value))),
                            Rule::partial_call => named.push((name.clone(), self.partial_call(value))),
                            _ => {}
                        }
                    }
                }
                Rule::partial_call => {
                    let function = self.partial_call(part);
                    if !named.is_empty() {
                        self.error(function.span, "an argument without a name cannot follow named ones");
                    }
                    positional.push(function);
                }
                Rule::for_clause => {
                    let iterators = self.iterators(part);
                    if let Some(value) = positional.pop() {
                        return Arguments::Reduction(Box::new(value), iterators);
                    }
                }
                _ => {}
            }
        }
        Arguments::List { positional, named }
    }

    /// A `partial_call` node.
    fn partial_call(&mut self, node: Node<'t>) -> Expr {
        let span = self.span(&node);
        let mut function = ComponentRef { global: false, parts: Vec::new(), span };
        let mut given = Vec::new();
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::path => {
                    let path = self.path(part);
                    let part = |name| RefPart { name, subscripts: Vec::new() };
                    let parts = path.parts.into_iter().map(part).collect();
                    function = ComponentRef { global: path.global, parts, span: path.span };
                }
                Rule::arguments => {
                    let Arguments::List { positional, named } = self.arguments(part) else { continue };
                    if let Some(first) = positional.first() {
                        self.error(
                            first.span,
                            "a function as an argument is given its inputs by name: `function f(a = 1)`",
                        );
                    }
                    given = named;
                }
                _ => {}
            }
        }
        Expr { kind: ExprKind::Partial(function, given), span }
    }

    /// A `reference` node.
    /// An `external` node; a clause that has not the form of the language keeps its place only.
    pub(crate) fn external(&mut self, node: Node<'t>) -> External {
        let mut external = External { language: None, call: None, span: self.trimmed_span(&node) };
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::string => external.language = Some(unescape(part.as_str()).into()),
                Rule::external_call => external.call = self.external_call(part),
                _ => {}
            }
        }
        external
    }

    fn external_call(&mut self, node: Node<'t>) -> Option<ExternalCall> {
        let (mut output, mut name, mut arguments) = (None, None, Vec::new());
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::reference => output = Some(self.reference(part)),
                Rule::ident => name = Some(self.ident(&part)),
                Rule::expression => arguments.push(self.expression(part)),
                _ => {}
            }
        }
        Some(ExternalCall { output, name: name?, arguments })
    }

    pub(crate) fn reference(&mut self, node: Node<'t>) -> ComponentRef {
        let span = self.span(&node);
        let mut reference = ComponentRef { global: false, parts: Vec::new(), span };
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::dot => reference.global = true,
                Rule::subscripts => {
                    let subscripts = self.subscripts(part);
                    if let Some(last) = reference.parts.last_mut() {
                        last.subscripts = subscripts;
                    }
                }
                _ => reference.parts.push(RefPart { name: self.ident(&part), subscripts: Vec::new() }),
            }
        }
        reference
    }

    /// A `subscripts` node.
    pub(crate) fn subscripts(&mut self, node: Node<'t>) -> Vec<Expr> {
        let mut subscripts = Vec::new();
        self.subscripts += 1;
        for part in node.into_inner() {
            match part.as_rule() {
                Rule::all_colon => subscripts.push(Expr { kind: ExprKind::Colon, span: self.span(&part) }),
                Rule::expression => subscripts.push(self.expression(part)),
                _ => {}
            }
        }
        self.subscripts -= 1;
        subscripts
    }
}

/// The least level of what stands after a sign: a term after `-`, a relation after `not`.
fn after_sign(op: UnaryOp) -> u8 {
    match op {
        UnaryOp::Not => level::RELATION,
        UnaryOp::Minus | UnaryOp::Plus => level::PRODUCT,
    }
}
