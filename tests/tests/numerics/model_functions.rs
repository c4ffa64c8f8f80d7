//! Compiled models as functions of their parameters: values, derivatives, reuse, threads, and what is refused.
//!
//! The oscillator `m x'' + k x = 0` from `x = a` has the solution `a cos(sqrt(k/m) t)`, whose derivatives are known.

use hyd_compiler::{Compilation, Goal, Options as CompilerOptions, compile};
use hyd_runtime::{EvaluationError, Functional, ModelFunction, Options};
use hyd_tests::models::messages;

const TEXT: &str = "model M
  parameter Real m = 1; parameter Real k = 4; parameter Real a = 1; parameter Integer n = 2; Real z[n] = fill(k, n);
  Real x(start = a, fixed = true); Real v(start = 0, fixed = true);
  Real twice = n*x;
equation
  der(x) = v;
  m*der(v) = -k*x;
  when time > 10 then
    terminate(\"enough\");
  end when;
end M;";

fn translate() -> Compilation {
    let mut library = hyd::LibraryPath::new();
    let options = CompilerOptions { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut library, "case.hyd", TEXT, &options);
    assert!(!compilation.has_errors(), "{}", messages(&compilation));
    compilation
}

fn wanted(parameters: &[&str], outputs: &[&str], times: &[f64]) -> Functional {
    let names = |list: &[&str]| list.iter().map(|name| name.to_string()).collect();
    let options = Options::new(0.0, 0.0).with_tolerance(1e-10);
    Functional { parameters: names(parameters), outputs: names(outputs), times: times.to_vec(), options }
}

fn function(
    parameters: &[&str],
    outputs: &[&str],
    times: &[f64],
) -> Result<ModelFunction<impl hyd_system::DaeSystem>, EvaluationError> {
    ModelFunction::new(translate().model.expect("translated").instantiate(), wanted(parameters, outputs, times))
}

/// `x` and its derivatives by `m`, `k` and `a`.
fn oscillation(t: f64, [m, k, a]: [f64; 3]) -> (f64, [f64; 3]) {
    let w = (k / m).sqrt();
    let by_w = -a * t * (w * t).sin();
    (a * (w * t).cos(), [-0.5 * by_w * w / m, 0.5 * by_w * w / k, (w * t).cos()])
}

const TIMES: [f64; 4] = [0.0, 0.1, 0.7324, 3.0];
const POINTS: [[f64; 3]; 3] = [[1.0, 4.0, 1.0], [1.3, 2.0, -0.5], [0.4, 9.0, 2.0]];

fn check(function: &mut ModelFunction<impl hyd_system::DaeSystem>) {
    for point in POINTS {
        let response = function.evaluate_with_derivatives(&point, &|| false).expect("it runs");
        assert_eq!(response.reached(), TIMES.len());
        for (k, &t) in TIMES.iter().enumerate() {
            let (x, slopes) = oscillation(t, point);
            assert!((response.value(k, 0) - x).abs() < 1e-7, "{} at {t}, not {x}", response.value(k, 0));
            assert!((response.value(k, 1) - 2.0 * x).abs() < 2e-7);
            assert_eq!((response.value(k, 2), response.derivative(k, 2, 1)), (point[1], 1.0));
            for (j, slope) in slopes.into_iter().enumerate() {
                let found = response.derivative(k, 0, j);
                assert!((found - slope).abs() < 1e-6 * (1.0 + slope.abs()), "by {j} at {t}: {found}, not {slope}");
                assert!((response.derivative(k, 1, j) - 2.0 * found).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn values_and_derivatives_are_those_of_the_closed_form() {
    let mut function = function(&["m", "k", "a"], &["x", "twice", "z[2]"], &TIMES).expect("known names");
    check(&mut function);
    // Once more on the same work space.
    check(&mut function);
    let with = function.evaluate_with_derivatives(&POINTS[1], &|| false).expect("it runs").values().to_vec();
    let without = function.evaluate(&POINTS[1], &|| false).expect("it runs");
    assert_eq!((without.values(), without.derivatives().len()), (with.as_slice(), 0));
}

#[test]
fn clones_run_in_threads() {
    let compilation = translate();
    let model = compilation.model.as_ref().expect("translated");
    std::thread::scope(|scope| {
        for _ in 0..4 {
            let system = model.instantiate();
            scope.spawn(move || {
                let wanted = wanted(&["m", "k", "a"], &["x", "twice", "z[2]"], &TIMES);
                check(&mut ModelFunction::new(system, wanted).expect("known names"));
            });
        }
    });
}

#[test]
fn a_run_that_ends_early_says_how_far_it_came() {
    let mut function = function(&["k"], &["x"], &[1.0, 9.5, 10.5, 12.0]).expect("known names");
    let response = function.evaluate(&[4.0], &|| false).expect("it runs");
    assert_eq!(response.reached(), 2);
    assert!(response.value(1, 0).is_finite() && response.value(2, 0).is_nan());
}

#[test]
fn what_makes_no_sense_is_refused() {
    let message = |parameters: &[&str], outputs: &[&str], times: &[f64]| match function(parameters, outputs, times) {
        Ok(_) => panic!("accepted"),
        Err(error) => error.to_string(),
    };
    assert_eq!(message(&["q"], &["x"], &[1.0]), "no sensitivity to `q`: there is no parameter of this name");
    assert_eq!(message(&["n"], &["x"], &[1.0]), "no sensitivity to `n`: it decides sizes or structure");
    assert_eq!(message(&["x"], &["x"], &[1.0]), "no sensitivity to `x`: it is not a parameter that can be set");
    assert_eq!(message(&["k"], &["q"], &[1.0]), "there is no variable `q`");
    assert_eq!(message(&["k"], &["x"], &[1.0, 1.0]), "time 2 must be a number greater than the one before it");
    let mut function = function(&["k"], &["x"], &[1.0]).expect("known names");
    assert!(matches!(function.evaluate(&[], &|| false), Err(EvaluationError::Count { wanted: 1, given: 0 })));
    assert!(matches!(function.evaluate(&[f64::NAN], &|| false), Err(EvaluationError::Value { .. })));
    assert!(matches!(function.evaluate(&[4.0], &|| true), Err(EvaluationError::Run(_))));
}
