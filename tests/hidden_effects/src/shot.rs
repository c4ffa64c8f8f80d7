//! One shot: rest, switch on, switch off, samples at given times.  Before the switch closes the machine is at rest, and rest is
//! computed, not integrated.  A sample at the instant of switching shows what has been switched.

use crate::contents::Contents;
use crate::drive::{Drive, SCALE, Shot, at};
use crate::integrator::{Failure, Integrator, N, State};
use crate::line::Waves;
use crate::machine::{Machine, Memory};

/// Error of a step in the scales of `drive::SCALE`.
pub const TOLERANCE: f64 = 1e-9;
/// Sizes of the channels, for the error of a lagging signal.
const SIGNAL_SCALE: [f64; 6] = [10.0, 1.0, 1e-4, 1e-2, 1e7, 1e7];

/// What the six channels show at `times` (ascending, s): u_C, i, x, y, p_R, p_0 in SI units.
pub fn run(machine: &Machine, shot: &Shot, times: &[f64], tolerance: f64) -> Result<Vec<[f64; 6]>, Failure> {
    let contents = Contents::of(machine);
    let (off, start) = (shot.trigger + shot.pulse, shot.trigger);
    let mut waves = machine.hidden.line.as_ref().map(|line| Waves::at_rest(line, machine.gaps.rho, start, shot.p_0));
    let mut scale = SCALE;
    if let Some((channel, _)) = machine.hidden.lag {
        scale[at::LAG] = SIGNAL_SCALE[channel];
        scale[at::LAG + 1] = SIGNAL_SCALE[channel];
    }
    match machine.hidden.memory {
        Some(Memory::Surge(_)) => scale[at::OWN] = scale[at::Y],
        Some(Memory::Pocket(_)) => scale[at::OWN] = scale[at::INLET],
        _ => {}
    }
    let rest = at_rest(machine, shot, &contents);
    let mut integrator = Integrator::new(start, rest, tolerance, scale);
    let mut rows = Vec::with_capacity(times.len());
    for &time in times {
        while integrator.time < time {
            let grid = waves.as_ref().map_or(f64::INFINITY, |waves| waves.time + waves.step);
            let switch = if integrator.time < off { off } else { f64::INFINITY };
            let next = time.min(grid).min(switch);
            let closed = integrator.time < off;
            let drive = Drive { machine, shot, contents: &contents, closed, waves: waves.as_ref() };
            integrator.advance(&drive, next)?;
            let accumulator = drive.accumulator(&integrator.state);
            if let Some(waves) = waves.as_mut()
                && next == grid
            {
                waves.advance(accumulator, integrator.state[at::INLET]);
            }
        }
        let closed = time >= start && time < off;
        let drive = Drive { machine, shot, contents: &contents, closed, waves: waves.as_ref() };
        rows.push(shown(&drive, &integrator.state));
    }
    Ok(rows)
}

fn shown(drive: &Drive, state: &State) -> [f64; 6] {
    let mut signals = drive.signals(state);
    if let Some((channel, _)) = drive.machine.hidden.lag {
        signals[channel] = state[at::LAG + usize::from(drive.machine.hidden.other_forms)];
    }
    signals
}

/// States at rest, the switch open and the capacitor charged.
fn at_rest(machine: &Machine, shot: &Shot, contents: &Contents) -> State {
    let mut state = [0.0; N];
    let pressure = resting_pressure(machine, shot);
    let (spool, valve, p_z) = (&machine.spool, &machine.valve, machine.chamber.p_z);
    let closing = spool.preload + spool.a_s0 * (shot.p_0 - p_z) - spool.a_sr * (pressure - p_z);
    state[at::CHARGE] = shot.u_0 * shot.capacity;
    state[at::X] = -closing / (spool.contact + spool.spring);
    state[at::Y] = -(valve.preload - valve.area * (pressure - p_z)) / (valve.k_seat + valve.spring);
    let ratio = contents.at_rest(pressure);
    let swept = valve.area * state[at::Y];
    match &machine.hidden.pipe {
        Some(pipe) => {
            state[at::NEAR] = ratio * pipe.near;
            state[at::FAR] = ratio * (machine.chamber.v_0 - pipe.near + swept);
        }
        None => {
            state[at::NEAR] = ratio * (machine.chamber.v_0 + swept);
            state[at::FAR] = 1.0;
        }
    }
    state[at::INLET] = shot.p_0;
    state[at::GAS] = machine.hidden.line.as_ref().map_or(1.0, |line| line.gas);
    if let Some((channel, _)) = machine.hidden.lag {
        let drive = Drive { machine, shot, contents, closed: false, waves: None };
        let signal = drive.signals(&state)[channel];
        state[at::LAG] = signal;
        state[at::LAG + 1] = signal;
    }
    state
}

/// Where what leaks past the spool leaves by the open drain; the drain's pressure if nothing leaks.
fn resting_pressure(machine: &Machine, shot: &Shot) -> f64 {
    if machine.hidden.spool_leak.is_none() {
        return machine.chamber.p_z;
    }
    let (mut low, mut high) = (machine.chamber.p_z, shot.p_0.max(machine.chamber.p_z));
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        let net = machine.inflow(0.0, shot.p_0 - middle) - machine.outflow(0.0, middle - machine.chamber.p_z);
        if net > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}
