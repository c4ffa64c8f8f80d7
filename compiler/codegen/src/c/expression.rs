//! Expressions as C: what is used once stands where it is used, what is used more often gets a local variable.
//!
//! Parentheses keep the order of operations, which floating point numbers remember.

use std::collections::HashSet;
use std::fmt::Write as _;

use hyd_symbolic::{Arena, BodyId, Function, MACHINE_LIMITS, Node, NodeId, Relation};
use rustc_hash::FxHashMap;

/// Expressions nested deeper than this are broken into local variables.
const DEEPEST: u32 = 12;

/// Words that are not names of local variables.
const RESERVED: &[&str] = &[
    "auto", "break", "case", "char", "const", "continue", "default", "do", "double", "else", "enum", "extern", "float",
    "for", "goto", "if", "inline", "int", "long", "register", "restrict", "return", "short", "signed", "sizeof",
    "static", "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "while", "d", "y", "yp", "w",
    "out", "out2", "k", "a", "o", "r", "account", "i", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh",
    "cosh", "tanh", "exp", "log", "log10", "sqrt", "pow", "fabs", "floor", "ceil", "trunc", "NAN", "INFINITY", "fail",
    "done",
];

/// How tightly the parts of an expression are bound.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Bond {
    Choice,
    Or,
    And,
    Relation,
    Sum,
    Product,
    Sign,
    Tight,
}

#[derive(Clone)]
struct Text {
    text: String,
    bond: Bond,
    /// It is a truth of C, 0 or 1 as an integer, and not a number.
    truth: bool,
    depth: u32,
}

/// Writes the expressions of one block.
pub(super) struct Writer<'a> {
    arena: &'a Arena,
    order: &'a [NodeId],
    roots: &'a [NodeId],
    prefix: &'a str,
    indent: String,
    known: FxHashMap<NodeId, Text>,
    calls: FxHashMap<(BodyId, NodeId), String>,
    uses: FxHashMap<NodeId, u32>,
    taken: HashSet<String>,
    count: usize,
    /// The account of the function around, none outside of functions.
    account: Option<&'static str>,
}

impl<'a> Writer<'a> {
    /// For the expressions `roots` with all their parts in `order`.
    pub(super) fn new(
        arena: &'a Arena,
        order: &'a [NodeId],
        roots: &'a [NodeId],
        prefix: &'a str,
        indent: String,
    ) -> Self {
        let mut uses: FxHashMap<NodeId, u32> = FxHashMap::default();
        for &id in order {
            for operand in arena.node(id).operands() {
                *uses.entry(operand).or_default() += 1;
            }
        }
        roots.iter().for_each(|root| *uses.entry(*root).or_default() += 1);
        let taken = RESERVED.iter().map(|word| word.to_string()).collect();
        Self {
            arena,
            order,
            roots,
            prefix,
            indent,
            known: FxHashMap::default(),
            calls: FxHashMap::default(),
            uses,
            taken,
            count: 0,
            account: None,
        }
    }

    /// Calls of functions take from the account of the function around.
    pub(super) fn within(mut self, account: &'static str) -> Self {
        self.account = Some(account);
        self
    }

    /// A name that nothing else has.
    pub(super) fn local(&mut self, wanted: &str) -> String {
        let mut name = wanted.to_string();
        let mut count = 1;
        while !self.taken.insert(name.clone()) {
            count += 1;
            name = format!("{wanted}_{count}");
        }
        name
    }

    /// Gives a leaf its text.
    pub(super) fn define(&mut self, id: NodeId, text: String, number: bool) {
        let bond = if number && text.starts_with('-') { Bond::Sign } else { Bond::Tight };
        self.known.insert(id, Text { text, bond, truth: false, depth: 0 });
    }

    /// Writes local variables and returns the texts of the roots, as numbers.
    pub(super) fn write(mut self, out: &mut String) -> Result<Vec<String>, std::fmt::Error> {
        for &id in self.order {
            if self.known.contains_key(&id) || matches!(self.arena.node(id), Node::Pair(..)) {
                continue;
            }
            let mut text = self.text(out, id)?;
            let simple = matches!(
                self.arena.node(id),
                Node::Const(_) | Node::Time | Node::Initial | Node::Homotopy | Node::Apply(..)
            );
            let often = self.uses.get(&id).copied().unwrap_or(0) > 1;
            if !simple && (often || text.depth > DEEPEST) {
                self.count += 1;
                let name = self.local(&format!("t{}", self.count));
                let kind = if text.truth { "int" } else { "double" };
                writeln!(out, "{}const {kind} {name} = {};", self.indent, text.text)?;
                text = Text { text: name, bond: Bond::Tight, truth: text.truth, depth: 0 };
            }
            self.known.insert(id, text);
        }
        Ok(self.roots.iter().map(|root| self.known[root].text.clone()).collect())
    }

    fn text(&mut self, out: &mut String, id: NodeId) -> Result<Text, std::fmt::Error> {
        Ok(match self.arena.node(id) {
            Node::Const(value) => {
                let text = number(value.value());
                let bond = if text.starts_with('-') { Bond::Sign } else { Bond::Tight };
                Text { text, bond, truth: false, depth: 0 }
            }
            Node::Time => leaf("d[0]"),
            Node::Initial => leaf("d[1]"),
            Node::Homotopy => leaf("d[2]"),
            Node::Neg(a) => self.compose(&[a], Bond::Sign, |part| format!("-{}", part(0, Bond::Tight))),
            Node::Add(a, b) => self.infix(a, "+", b, Bond::Sum),
            Node::Sub(a, b) => self.infix(a, "-", b, Bond::Sum),
            Node::Mul(a, b) => self.infix(a, "*", b, Bond::Product),
            Node::Div(a, b) => self.infix(a, "/", b, Bond::Product),
            Node::Not(a) => {
                let (condition, depth) = self.condition(a, Bond::Tight);
                Text { text: format!("!{condition}"), bond: Bond::Sign, truth: true, depth: depth + 1 }
            }
            Node::And(a, b) => self.logic(a, "&&", b, Bond::And),
            Node::Or(a, b) => self.logic(a, "||", b, Bond::Or),
            Node::Compare(relation, a, b) | Node::Event(relation, a, b) => {
                let mut text = self.infix(a, sign(relation), b, Bond::Relation);
                text.truth = true;
                text
            }
            Node::If(c, a, b) => {
                let (condition, depth) = self.condition(c, Bond::Or);
                let mut text = self.compose(&[a, b], Bond::Choice, |part| {
                    format!("{condition} ? {} : {}", part(0, Bond::Or), part(1, Bond::Choice))
                });
                text.depth = text.depth.max(depth + 1);
                text
            }
            Node::Call1(function, a) => {
                self.compose(&[a], Bond::Tight, |part| format!("{}({})", name(function), part(0, Bond::Choice)))
            }
            Node::Call2(function, a, b) => self.compose(&[a, b], Bond::Tight, |part| {
                format!("{}({}, {})", name(function), part(0, Bond::Choice), part(1, Bond::Choice))
            }),
            Node::Apply(body, output, list) => {
                let results = self.call(out, body, list)?;
                leaf(&format!("{results}[{output}]"))
            }
            Node::Slot(slot) => leaf(&format!("r[{}]", slot.0)),
            Node::Pair(..) => leaf("0"),
        })
    }

    /// Calls a function once for all its outputs; the name of the array that holds them.
    fn call(&mut self, out: &mut String, body: BodyId, list: NodeId) -> Result<String, std::fmt::Error> {
        if let Some(name) = self.calls.get(&(body, list)) {
            return Ok(name.clone());
        }
        let arguments: Vec<String> = self.arena.arguments(list).iter().map(|id| self.known[id].text.clone()).collect();
        self.count += 1;
        let (given, results) = (self.local(&format!("in{}", self.count)), self.local(&format!("res{}", self.count)));
        let (indent, count) = (self.indent.clone(), self.arena.body(body).outputs.len());
        writeln!(out, "{indent}const double {given}[] = {{{}}};", arguments.join(", "))?;
        writeln!(out, "{indent}double {results}[{count}];")?;
        let account = match self.account {
            Some(account) => account.to_string(),
            None => {
                let name = self.local(&format!("left{}", self.count));
                let limits = MACHINE_LIMITS;
                writeln!(out, "{indent}hyd_account {name} = {{{}, {}}};", limits.turns, limits.stack)?;
                format!("&{name}")
            }
        };
        writeln!(out, "{indent}{}_f{}({given}, {results}, {account});", self.prefix, body.0)?;
        self.calls.insert((body, list), results.clone());
        Ok(results)
    }

    fn part(&self, id: NodeId, least: Bond) -> String {
        let known = &self.known[&id];
        if known.bond < least { format!("({})", known.text) } else { known.text.clone() }
    }

    fn compose(
        &self,
        operands: &[NodeId],
        bond: Bond,
        write: impl Fn(&dyn Fn(usize, Bond) -> String) -> String,
    ) -> Text {
        let text = write(&|k, least| self.part(operands[k], least));
        let depth = operands.iter().map(|id| self.known[id].depth).max().unwrap_or(0) + 1;
        Text { text, bond, truth: false, depth }
    }

    /// The right side is bound tighter: floating point sums and products are not associative.
    fn infix(&self, a: NodeId, operator: &str, b: NodeId, bond: Bond) -> Text {
        let tighter = match bond {
            Bond::Sum => Bond::Product,
            Bond::Product => Bond::Sign,
            _ => Bond::Sum,
        };
        let left = if bond == Bond::Relation { Bond::Sum } else { bond };
        self.compose(&[a, b], bond, |part| {
            // `a - -b` would read as a decrement without the space; parentheses are clearer.
            let right = part(1, tighter);
            let right = if right.starts_with('-') { format!("({right})") } else { right };
            format!("{} {operator} {right}", part(0, left))
        })
    }

    fn logic(&self, a: NodeId, operator: &str, b: NodeId, bond: Bond) -> Text {
        // Mixed `&&` and `||` get parentheses, as compilers advise.
        let ((left, d), (right, e)) = (self.condition(a, Bond::Relation), self.condition(b, Bond::Relation));
        Text { text: format!("{left} {operator} {right}"), bond, truth: true, depth: d.max(e) + 1 }
    }

    /// A truth: different from zero.
    fn condition(&self, id: NodeId, least: Bond) -> (String, u32) {
        let known = &self.known[&id];
        let text = match known.truth {
            true => self.part(id, least),
            false if least == Bond::Tight => format!("({} != 0)", self.part(id, Bond::Sum)),
            false => format!("{} != 0", self.part(id, Bond::Sum)),
        };
        (text, known.depth)
    }
}

fn leaf(text: &str) -> Text {
    Text { text: text.to_string(), bond: Bond::Tight, truth: false, depth: 0 }
}

/// A number that C reads to the same bits.
pub(super) fn number(value: f64) -> String {
    match value {
        _ if value.is_nan() => "NAN".into(),
        f64::INFINITY => "INFINITY".into(),
        f64::NEG_INFINITY => "-INFINITY".into(),
        _ => format!("{value:?}"),
    }
}

fn sign(relation: Relation) -> &'static str {
    match relation {
        Relation::Less => "<",
        Relation::LessEqual => "<=",
        Relation::Greater => ">",
        Relation::GreaterEqual => ">=",
        Relation::Equal => "==",
        Relation::NotEqual => "!=",
    }
}

fn name(function: Function) -> &'static str {
    match function {
        Function::Abs => "fabs",
        Function::Sign => "hyd_sign",
        Function::Min => "hyd_min",
        Function::Max => "hyd_max",
        Function::Div => "hyd_div",
        Function::Mod => "hyd_mod",
        Function::Rem => "hyd_rem",
        other => other.name(),
    }
}
