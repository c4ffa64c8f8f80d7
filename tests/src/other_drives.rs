//! Further drives written down by hand as `y' = f(t, y)`: with connecting pipe, with seat brake, double-acting, servo-controlled.
//!
//! The equations are those of the READMEs beside the models, the values their defaults.  Pressures are states where the model has
//! compressed volumes, except beside a pipe, where vapour may appear.  Nothing of the product is used.

use std::f64::consts::PI;

use crate::dormand_prince::{Accuracy, integrate};
use crate::drive_equations::{contact, gaps, inductance, orifice};

const K: f64 = 1.4e9;
const P_Z: f64 = 1e5;

/// Times and states of a solution.
pub type Solution<const N: usize> = (Vec<f64>, Vec<[f64; N]>);

/// Polynomial of degree five from 0 to 1.
fn smooth(u: f64) -> f64 {
    let c = u.clamp(0.0, 1.0);
    c * c * c * (10.0 + c * (6.0 * c - 15.0))
}

fn grid(stop: f64, intervals: usize) -> Vec<f64> {
    (0..=intervals).map(|k| stop * (k as f64 / intervals as f64)).collect()
}

fn accuracy<const N: usize>(rtol: f64, scales: [f64; N]) -> Accuracy<N> {
    Accuracy { rtol, atol: scales.map(|scale| 0.1 * rtol * scale) }
}

/// Area of the edge of a spool of diameter `d` (m) that is open by `h` (m), with radial clearance `c`.
fn edge(d: f64, h: f64, c: f64) -> f64 {
    PI * d * (h.max(0.0).powi(2) + c * c).sqrt()
}

/// The single-acting drive with 0.3 m of pipe: u_C, lambda, x, v, y, w, compressed volumes of chamber and actuator, flow.
pub fn pipe(stop: f64, intervals: usize, rtol: f64) -> Solution<9> {
    let a_p = PI * 64e-6;
    let (v_r, v_a, area) = (1.5e-6, 1.5e-6, PI * 25e-6);
    let inertance = 860.0 * 0.3 / area;
    let r = 128.0 * 0.04 * 0.3 / (PI * 1e-8);
    let rates = |closed: bool, s: &[f64; 9]| {
        let &[u_c, lambda, x, v, y, w, d_r, d_a, q] = s;
        let (l, dl) = inductance(x);
        let i = lambda / l;
        let (du, dlambda) = if closed { (-i / 1e-3, u_c - 2.5 * i) } else { (0.0, -5.9 * i - 0.8 * (i / 0.01).tanh()) };
        let p_r = 2e3 + K / v_r * d_r.max(0.0);
        let volume = v_a + a_p * y;
        let p_a = 2e3 + K / volume * d_a.max(0.0);
        let force_x = 0.5 * i * i * dl - 22.0 - 20e3 * x - 4.0 * v - 0.6e-6 * (10e6 - P_Z)
            + 0.5e-6 * (p_r - P_Z)
            + contact(1e8, 1.2, -x, -v)
            - contact(1e8, 1.2, x - 0.45e-3, v);
        let force_y = a_p * (p_a - P_Z) - 250.0 - 25e3 * y - 60.0 * w + contact(5e7, 1.6, -y, -w)
            - contact(8e6, 0.4, y - 8e-3, w);
        let (supply, drain) = gaps(x);
        let in_r = orifice(supply, 10e6 - p_r) - orifice(drain, p_r - P_Z) - q;
        let in_a = q - a_p * w + a_p * w * d_a.max(0.0) / volume;
        let dq = (p_r - p_a - r * q - 1.5 * 860.0 * q * q.abs() / (2.0 * area * area)) / inertance;
        [du, dlambda, v, force_x / 20e-3, w, force_y / 0.35, in_r, in_a, dq]
    };
    let times = grid(stop, intervals);
    let switch = times.iter().position(|t| (t - 10e-3).abs() < 1e-12).expect("switching instant on the grid");
    let y = -250.0 / (5e7 + 25e3);
    let x = -(22.0 + 0.6e-6 * (10e6 - P_Z)) / (1e8 + 20e3);
    let start = [24.0, 0.0, x, 0.0, y, 0.0, v_r * 98e3 / K, (v_a + a_p * y) * 98e3 / K, 0.0];
    let accuracy = accuracy(rtol, [10.0, 0.05, 1e-4, 1.0, 1e-2, 1.0, 1e-8, 1e-8, 1e-4]);
    let mut values = integrate(|_, s| rates(true, s), &times[..=switch], start, &accuracy);
    let middle = values.pop().expect("invariant: there is a value at every time");
    values.extend(integrate(|_, s| rates(false, s), &times[switch..], middle, &accuracy));
    (times, values)
}

/// The drive with seat brake: y, w, pressures of cylinder and line.
pub fn seat_brake(stop: f64, intervals: usize, rtol: f64, clearance: f64) -> Solution<4> {
    let a_p = PI * 64e-6;
    let rates = |t: f64, s: &[f64; 4]| {
        let &[y, w, p_c, p_l] = s;
        let x = 0.5e-3 * (smooth((t - 1e-3) / 1e-3) - smooth((t - 12e-3) / 1e-3));
        let q_0 = orifice(edge(8e-3, x - 0.1e-3, 3e-6), 10e6 - p_l);
        let q_z = orifice(edge(8e-3, 0.4e-3 - x, 3e-6), p_l - P_Z);
        let q_bypass = orifice(2e-5 * smooth((p_l - p_c - 5e4) / 1e5), p_l - p_c);
        let q_brake = orifice(edge(5e-3, y - 0.2e-3, clearance), p_c - p_l);
        let force = a_p * (p_c - P_Z) - 250.0 - 25e3 * y - 60.0 * w + contact(5e7, 1.6, -y, -w)
            - contact(8e6, 0.4, y - 8e-3, w);
        let dp_c = K / (3e-6 + a_p * y) * (q_bypass - q_brake - a_p * w);
        [w, force / 0.35, dp_c, K / 1e-6 * (q_0 - q_z - q_bypass + q_brake)]
    };
    let times = grid(stop, intervals);
    let start = [-250.0 / (5e7 + 25e3), 0.0, P_Z, P_Z];
    let values = integrate(rates, &times, start, &accuracy(rtol, [1e-2, 1.0, 1e7, 1e7]));
    (times, values)
}

/// The double-acting drive: y, w, pressures of the opening and the closing side.
pub fn double_acting(stop: f64, intervals: usize, rtol: f64) -> Solution<4> {
    let (a_a, a_b) = (1.2e-4, 0.6e-4);
    let rates = |t: f64, s: &[f64; 4]| {
        let &[y, w, p_a, p_b] = s;
        let x = 0.8e-3 * (smooth((t - 1e-3) / 1e-3) - smooth((t - 12e-3) / 1e-3)) - 0.4e-3;
        let q_a = orifice(edge(8e-3, x, 2e-6), 10e6 - p_a) - orifice(edge(8e-3, -x, 2e-6), p_a - P_Z);
        let q_b = orifice(2e-5, 10e6 - p_b);
        let q_l = 1e-13 * (p_a - p_b);
        let force = a_a * (p_a - P_Z) - a_b * (p_b - P_Z) - 60.0 * w + contact(5e7, 1.6, -y, -w)
            - contact(8e6, 0.4, y - 8e-3, w);
        let dp_a = K / (3e-6 + a_a * y) * (q_a - q_l - a_a * w);
        let dp_b = K / (3e-6 + a_b * (8e-3 - y)) * (q_b + q_l + a_b * w);
        [w, force / 0.3, dp_a, dp_b]
    };
    let times = grid(stop, intervals);
    let start = [-9.9e6 * a_b / 5e7, 0.0, P_Z, 10e6];
    let values = integrate(rates, &times, start, &accuracy(rtol, [1e-2, 1.0, 1e7, 1e7]));
    (times, values)
}

/// The servo drive: y, w, pressures, position of the spool, its rate over the angular frequency, integral of the controller.
pub fn servo(stop: f64, intervals: usize, rtol: f64) -> Solution<7> {
    let area = 1e-4;
    let omega = 2.0 * PI * 300.0;
    let rates = |t: f64, s: &[f64; 7]| {
        let &[y, w, p_a, p_b, x, dx, integral] = s;
        let e = 1e-3 + 3e-3 * smooth((t - 5e-3) / 20e-3) - y;
        let free = 0.02 * e + integral;
        let u = free.clamp(-0.5e-3, 0.5e-3);
        let (opens, closes) = (edge(6e-3, x + 5e-6, 3e-6), edge(6e-3, 5e-6 - x, 3e-6));
        let q_a = orifice(opens, 15e6 - p_a) - orifice(closes, p_a - P_Z);
        let q_b = orifice(closes, 15e6 - p_b) - orifice(opens, p_b - P_Z);
        let q_l = 2e-12 * (p_a - p_b);
        let dp_a = K / (2e-6 + area * y) * (q_a - q_l - area * w);
        let dp_b = K / (2e-6 + area * (10e-3 - y)) * (q_b + q_l + area * w);
        let force = area * (p_a - p_b) - 100.0 * w;
        let ddx = omega * (u - x - 1.6 * dx);
        [w, force / 0.5, dp_a, dp_b, omega * dx, ddx, 0.02 * e / 0.2 + (u - free) / 0.2]
    };
    let times = grid(stop, intervals);
    let start = [1e-3, 0.0, 7.55e6, 7.55e6, 0.0, 0.0, 0.0];
    let values = integrate(rates, &times, start, &accuracy(rtol, [1e-2, 1.0, 1e7, 1e7, 1e-4, 1e-4, 1e-4]));
    (times, values)
}
