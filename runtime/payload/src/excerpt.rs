//! Some outputs without the others: code of its own that computes what they need.
//!
//! The routine of assigned variables is gone through backwards, and what nothing wanted reads is left out (backward slicing, Weiser 1981,
//! "Program Slicing"): expressions of straight-line code one by one, loops as a range of their instances.  What is left does the same
//! operations, so values have the same bits.

use std::ops::RangeInclusive;
use std::sync::{Arc, Mutex, PoisonError};

use hyd_index::{IndexVec, TypedIndex};
use hyd_symbolic::{NodeId, slots};
use hyd_system::Excerpt;

use crate::engine::{Backend, Engine};
use crate::instance::{Instance, Point};
use crate::mapping::Code;
use crate::model::Model;
use crate::program::{Address, Area, Kernel, Program, Routine, RoutineId, Store, TABLE_SIGN};
use crate::tangent::TangentSource;
use crate::vm::Registers;

/// So many excerpts of a model are kept for further instances.
const MOST_KEPT: usize = 64;

/// Makes code when it is asked for, of tangents and of programs.
pub trait CodeSource: TangentSource {
    /// Machine code of a program; none where it cannot be had.
    fn code(&self, program: &Program) -> Option<Arc<Code>>;
}

/// Some outputs, and what computes them.
#[derive(Debug)]
pub(crate) struct ExcerptCode {
    /// Positions in a row, in ascending order.
    wanted: Vec<u32>,
    /// Runs one routine; none where assigned variables are not among them.
    engine: Option<Engine>,
    /// Which unknowns are read, and whether rates are.
    reads: (Vec<u32>, bool),
}

/// The excerpts of a loaded model that have been asked for, made once for all instances.
#[derive(Debug)]
pub(crate) struct Excerpts {
    source: Option<Arc<dyn CodeSource>>,
    made: Mutex<Vec<Asked>>,
}

/// Outputs that were asked for, and their code if there is some.
type Asked = (Vec<u32>, Option<Arc<ExcerptCode>>);

impl Excerpts {
    pub(crate) fn new(source: Option<Arc<dyn CodeSource>>) -> Self {
        Self { source, made: Mutex::new(Vec::new()) }
    }

    /// The excerpt of these outputs; none where it would not save half of the work, or no code can be made.
    fn of(&self, wanted: &[u32], model: &Model, backend: Backend) -> Option<Arc<ExcerptCode>> {
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, excerpt)) = made.iter().find(|(outputs, _)| outputs == wanted) {
            return excerpt.clone();
        }
        let excerpt = self.make(wanted, model, backend).map(Arc::new);
        if made.len() == MOST_KEPT {
            made.remove(0);
        }
        made.push((wanted.to_vec(), excerpt.clone()));
        excerpt
    }

    fn make(&self, wanted: &[u32], model: &Model, backend: Backend) -> Option<ExcerptCode> {
        if wanted.last().is_some_and(|&last| last as usize >= model.structure.outputs) {
            return None;
        }
        let assigned: Vec<u32> = wanted.iter().copied().filter(|&k| k < model.row.assigned).collect();
        let (first, behind) = (model.row.assigned, model.row.assigned + model.structure.unknowns as u32);
        let rates = behind..behind + model.row.states.len() as u32;
        let unknowns = wanted.iter().filter(|k| (first..behind).contains(k)).map(|k| k - first).collect();
        let mut reads = (unknowns, wanted.iter().any(|k| rates.contains(k)));
        if assigned.is_empty() {
            return Some(ExcerptCode { wanted: wanted.to_vec(), engine: None, reads });
        }
        let whole = &model.program.routines[model.routines.simulation.assign];
        let length = model.rows.iter().map(|trace| trace.equations.len()).max().unwrap_or(0);
        let kernels = slice(&model.program, &whole.kernels, &assigned, length);
        if 2 * work(&kernels) > work(&whole.kernels) {
            return None;
        }
        kernels.iter().for_each(|kernel| add_reads(&model.program, kernel, &mut reads));
        reads.0.sort_unstable();
        reads.0.dedup();
        let routines = IndexVec::from_vec(vec![Routine { name: "excerpt", kernels }]);
        let program = Program { arena: model.program.arena.clone(), routines, tables: model.program.tables.clone() };
        let code = match backend {
            Backend::Vm => None,
            Backend::Native => Some(self.source.as_ref()?.code(&program)?),
        };
        let engine = Engine::new(code, Arc::new(program), backend).ok()?;
        Some(ExcerptCode { wanted: wanted.to_vec(), engine: Some(engine), reads })
    }
}

impl Instance {
    /// Code for these outputs (positions in a row, in ascending order), with a number for [`Instance::fill_excerpt`].
    pub(crate) fn find_excerpt(&mut self, wanted: &[u32]) -> Option<Excerpt> {
        let known = self.excerpts.iter().position(|(excerpt, _)| excerpt.wanted == wanted);
        let number = match known {
            Some(known) => known,
            None => {
                let excerpt = self.loaded.excerpts.of(wanted, &self.loaded.model, self.loaded.engine.backend())?;
                let registers = excerpt.engine.as_ref().map_or_else(Registers::default, Engine::registers);
                self.excerpts.push((excerpt, registers));
                self.excerpts.len() - 1
            }
        };
        let (unknowns, rates) = self.excerpts[number].0.reads.clone();
        Some(Excerpt { number, unknowns, rates })
    }

    /// The outputs of an excerpt at a point, to their positions in a row.
    pub(crate) fn fill_excerpt(&mut self, number: usize, point: Point<'_>, out: &mut [f64]) {
        let Some((excerpt, mut registers)) = self.excerpts.get_mut(number).map(|(e, r)| (e.clone(), std::mem::take(r)))
        else {
            return self.output_row(point, out);
        };
        if let Some(engine) = &excerpt.engine {
            let only = RoutineId::new(0);
            self.run_on((engine, only, &mut registers), point, &mut [], &mut []);
        }
        self.excerpts[number].1 = registers;
        let row = &self.loaded.model.row;
        let (unknowns, rates) = (row.assigned as usize, row.assigned as usize + point.unknown.len());
        let discrete = rates + row.states.len();
        for k in excerpt.wanted.iter().map(|&k| k as usize) {
            out[k] = match k {
                _ if k < unknowns => self.memory.work[k],
                _ if k < rates => point.unknown[k - unknowns],
                _ if k < discrete => point.rate[row.states[k - rates] as usize],
                _ => self.memory.data[self.loaded.model.area.discrete.start as usize + (k - discrete)],
            };
        }
    }
}

/// Expressions that kernels compute.
fn work(kernels: &[Kernel]) -> usize {
    kernels.iter().map(|kernel| kernel.count as usize * kernel.stores.len()).sum()
}

/// What of these kernels is needed for some positions of the work area, which has `length` of them.  No kernel reads positions that it
/// writes itself: instances do not depend on each other and load before they store.
fn slice(program: &Program, kernels: &[Kernel], wanted: &[u32], length: usize) -> Vec<Kernel> {
    let mut needed = vec![false; length];
    wanted.iter().for_each(|&k| needed[k as usize] = true);
    let mut kept = Vec::new();
    for kernel in kernels.iter().rev() {
        let Some((stores, instances)) = needed_part(program, kernel, &needed) else { continue };
        let roots: Vec<NodeId> = stores.iter().map(|store| store.value).collect();
        for slot in slots(&program.arena, &roots) {
            let address = &kernel.slots[slot.0 as usize];
            instances.clone().filter_map(|k| work_position(program, address, k)).for_each(|at| needed[at] = true);
        }
        let first = *instances.start();
        kept.push(Kernel {
            count: instances.end() - first + 1,
            slots: kernel.slots.iter().map(|&slot| moved(slot, first)).collect(),
            stores: stores.into_iter().map(|store| Store { to: moved(store.to, first), ..store }).collect(),
        });
    }
    kept.reverse();
    kept
}

/// Adds the unknowns that a kernel reads, and whether it reads rates.
fn add_reads(program: &Program, kernel: &Kernel, (unknowns, rates): &mut (Vec<u32>, bool)) {
    let roots: Vec<NodeId> = kernel.stores.iter().map(|store| store.value).collect();
    for slot in slots(&program.arena, &roots) {
        let address = &kernel.slots[slot.0 as usize];
        for (area, position) in (0..kernel.count).map(|k| place(program, address, k)) {
            match area {
                Area::Unknown => unknowns.push(position),
                Area::Rate => *rates = true,
                _ => {}
            }
        }
    }
}

/// The stores of a kernel that something needed comes from, and the instances between the first and the last that are needed.
fn needed_part(program: &Program, kernel: &Kernel, needed: &[bool]) -> Option<(Vec<Store>, RangeInclusive<u32>)> {
    let mut range: Option<RangeInclusive<u32>> = None;
    let mut stores = Vec::new();
    for store in &kernel.stores {
        let is_needed = |&k: &u32| work_position(program, &store.to, k).is_none_or(|at| needed[at]);
        let Some(first) = (0..kernel.count).find(is_needed) else { continue };
        // What is found from the front is found from the back.
        let last = (first..kernel.count).rev().find(is_needed).unwrap_or(first);
        range = Some(match range {
            Some(range) => first.min(*range.start())..=last.max(*range.end()),
            None => first..=last,
        });
        stores.push(*store);
    }
    range.map(|range| (stores, range))
}

/// The position in the work area that an instance uses; none if it uses another area.
fn work_position(program: &Program, address: &Address, instance: u32) -> Option<usize> {
    let (area, position) = place(program, address, instance);
    (area == Area::Work).then_some(position as usize)
}

/// The position that an instance uses.
fn place(program: &Program, address: &Address, instance: u32) -> (Area, u32) {
    match *address {
        Address::Fixed { area, index, .. } => (area, index),
        Address::Affine { area, base, stride, .. } => {
            (area, (i64::from(base) + i64::from(stride) * i64::from(instance)) as u32)
        }
        Address::Table { area, start, signed } => {
            let entry = program.tables[start as usize + instance as usize];
            (area, if signed { entry & !TABLE_SIGN } else { entry })
        }
    }
}

/// An address of a loop that begins at a later instance.
fn moved(address: Address, first: u32) -> Address {
    match address {
        Address::Affine { area, base, stride, negated } => {
            let base = (i64::from(base) + i64::from(stride) * i64::from(first)) as u32;
            Address::Affine { area, base, stride, negated }
        }
        Address::Table { area, start, signed } => Address::Table { area, start: start + first, signed },
        Address::Fixed { .. } => address,
    }
}
