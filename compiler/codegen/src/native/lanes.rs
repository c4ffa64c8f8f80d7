//! Two instances of a kernel at once: one pass over its nodes with vectors of two numbers.
//!
//! Every operation rounds each lane as the scalar one does, so results are the same to the bit.  A kernel whose nodes
//! are all computed without a call and whose instances cannot see each other's results is run in pairs; the last
//! instance of an odd number is run by itself.  Neighbours in memory are loaded and stored together, others lane by
//! lane.

use cranelift_codegen::ir::{InstBuilder, MemFlagsData, Value, types};
use cranelift_frontend::FunctionBuilder;
use hyd_symbolic::{Arena, Node, NodeId};
use rustc_hash::FxHashMap;

use super::expression::{Values, is_inline};
use super::kernel::{Frame, Instance, area_of, counted};
use super::width::Width;
use crate::program::{Address, Kernel};

/// Fewer instances are not worth a second form of the code.
const FEWEST: u32 = 4;

/// True if instances can be run in pairs.
pub(super) fn fits(arena: &Arena, kernel: &Kernel, order: &[NodeId], rounds_inline: bool) -> bool {
    kernel.count >= FEWEST
        && order.iter().all(|&id| is_inline(arena.node(id), rounds_inline))
        && is_apart(arena, kernel, order)
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

/// Emits the pairs of a kernel; `fixed` are scalars that are the same for all instances.  Returns the number of
/// instances that were run.
pub(super) fn pairs(
    frame: &Frame<'_>,
    fb: &mut FunctionBuilder<'_>,
    kernel: &Kernel,
    order: &[NodeId],
    fixed: &FxHashMap<NodeId, Value>,
) -> u32 {
    let count = kernel.count & !1;
    let mut values = Values::new(frame.arena, frame.calls, Width::Two);
    for &id in order {
        if let Some(&value) = fixed.get(&id) {
            let both = Width::Two.spread(fb, value);
            values.define(id, both);
        }
    }
    counted(fb, count, 2, |fb, counter| {
        for &id in order {
            if let Some(address) = frame.leaf(kernel, id).filter(|_| !fixed.contains_key(&id)) {
                let value = load(frame, fb, &address, counter);
                values.define(id, value);
            }
        }
        for &id in order {
            values.compute(fb, id);
        }
        for store in &kernel.stores {
            let value = values.real(fb, store.value);
            write(frame, fb, &store.to, counter, value);
        }
    });
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
