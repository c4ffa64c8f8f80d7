//! Two instances of a kernel at once: one pass over its nodes with vectors of two numbers.
//!
//! Every operation rounds each lane as the scalar one does, so results are the same to the bit.  A kernel whose nodes all have
//! a form for vectors and whose instances cannot see each other's results is run in pairs; the last instance of an odd number is run
//! by itself.  Neighbours in memory are loaded and stored together, others lane by lane.

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::{BlockArg, InstBuilder, MemFlagsData, Value, types};
use cranelift_frontend::FunctionBuilder;
use hyd_symbolic::{Arena, Function, Node, NodeId};
use rustc_hash::FxHashMap;

use super::expression::condition;
use super::kernel::{Frame, Instance, area_of};
use crate::program::{Address, Kernel};

/// Fewer instances are not worth a second form of the code.
const FEWEST: u32 = 4;

/// True if instances can be run in pairs.
pub fn fits(arena: &Arena, kernel: &Kernel, order: &[NodeId], rounds_inline: bool) -> bool {
    kernel.count >= FEWEST
        && order.iter().all(|&id| has_form(arena.node(id), rounds_inline))
        && is_apart(arena, kernel, order)
}

/// True if there is a form of the node for vectors.
fn has_form(node: Node, rounds_inline: bool) -> bool {
    match node {
        Node::Call1(Function::Sqrt | Function::Abs | Function::Sign, _) => true,
        Node::Call1(Function::Floor | Function::Ceil, _) => rounds_inline,
        Node::Call2(Function::Min | Function::Max, ..) => true,
        Node::Call1(..) | Node::Call2(..) | Node::Pair(..) | Node::Apply(..) => false,
        _ => true,
    }
}

/// True if no instance reads what another one writes.
fn is_apart(arena: &Arena, kernel: &Kernel, order: &[NodeId]) -> bool {
    let slot = |&id: &NodeId| match arena.node(id) {
        Node::Slot(slot) => Some(kernel.slots[slot.0 as usize]),
        _ => None,
    };
    order.iter().filter_map(slot).all(|read| {
        kernel.stores.iter().all(|store| {
            area_of(&read) != area_of(&store.to)
                || match (range(&read, kernel.count), range(&store.to, kernel.count)) {
                    (Some((first, last)), Some((begin, end))) => last < begin || end < first,
                    _ => false,
                }
        })
    })
}

/// First and last position that the instances touch; none for tables.
fn range(address: &Address, count: u32) -> Option<(i64, i64)> {
    match *address {
        Address::Fixed { index, .. } => Some((i64::from(index), i64::from(index))),
        Address::Affine { base, stride, .. } => {
            let (base, end) = (i64::from(base), i64::from(base) + i64::from(stride) * i64::from(count - 1));
            Some((base.min(end), base.max(end)))
        }
        Address::Table { .. } => None,
    }
}

/// A computed node in the forms asked for so far: numbers, and masks of ones and zeros.
#[derive(Clone, Copy, Default)]
struct Computed {
    real: Option<Value>,
    truth: Option<Value>,
}

fn real(value: Value) -> Computed {
    Computed { real: Some(value), truth: None }
}

fn truth(mask: Value) -> Computed {
    Computed { real: None, truth: Some(mask) }
}

/// The values of two instances.
struct Lanes<'a> {
    arena: &'a Arena,
    known: FxHashMap<NodeId, Computed>,
}

/// Emits the pairs of a kernel; `fixed` are scalars that are the same for all instances.  Returns the number of instances that were run.
pub fn pairs(
    frame: &Frame<'_>,
    fb: &mut FunctionBuilder<'_>,
    kernel: &Kernel,
    order: &[NodeId],
    fixed: &FxHashMap<NodeId, Value>,
) -> u32 {
    let count = kernel.count & !1;
    let spread: Vec<(NodeId, Value)> =
        fixed.iter().map(|(&id, &value)| (id, fb.ins().splat(types::F64X2, value))).collect();
    let (body, after) = (fb.create_block(), fb.create_block());
    let counter = fb.append_block_param(body, types::I64);
    let zero = fb.ins().iconst(types::I64, 0);
    fb.ins().jump(body, &[BlockArg::from(zero)]);
    fb.switch_to_block(body);
    let mut lanes = Lanes { arena: frame.arena, known: FxHashMap::default() };
    lanes.known.extend(spread.into_iter().map(|(id, value)| (id, real(value))));
    for &id in order {
        if let Some(address) = frame.leaf(kernel, id).filter(|_| !fixed.contains_key(&id)) {
            let value = load(frame, fb, &address, counter);
            lanes.known.insert(id, real(value));
        }
    }
    for &id in order {
        lanes.compute(fb, id);
    }
    for store in &kernel.stores {
        let value = lanes.real(fb, store.value);
        write(frame, fb, &store.to, counter, value);
    }
    let next = fb.ins().iadd_imm_s(counter, 2);
    let more = fb.ins().icmp_imm_u(IntCC::UnsignedLessThan, next, i64::from(count));
    fb.ins().brif(more, body, &[BlockArg::from(next)], after, &[]);
    fb.seal_block(body);
    fb.switch_to_block(after);
    fb.seal_block(after);
    count
}

/// Loads and stores of neighbours need no alignment.
fn unaligned() -> MemFlagsData {
    MemFlagsData::new().with_notrap()
}

/// What two instances read.
fn load(frame: &Frame<'_>, fb: &mut FunctionBuilder<'_>, address: &Address, counter: Value) -> Value {
    if let Address::Affine { stride: 1, negated, .. } = *address {
        let (place, offset, _) = frame.locate(fb, address, Instance::Counter(counter));
        // As integers first: Cranelift 0.135 makes a load the operand of a comparison (`cmppd`) whether it is aligned or not.
        let bits = fb.ins().load(types::I64X2, unaligned(), place, offset);
        let value = fb.ins().bitcast(types::F64X2, MemFlagsData::new(), bits);
        return if negated { fb.ins().fneg(value) } else { value };
    }
    let second = fb.ins().iadd_imm_s(counter, 1);
    let [low, high] = [counter, second].map(|counter| frame.load(fb, address, Instance::Counter(counter)));
    let both = fb.ins().splat(types::F64X2, low);
    fb.ins().insertlane(both, high, 1)
}

fn write(frame: &Frame<'_>, fb: &mut FunctionBuilder<'_>, address: &Address, counter: Value, value: Value) {
    if let Address::Affine { stride: 1, .. } = *address {
        let (place, offset, _) = frame.locate(fb, address, Instance::Counter(counter));
        fb.ins().store(unaligned(), value, place, offset);
        return;
    }
    let second = fb.ins().iadd_imm_s(counter, 1);
    for (lane, counter) in [counter, second].into_iter().enumerate() {
        let own = fb.ins().extractlane(value, lane as u8);
        frame.store(fb, address, Instance::Counter(counter), own);
    }
}

impl Lanes<'_> {
    fn compute(&mut self, fb: &mut FunctionBuilder<'_>, id: NodeId) {
        if self.known.contains_key(&id) {
            return;
        }
        let computed = match self.arena.node(id) {
            Node::Const(number) => real(number_of(fb, number.value())),
            Node::Compare(relation, a, b) | Node::Event(relation, a, b) => {
                let (a, b) = (self.real(fb, a), self.real(fb, b));
                truth(fb.ins().fcmp(condition(relation), a, b))
            }
            Node::And(a, b) => {
                let (a, b) = (self.truth(fb, a), self.truth(fb, b));
                truth(fb.ins().band(a, b))
            }
            Node::Or(a, b) => {
                let (a, b) = (self.truth(fb, a), self.truth(fb, b));
                truth(fb.ins().bor(a, b))
            }
            Node::Not(a) => {
                let a = self.truth(fb, a);
                truth(fb.ins().bnot(a))
            }
            Node::If(c, a, b) => self.choice(fb, c, a, b),
            Node::Call1(function, a) => {
                let a = self.real(fb, a);
                real(call1(fb, function, a))
            }
            Node::Call2(function, a, b) => {
                let (a, b) = (self.real(fb, a), self.real(fb, b));
                real(if function == Function::Min { fb.ins().fmin(a, b) } else { fb.ins().fmax(a, b) })
            }
            node => self.arithmetic(fb, node),
        };
        self.known.insert(id, computed);
    }

    fn arithmetic(&mut self, fb: &mut FunctionBuilder<'_>, node: Node) -> Computed {
        let operands: Vec<Value> = node.operands().map(|operand| self.real(fb, operand)).collect();
        real(match (node, operands.as_slice()) {
            (Node::Add(..), &[a, b]) => fb.ins().fadd(a, b),
            (Node::Sub(..), &[a, b]) => fb.ins().fsub(a, b),
            (Node::Mul(..), &[a, b]) => fb.ins().fmul(a, b),
            (Node::Div(..), &[a, b]) => fb.ins().fdiv(a, b),
            (_, &[a]) => fb.ins().fneg(a),
            _ => unreachable!("invariant: leaves are defined, and other nodes have no form for vectors"),
        })
    }

    /// `if c then a else b`; stays a truth when both sides are truths.
    fn choice(&mut self, fb: &mut FunctionBuilder<'_>, c: NodeId, a: NodeId, b: NodeId) -> Computed {
        let c = self.truth(fb, c);
        let logical = |id| self.known.get(&id).is_some_and(|known: &Computed| known.real.is_none());
        if logical(a) && logical(b) {
            let (a, b) = (self.truth(fb, a), self.truth(fb, b));
            return truth(fb.ins().bitselect(c, a, b));
        }
        let (a, b) = (self.real(fb, a), self.real(fb, b));
        real(select(fb, c, a, b))
    }

    /// The numbers a node stands for.
    fn real(&mut self, fb: &mut FunctionBuilder<'_>, id: NodeId) -> Value {
        let known = self.known.entry(id).or_default();
        if let Some(value) = known.real {
            return value;
        }
        let mask = known.truth.expect("invariant: operands are computed before their users");
        let (one, zero) = (number_of(fb, 1.0), number_of(fb, 0.0));
        let value = select(fb, mask, one, zero);
        known.real = Some(value);
        value
    }

    /// Where they differ from zero.
    fn truth(&mut self, fb: &mut FunctionBuilder<'_>, id: NodeId) -> Value {
        let known = self.known.entry(id).or_default();
        if let Some(truth) = known.truth {
            return truth;
        }
        let value = known.real.expect("invariant: operands are computed before their users");
        let zero = number_of(fb, 0.0);
        let truth = fb.ins().fcmp(FloatCC::NotEqual, value, zero);
        known.truth = Some(truth);
        truth
    }
}

/// The same number in both lanes.
fn number_of(fb: &mut FunctionBuilder<'_>, number: f64) -> Value {
    let value = fb.ins().f64const(number);
    fb.ins().splat(types::F64X2, value)
}

/// Of each lane the first where the mask is set, else the second.
fn select(fb: &mut FunctionBuilder<'_>, mask: Value, a: Value, b: Value) -> Value {
    let mask = fb.ins().bitcast(types::F64X2, MemFlagsData::new(), mask);
    fb.ins().bitselect(mask, a, b)
}

fn call1(fb: &mut FunctionBuilder<'_>, function: Function, a: Value) -> Value {
    match function {
        Function::Sqrt => fb.ins().sqrt(a),
        Function::Abs => fb.ins().fabs(a),
        Function::Floor => fb.ins().floor(a),
        Function::Ceil => fb.ins().ceil(a),
        _ => {
            let (one, minus, zero) = (number_of(fb, 1.0), number_of(fb, -1.0), number_of(fb, 0.0));
            let (above, below) =
                (fb.ins().fcmp(FloatCC::GreaterThan, a, zero), fb.ins().fcmp(FloatCC::LessThan, a, zero));
            let rest = select(fb, below, minus, zero);
            select(fb, above, one, rest)
        }
    }
}
