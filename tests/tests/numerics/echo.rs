//! Delays against closed forms that need a sum: thousands of reflections of a driven wave.
//!
//! `c = 1 + sin(w t) + r c(t - T)` is what a wave does between a driven end and one that reflects a part `r` of it.  It starts in
//! its steady state `1/(1 - r)`, so `c(t) = sum r^k (1 + sin w(t - k T))` over all `k T <= t`, and `r^(n+1)/(1 - r)` of the start.

use hyd_tests::runs::{Run, on_grid, run};

const TRAVEL: f64 = 1.2e-3;
const REFLECTED: f64 = 0.98;
const FREQUENCY: f64 = 300.0;

fn exact(t: f64) -> f64 {
    let returns = (t / TRAVEL * (1.0 + 1e-12)).floor() as i32;
    let wave = |k: i32| REFLECTED.powi(k) * (1.0 + (FREQUENCY * (t - f64::from(k) * TRAVEL)).sin());
    (0..=returns).map(wave).sum::<f64>() + REFLECTED.powi(returns + 1) / (1.0 - REFLECTED)
}

/// Largest difference over the run, relative to the largest value.
fn difference(run: &Run, variable: &str) -> f64 {
    let times: Vec<f64> = run.values("time_of_row");
    let pairs = times.iter().zip(run.values(variable));
    let largest = times.iter().map(|&t| exact(t).abs()).fold(0.0, f64::max);
    pairs.map(|(&t, value)| (value - exact(t)).abs()).fold(0.0, f64::max) / largest
}

/// Two thousand returns, of delayed values alone.
#[test]
fn an_echo_keeps_its_size_over_thousands_of_returns() {
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let run = run("tests/cases/delays/echo.hyd", &[], &on_grid(2.4, 1999, tolerance));
        let difference = difference(&run, "alone.c");
        // Each return may add a tenth of the tolerance, and the sum of all is 1/(1 - r) of that.
        assert!(difference < 0.1 * tolerance / (1.0 - REFLECTED), "at {tolerance}: {difference}");
    }
}

/// A jump that comes back excites what is a thousand times faster than the steps before it: `y' = r (late - y)` and `z' = y`.
#[test]
fn a_jump_that_comes_back_is_followed_by_short_steps() {
    let (r, begin): (f64, f64) = (1000.0, 1.4);
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let run = run("tests/cases/delays/fast.hyd", &[], &on_grid(3.0, 3000, tolerance));
        let (ys, zs) = (run.values("y"), run.values("z"));
        for (k, &t) in run.values("time_of_row").iter().enumerate() {
            let since = (t - begin).max(0.0);
            let y = -(-r * since).exp_m1();
            let off = (ys[k] - y).abs().max((zs[k] - since + y / r).abs());
            assert!(off < 20.0 * tolerance, "at {t} s with {tolerance:e}: off by {off:e}");
        }
    }
}

/// The same driven by a state: 115 turns of an oscillator are as wrong as its integrator makes them, and the echo no more.
#[test]
fn an_echo_of_a_state_is_as_exact_as_the_state() {
    for tolerance in [1e-6, 1e-8] {
        let run = run("tests/cases/delays/echo_beside_a_state.hyd", &[], &on_grid(2.4, 1999, tolerance));
        let times = run.values("time_of_row");
        let drive = times.iter().zip(run.values("s")).map(|(&t, s)| (s - (FREQUENCY * t).sin()).abs());
        let (drive, echo) = (drive.fold(0.0, f64::max), difference(&run, "c"));
        assert!(echo < 2.0 * drive + 10.0 * tolerance, "at {tolerance}: echo {echo}, drive {drive}");
    }
}

/// A delay far shorter than the time scale does not shorten the steps.
#[test]
fn steps_are_not_bound_to_a_short_delay() {
    let run = run("tests/cases/delays/short.hyd", &[], &on_grid(1.0, 10, 1e-6));
    assert!(run.summary.statistics.steps < 100, "{} steps", run.summary.statistics.steps);
    // y = exp(-s t) with s = exp(s T).
    let mut rate = 1.0_f64;
    for _ in 0..50 {
        rate = (rate * 1e-4).exp();
    }
    assert!((run.value("y", 1.0) / (-rate).exp() - 1.0).abs() < 3e-6);
}
