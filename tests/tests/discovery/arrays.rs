//! Models with arrays: an effect is in each element, or in one of them.

use crate::plain::{Bench, names};

const ROD: Bench = Bench {
    name: "rod",
    model: "model Rod \"four pieces of a rod, heated at one end\"
  constant Integer n = 4;
  parameter Real P = 30;
  parameter Real T_1 = 300;
  parameter Real T_2 = 300;
  parameter Real T_3 = 300;
  parameter Real T_4 = 300;
  parameter Real G = 0.5;
  parameter Real C[n] = fill(50, n);
  parameter Real s = 1;
  Real T[n](start = {T_1, T_2, T_3, T_4}, each fixed = true);
  Real Q[n + 1];
equation
  Q[1] = P;
  for i in 1:n - 1 loop
    Q[i + 1] = G*(T[i] - T[i + 1]);
  end for;
  Q[n + 1] = 0;
  for i in 1:n loop
    s*C[i]*der(T[i]) = Q[i] - Q[i + 1];
  end for;
end Rod;
",
    class: "Rod",
    channels: &[("T1", "T[1]", 0.05), ("T2", "T[2]", 0.05), ("T3", "T[3]", 0.05), ("T4", "T[4]", 0.05)],
    conditions: &["T_1", "T_2", "T_3", "T_4", "P"],
    nuisances: &["G", "s"],
    shots: &[
        &[300.0, 300.0, 300.0, 300.0, 30.0],
        &[310.0, 310.0, 310.0, 310.0, 60.0],
        &[320.0, 320.0, 320.0, 320.0, 10.0],
        &[300.0, 300.0, 300.0, 300.0, 45.0],
        &[290.0, 290.0, 290.0, 290.0, 20.0],
    ],
    shown: |_, value| value,
    // All lose heat to air that is as warm as they are at the start.
    rates: |x, shot| {
        let q = |k: usize| 0.5 * (x[k] - x[k + 1]);
        let flows = [shot[4], q(0), q(1), q(2), 0.0];
        (0..4).map(|k| (flows[k] - flows[k + 1] - 0.05 * (x[k] - shot[0])) / 50.0).collect()
    },
    recorded: |_, value| value,
    without: &[],
    stop: 600.0,
};

#[test]
fn what_each_element_of_a_loop_loses() {
    names(&ROD, "named", "heat_leak", "each T", &[("k", 0.05)]);
}

#[test]
fn what_one_element_of_a_loop_loses() {
    let bench = Bench {
        name: "one-piece",
        rates: |x, shot| {
            let q = |k: usize| 0.5 * (x[k] - x[k + 1]);
            let flows = [shot[4], q(0), q(1), q(2), 0.0];
            (0..4)
                .map(|k| (flows[k] - flows[k + 1] - if k == 2 { 0.1 * (x[2] - shot[0]) } else { 0.0 }) / 50.0)
                .collect()
        },
        ..ROD
    };
    names(&bench, "named", "heat_leak", "T[3]", &[("k", 0.1)]);
}

/// The same without arrays: the pieces are numbered.
#[test]
fn what_each_of_numbered_variables_loses() {
    let bench = Bench {
        name: "numbered",
        model: "model Rod
  parameter Real P = 30;
  parameter Real T_1 = 300;
  parameter Real T_2 = 300;
  parameter Real T_3 = 300;
  parameter Real T_4 = 300;
  parameter Real G = 0.5;
  parameter Real C = 50;
  Real T1(start = T_1, fixed = true);
  Real T2(start = T_2, fixed = true);
  Real T3(start = T_3, fixed = true);
  Real T4(start = T_4, fixed = true);
equation
  C*der(T1) = P - G*(T1 - T2);
  C*der(T2) = G*(T1 - T2) - G*(T2 - T3);
  C*der(T3) = G*(T2 - T3) - G*(T3 - T4);
  C*der(T4) = G*(T3 - T4);
end Rod;
",
        channels: &[("T1", "T1", 0.05), ("T2", "T2", 0.05), ("T3", "T3", 0.05), ("T4", "T4", 0.05)],
        nuisances: &["G", "C"],
        ..ROD
    };
    names(&bench, "named", "heat_leak", "each of T1, T2, T3, T4", &[("k", 0.05)]);
}

/// The same equations between arrays, solved for the rate.
#[test]
fn equations_between_arrays() {
    let bench = Bench {
        name: "between-arrays",
        model: "model Rod
  parameter Real P = 30;
  parameter Real T_1 = 300;
  parameter Real T_2 = 300;
  parameter Real T_3 = 300;
  parameter Real T_4 = 300;
  parameter Real G = 0.5;
  parameter Real C = 50;
  Real T[4](start = {T_1, T_2, T_3, T_4}, each fixed = true);
  Real Q[5];
equation
  Q = cat(1, {P}, G*(T[1:3] - T[2:4]), {0});
  C*der(T) = Q[1:4] - Q[2:5];
end Rod;
",
        nuisances: &["G", "C"],
        ..ROD
    };
    names(&bench, "named", "heat_leak", "each T", &[("k", 0.05)]);
}

/// A constant of the package stands in what is stored, and levels of a row have equations in a loop and outside of it.
#[test]
fn the_second_tank_of_a_row_leaks() {
    let bench = Bench {
        name: "row",
        model: "package Works
  constant Real area = 0.5;
  model Row
    parameter Real q0 = 0.01;
    parameter Real h_1 = 1;
    parameter Real h_2 = 1;
    parameter Real h_3 = 1;
    parameter Real c = 0.004;
    parameter Real s = 1;
    Real h[3](start = {h_1, h_2, h_3}, each fixed = true);
  equation
    s*area*der(h[1]) = q0 - c*h[1];
    for i in 2:3 loop
      s*area*der(h[i]) = c*(h[i - 1] - h[i]);
    end for;
  end Row;
end Works;
",
        class: "Works.Row",
        channels: &[("h1", "h[1]", 2e-3), ("h2", "h[2]", 2e-3), ("h3", "h[3]", 2e-3)],
        conditions: &["h_1", "h_2", "h_3", "q0"],
        nuisances: &["c", "s"],
        shots: &[
            &[0.2, 1.0, 0.5, 0.01],
            &[1.5, 0.2, 1.0, 0.004],
            &[0.8, 0.8, 0.8, 0.012],
            &[0.5, 1.6, 0.3, 0.008],
            &[1.2, 0.1, 0.1, 0.006],
        ],
        shown: |_, value| value,
        rates: |x, shot| {
            let q = [shot[3], 0.004 * x[0], 0.004 * x[1], 0.004 * x[2]];
            vec![(q[0] - q[1]) / 0.5, (q[1] - q[2] - 0.002 * x[1].max(0.0).sqrt()) / 0.5, (q[2] - q[3]) / 0.5]
        },
        recorded: |_, value| value,
        without: &[],
        stop: 400.0,
    };
    names(&bench, "named", "torricelli_leak", "h[2]", &[]);
}

/// Components of an array of the model's own class.
#[test]
fn one_body_of_several_rubs() {
    let bench = Bench {
        name: "bodies",
        model: "model Body
  parameter Real m = 2;
  parameter Real k = 80;
  parameter Real d = 0.6;
  parameter Real x0 = 0.5;
  Real x(start = x0, fixed = true);
  Real v(start = 0, fixed = true);
equation
  der(x) = v;
  m*der(v) = -k*x - d*v;
end Body;

model Bodies
  parameter Real x_1 = 0.5;
  parameter Real x_2 = 0.5;
  parameter Real k = 80;
  parameter Real d = 0.6;
  Body body[2](x0 = {x_1, x_2}, each k = k, each d = d);
end Bodies;
",
        class: "Bodies",
        channels: &[("x1", "body[1].x", 1e-3), ("x2", "body[2].x", 1e-3)],
        conditions: &["x_1", "x_2"],
        nuisances: &["k", "d"],
        shots: &[&[0.3, 0.4], &[0.6, 0.2], &[0.9, 0.5], &[0.45, 0.7], &[0.75, 0.3]],
        shown: |_, value| value,
        rates: |x, _| {
            // The states that channels show come first.
            let at = |k: usize| x.get(k + 2).copied().unwrap_or(0.0);
            let rub = 1.5 * (at(1) / 1e-3).tanh();
            let free = |k: usize| (-80.0 * x[k] - 0.6 * at(k)) / 2.0;
            vec![at(0), at(1), free(0), free(1) - rub / 2.0]
        },
        recorded: |_, value| value,
        without: &[],
        stop: 4.0,
    };
    names(&bench, "named", "coulomb_friction", "body[2].v", &[("F_c", 1.5)]);
}
