//! A hydraulic valve drive in seven states: the kind of system the integrator is made for.
//!
//! Capacitor discharge into a solenoid whose inductance depends on the spool position, a spool with spring and stiff contacts, a
//! chamber between supply and drain edges, a piston with valve spring and contacts.  Two time events: voltage on and off.
//! Lumped equations in SI units; partial derivatives by dual numbers.  There is no closed form: runs are compared with
//! runs at a much tighter tolerance.

use std::ops::{Add, Mul, Neg, Sub};

use super::Model;
use hyd_system::{EventChange, EventPhase};

const N: usize = 7;

/// A value with its derivatives by the seven states.
#[derive(Clone, Copy)]
pub struct Dual {
    value: f64,
    slope: [f64; N],
}

impl Dual {
    fn constant(value: f64) -> Self {
        Self { value, slope: [0.0; N] }
    }
    fn chain(self, value: f64, factor: f64) -> Self {
        Self { value, slope: self.slope.map(|s| factor * s) }
    }
    fn inverse(self) -> Self {
        self.chain(1.0 / self.value, -1.0 / (self.value * self.value))
    }
    fn positive_part(self) -> Self {
        if self.value > 0.0 { self } else { Self::constant(0.0) }
    }
    /// x / (x^2 + e^2)^(1/4): the square root with sign, made smooth around 0.
    fn signed_root(self, e: f64) -> Self {
        let s = self.value * self.value + e * e;
        let root = s.sqrt().sqrt();
        self.chain(self.value / root, 1.0 / root - 0.5 * self.value * self.value / (s * root))
    }
}

impl Add for Dual {
    type Output = Dual;
    fn add(self, other: Dual) -> Dual {
        Dual { value: self.value + other.value, slope: std::array::from_fn(|k| self.slope[k] + other.slope[k]) }
    }
}

impl Neg for Dual {
    type Output = Dual;
    fn neg(self) -> Dual {
        self.chain(-self.value, -1.0)
    }
}

impl Sub for Dual {
    type Output = Dual;
    fn sub(self, other: Dual) -> Dual {
        self + -other
    }
}

impl Mul for Dual {
    type Output = Dual;
    fn mul(self, other: Dual) -> Dual {
        let (left, right) = (self.chain(0.0, other.value), other.chain(0.0, self.value));
        Dual { value: self.value * other.value, ..left + right }
    }
}

impl Mul<Dual> for f64 {
    type Output = Dual;
    fn mul(self, other: Dual) -> Dual {
        other.chain(self * other.value, self)
    }
}

/// The drive; voltage is on between `on` and `off` (s).
pub(crate) struct Drive {
    pub on: f64,
    pub off: f64,
    powered: bool,
}

impl Drive {
    pub(crate) fn new(on: f64, off: f64) -> Self {
        Self { on, off, powered: false }
    }

    /// Rates of u_C, lambda, x, x', p, y, y'.
    fn rates(&self, s: [Dual; N]) -> [Dual; N] {
        let constant = Dual::constant;
        let [u, lambda, x, vx, p, y, vy] = s;
        // Spring and damper over the depth, the damper growing in within a micrometre so that the force has no jump.
        let contact = |stiffness: f64, damping: f64, depth: Dual, speed: Dual| {
            let grown = depth * (depth + constant(1e-6)).inverse();
            stiffness * depth - damping * (grown * speed)
        };
        let gap = constant(1.2e-3) - x;
        let inductance = 2e-5 * (gap + constant(2e-4)).inverse() + constant(5e-3);
        let current = lambda * inductance.inverse();
        let voltage = if self.powered { u } else { constant(0.0) };
        let du = if self.powered { -(1.0 / 2e-3 * current) } else { 20.0 * (constant(60.0) - u) };
        let dlambda = voltage - 1.5 * current;
        let dl = 2e-5 * ((gap + constant(2e-4)) * (gap + constant(2e-4))).inverse();
        let force = 0.5 * (dl * current * current);
        let low = (-x).positive_part();
        let high = (x - constant(1e-3)).positive_part();
        let spool =
            force - 2e4 * x - constant(8.0) - 10.0 * vx + contact(1e8, 400.0, low, vx) - contact(1e8, 400.0, high, -vx);
        let supply = 4e-2 * (x - constant(4e-4)).positive_part();
        let drain = 4e-2 * (constant(3e-4) - x).positive_part();
        let flow_in = 0.03 * supply * (constant(2e7) - p).signed_root(1e4);
        let flow_out = 0.03 * drain * p.signed_root(1e4);
        let area = 3e-4;
        let volume = area * y + constant(2e-5);
        let dp = 1.4e9 * (flow_in - flow_out - area * vy) * volume.inverse();
        let bottom = (-y).positive_part();
        let piston = area * p - 8e4 * y - constant(400.0) - 30.0 * vy + contact(1e9, 1e4, bottom, vy);
        [du, dlambda, vx, 1.0 / 0.02 * spool, dp, vy, 1.0 / 0.3 * piston]
    }

    fn states(y: &[f64]) -> [Dual; N] {
        std::array::from_fn(|k| {
            let mut slope = [0.0; N];
            slope[k] = 1.0;
            Dual { value: y[k], slope }
        })
    }
}

impl Model for Drive {
    fn names(&self) -> Vec<String> {
        ["u_C", "lambda", "x", "v_x", "p", "y", "v_y"].map(String::from).to_vec()
    }
    fn start(&self) -> Vec<f64> {
        vec![60.0, 0.0, -8e-8, 0.0, 0.0, -4e-7, 0.0]
    }
    fn nominals(&self) -> Vec<f64> {
        vec![10.0, 0.05, 1e-4, 1.0, 1e7, 1e-2, 1.0]
    }
    fn bind(&mut self) {
        self.powered = false;
    }
    fn residual(&self, _t: f64, y: &[f64], yp: &[f64], out: &mut [f64]) {
        let rates = self.rates(Self::states(y));
        for k in 0..N {
            out[k] = yp[k] - rates[k].value;
        }
    }
    fn jacobian(&self, _t: f64, y: &[f64], _yp: &[f64], state: &mut [f64], rate: &mut [f64]) {
        let rates = self.rates(Self::states(y));
        for (row, value) in rates.iter().enumerate() {
            for column in 0..N {
                state[column * N + row] = -value.slope[column];
            }
            rate[row * N + row] = 1.0;
        }
    }
    fn next_time_event(&self, t: f64) -> f64 {
        [self.on, self.off].into_iter().find(|&event| event > t).unwrap_or(f64::INFINITY)
    }
    fn event(&mut self, _phase: EventPhase, t: f64, _y: &mut [f64], _yp: &[f64]) -> EventChange {
        let powered = t >= self.on && t < self.off;
        let changed = powered != self.powered;
        self.powered = powered;
        EventChange { changed, ..EventChange::default() }
    }
}
