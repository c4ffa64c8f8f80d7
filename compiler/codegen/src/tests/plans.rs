//! Residuals and Jacobians of compiled plans against direct evaluation and central differences, in every form of code.
#![allow(clippy::unwrap_used, clippy::disallowed_methods)]

use hyd_equations::Role;
use hyd_flat::VarId;
use hyd_symbolic::Function;
use hyd_system::DaeSystem;

use super::support::Maker;
use crate::{Backend, Instance, Options};

/// A line of `n` cells: flows `q[k]` between pressures, momentum-like products `w[k]` of neighbouring flows, and
/// `c*der(p[k]) = q[k] - q[k+1] + 0.1*w[k]`.  Every third cell stores the negative of its pressure.
fn line(n: u32) -> Maker {
    let mut m = Maker::new();
    let p = m.array("p", n, Role::State);
    let q = m.array("q", n + 1, Role::Algebraic);
    let w = m.array("w", n, Role::Algebraic);
    let c = m.scalar("c", Role::Parameter);
    let feed = m.scalar("feed", Role::Parameter);
    m.bind(c, 0, |e| e.number(0.7));
    m.bind(feed, 1, |e| {
        let c = e.var(c);
        let three = e.c(3.0);
        e.mul(three, c)
    });
    let flow = |m: &mut Maker, k: usize, left: (VarId, bool), right: (VarId, bool)| {
        m.assign(q[k], 0, "q = (pl - pr)/(1 + abs(pl - pr))", |e| {
            let l = if left.1 { e.minus(left.0) } else { e.var(left.0) };
            let r = if right.1 { e.minus(right.0) } else { e.var(right.0) };
            let difference = e.sub(l, r);
            let size = e.call(Function::Abs, difference);
            let one = e.c(1.0);
            let below = e.add(one, size);
            e.div(difference, below)
        });
    };
    let cell = |k: usize| (p[k], k.is_multiple_of(3));
    let n = n as usize;
    flow(&mut m, 0, (feed, false), cell(0));
    for k in 1..n {
        flow(&mut m, k, cell(k - 1), cell(k));
    }
    flow(&mut m, n, cell(n - 1), (c, false));
    for k in 0..n {
        m.assign(w[k], 1, "w = sin(q)*qn*time", |e| {
            let (a, b, t) = (e.var(q[k]), e.var(q[k + 1]), e.time());
            let s = e.call(Function::Sin, a);
            let product = e.mul(s, b);
            e.mul(product, t)
        });
    }
    for k in 0..n {
        let (v, negative) = cell(k);
        m.solve(v, true, "c*der(p) = q - qn + 0.1*w", |e| {
            let (a, b, extra, c) = (e.var(q[k]), e.var(q[k + 1]), e.var(w[k]), e.var(c));
            let rate = if negative {
                let operand = hyd_flat::Operand::new(hyd_flat::Target::Der(v)).negate();
                e.read(operand)
            } else {
                e.der(v)
            };
            let left = e.mul(c, rate);
            let tenth = e.c(0.1);
            let (flow, extra) = (e.sub(a, b), e.mul(tenth, extra));
            let right = e.add(flow, extra);
            e.sub(left, right)
        });
    }
    m
}

/// The residual of [`line`] written out.
fn residual(n: usize, t: f64, y: &[f64], yp: &[f64], (c, feed): (f64, f64)) -> Vec<f64> {
    let sign = |k: usize| if k.is_multiple_of(3) { -1.0 } else { 1.0 };
    let p = |k: usize| sign(k) * y[k];
    let f = |l: f64, r: f64| (l - r) / (1.0 + (l - r).abs());
    let mut q = vec![f(feed, p(0))];
    q.extend((1..n).map(|k| f(p(k - 1), p(k))));
    q.push(f(p(n - 1), c));
    let w = |k: usize| q[k].sin() * q[k + 1] * t;
    (0..n).map(|k| c * sign(k) * yp[k] - (q[k] - q[k + 1] + 0.1 * w(k))).collect()
}

fn forms() -> [Options; 4] {
    let form = |straight_nodes, backend| Options { straight_nodes, backend };
    [form(4000, Backend::Native), form(0, Backend::Native), form(4000, Backend::Vm), form(0, Backend::Vm)]
}

fn point(n: usize) -> (Vec<f64>, Vec<f64>) {
    let y = (0..n).map(|k| (k as f64 * 1.7).sin() + 0.3).collect();
    (y, (0..n).map(|k| (k as f64 * 0.9).cos()).collect())
}

fn dense_jacobian(system: &mut Instance, t: f64, y: &[f64], yp: &[f64]) -> [Vec<Vec<f64>>; 2] {
    let structure = system.structure().clone();
    let mut state = vec![f64::NAN; structure.state_pattern.entries()];
    let mut rate = vec![f64::NAN; structure.rate_pattern.entries()];
    system.jacobian(t, y, yp, &mut state, &mut rate);
    let dense = |pattern: &hyd_system::Pattern, values: &[f64]| {
        let mut matrix = vec![vec![0.0; y.len()]; y.len()];
        let entries = (0..pattern.columns()).flat_map(|c| pattern.column(c).map(move |k| (k, c)));
        for (k, c) in entries {
            matrix[pattern.row_indices[k] as usize][c] = values[k];
        }
        matrix
    };
    [dense(&structure.state_pattern, &state), dense(&structure.rate_pattern, &rate)]
}

#[test]
fn residual_is_the_written_out_formula_in_every_form() {
    let n = 23;
    for options in forms() {
        let mut system = line(n as u32).compile(&options);
        system.bind(0.0).unwrap();
        let (y, yp) = point(n);
        let mut out = vec![0.0; n];
        system.residual(0.8, &y, &yp, &mut out);
        let expected = residual(n, 0.8, &y, &yp, (0.7, 2.1));
        for (a, b) in out.iter().zip(&expected) {
            assert!((a - b).abs() < 1e-14, "{a} {b} {options:?}");
        }
    }
}

#[test]
fn jacobian_agrees_with_central_differences_in_every_form() {
    let n = 11;
    let (y, yp) = point(n);
    for options in forms() {
        let mut system = line(n as u32).compile(&options);
        system.bind(0.0).unwrap();
        let [state, rate] = dense_jacobian(&mut system, 0.8, &y, &yp);
        // Truncation h^2 and rounding eps/h balance near 1e-10.
        let h = 1e-5;
        for c in 0..n {
            let shifted = |base: &[f64], by: f64| {
                let mut list = base.to_vec();
                list[c] += by;
                list
            };
            let up = residual(n, 0.8, &shifted(&y, h), &yp, (0.7, 2.1));
            let down = residual(n, 0.8, &shifted(&y, -h), &yp, (0.7, 2.1));
            let up_rate = residual(n, 0.8, &y, &shifted(&yp, h), (0.7, 2.1));
            let down_rate = residual(n, 0.8, &y, &shifted(&yp, -h), (0.7, 2.1));
            for r in 0..n {
                let by_state = (up[r] - down[r]) / (2.0 * h);
                let by_rate = (up_rate[r] - down_rate[r]) / (2.0 * h);
                assert!((state[r][c] - by_state).abs() < 1e-8, "{r} {c} {} {by_state} {options:?}", state[r][c]);
                assert!((rate[r][c] - by_rate).abs() < 1e-8, "{r} {c} {} {by_rate} {options:?}", rate[r][c]);
            }
        }
    }
}

#[test]
fn code_and_kernels_of_a_line_do_not_grow_with_its_cells() {
    let statistics = |n| {
        let options = Options { straight_nodes: 0, ..Options::default() };
        line(n).model(&options).unwrap().statistics()
    };
    // From here on all displacements have the same width.
    let (small, large) = (statistics(150), statistics(900));
    assert_eq!(small, large);
    assert!(small.code_bytes > 0 && small.templates == 3, "{small:?}");
}

#[test]
fn outputs_hold_assigned_variables_unknowns_and_rates() {
    let n = 5;
    let (y, yp) = point(n);
    for options in forms() {
        let mut system = line(n as u32).compile(&options);
        system.bind(0.0).unwrap();
        let mut row = vec![0.0; system.structure().outputs];
        system.outputs(0.8, &y, &yp, &mut row);
        let tables = system.tables().clone();
        let value = |name: &str| {
            let (variable, k) = tables.find(name).unwrap();
            match variable.sources[k].place {
                hyd_system::Place::Output(i) => row[i as usize],
                hyd_system::Place::Parameter(i) => system.parameters()[i as usize],
                hyd_system::Place::Constant(value) => value,
            }
        };
        assert_eq!(value("p[2]"), y[1]);
        assert_eq!(value("der(p[4])"), yp[3]);
        assert_eq!(value("feed"), 3.0 * 0.7);
        let difference: f64 = 3.0 * 0.7 + y[0];
        assert_eq!(value("q[1]"), difference / (1.0 + difference.abs()));
        assert_eq!(tables.unknown_name(2), "p[3]");
        assert_eq!(tables.row_equation(0).unwrap().text.as_ref(), "c*der(p) = q - qn + 0.1*w");
    }
}

#[test]
fn instances_run_on_threads_with_their_own_parameters() {
    let system = line(4).compile(&Options::default());
    let (y, yp) = point(4);
    let run = |mut system: Instance, c: f64, y: Vec<f64>, yp: Vec<f64>| {
        let index = 0;
        system.set_parameter(index, c).unwrap();
        system.bind(0.0).unwrap();
        let mut out = vec![0.0; 4];
        system.residual(0.1, &y, &yp, &mut out);
        out
    };
    let values = [0.5, 0.9];
    let threads: Vec<_> = values
        .iter()
        .map(|&c| {
            let (system, y, yp) = (system.clone(), y.clone(), yp.clone());
            std::thread::spawn(move || run(system, c, y, yp))
        })
        .collect();
    for (thread, c) in threads.into_iter().zip(values) {
        let expected = residual(4, 0.1, &y, &yp, (c, 3.0 * c));
        let found = thread.join().unwrap();
        assert!(found.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-14));
    }
}
