//! One expression node to instructions, its operands being there already.
//!
//! Booleans live as truths ([`Width`]) while only logic consumes them and become 0.0 or 1.0 where a number is asked for;
//! both forms of a value are kept, so each conversion happens once.  `if` becomes a selection without a branch: both
//! sides are computed, as the language's pure expressions allow.

use cranelift_codegen::ir::condcodes::FloatCC;
use cranelift_codegen::ir::{InstBuilder, MemFlagsData, SigRef, StackSlot, StackSlotData, StackSlotKind, Value, types};
use cranelift_frontend::FunctionBuilder;
use hyd_symbolic::{Arena, BodyId, Function, MACHINE_LIMITS, Node, NodeId, Relation};
use rustc_hash::FxHashMap;

use hyd_payload::{POWERS, SINES_AND_COSINES, function_position};

use super::groups::Groups;
use super::width::Width;

/// A computed node in the forms asked for so far.
#[derive(Clone, Copy, Default)]
struct Computed {
    real: Option<Value>,
    truth: Option<Value>,
}

/// What all expressions of a function share.
#[derive(Clone, Copy)]
pub(super) struct Calls {
    /// Start of the function table.
    pub table: Value,
    /// Signature of functions of one argument.
    pub unary: SigRef,
    /// Signature of functions of two arguments.
    pub binary: SigRef,
    /// Signature of the functions for groups.
    pub grouped: SigRef,
    /// See [`super::isa::Target::rounds_inline`].
    pub rounds_inline: bool,
    /// Size of an address in bytes.
    pub pointer_bytes: i32,
    /// Start of the table of bodies.
    pub bodies: Value,
    /// Signature of bodies.
    pub body: SigRef,
    /// What generated code received.
    pub context: Value,
    /// The account of the call that is running, none outside of bodies.
    pub account: Option<Value>,
}

impl Calls {
    /// Calls a body; its outputs stand in the slot returned.  A call in a kernel gets a fresh account.
    pub(super) fn call_body(
        &self,
        fb: &mut FunctionBuilder<'_>,
        body: BodyId,
        arguments: &[Value],
        outputs: usize,
        account: Option<Value>,
    ) -> StackSlot {
        let given = space(fb, arguments.len());
        for (k, &argument) in arguments.iter().enumerate() {
            fb.ins().stack_store(types::I64, argument, given, k as i32 * 8);
        }
        let results = space(fb, outputs);
        let account = account.unwrap_or_else(|| {
            let slot = space(fb, 2);
            let (turns, stack) = (MACHINE_LIMITS.turns as i64, MACHINE_LIMITS.stack as i64);
            let (turns, stack) = (fb.ins().iconst(types::I64, turns), fb.ins().iconst(types::I64, stack));
            fb.ins().stack_store(types::I64, turns, slot, 0);
            fb.ins().stack_store(types::I64, stack, slot, 8);
            fb.ins().stack_addr(types::I64, slot, 0)
        });
        let flags = MemFlagsData::trusted().with_readonly().with_can_move();
        let callee = fb.ins().load(types::I64, flags, self.bodies, body.0 as i32 * self.pointer_bytes);
        let given = fb.ins().stack_addr(types::I64, given, 0);
        let place = fb.ins().stack_addr(types::I64, results, 0);
        fb.ins().call_indirect(self.body, callee, &[self.context, given, place, account]);
        results
    }
}

/// Room for numbers on the stack.
pub(super) fn space(fb: &mut FunctionBuilder<'_>, count: usize) -> StackSlot {
    let size = (count.max(1) * 8) as u32;
    fb.create_sized_stack_slot(StackSlotData::new(StackSlotKind::ExplicitSlot, size, 3))
}

/// The values of a kernel's instances, of as many as the width says.
pub(super) struct Values<'a> {
    arena: &'a Arena,
    calls: Calls,
    width: Width,
    known: FxHashMap<NodeId, Computed>,
    /// Results of calls of bodies, by body and arguments.
    results: FxHashMap<(BodyId, NodeId), StackSlot>,
    groups: Groups,
}

impl<'a> Values<'a> {
    /// No values yet.
    pub(super) fn new(arena: &'a Arena, calls: Calls, width: Width) -> Self {
        let (known, results) = Default::default();
        Self { arena, calls, width, known, results, groups: Groups::default() }
    }

    /// Computes all nodes of an order, operands first, sines, cosines and powers together where there are several; leaves must
    /// have been defined.
    pub(super) fn compute_all(&mut self, fb: &mut FunctionBuilder<'_>, order: &[NodeId]) {
        let mut order = order.to_vec();
        self.groups = Groups::find(self.arena, &mut order);
        for id in order {
            self.compute(fb, id);
        }
    }

    /// Gives a leaf its value.
    pub(super) fn define(&mut self, id: NodeId, real: Value) {
        self.known.insert(id, Computed { real: Some(real), truth: None });
    }

    /// Computes a node whose operands are known; leaves must have been defined.
    pub(super) fn compute(&mut self, fb: &mut FunctionBuilder<'_>, id: NodeId) {
        if self.known.contains_key(&id) {
            return;
        }
        let computed = match self.arena.node(id) {
            Node::Const(number) => real(self.width.number(fb, number.value())),
            Node::Not(_) | Node::And(..) | Node::Or(..) | Node::Compare(..) | Node::Event(..) => self.logic(fb, id),
            Node::If(c, a, b) => self.choice(fb, c, a, b),
            Node::Call1(function, a) => real(self.call1(fb, function, a)),
            Node::Call2(function, a, b) => {
                let place = if function == Function::Pow { self.groups.place_of_power(a, b) } else { None };
                real(match place {
                    Some(place) => self.grouped_power(fb, place),
                    None => {
                        let (a, b) = (self.real(fb, a), self.real(fb, b));
                        self.call2(fb, function, a, b)
                    }
                })
            }
            Node::Pair(..) => return,
            Node::Apply(body, output, list) => self.apply(fb, body, output, list),
            _ => self.arithmetic(fb, id),
        };
        self.known.insert(id, computed);
    }

    /// The number a node stands for.
    pub(super) fn real(&mut self, fb: &mut FunctionBuilder<'_>, id: NodeId) -> Value {
        let width = self.width;
        let known = self.known.entry(id).or_default();
        if let Some(value) = known.real {
            return value;
        }
        let truth = known.truth.expect("invariant: operands are computed before their users");
        let (one, zero) = (width.number(fb, 1.0), width.number(fb, 0.0));
        let value = width.select(fb, truth, one, zero);
        known.real = Some(value);
        value
    }

    /// Its truth: different from zero.
    fn truth(&mut self, fb: &mut FunctionBuilder<'_>, id: NodeId) -> Value {
        let width = self.width;
        let known = self.known.entry(id).or_default();
        if let Some(truth) = known.truth {
            return truth;
        }
        let value = known.real.expect("invariant: operands are computed before their users");
        let zero = width.number(fb, 0.0);
        let truth = fb.ins().fcmp(FloatCC::NotEqual, value, zero);
        known.truth = Some(truth);
        truth
    }

    fn arithmetic(&mut self, fb: &mut FunctionBuilder<'_>, id: NodeId) -> Computed {
        let node = self.arena.node(id);
        let operands: Vec<Value> = node.operands().map(|operand| self.real(fb, operand)).collect();
        real(match (node, operands.as_slice()) {
            (Node::Add(..), &[a, b]) => fb.ins().fadd(a, b),
            (Node::Sub(..), &[a, b]) => fb.ins().fsub(a, b),
            (Node::Mul(..), &[a, b]) => fb.ins().fmul(a, b),
            (Node::Div(..), &[a, b]) => fb.ins().fdiv(a, b),
            (_, &[a]) => fb.ins().fneg(a),
            _ => unreachable!("invariant: leaves are defined, logic and calls are handled by the caller"),
        })
    }

    fn logic(&mut self, fb: &mut FunctionBuilder<'_>, id: NodeId) -> Computed {
        let value = match self.arena.node(id) {
            Node::Compare(relation, a, b) | Node::Event(relation, a, b) => {
                let (a, b) = (self.real(fb, a), self.real(fb, b));
                fb.ins().fcmp(condition(relation), a, b)
            }
            Node::And(a, b) => {
                let (a, b) = (self.truth(fb, a), self.truth(fb, b));
                fb.ins().band(a, b)
            }
            Node::Or(a, b) => {
                let (a, b) = (self.truth(fb, a), self.truth(fb, b));
                fb.ins().bor(a, b)
            }
            node => {
                let operand = node.operands().next().expect("invariant: `not` has an operand");
                let operand = self.truth(fb, operand);
                self.width.not(fb, operand)
            }
        };
        Computed { real: None, truth: Some(value) }
    }

    /// `if c then a else b`; stays a truth when both sides are truths.
    fn choice(&mut self, fb: &mut FunctionBuilder<'_>, c: NodeId, a: NodeId, b: NodeId) -> Computed {
        let c = self.truth(fb, c);
        let logical = |id| self.known.get(&id).is_some_and(|known: &Computed| known.real.is_none());
        if logical(a) && logical(b) {
            let (a, b) = (self.truth(fb, a), self.truth(fb, b));
            return Computed { real: None, truth: Some(self.width.select_truth(fb, c, a, b)) };
        }
        let (a, b) = (self.real(fb, a), self.real(fb, b));
        real(self.width.select(fb, c, a, b))
    }

    /// An output of a body; outputs of one call share it.
    fn apply(&mut self, fb: &mut FunctionBuilder<'_>, body: BodyId, output: u32, list: NodeId) -> Computed {
        let slot = match self.results.get(&(body, list)) {
            Some(&slot) => slot,
            None => {
                let arguments: Vec<Value> =
                    self.arena.arguments(list).into_iter().map(|argument| self.real(fb, argument)).collect();
                let count = self.arena.body(body).outputs.len();
                let slot = self.calls.call_body(fb, body, &arguments, count, None);
                self.results.insert((body, list), slot);
                slot
            }
        };
        real(fb.ins().stack_load(types::I64, types::F64, slot, output as i32 * 8))
    }

    fn call1(&mut self, fb: &mut FunctionBuilder<'_>, function: Function, argument: NodeId) -> Value {
        if matches!(function, Function::Sin | Function::Cos)
            && let Some(place) = self.groups.place(argument)
        {
            return self.grouped(fb, function, place);
        }
        let a = self.real(fb, argument);
        match function {
            Function::Sqrt => fb.ins().sqrt(a),
            Function::Abs => fb.ins().fabs(a),
            Function::Sign => {
                let width = self.width;
                let [zero, one, minus] = [0.0, 1.0, -1.0].map(|number| width.number(fb, number));
                let (above, below) =
                    (fb.ins().fcmp(FloatCC::GreaterThan, a, zero), fb.ins().fcmp(FloatCC::LessThan, a, zero));
                let rest = width.select(fb, below, minus, zero);
                width.select(fb, above, one, rest)
            }
            Function::Floor if self.calls.rounds_inline => fb.ins().floor(a),
            Function::Ceil if self.calls.rounds_inline => fb.ins().ceil(a),
            _ => self.call(fb, function, &[a]),
        }
    }

    fn call2(&self, fb: &mut FunctionBuilder<'_>, function: Function, a: Value, b: Value) -> Value {
        let inline = self.calls.rounds_inline;
        match function {
            Function::Min => fb.ins().fmin(a, b),
            Function::Max => fb.ins().fmax(a, b),
            Function::Div if inline => {
                let quotient = fb.ins().fdiv(a, b);
                fb.ins().trunc(quotient)
            }
            Function::Mod | Function::Rem if inline => {
                let quotient = fb.ins().fdiv(a, b);
                let whole = if function == Function::Mod { fb.ins().floor(quotient) } else { fb.ins().trunc(quotient) };
                let part = fb.ins().fmul(whole, b);
                fb.ins().fsub(a, part)
            }
            _ => self.call(fb, function, &[a, b]),
        }
    }

    /// The sine or cosine of an angle that is computed with others.
    fn grouped(&mut self, fb: &mut FunctionBuilder<'_>, function: Function, place: (u32, u32)) -> Value {
        if let Some(angles) = self.groups.pending(place.0) {
            let angles: Vec<Value> = angles.into_iter().map(|angle| self.real(fb, angle)).collect();
            let callee = self.callee(fb, SINES_AND_COSINES);
            self.groups.call(fb, place.0, &angles, (callee, self.calls.grouped));
        }
        self.groups.read(fb, function, place)
    }

    /// A power that is computed with others.
    fn grouped_power(&mut self, fb: &mut FunctionBuilder<'_>, place: (u32, u32)) -> Value {
        if let Some(powers) = self.groups.pending_powers(place.0) {
            let [mut bases, mut exponents] = [Vec::new(), Vec::new()];
            for (base, exponent) in powers {
                bases.push(self.real(fb, base));
                exponents.push(self.real(fb, exponent));
            }
            let callee = self.callee(fb, POWERS);
            self.groups.call_powers(fb, place.0, (&bases, &exponents), (callee, self.calls.grouped));
        }
        self.groups.read_power(fb, place)
    }

    fn call(&self, fb: &mut FunctionBuilder<'_>, function: Function, arguments: &[Value]) -> Value {
        let address = self.callee(fb, function_position(function));
        let signature = if arguments.len() == 1 { self.calls.unary } else { self.calls.binary };
        let call = fb.ins().call_indirect(signature, address, arguments);
        fb.inst_results(call)[0]
    }

    /// The address at a position of the function table.
    fn callee(&self, fb: &mut FunctionBuilder<'_>, position: usize) -> Value {
        let flags = MemFlagsData::trusted().with_readonly().with_can_move();
        fb.ins().load(types::I64, flags, self.calls.table, position as i32 * self.calls.pointer_bytes)
    }
}

/// True if the node is computed without a call, as it is for two instances at once.
pub(super) fn is_inline(node: Node, rounds_inline: bool) -> bool {
    match node {
        Node::Call1(Function::Sqrt | Function::Abs | Function::Sign, _) => true,
        Node::Call2(Function::Min | Function::Max, ..) => true,
        Node::Call1(Function::Floor | Function::Ceil, _)
        | Node::Call2(Function::Div | Function::Mod | Function::Rem, ..) => rounds_inline,
        Node::Call1(..) | Node::Call2(..) | Node::Pair(..) | Node::Apply(..) => false,
        _ => true,
    }
}

fn real(value: Value) -> Computed {
    Computed { real: Some(value), truth: None }
}

fn condition(relation: Relation) -> FloatCC {
    match relation {
        Relation::Less => FloatCC::LessThan,
        Relation::LessEqual => FloatCC::LessThanOrEqual,
        Relation::Greater => FloatCC::GreaterThan,
        Relation::GreaterEqual => FloatCC::GreaterThanOrEqual,
        Relation::Equal => FloatCC::Equal,
        Relation::NotEqual => FloatCC::NotEqual,
    }
}
