//! What a place of memory can change: structural dependencies between what is given, what is found and what events decide.
//!
//! A store depends on all that its expression reads, in every branch.  From the places that change at first, dependencies are followed
//! through assigned variables, residuals, relations and discrete equations until nothing new is reached; a residual passes them on to what it
//! determines.  Nothing is missing; what only a value rules out (`0*u`) may be there.  Delayed values depend on what is delayed.

use hyd_symbolic::{SlotId, slots};

use crate::model::Model;
use crate::program::{Address, Area, Kernel, Place, Program, RoutineId, TABLE_SIGN};

/// Where a store goes, and what it reads.
type Stored = (Address, Vec<Address>);

/// Where one routine stores what it reads elsewhere.
struct Flow {
    /// For each kernel its number of instances, and its stores.
    kernels: Vec<(u32, Vec<Stored>)>,
}

impl Flow {
    fn new(program: &Program, routine: RoutineId) -> Self {
        let of_kernel = |kernel: &Kernel| {
            let address = |slot: &SlotId| kernel.slots.get(slot.0 as usize).copied();
            let stores = kernel.stores.iter().map(|store| {
                let reads = slots(&program.arena, &[store.value]);
                (store.to, reads.iter().filter_map(address).collect())
            });
            (kernel.count, stores.collect())
        };
        Self { kernels: program.routines[routine].kernels.iter().map(of_kernel).collect() }
    }

    /// Places that are looked at in one pass.
    fn work(&self) -> u64 {
        let of_kernel = |(count, stores): &(u32, Vec<Stored>)| {
            u64::from(*count) * stores.iter().map(|(_, reads)| reads.len() as u64 + 1).sum::<u64>()
        };
        self.kernels.iter().map(of_kernel).sum()
    }
}

/// The place of an address in one instance.
fn place(program: &Program, address: Address, instance: u32) -> Option<Place> {
    match address {
        Address::Fixed { area, index, .. } => Some(Place { area, index }),
        Address::Affine { area, base, stride, .. } => {
            let index = i64::from(base) + i64::from(stride) * i64::from(instance);
            Some(Place { area, index: u32::try_from(index).ok()? })
        }
        Address::Table { area, start, signed } => {
            let entry = *program.tables.get((start + instance) as usize)?;
            Some(Place { area, index: if signed { entry & !TABLE_SIGN } else { entry } })
        }
    }
}

/// The flow of a model.
pub struct Reach<'a> {
    model: &'a Model,
    assign: Flow,
    residual: Flow,
    truths: Flow,
    discrete: Flow,
    /// For each residual the unknown that it determines, or whose rate.
    determined: Vec<Option<u32>>,
}

/// What is reached.
#[derive(Clone, Debug)]
pub struct Reached {
    /// By area and position.
    areas: [Vec<bool>; 4],
}

impl Reached {
    /// True if the place can change.
    pub fn holds(&self, place: Place) -> bool {
        self.areas.get(place.area as usize).and_then(|area| area.get(place.index as usize)).copied().unwrap_or(false)
    }

    /// Marks a place; true if that is new.
    fn mark(&mut self, place: Place) -> bool {
        let Some(area) = self.areas.get_mut(place.area as usize) else { return false };
        let index = place.index as usize;
        // Assigned variables that no result shows lie behind those that are shown.
        if index >= area.len() {
            area.resize(index + 1, false);
        }
        !std::mem::replace(&mut area[index], true)
    }
}

impl<'a> Reach<'a> {
    /// `row_of`: for each unknown the residual that determines it, or its rate where it is a state.
    pub fn new(model: &'a Model, row_of: &[usize]) -> Self {
        let flow = |routine| Flow::new(&model.program, routine);
        let (simulation, events) = (&model.routines.simulation, &model.routines.events);
        let mut determined = vec![None; model.structure.unknowns];
        for (unknown, &row) in row_of.iter().enumerate() {
            if let Some(own) = determined.get_mut(row) {
                *own = Some(unknown as u32);
            }
        }
        Self {
            model,
            assign: flow(simulation.assign),
            residual: flow(simulation.residual),
            truths: flow(events.truths),
            discrete: flow(events.discrete),
            determined,
        }
    }

    /// Places that are looked at to follow one beginning, at the least.
    pub fn work(&self) -> u64 {
        [&self.assign, &self.residual, &self.truths, &self.discrete].into_iter().map(Flow::work).sum()
    }

    /// All that can change where these places do.
    pub fn from(&self, begin: impl IntoIterator<Item = Place>) -> Reached {
        let (model, unknowns) = (self.model, self.model.structure.unknowns);
        let lengths = [model.area.length as usize, unknowns, unknowns, model.row.assigned as usize];
        let mut reached = Reached { areas: lengths.map(|length| vec![false; length]) };
        for place in begin {
            reached.mark(place);
        }
        let differential = &model.structure.differential;
        loop {
            let mut news = self.pass(&self.assign, &mut reached, |_| None);
            news |= self.pass(&self.residual, &mut reached, |row| {
                let index = self.determined.get(row as usize).copied().flatten()?;
                let area = if differential[index as usize] { Area::Rate } else { Area::Unknown };
                Some(Place { area, index })
            });
            news |= self.pass(&self.truths, &mut reached, |k| Some(Place::data(model.area.held.start + k)));
            news |= self.pass(&self.discrete, &mut reached, |_| None);
            news |= self.remembered(&mut reached);
            if !news {
                return reached;
            }
        }
    }

    /// Follows a routine once; `result` is the place that a result stands for.
    fn pass(&self, flow: &Flow, reached: &mut Reached, result: impl Fn(u32) -> Option<Place>) -> bool {
        let program = &self.model.program;
        let mut news = false;
        for (count, stores) in &flow.kernels {
            for instance in 0..*count {
                for (to, reads) in stores {
                    let at = |&address: &Address| place(program, address, instance);
                    if !reads.iter().filter_map(at).any(|own| reached.holds(own)) {
                        continue;
                    }
                    let to = place(program, *to, instance);
                    let to = to.and_then(|to| if to.area == Area::Out { result(to.index) } else { Some(to) });
                    news |= to.is_some_and(|to| reached.mark(to));
                }
            }
        }
        news
    }

    /// Values before an event, and delayed ones.
    fn remembered(&self, reached: &mut Reached) -> bool {
        let area = &self.model.area;
        let mut news = false;
        for (now, before) in area.discrete.clone().zip(area.pre.clone()) {
            news |= reached.holds(Place::data(now)) && reached.mark(Place::data(before));
        }
        for &(now, before) in &area.pre_continuous {
            news |= reached.holds(now) && reached.mark(Place::data(before));
        }
        for (k, site) in self.model.delays.iter().enumerate() {
            if [site.source, site.time].iter().any(|(own, _)| reached.holds(*own)) {
                for list in [&area.delayed, &area.delayed_rates] {
                    news |= list.start + (k as u32) < list.end && reached.mark(Place::data(list.start + k as u32));
                }
            }
        }
        news
    }
}
