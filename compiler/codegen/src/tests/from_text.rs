//! Model texts through all stages, integrated by a small solver of this file and compared with analytic solutions.
//!
//! The classical Runge-Kutta method (Kutta 1901) on the states; at each stage rates and algebraic unknowns come from
//! Newton iterations on the residual with the compiled Jacobian.
#![allow(clippy::unwrap_used, clippy::disallowed_methods)]

use std::sync::Arc;

use hyd_equations::differentiate;
use hyd_instance::{ClassTable, SourceText, Sources, instantiate};
use hyd_system::{DaeSystem, EventPhase, Pattern, Place};

use crate::{Backend, CompiledModel, Instance, Jacobians, Options, generate};

struct NoLibrary;

impl Sources for NoLibrary {
    fn find(&mut self, _: &[Arc<str>]) -> Result<Option<SourceText>, String> {
        Ok(None)
    }
}

fn compile(text: &str, options: &Options) -> Instance {
    model(text, options).instantiate()
}

fn model(text: &str, options: &Options) -> CompiledModel {
    let mut sources = NoLibrary;
    let mut table = ClassTable::new(&mut sources);
    let class = table.add_main("test.hyd", text)[0];
    let (tree, mut scopes) = instantiate(table, class, Vec::new()).map_err(|table| table.messages).unwrap();
    let flat = hyd_flat::flatten(&tree, &mut scopes, &[], &[]);
    assert!(scopes.table.messages.iter().next().is_none(), "{:?}", scopes.table.messages);
    assert!(flat.diagnostics.is_empty(), "{:?}", flat.diagnostics);
    let outcome = hyd_equations::sort(flat.value);
    let mut sorted = outcome.value.unwrap_or_else(|| panic!("{:?}", outcome.diagnostics));
    let (simulation, initial) = (sorted.simulation.clone(), sorted.initial.clone());
    let simulation = differentiate(&mut sorted.system, &simulation);
    let initial = differentiate(&mut sorted.system, &initial);
    let jacobians = Jacobians { simulation: &simulation, initial: &initial };
    generate(&sorted, jacobians, &scopes.table.files, options).unwrap()
}

fn forms() -> [Options; 3] {
    let form = |straight_nodes, backend| Options { straight_nodes, backend };
    [form(4000, Backend::Native), form(0, Backend::Native), form(0, Backend::Vm)]
}

/// Solves `a x = b` by elimination with row exchanges.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap();
        a.swap(k, pivot);
        b.swap(k, pivot);
        let (top, below) = a.split_at_mut(k + 1);
        for (i, row) in below.iter_mut().enumerate() {
            let factor = row[k] / top[k][k];
            row.iter_mut().zip(&top[k]).for_each(|(value, pivot)| *value -= factor * pivot);
            b[k + 1 + i] -= factor * b[k];
        }
    }
    for k in (0..n).rev() {
        let sum: f64 = (k + 1..n).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - sum) / a[k][k];
    }
    b
}

fn scatter(pattern: &Pattern, values: &[f64], wanted: impl Fn(usize) -> bool, matrix: &mut [Vec<f64>]) {
    for c in (0..pattern.columns()).filter(|&c| wanted(c)) {
        pattern.column(c).for_each(|k| matrix[pattern.row_indices[k] as usize][c] = values[k]);
    }
}

/// Rates of the states and values of the algebraic unknowns at given states.
fn close(system: &mut Instance, t: f64, y: &mut [f64], yp: &mut [f64]) {
    let structure = system.structure().clone();
    let n = y.len();
    let mut state = vec![0.0; structure.state_pattern.entries()];
    let mut rate = vec![0.0; structure.rate_pattern.entries()];
    let mut out = vec![0.0; n];
    for _ in 0..8 {
        system.residual(t, y, yp, &mut out);
        system.jacobian(t, y, yp, &mut state, &mut rate);
        let mut matrix = vec![vec![0.0; n]; n];
        scatter(&structure.state_pattern, &state, |c| !structure.differential[c], &mut matrix);
        scatter(&structure.rate_pattern, &rate, |c| structure.differential[c], &mut matrix);
        let step = solve(matrix, out.clone());
        for k in 0..n {
            if structure.differential[k] { yp[k] -= step[k] } else { y[k] -= step[k] }
        }
    }
}

fn start(system: &mut Instance) -> (Vec<f64>, Vec<f64>) {
    system.bind(0.0).unwrap();
    let structure = system.structure().clone();
    let n = structure.initial.unknowns;
    let (mut z, mut out) = (vec![0.0; n], vec![0.0; n]);
    let mut values = vec![0.0; structure.initial.pattern.entries()];
    let (mut y, mut yp) = (vec![0.0; structure.unknowns], vec![0.0; structure.unknowns]);
    system.initial_guess(0.0, &mut z).unwrap();
    for _ in 0..2 {
        for _ in 0..20 {
            system.initial_residual(0.0, &z, &mut out).unwrap();
            system.initial_jacobian(0.0, &z, &mut values).unwrap();
            let mut matrix = vec![vec![0.0; n]; n];
            scatter(&structure.initial.pattern, &values, |_| true, &mut matrix);
            let step = solve(matrix, out.clone());
            z.iter_mut().zip(&step).for_each(|(z, step)| *z -= step);
        }
        system.initial_store(0.0, &z, &mut y, &mut yp).unwrap();
        system.event_pass(EventPhase::Initial, 0.0, &mut y, &yp).unwrap();
    }
    (y, yp)
}

/// One Runge-Kutta step of the states.
fn step(system: &mut Instance, t: f64, h: f64, y: &mut [f64], yp: &mut [f64]) {
    let base = y.to_vec();
    let differential = system.structure().differential.clone();
    let mut sum = vec![0.0; y.len()];
    for (offset, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
        for k in (0..y.len()).filter(|&k| differential[k]) {
            y[k] = base[k] + offset * h * yp[k];
        }
        close(system, t + offset * h, y, yp);
        sum.iter_mut().zip(yp.iter()).for_each(|(sum, rate)| *sum += weight * rate);
    }
    for k in (0..y.len()).filter(|&k| differential[k]) {
        y[k] = base[k] + h / 6.0 * sum[k];
    }
    close(system, t + h, y, yp);
}

fn value(system: &mut Instance, name: &str, t: f64, y: &[f64], yp: &[f64]) -> f64 {
    let mut row = vec![0.0; system.structure().outputs];
    system.outputs(t, y, yp, &mut row);
    let tables = system.tables().clone();
    let (variable, k) = tables.find(name).unwrap_or_else(|| panic!("no {name}"));
    let source = variable.sources[k];
    let value = match source.place {
        Place::Output(index) => row[index as usize],
        Place::Parameter(index) => system.parameters()[index as usize],
        Place::Constant(value) => value,
    };
    if source.negated { -value } else { value }
}

#[test]
fn an_oscillator_moves_as_the_cosine() {
    let text = "model M parameter Real m = 2; parameter Real c = 8*m/2; Real x(start=1, fixed=true); Real v(start=0, fixed=true);
        Real f; Real a; Real twice; Real minus;
        equation der(x) = v; a = f/m; der(v) = a; f = -c*x; twice = 2*x; minus + x = 0; end M;";
    for options in forms() {
        let mut system = compile(text, &options);
        let (mut y, mut yp) = start(&mut system);
        let steps = 400;
        for k in 0..steps {
            step(&mut system, f64::from(k) / 400.0, 1.0 / 400.0, &mut y, &mut yp);
        }
        // x = cos(2 t), from c/m = 4; the method errs by about h^4.
        for (name, expected) in [
            ("x", 2f64.cos()),
            ("twice", 2.0 * 2f64.cos()),
            ("minus", -(2f64.cos())),
            ("der(v)", -4.0 * 2f64.cos()),
            ("f", -8.0 * 2f64.cos()),
        ] {
            let found = value(&mut system, name, 1.0, &y, &yp);
            assert!((found - expected).abs() < 1e-8, "{name}: {found} {expected} {options:?}");
        }
    }
}

#[test]
fn implicit_equations_and_initial_equations_are_solved() {
    // At rest: u + u^3 = 2 gives u = 1, and x = u.  Then der(x) = -(x - u) + step, with the step in 2*u at t = 0.5.
    let text = "model M Real x(start=0.5); Real u(start=0.5); Real s;
        initial equation der(x) = 0;
        equation u + u^3 = 2; s = if time >= 0.5 then 1 else 0; der(x) = u - x + s; end M;";
    for options in forms() {
        let mut system = compile(text, &options);
        let (mut y, mut yp) = start(&mut system);
        assert!((value(&mut system, "x", 0.0, &y, &yp) - 1.0).abs() < 1e-12);
        close(&mut system, 0.0, &mut y, &mut yp);
        assert!((value(&mut system, "u", 0.0, &y, &yp) - 1.0).abs() < 1e-12);
        assert_eq!(system.next_time_event(0.0).t, 0.5);
        let change = system.event_pass(EventPhase::First, 0.5, &mut y, &yp).unwrap();
        assert!(change.changed);
        close(&mut system, 0.5, &mut y, &mut yp);
        for k in 0..100 {
            step(&mut system, 0.5 + f64::from(k) / 100.0, 0.01, &mut y, &mut yp);
        }
        let expected = 2.0 - (-1f64).exp();
        let found = value(&mut system, "x", 1.5, &y, &yp);
        assert!((found - expected).abs() < 1e-9, "{found} {expected} {options:?}");
    }
}

#[test]
fn a_line_of_cells_decays_as_its_mode_and_its_code_does_not_grow() {
    let text = |n: usize| {
        format!(
            "model Line parameter Integer n = {n}; parameter Real k = 2; Real T[n]; Real q[n + 1];
             initial equation for i in 1:n loop T[i] = sin(3.141592653589793*i/(n + 1)); end for;
             equation q[1] = k*(0 - T[1]); for i in 2:n loop q[i] = k*(T[i-1] - T[i]); end for; q[n + 1] = k*T[n];
             for i in 1:n loop der(T[i]) = q[i] - q[i + 1]; end for; end Line;"
        )
    };
    for options in forms() {
        let n = 9;
        let mut system = compile(&text(n), &options);
        let (mut y, mut yp) = start(&mut system);
        for k in 0..50 {
            step(&mut system, f64::from(k) / 50.0, 0.02, &mut y, &mut yp);
        }
        // Lowest eigenvalue of the second difference: 4 sin^2(pi/(2(n+1))).
        let rate = 2.0 * 4.0 * (std::f64::consts::PI / 20.0).sin().powi(2);
        for i in 1..=n {
            let expected = (std::f64::consts::PI * i as f64 / 10.0).sin() * (-rate).exp();
            let found = value(&mut system, &format!("T[{i}]"), 1.0, &y, &yp);
            assert!((found - expected).abs() < 1e-9, "{i}: {found} {expected} {options:?}");
        }
    }
    let options = Options { straight_nodes: 0, ..Options::default() };
    let statistics = |n| model(&text(n), &options).statistics();
    assert_eq!(statistics(1_000), statistics(4_000));
}

#[test]
fn a_ball_bounces_and_a_clock_ticks() {
    let text =
        "model Ball Real h(start=1, fixed=true); Real v(start=0, fixed=true); Integer bounces(start=0, fixed=true);
        discrete Real next(start=0.3, fixed=true); discrete Real seen(start=-1, fixed=true); Boolean low;
        equation der(h) = v; der(v) = -9.81; low = h < 0.25;
        when h <= 0 then reinit(v, -0.5*pre(v)); bounces = pre(bounces) + 1; end when;
        when time >= pre(next) then next = pre(next) + 0.3; seen = h; end when;
        assert(h > -0.5, \"below the floor\"); end Ball;";
    for options in forms() {
        let mut system = compile(text, &options);
        let (mut y, mut yp) = start(&mut system);
        close(&mut system, 0.0, &mut y, &mut yp);
        assert_eq!(system.next_time_event(0.0).t, 0.3);
        let settle = |system: &mut Instance, t: f64, y: &mut [f64], yp: &mut [f64]| {
            let mut phase = EventPhase::First;
            for _ in 0..5 {
                let change = system.event_pass(phase, t, y, yp).unwrap();
                if !change.changed && !change.reinitialised {
                    return;
                }
                close(system, t, y, yp);
                phase = EventPhase::Iterate;
            }
            panic!("no end of the event iteration");
        };
        // Free fall is a parabola, so that one step of the method is exact.
        step(&mut system, 0.0, 0.3, &mut y, &mut yp);
        settle(&mut system, 0.3, &mut y, &mut yp);
        let height = 1.0 - 9.81 / 2.0 * 0.09;
        assert!((value(&mut system, "seen", 0.3, &y, &yp) - height).abs() < 1e-12);
        assert_eq!(system.next_time_event(0.3).t, 0.6);
        assert_eq!(value(&mut system, "low", 0.3, &y, &yp), 0.0);
        let mut roots = vec![0.0; system.structure().roots];
        let contact = (2.0f64 / 9.81).sqrt() + 1e-12;
        step(&mut system, 0.3, contact - 0.3, &mut y, &mut yp);
        system.roots(contact, &y, &yp, &mut roots);
        assert!(roots.iter().all(|&root| root > 0.0), "{roots:?}");
        settle(&mut system, contact, &mut y, &mut yp);
        let speed = 0.5 * (2.0f64 * 9.81).sqrt();
        assert!((value(&mut system, "v", contact, &y, &yp) - speed).abs() < 1e-9);
        assert_eq!(value(&mut system, "bounces", contact, &y, &yp), 1.0);
        assert_eq!(value(&mut system, "low", contact, &y, &yp), 1.0);
        let mut reports = Vec::new();
        system.assertions(contact, &y, &yp, &mut reports);
        assert!(reports.is_empty());
    }
}

#[test]
fn derivatives_are_listed_under_the_names_of_the_text() {
    // One of the two names is eliminated; both orders of declaration are tried.
    for order in ["Real a(start=3, fixed=true); Real b;", "Real b; Real a(start=3, fixed=true);"] {
        let text = format!("model M {order} equation der(a) = -2*a; a + b = 0; end M;");
        let mut system = compile(&text, &Options::default());
        let (mut y, mut yp) = start(&mut system);
        close(&mut system, 0.0, &mut y, &mut yp);
        for (name, expected) in [("a", 3.0), ("b", -3.0), ("der(a)", -6.0)] {
            assert_eq!(value(&mut system, name, 0.0, &y, &yp), expected, "{name}, {order}");
        }
    }
}
