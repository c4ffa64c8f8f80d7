//! The memory that routines run on, and what each routine touches of it.
//!
//! Code addresses the areas by numbers that were fixed at translation.  [`Extents`] records, per routine and area, one
//! past the highest number, so that one comparison per call makes native code as safe as indexing slices.  Unknowns and
//! rates belong to the solver and are never written; a program that tries is refused here.

use hyd_index::IndexVec;
use hyd_symbolic::{NodeId, SlotId, slots};

use crate::program::{AREAS, Address, Area, HOMOTOPY, Kernel, Program, RoutineId, TABLE_SIGN};

/// The areas of one call.
#[derive(Debug)]
pub struct Memory<'a> {
    /// Time, flags, constants, parameters, start values, discrete variables, held relations.
    pub data: &'a mut [f64],
    /// Unknowns.
    pub unknown: &'a [f64],
    /// Derivatives of the unknowns.
    pub rate: &'a [f64],
    /// Assigned variables.
    pub work: &'a mut [f64],
    /// Results.
    pub out: &'a mut [f64],
    /// Second result array.
    pub out2: &'a mut [f64],
}

impl Memory<'_> {
    /// Length of each area.
    pub fn lengths(&self) -> [usize; AREAS] {
        [self.data.len(), self.unknown.len(), self.rate.len(), self.work.len(), self.out.len(), self.out2.len()]
    }

    /// A value.
    pub fn read(&self, area: Area, index: u32) -> f64 {
        let index = index as usize;
        match area {
            Area::Data => self.data[index],
            Area::Unknown => self.unknown[index],
            Area::Rate => self.rate[index],
            Area::Work => self.work[index],
            Area::Out => self.out[index],
            Area::Out2 => self.out2[index],
        }
    }

    /// Writes a value; unknowns and rates are never written ([`Extents::of`] refuses such programs).
    pub fn write(&mut self, area: Area, index: u32, value: f64) {
        let index = index as usize;
        match area {
            Area::Data => self.data[index] = value,
            Area::Work => self.work[index] = value,
            Area::Out => self.out[index] = value,
            Area::Out2 => self.out2[index] = value,
            Area::Unknown | Area::Rate => {}
        }
    }
}

/// What the routines of a program need of each area.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Extents {
    pub(crate) needed: IndexVec<RoutineId, [u32; AREAS]>,
}

impl Extents {
    /// Scans a program.
    ///
    /// # Errors
    /// A sentence, if a kernel writes an area it must not, an address has no place or a table is too short.
    pub fn of(program: &Program) -> Result<Self, String> {
        let mut needed = IndexVec::new();
        for routine in program.routines.iter() {
            let mut ends = [0u32; AREAS];
            ends[Area::Data as usize] = HOMOTOPY + 1; // the last of the fixed ones
            for kernel in &routine.kernels {
                check_slots(program, kernel)?;
                let stores = kernel.stores.iter().map(|store| (&store.to, true));
                for (address, written) in kernel.slots.iter().map(|slot| (slot, false)).chain(stores) {
                    let (area, end) = end_of(program, address, kernel.count)?;
                    if written && matches!(area, Area::Unknown | Area::Rate) {
                        return Err(format!("routine `{}` writes unknowns", routine.name));
                    }
                    ends[area as usize] = ends[area as usize].max(end);
                }
            }
            needed.push(ends);
        }
        Ok(Self { needed })
    }

    /// One past the highest position that the routine touches, per area.
    pub fn needed(&self, routine: RoutineId) -> [u32; AREAS] {
        self.needed[routine]
    }

    /// Panics unless the memory is large enough for the routine.
    pub fn check(&self, routine: RoutineId, memory: &Memory<'_>) {
        let enough = self.needed[routine].iter().zip(memory.lengths()).all(|(&end, length)| end as usize <= length);
        assert!(enough, "invariant: callers size their memory by the layout the program was made with");
    }
}

/// Refuses a kernel whose expressions use slots that it does not describe.
fn check_slots(program: &Program, kernel: &Kernel) -> Result<(), String> {
    let roots: Vec<NodeId> = kernel.stores.iter().map(|store| store.value).collect();
    let known = |slot: &SlotId| (slot.0 as usize) < kernel.slots.len();
    if slots(&program.arena, &roots).iter().all(known) { Ok(()) } else { Err("a slot has no address".into()) }
}

/// The area of an address and one past its highest position over all instances.
fn end_of(program: &Program, address: &Address, count: u32) -> Result<(Area, u32), String> {
    let outside = || "an address lies outside its area".to_string();
    match *address {
        Address::Fixed { area, index, .. } => Ok((area, index.checked_add(1).ok_or_else(outside)?)),
        Address::Affine { area, base, stride, .. } => {
            let last = i64::from(base) + i64::from(stride) * (i64::from(count) - 1).max(0);
            let high = last.max(i64::from(base)) + 1;
            if last < 0 || high > i64::from(u32::MAX) { Err(outside()) } else { Ok((area, high as u32)) }
        }
        Address::Table { area, start, signed } => {
            let range = start as usize..start as usize + count as usize;
            let entries = program.tables.get(range).ok_or("a slot table is too short")?;
            let mask = if signed { !TABLE_SIGN } else { u32::MAX };
            let high = entries.iter().map(|entry| entry & mask).max().unwrap_or(0);
            Ok((area, high.checked_add(1).ok_or_else(outside)?))
        }
    }
}
