//! A kernel to instructions: loads, one pass over its nodes, stores; as a loop when it has several instances.
//!
//! All loads of an instance come before its stores.  Loads from areas that the whole function never writes are marked
//! read-only, which lets the code generator place them where they are needed; loads at fixed places stand in front of
//! the loop.  Positions that ascend evenly are computed from one counter, others come from a table.  Where nodes and
//! places allow it the loop runs two instances at once ([`super::lanes`]).

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{BlockArg, InstBuilder, MemFlagsData, Value, types};
use cranelift_frontend::FunctionBuilder;
use hyd_symbolic::{Arena, Node, NodeId, post_order};
use rustc_hash::FxHashMap;

use super::expression::{Calls, Values};
use super::lanes;
use super::width::Width;
use crate::program::{AREAS, Address, Area, HOMOTOPY, INITIAL, Kernel, TABLE_SIGN, TIME};

/// Bytes of a value.
const BYTES: i64 = 8;

/// What all kernels of a function share.
pub(super) struct Frame<'a> {
    /// The nodes.
    pub arena: &'a Arena,
    /// Start of each area.
    pub areas: [Value; AREAS],
    /// The function writes this area.
    pub written: [bool; AREAS],
    /// Start of the slot tables.
    pub tables: Value,
    /// Function table.
    pub calls: Calls,
}

/// A loop whose counter goes from 0 in steps and stays below the count; the body must not change the current block.
pub(super) fn counted(
    fb: &mut FunctionBuilder<'_>,
    count: u32,
    step: i64,
    each: impl FnOnce(&mut FunctionBuilder<'_>, Value),
) {
    let (body, after) = (fb.create_block(), fb.create_block());
    let counter = fb.append_block_param(body, types::I64);
    let zero = fb.ins().iconst(types::I64, 0);
    fb.ins().jump(body, &[BlockArg::from(zero)]);
    fb.switch_to_block(body);
    each(fb, counter);
    let next = fb.ins().iadd_imm_s(counter, step);
    let more = fb.ins().icmp_imm_u(IntCC::UnsignedLessThan, next, i64::from(count));
    fb.ins().brif(more, body, &[BlockArg::from(next)], after, &[]);
    fb.seal_block(body);
    fb.switch_to_block(after);
    fb.seal_block(after);
}

/// Which instance the code is for.
#[derive(Clone, Copy)]
pub(super) enum Instance {
    /// The only one.
    Single,
    /// The loop counter.
    Counter(Value),
}

impl Frame<'_> {
    /// Emits a kernel at the current place; afterwards the current block is where the next kernel goes.
    pub(super) fn emit(&self, fb: &mut FunctionBuilder<'_>, kernel: &Kernel) {
        let roots: Vec<NodeId> = kernel.stores.iter().map(|store| store.value).collect();
        let order = post_order(self.arena, &roots);
        match kernel.count {
            0 => {}
            1 => self.instance(fb, kernel, &order, Instance::Single, &FxHashMap::default()),
            _ => self.repeat(fb, kernel, &order),
        }
    }

    fn repeat(&self, fb: &mut FunctionBuilder<'_>, kernel: &Kernel, order: &[NodeId]) {
        let fixed = self.load_fixed(fb, kernel, order);
        if lanes::fits(self.arena, kernel, order, self.calls.rounds_inline) {
            let done = lanes::pairs(self, fb, kernel, order, &fixed);
            if done < kernel.count {
                let last = fb.ins().iconst(types::I64, i64::from(done));
                self.instance(fb, kernel, order, Instance::Counter(last), &fixed);
            }
            return;
        }
        counted(fb, kernel.count, 1, |fb, counter| {
            self.instance(fb, kernel, order, Instance::Counter(counter), &fixed)
        });
    }

    /// Values that are the same for all instances.
    fn load_fixed(&self, fb: &mut FunctionBuilder<'_>, kernel: &Kernel, order: &[NodeId]) -> FxHashMap<NodeId, Value> {
        let mut known = FxHashMap::default();
        for &id in order {
            if let Some(address @ Address::Fixed { .. }) = self.leaf(kernel, id) {
                let value = self.load(fb, &address, Instance::Single);
                known.insert(id, value);
            }
        }
        known
    }

    fn instance(
        &self,
        fb: &mut FunctionBuilder<'_>,
        kernel: &Kernel,
        order: &[NodeId],
        instance: Instance,
        fixed: &FxHashMap<NodeId, Value>,
    ) {
        let mut values = Values::new(self.arena, self.calls, Width::One);
        for &id in order {
            if let Some(&value) = fixed.get(&id) {
                values.define(id, value);
            } else if let Some(address) = self.leaf(kernel, id) {
                let value = self.load(fb, &address, instance);
                values.define(id, value);
            }
        }
        values.compute_all(fb, order);
        for store in &kernel.stores {
            let value = values.real(fb, store.value);
            self.store(fb, &store.to, instance, value);
        }
    }

    /// Where a leaf is read, none for other nodes.
    pub(super) fn leaf(&self, kernel: &Kernel, id: NodeId) -> Option<Address> {
        match self.arena.node(id) {
            Node::Slot(slot) => Some(kernel.slots[slot.0 as usize]),
            Node::Time => Some(Address::Fixed { area: Area::Data, index: TIME, negated: false }),
            Node::Initial => Some(Address::Fixed { area: Area::Data, index: INITIAL, negated: false }),
            Node::Homotopy => Some(Address::Fixed { area: Area::Data, index: HOMOTOPY, negated: false }),
            _ => None,
        }
    }

    pub(super) fn load(&self, fb: &mut FunctionBuilder<'_>, address: &Address, instance: Instance) -> Value {
        let (place, offset, sign) = self.locate(fb, address, instance);
        let mut flags = MemFlagsData::trusted();
        if !self.written[area_of(address) as usize] {
            flags = flags.with_readonly().with_can_move();
        }
        let value = fb.ins().load(types::F64, flags, place, offset);
        match (sign, address) {
            (Some(sign), _) => {
                let bits = fb.ins().bitcast(types::I64, MemFlagsData::new(), value);
                let bits = fb.ins().bxor(bits, sign);
                fb.ins().bitcast(types::F64, MemFlagsData::new(), bits)
            }
            (None, Address::Fixed { negated: true, .. } | Address::Affine { negated: true, .. }) => {
                fb.ins().fneg(value)
            }
            _ => value,
        }
    }

    pub(super) fn store(&self, fb: &mut FunctionBuilder<'_>, address: &Address, instance: Instance, value: Value) {
        let (place, offset, _) = self.locate(fb, address, instance);
        fb.ins().store(MemFlagsData::trusted(), value, place, offset);
    }

    /// Address as register plus offset, and the sign mask of a table entry.
    pub(super) fn locate(
        &self,
        fb: &mut FunctionBuilder<'_>,
        address: &Address,
        instance: Instance,
    ) -> (Value, i32, Option<Value>) {
        let start = self.areas[area_of(address) as usize];
        match *address {
            Address::Fixed { index, .. } => {
                let (place, offset) = shifted(fb, start, i64::from(index) * BYTES);
                (place, offset, None)
            }
            Address::Affine { base, stride, .. } => {
                let (place, offset) = shifted(fb, start, i64::from(base) * BYTES);
                let Instance::Counter(counter) = instance else { return (place, offset, None) };
                let steps = if stride == 1 { counter } else { fb.ins().imul_imm_s(counter, i64::from(stride)) };
                let bytes = fb.ins().ishl_imm_u(steps, 3);
                (fb.ins().iadd(place, bytes), offset, None)
            }
            Address::Table { start: first, signed, .. } => {
                let entry = self.table_entry(fb, first, instance);
                let index = if signed { fb.ins().band_imm_u(entry, i64::from(!TABLE_SIGN)) } else { entry };
                let bytes = fb.ins().ishl_imm_u(index, 3);
                let place = fb.ins().iadd(start, bytes);
                let sign = signed.then(|| {
                    let bit = fb.ins().ushr_imm_u(entry, 31);
                    fb.ins().ishl_imm_u(bit, 63)
                });
                (place, 0, sign)
            }
        }
    }

    fn table_entry(&self, fb: &mut FunctionBuilder<'_>, first: u32, instance: Instance) -> Value {
        let (place, offset) = shifted(fb, self.tables, i64::from(first) * 4);
        let place = match instance {
            Instance::Single => place,
            Instance::Counter(counter) => {
                let bytes = fb.ins().ishl_imm_u(counter, 2);
                fb.ins().iadd(place, bytes)
            }
        };
        fb.ins().uload32(MemFlagsData::trusted().with_readonly().with_can_move(), place, offset)
    }
}

/// Splits a byte distance into what fits an instruction and what must be added before.
fn shifted(fb: &mut FunctionBuilder<'_>, start: Value, bytes: i64) -> (Value, i32) {
    match i32::try_from(bytes) {
        Ok(offset) => (start, offset),
        Err(_) => (fb.ins().iadd_imm_s(start, bytes), 0),
    }
}

pub(super) fn area_of(address: &Address) -> Area {
    match *address {
        Address::Fixed { area, .. } | Address::Affine { area, .. } | Address::Table { area, .. } => area,
    }
}
