//! Three problems with diffsol: peer-diffsol (bdf|esdirk34|tr_bdf2) (drive|line|cord) TOLERANCE CELLS [FILE].
//!
//! Prints CPU seconds (best of several), steps, rejected steps; writes samples `t,value,...` to FILE.  The equations are those of
//! `../models` and of `../../../models/hydraulic_line`, in scaled units.

use std::f64::consts::PI;
use std::fmt::Write as _;

use diffsol::{FaerSparseLU, FaerSparseMat, NalgebraLU, NalgebraMat, OdeBuilder, OdeSolverMethod, Vector};

fn cpu() -> f64 {
    let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut t) };
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

/// Coefficients of a chain: `a` before differences of the second kind of unknown, `b` of the first, `r` friction.
#[derive(Clone, Copy)]
struct Line {
    cells: usize,
    i: f64,
    c: f64,
    r: f64,
}

impl Line {
    fn new(cells: usize) -> Self {
        let (area, dz) = (PI * 3.6e-5, 20.0 / cells as f64);
        let c = 870.0 * 1300.0 * 1300.0 * 1e-9 / (area * dz);
        Self { cells, i: area / (870.0 * dz) * 1e9, c, r: 0.03 / (0.024 * area) * 1e-3 }
    }
    fn valve(t: f64) -> f64 {
        let s = ((t - 0.01) / 0.02).clamp(0.0, 1.0);
        2e-3 * (2.0 / 870.0 * 1e6f64).sqrt() * (1.0 - 0.99 * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s))
    }
    fn start(&self, y: &mut [f64]) {
        let q = 0.424_465_957_385_262_94;
        for k in 0..self.cells {
            (y[2 * k], y[2 * k + 1]) = (q, 20.0 - (k + 1) as f64 * self.r / self.i * q * q);
        }
    }
    fn rates(&self, y: &[f64], t: f64, f: &mut [f64]) {
        let d = y[2 * self.cells - 1] - 0.1;
        let out = Self::valve(t) * d / (d * d + 1e-6).sqrt().sqrt();
        let mut left = 20.0;
        for k in 0..self.cells {
            let (q, p) = (y[2 * k], y[2 * k + 1]);
            f[2 * k] = self.i * (left - p) - self.r * q * q.abs();
            f[2 * k + 1] = self.c * (q - if k + 1 < self.cells { y[2 * k + 2] } else { out });
            left = p;
        }
    }
    fn slope(&self, y: &[f64], t: f64, v: &[f64], f: &mut [f64]) {
        let d = y[2 * self.cells - 1] - 0.1;
        let s = d * d + 1e-6;
        let root = s.sqrt().sqrt();
        let out = Self::valve(t) * (1.0 / root - 0.5 * d * d / (s * root)) * v[2 * self.cells - 1];
        let mut left = 0.0;
        for k in 0..self.cells {
            f[2 * k] = self.i * (left - v[2 * k + 1]) - 2.0 * self.r * y[2 * k].abs() * v[2 * k];
            f[2 * k + 1] = self.c * (v[2 * k] - if k + 1 < self.cells { v[2 * k + 2] } else { out });
            left = v[2 * k + 1];
        }
    }
}

fn cord_rates(y: &[f64], f: &mut [f64]) {
    let cells = y.len() / 2;
    let s = (cells as f64 + 1.0).powi(2);
    for k in 0..cells {
        let left = if k > 0 { y[2 * k - 2] } else { 0.0 };
        let right = if k + 1 < cells { y[2 * k + 2] } else { 0.0 };
        f[2 * k] = y[2 * k + 1];
        f[2 * k + 1] = s * (left - 2.0 * y[2 * k] + right);
    }
}

fn contact(depth: f64, speed: f64, k: f64) -> f64 {
    if depth <= 0.0 { 0.0 } else { (k * depth * (1.0 + 0.5 * speed)).max(0.0) }
}

fn orifice(area: f64, dp: f64) -> f64 {
    0.65 * area * (2.0 / 870.0 * 1e6f64).sqrt() * 1e3 * dp / (dp * dp + 1e-4).sqrt().sqrt()
}

fn drive_rates(z: &[f64], f: &mut [f64]) {
    let (x, y, area) = (z[2] * 1e-3, z[5] * 1e-3, PI / 4.0 * 1e-4);
    let gap = 0.762e-3 + 0.45e-3 - x;
    let (l, dl) = (1.2193e-5 / gap, 1.2193e-5 / (gap * gap));
    let spool = contact(-x, -z[3], 2e7) - contact(x - 0.45e-3, z[3], 2e7);
    let piston = contact(-y, -z[6], 1e8) - contact(y - 8e-3, z[6], 2e7);
    let flow_in = orifice(PI * 8e-3 * (x - 0.05e-3).max(0.0) + 1e-9, z[7] - z[4]);
    let flow_out = orifice(PI * 8e-3 * (0.4e-3 - x).max(0.0) + 1e-9, z[4] - 0.1);
    f[0] = -z[1] * 1e3;
    f[1] = (z[0] - 6.0 * z[1] - dl * z[3] * z[1]) / l;
    f[2] = z[3] * 1e3;
    f[3] = (0.5 * z[1] * z[1] * dl - 20.0 - 10.0 * z[2] - 5.0 * z[3] + spool) / 0.03;
    f[4] = 1.4 / (5e-6 + area * y) * (flow_in - flow_out - area * z[6] * 1e3);
    f[5] = z[6] * 1e3;
    f[6] = (area * (z[4] - 0.1) * 1e6 - 250.0 - 30.0 * z[5] - 20.0 * z[6] + piston) / 0.15;
    f[7] = 1.4 / 2e-4 * (orifice(2e-5, 10.0 - z[7]) - flow_in);
}

/// Directional derivative of the drive by central differences (SUNDIALS differences too).
fn drive_slope(z: &[f64], v: &[f64], out: &mut [f64]) {
    let size = v.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if size == 0.0 {
        return out.fill(0.0);
    }
    let scale = z.iter().zip(v).filter(|(_, v)| **v != 0.0).fold(1e-3f64, |m, (z, _)| m.max(z.abs()));
    let h = 1e-7 * scale / size;
    let (mut low, mut high) = ([0.0; 8], [0.0; 8]);
    let moved = |sign: f64| -> [f64; 8] { std::array::from_fn(|k| z[k] + sign * h * v[k]) };
    drive_rates(&moved(-1.0), &mut low);
    drive_rates(&moved(1.0), &mut high);
    for k in 0..8 {
        out[k] = (high[k] - low[k]) / (2.0 * h);
    }
}

/// Runs one method several times; a macro because the solver types differ.
macro_rules! measure {
    ($problem:expr, $method:ident, $linear:ty, $times:expr, $columns:expr, $file:expr) => {{
        let (mut best, mut spent, mut counts) = (f64::MAX, 0.0, (0, 0));
        let mut runs = 0;
        // What the first run of a process costs, or the best of several.
        let once = std::env::var_os("ONCE").is_some();
        while runs == 0 || (!once && spent < 1.0 && runs < 20) {
            let begin = cpu();
            let mut solver = $problem.$method::<$linear>().expect("solver");
            let mut text = String::new();
            for &t in $times.iter() {
                while solver.state().t < t {
                    solver.step().expect("step");
                }
                let y = solver.interpolate(t).expect("interpolation").clone_as_vec();
                if runs == 0 && $file.is_some() {
                    let _ = write!(text, "{t:e}");
                    for &c in $columns {
                        let _ = write!(text, ",{:.17e}", y[c]);
                    }
                    text.push('\n');
                }
            }
            let seconds = cpu() - begin;
            if let (0, Some(file)) = (runs, $file) {
                std::fs::write(file, &text).expect("written");
            }
            let statistics = solver.get_statistics();
            counts = (statistics.number_of_steps, statistics.number_of_error_test_failures);
            best = best.min(seconds);
            spent += seconds;
            runs += 1;
        }
        println!("{best:.6} {} {}", counts.0, counts.1);
    }};
}

macro_rules! by_method {
    ($name:expr, $problem:expr, $linear:ty, $times:expr, $columns:expr, $file:expr) => {
        match $name {
            "bdf" => measure!($problem, bdf, $linear, $times, $columns, $file),
            "esdirk34" => measure!($problem, esdirk34, $linear, $times, $columns, $file),
            "tr_bdf2" => measure!($problem, tr_bdf2, $linear, $times, $columns, $file),
            other => panic!("no method {other}"),
        }
    };
}

fn main() {
    let a: Vec<String> = std::env::args().collect();
    let (method, tolerance, cells) =
        (a[1].as_str(), a[3].parse::<f64>().expect("tolerance"), a[4].parse().expect("cells"));
    let file = a.get(5);
    let times = |n: usize, stop: f64| (1..=n).map(|k| stop * k as f64 / n as f64).collect::<Vec<_>>();
    let n: usize = cells;
    match a[2].as_str() {
        "drive" => {
            let problem = OdeBuilder::<NalgebraMat<f64>>::new()
                .rtol(tolerance)
                .atol([0.01 * tolerance])
                .rhs_implicit(|y, _p, _t, f| drive_rates(y, f), |y, _p, _t, v, f| drive_slope(y, v, f))
                .init(|_p, _t, y| y.copy_from_slice(&[48.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 10.0]), 8)
                .build()
                .expect("problem");
            by_method!(method, problem, NalgebraLU<f64>, times(80, 0.08), &[0, 1, 2, 3, 4, 5, 6, 7], file);
        }
        "line" => {
            let line = Line::new(n);
            let problem = OdeBuilder::<FaerSparseMat<f64>>::new()
                .rtol(tolerance)
                .atol([0.01 * tolerance])
                .rhs_implicit(move |y, _p, t, f| line.rates(y, t, f), move |y, _p, t, v, f| line.slope(y, t, v, f))
                .init(move |_p, _t, y| line.start(y), 2 * n)
                .build()
                .expect("problem");
            let columns = [0, 2 * (n / 2 - 1) + 1, 2 * n - 1];
            by_method!(method, problem, FaerSparseLU<f64>, times(50, 0.1), &columns, file);
        }
        _ => {
            let problem = OdeBuilder::<FaerSparseMat<f64>>::new()
                .rtol(tolerance)
                .atol([0.01 * tolerance])
                .rhs_implicit(|y, _p, _t, f| cord_rates(y, f), |_y, _p, _t, v, f| cord_rates(v, f))
                .init(
                    move |_p, _t, y| {
                        for k in 0..n {
                            y[2 * k] = (PI * (k + 1) as f64 / (n as f64 + 1.0)).sin();
                            y[2 * k + 1] = 0.0;
                        }
                    },
                    2 * n,
                )
                .build()
                .expect("problem");
            let columns = [0, 2 * (n / 2 - 1), 2 * n - 2];
            by_method!(method, problem, FaerSparseLU<f64>, times(50, 5.0), &columns, file);
        }
    }
}
