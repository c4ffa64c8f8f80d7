//! Models whose inputs follow recorded samples, against closed forms.
//!
//! A first-order lag under a straight line has a solution in closed form, so it has one under a polygon, piece by piece; its derivatives
//! by parameters are central differences of that form.

#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use hyd_compiler::{Compilation, Extras, Goal, Instance, Options as CompilerOptions, compile_extended};
use hyd_payload::Backend;
use hyd_results::{Side, Trajectory};
use hyd_runtime::{Options, Solver, Summary, simulate};
use hyd_system::{DaeSystem, Hold, InputError, Inputs, Series};
use hyd_tests::models::messages;

const LAG: &str = "model Lag
  input Real u;
  parameter Real T = 0.5; parameter Real x0 = 0.2;
  Real x(start = x0, fixed = true);
equation
  T*der(x) = u - x;
end Lag;";

fn translate(text: &str, driven: &[&str]) -> Compilation {
    let driven: Vec<String> = driven.iter().map(|name| name.to_string()).collect();
    let options = CompilerOptions { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
    let extras = Extras { driven: &driven, ..Extras::default() };
    compile_extended(&mut hyd::LibraryPath::new(), "case.hyd", text, &options, &extras)
}

fn system(text: &str, inputs: &[(&str, Arc<Series>)]) -> Instance {
    let names: Vec<&str> = inputs.iter().map(|(name, _)| *name).collect();
    let compilation = translate(text, &names);
    assert!(!compilation.has_errors(), "{}", messages(&compilation));
    let mut system = compilation.model.unwrap().instantiate();
    hand_over(&mut system, inputs);
    system
}

fn hand_over(system: &mut dyn DaeSystem, inputs: &[(&str, Arc<Series>)]) {
    let sites: Vec<String> = system.structure().inputs.iter().map(|site| site.name.to_string()).collect();
    for (name, series) in inputs {
        let input = sites.iter().position(|site| site == name).unwrap_or_else(|| panic!("{name} of {sites:?}"));
        system.set_input(input, series).unwrap();
    }
}

fn series(times: &[f64], values: &[f64], hold: Hold) -> Arc<Series> {
    Arc::new(Series::new(times.to_vec(), values.to_vec(), hold).unwrap())
}

fn run(system: &mut dyn DaeSystem, options: &Options) -> (Trajectory, Summary) {
    let mut rows = Trajectory::new();
    let summary = simulate(system, options, &mut rows, &|| false).unwrap_or_else(|error| panic!("{error}"));
    (rows, summary)
}

fn value(rows: &Trajectory, name: &str, t: f64) -> f64 {
    rows.series(name).unwrap_or_else(|| panic!("no {name}")).value(t, Side::After)
}

/// `T*x' = u - x` from `x0` at the first time on, where `u` follows the samples.
fn lag(t: f64, (times, values): (&[f64], &[f64]), hold: Hold, [lag, x0]: [f64; 2]) -> f64 {
    let mut x = x0;
    for k in 1..times.len() {
        let (a, width) = (values[k - 1], times[k] - times[k - 1]);
        let s = if hold == Hold::Zero { 0.0 } else { (values[k] - a) / width };
        let after = |tau: f64| a + s * tau - s * lag + (x - a + s * lag) * (-tau / lag).exp();
        if t <= times[k] {
            return after(t - times[k - 1]);
        }
        x = after(width);
    }
    x
}

const TIMES: [f64; 7] = [0.0, 1.0, 2.0, 2.5, 4.0, 4.1, 6.0];
const VALUES: [f64; 7] = [1.0, 0.3, 2.0, 2.0, -1.0, 0.5, 0.5];

#[test]
fn a_lag_follows_a_polygon_and_steps_as_its_closed_form_does() {
    for hold in [Hold::Linear, Hold::Zero] {
        for solver in [Solver::Auto, Solver::Bdf, Solver::Esdirk] {
            let mut system = system(LAG, &[("u", series(&TIMES, &VALUES, hold))]);
            let options = Options { solver, intervals: 60, ..Options::new(0.0, 6.0).with_tolerance(1e-9) };
            let (rows, summary) = run(&mut system, &options);
            for k in 0..=60 {
                let t = 0.1 * f64::from(k);
                let exact = lag(t, (&TIMES, &VALUES), hold, [0.5, 0.2]);
                let found = value(&rows, "x", t);
                assert!((found - exact).abs() < 1e-7, "{hold:?} {solver:?} {t}: {found}, not {exact}");
            }
            // The input is a column, its jumps are events, kinks are none.
            assert_eq!(value(&rows, "u", 2.0), 2.0);
            let before = rows.series("u").unwrap().value(2.0, Side::Before);
            let (jump, events) = if hold == Hold::Zero { (0.3, 4) } else { (2.0, 0) };
            assert_eq!((before, summary.statistics.time_events), (jump, events), "{hold:?}");
        }
    }
}

/// Samples that move up and down by chance, so many to a second.
fn noise(count: usize, rate: f64) -> (Vec<f64>, Vec<f64>) {
    let mut state = 12_345_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    ((0..count).map(|k| k as f64 / rate).collect(), (0..count).map(|_| next()).collect())
}

#[test]
fn samples_close_to_each_other_are_left_to_the_one_step_method() {
    let (times, values) = noise(2001, 20.0);
    for hold in [Hold::Linear, Hold::Zero] {
        let mut found = Vec::new();
        for solver in [Solver::Auto, Solver::Bdf] {
            let mut system = system(LAG, &[("u", series(&times, &values, hold))]);
            let options = Options { solver, intervals: 2000, ..Options::new(0.0, 100.0).with_tolerance(1e-6) };
            let (rows, summary) = run(&mut system, &options);
            let error = (1..2000)
                .map(|k| {
                    let t = 0.05 * f64::from(k);
                    let from = (k as usize).saturating_sub(200);
                    let x0 = if from == 0 { 0.2 } else { value(&rows, "x", times[from]) };
                    // The lag forgets: ten seconds back decide.
                    let exact = lag(t, (&times[from..], &values[from..]), hold, [0.5, x0]);
                    (value(&rows, "x", t) - exact).abs()
                })
                .fold(0.0, f64::max);
            found.push((error, summary));
        }
        assert!(found[0].0 < 5e-6 && found[1].0 < 2e-5, "{hold:?}: errors {} and {}", found[0].0, found[1].0);
        let work = |k: usize| found[k].1.statistics.newton_iterations as f64;
        assert!(work(0) < 0.7 * work(1), "{hold:?}: {} iterations instead of {}", work(0), work(1));
        let told: Vec<String> = found[0].1.phases.iter().map(|phase| phase.reason.to_string()).collect();
        assert!(told.iter().any(|reason| reason.contains("samples of the recorded inputs")), "{told:?}");
    }
}

#[test]
fn the_start_uses_the_first_value() {
    let text = "model M
  input Real u;
  Real x(start = 1); Real y;
initial equation
  der(x) = 0;
equation
  der(x) = u - x^3; y = u + x;
end M;";
    let mut system = system(text, &[("u", series(&[-1.0, 1.0, 2.0], &[4.0, 12.0, 12.0], Hold::Linear))]);
    let (rows, _) = run(&mut system, &Options::new(0.0, 1.5));
    assert!((value(&rows, "x", 0.0) - 2.0).abs() < 1e-9 && (value(&rows, "y", 0.0) - 10.0).abs() < 1e-9);
}

#[test]
fn index_reduction_differentiates_the_record() {
    // v is the slope of the record; z lags behind it.
    let text = "model M
  input Real u;
  Real x; Real v; Real z(start = 0, fixed = true);
equation
  x = u; der(x) = v; der(z) = v - z;
end M;";
    let mut system = system(text, &[("u", series(&TIMES, &VALUES, Hold::Linear))]);
    assert!(system.structure().inputs[0].differentiated);
    let options = Options { intervals: 60, ..Options::new(0.0, 6.0).with_tolerance(1e-9) };
    let (rows, _) = run(&mut system, &options);
    let slopes: Vec<f64> =
        (0..6).map(|k| (VALUES[k + 1] - VALUES[k]) / (TIMES[k + 1] - TIMES[k])).chain([0.0]).collect();
    for k in 0..60 {
        let t = 0.1 * f64::from(k) + 0.03;
        let slope = slopes[TIMES.iter().rposition(|time| *time <= t).unwrap()];
        let exact = lag(t - 0.03, (&TIMES, &slopes), Hold::Zero, [1.0, 0.0]);
        assert!((value(&rows, "z", t - 0.03) - exact).abs() < 1e-7, "{t}");
        assert!((value(&rows, "v", t) - slope).abs() < 1e-9, "{t}: {} not {slope}", value(&rows, "v", t));
    }
    for (k, t) in TIMES.iter().enumerate().skip(1) {
        let sides = [Side::Before, Side::After].map(|side| rows.series("v").unwrap().value(*t, side));
        assert!(
            (sides[0] - slopes[k - 1]).abs() < 1e-9 && (*t == 6.0 || (sides[1] - slopes[k]).abs() < 1e-9),
            "{sides:?}"
        );
    }
    let held = series(&TIMES, &VALUES, Hold::Zero);
    assert_eq!(system.set_input(0, &held), Err(InputError::NoDerivative));
    // A spline has a continuous slope: no events.
    let times: Vec<f64> = (0..=60).map(|k| 0.1 * f64::from(k)).collect();
    let values: Vec<f64> = times.iter().map(|t| t.sin()).collect();
    hand_over(&mut system, &[("u", series(&times, &values, Hold::Smooth))]);
    let (rows, summary) = run(&mut system, &options);
    assert_eq!(summary.statistics.time_events, 0);
    for t in [1.0, 2.0, 3.3, 5.0] {
        let exact = 0.5 * (f64::cos(t) + f64::sin(t) - (-t).exp());
        assert!((value(&rows, "z", t) - exact).abs() < 1e-4, "{t}: {} not {exact}", value(&rows, "z", t));
    }
}

#[test]
fn what_would_need_two_derivatives_is_refused_by_name() {
    let text = "model M
  input Real stroke;
  Real x; Real v; Real f;
equation
  x = stroke; der(x) = v; der(v) = f;
end M;";
    let compilation = translate(text, &["stroke"]);
    let said = messages(&compilation);
    assert!(said.contains("the recorded input `stroke` would have to be differentiated twice"), "{said}");
}

#[test]
fn a_short_pulse_in_a_long_quiet_record_is_not_stepped_over() {
    let count = 100_000;
    let (at, height, width) = (70_007usize, 0.05, 0.001);
    let times: Vec<f64> = (0..count).map(|k| width * k as f64).collect();
    let mut values = vec![1.0; count];
    values[0] = 0.0;
    values[at] += height;
    for hold in [Hold::Linear, Hold::Zero] {
        for solver in [Solver::Auto, Solver::Bdf, Solver::Esdirk] {
            let mut system = system(LAG, &[("u", series(&times, &values, hold))]);
            let options = Options { solver, intervals: 1000, ..Options::new(0.0, 99.0).with_tolerance(1e-8) };
            let (rows, summary) = run(&mut system, &options);
            let t = 71.28;
            let exact = lag(t, (&times, &values), hold, [0.5, 0.2]);
            let found = value(&rows, "x", t);
            // The pulse leaves a thousandth of its height behind.
            assert!((exact - 1.0).abs() > 5e-6 && (found - exact).abs() < 5e-7, "{hold:?} {solver:?}: {found} {exact}");
            assert!(summary.statistics.steps < 1500, "{hold:?} {solver:?}: {} steps", summary.statistics.steps);
        }
    }
}

#[test]
fn an_event_on_the_input_within_a_pulse_is_found() {
    let text = "model M
  input Real u;
  discrete Real last(start = -1, fixed = true); Integer n(start = 0, fixed = true);
equation
  when u > 0.5 then
    last = time; n = pre(n) + 1;
  end when;
end M;";
    let times: Vec<f64> = (0..1001).map(f64::from).collect();
    let mut values = vec![0.0; 1001];
    values[500] = 1.0;
    let (rows, _) = run(&mut system(text, &[("u", series(&times, &values, Hold::Linear))]), &Options::new(0.0, 1000.0));
    assert!((value(&rows, "last", 1000.0) - 499.5).abs() < 1e-6 && value(&rows, "n", 1000.0) == 1.0);
    let (rows, _) = run(&mut system(text, &[("u", series(&times, &values, Hold::Zero))]), &Options::new(0.0, 1000.0));
    assert_eq!((value(&rows, "last", 1000.0), value(&rows, "n", 1000.0)), (500.0, 1.0));
}

#[test]
fn sensitivities_go_through_recorded_inputs() {
    let central = |f: &dyn Fn(f64) -> f64, at: f64| {
        let (h, quarter) = (1e-3, 0.25e-3);
        let of = |h: f64| (f(at + h) - f(at - h)) / (2.0 * h);
        (16.0 * of(quarter) - of(h)) / 15.0
    };
    for hold in [Hold::Linear, Hold::Zero] {
        let options = Options {
            sensitivity: vec!["T".into(), "x0".into()],
            intervals: 60,
            ..Options::new(0.0, 6.0).with_tolerance(1e-9)
        };
        let (rows, _) = run(&mut system(LAG, &[("u", series(&TIMES, &VALUES, hold))]), &options);
        for t in [0.5, 1.0, 2.2, 3.0, 4.1, 5.5] {
            let by_lag = central(&|lag_| lag(t, (&TIMES, &VALUES), hold, [lag_, 0.2]), 0.5);
            let by_start = central(&|x0| lag(t, (&TIMES, &VALUES), hold, [0.5, x0]), 0.2);
            for (name, exact) in [("d(x)/d(T)", by_lag), ("d(x)/d(x0)", by_start)] {
                let found = value(&rows, name, t);
                assert!(
                    (found - exact).abs() < 2e-6 * (1.0 + exact.abs()),
                    "{hold:?} {name} at {t}: {found}, not {exact}"
                );
            }
            assert_eq!(value(&rows, "d(u)/d(T)", t), 0.0);
        }
    }
}

/// Where the one-step method takes over, first steps behind jumps are taken over, too, and derivatives go on through both.
#[test]
fn sensitivities_go_through_samples_close_to_each_other() {
    let (times, values) = noise(401, 20.0);
    for hold in [Hold::Linear, Hold::Zero] {
        let options =
            Options { sensitivity: vec!["T".into()], intervals: 400, ..Options::new(0.0, 20.0).with_tolerance(1e-7) };
        let (rows, summary) = run(&mut system(LAG, &[("u", series(&times, &values, hold))]), &options);
        assert!(summary.statistics.one_step_steps > summary.statistics.steps / 2, "{:?}", summary.statistics);
        for k in (20..400).step_by(7) {
            let t = times[k];
            let at = |lag_: f64| lag(t, (&times, &values), hold, [lag_, 0.2]);
            let exact = (at(0.5005) - at(0.4995)) / 1e-3;
            let found = value(&rows, "d(x)/d(T)", t);
            assert!((found - exact).abs() < 1e-5, "{hold:?} at {t}: {found}, not {exact}");
        }
    }
}

#[test]
fn instants_at_which_the_input_crosses_a_level_have_derivatives() {
    // u = t up to 2: y begins to grow at the level, so y(t) = t - level; the level of 2u is met at half of it.
    let text = "model M
  input Real u;
  parameter Real level = 0.7;
  Boolean on(start = false, fixed = true); Real y(start = 0, fixed = true); Real w;
equation
  w = 2*u;
  when w > level then on = true; end when;
  der(y) = if on then 1 else 0;
end M;";
    let options = Options { sensitivity: vec!["level".into()], intervals: 20, ..Options::new(0.0, 2.0) };
    let (rows, _) =
        run(&mut system(text, &[("u", series(&[0.0, 2.0, 3.0], &[0.0, 2.0, 0.0], Hold::Linear))]), &options);
    assert!((value(&rows, "y", 2.0) - 1.65).abs() < 1e-6);
    assert!((value(&rows, "d(y)/d(level)", 2.0) + 0.5).abs() < 1e-6, "{}", value(&rows, "d(y)/d(level)", 2.0));
}

#[test]
fn elements_of_arrays_and_several_records_on_times_of_their_own() {
    let text = "model M
  input Real u[2]; input Real v;
  Real x[2](each start = 0, each fixed = true); Real y = v + u[2];
equation
  for k in 1:2 loop der(x[k]) = u[k]*k - v; end for;
end M;";
    let inputs = [
        ("u[1]", series(&[0.0, 2.0], &[0.0, 2.0], Hold::Linear)),
        ("u[2]", series(&[0.0, 1.0, 2.0], &[1.0, 3.0, 3.0], Hold::Zero)),
        ("v", series(&[0.0, 0.5, 2.0], &[1.0, 1.0, 1.0], Hold::Smooth)),
    ];
    let mut all = system(text, &inputs);
    let (rows, _) = run(&mut all, &Options::new(0.0, 2.0));
    assert!((value(&rows, "x[1]", 2.0) - 0.0).abs() < 1e-6, "{}", value(&rows, "x[1]", 2.0));
    assert!((value(&rows, "x[2]", 2.0) - (2.0 + 6.0 - 2.0)).abs() < 1e-6, "{}", value(&rows, "x[2]", 2.0));
    assert_eq!(value(&rows, "y", 1.5), 4.0);
    // An input without samples is no run.
    let mut none = translate(text, &["u[1]", "v"]).model.unwrap().instantiate();
    let error =
        simulate(&mut none, &Options::new(0.0, 1.0), &mut Trajectory::new(), &|| false).unwrap_err().to_string();
    assert!(error.contains("the input `u[1]` has no samples"), "{error}");
}

#[test]
fn interpreter_machine_code_and_threads_give_the_same_bits() {
    let rows = |system: &mut dyn DaeSystem| {
        let (rows, _) = run(system, &Options::new(0.0, 6.0));
        (0..rows.len()).flat_map(|k| rows.row(k).to_vec()).map(f64::to_bits).collect::<Vec<u64>>()
    };
    for hold in [Hold::Linear, Hold::Zero, Hold::Smooth] {
        let record = series(&TIMES, &VALUES, hold);
        let model = translate(LAG, &["u"]).model.unwrap();
        let instance = |model: &hyd_compiler::CompiledModel| {
            let mut system = model.instantiate();
            hand_over(&mut system, &[("u", record.clone())]);
            system
        };
        let mut native = instance(&model);
        let first = rows(&mut native);
        assert_eq!(first, rows(&mut native), "a second run of the same system");
        assert_eq!(first, rows(&mut instance(&model.on(Backend::Vm).unwrap())));
        let others: Vec<_> = (0..4).map(|_| instance(&model)).collect();
        let others: Vec<_> = others
            .into_iter()
            .map(|mut system| {
                std::thread::spawn(move || {
                    let mut rows = Trajectory::new();
                    simulate(&mut system, &Options::new(0.0, 6.0), &mut rows, &|| false).unwrap();
                    (0..rows.len()).flat_map(|k| rows.row(k).to_vec()).map(f64::to_bits).collect::<Vec<u64>>()
                })
            })
            .collect();
        for other in others {
            assert_eq!(first, other.join().unwrap());
        }
    }
}
