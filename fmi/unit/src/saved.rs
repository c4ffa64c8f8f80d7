//! A state of a unit as bytes, and back.
//!
//! What the model remembers, what its solution needs, and where the unit stands; the same unit goes on from it with the same bits.  In a
//! co-simulation that is all that the solver holds: the past of its polynomials, its matrices as they were factored last, what it knows of
//! relations and delays.  A sum over the bytes keeps damaged ones out, whose lists would not fit each other.

use crate::core::{Core, Engine, Kind, Mode, Setup};
use crate::fault::Fault;
use hyd_runtime::{Exchange, Onward};
use serde::{Deserialize, Serialize};

/// First bytes, with the version of the layout.
const MAGIC: [u8; 8] = *b"hydunit4";

fn damaged() -> Fault {
    Fault::usage("the bytes are not a state of this unit")
}

/// What a co-simulation has beside the model: as the fields of [`Core`].
#[derive(Serialize, Deserialize)]
struct Stepping<S> {
    solver: Option<S>,
    /// Solver, and the model as bytes.
    unsettled: Option<(S, Vec<u8>)>,
    disturbed: bool,
    sloped: Vec<bool>,
    waiting: bool,
    ended: Option<String>,
    told: usize,
    told_open: bool,
}

/// Where the unit stands, whoever integrates.
#[derive(Serialize, Deserialize)]
struct Place {
    mode: u8,
    start: f64,
    stop: Option<f64>,
    tolerance: Option<f64>,
    unstarted: bool,
    at: f64,
}

const MODES: [Mode; 5] = [Mode::Instantiated, Mode::Initialization, Mode::Event, Mode::Running, Mode::Terminated];

impl Core {
    /// # Errors
    /// None that is known: what the unit holds can be written.
    pub(crate) fn serialize(&self) -> Result<Vec<u8>, Fault> {
        let Setup { start, stop, tolerance } = self.setup;
        let mode = MODES.iter().position(|&mode| mode == self.mode).unwrap_or_default() as u8;
        let place = Place { mode, start, stop, tolerance, unstarted: self.unstarted, at: self.at };
        let mut body = packed(&place)?;
        match &self.engine {
            Engine::Exchange(exchange) => body.extend(packed(&exchange.save())?),
            Engine::None if self.kind == Kind::Exchange => body.extend(packed(&Vec::<f64>::new())?),
            engine => {
                let model = |system: &hyd_payload::Instance| {
                    let mut out = Vec::new();
                    system.save(&mut out);
                    out
                };
                let unsettled = self.unsettled.as_ref().map(|(solver, system)| (&**solver, model(system)));
                body.extend(packed(&Stepping::<&Onward> {
                    solver: match engine {
                        Engine::Stepping(solver) => Some(solver),
                        _ => None,
                    },
                    unsettled,
                    disturbed: self.disturbed,
                    sloped: self.sloped.clone(),
                    waiting: self.waiting,
                    ended: self.ended.clone(),
                    told: self.told,
                    told_open: self.told_open,
                })?);
            }
        }
        self.system.save(&mut body);
        let token = [self.known.payload, u64::from(self.kind == Kind::Stepping), sum_of(&body)];
        Ok([MAGIC.to_vec(), token.iter().flat_map(|word| word.to_le_bytes()).collect(), body].concat())
    }

    /// The unit as it was when a state was kept.
    ///
    /// # Errors
    /// The state is one of another unit, or of the same in another kind of use.
    pub(crate) fn take_state(&mut self, kept: &Core) -> Result<(), Fault> {
        if self.known.payload != kept.known.payload || (self.kind, self.manners) != (kept.kind, kept.manners) {
            return Err(Fault::usage("the state is not one of this instance"));
        }
        self.clone_from(kept);
        Ok(())
    }

    /// A state that goes on from bytes; `self` is as it was.
    ///
    /// # Errors
    /// They are not of this unit.
    pub(crate) fn deserialize(&self, bytes: &[u8]) -> Result<Core, Fault> {
        let mut rest = bytes.strip_prefix(&MAGIC).ok_or_else(damaged)?;
        let known = [self.known.payload, u64::from(self.kind == Kind::Stepping)];
        if known.iter().any(|known| word(&mut rest).ok() != Some(*known)) || word(&mut rest)? != sum_of(rest) {
            return Err(damaged());
        }
        let place: Place = unpacked(&mut rest)?;
        let mut core = self.clone();
        core.mode = *MODES.get(usize::from(place.mode)).ok_or_else(damaged)?;
        core.setup = Setup { start: place.start, stop: place.stop, tolerance: place.tolerance };
        (core.unstarted, core.at) = (place.unstarted, place.at);
        (core.fresh, core.parameters_set, core.reports) = (false, true, Vec::new());
        match self.kind {
            Kind::Exchange => {
                let numbers: Vec<f64> = unpacked(&mut rest)?;
                core.system.restore(&mut rest).map_err(|_| damaged())?;
                core.sloped.fill(false);
                (core.disturbed, core.waiting, core.unsettled, core.ended) = (false, false, None, None);
                core.engine = match numbers.is_empty() {
                    true => Engine::None,
                    false => {
                        let mut exchange = Box::new(Exchange::new(core.structure(), core.system.is_affine()));
                        if !exchange.restore(&mut core.system, &numbers) {
                            return Err(damaged());
                        }
                        Engine::Exchange(exchange)
                    }
                };
            }
            Kind::Stepping => {
                let own: Stepping<Onward> = unpacked(&mut rest)?;
                core.system.restore(&mut rest).map_err(|_| damaged())?;
                core.unsettled = match own.unsettled {
                    None => None,
                    Some((solver, model)) => {
                        let mut system = core.system.clone();
                        system.restore(&mut model.as_slice()).map_err(|_| damaged())?;
                        Some((Box::new(solver), system))
                    }
                };
                core.engine = own.solver.map_or(Engine::None, |solver| Engine::Stepping(Box::new(solver)));
                (core.disturbed, core.sloped, core.waiting) = (own.disturbed, own.sloped, own.waiting);
                (core.ended, core.told, core.told_open) = (own.ended, own.told, own.told_open);
            }
        }
        if !rest.is_empty() {
            return Err(damaged());
        }
        Ok(core)
    }
}

fn packed(value: &impl Serialize) -> Result<Vec<u8>, Fault> {
    postcard::to_allocvec(value).map_err(|error| Fault::usage(format!("the state cannot be written: {error}")))
}

/// A value from the beginning of the bytes, which is taken from them.
fn unpacked<'a, T: Deserialize<'a>>(rest: &mut &'a [u8]) -> Result<T, Fault> {
    let (value, after) = postcard::take_from_bytes(rest).map_err(|_| damaged())?;
    *rest = after;
    Ok(value)
}

/// The sum of Fowler, Noll and Vo (FNV-1a, 64 bits).
fn sum_of(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |sum, &byte| (sum ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

fn word(rest: &mut &[u8]) -> Result<u64, Fault> {
    let (word, after) = rest.split_first_chunk::<8>().ok_or_else(damaged)?;
    *rest = after;
    Ok(u64::from_le_bytes(*word))
}
