//! What an instance keeps for tangents: blocks of all areas, coefficients, and the rows that its directions reach.

use std::sync::Arc;

use hyd_system::{Along, Direction, DirectionError, Place as ValuePlace};

use super::code::TangentCode;
use super::model::{PARTS, Part, TangentModel};
use super::rows::{CHUNK, Rows, Spaces};
use super::sweep::Sweep;
use crate::instance::Instance;
use crate::loaded::Loaded;
use crate::model::Model;
use crate::program::{Area, Place, TIME};
use crate::routines::Signed;
use crate::vm::Registers;

/// Tangents of one instance for chosen directions.
#[derive(Clone, Debug)]
pub(crate) struct TangentMemory {
    pub(super) code: Arc<TangentCode>,
    /// What is varied.
    pub(super) directions: Vec<Direction>,
    /// Number of directions.
    pub(super) width: usize,
    /// Derivatives, `width` per place, and some room behind them.
    pub(super) blocks: Vec<f64>,
    pub(super) coefficients: [Vec<f64>; PARTS],
    pub(super) registers: Registers,
    /// Block and direction of what is varied, ascending.
    pub(super) seeds: Vec<(u32, u32)>,
    pub(super) rows: ActiveRows,
    pub(super) sweep: Sweep,
    /// Derivatives of discrete variables before a pass, and before a round of it.
    pub(super) before: Vec<f64>,
    pub(super) last: Vec<f64>,
    /// Derivatives of the values that inputs were given; empty where nobody has said any.
    given: Vec<f64>,
    /// Outputs that are looked at, if not all.
    wanted: Option<Vec<u32>>,
}

/// The rows that the directions reach.
#[derive(Clone, Debug, Default)]
pub(super) struct ActiveRows {
    pub(super) bind: Rows,
    pub(super) initial_assign: Rows,
    pub(super) initial_residual: Rows,
    /// All assigned variables, those that residuals need, those that root functions need.
    pub(super) assign: Rows,
    pub(super) for_residual: Rows,
    pub(super) for_roots: Rows,
    /// Those that sources of delays and delay times need.
    pub(super) for_delays: Rows,
    /// Those that the outputs need that are looked at.
    pub(super) for_outputs: Rows,
    pub(super) residual: Rows,
    /// The same where time and unknowns are held.
    pub(super) held_assign: Rows,
    pub(super) held_residual: Rows,
    pub(super) roots: Rows,
    pub(super) instants: Rows,
    pub(super) discrete: Rows,
    pub(super) reinits: Rows,
}

impl TangentMemory {
    /// Memory for these directions.
    ///
    /// # Errors
    /// Position of the direction that is refused, and why.
    pub(super) fn new(loaded: &Loaded, directions: &[Direction]) -> Result<Self, (usize, DirectionError)> {
        let code = loaded.derivatives.code(&loaded.model).map_err(|reason| (0, DirectionError::Unsupported(reason)))?;
        let tangents = &code.model;
        let mut seeds = Vec::new();
        for (k, &direction) in directions.iter().enumerate() {
            if let Some(block) = seed(loaded, tangents, direction).map_err(|error| (k, error))? {
                seeds.push((block, k as u32));
            }
        }
        seeds.sort_unstable();
        let width = directions.len();
        let discrete = loaded.model.area.discrete.len() * width;
        let (rows, reached) = active_rows(&loaded.model, tangents, &seeds);
        let sweep = Sweep::new(loaded.derivatives.sweep(tangents, &reached), &reached);
        Ok(Self {
            directions: directions.to_vec(),
            width,
            blocks: vec![0.0; tangents.spaces.length as usize * width + CHUNK],
            coefficients: std::array::from_fn(|part| tangents.stages[part].coefficients.clone()),
            registers: code.engine.registers(),
            rows,
            sweep,
            seeds,
            before: vec![0.0; discrete],
            last: vec![0.0; discrete],
            given: Vec::new(),
            wanted: None,
            code,
        })
    }

    /// Where the blocks of each area begin.
    pub(super) fn spaces(&self) -> Spaces {
        self.code.model.spaces
    }

    /// Takes over the derivatives of the values that inputs were given.
    pub(super) fn give_inputs(&mut self, values: &[f64]) {
        self.given.clear();
        self.given.extend_from_slice(values);
    }

    /// Forgets them.
    pub(super) fn forget_inputs(&mut self) {
        self.given.clear();
    }

    /// Puts the derivatives of given inputs in their place, where there are some; the time is held.
    pub(super) fn load_inputs(&mut self, first: u32) {
        let given = std::mem::take(&mut self.given);
        if !given.is_empty() {
            self.put(first, &given);
        }
        self.given = given;
    }

    /// Takes over the derivatives of time, unknowns and rates; recorded inputs, at the time of the instance, move with time.
    pub(super) fn load(&mut self, along: Along<'_>, instance: &Instance) {
        self.put(TIME, along.t);
        let area = &instance.loaded.model.area;
        for (k, (value, rate)) in area.inputs.clone().zip(area.input_rates.clone()).enumerate() {
            let (slope, curvature) = instance.input_slope(k);
            for (index, factor) in [(value, slope), (rate, curvature)] {
                let first = index as usize * self.width;
                let block = self.blocks[first..first + self.width].iter_mut();
                block.zip(along.t).for_each(|(to, dt)| *to = factor * dt);
            }
        }
        let first = area.inputs.start as usize * self.width;
        for (to, given) in self.blocks[first..].iter_mut().zip(&self.given) {
            *to += given;
        }
        let spaces = self.spaces();
        self.put(spaces.start(Area::Unknown, false), along.y);
        self.put(spaces.start(Area::Rate, false), along.yp);
    }

    /// Leaves out what outputs need that nobody looks at; `assigned`: number of assigned variables among them, which come first.
    pub(super) fn select_outputs(&mut self, wanted: Option<&[u32]>, assigned: u32) {
        if self.wanted.as_deref() == wanted {
            return;
        }
        self.wanted = wanted.map(<[u32]>::to_vec);
        self.rows.for_outputs = match wanted {
            None => self.rows.assign.clone(),
            Some(wanted) => {
                let work = self.spaces().start(Area::Work, false);
                let mut marked = vec![false; self.spaces().length as usize];
                wanted.iter().filter(|k| **k < assigned).for_each(|k| marked[(work + k) as usize] = true);
                self.rows.assign.needed(&mut marked)
            }
        };
    }

    /// Writes blocks from a position on.
    pub(super) fn put(&mut self, first: u32, values: &[f64]) {
        let start = first as usize * self.width;
        self.blocks[start..start + values.len()].copy_from_slice(values);
    }

    /// Reads the blocks of wanted outputs, the first of which stands at a position.
    pub(super) fn get_wanted(&self, first: u32, out: &mut [f64]) {
        let Some(wanted) = &self.wanted else { return self.get(first, out) };
        let (start, width) = (first as usize * self.width, self.width);
        for block in wanted.iter().map(|&k| k as usize * width..(k as usize + 1) * width) {
            if let Some(out) = out.get_mut(block.clone()) {
                out.copy_from_slice(&self.blocks[start + block.start..start + block.end]);
            }
        }
    }

    /// Reads blocks from a position on.
    pub(super) fn get(&self, first: u32, out: &mut [f64]) {
        let start = first as usize * self.width;
        out.copy_from_slice(&self.blocks[start..start + out.len()]);
    }

    /// The block of a place of the simulation or of the initial system, into `out`.
    pub(super) fn signed(&self, (place, negated): Signed, initial: bool, out: &mut [f64]) {
        self.get(self.block(place, initial), out);
        if negated {
            out.iter_mut().for_each(|value| *value = -*value);
        }
    }

    /// Copies one block.
    pub(super) fn copy(&mut self, from: u32, to: u32) {
        let (from, to) = (from as usize * self.width, to as usize * self.width);
        self.blocks.copy_within(from..from + self.width, to);
    }

    /// The block of a place.
    pub(super) fn block(&self, place: Place, initial: bool) -> u32 {
        self.spaces().start(place.area, initial) + place.index
    }

    /// The chain rule over rows with the coefficients of a stage; seeds are added if `seeded`.
    pub(super) fn chain(&mut self, part: Part, rows: fn(&ActiveRows) -> &Rows, seeded: bool) {
        let coefficients = &self.coefficients[part as usize];
        let seeds = if seeded { self.seeds.as_slice() } else { &[] };
        let add = |to: u32, from: usize, sum: &mut [f64]| {
            if !seeds.is_empty() {
                let first = seeds.partition_point(|&(block, _)| block < to);
                for &(_, k) in seeds[first..].iter().take_while(|&&(block, _)| block == to) {
                    if let Some(value) = (k as usize).checked_sub(from).and_then(|k| sum.get_mut(k)) {
                        *value += 1.0;
                    }
                }
            }
        };
        rows(&self.rows).apply(coefficients, &mut self.blocks, self.width, add);
    }
}

impl TangentModel {
    /// The data that anything that can be varied reaches.
    pub fn reachable(&self, model: &Model) -> Vec<bool> {
        let given = model.area.given.iter().zip(model.area.parameters.clone());
        let parameters = given.filter_map(|(given, block)| given.map(|_| block));
        let starts = self.starts.iter().copied().flatten();
        let mut seeds: Vec<(u32, u32)> = parameters.chain(starts).map(|block| (block, 0)).collect();
        seeds.sort_unstable();
        active_rows(model, self, &seeds).1
    }
}

/// The block in the data area that a direction varies.
fn seed(loaded: &Loaded, tangents: &TangentModel, direction: Direction) -> Result<Option<u32>, DirectionError> {
    let area = &loaded.model.area;
    match direction {
        Direction::None => Ok(None),
        Direction::Parameter(k) => match area.given.get(k as usize) {
            Some(Some(_)) => Ok(Some(area.parameters.start + k)),
            _ => Err(DirectionError::NotSettable),
        },
        Direction::Start(variable, element) => {
            start_place(loaded, tangents, variable, element).map(Some).ok_or(DirectionError::NoStart)
        }
    }
}

/// Where the start value stands that an unknown or discrete variable begins with.
fn start_place(loaded: &Loaded, tangents: &TangentModel, variable: u32, element: u32) -> Option<u32> {
    let tables = &loaded.model.tables;
    let source = *tables.variables.get(variable as usize)?.sources.get(element as usize)?;
    let ValuePlace::Output(position) = source.place else { return None };
    tangents.starts.get(position as usize).copied().flatten()
}

/// The rows that directions reach, and the data that they do.
fn active_rows(model: &Model, tangents: &TangentModel, seeds: &[(u32, u32)]) -> (ActiveRows, Vec<bool>) {
    let (layout, spaces) = (&model.area, tangents.spaces);
    let mut active = vec![false; spaces.length as usize];
    seeds.iter().for_each(|&(block, _)| active[block as usize] = true);
    let with_time = || std::iter::once(TIME).chain(layout.inputs.clone()).chain(layout.input_rates.clone());
    with_time().for_each(|index| active[index as usize] = true);
    let unknowns = spaces.start(Area::Unknown, false)..spaces.start(Area::Work, false);
    let initial = spaces.start(Area::Unknown, true)..spaces.start(Area::Work, true);
    // What changes at events follows the instants of events.
    let discrete = layout.discrete.clone().chain(layout.pre.clone());
    let continuous = layout.pre_continuous.iter().map(|&(_, index)| index);
    let delayed = layout.delayed.clone().chain(layout.delayed_rates.clone());
    for block in unknowns.chain(initial).chain(discrete).chain(continuous).chain(delayed) {
        active[block as usize] = true;
    }
    let rows = |part: Part| &tangents.stage(part).rows;
    let bind = rows(Part::Bind).active(&mut active);
    let initial_assign = rows(Part::InitialAssign).active(&mut active);
    let initial_residual = rows(Part::InitialResidual).filtered(&active);
    for &(_, to) in &model.initial.values {
        active[to as usize] = true;
    }
    let mut data: Vec<bool> = active[..layout.length as usize].to_vec();
    with_time().for_each(|index| data[index as usize] = false);
    let mut held = vec![false; active.len()];
    held[..data.len()].copy_from_slice(&data);
    let held_assign = rows(Part::Assign).active(&mut held);
    let held_residual = rows(Part::Residual).filtered(&held);
    let assign = rows(Part::Assign).active(&mut active);
    let residual = rows(Part::Residual).filtered(&active);
    let roots = rows(Part::Roots).filtered(&active);
    let needed = |rows: &Rows| {
        let mut marked = vec![false; active.len()];
        rows.mark_read(&mut marked);
        assign.needed(&mut marked)
    };
    let held_assign = {
        let mut marked = vec![false; active.len()];
        held_residual.mark_read(&mut marked);
        held_assign.needed(&mut marked)
    };
    let for_delays = {
        let mut marked = vec![false; active.len()];
        for (place, _) in model.delays.iter().flat_map(|site| [site.source, site.time]) {
            marked[(spaces.start(place.area, false) + place.index) as usize] = true;
        }
        assign.needed(&mut marked)
    };
    let rows = ActiveRows {
        for_delays,
        for_outputs: assign.clone(),
        for_residual: needed(&residual),
        for_roots: needed(&roots),
        instants: rows(Part::Instants).filtered(&active),
        discrete: rows(Part::Discrete).filtered(&active),
        reinits: rows(Part::Reinits).filtered(&active),
        bind,
        initial_assign,
        initial_residual,
        assign,
        residual,
        held_assign,
        held_residual,
        roots,
    };
    (rows, data)
}
