//! Sines and cosines of a kernel in groups: one call for all angles that are known at once.
//!
//! The rank of a sine or cosine says how many others stand below one another in its angle.  Nodes are computed by rank, so
//! that the angles of a rank are there when its first sine is asked for; results stand in a stack slot.  The values are those of
//! single calls ([`hyd_system::angles`]).

use cranelift_codegen::ir::{InstBuilder, SigRef, StackSlot, Value, types};
use cranelift_frontend::FunctionBuilder;
use hyd_symbolic::{Arena, Function, Node, NodeId};
use hyd_system::angles::{Angles, LANES};
use rustc_hash::FxHashMap;

use super::expression::space;

/// Fewer sines and cosines of a rank are as fast one by one.
const FEWEST: u32 = 3;
/// Most angles of a kernel: their results take room on the stack.
const MOST: usize = 1000;

/// The angles of one rank.
#[derive(Default)]
struct Rank {
    /// Sines and cosines of these.
    calls: u32,
    angles: Vec<NodeId>,
    /// Where the results are, once they are computed.
    slot: Option<StackSlot>,
}

/// The angles of a kernel that are computed in groups.
#[derive(Default)]
pub(super) struct Groups {
    ranks: Vec<Rank>,
    /// Rank and position of each angle.
    places: FxHashMap<NodeId, (u32, u32)>,
}

impl Groups {
    /// Finds the groups among nodes that are computed in this order, operands first, and changes the order where there are
    /// any.
    pub(super) fn find(arena: &Arena, order: &mut [NodeId]) -> Self {
        let mut groups = Self::default();
        if order.iter().filter(|&&id| angle(arena.node(id)).is_some()).count() < FEWEST as usize {
            return groups;
        }
        let mut of_node: FxHashMap<NodeId, u32> = FxHashMap::default();
        for &id in order.iter() {
            let node = arena.node(id);
            let below = node.operands().map(|operand| of_node[&operand]).max().unwrap_or(0);
            let own = angle(node).map_or(below, |angle| groups.add(angle, below));
            of_node.insert(id, own);
        }
        let Self { ranks, places } = &mut groups;
        places.retain(|_, (rank, _)| ranks[*rank as usize].calls >= FEWEST);
        if !places.is_empty() {
            order.sort_by_key(|id| of_node[id]);
        }
        groups
    }

    /// One more sine or cosine of an angle that needs those of `below` ranks; returns its own.
    fn add(&mut self, angle: NodeId, below: u32) -> u32 {
        let rank = below as usize;
        if self.ranks.len() <= rank {
            self.ranks.resize_with(rank + 1, Rank::default);
        }
        let Self { ranks, places } = self;
        if places.len() == MOST && !places.contains_key(&angle) {
            return below + 1;
        }
        let Rank { calls, angles, .. } = &mut ranks[rank];
        *calls += 1;
        places.entry(angle).or_insert_with(|| {
            angles.push(angle);
            (below, angles.len() as u32 - 1)
        });
        below + 1
    }

    /// Rank and position of an angle whose sine and cosine are computed with others.
    pub(super) fn place(&self, angle: NodeId) -> Option<(u32, u32)> {
        self.places.get(&angle).copied()
    }

    /// The angles of a rank that is not computed yet.
    pub(super) fn pending(&self, rank: u32) -> Option<Vec<NodeId>> {
        let rank = &self.ranks[rank as usize];
        rank.slot.is_none().then(|| rank.angles.clone())
    }

    /// Computes a rank from the values of its angles.
    pub(super) fn call(
        &mut self,
        fb: &mut FunctionBuilder<'_>,
        rank: u32,
        angles: &[Value],
        (callee, signature): (Value, SigRef),
    ) {
        let count = angles.len().div_ceil(LANES);
        let slot = space(fb, count * size_of::<Angles>() / 8);
        for k in 0..count * LANES {
            // What fills the last group is an angle, too.
            let value = angles[k.min(angles.len() - 1)];
            fb.ins().stack_store(types::I64, value, slot, offset(k, 0));
        }
        let count = fb.ins().iconst(types::I64, count as i64);
        let place = fb.ins().stack_addr(types::I64, slot, 0);
        fb.ins().call_indirect(signature, callee, &[count, place]);
        self.ranks[rank as usize].slot = Some(slot);
    }

    /// The sine or cosine at a place that is computed.
    pub(super) fn read(&self, fb: &mut FunctionBuilder<'_>, function: Function, (rank, position): (u32, u32)) -> Value {
        let slot = self.ranks[rank as usize].slot.expect("invariant: the rank was computed when it was asked for");
        let part = if function == Function::Sin { 1 } else { 2 };
        fb.ins().stack_load(types::I64, types::F64, slot, offset(position as usize, part))
    }
}

/// Where angle (part 0), sine (1) or cosine (2) of a position stand, in bytes.
fn offset(position: usize, part: usize) -> i32 {
    let (group, lane) = (position / LANES, position % LANES);
    (group * size_of::<Angles>() + (part * LANES + lane) * 8) as i32
}

/// The angle that a sine or cosine is taken of.
fn angle(node: Node) -> Option<NodeId> {
    match node {
        Node::Call1(Function::Sin | Function::Cos, angle) => Some(angle),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hyd_symbolic::{SlotId, post_order};

    fn call(arena: &mut Arena, function: Function, angle: NodeId) -> NodeId {
        arena.intern(Node::Call1(function, angle))
    }

    fn sum(arena: &mut Arena, terms: &[NodeId]) -> NodeId {
        terms.iter().copied().reduce(|a, b| arena.intern(Node::Add(a, b))).expect("terms")
    }

    #[test]
    fn angles_of_a_rank_are_one_group() {
        let mut arena = Arena::default();
        let slots: Vec<NodeId> = (0..3).map(|k| arena.slot(SlotId(k))).collect();
        let both = [Function::Sin, Function::Cos].map(|function| call(&mut arena, function, slots[0]));
        let sine = call(&mut arena, Function::Sin, slots[1]);
        // A rank of two calls above one of three.
        let angle = sum(&mut arena, &[both[0], slots[2]]);
        let above = [Function::Sin, Function::Cos].map(|function| call(&mut arena, function, angle));
        let last = call(&mut arena, Function::Cos, above[0]);
        let root = sum(&mut arena, &[last, above[1], both[1], sine]);
        let mut order = post_order(&arena, &[root]);
        let before = order.clone();
        let groups = Groups::find(&arena, &mut order);
        let calls: Vec<u32> = groups.ranks.iter().map(|rank| rank.calls).collect();
        assert_eq!(calls, [3, 2, 1]);
        assert_eq!(groups.pending(0).map(|angles| angles.len()), Some(2), "both of one angle are one place");
        assert!(groups.place(slots[0]).is_some() && groups.place(slots[1]).is_some());
        assert_eq!((groups.place(angle), groups.place(above[0])), (None, None), "two calls and one are not a group");

        let position = |id: NodeId| order.iter().position(|&known| known == id).expect("still there");
        assert_eq!(order.len(), before.len());
        for &id in &order {
            assert!(arena.node(id).operands().all(|operand| position(operand) < position(id)), "operands come first");
        }
        let first = [both[0], both[1], sine].map(position).into_iter().min().expect("three");
        assert!(slots[..2].iter().all(|&angle| position(angle) < first), "all angles are there at the first call");
    }

    #[test]
    fn a_few_calls_change_nothing() {
        let mut arena = Arena::default();
        let x = arena.slot(SlotId(0));
        let terms = [Function::Sin, Function::Cos, Function::Exp].map(|function| call(&mut arena, function, x));
        let root = sum(&mut arena, &terms);
        let mut order = post_order(&arena, &[root]);
        let before = order.clone();
        let groups = Groups::find(&arena, &mut order);
        assert_eq!((groups.place(x), order), (None, before));
    }

    #[test]
    fn the_room_for_angles_is_limited() {
        let mut arena = Arena::default();
        let slots: Vec<NodeId> = (0..MOST as u32 + 50).map(|k| arena.slot(SlotId(k))).collect();
        let sines: Vec<NodeId> = slots.iter().map(|&x| call(&mut arena, Function::Sin, x)).collect();
        let root = sum(&mut arena, &sines);
        let groups = Groups::find(&arena, &mut post_order(&arena, &[root]));
        assert_eq!(groups.pending(0).map(|angles| angles.len()), Some(MOST));
        assert_eq!(slots.iter().filter(|&&x| groups.place(x).is_some()).count(), MOST);
    }
}
