//! Derivatives of one unit along directions, by twins of it ([`crate::twins`]); their way through events is in [`events`].
//!
//! A direction that moves a parameter of the unit has a twin with that parameter a step `h` away.  Where time, states and inputs move by
//! `dt`, `dx`, `dw`, the twin is asked at `t + h dt`, `x + h dx`, `w + h dw`, so that one answer has all that the direction does; where they
//! are held it is asked where its likeness is.  At an event the displacements are total ones along the moving event, so that the twin goes
//! through its own event at its own instant: what becomes of discrete variables stands in it from then on, and its states tell what
//! `reinit` does (the saltation formula, see `runtime/src/sensitivity/event.rs`, in differences).  Where a twin and its likeness do not
//! go through the same, nothing is known: every such case ends in a sentence, and who asked takes differences of whole runs.
//!
//! Steps are a millionth of what they move: rounding and what a unit leaves of its own iterations (1e-12 in units of this program) are a millionth
//! of a derivative then, and so is what is not linear.  An indicator at a moved event is off by the square of that.

mod events;

use hyd_system::{DaeSystem, Direction, Instants, Place};

use super::{Part, start::differs};
use crate::host::Refusal;
use crate::twins::{Apart, Call, LIKENESS};

/// Step of a twin, as a part of the parameter that it is apart by, and of what moves along a direction.
const STEP: f64 = 1e-6;
/// Times below this count as much (s), and steps of time are smaller than others by the second number, because few things change with the time
/// itself as slowly as a run lasts.
const TIME: (f64, f64) = (1e-3, 1e-3);
/// A step that stays for a run moves states and inputs by no more than this part of their largest or nominal values.
const FARTHEST: f64 = 1e-3;
/// Next events of a unit and its twin differ by less than this part of their time, else they are not the same event.
const NEXT: f64 = 1e-3;
/// Numbers of one unit that has not been disturbed differ by less, relative; and the start is looked at so far beside it.
const EQUAL: f64 = 1e-9;
/// The unit and its likeness differ by less than this part of their largest values.
const ALIKE: f64 = 1e-6;

/// A twin of a unit for one direction.
#[derive(Debug)]
struct Twin {
    number: u32,
    /// How far it is apart, in the unit of the direction; 0: not yet.
    step: f64,
    apart: Apart,
    /// Its next time event (s).
    next: f64,
    /// Derivatives of the states at the start.
    start: Vec<f64>,
}

/// The twins of one unit, and what they say.
#[derive(Debug, Default)]
pub(super) struct Twinned {
    /// Per direction.
    twins: Vec<Option<Twin>>,
    /// What the unit was given when the likeness was started.
    settled: Vec<f64>,
    /// The next time event of the unit (s).
    next: f64,
    /// Largest values so far of states, rates and what is watched.
    largest: Vec<f64>,
    /// Derivatives of the rates and of what is watched, block by block.
    pub(super) rates: Vec<f64>,
    pub(super) watched: Vec<f64>,
    calls: Vec<Call>,
    /// Per call: its direction, its step.
    steps: Vec<(usize, f64)>,
    inputs: Vec<f64>,
    states: Vec<f64>,
    found: Vec<f64>,
}

/// How time (per direction), states and what the unit is given (a block each) move.
#[derive(Clone, Copy)]
pub(super) struct Moved<'a> {
    pub(super) t: &'a [f64],
    pub(super) x: &'a [f64],
    pub(super) w: &'a [f64],
}

/// Why there is no derivative.
pub(super) enum Lost {
    /// The unit has no value there.
    Here,
    /// A sentence: nothing can be known in this run.
    Always(String),
}

fn said<T>(sentence: &str) -> Result<T, Lost> {
    Err(Lost::Always(sentence.to_string()))
}

pub(super) fn refused(refusal: Refusal) -> Lost {
    match refusal {
        Refusal::Discarded => Lost::Here,
        Refusal::Lost => Lost::Always("an instance of the unit with another parameter ends its process".to_string()),
    }
}

impl Twinned {
    /// Decides which directions have twins, by the derivatives of the parameters of the text (a block each).
    pub(super) fn plan(
        &mut self,
        part: &Part,
        directions: &[Direction],
        (parameters, by_parameters): (&[f64], &[f64]),
    ) -> Result<(), Lost> {
        let width = directions.len();
        let (n, values) = (part.x.len(), part.x.len() + part.watched.len());
        self.twins.clear();
        self.largest = vec![0.0; n + values];
        self.rates = vec![0.0; n * width];
        self.watched = vec![0.0; part.watched.len() * width];
        let mut number = LIKENESS;
        for (k, direction) in directions.iter().enumerate() {
            let slope = |source: &hyd_system::Source| match source.place {
                Place::Parameter(at) => {
                    let own = by_parameters[at as usize * width + k];
                    if source.negated { -own } else { own }
                }
                _ => 0.0,
            };
            let value = |source: &hyd_system::Source| match source.place {
                Place::Parameter(at) if source.negated => -parameters[at as usize],
                Place::Parameter(at) => parameters[at as usize],
                _ => 0.0,
            };
            // Position, value, slope, limits, size.
            let mut own = Vec::new();
            for (source, index, _) in &part.parameters {
                let slope = slope(source);
                if slope != 0.0 {
                    let known = part.unit.parameter_of(*index);
                    let Some((value, limits, nominal)) = known else {
                        return said("a parameter of the unit has numbers too coarse for differences");
                    };
                    own.push((*index, value, slope, limits, if value == 0.0 { nominal.abs() } else { value.abs() }));
                }
            }
            let of_parameters = own.len();
            for (source, position) in &part.starts {
                let (slope, value) = (slope(source), value(source));
                if slope != 0.0 {
                    let limits = (f64::NEG_INFINITY, f64::INFINITY);
                    own.push((*position, value, slope, limits, if value == 0.0 { 1.0 } else { value.abs() }));
                }
            }
            // Without a parameter of its own the unit sees a direction by what it is given.
            if *direction == Direction::None || own.is_empty() && part.gives.is_empty() {
                self.twins.push(None);
                continue;
            }
            let mut step =
                own.iter().map(|(_, _, slope, _, size)| STEP * size / slope.abs()).fold(f64::INFINITY, f64::min);
            let fits = |step: f64| {
                own.iter().all(|(_, v, slope, (low, high), _)| (*low..=*high).contains(&(v + step * slope)))
            };
            if own.is_empty() {
                // What moves the inputs only has hardly begun to do so at an early event: its own size says how far it may go.
                step = match *direction {
                    Direction::Parameter(at) => STEP * parameters[at as usize].abs(),
                    _ => 0.0,
                };
            } else if !fits(step) && fits(-step) {
                step = -step;
            }
            let mut moved: Vec<(usize, f64)> =
                own.iter().map(|(at, value, slope, ..)| (*at, value + step * slope)).collect();
            let starts = moved.split_off(of_parameters);
            number += 1;
            let apart = Apart { parameters: moved, starts };
            self.twins.push(Some(Twin { number, step, apart, next: f64::INFINITY, start: vec![0.0; n] }));
        }
        Ok(())
    }

    /// Starts likeness and twins with what the unit has been given at its start, moved by `w` (a block each) where that is known.  True if a
    /// derivative of a state at the start is not what it was before.
    pub(super) fn start(
        &mut self,
        part: &mut Part,
        (t0, w): (f64, Option<&[f64]>),
        width: usize,
    ) -> Result<bool, Lost> {
        let n = part.x.len();
        let indicators = part.unit.structure().roots;
        let (mut states, mut held, mut own_held) = (vec![0.0; n], vec![false; indicators], vec![false; indicators]);
        part.unit.held(&mut own_held);
        let before = self.probe(part, t0);
        self.settled.clone_from(&part.settled);
        self.next = part.unit.next;
        let mut inputs = vec![0.0; part.sites()];
        part.place_inputs(&self.settled, &mut inputs);
        let alike = part.unit.start_twin(LIKENESS, (&Apart::default(), &inputs), (&mut states, &mut held));
        let alike = alike.map_err(refused)?;
        let start = part.unit.start().to_vec();
        if states.iter().zip(&start).any(|(a, b)| differs(*a, *b)) || held != own_held {
            return said("a second instance of the unit starts otherwise than the first one");
        }
        let mut is_other = false;
        for (k, twin) in self.twins.iter_mut().enumerate() {
            let Some(twin) = twin else { continue };
            let moves = |j: usize| w.map_or(0.0, |w| w[j * width + k]);
            let is_moved = (0..self.settled.len()).any(|j| moves(j) != 0.0);
            if twin.step == 0.0 && is_moved {
                let size = |j: usize| {
                    let nominal = part.nominals.1[j].abs();
                    STEP * if self.settled[j] == 0.0 { nominal } else { self.settled[j].abs() } / moves(j).abs()
                };
                twin.step =
                    (0..self.settled.len()).filter(|&j| moves(j) != 0.0).map(size).fold(f64::INFINITY, f64::min);
            }
            let given: Vec<f64> = self.settled.iter().enumerate().map(|(j, own)| own + twin.step * moves(j)).collect();
            part.place_inputs(&given, &mut inputs);
            let update = part.unit.start_twin(twin.number, (&twin.apart, &inputs), (&mut states, &mut held));
            let update = update.map_err(refused)?;
            if held != own_held || update.terminate != alike.terminate || !same_next(t0, (self.next, update.next)) {
                return said("a relation of the unit at the start depends on a parameter");
            }
            twin.next = update.next;
            for ((slope, state), own) in twin.start.iter_mut().zip(&states).zip(&start) {
                let new = if twin.step == 0.0 { 0.0 } else { (state - own) / twin.step };
                is_other |= (new - *slope).abs() > ALIKE * new.abs().max(slope.abs());
                *slope = new;
            }
        }
        if !agree(&before, &self.probe(part, t0)) {
            return said("instances of the unit in one process disturb each other");
        }
        Ok(is_other)
    }

    /// What the first instance says near its start.
    fn probe(&self, part: &mut Part, t0: f64) -> Vec<f64> {
        let near: Vec<f64> = part.unit.start().iter().map(|own| own * (1.0 + EQUAL)).collect();
        let given = part.settled.clone();
        super::give(&mut part.unit, &part.gives, &given);
        let mut found = vec![0.0; part.rates.len() + part.watched.len()];
        let (rates, watched) = found.split_at_mut(part.rates.len());
        part.unit.first_one(|unit| unit.watch(t0, &near, rates, watched));
        found
    }

    /// Derivatives of the states at the start, a block each.
    pub(super) fn starts(&self, width: usize, out: &mut [f64]) {
        out.fill(0.0);
        for (k, twin) in self.twins.iter().enumerate() {
            let Some(twin) = twin else { continue };
            out.chunks_exact_mut(width).zip(&twin.start).for_each(|(block, slope)| block[k] = *slope);
        }
    }

    /// What the unit was given when its twins were started.
    pub(super) fn is_started_with(&self, settled: &[f64]) -> bool {
        self.settled == settled
    }

    /// Derivatives of rates and of what is watched at a point, into `rates` and `watched`: along `moved`, or with time, states and inputs held.
    /// `passed`: nobody asks for anything before this point any more; `all`: what is watched is wanted, too.
    pub(super) fn derive(
        &mut self,
        part: &mut Part,
        (t, unknowns): (f64, &[f64]),
        moved: Option<Moved<'_>>,
        (width, passed, all): (usize, bool, bool),
    ) -> Result<(), Lost> {
        let n = part.x.len();
        let values = if all { n + part.watched.len() } else { n };
        self.note_states(&unknowns[part.x.clone()]);
        self.calls.clear();
        self.steps.clear();
        self.inputs.clear();
        self.states.clear();
        self.call(part, (t, unknowns), None, (LIKENESS, passed, 0, 0.0), width);
        for k in 0..width {
            let own = self.twins[k].as_ref();
            let (number, step) = own.map_or((LIKENESS, 0.0), |twin| (twin.number, twin.step));
            let step = match moved {
                Some(moved) if step == 0.0 => self.step_along(part, (t, unknowns), moved, (k, width)),
                Some(moved) => {
                    self.is_small(part, unknowns, moved, (k, width, step))?;
                    step
                }
                None => step,
            };
            let completed = passed && number != LIKENESS;
            if step != 0.0 || completed {
                self.call(part, (t, unknowns), moved, (number, completed, k, step), width);
            }
        }
        self.rates.fill(0.0);
        self.watched.fill(0.0);
        self.found.resize(self.calls.len() * values, 0.0);
        let asked = part.unit.watch_twins(&self.calls, (&self.inputs[..], &self.states[..]), &mut self.found);
        if asked.map_err(refused)? {
            return said("the unit asks for an event at a step");
        }
        let (base, others) = self.found.split_at(values);
        for (largest, value) in self.largest[n..].iter_mut().zip(base) {
            *largest = largest.max(value.abs());
        }
        for (&(k, step), other) in self.steps[1..].iter().zip(others.chunks_exact(values.max(1))) {
            if step == 0.0 {
                continue;
            }
            let slopes = other.iter().zip(base).map(|(other, base)| (other - base) / step);
            let blocks = self.rates.chunks_exact_mut(width).chain(self.watched.chunks_exact_mut(width));
            blocks.zip(slopes).for_each(|(block, slope)| block[k] = slope);
        }
        Ok(())
    }

    /// A twin's step moves what its unit is asked at by no more than a small part of its size, else differences of its answers say nothing of derivatives.
    fn is_small(
        &self,
        part: &Part,
        unknowns: &[f64],
        moved: Moved<'_>,
        (k, width, step): (usize, usize, f64),
    ) -> Result<(), Lost> {
        let mut nominals = vec![0.0; part.x.len()];
        part.unit.nominals(&mut nominals);
        let states = self.largest.iter().zip(&nominals).map(|(largest, nominal)| largest.max(nominal.abs()));
        let given = unknowns[part.w.clone()].iter().zip(&part.nominals.1);
        let given = given.map(|(value, nominal)| value.abs().max(nominal.abs()));
        let slopes = moved.x.chunks_exact(width).chain(moved.w.chunks_exact(width)).map(|block| block[k]);
        if states.chain(given).zip(slopes).all(|(size, slope)| (step * slope).abs() <= FARTHEST * size) {
            return Ok(());
        }
        said("a step of a parameter moves the unit too far for differences to give its derivatives")
    }

    /// Adds a question to the list.
    fn call(
        &mut self,
        part: &Part,
        (t, unknowns): (f64, &[f64]),
        moved: Option<Moved<'_>>,
        (twin, completed, k, step): (u32, bool, usize, f64),
        width: usize,
    ) {
        let (first, sites) = (self.inputs.len(), part.sites());
        self.inputs.resize(first + sites, 0.0);
        let shift = |list: Option<&[f64]>, j: usize| list.map_or(0.0, |list| step * list[j * width + k]);
        let given = &unknowns[part.w.clone()];
        for (j, &(_, site, _)) in part.gives.iter().enumerate() {
            self.inputs[first + site] = given[j] + shift(moved.map(|own| own.w), j);
        }
        let states = unknowns[part.x.clone()].iter().enumerate();
        self.states.extend(states.map(|(j, own)| own + shift(moved.map(|own| own.x), j)));
        let t = t + moved.map_or(0.0, |own| step * own.t[k]);
        self.calls.push(Call { twin, completed, t });
        self.steps.push((k, step));
    }

    fn note_states(&mut self, states: &[f64]) {
        self.largest.iter_mut().zip(states).for_each(|(largest, value)| *largest = largest.max(value.abs()));
    }

    /// A step along a direction that moves nothing of the unit by more than a millionth of its size; 0 where nothing moves.
    fn step_along(
        &self,
        part: &Part,
        (t, unknowns): (f64, &[f64]),
        moved: Moved<'_>,
        (k, width): (usize, usize),
    ) -> f64 {
        let mut step = f64::INFINITY;
        let mut limit = |size: f64, slope: f64| {
            if slope != 0.0 {
                step = step.min(STEP * size / slope.abs());
            }
        };
        for (j, &largest) in self.largest[..part.x.len()].iter().enumerate() {
            limit(if largest == 0.0 { 1.0 } else { largest }, moved.x[j * width + k]);
        }
        for (j, value) in unknowns[part.w.clone()].iter().enumerate() {
            let nominal = part.nominals.1[j].abs();
            limit(if *value == 0.0 { nominal } else { value.abs() }, moved.w[j * width + k]);
        }
        limit(TIME.1 * t.abs().max(TIME.0), moved.t[k]);
        if step.is_finite() { step } else { 0.0 }
    }

    /// Derivatives of the event indicators along `moved`, a block each.
    pub(super) fn indicators(
        &mut self,
        part: &mut Part,
        at: (f64, &[f64]),
        moved: Moved<'_>,
        (width, out): (usize, &mut [f64]),
    ) -> Result<(), Lost> {
        let count = part.unit.structure().roots;
        out.fill(0.0);
        if count == 0 {
            return Ok(());
        }
        let (mut base, mut other) = (vec![0.0; count], vec![0.0; count]);
        for k in 0..=width {
            self.inputs.clear();
            self.states.clear();
            self.calls.clear();
            self.steps.clear();
            if k == 0 {
                self.call(part, at, None, (LIKENESS, false, 0, 0.0), width);
                part.unit.twin_indicators(self.calls[0], (&self.inputs, &self.states), &mut base).map_err(refused)?;
                continue;
            }
            let k = k - 1;
            let own = self.twins[k].as_ref();
            let (number, step) = own.map_or((LIKENESS, 0.0), |twin| (twin.number, twin.step));
            let step = if step == 0.0 {
                self.step_along(part, at, moved, (k, width))
            } else {
                self.is_small(part, at.1, moved, (k, width, step))?;
                step
            };
            if step == 0.0 {
                continue;
            }
            self.call(part, at, Some(moved), (number, false, k, step), width);
            part.unit.twin_indicators(self.calls[0], (&self.inputs, &self.states), &mut other).map_err(refused)?;
            for ((block, other), base) in out.chunks_exact_mut(width).zip(&other).zip(&base) {
                block[k] = (other - base) / step;
            }
        }
        Ok(())
    }

    /// True if a time event of the unit is due.
    pub(super) fn is_due(&self, t: f64, instants: Instants) -> bool {
        self.next.is_finite() && instants.has_come(self.next, t)
    }

    /// Derivatives of the instant of the time event that is due.
    pub(super) fn instant(&self, out: &mut [f64]) {
        for (out, twin) in out.iter_mut().zip(&self.twins) {
            let apart = twin.as_ref().filter(|twin| twin.step != 0.0);
            *out = apart.map_or(0.0, |twin| (twin.next - self.next) / twin.step);
        }
    }
}

/// Two next time events are the same one, moved a little.
fn same_next(t: f64, (own, other): (f64, f64)) -> bool {
    own == other || (own - other).abs() <= NEXT * own.abs().max((own - t).abs())
}

fn differs_in_time(a: f64, b: f64) -> bool {
    a != b && differs(a, b)
}

/// All but equal; what is not a number is like itself.
fn agree(a: &[f64], b: &[f64]) -> bool {
    let size = a.iter().filter(|value| value.is_finite()).fold(0.0f64, |most, value| most.max(value.abs()));
    let close = |(a, b): (&f64, &f64)| {
        a.to_bits() == b.to_bits() || (a - b).abs() <= EQUAL * a.abs().max(ALIKE * size) || (a.is_nan() && b.is_nan())
    };
    a.iter().zip(b).all(close)
}

impl Part {
    /// Number of inputs of the unit.
    fn sites(&self) -> usize {
        self.unit.input_sites().0.len()
    }

    /// What is given, in the order of the unit's inputs.
    fn place_inputs(&self, given: &[f64], inputs: &mut [f64]) {
        for (&(_, site, _), &value) in self.gives.iter().zip(given) {
            inputs[site] = value;
        }
    }
}
