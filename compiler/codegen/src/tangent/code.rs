//! Kernels to the kernels of their partial derivatives, and the rows that chain them.
//!
//! For each stored expression of a kernel and each slot it depends on, one derivative is stored beside the others, one
//! position per instance; derivatives that are numbers are not code but preset coefficients.  Time is one more thing that
//! is read.  The primal routines run before, so assigned variables stand in the work area.

use std::sync::Arc;

use hyd_symbolic::{Arena, NodeId, contains_time, gradient, partial_time};
use rustc_hash::FxHashMap;

use hyd_payload::tangent::{MINUS, PARTS, Rows, Spaces, Stage, TangentModel, Term};
use hyd_payload::{Backend, vm};

use crate::lower::Lowered;
use crate::program::{Address, Area, Kernel, Program, Routine, RoutineId, Store, TIME};

/// Differentiates the routines of a model.
///
/// # Errors
/// A sentence, when no code can be made.
pub(super) fn tangents(lowered: &Lowered, starts: Vec<Option<u32>>, backend: Backend) -> Result<TangentModel, String> {
    let base = &lowered.program;
    let of = |routine: RoutineId| base.routines[routine].kernels.as_slice();
    let events = &lowered.routines.events;
    let (plain, start) = (&lowered.plain, &lowered.initial_plain);
    let sources: [(&[Kernel], bool); PARTS] = [
        (of(lowered.routines.bind), false),
        (&start.assign, true),
        (&start.residual, true),
        (&plain.assign, false),
        (&plain.residual, false),
        (&plain.extra, false),
        (of(events.instants), false),
        (of(events.discrete), false),
        (of(events.reinits), false),
    ];
    let results = [
        lowered.routines.initial.state_pattern.rows,
        lowered.routines.simulation.state_pattern.rows,
        events.rooted.len(),
        events.timed.len(),
        events.reinit_unknowns.len(),
    ];
    let spaces = Spaces::new([
        lowered.layout.data,
        lowered.routines.simulation.state_pattern.rows as u32,
        assigned(&plain.assign),
        results.into_iter().max().unwrap_or(0) as u32,
        lowered.routines.initial.state_pattern.rows as u32,
        assigned(&start.assign),
    ]);
    let mut program = Program { arena: base.arena.clone(), tables: base.tables.clone(), ..Program::default() };
    let stages = sources.map(|(kernels, initial)| stage(&mut program, kernels, spaces, initial));
    let code = crate::engine::code(&program, backend)?;
    Ok(TangentModel { code, program: Arc::new(program), spaces, stages, starts, sweep: None })
}

/// Number of instances that write.
fn assigned(kernels: &[Kernel]) -> u32 {
    kernels.iter().map(|kernel| kernel.count * kernel.stores.len() as u32).sum()
}

fn stage(program: &mut Program, kernels: &[Kernel], spaces: Spaces, initial: bool) -> Stage {
    let mut maker =
        Maker { spaces, initial, coefficients: Vec::new(), numbers: FxHashMap::default(), rows: Rows::default() };
    let mut routine = Routine { name: "partials", kernels: Vec::new() };
    for kernel in kernels {
        let stores = maker.kernel(&mut program.arena, &program.tables, kernel);
        if !stores.is_empty() {
            routine.kernels.push(Kernel { count: kernel.count, slots: kernel.slots.clone(), stores });
        }
    }
    let partials = program.routines.push(routine);
    Stage { partials, coefficients: maker.coefficients, rows: maker.rows }
}

/// A partial derivative: what it is by, and where its values stand.
struct Partial {
    source: Address,
    /// Coefficient of instance 0 and distance to the next one (0: a number).
    first: u32,
    step: u32,
}

struct Maker {
    spaces: Spaces,
    initial: bool,
    coefficients: Vec<f64>,
    numbers: FxHashMap<u64, u32>,
    rows: Rows,
}

impl Maker {
    /// Appends the rows of a kernel; returns what its partials store.
    fn kernel(&mut self, arena: &mut Arena, tables: &[u32], kernel: &Kernel) -> Vec<Store> {
        let mut stores = Vec::new();
        let mut partials: Vec<Vec<Partial>> = Vec::with_capacity(kernel.stores.len());
        for store in &kernel.stores {
            partials.push(self.partials(arena, kernel, store.value, &mut stores));
        }
        for instance in 0..kernel.count {
            for (store, partials) in kernel.stores.iter().zip(&partials) {
                let (to, _) = self.block(&store.to, instance, tables);
                let terms = partials.iter().map(|partial| {
                    let (from, negated) = self.block(&partial.source, instance, tables);
                    let coefficient = partial.first + partial.step * instance;
                    Term { coefficient: coefficient | if negated { MINUS } else { 0 }, from }
                });
                let terms: Vec<Term> = terms.collect();
                self.rows.push(to, terms);
            }
        }
        stores
    }

    fn partials(&mut self, arena: &mut Arena, kernel: &Kernel, value: NodeId, stores: &mut Vec<Store>) -> Vec<Partial> {
        let mut list: Vec<(Address, NodeId)> = Vec::new();
        for (slot, derivative) in gradient(arena, value) {
            list.push((kernel.slots[slot.0 as usize], derivative));
        }
        if contains_time(arena, value) {
            let clock = Address::Fixed { area: Area::Data, index: TIME, negated: false };
            list.push((clock, partial_time(arena, value)));
        }
        let mut partials = Vec::with_capacity(list.len());
        for (source, derivative) in list {
            let (first, step) = match arena.as_constant(derivative) {
                Some(0.0) => continue,
                Some(number) => (self.number(number), 0),
                None => {
                    let first = self.coefficients.len() as u32;
                    self.coefficients.resize(self.coefficients.len() + kernel.count as usize, 0.0);
                    let to = Address::Affine { area: Area::Out, base: first, stride: 1, negated: false };
                    stores.push(Store { value: derivative, to });
                    (first, 1)
                }
            };
            partials.push(Partial { source, first, step });
        }
        partials
    }

    fn number(&mut self, value: f64) -> u32 {
        let coefficients = &mut self.coefficients;
        *self.numbers.entry(value.to_bits()).or_insert_with(|| {
            coefficients.push(value);
            coefficients.len() as u32 - 1
        })
    }

    /// The block of an address in one instance, and its sign.
    fn block(&self, address: &Address, instance: u32, tables: &[u32]) -> (u32, bool) {
        let (area, index, negated) = vm::place(address, instance, tables);
        (self.spaces.start(area, self.initial) + index, negated)
    }
}
