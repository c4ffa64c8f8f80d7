//! A flat model from short texts: declarations and equations, one string each.
//!
//! `real x`, `real x = 2` (start), `fixed x = 2`, `param p = 3*q`, `free p = 1` (found at the start), `const c = 2`,
//! `discrete d`, `boolean b`, `internal b`; equations `left = right` with a section.  Precedence: or, and, not, relation,
//! sum, product, sign, power.  Each distinct operand of an equation gets one slot.

use hyd_flat::{
    EquationBlock, FlatModel, Made, Operand, PerElement, Section, StateSelect, Target, VarId, VariableBlock,
};
use hyd_source::{FileId, Origin, Span};
use hyd_symbolic::{Function, Node, NodeId, Relation, SlotId, canonical};
use hyd_system::{NamePattern, Settable, ValueKind, Variability};

pub(crate) struct Model {
    pub flat: FlatModel,
    next_byte: usize,
}

impl Model {
    /// A model of the given declarations and continuous equations.
    pub(crate) fn new(declarations: &[&str], equations: &[&str]) -> Self {
        let mut model = Self { flat: FlatModel::default(), next_byte: 0 };
        for declaration in declarations {
            model.declare(declaration);
        }
        for declaration in declarations {
            model.give_value(declaration);
        }
        for equation in equations {
            model.equation(Section::Continuous, equation);
        }
        model
    }

    pub(crate) fn with(mut self, section: Section, equations: &[&str]) -> Self {
        for equation in equations {
            self.equation(section, equation);
        }
        self
    }

    pub(crate) fn origin(&mut self) -> Origin {
        self.next_byte += 10;
        let span = Span { file: FileId(0), start: self.next_byte as u32 - 10, end: self.next_byte as u32 - 1 };
        Origin { path: "".into(), span }
    }

    fn declare(&mut self, text: &str) {
        let head = text.split('=').next().unwrap_or_default().trim();
        let (kind, name) = head.split_once(' ').expect("`kind name`");
        let block = self.block(kind, name, 1, text.contains('='));
        self.flat.variables.push(block);
        self.flat.scalars += 1;
    }

    fn give_value(&mut self, text: &str) {
        let Some((head, value)) = text.split_once('=') else { return };
        let (kind, name) = head.trim().split_once(' ').expect("`kind name`");
        match kind {
            "param" | "const" => self.equation(Section::Binding, &format!("{name} = {value}")),
            _ => self.equation(Section::Start, &format!("start({name}) = {value}")),
        }
    }

    pub(crate) fn block(&mut self, kind: &str, name: &str, count: u32, has_start: bool) -> VariableBlock {
        let variability = match kind {
            "param" | "free" => Variability::Parameter,
            "const" => Variability::Constant,
            "discrete" | "boolean" | "internal" => Variability::Discrete,
            _ => Variability::Continuous,
        };
        let dims = if count == 1 { vec![] } else { vec![count] };
        VariableBlock {
            name: NamePattern { parts: vec![(name.into(), dims)], derivative: false },
            first: VarId(self.flat.scalars),
            count,
            kind: if matches!(kind, "boolean" | "internal") { ValueKind::Boolean } else { ValueKind::Real },
            declared: None,
            variability,
            unit: None,
            element_units: Vec::new(),
            display_unit: None,
            description: None,
            settable: Settable::Yes,
            protected: false,
            made: (kind == "internal").then_some(Made::Event),
            has_start,
            fixed: PerElement::All(matches!(kind, "fixed" | "param" | "const")),
            min: PerElement::All(f64::NEG_INFINITY),
            max: PerElement::All(f64::INFINITY),
            limit_spans: [None, None],
            at_any_time: false,
            nominal: PerElement::All(None),
            state_select: PerElement::All(StateSelect::Default),
            origin: self.origin(),
        }
    }

    pub(crate) fn equation(&mut self, section: Section, text: &str) {
        let (left, right) = split_equation(text);
        let mut parser = Parser { model: self, operands: Vec::new(), rest: "" };
        let left = parser.whole(left);
        let right = parser.whole(right);
        let operands = parser.operands;
        let (template, slots) = canonical(&mut self.flat.templates.arena, left, right);
        let operands = slots.iter().map(|slot| operands[slot.0 as usize]).collect();
        let template = self.flat.templates.intern(template);
        let origin = self.origin();
        self.flat.equations.push(EquationBlock { section, made: false, template, count: 1, operands, origin });
    }

    pub(crate) fn var(&self, name: &str) -> VarId {
        let found = (0..self.flat.scalars).map(VarId).find(|&v| self.flat.var_name(v) == name);
        found.unwrap_or_else(|| panic!("no variable {name}"))
    }
}

/// Splits at the `=` that is not part of a relation.
fn split_equation(text: &str) -> (&str, &str) {
    let bytes = text.as_bytes();
    let lone = |&k: &usize| bytes[k] == b'=' && !b"<>=".contains(&bytes[k - 1]) && bytes.get(k + 1) != Some(&b'=');
    let at = (1..bytes.len()).find(lone).expect("an equation has an equals sign");
    (&text[..at], &text[at + 1..])
}

struct Parser<'a> {
    model: &'a mut Model,
    operands: Vec<Operand>,
    rest: &'a str,
}

impl<'a> Parser<'a> {
    fn whole(&mut self, text: &'a str) -> NodeId {
        self.rest = text;
        let node = self.expression();
        assert!(self.rest.trim().is_empty(), "cannot read `{}`", self.rest);
        node
    }

    fn build(&mut self, node: Node) -> NodeId {
        self.model.flat.templates.arena.build(node)
    }

    fn eat(&mut self, token: &str) -> bool {
        self.rest = self.rest.trim_start();
        let word = token.chars().all(char::is_alphabetic);
        let follows = self.rest.get(token.len()..).and_then(|r| r.chars().next());
        let fits = self.rest.starts_with(token) && !(word && follows.is_some_and(|c| c.is_alphanumeric() || c == '_'));
        if fits {
            self.rest = &self.rest[token.len()..];
        }
        fits
    }

    fn expression(&mut self) -> NodeId {
        if self.eat("if") {
            let c = self.expression();
            assert!(self.eat("then"));
            let a = self.expression();
            assert!(self.eat("else"));
            let b = self.expression();
            return self.build(Node::If(c, a, b));
        }
        let mut left = self.conjunction();
        while self.eat("or") {
            let right = self.conjunction();
            left = self.build(Node::Or(left, right));
        }
        left
    }

    fn conjunction(&mut self) -> NodeId {
        let mut left = self.relation();
        while self.eat("and") {
            let right = self.relation();
            left = self.build(Node::And(left, right));
        }
        left
    }

    fn relation(&mut self) -> NodeId {
        if self.eat("not") {
            let a = self.relation();
            return self.build(Node::Not(a));
        }
        let left = self.sum();
        let relations = [
            ("<=", Relation::LessEqual),
            (">=", Relation::GreaterEqual),
            ("<>", Relation::NotEqual),
            ("==", Relation::Equal),
            ("<", Relation::Less),
            (">", Relation::Greater),
        ];
        for (token, relation) in relations {
            if self.eat(token) {
                let right = self.sum();
                return self.build(Node::Event(relation, left, right));
            }
        }
        left
    }

    fn sum(&mut self) -> NodeId {
        let mut left = if self.eat("-") {
            let a = self.product();
            self.build(Node::Neg(a))
        } else {
            self.product()
        };
        loop {
            if self.eat("+") {
                let right = self.product();
                left = self.build(Node::Add(left, right));
            } else if self.eat("-") {
                let right = self.product();
                left = self.build(Node::Sub(left, right));
            } else {
                return left;
            }
        }
    }

    fn product(&mut self) -> NodeId {
        let mut left = self.power();
        loop {
            if self.eat("*") {
                let right = self.power();
                left = self.build(Node::Mul(left, right));
            } else if self.eat("/") {
                let right = self.power();
                left = self.build(Node::Div(left, right));
            } else {
                return left;
            }
        }
    }

    fn power(&mut self) -> NodeId {
        let base = self.primary();
        if self.eat("^") {
            let exponent = self.primary();
            return self.build(Node::Call2(Function::Pow, base, exponent));
        }
        base
    }

    fn primary(&mut self) -> NodeId {
        if self.eat("(") {
            let inside = self.expression();
            assert!(self.eat(")"));
            return inside;
        }
        self.rest = self.rest.trim_start();
        let end = self.rest.find(|c: char| !c.is_alphanumeric() && !"._$[]".contains(c)).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        if let Ok(value) = word.parse::<f64>() {
            return self.model.flat.templates.arena.constant(value);
        }
        if !self.eat("(") {
            return match word {
                "time" => self.build(Node::Time),
                "true" => self.model.flat.templates.arena.constant(1.0),
                "false" => self.model.flat.templates.arena.constant(0.0),
                _ => self.slot(Target::Var(self.model.var(word))),
            };
        }
        if word == "initial" {
            assert!(self.eat(")"));
            return self.build(Node::Initial);
        }
        let target = match word {
            "der" => Some(Target::Der as fn(VarId) -> Target),
            "pre" => Some(Target::Pre as fn(VarId) -> Target),
            "start" => Some(Target::Start as fn(VarId) -> Target),
            _ => None,
        };
        if let Some(make) = target {
            let (name, rest) = self.rest.split_once(')').expect("a name in parentheses");
            let v = self.model.var(name.trim());
            self.rest = rest;
            return self.slot(make(v));
        }
        let function = Function::from_name(word).unwrap_or_else(|| panic!("no function {word}"));
        let a = self.expression();
        let node = if self.eat(",") {
            let b = self.expression();
            self.build(Node::Call2(function, a, b))
        } else {
            self.build(Node::Call1(function, a))
        };
        assert!(self.eat(")"));
        node
    }

    fn slot(&mut self, target: Target) -> NodeId {
        let operand = Operand::new(target);
        let known = self.operands.iter().position(|&other| other == operand);
        let slot = known.unwrap_or_else(|| {
            self.operands.push(operand);
            self.operands.len() - 1
        });
        self.model.flat.templates.arena.slot(SlotId(slot as u32))
    }
}
