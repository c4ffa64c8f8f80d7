//! Integers stay exact or end in an error.
//!
//! In the run an Integer is a double, which holds integers up to 2^53 exactly.  A product or sum of Integers that may be larger
//! is checked where it is computed, and the error names its text.  What cannot grow beyond all bounds in a run is left alone:
//! numbers of loops, products of literals with parameters, a counter that a literal is added to.

use hyd_instance::ScalarType;
use hyd_source::{Code, Span};
use hyd_symbolic::{Body, BodyOutput, Function, Node, NodeId, Relation, SlotId, Step};
use hyd_syntax::tree::BinaryOp;
use hyd_system::Variability;

use crate::state::context::{Context, Fail};
use crate::state::flattener::Flattener;
use crate::state::index::SlotKey;
use crate::state::node::Typed;

/// The largest integer below which all are doubles.
const LARGEST: f64 = hyd_instance::value::LARGEST_INTEGER as f64;

/// What numbers of loops and Integer parameters are taken to stay below (Modelica 3.6, section 4.9.2: Integers of 32 bits).
const OF_32_BITS: f64 = 2_147_483_648.0;

/// Deepest look into an expression for its bounds; what is deeper counts as unbounded.
const MAX_LOOK: u32 = 8;

impl Flattener<'_, '_> {
    /// `x op y` of scalars, checked where it is an Integer that may be too large.
    pub(crate) fn combine_exactly(
        &mut self,
        span: Span,
        op: BinaryOp,
        x: Typed,
        y: Typed,
        cx: &Context,
    ) -> Result<Typed, Fail> {
        let operands = [x.node, y.node];
        let value = self.combine(span, op, x, y)?;
        if !matches!(value.scalar, ScalarType::Integer) {
            return Ok(value);
        }
        if let Some(number) = self.model.templates.arena.as_constant(value.node) {
            if number.abs() <= LARGEST {
                return Ok(value);
            }
            return Err(self.error(Code::Value, span, self.too_large(span)));
        }
        let [a, b] = operands.map(|node| self.largest(node, MAX_LOOK));
        let product = matches!(op, BinaryOp::Mul | BinaryOp::ElementMul);
        let bounded = match product {
            true => a * b <= LARGEST || a.min(b) <= 1.0,
            // Adding numbers of 32 bits takes a run millions of events to get out of the range.
            false => a + b <= 2.0 * LARGEST && a.min(b) <= OF_32_BITS,
        };
        if bounded { Ok(value) } else { self.checked(span, value, cx) }
    }

    fn too_large(&self, span: Span) -> String {
        let text = self.scopes.table.files.snippet(span).split_whitespace().collect::<Vec<_>>().join(" ");
        format!("the Integer `{text}` is beyond 2^53, from where on Integers are not exact")
    }

    /// How large the number may be.
    fn largest(&self, node: NodeId, look: u32) -> f64 {
        let Some(look) = look.checked_sub(1) else { return f64::INFINITY };
        let arena = &self.model.templates.arena;
        match arena.node(node) {
            Node::Const(number) => number.value().abs(),
            Node::Slot(_) if !self.builders.is_empty() => LARGEST,
            Node::Slot(slot) => match &self.slots.keys[slot.0 as usize] {
                SlotKey::Number(_) => OF_32_BITS,
                SlotKey::Variable(_, v, _) => {
                    let fixed = self.variable_of(*v).variability <= Variability::Parameter;
                    if fixed { OF_32_BITS } else { LARGEST }
                }
                SlotKey::Quantity(_) => f64::INFINITY,
            },
            Node::Neg(a) => self.largest(a, look),
            Node::Add(a, b) | Node::Sub(a, b) => self.largest(a, look) + self.largest(b, look),
            Node::Mul(a, b) => self.largest(a, look) * self.largest(b, look),
            Node::If(_, a, b) => self.largest(a, look).max(self.largest(b, look)),
            Node::Call2(Function::Min | Function::Max, a, b) => self.largest(a, look).max(self.largest(b, look)),
            Node::Call2(Function::Mod | Function::Rem, _, b) => self.largest(b, look),
            Node::Call1(Function::Sign, _) => 1.0,
            _ => LARGEST,
        }
    }

    /// The same value, or the end of the run with a message.
    fn checked(&mut self, span: Span, value: Typed, cx: &Context) -> Result<Typed, Fail> {
        if self.in_body(cx) {
            let node = self.held(value.node);
            let test = self.is_exact(node);
            let text = self.too_large(span).into();
            self.step(Step::Check(test, text));
            return Ok(Typed { node, scalar: value.scalar });
        }
        let id = match self.range_checks.get(&span) {
            Some(&known) => known,
            None => {
                let name: hyd_syntax::tree::Name = "range of Integers".into();
                let node = self.model.templates.arena.slot(SlotId(0));
                let test = self.is_exact(node);
                let steps = vec![Step::Check(test, self.too_large(span).into()), Step::Set(1, node)];
                let id = self.model.templates.arena.reserve_body(name.clone(), vec![false]);
                let outputs = vec![BodyOutput { name: name.clone(), register: 1, zero: false }];
                let body = Body {
                    name,
                    inputs: 1,
                    real_inputs: vec![false],
                    registers: 2,
                    steps,
                    outputs,
                    derivatives: Vec::new(),
                };
                self.model.templates.arena.set_body(id, body);
                self.range_checks.insert(span, id);
                id
            }
        };
        let arena = &mut self.model.templates.arena;
        let list = arena.argument_list(&[value.node]);
        Ok(Typed { node: arena.apply(id, 0, list), scalar: value.scalar })
    }

    fn is_exact(&mut self, node: NodeId) -> NodeId {
        let arena = &mut self.model.templates.arena;
        let (size, most) = (arena.call1(Function::Abs, node), arena.constant(LARGEST));
        arena.compare(Relation::LessEqual, size, most)
    }
}
