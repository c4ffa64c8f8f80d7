//! The drive's motion: charge, flux, spool, valve and amounts of oil as states, written down by hand with every law that may be
//! hidden in it.  Each hidden effect has the form in which it is usually stated and another inner form of the same size
//! (`Hidden::other_forms`): Lorentzian for Gaussian static excess, an algebraic for a hyperbolic-tangent sign, a loop with its own
//! inductance for an ideal shunt, a gap that widens under pressure, a force angle that changes with the opening, and so on.

use crate::contents::Contents;
use crate::integrator::{N, State, System};
use crate::line::Waves;
use crate::machine::{Friction, Inductance, Machine, Memory};

/// Places of the states.
pub mod at {
    /// Charge of the capacitor, C.
    pub const CHARGE: usize = 0;
    /// Flux linkage, Wb (current, A, where the voltage of motion is left out).
    pub const FLUX: usize = 1;
    /// Current of the eddy loop, A.
    pub const EDDY: usize = 2;
    /// Spool, m and m/s.
    pub const X: usize = 3;
    /// Speed of the spool.
    pub const V: usize = 4;
    /// Valve, m and m/s.
    pub const Y: usize = 5;
    /// Speed of the valve.
    pub const W: usize = 6;
    /// Oil in the working chamber, m3 at reference pressure.
    pub const NEAR: usize = 7;
    /// Oil at the actuator behind a pipe, m3.
    pub const FAR: usize = 8;
    /// Flow in that pipe, m3/s.
    pub const PIPE: usize = 9;
    /// Pressure at the inlet, Pa.
    pub const INLET: usize = 10;
    /// Gas of the accumulator, m3.
    pub const GAS: usize = 11;
    /// Lagging signal, two stages.
    pub const LAG: usize = 12;
    /// What a law with memory remembers, and its rate of change; in units of that law.
    pub const OWN: usize = 14;
}

/// Error scales of the states.
pub const SCALE: State = [1e-2, 0.05, 1.0, 1e-4, 1.0, 1e-2, 1.0, 2e-8, 2e-8, 1e-3, 1e7, 3e-4, 1.0, 1.0, 1.0, 1.0];
/// Time constant of the eddy loop in its other form, s.
const EDDY_TIME: f64 = 4e-6;
/// Softness of the contact law's corner in its other form.
const SOFT: f64 = 0.15;

/// Conditions of one shot.
#[derive(Clone, Debug)]
pub struct Shot {
    /// Supply pressure, Pa.
    pub p_0: f64,
    /// Voltage of the capacitor, V.
    pub u_0: f64,
    /// Capacity, F.
    pub capacity: f64,
    /// Length of the pulse, s.
    pub pulse: f64,
    /// When the switch really closes, s.
    pub trigger: f64,
}

/// The right-hand side while the switch stands one way.
pub struct Drive<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The shot.
    pub shot: &'a Shot,
    /// Its contents' law.
    pub contents: &'a Contents,
    /// Whether the switch is closed.
    pub closed: bool,
    /// The supply line.
    pub waves: Option<&'a Waves>,
}

/// Pressures and flows at a state.
struct Oil {
    p_0: f64,
    p_near: f64,
    p_far: f64,
    q_in: f64,
    q_net: f64,
    intake: [f64; 2],
}

impl Machine {
    /// Inductance where the spool is at `x`, and its derivative.
    pub fn inductance(&self, x: f64) -> (f64, f64) {
        let reach = self.coil.b_e + self.coil.x_0 + self.coil.travel - x;
        (self.coil.a_e / reach + self.coil.l_0, self.coil.a_e / (reach * reach))
    }

    fn inlet_area(&self, x: f64) -> f64 {
        let (sin, cos) = self.gaps.alpha.sin_cos();
        if x > 0.0 { std::f64::consts::PI * x * sin * (self.gaps.d_s - x * sin * cos) } else { 0.0 }
    }

    fn drain_area(&self, x: f64) -> f64 {
        let open = (self.gaps.x_z - x).max(0.0);
        std::f64::consts::PI * self.gaps.d_z * (open * open + self.gaps.clearance * self.gaps.clearance).sqrt()
    }

    fn root(&self, dp: f64) -> f64 {
        dp / (dp * dp + self.gaps.dp_tr * self.gaps.dp_tr).sqrt().sqrt()
    }

    /// Flow through the inlet, m3/s.
    pub fn inflow(&self, x: f64, dp: f64) -> f64 {
        let rise = self.hidden.coefficient_slope.unwrap_or(0.0) * (x / self.coil.travel - 0.5);
        let leak = self.hidden.spool_leak.unwrap_or(0.0) * dp;
        self.gaps.mu_0 * (1.0 + rise) * self.inlet_area(x) * (2.0 / self.gaps.rho).sqrt() * self.root(dp) + leak
    }

    /// Flow out of the chamber to the drain, by the gap and past the piston, m3/s.
    pub fn outflow(&self, x: f64, dp: f64) -> f64 {
        let free = self.gaps.mu_z * self.drain_area(x) * (2.0 / self.gaps.rho).sqrt();
        let gap = match self.hidden.back_pressure {
            Some(resistance) => self.root(dp) / (1.0 / (free * free) + resistance).sqrt(),
            None => free * self.root(dp),
        };
        let widened = if self.hidden.other_forms { 1.0 + 1e-9 * dp } else { 1.0 };
        gap + self.hidden.leakage.unwrap_or(0.0) * dp * widened
    }

    /// Contact force at penetration `d` growing at `rate`.
    fn contact(&self, stiffness: f64, chi: f64, d: f64, rate: f64) -> f64 {
        if d <= 0.0 {
            return 0.0;
        }
        let law = 1.0 + chi * rate;
        let factor = if self.hidden.other_forms {
            (law + (law * law + SOFT * SOFT).sqrt()) / (1.0 + (1.0 + SOFT * SOFT).sqrt())
        } else {
            law.max(0.0)
        };
        stiffness * d * factor
    }

    fn dry(&self, friction: &Friction, speed: f64) -> f64 {
        let part = speed / friction.v_s;
        let excess = friction.sticking - friction.sliding;
        if self.hidden.other_forms {
            let fade = 1.0 / (1.0 + part * part).powi(2);
            -(friction.sliding + excess * fade) * speed / (speed * speed + friction.v_r * friction.v_r).sqrt()
        } else {
            -(friction.sliding + excess * (-part * part).exp()) * (speed / friction.v_r).tanh()
        }
    }

    /// Sum of forces on the spool, N.
    pub fn spool_force(&self, x: f64, v: f64, i: f64, p_0: f64, p_r: f64) -> f64 {
        let (_, slope) = self.inductance(x);
        let spool = &self.spool;
        let mut force = 0.5 * i * i * slope
            - spool.preload
            - spool.spring * x
            - spool.damping * v
            - spool.a_s0 * (p_0 - self.chamber.p_z)
            + spool.a_sr * (p_r - self.chamber.p_z)
            + self.contact(spool.contact, spool.chi, -x, -v)
            - self.contact(spool.contact, spool.chi, x - self.coil.travel, v);
        if let Some(friction) = &self.hidden.stiction {
            force += self.dry(friction, v);
        }
        if let Some([part, angle]) = self.hidden.flow_force {
            let turn = if self.hidden.other_forms { 1.05 - 0.1 * x / self.coil.travel } else { 1.0 };
            let mu = self.gaps.mu_0;
            force -= part * 2.0 * mu * mu * self.inlet_area(x) * (p_0 - p_r) * angle.cos() * turn;
        }
        force
    }

    /// Sum of forces on piston and valve, N.
    pub fn valve_force(&self, y: f64, w: f64, pressure: f64) -> f64 {
        let valve = &self.valve;
        let d = y - valve.y_max;
        let stop = match self.hidden.stop_spring {
            Some(second) => {
                let series = valve.k_stop * second / (valve.k_stop + second);
                if self.hidden.other_forms { series * (1.0 + 50.0 * (d - 3e-4)) } else { series }
            }
            None => valve.k_stop,
        };
        let mut force =
            valve.area * (pressure - self.chamber.p_z) - valve.preload - valve.spring * y - valve.damping * w
                + self.contact(valve.k_seat, valve.chi_seat, -y, -w)
                - self.contact(stop, valve.chi_stop, d, w);
        if let Some(friction) = &self.hidden.friction {
            force += self.dry(friction, w);
        }
        if let Some([damping, depth]) = self.hidden.cushion {
            let power = if self.hidden.other_forms { 2.8 } else { 3.0 };
            force -= damping * w / (1.0 + y.max(0.0) / depth).powf(power);
        }
        force
            - self.hidden.drag.unwrap_or(0.0) * w * w.abs()
            - self.hidden.hardening.unwrap_or(0.0) * y.powi(3)
            - self
                .hidden
                .adhesion
                .map_or(0.0, |[pull, depth]| pull * (-y.max(0.0) / depth).exp() * w.max(0.0) / (w * w + 1e-4).sqrt())
    }
}

impl Drive<'_> {
    /// Current of the magnetising path, of saturation, and the flux law's inductance.
    fn magnetising(&self, y: &State) -> (f64, f64) {
        let machine = self.machine;
        let (inductance, _) = machine.inductance(y[at::X]);
        let main = match machine.hidden.inductance {
            Inductance::Moving => y[at::FLUX] / inductance,
            Inductance::Constant => y[at::FLUX] / machine.inductance(0.0).0,
            Inductance::Motionless => y[at::FLUX],
        };
        let extra = machine.hidden.saturation.map_or(0.0, |[i_s, flux_s, n]| {
            let part = y[at::FLUX].abs() / flux_s;
            let bend =
                if machine.hidden.other_forms { 0.5 * (part.powf(n - 1.0) + part.powf(n + 1.0)) } else { part.powf(n) };
            i_s * bend * y[at::FLUX].signum()
        });
        (main, extra)
    }

    /// Coil current and the voltage that changes the flux.
    fn circuit(&self, y: &State) -> (f64, f64) {
        let machine = self.machine;
        let circuit = &machine.circuit;
        let (main, extra) = self.magnetising(y);
        let warmer = match machine.hidden.memory {
            Some(Memory::Warming(part)) => 1.0 + part * y[at::OWN],
            _ => 1.0,
        };
        let shunt = machine.hidden.eddy.unwrap_or(0.0);
        let ideal = shunt > 0.0 && !machine.hidden.other_forms;
        let i = main + extra + if ideal { 0.0 } else { y[at::EDDY] };
        let (resistance, free) = if self.closed {
            let r = circuit.r * warmer + circuit.r_w;
            (r, y[at::CHARGE] / self.shot.capacity - r * i)
        } else {
            let r = circuit.r * warmer + circuit.r_fw;
            (r, -r * i - circuit.v_fw * (i / circuit.i_sm).tanh())
        };
        if ideal {
            let e = free / (1.0 + resistance * shunt);
            (i + shunt * e, e)
        } else {
            (i, free)
        }
    }

    fn oil(&self, y: &State) -> Oil {
        let machine = self.machine;
        let p_0 = if self.waves.is_some() { y[at::INLET] } else { self.shot.p_0 };
        let swept = machine.valve.area * y[at::Y];
        let (near, far) = match &machine.hidden.pipe {
            Some(pipe) => (pipe.near, machine.chamber.v_0 - pipe.near + swept),
            None => (machine.chamber.v_0 + swept, 1.0),
        };
        let ratios = [y[at::NEAR] / near, y[at::FAR] / far];
        let p_near = self.contents.pressure(ratios[0]);
        let p_far = if machine.hidden.pipe.is_some() { self.contents.pressure(ratios[1]) } else { p_near };
        let q_in = machine.inflow(y[at::X], p_0 - p_near);
        let q_net = q_in - machine.outflow(y[at::X], p_near - machine.chamber.p_z) - y[at::PIPE];
        Oil { p_0, p_near, p_far, q_in, q_net, intake: ratios.map(|ratio| self.contents.intake(ratio)) }
    }

    /// The channels u_C, i, x, y, p_R, p_0 as ideal sensors would show them.
    pub fn signals(&self, y: &State) -> [f64; 6] {
        let oil = self.oil(y);
        [y[at::CHARGE] / self.shot.capacity, self.circuit(y).0, y[at::X], y[at::Y], oil.p_near, oil.p_0]
    }

    fn pipe_slopes(&self, y: &State, oil: &Oil, slope: &mut State) {
        let Some(pipe) = &self.machine.hidden.pipe else { return };
        let rho = self.machine.gaps.rho;
        let area = std::f64::consts::PI * pipe.diameter * pipe.diameter / 4.0;
        let q = y[at::PIPE];
        let laminar = 128.0 * 0.04 * pipe.length / (std::f64::consts::PI * pipe.diameter.powi(4));
        let loss = match self.machine.hidden.other_forms {
            true if q > 0.0 => 1.55,
            true => 1.45,
            false => 1.5,
        };
        let drop = laminar * q + loss * rho * q * q.abs() / (2.0 * area * area);
        slope[at::PIPE] = (oil.p_near - oil.p_far - drop) * area / (rho * pipe.length);
        slope[at::FAR] = q * oil.intake[1];
    }

    fn line_slopes(&self, t: f64, y: &State, oil: &Oil, slope: &mut State) {
        let (Some(waves), Some(line)) = (self.waves, &self.machine.hidden.line) else { return };
        let (plus, minus) = waves.arriving(t);
        let delivered = (plus - y[at::INLET]) / waves.impedance;
        slope[at::INLET] = self.machine.chamber.bulk / line.inlet * (delivered - oil.q_in);
        slope[at::GAS] = (self.accumulator(y) - minus) / waves.impedance;
    }

    /// What a law with memory remembers, and what it does to the rest.
    fn memory_slopes(&self, y: &State, i: f64, oil: &Oil, slope: &mut State) {
        let machine = self.machine;
        let own = y[at::OWN];
        match machine.hidden.memory {
            Some(Memory::Surge([mass, frequency, damping])) => {
                // Distance from the valve, and speed.
                let speed = y[at::OWN + 1];
                let square = frequency * frequency;
                slope[at::OWN] = speed - y[at::W];
                slope[at::OWN + 1] = -square * own - 2.0 * damping * frequency * (speed - y[at::W]);
                slope[at::W] -= mass * slope[at::OWN + 1] / machine.valve.mass;
            }
            Some(Memory::Pocket([compliance, time])) => {
                // Pressure above that of the drain.
                slope[at::OWN] = (oil.p_near - machine.chamber.p_z - own) / time;
                slope[at::NEAR] -= compliance * slope[at::OWN] * oil.intake[0];
            }
            Some(Memory::Warming(_)) => slope[at::OWN] = i * i,
            Some(Memory::Film([damping, time])) => {
                slope[at::OWN] = (y[at::V] - own) / time;
                slope[at::V] -= damping * own / machine.spool.mass;
            }
            Some(Memory::Seal([force, travel])) => {
                let speed = y[at::W];
                slope[at::OWN] = (speed - speed.abs() * own) / travel;
                slope[at::W] -= force * own / machine.valve.mass;
            }
            None => {}
        }
    }

    /// Pressure of the accumulator, Pa.
    pub fn accumulator(&self, y: &State) -> f64 {
        let line = self.machine.hidden.line.as_ref();
        line.map_or(self.shot.p_0, |line| self.shot.p_0 * (line.gas / y[at::GAS]).powf(line.exponent))
    }
}

impl System for Drive<'_> {
    fn slope(&self, t: f64, y: &State) -> State {
        let machine = self.machine;
        let mut slope = [0.0; N];
        let (i, e) = self.circuit(y);
        let (main, _) = self.magnetising(y);
        let oil = self.oil(y);
        slope[at::CHARGE] = if self.closed { -i } else { 0.0 };
        slope[at::FLUX] = match machine.hidden.inductance {
            Inductance::Motionless => e / machine.inductance(y[at::X]).0,
            _ => e,
        };
        if machine.hidden.other_forms
            && let Some(shunt) = machine.hidden.eddy
        {
            slope[at::EDDY] = (shunt * e - y[at::EDDY]) / EDDY_TIME;
        }
        slope[at::X] = y[at::V];
        slope[at::V] = machine.spool_force(y[at::X], y[at::V], main, oil.p_0, oil.p_near) / machine.spool.mass;
        slope[at::Y] = y[at::W];
        slope[at::W] = machine.valve_force(y[at::Y], y[at::W], oil.p_far) / machine.valve.mass;
        slope[at::NEAR] = oil.q_net * oil.intake[0];
        self.pipe_slopes(y, &oil, &mut slope);
        self.line_slopes(t, y, &oil, &mut slope);
        self.memory_slopes(y, i, &oil, &mut slope);
        if let Some((channel, time)) = machine.hidden.lag {
            let signal = [y[at::CHARGE] / self.shot.capacity, i, y[at::X], y[at::Y], oil.p_near, oil.p_0][channel];
            let second = if machine.hidden.other_forms { 0.05 * time } else { 0.0 };
            slope[at::LAG] = (signal - y[at::LAG]) / (time - second);
            if second > 0.0 {
                slope[at::LAG + 1] = (y[at::LAG] - y[at::LAG + 1]) / second;
            }
        }
        slope
    }

    fn kinks(&self, y: &State) -> [bool; 6] {
        let machine = self.machine;
        let volume = match &machine.hidden.pipe {
            Some(pipe) => pipe.near,
            None => machine.chamber.v_0 + machine.valve.area * y[at::Y],
        };
        [
            y[at::X] > 0.0,
            y[at::X] > machine.coil.travel,
            y[at::X] > machine.gaps.x_z,
            y[at::Y] > 0.0,
            y[at::Y] > machine.valve.y_max,
            self.contents.compressed(y[at::NEAR] / volume),
        ]
    }
}
