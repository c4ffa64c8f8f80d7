//! Sines, cosines and powers of a kernel in groups: one call for all that can be computed at once.
//!
//! The rank of such a function says how many others stand below one another in its arguments.  Nodes are computed by rank, so that all
//! arguments of a rank are there when its first function is asked for; results stand in stack slots.  The values are those of
//! single calls ([`hyd_system::angles`], [`hyd_system::powers`]).

use cranelift_codegen::ir::{InstBuilder, SigRef, StackSlot, Value, types};
use cranelift_frontend::FunctionBuilder;
use hyd_symbolic::{Arena, Function, Node, NodeId};
use hyd_system::LANES;
use hyd_system::angles::Angles;
use hyd_system::powers::Powers;
use rustc_hash::FxHashMap;

use super::expression::space;

/// Fewer sines and cosines of a rank are as fast one by one; likewise powers.
const FEWEST: u32 = 3;
const FEWEST_POWERS: usize = 2;
/// Most angles of a kernel, and most powers: their results take room on the stack.
const MOST: usize = 1000;

/// The functions of one rank.
#[derive(Default)]
struct Rank {
    /// Sines and cosines of these.
    calls: u32,
    angles: Vec<NodeId>,
    /// Bases and exponents.
    powers: Vec<(NodeId, NodeId)>,
    /// Where the results are, once they are computed.
    slot: Option<StackSlot>,
    powers_slot: Option<StackSlot>,
}

/// The functions of a kernel that are computed in groups.
#[derive(Default)]
pub(super) struct Groups {
    ranks: Vec<Rank>,
    /// Rank and position of each angle, and of each power.
    places: FxHashMap<NodeId, (u32, u32)>,
    power_places: FxHashMap<(NodeId, NodeId), (u32, u32)>,
}

impl Groups {
    /// Finds the groups among nodes that are computed in this order, operands first, and changes the order where there are
    /// any.
    pub(super) fn find(arena: &Arena, order: &mut [NodeId]) -> Self {
        let mut groups = Self::default();
        let count = |is_one: &dyn Fn(Node) -> bool| order.iter().filter(|&&id| is_one(arena.node(id))).count();
        if count(&|node| angle(node).is_some()) < FEWEST as usize
            && count(&|node| power(node).is_some()) < FEWEST_POWERS
        {
            return groups;
        }
        let mut of_node: FxHashMap<NodeId, u32> = FxHashMap::default();
        for &id in order.iter() {
            let node = arena.node(id);
            let below = node.operands().map(|operand| of_node[&operand]).max().unwrap_or(0);
            let own = match (angle(node), power(node)) {
                (Some(angle), _) => groups.add(angle, below),
                (_, Some(power)) => groups.add_power(power, below),
                _ => below,
            };
            of_node.insert(id, own);
        }
        let Self { ranks, places, power_places } = &mut groups;
        places.retain(|_, (rank, _)| ranks[*rank as usize].calls >= FEWEST);
        power_places.retain(|_, (rank, _)| ranks[*rank as usize].powers.len() >= FEWEST_POWERS);
        if !places.is_empty() || !power_places.is_empty() {
            order.sort_by_key(|id| of_node[id]);
        }
        groups
    }

    fn rank(&mut self, rank: usize) -> &mut Rank {
        if self.ranks.len() <= rank {
            self.ranks.resize_with(rank + 1, Rank::default);
        }
        &mut self.ranks[rank]
    }

    /// One more sine or cosine of an angle that needs those of `below` ranks; returns its own.
    fn add(&mut self, angle: NodeId, below: u32) -> u32 {
        self.rank(below as usize);
        let Self { ranks, places, .. } = self;
        if places.len() == MOST && !places.contains_key(&angle) {
            return below + 1;
        }
        let Rank { calls, angles, .. } = &mut ranks[below as usize];
        *calls += 1;
        places.entry(angle).or_insert_with(|| {
            angles.push(angle);
            (below, angles.len() as u32 - 1)
        });
        below + 1
    }

    /// One more power that needs the functions of `below` ranks; returns its own.
    fn add_power(&mut self, power: (NodeId, NodeId), below: u32) -> u32 {
        if self.power_places.len() < MOST {
            let powers = &mut self.rank(below as usize).powers;
            powers.push(power);
            let position = powers.len() as u32 - 1;
            self.power_places.insert(power, (below, position));
        }
        below + 1
    }

    /// Rank and position of an angle whose sine and cosine are computed with others.
    pub(super) fn place(&self, angle: NodeId) -> Option<(u32, u32)> {
        self.places.get(&angle).copied()
    }

    /// Rank and position of a power that is computed with others.
    pub(super) fn place_of_power(&self, base: NodeId, exponent: NodeId) -> Option<(u32, u32)> {
        self.power_places.get(&(base, exponent)).copied()
    }

    /// The angles of a rank that is not computed yet.
    pub(super) fn pending(&self, rank: u32) -> Option<Vec<NodeId>> {
        let rank = &self.ranks[rank as usize];
        rank.slot.is_none().then(|| rank.angles.clone())
    }

    /// Bases and exponents of a rank whose powers are not computed yet.
    pub(super) fn pending_powers(&self, rank: u32) -> Option<Vec<(NodeId, NodeId)>> {
        let rank = &self.ranks[rank as usize];
        rank.powers_slot.is_none().then(|| rank.powers.clone())
    }

    /// Computes a rank from the values of its angles.
    pub(super) fn call(&mut self, fb: &mut FunctionBuilder<'_>, rank: u32, angles: &[Value], callee: (Value, SigRef)) {
        let slot = grouped::<Angles>(fb, &[angles], callee);
        self.ranks[rank as usize].slot = Some(slot);
    }

    /// Computes the powers of a rank from the values of bases and exponents.
    pub(super) fn call_powers(
        &mut self,
        fb: &mut FunctionBuilder<'_>,
        rank: u32,
        (bases, exponents): (&[Value], &[Value]),
        callee: (Value, SigRef),
    ) {
        let slot = grouped::<Powers>(fb, &[bases, exponents], callee);
        self.ranks[rank as usize].powers_slot = Some(slot);
    }

    /// The sine or cosine at a place that is computed.
    pub(super) fn read(&self, fb: &mut FunctionBuilder<'_>, function: Function, (rank, position): (u32, u32)) -> Value {
        let slot = self.ranks[rank as usize].slot.expect("invariant: the rank was computed when it was asked for");
        let part = if function == Function::Sin { 1 } else { 2 };
        fb.ins().stack_load(types::I64, types::F64, slot, offset::<Angles>(position as usize, part))
    }

    /// The power at a place that is computed.
    pub(super) fn read_power(&self, fb: &mut FunctionBuilder<'_>, (rank, position): (u32, u32)) -> Value {
        let slot =
            self.ranks[rank as usize].powers_slot.expect("invariant: the rank was computed when it was asked for");
        fb.ins().stack_load(types::I64, types::F64, slot, offset::<Powers>(position as usize, 2))
    }
}

/// Calls a function for groups of type `T` with these arguments, part by part; the results stand in the slot behind them.
fn grouped<T>(fb: &mut FunctionBuilder<'_>, parts: &[&[Value]], (callee, signature): (Value, SigRef)) -> StackSlot {
    let last = parts[0].len() - 1;
    let count = parts[0].len().div_ceil(LANES);
    let slot = space(fb, count * size_of::<T>() / 8);
    for (part, values) in parts.iter().enumerate() {
        for k in 0..count * LANES {
            // What fills the last group are arguments, too.
            fb.ins().stack_store(types::I64, values[k.min(last)], slot, offset::<T>(k, part));
        }
    }
    let count = fb.ins().iconst(types::I64, count as i64);
    let place = fb.ins().stack_addr(types::I64, slot, 0);
    fb.ins().call_indirect(signature, callee, &[count, place]);
    slot
}

/// Where a part of a group stands at a position, in bytes: angle, sine, cosine; base, exponent, value.
fn offset<T>(position: usize, part: usize) -> i32 {
    let (group, lane) = (position / LANES, position % LANES);
    (group * size_of::<T>() + (part * LANES + lane) * 8) as i32
}

/// The angle that a sine or cosine is taken of.
fn angle(node: Node) -> Option<NodeId> {
    match node {
        Node::Call1(Function::Sin | Function::Cos, angle) => Some(angle),
        _ => None,
    }
}

/// Base and exponent of a power.
fn power(node: Node) -> Option<(NodeId, NodeId)> {
    match node {
        Node::Call2(Function::Pow, base, exponent) => Some((base, exponent)),
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

    #[test]
    fn powers_of_a_rank_are_one_group_whatever_stands_in_them() {
        let mut arena = Arena::default();
        let slots: Vec<NodeId> = (0..4).map(|k| arena.slot(SlotId(k))).collect();
        let power = |arena: &mut Arena, base, exponent| arena.intern(Node::Call2(Function::Pow, base, exponent));
        let first = [power(&mut arena, slots[0], slots[3]), power(&mut arena, slots[1], slots[3])];
        // A rank of one power and a sine above one of two.
        let both = sum(&mut arena, &first);
        let above = power(&mut arena, both, slots[3]);
        let sine = call(&mut arena, Function::Sin, both);
        let root = sum(&mut arena, &[above, sine, slots[2]]);
        let mut order = post_order(&arena, &[root]);
        let groups = Groups::find(&arena, &mut order);
        assert_eq!(groups.pending_powers(0), Some(vec![(slots[0], slots[3]), (slots[1], slots[3])]));
        assert_eq!(groups.place_of_power(slots[1], slots[3]), Some((0, 1)));
        assert_eq!((groups.place_of_power(both, slots[3]), groups.place(both)), (None, None), "single ones");
        let position = |id: NodeId| order.iter().position(|&known| known == id).expect("still there");
        assert!(order.iter().all(|&id| arena.node(id).operands().all(|operand| position(operand) < position(id))));
    }
}
