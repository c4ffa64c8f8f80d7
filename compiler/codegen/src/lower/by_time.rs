//! Relations that depend on time alone: which they are, and a routine that computes their root functions and nothing else.
//!
//! What depends on time alone is followed through the assignments: an assignment belongs to it if all that it reads is data, which
//! only events change, or was assigned so.  Compiled functions do not, because nothing is known of them over an interval of
//! time.

use std::rc::Rc;

use hyd_equations::{OperandRange, SortedSystem};
use hyd_flat::Target;
use hyd_index::TypedIndex;
use hyd_symbolic::{Arena, Node, NodeId, SlotId, post_order, slots};
use rustc_hash::FxHashMap;

use super::batch::{Batch, Item, Locate};
use crate::layout::Place;
use crate::program::{Area, Kernel, Program};

/// What a value needs.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Need {
    /// Data that only events change.
    Data,
    /// The time besides.
    Time,
    /// Unknowns, the past, or a compiled function.
    More,
}

/// The relations among `rooted` that depend on time alone, and the kernels of their root functions.
pub(super) fn lower(
    program: &mut Program,
    sorted: &SortedSystem,
    locate: &Locate<'_>,
    rooted: &[u32],
) -> Result<(Vec<u32>, Vec<Kernel>), String> {
    let mut needs = Needs { sorted, locate, nodes: FxHashMap::default(), assigned: Vec::new() };
    if rooted.is_empty() {
        return Ok((Vec::new(), Vec::new()));
    }
    let plan = &sorted.simulation;
    for a in &plan.assignments {
        let need = needs.of(&program.arena, a.value, a.operands)?;
        needs.assigned.push(need);
    }
    let mut by_time = Vec::new();
    for &r in rooted {
        let relation = sorted.relations[r as usize];
        if needs.of(&program.arena, relation.root, relation.operands)? == Need::Time {
            by_time.push(r);
        }
    }
    let rows = || by_time.iter().map(|&r| (sorted.relations[r as usize].root, sorted.relations[r as usize].operands));
    // What the rows read, and what that reads in turn.
    let mut wanted = vec![false; plan.assignments.len()];
    for (value, operands) in rows() {
        needs.want(value, operands, &mut wanted)?;
    }
    for k in (0..wanted.len()).rev().filter(|_| !by_time.is_empty()) {
        if wanted[k] {
            needs.want(plan.assignments[k].value, plan.assignments[k].operands, &mut wanted)?;
        }
    }
    let mut batch = Batch::new(locate);
    let mut last = 0;
    for (index, a) in (0u32..).zip(&plan.assignments).filter(|(index, _)| wanted[*index as usize]) {
        let (operands, to) = (sorted.system.operands_of(a.operands), [Place { area: Area::Work, index }]);
        batch.add(&program.arena, Item { level: a.level, values: &[a.value], operands, extra: &[], to: &to })?;
        last = last.max(a.level + 1);
    }
    for (index, (value, operands)) in (0u32..).zip(rows()) {
        let (operands, to) = (sorted.system.operands_of(operands), [Place { area: Area::Out, index }]);
        batch.add(&program.arena, Item { level: last, values: &[value], operands, extra: &[], to: &to })?;
    }
    let kernels = batch.kernels(&mut program.tables);
    Ok((by_time, kernels))
}

struct Needs<'a> {
    sorted: &'a SortedSystem,
    locate: &'a Locate<'a>,
    /// Of expressions themselves, and the slots that they read.
    nodes: FxHashMap<NodeId, (Need, Rc<[SlotId]>)>,
    /// Of the assignments so far.
    assigned: Vec<Need>,
}

impl Needs<'_> {
    fn of(&mut self, arena: &Arena, value: NodeId, operands: OperandRange) -> Result<Need, String> {
        let (own, used) = self.nodes.entry(value).or_insert_with(|| own(arena, value)).clone();
        let mut time = own == Need::Time;
        if own == Need::More {
            return Ok(Need::More);
        }
        let operands = self.sorted.system.operands_of(operands);
        for operand in used.iter().map(|slot| operands[slot.index()]) {
            let is_more = matches!(
                operand.target(),
                Target::Delayed(_)
                    | Target::DelayedRate(_)
                    | Target::Chosen(_)
                    | Target::Input(_)
                    | Target::InputRate(_)
            );
            if is_more {
                return Ok(Need::More);
            }
            let (place, _) = (self.locate)(operand)?;
            match place.area {
                Area::Data => {}
                Area::Work => match self.assigned.get(place.index as usize) {
                    Some(Need::Data) => {}
                    Some(Need::Time) => time = true,
                    _ => return Ok(Need::More),
                },
                _ => return Ok(Need::More),
            }
        }
        Ok(if time { Need::Time } else { Need::Data })
    }

    /// Marks the assignments that a value, of which is known what it needs, reads.
    fn want(&self, value: NodeId, operands: OperandRange, wanted: &mut [bool]) -> Result<(), String> {
        let operands = self.sorted.system.operands_of(operands);
        for slot in self.nodes.get(&value).iter().flat_map(|(_, used)| used.iter()) {
            let (place, _) = (self.locate)(operands[slot.index()])?;
            if place.area == Area::Work {
                wanted[place.index as usize] = true;
            }
        }
        Ok(())
    }
}

fn own(arena: &Arena, value: NodeId) -> (Need, Rc<[SlotId]>) {
    let mut need = Need::Data;
    for id in post_order(arena, &[value]) {
        match arena.node(id) {
            Node::Apply(..) => return (Need::More, Rc::from([])),
            Node::Time => need = Need::Time,
            _ => {}
        }
    }
    (need, slots(arena, &[value]).into())
}
