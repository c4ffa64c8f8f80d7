//! A state of a model exchange as bytes, and back.
//!
//! What the model remembers, what its solution needs, and where the unit stands; the same unit goes on from it with the same bits.

use crate::core::{Core, Engine, Kind, Mode, Setup};
use crate::fault::Fault;
use hyd_runtime::Exchange;

/// First bytes, with the version of the layout.
const MAGIC: [u8; 8] = *b"hydunit2";

fn damaged() -> Fault {
    Fault::usage("the bytes are not a state of this unit")
}

impl Core {
    /// # Errors
    /// The state of a co-simulation.
    pub(crate) fn serialize(&self) -> Result<Vec<u8>, Fault> {
        let numbers = match (&self.engine, self.kind) {
            (Engine::Exchange(exchange), _) => exchange.save(),
            (Engine::None, Kind::Exchange) => Vec::new(),
            _ => return Err(Fault::usage("states of a co-simulation can be kept, but not be written as bytes")),
        };
        let flag = |flag: bool| f64::from(u8::from(flag));
        let mode = match self.mode {
            Mode::Instantiated => 0.0,
            Mode::Initialization => 1.0,
            Mode::Event => 2.0,
            Mode::Running => 3.0,
            Mode::Terminated => 4.0,
        };
        let Setup { start, stop, tolerance } = self.setup;
        let own = [mode, start, stop.unwrap_or(f64::NAN), tolerance.unwrap_or(f64::NAN), flag(self.unstarted), self.at];
        let token = hyd_token(self);
        let mut out = MAGIC.to_vec();
        out.extend_from_slice(&token.to_le_bytes());
        for list in [&own[..], &numbers] {
            out.extend_from_slice(&(list.len() as u64).to_le_bytes());
            list.iter().for_each(|value| out.extend_from_slice(&value.to_le_bytes()));
        }
        self.system.save(&mut out);
        Ok(out)
    }

    /// The unit as it was when a state was kept.
    ///
    /// # Errors
    /// The state is one of another unit, or of the same in another kind of use.
    pub(crate) fn take_state(&mut self, kept: &Core) -> Result<(), Fault> {
        if hyd_token(self) != hyd_token(kept) || (self.kind, self.manners) != (kept.kind, kept.manners) {
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
        if word(&mut rest)? != hyd_token(self).to_le_bytes() || self.kind != Kind::Exchange {
            return Err(damaged());
        }
        let (own, numbers) = (list(&mut rest)?, list(&mut rest)?);
        let [mode, start, stop, tolerance, unstarted, at] = own[..] else { return Err(damaged()) };
        let mut core = self.clone();
        core.mode = match mode {
            0.0 => Mode::Instantiated,
            1.0 => Mode::Initialization,
            2.0 => Mode::Event,
            3.0 => Mode::Running,
            4.0 => Mode::Terminated,
            _ => return Err(damaged()),
        };
        let known = |value: f64| (!value.is_nan()).then_some(value);
        core.setup = Setup { start, stop: known(stop), tolerance: known(tolerance) };
        (core.unstarted, core.at) = (unstarted != 0.0, at);
        core.system.restore(&mut rest).map_err(|_| damaged())?;
        if !rest.is_empty() {
            return Err(damaged());
        }
        (core.fresh, core.disturbed, core.waiting) = (false, false, false);
        core.parameters_set = true;
        core.unsettled = None;
        core.sloped.fill(false);
        (core.ended, core.reports) = (None, Vec::new());
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
        Ok(core)
    }
}

/// A number by which the state knows its model.
fn hyd_token(core: &Core) -> u64 {
    core.known.loaded.model.identity.sources
}

fn word(rest: &mut &[u8]) -> Result<[u8; 8], Fault> {
    let (word, after) = rest.split_first_chunk::<8>().ok_or_else(damaged)?;
    *rest = after;
    Ok(*word)
}

fn list(rest: &mut &[u8]) -> Result<Vec<f64>, Fault> {
    let count = u64::from_le_bytes(word(rest)?);
    if count > rest.len() as u64 / 8 {
        return Err(damaged());
    }
    (0..count).map(|_| word(rest).map(f64::from_le_bytes)).collect()
}
