//! Units of the expressions of one equation, and what they must satisfy.
//!
//! A template is gone through once per tuple of slot classes, operands before the nodes that use them.  Sums, relations,
//! branches and both sides of the equation must agree, arguments of transcendental functions must be numbers: each such
//! demand between two quantities is a [`Row`] of a system that is linear in the exponents of the unknown units (Kennedy
//! 1994; Wand and O'Keefe, "Automatic dimensional inference", 1991).  Rows that hold already are dropped.

use hyd_symbolic::{Arena, BodyId, Function, Node, NodeId, SlotId, Template, post_order, slots};
use rustc_hash::FxHashMap;

use crate::form::{Fit, Form, Product, is_plain};
use crate::rational::Rational;
use crate::unit::Unit;

/// Integers up to this are plain factors wherever they stand.
pub(crate) const SMALL: f64 = 12.0;
/// Largest denominator of a constant exponent.
const LARGEST_DENOMINATOR: i64 = 1000;

/// Why two units must agree.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Rule {
    /// Both sides of an equation.
    Equation,
    /// Terms of a sum.
    Terms,
    /// Branches of an `if`.
    Branches,
    /// Sides of a relation.
    Relation,
    /// Arguments of a function such as `max`.
    Arguments(Function),
    /// The argument of a function such as `sin` must be a number.
    Number(Function),
    /// The base of a power with variable exponent must be a number.
    Base,
    /// An exponent must be a number.
    Exponent,
    /// What a function or record declares of the value given to it.
    Claim,
}

/// Two units that must agree.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    /// Number of the template and its classes.
    pub case: u32,
    /// What the sides are; no second node where a number is asked for.
    pub nodes: (NodeId, Option<NodeId>),
    /// Unit of the first.
    pub left: Product,
    /// Unit of the second, or a number.
    pub right: Product,
    /// Why.
    pub rule: Rule,
}

/// What numbers of the text are as factors.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Literals {
    /// Those that are plain have no unit, others may have any.
    AsUsual,
    /// All but 0 and 1 may have any.
    Quantities,
}

/// What is needed to go through a template.
pub(crate) struct Case<'a> {
    /// The nodes.
    pub arena: &'a Arena,
    /// Form of each slot.
    pub slots: Vec<Form>,
    /// Value of slots that hold a number, for exponents.
    pub values: Vec<Option<f64>>,
    /// Numbers may be conversions, because some variable has a unit with a factor.
    pub conversions: bool,
    /// Larger integers stand in the text, so that they are not constants with a unit put in by value.
    pub visible: bool,
    /// What numbers are.
    pub literals: Literals,
    /// Units of the results of compiled functions.
    pub results: &'a FxHashMap<(BodyId, u32), Unit>,
    /// Number of this case.
    pub number: u32,
}

/// Goes through `left = right` (only `left` if `alone`) and adds the rows that do not hold already.
pub(crate) fn infer(case: &Case<'_>, template: &Template, (alone, rule): (bool, Rule), rows: &mut Vec<Row>) {
    let roots = [template.left, template.right];
    let roots = if alone { &roots[..1] } else { &roots[..] };
    let mut pass = Pass { case, forms: FxHashMap::default(), rows, apart: residuals(case.arena, template) };
    for id in post_order(case.arena, roots) {
        let form = pass.form(id);
        pass.forms.insert(id, form);
    }
    if !alone {
        pass.agree(template.left, template.right, rule);
    }
}

/// The branches of `0 = if c then l1 - r1 else l2 - r2`, which an `if` equation becomes whose branches set different variables: each is an equation
/// of its own.
fn residuals(arena: &Arena, template: &Template) -> Vec<NodeId> {
    let mut found = Vec::new();
    if arena.as_constant(template.left) == Some(0.0) {
        let mut todo = vec![template.right];
        while let Some(id) = todo.pop() {
            if let Node::If(_, a, b) = arena.node(id) {
                found.push(id);
                todo.extend([a, b]);
            }
        }
    }
    found
}

struct Pass<'a, 'b> {
    case: &'a Case<'a>,
    /// Conditions between equations, not between values.
    apart: Vec<NodeId>,
    forms: FxHashMap<NodeId, Form>,
    rows: &'b mut Vec<Row>,
}

impl Pass<'_, '_> {
    fn of(&self, id: NodeId) -> Form {
        self.forms[&id].clone()
    }

    fn form(&mut self, id: NodeId) -> Form {
        let one = Rational::ONE;
        let conversions = self.case.conversions;
        match self.case.arena.node(id) {
            Node::Const(number) => self.literal(number.value()),
            Node::Slot(slot) => self.case.slots[slot.0 as usize].clone(),
            Node::Time => Form::Quantity(Product::rule(&Unit::SECOND)),
            Node::Initial | Node::Homotopy | Node::Not(_) | Node::And(..) | Node::Or(..) => Form::COUNT,
            Node::Neg(a) => match self.of(a) {
                Form::Quantity(p) => Form::Quantity(Product { offset: p.offset.map(|o| -o), ..p }),
                Form::Number { plain, value } => Form::Number { plain, value: value.map(|v| -v) },
                Form::Free => Form::Free,
            },
            Node::Add(a, b) => self.sum(a, b, 1.0),
            Node::Sub(a, b) => self.sum(a, b, -1.0),
            Node::Mul(a, b) => self.of(a).product(&self.of(b), one, conversions),
            Node::Div(a, b) => self.of(a).product(&self.of(b), Rational::whole(-1), conversions),
            Node::Compare(_, a, b) | Node::Event(_, a, b) => {
                self.agree(a, b, Rule::Relation);
                Form::COUNT
            }
            Node::If(..) if self.apart.contains(&id) => Form::Free,
            Node::If(_, a, b) => self.agree(a, b, Rule::Branches),
            Node::Call1(function, a) => self.call1(function, a),
            Node::Call2(function, a, b) => self.call2(function, a, b),
            // Inside a compiled function units are not followed: its results have what it declares.
            Node::Apply(body, output, _) => match self.case.results.get(&(body, output)) {
                Some(unit) => Form::Quantity(Product::known(unit)),
                None => Form::Free,
            },
            Node::Pair(..) => Form::Free,
        }
    }

    fn literal(&self, value: f64) -> Form {
        let hidden = !self.case.visible && value.abs() > SMALL && value.fract() == 0.0;
        let plain = match self.case.literals {
            Literals::AsUsual => is_plain(value) && !hidden,
            Literals::Quantities => value == 0.0 || value.abs() == 1.0,
        };
        Form::Number { plain, value: Some(value) }
    }

    fn sum(&mut self, a: NodeId, b: NodeId, sign: f64) -> Form {
        let (x, y) = (self.of(a), self.of(b));
        match (&x, &y) {
            (Form::Quantity(p), Form::Number { value, .. }) => Form::Quantity(shifted(p.clone(), *value, 1.0)),
            (Form::Number { value, .. }, Form::Quantity(p)) => Form::Quantity(shifted(p.clone(), *value, sign)),
            (Form::Quantity(p), Form::Quantity(q)) => {
                let offset = p.offset.zip(q.offset).map(|(o, u)| o + sign * u);
                self.demand(p, q, (a, Some(b)), Rule::Terms);
                self.joined(p, q, offset)
            }
            _ => self.agree(a, b, Rule::Terms),
        }
    }

    /// Both must agree; the unit of either.
    fn agree(&mut self, a: NodeId, b: NodeId, rule: Rule) -> Form {
        match (self.of(a), self.of(b)) {
            (Form::Quantity(p), Form::Quantity(q)) => {
                self.demand(&p, &q, (a, Some(b)), rule);
                let offset = p.offset.filter(|o| q.offset == Some(*o));
                self.joined(&p, &q, offset)
            }
            (Form::Quantity(p), _) | (_, Form::Quantity(p)) => Form::Quantity(p),
            (Form::Number { plain: p, .. }, Form::Number { plain: q, .. }) => {
                Form::Number { plain: p && q, value: None }
            }
            _ => Form::Free,
        }
    }

    /// The unit of two terms; nothing if they cannot agree, so that a mistake is reported once.
    fn joined(&self, p: &Product, q: &Product, offset: Option<f64>) -> Form {
        let contradict = p.unknowns == q.unknowns && matches!(p.compare(q), Fit::Dimension | Fit::Factor(_));
        if contradict { Form::Free } else { Form::Quantity(p.join(q, offset)) }
    }

    fn demand(&mut self, left: &Product, right: &Product, nodes: (NodeId, Option<NodeId>), rule: Rule) {
        let zero_points = !matches!(rule, Rule::Terms);
        let (mut left, mut right) = (left.clone(), right.clone());
        if !zero_points {
            // Sums add zero points; whether the sum makes sense shows where it is used.
            (left.offset, right.offset) = (None, None);
        }
        let holds = left.is_known() && right.is_known() && left.compare(&right) == Fit::Same;
        // The unit of an unknown with itself: nothing to learn.
        let same = left == right;
        if !holds && !same {
            self.rows.push(Row { case: self.case.number, nodes, left, right, rule });
        }
    }

    fn number(&mut self, a: NodeId, rule: Rule) {
        if let Form::Quantity(p) = self.of(a) {
            self.demand(&p, &Product::rule(&Unit::ONE), (a, None), rule);
        }
    }

    fn call1(&mut self, function: Function, a: NodeId) -> Form {
        match function {
            Function::Sqrt => self.of(a).power(Rational::new(1, 2).unwrap_or(Rational::ONE)),
            Function::Abs | Function::Floor | Function::Ceil => self.of(a),
            Function::Sign => number_one(),
            _ => {
                self.number(a, Rule::Number(function));
                number_one()
            }
        }
    }

    fn call2(&mut self, function: Function, a: NodeId, b: NodeId) -> Form {
        match function {
            Function::Pow => self.power(a, b),
            Function::Atan2 => {
                self.agree(a, b, Rule::Arguments(function));
                number_one()
            }
            Function::Div => {
                self.agree(a, b, Rule::Arguments(function));
                self.of(a).product(&self.of(b), Rational::whole(-1), false)
            }
            _ => self.agree(a, b, Rule::Arguments(function)),
        }
    }

    fn power(&mut self, base: NodeId, exponent: NodeId) -> Form {
        if let Some(value) = self.constant(exponent) {
            return match Rational::near(value, LARGEST_DENOMINATOR) {
                Some(exponent) => self.of(base).power(exponent),
                None => {
                    self.number(base, Rule::Base);
                    self.of(base)
                }
            };
        }
        self.number(exponent, Rule::Exponent);
        match (self.of(base), self.of(exponent)) {
            // An integer known to the run only: any base will do, and the unit is its power.
            (Form::Quantity(p), Form::Number { .. }) if !(p.is_known() && p.dimension.is_none()) => Form::Free,
            (Form::Quantity(_), _) => {
                self.number(base, Rule::Base);
                number_one()
            }
            (form, _) => form,
        }
    }

    /// The value of an expression of numbers.
    fn constant(&self, root: NodeId) -> Option<f64> {
        let value = |slot: SlotId| self.case.values[slot.0 as usize];
        if slots(self.case.arena, &[root]).into_iter().any(|slot| value(slot).is_none())
            || hyd_symbolic::contains_time(self.case.arena, root)
        {
            return None;
        }
        Some(hyd_symbolic::eval(self.case.arena, root, |slot| value(slot).unwrap_or(0.0), 0.0, false))
    }
}

/// The unit of a sine.
fn number_one() -> Form {
    Form::Quantity(Product::rule(&Unit::ONE))
}

/// A quantity plus a literal: 273.15 and its like may move the zero point of a temperature, so that nobody can say.
fn shifted(mut product: Product, value: Option<f64>, sign: f64) -> Product {
    let moves = value.is_some_and(|v| [273.15, 459.67, 491.67].iter().any(|known| (v.abs() - known).abs() < 1e-6));
    product.offset = if moves { None } else { product.offset.map(|o| sign * o) };
    product
}
