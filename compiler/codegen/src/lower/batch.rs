//! Expressions of one form to loops.
//!
//! Expressions with the same nodes, the same level and operands in the same areas become one kernel.  Positions that are
//! equal or ascend evenly over the instances become fixed or affine addresses, others a table.  So the number of kernels
//! follows the number of forms, not of equations.  Kernels come in the order of their levels: what a level reads was
//! written by the levels before it.

use hyd_flat::Operand;
use hyd_index::TypedIndex;
use hyd_symbolic::{Arena, NodeId, slots};
use rustc_hash::FxHashMap;

use crate::layout::Place;
use crate::program::{Address, Area, Kernel, Store, TABLE_SIGN};

/// Expressions over the same operands, computed together, and where each value goes.
#[derive(Clone, PartialEq, Debug)]
pub struct Item<'a> {
    /// Position in the order of dependence.
    pub level: u32,
    /// The expressions.
    pub values: Vec<NodeId>,
    /// What their slots read.
    pub operands: &'a [Operand],
    /// Further places, read by the slots behind the operands.
    pub extra: Vec<Place>,
    /// Where the values go.
    pub to: Vec<Place>,
}

/// What slots read: place and sign.
pub type Locate<'a> = dyn Fn(Operand) -> Result<(Place, bool), String> + 'a;

/// The instances of one kernel.
struct Group {
    values: Vec<NodeId>,
    used: Vec<usize>,
    slots: usize,
    instances: Vec<Instance>,
}

/// Places of one instance: what the used slots read, and where the values go.
struct Instance {
    reads: Vec<(Place, bool)>,
    to: Vec<Place>,
}

/// Kernels for all items; slot tables are appended to `tables`.
///
/// # Errors
/// What `locate` says of an operand without a place.
pub fn kernels(
    arena: &Arena,
    items: &[Item<'_>],
    locate: &Locate<'_>,
    tables: &mut Vec<u32>,
) -> Result<Vec<Kernel>, String> {
    let mut groups: Vec<Group> = Vec::new();
    let mut known: FxHashMap<(u32, Vec<NodeId>, Vec<Area>), usize> = FxHashMap::default();
    let mut used_slots: FxHashMap<Vec<NodeId>, Vec<usize>> = FxHashMap::default();
    let mut levels: Vec<(u32, usize)> = Vec::new();
    for item in items {
        let used = used_slots
            .entry(item.values.clone())
            .or_insert_with(|| slots(arena, &item.values).iter().map(|slot| slot.index()).collect());
        let instance = instance(item, used, locate)?;
        let reads = instance.reads.iter().map(|(place, _)| place.area);
        let areas: Vec<Area> = reads.chain(instance.to.iter().map(|place| place.area)).collect();
        let group = *known.entry((item.level, item.values.clone(), areas)).or_insert_with(|| {
            let slots = used.iter().max().map_or(0, |&last| last + 1);
            levels.push((item.level, groups.len()));
            groups.push(Group { values: item.values.clone(), used: used.clone(), slots, instances: Vec::new() });
            groups.len() - 1
        });
        groups[group].instances.push(instance);
    }
    levels.sort_unstable();
    Ok(levels.into_iter().map(|(_, group)| groups[group].kernel(tables)).collect())
}

fn instance(item: &Item<'_>, used: &[usize], locate: &Locate<'_>) -> Result<Instance, String> {
    let read = |&slot: &usize| match item.operands.get(slot) {
        Some(&operand) => locate(operand),
        None => {
            let extra = item.extra.get(slot - item.operands.len());
            extra.map(|&place| (place, false)).ok_or_else(|| "a slot has no operand".to_string())
        }
    };
    let reads = used.iter().map(read).collect::<Result<_, _>>()?;
    Ok(Instance { reads, to: item.to.clone() })
}

impl Group {
    fn kernel(&mut self, tables: &mut Vec<u32>) -> Kernel {
        // Instances do not depend on each other; ascending results make affine addresses likely.
        self.instances.sort_by_key(|instance| instance.to.first().map_or(0, |place| place.index));
        let unused = Address::Fixed { area: Area::Data, index: 0, negated: false };
        let mut addresses = vec![unused; self.slots];
        for (k, &slot) in self.used.iter().enumerate() {
            let places: Vec<(Place, bool)> = self.instances.iter().map(|instance| instance.reads[k]).collect();
            addresses[slot] = address(&places, tables);
        }
        let mut stores = Vec::with_capacity(self.values.len());
        for (k, &value) in self.values.iter().enumerate() {
            let places: Vec<(Place, bool)> = self.instances.iter().map(|instance| (instance.to[k], false)).collect();
            stores.push(Store { value, to: address(&places, tables) });
        }
        Kernel { count: self.instances.len() as u32, slots: addresses, stores }
    }
}

/// The shortest description of the places of one slot over all instances (all in one area, at least one).
fn address(places: &[(Place, bool)], tables: &mut Vec<u32>) -> Address {
    let (first, negated) = places[0];
    let (area, base) = (first.area, first.index);
    let stride = places.get(1).map_or(0, |(second, _)| i64::from(second.index) - i64::from(base));
    let one_sign = places.iter().all(|&(_, sign)| sign == negated);
    let even = (0i64..).zip(places).all(|(k, (place, _))| i64::from(place.index) == i64::from(base) + stride * k);
    match i32::try_from(stride) {
        Ok(0) if even && one_sign => Address::Fixed { area, index: base, negated },
        Ok(stride) if even && one_sign => Address::Affine { area, base, stride, negated },
        _ => {
            let start = tables.len() as u32;
            let signed = places.iter().any(|&(_, sign)| sign);
            tables.extend(places.iter().map(|&(place, sign)| place.index | if sign { TABLE_SIGN } else { 0 }));
            Address::Table { area, start, signed }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_as_short_as_the_places_allow() {
        let mut tables = Vec::new();
        let places = |list: &[(u32, bool)]| -> Vec<(Place, bool)> {
            list.iter().map(|&(index, sign)| (Place { area: Area::Work, index }, sign)).collect()
        };
        let area = Area::Work;
        let of = |list: &[(u32, bool)], tables: &mut Vec<u32>| address(&places(list), tables);
        let fixed = Address::Fixed { area, index: 7, negated: true };
        assert_eq!(of(&[(7, true), (7, true)], &mut tables), fixed);
        let falling = Address::Affine { area, base: 9, stride: -2, negated: false };
        assert_eq!(of(&[(9, false), (7, false), (5, false)], &mut tables), falling);
        assert!(tables.is_empty());
        let table = Address::Table { area, start: 0, signed: true };
        assert_eq!(of(&[(1, false), (2, true), (3, false)], &mut tables), table);
        assert_eq!(tables, [1, 2 | TABLE_SIGN, 3]);
    }
}
