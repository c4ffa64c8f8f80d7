//! `hyd linearize` against closed forms: matrices, eigenvalues, algebraic unknowns, constraints, a point of a nonlinear run.
#![allow(clippy::unwrap_used)]

use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// Runs the verb on a text; the JSON it prints, or its messages.
fn linearize(name: &str, text: &str, arguments: &[&str]) -> Result<Value, String> {
    let folder: PathBuf = std::env::temp_dir().join(format!("hyd-linear-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("m.hyd"), text).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_hyd-under-test"));
    command.args(["linearize", "m.hyd", "--json"]).args(arguments).current_dir(&folder).env("NO_COLOR", "1");
    let output = command.output().unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    match output.status.success() {
        true => Ok(serde_json::from_slice(&output.stdout).unwrap()),
        false => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
    }
}

fn matrix(value: &Value) -> Vec<Vec<f64>> {
    serde_json::from_value(value.clone()).unwrap()
}

#[track_caller]
fn near(found: &Value, wanted: &[Vec<f64>], tolerance: f64) {
    let found = matrix(found);
    assert_eq!(found.len(), wanted.len(), "{found:?}");
    for (found_row, wanted_row) in found.iter().zip(wanted) {
        assert_eq!(found_row.len(), wanted_row.len());
        for (a, b) in found_row.iter().zip(wanted_row) {
            assert!((a - b).abs() <= tolerance * b.abs().max(1.0), "{found:?} instead of {wanted:?}");
        }
    }
}

/// Mass, spring and damper with algebraic forces between: A, B, C, D and the poles of the textbook.
#[test]
fn an_oscillator_with_algebraic_forces() {
    let text = "model M
  parameter Real m = 2, c = 0.6, k = 50, f = 3, share = 0.5;
  final parameter Real push = share*f;
  Real x(start = 0.1, fixed = true), v(start = 0, fixed = true), spring, damper, a;
equation
  der(x) = v;
  m*a = push - spring - damper;
  der(v) = a;
  spring = k*x;
  damper = c*v;
end M;
";
    let arguments = ["--at", "0.3", "--input", "f", "--output", "a", "--output", "spring"];
    let found = linearize("oscillator", text, &arguments).unwrap();
    assert_eq!(found["states"], serde_json::json!(["x", "v"]));
    near(&found["A"], &[vec![0.0, 1.0], vec![-25.0, -0.3]], 1e-13);
    // The input acts through a dependent parameter.
    near(&found["B"], &[vec![0.0], vec![0.25]], 1e-13);
    near(&found["C"], &[vec![-25.0, -0.3], vec![50.0, 0.0]], 1e-13);
    near(&found["D"], &[vec![0.25], vec![0.0]], 1e-13);
    let imaginary = (25.0f64 - 0.15 * 0.15).sqrt();
    near(&found["eigenvalues"], &[vec![-0.15, imaginary], vec![-0.15, -imaginary]], 1e-12);
}

/// The same with the ends of the model itself: what it declares as `input` and `output` is taken, arrays element by element.
#[test]
fn inputs_and_outputs_of_the_model_are_taken_by_themselves() {
    let text = "connector In = input Real;
block Gain
  In u;
  output Real y;
equation
  y = 2*u;
end Gain;
model M
  parameter Real m = 2, c = 0.6, k = 50;
  In F(start = 1);
  input Real push[2];
  output Real a, place[2];
  Gain gain;
  Real x(start = 0.1, fixed = true), v(start = 0, fixed = true);
equation
  connect(F, gain.u);
  der(x) = v;
  m*a = gain.y + push[1] - 3*push[2] - k*x - c*v;
  der(v) = a;
  place = {x, 10*v};
end M;
";
    let found = linearize("ends", text, &["--at", "0.3"]).unwrap();
    assert_eq!(found["inputs"], serde_json::json!(["F", "push[1]", "push[2]"]));
    assert_eq!(found["outputs"], serde_json::json!(["a", "place[1]", "place[2]"]));
    near(&found["A"], &[vec![0.0, 1.0], vec![-25.0, -0.3]], 1e-13);
    near(&found["B"], &[vec![0.0; 3], vec![1.0, 0.5, -1.5]], 1e-13);
    near(&found["C"], &[vec![-25.0, -0.3], vec![1.0, 0.0], vec![0.0, 10.0]], 1e-13);
    near(&found["D"], &[vec![1.0, 0.5, -1.5], vec![0.0; 3], vec![0.0; 3]], 1e-13);
    let some = linearize("ends-some", text, &["--at", "0", "--input", "k", "--output", "x"]).unwrap();
    assert_eq!((&some["inputs"], &some["outputs"]), (&serde_json::json!(["k"]), &serde_json::json!(["x"])));
}

/// x' = u - x^2 from 1 with u = 0 has x = 1/(1 + t): at t = 1 the slope is -2 x = -1.
#[test]
fn a_point_of_a_nonlinear_run() {
    let text = "model M
  parameter Real u = 0;
  Real x(start = 1, fixed = true), y;
equation
  der(x) = u - x^2;
  exp(y) = 3*x + u;
end M;
";
    let found =
        linearize("run", text, &["--at", "1", "--input", "u", "--output", "y", "--tolerance", "1e-10"]).unwrap();
    near(&found["A"], &[vec![-1.0]], 1e-8);
    near(&found["B"], &[vec![1.0]], 1e-12);
    // y = log(3 x + u): by x 3/(3 x), by u 1/(3 x).
    near(&found["C"], &[vec![2.0]], 1e-8);
    near(&found["D"], &[vec![2.0 / 3.0]], 1e-8);
}

/// A pendulum in Cartesian coordinates (index 3, states chosen at the point) hanging at rest: a pair at sqrt(g/L).
#[test]
fn a_constraint_of_index_three() {
    let text = "model M
  parameter Real L = 2, g = 9.81, m = 3;
  Real x(start = 0, fixed = true), y(start = -L), vx(start = 0, fixed = true), vy, force;
equation
  der(x) = vx;
  der(y) = vy;
  m*der(vx) = -x/L*force;
  m*der(vy) = -y/L*force - m*g;
  x^2 + y^2 = L^2;
end M;
";
    let found = linearize("pendulum", text, &["--at", "0"]).unwrap();
    assert_eq!(found["states"].as_array().unwrap().len(), 2, "{}", found["states"]);
    let omega = (9.81f64 / 2.0).sqrt();
    near(&found["eigenvalues"], &[vec![0.0, omega], vec![0.0, -omega]], 1e-10);
}

/// A chain of 30 equal masses and springs between walls: frequencies 2 sqrt(k/m) sin(j pi/(2 (n + 1))).
#[test]
fn frequencies_of_a_chain() {
    let text = "model M
  parameter Integer n = 30;
  Real x[n](each start = 0, each fixed = true), v[n](each start = 0, each fixed = true);
equation
  for i in 1:n loop
    der(x[i]) = v[i];
    der(v[i]) = 1e4*((if i > 1 then x[max(i - 1, 1)] else 0) - 2*x[i] + (if i < n then x[min(i + 1, n)] else 0));
  end for;
end M;
";
    let found = linearize("chain", text, &["--at", "0"]).unwrap();
    let mut frequencies: Vec<f64> =
        matrix(&found["eigenvalues"]).iter().map(|value| value[1]).filter(|im| *im > 0.0).collect();
    frequencies.sort_by(f64::total_cmp);
    let wanted = (1..=30).map(|j| 200.0 * (f64::from(j) * std::f64::consts::PI / 62.0).sin());
    for (found, wanted) in frequencies.iter().zip(wanted) {
        assert!((found - wanted).abs() < 1e-9 * wanted, "{found} instead of {wanted}");
    }
    assert_eq!(frequencies.len(), 30);
}

#[test]
fn what_has_no_linear_model_is_refused() {
    let text = "model M\n  parameter Integer n = 1;\n  parameter Real p = 1;\n  Real x(start = p, fixed = true);\nequation\n  der(x) = -sum(fill(x, n));\nend M;\n";
    let cases = [
        (&["--at", "1", "--input", "q"][..], "the model has no parameter `q`"),
        (&["--at", "1", "--input", "n"], "`n` cannot be an input: it decides sizes or structure"),
        (&["--at", "1", "--output", "z"], "the model has no variable `z`"),
        (&["--at", "-1"], "error"),
        (&["--at", "1", "--result", "a.csv"], "a linear model is written as .json or .mat"),
    ];
    for (arguments, message) in cases {
        let said = linearize("refused", text, arguments).unwrap_err();
        assert!(said.contains(message), "{said}");
    }
    let delayed = "model M\n  Real x(start = 1, fixed = true);\nequation\n  der(x) = -delay(x, 0.1);\nend M;\n";
    assert!(linearize("delayed", delayed, &["--at", "1"]).unwrap_err().contains("the model has delays"));
}

/// A run that fails among forty like cells looks for the eigenvalue behind it; a QR iteration without a bound may turn forever on the
/// matrix of such cells.
#[test]
fn a_run_that_fails_among_many_like_cells_ends() {
    let text = "\
model M
  Real x[40](each start = 0, each fixed = true);
  Real v[40](each start = 0.1, each fixed = true);
  Real w[40](each start = 0.2, each fixed = true);
  Real z[40];
equation
  for i in 1:40 loop
    der(x[i]) = 1 + x[i]^2 + 0.1*z[i];
    der(v[i]) = -v[i] + tanh(exp(-abs(x[i]))) + 0.1*z[i];
    der(w[i]) = -w[i] + tanh(x[i] - time) + 0.1*z[i];
    z[i] + 0.2*tanh(z[i]) = if time > 0.3 then 0.57 else 0.35;
  end for;
end M;
";
    let folder: PathBuf = std::env::temp_dir().join(format!("hyd-like-cells-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("m.hyd"), text).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_hyd-under-test"));
    command.args(["simulate", "m.hyd", "--stop", "2", "--result", "r.csv"]).current_dir(&folder);
    let mut child = command.stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let begun = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed().as_secs() > 120 {
            child.kill().unwrap();
            panic!("the run does not end");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let output = child.wait_with_output().unwrap();
    std::fs::remove_dir_all(&folder).unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        !output.status.success() && said.contains("x[1]") && said.contains("shared by many of the 120 states"),
        "{said}"
    );
}
