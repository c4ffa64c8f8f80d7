//! Forward sensitivities against closed forms: smooth systems, initial systems, and jumps at events.
//!
//! Each model has a solution in closed form; its derivative by a parameter is taken from that form by central differences with
//! Richardson extrapolation, whose error is far below the tolerances asked for.

use hyd_compiler::{Compilation, Goal, Options as CompilerOptions, compile};
use hyd_results::{Side, Trajectory};
use hyd_runtime::{Options, SolveError, simulate};
use hyd_tests::models::messages;

fn translate(text: &str) -> Compilation {
    let mut library = hyd::LibraryPath::new();
    let options = CompilerOptions { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
    let compilation = compile(&mut library, "case.hyd", text, &options);
    assert!(!compilation.has_errors(), "{}", messages(&compilation));
    compilation
}

fn run(text: &str, stop: f64, names: &[&str]) -> Trajectory {
    let mut system = translate(text).model.expect("translated").instantiate();
    let options = Options {
        sensitivity: names.iter().map(|name| name.to_string()).collect(),
        intervals: 100,
        ..Options::new(0.0, stop).with_tolerance(1e-9)
    };
    let mut rows = Trajectory::new();
    simulate(&mut system, &options, &mut rows, &|| false).unwrap_or_else(|error| panic!("{error}"));
    rows
}

/// Derivative of `f` by its `k`-th argument: central differences, two steps, extrapolated.
fn derivative<const N: usize>(f: &dyn Fn([f64; N]) -> f64, at: [f64; N], k: usize) -> f64 {
    let central = |h: f64| {
        let (mut above, mut below) = (at, at);
        above[k] += h;
        below[k] -= h;
        (f(above) - f(below)) / (2.0 * h)
    };
    let h = 1e-3 * at[k].abs().max(1e-2);
    (4.0 * central(0.5 * h) - central(h)) / 3.0
}

/// Compares `d(variable)/d(name)` with the closed form at some of the times.
fn compare<const N: usize>(
    rows: &Trajectory,
    variable: &str,
    names: [&str; N],
    at: [f64; N],
    closed: &dyn Fn(f64, [f64; N]) -> f64,
    (times, tolerance): (&[f64], f64),
) {
    for &t in times {
        let value = rows.series(variable).expect("recorded").value(t, Side::After);
        assert!((value - closed(t, at)).abs() < tolerance, "{variable} at {t}: {value}, not {}", closed(t, at));
        for (k, name) in names.iter().enumerate() {
            let column = format!("d({variable})/d({name})");
            let found = rows.series(&column).unwrap_or_else(|| panic!("no {column}")).value(t, Side::After);
            let expected = derivative(&|p| closed(t, p), at, k);
            let error = (found - expected).abs() / (1.0 + expected.abs());
            assert!(error < tolerance, "{column} at {t}: {found}, not {expected}");
        }
    }
}

const TIMES: [f64; 5] = [0.0, 0.13, 0.5, 0.77, 1.0];

#[test]
fn forced_decay() {
    let text = "model M
  parameter Real a = 2; parameter Real b = 3; parameter Real w = 5; parameter Real x0 = 0.7;
  Real x(start = x0, fixed = true);
  Real y = b*x + a;
equation
  der(x) = -a*x + b*sin(w*time);
end M;";
    let rows = run(text, 1.0, &["a", "b", "w", "x0"]);
    let x = |t: f64, [a, b, w, x0]: [f64; 4]| {
        let d = a * a + w * w;
        (x0 + b * w / d) * (-a * t).exp() + b * (a * (w * t).sin() - w * (w * t).cos()) / d
    };
    let (names, at) = (["a", "b", "w", "x0"], [2.0, 3.0, 5.0, 0.7]);
    compare(&rows, "x", names, at, &x, (&TIMES, 1e-6));
    compare(&rows, "y", names, at, &|t, p| p[1] * x(t, p) + p[0], (&TIMES, 1e-6));
}

#[test]
fn start_values_and_dependent_parameters() {
    let text = "model M
  parameter Real k = 4; parameter Real c = 2*k;
  Real x(start = 1.5, fixed = true); Real v(start = 0, fixed = true);
equation
  der(x) = v; der(v) = -c*x;
end M;";
    let rows = run(text, 1.0, &["k", "x", "v"]);
    // `c` follows `k`.
    let x = |t: f64, [k, x0, v0]: [f64; 3]| {
        let w = (2.0 * k).sqrt();
        x0 * (w * t).cos() + v0 / w * (w * t).sin()
    };
    compare(&rows, "x", ["k", "x", "v"], [4.0, 1.5, 0.0], &x, (&TIMES, 1e-6));
}

#[test]
fn algebraic_loop() {
    // z*z = a*x, x' = -z: sqrt(x) falls linearly.
    let text = "model M
  parameter Real a = 0.8; parameter Real x0 = 2;
  Real x(start = x0, fixed = true); Real z(start = 1);
equation
  z*z + 0.0*sin(z) = a*x;
  der(x) = -z;
end M;";
    let rows = run(text, 1.0, &["a", "x0"]);
    let root = |t: f64, [a, x0]: [f64; 2]| x0.sqrt() - 0.5 * a.sqrt() * t;
    let (names, at) = (["a", "x0"], [0.8, 2.0]);
    compare(&rows, "x", names, at, &|t, p| root(t, p).powi(2), (&TIMES, 1e-6));
    compare(&rows, "z", names, at, &|t, p| p[0].sqrt() * root(t, p), (&TIMES, 1e-6));
}

#[test]
fn parameter_solved_at_the_start() {
    // x'(0) = 0 makes p = u/x0; then x' = -p x + u (1 + t).
    let text = "model M
  parameter Real u = 1.2; parameter Real x0 = 0.6;
  parameter Real p(fixed = false, start = 1);
  Real x(start = x0, fixed = true);
equation
  der(x) = -p*x + u*(1 + time);
initial equation
  der(x) = 0;
end M;";
    let rows = run(text, 1.0, &["u", "x0"]);
    let x = |t: f64, [u, x0]: [f64; 2]| {
        let p = u / x0;
        // Particular solution u/p + u/p*t - u/p^2.
        let particular = |t: f64| u / p + u / p * t - u / (p * p);
        particular(t) + (x0 - particular(0.0)) * (-p * t).exp()
    };
    compare(&rows, "x", ["u", "x0"], [1.2, 0.6], &x, (&TIMES, 1e-6));
}

const BALL: &str = "model Ball
  parameter Real g = 9.81; parameter Real e = 0.8; parameter Real h0 = 1;
  Real h(start = h0, fixed = true); Real v(start = 0, fixed = true);
  discrete Real last(start = 0, fixed = true);
equation
  der(h) = v;
  der(v) = -g;
  when h < 0 then
    reinit(v, -e*pre(v));
    last = time;
  end when;
end Ball;";

/// Height, speed and time of the last bounce.
fn ball(t: f64, [g, e, h0]: [f64; 3]) -> (f64, f64, f64) {
    let (mut start, mut height, mut speed) = (0.0, h0, 0.0);
    loop {
        let fall = (speed + (speed * speed + 2.0 * g * height).sqrt()) / g;
        if start + fall > t {
            let s = t - start;
            return (height + speed * s - 0.5 * g * s * s, speed - g * s, start);
        }
        speed = e * (g * fall - speed);
        (start, height) = (start + fall, 0.0);
    }
}

#[test]
fn bouncing_ball() {
    let rows = run(BALL, 2.0, &["g", "e", "h0"]);
    let (names, at) = (["g", "e", "h0"], [9.81, 0.8, 1.0]);
    let times = [0.3, 0.7, 1.1, 1.5, 2.0];
    compare(&rows, "h", names, at, &|t, p| ball(t, p).0, (&times, 1e-6));
    compare(&rows, "v", names, at, &|t, p| ball(t, p).1, (&times, 1e-6));
    compare(&rows, "last", names, at, &|t, p| ball(t, p).2, (&times, 1e-6));
}

#[test]
fn thermostat() {
    let text = "model Thermostat
  parameter Real k = 1.3; parameter Real P = 60; parameter Real low = 18; parameter Real high = 22;
  Real T(start = 20, fixed = true); Boolean on(start = true, fixed = true);
equation
  der(T) = (if on then P else 0) - k*T;
  on = if pre(on) then T < high else T <= low;
end Thermostat;";
    let rows = run(text, 1.0, &["k", "P", "low", "high"]);
    let temperature = |t: f64, [k, power, low, high]: [f64; 4]| {
        let (mut on, mut start, mut value) = (true, 0.0, 20.0);
        loop {
            let (goal, limit) = if on { (power / k, high) } else { (0.0, low) };
            let duration = f64::ln((value - goal) / (limit - goal)) / k;
            if start + duration > t {
                return goal + (value - goal) * (-k * (t - start)).exp();
            }
            (start, value, on) = (start + duration, limit, !on);
        }
    };
    let (names, at) = (["k", "P", "low", "high"], [1.3, 60.0, 18.0, 22.0]);
    compare(&rows, "T", names, at, &temperature, (&[0.05, 0.3, 0.61, 1.0], 1e-6));
}

#[test]
fn instants_that_depend_on_parameters() {
    let text = "model M
  parameter Real ton = 0.3; parameter Real a = 2; parameter Real b = 0.5; parameter Real c = 0.1;
  Real x(start = 1, fixed = true);
  Real u = if time >= ton then a else 0;
equation
  der(x) = u - x;
  when time >= 2*ton then
    reinit(x, b*pre(x) + c*time);
  end when;
end M;";
    let rows = run(text, 1.0, &["ton", "a", "b", "c"]);
    let x = |t: f64, [ton, a, b, c]: [f64; 4]| {
        let first = |t: f64| if t < ton { (-t).exp() } else { a + ((-ton).exp() - a) * (ton - t).exp() };
        if t < 2.0 * ton {
            return first(t);
        }
        let jumped = b * first(2.0 * ton) + c * 2.0 * ton;
        a + (jumped - a) * (2.0 * ton - t).exp()
    };
    compare(&rows, "x", ["ton", "a", "b", "c"], [0.3, 2.0, 0.5, 0.1], &x, (&[0.1, 0.45, 0.59, 0.61, 1.0], 1e-6));
}

/// `z^3 - 3z = x` is followed from below until the root ends at `z = -1, x = 2`; the run goes on at `z = 2`.  With `dx = a dt` the integral
/// of `z` over time is that of `z (3 z^2 - 3)/a` over `z`.
#[test]
fn a_loop_that_loses_its_root() {
    let text = "model M
  parameter Real a = 1, x0 = -1.5;
  Real x(start = x0, fixed = true), y(start = 0, fixed = true), z(start = -2);
equation
  der(x) = a;
  der(y) = z;
  z^3 - 3*z = x;
end M;";
    let rows = run(text, 8.0, &["a", "x0"]);
    let root = |x: f64| match x < 2.0 {
        true => -2.0 * ((-x / 2.0).acos() / 3.0).cos(),
        false => 2.0 * ((x / 2.0).acosh() / 3.0).cosh(),
    };
    let integral = |z: f64| 0.75 * z.powi(4) - 1.5 * z * z;
    let y = |t: f64, [a, x0]: [f64; 2]| {
        let (first, last) = (root(x0), root(x0 + a * t));
        let jump = if x0 + a * t < 2.0 { 0.0 } else { integral(-1.0) - integral(2.0) };
        (integral(last) - integral(first) + jump) / a
    };
    compare(&rows, "y", ["a", "x0"], [1.0, -1.5], &y, (&[1.04, 3.04, 4.0, 8.0], 1e-6));
    let z = |t: f64, [a, x0]: [f64; 2]| root(x0 + a * t);
    // Rows between steps interpolate, which is rough close to the fold.
    compare(&rows, "z", ["a", "x0"], [1.0, -1.5], &z, (&[3.52, 8.0], 1e-6));
}

#[test]
fn sampled_values() {
    let text = "model M
  parameter Real T = 0.3; parameter Real k = 2;
  Real x(start = 1, fixed = true); discrete Real held(start = 0, fixed = true);
equation
  der(x) = k*x - held;
  when sample(T, T) then
    held = x;
  end when;
end M;";
    let rows = run(text, 1.0, &["T", "k"]);
    let x = |t: f64, [period, k]: [f64; 2]| {
        let (mut start, mut value, mut held) = (0.0, 1.0, 0.0);
        loop {
            let at = |s: f64| held / k + (value - held / k) * f64::exp(k * s);
            if start + period > t {
                return at(t - start);
            }
            value = at(period);
            (start, held) = (start + period, value);
        }
    };
    compare(&rows, "x", ["T", "k"], [0.3, 2.0], &x, (&[0.2, 0.5, 0.8, 1.0], 1e-6));
}

#[test]
fn pendulum_of_index_three() {
    let text = "model M
  parameter Real L = 1; parameter Real g = 9.81;
  Real x(start = 0.6, fixed = true); Real y(start = -0.8); Real vx(start = 0, fixed = true); Real vy; Real F;
equation
  der(x) = vx; der(y) = vy;
  der(vx) = -F*x; der(vy) = -F*y - g;
  x^2 + y^2 = L^2;
end M;";
    let rows = run(text, 1.0, &["g", "L"]);
    // The angle by an explicit method in small steps.
    let x = |t: f64, [g, length]: [f64; 2]| {
        let (mut angle, mut speed) = (f64::asin(0.6 / length), 0.0);
        let steps = 4000;
        let h = t / f64::from(steps);
        let f = |angle: f64| -g / length * angle.sin();
        for _ in 0..steps {
            let (a1, s1) = (speed, f(angle));
            let (a2, s2) = (speed + 0.5 * h * s1, f(angle + 0.5 * h * a1));
            let (a3, s3) = (speed + 0.5 * h * s2, f(angle + 0.5 * h * a2));
            let (a4, s4) = (speed + h * s3, f(angle + h * a3));
            angle += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
            speed += h / 6.0 * (s1 + 2.0 * s2 + 2.0 * s3 + s4);
        }
        length * angle.sin()
    };
    compare(&rows, "x", ["g", "L"], [9.81, 1.0], &x, (&[0.2, 0.5, 0.7], 2e-6));
}

#[test]
fn refusals_say_why() {
    let text = "model M
  parameter Integer n = 2; parameter Real a = 1; final parameter Real b = 2*a; constant Real c = 3;
  Real x[n](each start = 1, each fixed = true);
equation
  for i in 1:n loop
    der(x[i]) = -a*b*c*x[i];
  end for;
end M;";
    let compilation = translate(text);
    for (name, part) in [
        ("n", "sizes or structure"),
        ("b", "computed or fixed"),
        ("c", "computed or fixed"),
        ("nothing", "no parameter or variable of this name"),
    ] {
        let mut system = compilation.model.as_ref().expect("translated").instantiate();
        let options = Options { sensitivity: vec!["a".to_string(), name.to_string()], ..Options::new(0.0, 1.0) };
        let result = simulate(&mut system, &options, &mut Trajectory::new(), &|| false);
        let Err(SolveError::Option(error)) = result else { panic!("`{name}` was accepted") };
        let message = error.to_string();
        assert!(message.contains(&format!("`{name}`")) && message.contains(part), "{message}");
    }
}
