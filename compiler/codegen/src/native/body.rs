//! Bodies of functions to instructions: registers become variables, steps become blocks.
//!
//! A body is `fn(context, arguments, outputs, account)`.  Registers of arrays with computed subscripts live in a stack
//! slot (those of arguments where the caller put them), all others in machine registers.  The account holds the turns and
//! the bytes of stack that are left; a call that runs out of either gives NaN for all outputs, exactly as the interpreter
//! (`hyd_symbolic::Machine`) does.

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::{Block, InstBuilder, MemFlagsData, StackSlot, Value, types};
use cranelift_frontend::{FunctionBuilder, Variable};
use hyd_symbolic::{Arena, Body, BodyId, Node, NodeId, Step, post_order};

use super::expression::{Calls, Values, space};
use super::width::Width;

/// Where a register lives.
#[derive(Clone, Copy)]
enum Home {
    Variable(Variable),
    /// Position in the arguments.
    Argument(u32),
    /// Position in the stack slot.
    Stack(u32),
}

struct Emitter<'a> {
    arena: &'a Arena,
    body: &'a Body,
    calls: Calls,
    homes: Vec<Home>,
    arguments: Value,
    account: Value,
    memory: StackSlot,
    /// Blocks after the loops around, innermost last.
    exits: Vec<Block>,
    /// Stores the outputs and leaves.
    done: Block,
    /// Leaves with NaN.
    failed: Block,
}

/// Emits the whole function, `entry` being its first block.
pub(super) fn emit(fb: &mut FunctionBuilder<'_>, arena: &Arena, id: BodyId, calls: Calls, entry: Block) {
    let body = arena.body(id);
    let (arguments, outputs, account) = {
        let parameters = fb.block_params(entry);
        (parameters[1], parameters[2], parameters[3])
    };
    let (homes, stacked) = homes(fb, body);
    let memory = space(fb, stacked as usize);
    let (done, failed, full) = (fb.create_block(), fb.create_block(), fb.create_block());
    let mut emitter =
        Emitter { arena, body, calls, homes, arguments, account, memory, exits: Vec::new(), done, failed };
    emitter.enter(fb, full);
    emitter.clear(fb, stacked);
    emitter.steps(fb, &body.steps);
    fb.ins().jump(done, &[]);

    fb.switch_to_block(done);
    for (k, output) in body.outputs.iter().enumerate() {
        let value = emitter.read(fb, output.register);
        fb.ins().store(MemFlagsData::trusted(), value, outputs, k as i32 * 8);
    }
    emitter.give_back(fb);
    fb.ins().return_(&[]);

    fb.switch_to_block(failed);
    emitter.give_back(fb);
    fb.ins().jump(full, &[]);
    fb.switch_to_block(full);
    let nan = fb.ins().f64const(f64::NAN);
    for k in 0..body.outputs.len() {
        fb.ins().store(MemFlagsData::trusted(), nan, outputs, k as i32 * 8);
    }
    fb.ins().return_(&[]);
    fb.seal_all_blocks();
}

/// Homes of all registers and the number of those on the stack.
fn homes(fb: &mut FunctionBuilder<'_>, body: &Body) -> (Vec<Home>, u32) {
    let mut stacked = 0;
    let mut homes = Vec::with_capacity(body.registers as usize);
    for (r, memory) in body.in_memory().into_iter().enumerate() {
        homes.push(match memory {
            true if (r as u32) < body.inputs => Home::Argument(r as u32),
            true => {
                stacked += 1;
                Home::Stack(stacked - 1)
            }
            false => Home::Variable(fb.declare_var(types::F64)),
        });
    }
    (homes, stacked)
}

impl Emitter<'_> {
    /// Takes a turn and the stack of this call from the account; leaves at once where there is none.
    fn enter(&self, fb: &mut FunctionBuilder<'_>, full: Block) {
        let flags = MemFlagsData::trusted();
        let (turns, stack) =
            (fb.ins().load(types::I64, flags, self.account, 0), fb.ins().load(types::I64, flags, self.account, 8));
        let none = fb.ins().icmp_imm_s(IntCC::Equal, turns, 0);
        let short = fb.ins().icmp_imm_s(IntCC::SignedLessThan, stack, self.body.frame() as i64);
        let refused = fb.ins().bor(none, short);
        let go = fb.create_block();
        fb.ins().brif(refused, full, &[], go, &[]);
        fb.switch_to_block(go);
        let turns = fb.ins().iadd_imm_s(turns, -1);
        let stack = fb.ins().iadd_imm_s(stack, -(self.body.frame() as i64));
        fb.ins().store(flags, turns, self.account, 0);
        fb.ins().store(flags, stack, self.account, 8);
    }

    fn give_back(&self, fb: &mut FunctionBuilder<'_>) {
        let flags = MemFlagsData::trusted();
        let stack = fb.ins().load(types::I64, flags, self.account, 8);
        let stack = fb.ins().iadd_imm_s(stack, self.body.frame() as i64);
        fb.ins().store(flags, stack, self.account, 8);
    }

    /// First values of the registers: arguments and 0.
    fn clear(&self, fb: &mut FunctionBuilder<'_>, stacked: u32) {
        let zero = fb.ins().f64const(0.0);
        for (r, &home) in self.homes.iter().enumerate() {
            if let Home::Variable(variable) = home {
                let value = if (r as u32) < self.body.inputs {
                    fb.ins().load(types::F64, MemFlagsData::trusted(), self.arguments, r as i32 * 8)
                } else {
                    zero
                };
                fb.def_var(variable, value);
            }
        }
        if stacked == 0 {
            return;
        }
        // The stack is cleared by a loop: arrays may be long.
        let (head, after) = (fb.create_block(), fb.create_block());
        let counter = fb.append_block_param(head, types::I64);
        let start = fb.ins().iconst(types::I64, 0);
        fb.ins().jump(head, &[start.into()]);
        fb.switch_to_block(head);
        let base = fb.ins().stack_addr(types::I64, self.memory, 0);
        let bytes = fb.ins().ishl_imm_u(counter, 3);
        let place = fb.ins().iadd(base, bytes);
        let zero = fb.ins().f64const(0.0);
        fb.ins().store(MemFlagsData::trusted(), zero, place, 0);
        let next = fb.ins().iadd_imm_s(counter, 1);
        let more = fb.ins().icmp_imm_u(IntCC::UnsignedLessThan, next, i64::from(stacked));
        fb.ins().brif(more, head, &[next.into()], after, &[]);
        fb.switch_to_block(after);
    }

    fn read(&self, fb: &mut FunctionBuilder<'_>, r: u32) -> Value {
        match self.homes[r as usize] {
            Home::Variable(variable) => fb.use_var(variable),
            Home::Argument(k) => fb.ins().load(types::F64, MemFlagsData::trusted(), self.arguments, k as i32 * 8),
            Home::Stack(k) => fb.ins().stack_load(types::I64, types::F64, self.memory, k as i32 * 8),
        }
    }

    fn write(&self, fb: &mut FunctionBuilder<'_>, r: u32, value: Value) {
        match self.homes[r as usize] {
            Home::Variable(variable) => fb.def_var(variable, value),
            Home::Argument(k) => {
                fb.ins().store(MemFlagsData::trusted(), value, self.arguments, k as i32 * 8);
            }
            Home::Stack(k) => {
                fb.ins().stack_store(types::I64, value, self.memory, k as i32 * 8);
            }
        }
    }

    /// The values of expressions at this place.
    fn values(&self, fb: &mut FunctionBuilder<'_>, roots: &[NodeId]) -> Vec<Value> {
        let order = post_order(self.arena, roots);
        let mut values = Values::new(self.arena, self.calls, Width::One);
        for &id in &order {
            if let Node::Slot(slot) = self.arena.node(id) {
                let value = self.read(fb, slot.0);
                values.define(id, value);
            }
        }
        for &id in &order {
            values.compute(fb, id);
        }
        roots.iter().map(|&root| values.real(fb, root)).collect()
    }

    fn value(&self, fb: &mut FunctionBuilder<'_>, root: NodeId) -> Value {
        self.values(fb, &[root])[0]
    }

    fn holds(&self, fb: &mut FunctionBuilder<'_>, root: NodeId) -> Value {
        let value = self.value(fb, root);
        let zero = fb.ins().f64const(0.0);
        fb.ins().fcmp(FloatCC::NotEqual, value, zero)
    }

    fn steps(&mut self, fb: &mut FunctionBuilder<'_>, steps: &[Step]) {
        for step in steps {
            self.step(fb, step);
        }
    }

    fn step(&mut self, fb: &mut FunctionBuilder<'_>, step: &Step) {
        match step {
            Step::Set(to, node) => {
                let value = self.value(fb, *node);
                self.write(fb, *to, value);
            }
            Step::Load { to, first, count, index } => {
                let index = self.value(fb, *index);
                let place = self.element(fb, *first, *count, index);
                let value = fb.ins().load(types::F64, MemFlagsData::trusted(), place, 0);
                self.write(fb, *to, value);
            }
            Step::Store { first, count, index, value } => {
                let values = self.values(fb, &[*index, *value]);
                let place = self.element(fb, *first, *count, values[0]);
                fb.ins().store(MemFlagsData::trusted(), values[1], place, 0);
            }
            Step::Call { body, arguments, results } => {
                let arguments = self.values(fb, arguments);
                let outputs = self.arena.body(*body).outputs.len();
                let slot = self.calls.call_body(fb, *body, &arguments, outputs, Some(self.account));
                for (k, &to) in results.iter().enumerate() {
                    let value = fb.ins().stack_load(types::I64, types::F64, slot, k as i32 * 8);
                    self.write(fb, to, value);
                }
            }
            Step::If(condition, yes, no) => self.branch(fb, *condition, yes, no),
            Step::Loop(steps) => self.repeat(fb, steps),
            Step::Break => {
                let exit = *self.exits.last().expect("invariant: a break stands in a loop");
                self.leave(fb, exit);
            }
            Step::Return => self.leave(fb, self.done),
            Step::Check(condition, _) => {
                let holds = self.holds(fb, *condition);
                let go = fb.create_block();
                fb.ins().brif(holds, go, &[], self.failed, &[]);
                fb.switch_to_block(go);
            }
        }
    }

    /// Jumps away; what follows is never reached.
    fn leave(&self, fb: &mut FunctionBuilder<'_>, to: Block) {
        fb.ins().jump(to, &[]);
        let dead = fb.create_block();
        fb.switch_to_block(dead);
    }

    /// The address of an element, after the check of its index (from 0).
    fn element(&self, fb: &mut FunctionBuilder<'_>, first: u32, count: u32, index: Value) -> Value {
        let (zero, end) = (fb.ins().f64const(0.0), fb.ins().f64const(f64::from(count)));
        let low = fb.ins().fcmp(FloatCC::GreaterThanOrEqual, index, zero);
        let high = fb.ins().fcmp(FloatCC::LessThan, index, end);
        let inside = fb.ins().band(low, high);
        let go = fb.create_block();
        fb.ins().brif(inside, go, &[], self.failed, &[]);
        fb.switch_to_block(go);
        let whole = fb.ins().fcvt_to_sint_sat(types::I64, index);
        let bytes = fb.ins().ishl_imm_u(whole, 3);
        let base = match self.homes[first as usize] {
            Home::Argument(k) => fb.ins().iadd_imm_s(self.arguments, i64::from(k) * 8),
            Home::Stack(k) => fb.ins().stack_addr(types::I64, self.memory, k as i32 * 8),
            Home::Variable(_) => unreachable!("invariant: arrays with computed subscripts are in memory"),
        };
        fb.ins().iadd(base, bytes)
    }

    fn branch(&mut self, fb: &mut FunctionBuilder<'_>, condition: NodeId, yes: &[Step], no: &[Step]) {
        let holds = self.holds(fb, condition);
        let (then, other, after) = (fb.create_block(), fb.create_block(), fb.create_block());
        fb.ins().brif(holds, then, &[], other, &[]);
        for (block, steps) in [(then, yes), (other, no)] {
            fb.switch_to_block(block);
            self.steps(fb, steps);
            fb.ins().jump(after, &[]);
        }
        fb.switch_to_block(after);
    }

    fn repeat(&mut self, fb: &mut FunctionBuilder<'_>, steps: &[Step]) {
        let (head, exit) = (fb.create_block(), fb.create_block());
        fb.ins().jump(head, &[]);
        fb.switch_to_block(head);
        let turns = fb.ins().load(types::I64, MemFlagsData::trusted(), self.account, 0);
        let none = fb.ins().icmp_imm_s(IntCC::Equal, turns, 0);
        let go = fb.create_block();
        fb.ins().brif(none, self.failed, &[], go, &[]);
        fb.switch_to_block(go);
        let turns = fb.ins().iadd_imm_s(turns, -1);
        fb.ins().store(MemFlagsData::trusted(), turns, self.account, 0);
        self.exits.push(exit);
        self.steps(fb, steps);
        self.exits.pop();
        fb.ins().jump(head, &[]);
        fb.switch_to_block(exit);
    }
}
