//! The drive written down by hand as `y' = f(t, y)`, to be compared with what the compiler makes of the model text.
//!
//! States: voltage of the capacitor, flux linkage, position and velocity of spool and valve, pressure of the working chamber.
//! The pressure is a state here, while the model integrates a compressed volume: two forms of one law.  Equations: paper
//! (Szydlowski, Smoczynski, Archives of Automotive Engineering 62(4), 2013, 63-76) equations 3, 4, 10, 11, force by the
//! balance of energy, contacts after Hunt and Crossley; values are the nominal ones.  No leakage, chamber full at the start.

use std::f64::consts::PI;

use crate::dormand_prince::{Accuracy, integrate};

/// Number of states.
pub const STATES: usize = 7;
/// States in their order.
pub const NAMES: [&str; STATES] = ["u_C", "lambda", "x", "v", "y", "w", "p_R"];

/// Drain pressure (Pa).
const P_Z: f64 = 1e5;
/// Area of the piston (m2).
const A_P: f64 = PI * 16e-3 * 16e-3 / 4.0;

/// What an experiment chooses.
#[derive(Clone, Copy, Debug)]
pub struct Experiment {
    /// Supply pressure (Pa).
    pub p0: f64,
    /// Voltage of the charged capacitor (V).
    pub u0: f64,
    /// Capacitance (F).
    pub c: f64,
    /// The contact closes at 0 and opens then (s).
    pub t_off: f64,
}

/// Inductance (H) and its derivative (H/m) at a position of the spool.
pub fn inductance(x: f64) -> (f64, f64) {
    let gap = 0.39e-3 + 0.035e-3 + 0.45e-3 - x;
    (4.91e-6 / gap + 4.46e-3, 4.91e-6 / (gap * gap))
}

/// Contact force (N) for a penetration (m) and its rate (m/s).
pub fn contact(stiffness: f64, damping: f64, depth: f64, rate: f64) -> f64 {
    if depth > 0.0 { (stiffness * depth * (1.0 + damping * rate)).max(0.0) } else { 0.0 }
}

/// Flow (m3/s) through an area (m2) driven by a pressure difference (Pa).
pub fn orifice(area: f64, dp: f64) -> f64 {
    0.65 * area * (2.0 / 860.0_f64).sqrt() * dp / (dp * dp + 4e8).powf(0.25)
}

/// Areas of the supply and the drain gap (m2).
pub fn gaps(x: f64) -> (f64, f64) {
    let width = x.max(0.0) * (PI / 4.0).sin();
    let edge = (0.40e-3 - x).max(0.0);
    (PI * width * (8e-3 - width * (PI / 4.0).cos()), PI * 9e-3 * (edge * edge + 9e-12).sqrt())
}

impl Experiment {
    /// Everything at rest, the capacitor charged.
    pub fn start(&self) -> [f64; STATES] {
        let x = -(22.0 + 0.6e-6 * (self.p0 - P_Z)) / (1e8 + 20e3);
        [self.u0, 0.0, x, 0.0, -250.0 / (5e7 + 25e3), 0.0, P_Z]
    }

    /// Derivatives of the states with the contact closed or open.
    fn rates(&self, closed: bool, state: &[f64; STATES]) -> [f64; STATES] {
        let &[u_c, lambda, x, v, y, w, p_r] = state;
        let (l, dl_dx) = inductance(x);
        let i = lambda / l;
        let (du_c, dlambda) = if closed {
            (-i / self.c, u_c - (1.9 + 0.6) * i)
        } else {
            (0.0, -(1.9 + 4.0) * i - 0.8 * (i / 0.01).tanh())
        };
        let pull = 0.5 * i * i * dl_dx - 22.0 - 20e3 * x - 4.0 * v;
        let oil = -0.6e-6 * (self.p0 - P_Z) + 0.5e-6 * (p_r - P_Z);
        let stops = contact(1e8, 1.2, -x, -v) - contact(1e8, 1.2, x - 0.45e-3, v);
        let valve = A_P * (p_r - P_Z) - 250.0 - 25e3 * y - 60.0 * w;
        let seat = contact(5e7, 1.6, -y, -w) - contact(8e6, 0.4, y - 8e-3, w);
        let (supply, drain) = gaps(x);
        let net = orifice(supply, self.p0 - p_r) - orifice(drain, p_r - P_Z) - A_P * w;
        let dp_r = 1.4e9 / (3e-6 + A_P * y) * net;
        [du_c, dlambda, v, (pull + oil + stops) / 20e-3, w, (valve + seat) / 0.35, dp_r]
    }

    /// States at `0..=intervals` equal steps up to `stop` (s), restarted where the contact opens (which must be such a point).
    pub fn solve(&self, stop: f64, intervals: usize, rtol: f64) -> (Vec<f64>, Vec<[f64; STATES]>) {
        let times: Vec<f64> = (0..=intervals).map(|k| stop * (k as f64 / intervals as f64)).collect();
        let switch = times.iter().position(|t| (t - self.t_off).abs() < 1e-12).expect("switching instant on the grid");
        let scales = [10.0, 0.05, 1e-4, 1.0, 1e-2, 1.0, 1e7];
        let accuracy = Accuracy { rtol, atol: scales.map(|scale| 0.1 * rtol * scale) };
        let mut values = integrate(|_, s| self.rates(true, s), &times[..=switch], self.start(), &accuracy);
        let middle = values.pop().expect("invariant: there is a value at every time");
        values.extend(integrate(|_, s| self.rates(false, s), &times[switch..], middle, &accuracy));
        (times, values)
    }
}
