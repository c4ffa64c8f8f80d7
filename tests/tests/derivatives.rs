//! The symbolic Jacobian of every model against differences of its residual.
//!
//! 100 points per model: along a trajectory, all unknowns and rates then perturbed by random factors, from 1e-6 to 1 of their
//! size or nominal value.  Central differences with two steps are extrapolated (Richardson).  Entries where the two
//! one-sided differences disagree stand at a kink and are left out; they must be few.  Entries outside the pattern must
//! not show in the differences at all.  Models come by listing; those that need neighbours are seen in the test stands.

use hyd_compiler::{CompiledSystem, Goal};
use hyd_system::{DaeSystem, EventPhase, Pattern};
use hyd_tests::models::{compile_file, model_files};
use hyd_tests::runs::{Run, instance, on_grid, run};

const POINTS: usize = 100;

/// Random numbers: xorshift after Marsaglia, "Xorshift RNGs", J. Stat. Software 8 (2003).
struct Random(u64);

impl Random {
    /// Evenly in -1 to 1.
    fn signed(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Either sign, sizes from 1e-6 to 1 evenly by their logarithm.
    fn spread(&mut self) -> f64 {
        let size = 10f64.powf(-3.0 + 3.0 * self.signed());
        if self.signed() < 0.0 { -size } else { size }
    }
}

/// A time with values of unknowns and rates.
struct Point {
    t: f64,
    y: Vec<f64>,
    yp: Vec<f64>,
}

/// What the comparison of a model has seen.
#[derive(Default)]
struct Tally {
    compared: usize,
    at_kinks: usize,
    faults: Vec<String>,
}

/// The trajectory of the unknowns, perturbed.
fn points(run: &Run, system: &CompiledSystem, nominals: &[f64], random: &mut Random) -> Vec<Point> {
    let tables = system.tables();
    let series: Vec<Vec<f64>> = (0..nominals.len()).map(|k| run.values(&tables.unknown_name(k))).collect();
    let times = run.rows.times();
    (0..POINTS)
        .map(|p| {
            let row = 1 + p * (times.len() - 2) / POINTS;
            let h = times[row + 1] - times[row - 1];
            let mut y: Vec<f64> = series.iter().map(|values| values[row]).collect();
            let mut yp: Vec<f64> = series.iter().map(|values| (values[row + 1] - values[row - 1]) / h).collect();
            for k in 0..y.len() {
                y[k] += random.spread() * (y[k].abs() + nominals[k]);
                yp[k] += random.spread() * (yp[k].abs() + nominals[k]);
            }
            Point { t: times[row], y, yp }
        })
        .collect()
}

/// Settles relations and discrete variables at a point, so that later times see what holds there.
fn settle(system: &mut CompiledSystem, point: &mut Point) {
    let mut phase = EventPhase::First;
    for _ in 0..10 {
        let change = system.event_pass(phase, point.t, &mut point.y, &point.yp);
        if !change.expect("events can be evaluated").changed {
            return;
        }
        phase = EventPhase::Iterate;
    }
    panic!("relations do not settle at {} s", point.t);
}

fn residual(system: &mut CompiledSystem, t: f64, y: &[f64], yp: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; y.len()];
    system.residual(t, y, yp, &mut out);
    out
}

/// Residuals with one value moved by `h`.
fn moved(system: &mut CompiledSystem, point: &mut Point, column: usize, rate: bool, h: f64) -> Vec<f64> {
    let place = |point: &mut Point| -> *mut f64 { std::ptr::null_mut::<f64>().wrapping_add(point.y.len() * 0) };
    let _ = place;
    let values = if rate { &mut point.yp } else { &mut point.y };
    let old = values[column];
    values[column] = old + h;
    let out = residual(system, point.t, &point.y, &point.yp);
    if rate { point.yp[column] = old } else { point.y[column] = old }
    out
}

/// Row sizes: what the terms of a row add up to in size, as far as the Jacobian shows it.
fn sizes(point: &Point, nominals: &[f64], patterns: [&Pattern; 2], values: [&[f64]; 2]) -> Vec<f64> {
    let mut sizes = vec![0.0; point.y.len()];
    for (rate, (pattern, values)) in patterns.iter().zip(values).enumerate() {
        for c in 0..point.y.len() {
            let at = if rate == 1 { point.yp[c] } else { point.y[c] };
            for e in pattern.column(c) {
                sizes[pattern.row_indices[e] as usize] += values[e].abs() * (at.abs() + nominals[c]);
            }
        }
    }
    sizes
}

fn compare(system: &mut CompiledSystem, point: &mut Point, nominals: &[f64], tally: &mut Tally) {
    let structure = system.structure().clone();
    let patterns = [&structure.state_pattern, &structure.rate_pattern];
    let mut states = vec![0.0; patterns[0].entries()];
    let mut rates = vec![0.0; patterns[1].entries()];
    system.jacobian(point.t, &point.y, &point.yp, &mut states, &mut rates);
    let sizes = sizes(point, nominals, patterns, [&states, &rates]);
    let middle = residual(system, point.t, &point.y, &point.yp);
    for (rate, values) in [(false, &states), (true, &rates)] {
        for c in 0..nominals.len() {
            let at = if rate { point.yp[c] } else { point.y[c] };
            let h = 2e-5 * (at.abs() + nominals[c]);
            let mut column = vec![0.0; nominals.len()];
            for e in patterns[usize::from(rate)].column(c) {
                column[patterns[usize::from(rate)].row_indices[e] as usize] = values[e];
            }
            let mut shifted = |scale: f64| moved(system, point, c, rate, scale * h);
            let samples = [shifted(-1.0), shifted(-0.5), shifted(0.5), shifted(1.0)];
            for r in 0..nominals.len() {
                let noise = 1e-14 * (sizes[r] + middle[r].abs()) / h;
                let value = |k: usize| samples[k][r];
                entry(h, [value(0), value(1), middle[r], value(2), value(3)], column[r], noise, tally, &|| {
                    let tables = system_names(&structure, r, c, rate);
                    format!("{tables} at {} s", point_time(point_t))
                });
            }
        }
    }
}
