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
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Item<'a> {
    /// Position in the order of dependence.
    pub level: u32,
    /// The expressions.
    pub values: &'a [NodeId],
    /// What their slots read.
    pub operands: &'a [Operand],
    /// Further places, read by the slots behind the operands.
    pub extra: &'a [Place],
    /// Where the values go.
    pub to: &'a [Place],
}

/// What slots read: place and sign.
pub(super) type Locate<'a> = dyn Fn(Operand) -> Result<(Place, bool), String> + 'a;

/// Items on the way to kernels.  Nothing is allocated per item: systems have millions of them.
pub(crate) struct Batch<'l> {
    locate: &'l Locate<'l>,
    forms: Vec<Form>,
    known: FxHashMap<Box<[NodeId]>, usize>,
    /// Groups of each form and level.
    by_level: FxHashMap<(usize, u32), Vec<usize>>,
    groups: Vec<Group>,
    /// Work space: areas of what the item reads and where its values go, and positions with signs of what it reads.
    areas: Vec<Area>,
    reads: Vec<u32>,
}

/// A list of expressions with the slots that occur in them.
struct Form {
    values: Box<[NodeId]>,
    used: Vec<usize>,
}

/// The instances of one kernel.
struct Group {
    form: usize,
    level: u32,
    /// Areas of the used slots, then of the results.
    areas: Vec<Area>,
    /// Positions of what the used slots read, signs in the highest bit, instance by instance.
    reads: Vec<u32>,
    /// Positions of the results, instance by instance.
    to: Vec<u32>,
}

impl<'l> Batch<'l> {
    /// No items yet.
    pub(crate) fn new(locate: &'l Locate<'l>) -> Self {
        Self {
            locate,
            forms: Vec::new(),
            known: FxHashMap::default(),
            by_level: FxHashMap::default(),
            groups: Vec::new(),
            areas: Vec::new(),
            reads: Vec::new(),
        }
    }

    /// Adds an item.
    ///
    /// # Errors
    /// What `locate` says of an operand without a place.
    pub(crate) fn add(&mut self, arena: &Arena, item: Item<'_>) -> Result<(), String> {
        let form = self.form(arena, item.values);
        self.areas.clear();
        self.reads.clear();
        for &slot in &self.forms[form].used {
            let (place, negated) = read(self.locate, &item, slot)?;
            self.areas.push(place.area);
            self.reads.push(place.index | if negated { TABLE_SIGN } else { 0 });
        }
        self.areas.extend(item.to.iter().map(|place| place.area));
        let same = self.by_level.entry((form, item.level)).or_default();
        let known = same.iter().copied().find(|&group| self.groups[group].areas == self.areas);
        let group = known.unwrap_or_else(|| {
            same.push(self.groups.len());
            let areas = self.areas.clone();
            self.groups.push(Group { form, level: item.level, areas, reads: Vec::new(), to: Vec::new() });
            self.groups.len() - 1
        });
        let group = &mut self.groups[group];
        group.reads.extend_from_slice(&self.reads);
        group.to.extend(item.to.iter().map(|place| place.index));
        Ok(())
    }

    fn form(&mut self, arena: &Arena, values: &[NodeId]) -> usize {
        if let Some(&known) = self.known.get(values) {
            return known;
        }
        let used = slots(arena, values).iter().map(|slot| slot.index()).collect();
        self.forms.push(Form { values: values.into(), used });
        self.known.insert(values.into(), self.forms.len() - 1);
        self.forms.len() - 1
    }

    /// The kernels of all items; slot tables are appended to `tables`.
    pub(crate) fn kernels(self, tables: &mut Vec<u32>) -> Vec<Kernel> {
        let mut levels: Vec<(u32, usize)> = self.groups.iter().map(|group| group.level).zip(0..).collect();
        levels.sort_unstable();
        levels.into_iter().map(|(_, group)| self.groups[group].kernel(&self.forms, tables)).collect()
    }
}

fn read(locate: &Locate<'_>, item: &Item<'_>, slot: usize) -> Result<(Place, bool), String> {
    match item.operands.get(slot) {
        Some(&operand) => locate(operand),
        None => {
            let extra = item.extra.get(slot - item.operands.len());
            extra.map(|&place| (place, false)).ok_or_else(|| "a slot has no operand".to_string())
        }
    }
}

impl Group {
    fn kernel(&self, forms: &[Form], tables: &mut Vec<u32>) -> Kernel {
        let Form { values, used } = &forms[self.form];
        let count = self.to.len() / values.len();
        // Instances do not depend on each other; ascending results make affine addresses likely.
        let result = |instance: u32| self.to[instance as usize * values.len()];
        let mut order: Vec<u32> = (0..count as u32).collect();
        if !order.is_sorted_by_key(|&k| result(k)) {
            order.sort_by_key(|&k| result(k));
        }
        let mut places: Vec<u32> = Vec::with_capacity(count);
        let mut column = |list: &[u32], width: usize, k: usize, area: Area| {
            places.clear();
            places.extend(order.iter().map(|&instance| list[instance as usize * width + k]));
            address(area, &places, tables)
        };
        let unused = Address::Fixed { area: Area::Data, index: 0, negated: false };
        let mut slots = vec![unused; used.iter().max().map_or(0, |&last| last + 1)];
        for (k, &slot) in used.iter().enumerate() {
            slots[slot] = column(&self.reads, used.len(), k, self.areas[k]);
        }
        let to = |k: usize| self.areas[used.len() + k];
        let stores = values.iter().enumerate();
        let stores = stores.map(|(k, &value)| Store { value, to: column(&self.to, values.len(), k, to(k)) }).collect();
        Kernel { count: count as u32, slots, stores }
    }
}

/// The shortest description of the places of one slot over all instances (positions in one area with signs, at least one).
fn address(area: Area, places: &[u32], tables: &mut Vec<u32>) -> Address {
    let index = |place: u32| i64::from(place & !TABLE_SIGN);
    let (base, negated) = (places[0] & !TABLE_SIGN, places[0] & TABLE_SIGN != 0);
    let stride = places.get(1).map_or(0, |&second| index(second) - i64::from(base));
    let one_sign = places.iter().all(|&place| (place & TABLE_SIGN != 0) == negated);
    let even = (0i64..).zip(places).all(|(k, &place)| index(place) == i64::from(base) + stride * k);
    match i32::try_from(stride) {
        Ok(0) if even && one_sign => Address::Fixed { area, index: base, negated },
        Ok(stride) if even && one_sign => Address::Affine { area, base, stride, negated },
        _ => {
            let start = tables.len() as u32;
            let signed = places.iter().any(|&place| place & TABLE_SIGN != 0);
            tables.extend_from_slice(places);
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
        let area = Area::Work;
        let of = |list: &[(u32, bool)], tables: &mut Vec<u32>| {
            let places: Vec<u32> = list.iter().map(|&(k, sign)| k | if sign { TABLE_SIGN } else { 0 }).collect();
            address(area, &places, tables)
        };
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
