//! Forward sensitivities through delays against closed forms: smooth pasts, jumps that come back, varying delay times, echoes.
//!
//! Each solution is known in closed form (method of steps; Bellen, Zennaro, "Numerical Methods for Delay Differential Equations",
//! Oxford 2003, section 1.1); its derivatives are central differences of that form with Richardson extrapolation.

use hyd_compiler::{Goal, Options as CompilerOptions, compile};
use hyd_results::{Side, Trajectory};
use hyd_runtime::{Options, SolveError, simulate};
use hyd_tests::models::messages;

fn run(text: &str, stop: f64, names: &[&str], tolerance: f64) -> Trajectory {
    attempt(text, stop, names, tolerance).unwrap_or_else(|error| panic!("{error}"))
}

fn attempt(text: &str, stop: f64, names: &[&str], tolerance: f64) -> Result<Trajectory, SolveError> {
    let mut library = hyd::LibraryPath::new();
    let options = CompilerOptions { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut library, "case.hyd", text, &options);
    assert!(!compilation.has_errors(), "{}", messages(&compilation));
    let mut system = compilation.model.expect("translated").instantiate();
    let options = Options {
        sensitivity: names.iter().map(|name| name.to_string()).collect(),
        intervals: 100,
        ..Options::new(0.0, stop).with_tolerance(tolerance)
    };
    let mut rows = Trajectory::new();
    simulate(&mut system, &options, &mut rows, &|| false).map(|_| rows)
}

/// Compares a variable and its derivatives with a closed form of time and parameters.
fn compare<const N: usize>(
    text: &str,
    variable: &str,
    (names, at): ([&str; N], [f64; N]),
    closed: &dyn Fn(f64, [f64; N]) -> f64,
    (stop, times, allowed): (f64, &[f64], f64),
) {
    let rows = run(text, stop, &names, 1e-9);
    for &t in times {
        let value = rows.series(variable).expect("recorded").value(t, Side::After);
        assert!((value - closed(t, at)).abs() < allowed, "{variable} at {t}: {value}, not {}", closed(t, at));
        for (k, name) in names.iter().enumerate() {
            let central = |h: f64| {
                let (mut above, mut below) = (at, at);
                above[k] += h;
                below[k] -= h;
                (closed(t, above) - closed(t, below)) / (2.0 * h)
            };
            let h = 1e-4 * at[k].abs();
            let expected = (4.0 * central(0.5 * h) - central(h)) / 3.0;
            let column = format!("d({variable})/d({name})");
            let found = rows.series(&column).unwrap_or_else(|| panic!("no {column}")).value(t, Side::After);
            let error = (found - expected).abs() / (1.0 + expected.abs());
            assert!(error < allowed, "{column} at {t}: {found}, not {expected}");
        }
    }
}

/// `y' = -k y(t - tau)`, constant before the start: `y = y0 sum (-k)^n (t - (n - 1) tau)^n / n!` over the powers of positive numbers.
#[test]
fn a_decay_that_looks_back() {
    let text = "model Decay
        parameter Real k = 1.3;
        parameter Real tau = 0.7;
        parameter Real y0 = 2;
        Real y(start = y0, fixed = true);
      equation
        der(y) = -k*delay(y, tau);
      end Decay;";
    let closed = |t: f64, [k, tau, y0]: [f64; 3]| {
        let (mut sum, mut factor) = (1.0, 1.0);
        for n in 1.. {
            let since = t - f64::from(n - 1) * tau;
            if since <= 0.0 {
                break;
            }
            factor *= -k / f64::from(n);
            sum += factor * since.powi(n);
        }
        y0 * sum
    };
    let at = (["k", "tau", "y0"], [1.3, 0.7, 2.0]);
    compare(text, "y", at, &closed, (5.0, &[0.5, 1.0, 2.0, 3.3, 5.0], 1e-6));
}

/// A ramp that is switched on comes back as a jump: `x' = u(t - tau)`, `u = a t` from `t_s` on.
#[test]
fn a_jump_comes_back_at_an_instant_that_moves() {
    let text = "model Jump
        parameter Real a = 3;
        parameter Real t_s = 0.4;
        parameter Real tau = 0.35;
        Real u = if time < t_s then 0 else a*time;
        Real z = delay(u, tau);
        Real x(start = 0, fixed = true);
      equation
        der(x) = z;
      end Jump;";
    let closed = |t: f64, [a, t_s, tau]: [f64; 3]| 0.5 * a * ((t - tau).powi(2) - t_s * t_s);
    let at = (["a", "t_s", "tau"], [3.0, 0.4, 0.35]);
    compare(text, "x", at, &closed, (2.0, &[0.8, 1.0, 2.0], 1e-6));
    let delayed = |t: f64, [a, _, tau]: [f64; 3]| a * (t - tau);
    compare(text, "z", at, &delayed, (2.0, &[0.8, 1.0, 2.0], 1e-6));
}

/// The delay time grows, so that the jump is passed at `t = (t_s + tau)/(1 - b)`.
#[test]
fn a_jump_passes_a_delay_time_that_grows() {
    let text = "model Growing
        parameter Real a = 3;
        parameter Real t_s = 0.4;
        parameter Real tau = 0.35;
        parameter Real b = 0.2;
        Real u = if time < t_s then 0 else a*time;
        Real z = delay(u, tau + b*time, 2);
        Real x(start = 0, fixed = true);
      equation
        der(x) = z;
      end Growing;";
    let closed = |t: f64, [a, t_s, tau, b]: [f64; 4]| {
        // The integral of a (t (1 - b) - tau) from where the bracket is t_s.
        let bracket = t * (1.0 - b) - tau;
        a * (bracket.powi(2) - t_s * t_s) / (2.0 * (1.0 - b))
    };
    let at = (["a", "t_s", "tau", "b"], [3.0, 0.4, 0.35, 0.2]);
    compare(text, "x", at, &closed, (2.0, &[1.0, 1.5, 2.0], 1e-6));
}

/// An oscillation seen through a delay time that follows a state.
#[test]
fn a_delay_time_that_is_computed() {
    let text = "model Computed
        parameter Real w = 3;
        parameter Real c = 0.4;
        Real x(start = 0, fixed = true);
        Real v(start = w, fixed = true);
        Real s(start = 1, fixed = true);
        Real z = delay(x, c*(2 - s), 1);
      equation
        der(x) = v;
        der(v) = -w*w*x;
        der(s) = -s;
      end Computed;";
    let closed = |t: f64, [w, c]: [f64; 2]| (w * (t - c * (2.0 - (-t).exp()))).sin();
    let at = (["w", "c"], [3.0, 0.4]);
    compare(text, "z", at, &closed, (4.0, &[1.0, 1.6, 2.4, 4.0], 1e-5));
}

/// An echo without loss of a pulse that decays: `z = u + r z(t - tau)`, algebraic but for what feeds it.
#[test]
fn echoes_keep_their_derivatives() {
    let text = "model Echo
        parameter Real r = 0.8;
        parameter Real tau = 0.3;
        parameter Real k = 2;
        Real u(start = 0, fixed = true);
        Real z;
        Real past = delay(z, tau);
      equation
        der(u) = k*(1 - u);
        z = u + r*past;
      end Echo;";
    let closed = |t: f64, [r, tau, k]: [f64; 3]| {
        // z = 0 before the start, where u = 0.
        let u = |t: f64| if t > 0.0 { 1.0 - (-k * t).exp() } else { 0.0 };
        (0..40).map(|n| r.powi(n) * u(t - f64::from(n) * tau)).sum()
    };
    let at = (["r", "tau", "k"], [0.8, 0.3, 2.0]);
    compare(text, "z", at, &closed, (3.0, &[0.21, 0.51, 0.99, 2.04, 2.97], 1e-5));
}

/// A delay of no time passes values on, but no derivatives, which is said before the first step.
#[test]
fn a_delay_time_of_zero_is_refused() {
    let text = "model Through
        parameter Real k = 1.5;
        parameter Real tau = 0;
        Real y(start = 1, fixed = true);
      equation
        der(y) = -k*delay(y, tau);
      end Through;";
    let y = run(text, 2.0, &[], 1e-9).last("y").expect("recorded");
    assert!((y - (-3.0f64).exp()).abs() < 1e-8, "{y}");
    let refused = attempt(text, 2.0, &["k"], 1e-9).expect_err("no derivatives").to_string();
    assert_eq!(
        refused,
        "no sensitivity to `k`: a `delay` has a delay time of zero, and derivatives cannot be carried through it"
    );
}

/// A solution at rest has long steps; its derivative by the start value dies out a thousand times faster than the
/// delay, and does so again when it comes back: `z' = y` and `v' = y(t - tau)`, which was `y0` before, so `dz/dy0 = (1
/// - exp(-r t))/r` and `dv/dy0 = tau + dz/dy0(t - tau)`.
#[test]
fn derivatives_that_die_out_fast_beside_a_solution_at_rest() {
    let text = "model Rest
        parameter Real y0 = 1;
        parameter Real r = 1000;
        Real y(start = y0, fixed = true);
        Real z(start = 0, fixed = true);
        Real v(start = 0, fixed = true);
      equation
        der(y) = -r*(y - 1);
        der(z) = y;
        der(v) = delay(y, 0.1);
      end Rest;";
    for tolerance in [1e-4, 1e-6, 1e-9_f64] {
        // The local error that is accepted, as a part of the largest derivative, a few times.
        let accepted = f64::max(10.0 * tolerance, 1e-5 * f64::powf(tolerance / 1e-6, 0.8));
        let rows = run(text, 1.0, &["y0"], tolerance);
        for t in [0.01, 0.05, 0.3, 1.0] {
            let expected = |t: f64| if t > 0.0 { -(-1000.0 * t).exp_m1() / 1000.0 } else { 0.0 };
            for (name, exact, largest) in [("z", expected(t), 1e-3), ("v", t.min(0.1) + expected(t - 0.1), 0.1)] {
                let found = rows.series(&format!("d({name})/d(y0)")).expect("recorded").value(t, Side::After);
                assert!(
                    (found - exact).abs() < 5.0 * accepted * largest,
                    "d({name})/d(y0) at {t}: {found}, not {exact}"
                );
            }
        }
    }
}
