//! The symbolic Jacobian of every model against differences of its residual.
//!
//! 100 points per model: along a trajectory, all unknowns and rates then perturbed by random factors, from 1e-6 to 1 of their
//! size or nominal value.  Central differences with two steps are extrapolated (Richardson).  Entries where the two
//! one-sided differences disagree stand at a kink and are left out; they must be few.  Entries outside the pattern must
//! not show in the differences at all.  Models come by listing; those that need neighbours are seen in the test stands.

use hyd_compiler::{Goal, Instance};
use hyd_results::Discard;
use hyd_runtime::simulate;
use hyd_system::{DaeSystem, EventPhase, Pattern};
use hyd_tests::models::{compile_file, model_files};
use hyd_tests::runs::{Run, instance, on_grid, run, translated};

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
    undefined: usize,
    faults: Vec<String>,
}

/// The trajectory of the unknowns, perturbed.
fn points(run: &Run, system: &Instance, nominals: &[f64], random: &mut Random) -> Vec<Point> {
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
fn settle(system: &mut Instance, point: &mut Point) {
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

fn residual(system: &mut Instance, t: f64, y: &[f64], yp: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; y.len()];
    system.residual(t, y, yp, &mut out);
    out
}

/// Residuals with one unknown, or its rate, moved by `h`.
fn moved(system: &mut Instance, point: &Point, column: usize, rate: bool, h: f64) -> Vec<f64> {
    let (mut y, mut yp) = (point.y.clone(), point.yp.clone());
    let values = if rate { &mut yp } else { &mut y };
    values[column] += h;
    residual(system, point.t, &y, &yp)
}

/// What the terms of each row add up to, as far as the Jacobian shows it: the rounding error of a residual goes with it.
fn sizes(point: &Point, nominals: &[f64], patterns: [&Pattern; 2], values: [&[f64]; 2]) -> Vec<f64> {
    let mut sizes = vec![0.0; point.y.len()];
    for ((pattern, values), at) in patterns.iter().zip(values).zip([&point.y, &point.yp]) {
        for c in 0..point.y.len() {
            for e in pattern.column(c) {
                sizes[pattern.row_indices[e] as usize] += (values[e] * (at[c].abs() + nominals[c])).abs();
            }
        }
    }
    sizes
}

/// Compares all entries at a point, those outside the pattern included.
fn compare(system: &mut Instance, point: &Point, nominals: &[f64], tally: &mut Tally) {
    let n = nominals.len();
    let structure = system.structure().clone();
    let patterns = [&structure.state_pattern, &structure.rate_pattern];
    let (mut states, mut rates) = (vec![0.0; patterns[0].entries()], vec![0.0; patterns[1].entries()]);
    system.jacobian(point.t, &point.y, &point.yp, &mut states, &mut rates);
    let sizes = sizes(point, nominals, patterns, [&states, &rates]);
    let middle = residual(system, point.t, &point.y, &point.yp);
    for (rate, values) in [(false, &states), (true, &rates)] {
        let pattern = patterns[usize::from(rate)];
        for (c, nominal) in nominals.iter().enumerate() {
            let at = if rate { point.yp[c] } else { point.y[c] };
            let h = 2e-5 * (at.abs() + nominal);
            let mut column = vec![0.0; n];
            pattern.column(c).for_each(|e| column[pattern.row_indices[e] as usize] = values[e]);
            let [a, b, d, e] = [-1.0, -0.5, 0.5, 1.0].map(|scale| moved(system, point, c, rate, scale * h));
            for r in 0..n {
                let noise = 1e-14 * (sizes[r] + middle[r].abs()) / h;
                let samples = [a[r], b[r], middle[r], d[r], e[r]];
                if let Some(fault) = tally.entry(column[r], samples, h, noise) {
                    let name = system.tables().unknown_name(c);
                    let of = if rate { format!("der({name})") } else { name };
                    let row = system.tables().row_equation(r).map_or("?".into(), |equation| equation.text.clone());
                    tally.faults.push(format!("`{row}` by {of} at {} s: {fault}", point.t));
                }
            }
        }
    }
}

/// The same for the initial system, around its first guess.
fn compare_initial(file: &str, system: &mut Instance, tally: &mut Tally) {
    let initial = system.structure().initial.clone();
    let n = initial.unknowns;
    let (mut guess, mut nominals) = (vec![0.0; n], vec![1.0; n]);
    system.initial_guess(0.0, &mut guess).unwrap_or_else(|failure| panic!("{file}: {failure:?}"));
    system.initial_nominals(&mut nominals);
    let residual = |system: &mut Instance, z: &[f64]| {
        let mut out = vec![0.0; n];
        system.initial_residual(0.0, z, &mut out).unwrap_or_else(|failure| panic!("{file}: {failure:?}"));
        out
    };
    let mut random = Random(0x5851_f42d_4c95_7f2d);
    for _ in 0..if n == 0 { 0 } else { POINTS } {
        let z: Vec<f64> = guess.iter().zip(&nominals).map(|(z, n)| z + random.spread() * (z.abs() + n)).collect();
        let mut values = vec![0.0; initial.pattern.entries()];
        system.initial_jacobian(0.0, &z, &mut values).unwrap_or_else(|failure| panic!("{file}: {failure:?}"));
        let middle = residual(system, &z);
        for c in 0..n {
            let h = 2e-5 * (z[c].abs() + nominals[c]);
            let mut column = vec![0.0; n];
            initial.pattern.column(c).for_each(|e| column[initial.pattern.row_indices[e] as usize] = values[e]);
            let [a, b, d, e] = [-1.0, -0.5, 0.5, 1.0].map(|scale| {
                let mut moved = z.clone();
                moved[c] += scale * h;
                residual(system, &moved)
            });
            for r in 0..n {
                let noise = 1e-13 * (middle[r].abs() + (column[r] * z[c]).abs()) / h;
                if let Some(fault) = tally.entry(column[r], [a[r], b[r], middle[r], d[r], e[r]], h, noise) {
                    tally.faults.push(format!("initial row {r} by unknown {c}: {fault}"));
                }
            }
        }
    }
}

impl Tally {
    /// One entry against residuals at -h, -h/2, 0, h/2, h; a text if it is wrong.
    fn entry(&mut self, symbolic: f64, samples: [f64; 5], h: f64, noise: f64) -> Option<String> {
        let [a, b, middle, d, e] = samples;
        if !samples.iter().all(|sample| sample.is_finite()) {
            self.undefined += 1;
            return None;
        }
        let difference = (4.0 * (d - b) / h - (e - a) / (2.0 * h)) / 3.0;
        let off = (symbolic - difference).abs();
        self.compared += usize::from(symbolic != 0.0 || difference != 0.0);
        if off <= 1e-6 * symbolic.abs() + noise {
            return None;
        }
        // At a kink the two sides differ by at least as much as the mean of them is off either.
        let sides = ((e - middle) - (middle - a)).abs() / h;
        if sides >= off {
            self.at_kinks += 1;
            return None;
        }
        Some(format!("{symbolic:e} instead of {difference:e} (noise {noise:.1e}, sides differ by {sides:.1e})"))
    }
}

/// Last time of the model's own experiment (s).
fn span(file: &str) -> f64 {
    let flat = compile_file(file, &[], Goal::Flat);
    flat.flat.as_ref().and_then(|flat| flat.experiment.stop).unwrap_or(1.0)
}

/// The comparison itself: it accepts a right entry, refuses one that is off by 1e-5, and knows a kink.
#[test]
fn entries_are_judged() {
    let h = 1e-5;
    let around = |f: fn(f64) -> f64, x: f64| [-h, -h / 2.0, 0.0, h / 2.0, h].map(|d| f(x + d));
    let mut tally = Tally::default();
    assert_eq!(tally.entry(12.0, around(|x| x * x * x, 2.0), h, 1e-9), None);
    assert!(tally.entry(12.0 * (1.0 + 1e-5), around(|x| x * x * x, 2.0), h, 1e-9).is_some());
    assert!(tally.entry(0.0, around(|x| x, 1.0), h, 1e-9).is_some());
    assert_eq!(tally.entry(0.0, around(|x| x.max(1.0), 1.0), h, 1e-9), None);
    assert_eq!((tally.compared, tally.at_kinks), (4, 1));
}

#[test]
fn jacobians_of_all_models() {
    let mut models = 0;
    let mut report = String::new();
    for file in model_files() {
        let checked = compile_file(&file, &[], Goal::Run);
        if checked.has_errors() {
            continue;
        }
        let tally = check(&file);
        println!("{file}: {} entries, {} at kinks, {} undefined", tally.compared, tally.at_kinks, tally.undefined);
        if tally.compared == 0 {
            continue;
        }
        models += 1;
        if !tally.faults.is_empty() {
            let first = tally.faults.iter().take(5).map(|fault| format!("  {fault}\n")).collect::<String>();
            report += &format!("{file}: {} of {} entries wrong\n{first}", tally.faults.len(), tally.compared);
        }
        let skipped = tally.at_kinks + tally.undefined;
        if skipped * 20 > tally.compared {
            report += &format!("{file}: {skipped} of {} entries left out, more than 5 %\n", tally.compared);
        }
    }
    assert!(report.is_empty(), "{report}");
    // All models that can run: a model that no longer compiles must not go unseen.
    assert!(models >= 17, "only {models} models compared");
}

fn check(file: &str) -> Tally {
    let run = run(file, &[], &on_grid(span(file), 4 * POINTS, 1e-6));
    let compilation = translated(file, &[]);
    let mut system = instance(&compilation, &[]);
    // Starts, parameters found at the start, discrete variables: as after a run.
    simulate(&mut system, &on_grid(span(file), 1, 1e-4), &mut Discard, &|| false).expect("it has run before");
    let mut nominals = vec![1.0; system.structure().unknowns];
    system.nominals(&mut nominals);
    let mut tally = Tally::default();
    compare_initial(file, &mut system, &mut tally);
    for mut point in points(&run, &system, &nominals, &mut Random(0x9e37_79b9_7f4a_7c15)) {
        settle(&mut system, &mut point);
        compare(&mut system, &point, &nominals, &mut tally);
    }
    tally
}
