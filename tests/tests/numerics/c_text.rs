//! `hyd equations --stage c`: compiled by the C compiler of the machine, the text gives our values of residual, Jacobian and events.
//!
//! Without a C compiler there is nothing to compare with, and the test says so.  Elementary functions of the C library
//! may differ from ours in the last bit; everything else is the same operations in the same order.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::io;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use hyd_compiler::{Compilation, CompiledModel, Goal, Options, compile};
use hyd_results::{RowKind, Sink};
use hyd_runtime::simulate;
use hyd_system::{DaeSystem, Tables};
use hyd_tests::models::{compile_file, messages};

/// Last row of a run.
#[derive(Default)]
struct Last(f64, Vec<f64>);

impl Sink for Last {
    fn begin(&mut self, _: &Arc<Tables>, _: &[f64]) -> io::Result<()> {
        Ok(())
    }

    fn row(&mut self, t: f64, values: &[f64], _: RowKind) -> io::Result<()> {
        (self.0, self.1) = (t, values.to_vec());
        Ok(())
    }
}

/// Values at a point of a run: residuals, both Jacobians, root functions; with parameters bound and relations as at the start.
fn ours(model: &CompiledModel, t: f64, y: &[f64], yp: &[f64]) -> Vec<f64> {
    let mut system = model.instantiate();
    system.bind(0.0).unwrap();
    let structure = system.structure().clone();
    let own_roots = structure.roots - structure.delays.iter().filter(|site| site.varying).count();
    let mut residual = vec![0.0; structure.unknowns];
    let mut state = vec![0.0; structure.state_pattern.entries()];
    let mut rate = vec![0.0; structure.rate_pattern.entries()];
    let mut roots = vec![0.0; own_roots];
    system.residual(t, y, yp, &mut residual);
    system.jacobian(t, y, yp, &mut state, &mut rate);
    system.roots(t, y, yp, &mut roots);
    [residual, state, rate, roots].concat()
}

/// The program around the text.
fn program(text: &str, prefix: &str, composed: Option<usize>, t: f64, y: &[f64], yp: &[f64]) -> String {
    let list = |values: &[f64]| values.iter().chain(&[0.0]).map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", ");
    let mut out = text.to_string();
    let _ = write!(
        out,
        "\n#include <stdio.h>\nstatic double d[{prefix}_DATA + 1], w[{prefix}_WORK + 1], out[1000000], out2[1000000]{};\n\
         static const double y[] = {{{}}}, yp[] = {{{}}};\n\
         static void show(const double *v, int n) {{ for (int i = 0; i < n; i++) printf(\"%.17g\\n\", v[i]); }}\n\
         int main(void) {{\n{prefix}_start(d); d[0] = 0; d[1] = 1;\n{prefix}_bind(d, y, yp, w, out, out2); d[0] = {t:?}; d[1] = 0;\n\
         {prefix}_residual(d, y, yp, w, out, out2); show(out, {prefix}_UNKNOWNS);\n\
         {prefix}_jacobian(d, y, yp, w, {}out, out2); show(out, {prefix}_STATE_ENTRIES); show(out2, {prefix}_RATE_ENTRIES);\n\
         {prefix}_roots(d, y, yp, w, out, out2); show(out, {prefix}_ROOTS);\nreturn 0; }}\n",
        composed.map_or_else(String::new, |length| format!(", s[{length}]")),
        list(y),
        list(yp),
        if composed.is_some() { "s, " } else { "" }
    );
    out
}

/// None without a C compiler.
fn theirs(name: &str, program: &str) -> Option<Vec<f64>> {
    let folder = std::env::temp_dir().join(format!("hyd-c-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("m.c"), program).unwrap();
    let compiled = Command::new("cc")
        .args(["-std=c99", "-O0", "-ffp-contract=off", "-Wall", "-Werror", "-o", "m", "m.c", "-lm"])
        .current_dir(&folder)
        .output();
    let values = match compiled {
        Err(error) => {
            println!("no C compiler: {error}");
            None
        }
        Ok(output) => {
            assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
            let ran = Command::new(Path::new(&folder).join("m")).output().unwrap();
            let text = String::from_utf8(ran.stdout).unwrap();
            Some(text.lines().map(|line| line.parse().unwrap()).collect())
        }
    };
    std::fs::remove_dir_all(&folder).unwrap();
    values
}

fn check(name: &str, compilation: &Compilation) {
    let model = compilation.model.as_ref().unwrap_or_else(|| panic!("{name}: {}", messages(compilation)));
    let experiment = model.payload().experiment;
    let stop = 0.37 * experiment.stop.unwrap_or(1.0);
    let mut last = Last::default();
    let ran = simulate(&mut model.instantiate(), &hyd_runtime::Options::new(0.0, stop), &mut last, &|| false);
    ran.unwrap_or_else(|error| panic!("{name}: {error}"));
    let (y, yp) = model.payload().row.point(&last.1);
    let text = model.c_text();
    let prefix =
        text.lines().find_map(|line| line.strip_prefix("#define ")?.split_once("_UNKNOWNS ")).unwrap().0.to_string();
    let composed = text.lines().find_map(|line| {
        let rest = line.strip_prefix("/* The chain rule over the partial derivatives; s: ")?;
        rest.split_once(' ')?.0.parse().ok()
    });
    let simulation_composed = text.contains(&format!("void {prefix}_partials("));
    let program = program(&text, &prefix, composed.filter(|_| simulation_composed), last.0, &y, &yp);
    let Some(theirs) = theirs(name, &program) else { return };
    let ours = ours(model, last.0, &y, &yp);
    assert_eq!(ours.len(), theirs.len(), "{name}");
    for (k, (a, b)) in ours.iter().zip(&theirs).enumerate() {
        let same = a == b || a.is_nan() && b.is_nan() || (a - b).abs() <= 1e-12 * a.abs().max(b.abs());
        assert!(same || (a - b).abs() <= 1e-12 * largest(&y, &yp), "{name}: value {k} is {a}, in C {b}");
    }
}

fn largest(y: &[f64], yp: &[f64]) -> f64 {
    y.iter().chain(yp).fold(1.0, |most: f64, value| most.max(value.abs()))
}

#[test]
fn models_of_the_repository_have_the_same_values_in_c() {
    for file in [
        "models/single_acting_drive/drive.hyd",
        "models/single_acting_drive/rlclocked.hyd",
        "models/single_acting_drive/peak_and_hold/peakholddrive.hyd",
        "models/servo_drive/drive.hyd",
        "models/hydraulic_line/line.hyd",
    ] {
        check(&file.replace('/', "-"), &compile_file(file, &[], Goal::Run));
    }
}

/// Loops, functions with loops, branches and tables, names that C reserves.
#[test]
fn everything_the_language_has_is_written() {
    let text = "package P
  function mean \"By a loop\"
    input Real a[:];
    output Real m;
  algorithm
    m := 0;
    for i in 1:size(a, 1) loop
      if a[i] > 10 then break; end if;
      m := m + a[i];
    end for;
    m := m/size(a, 1);
  end mean;
  function steps
    input Real x;
    output Real n;
  algorithm
    n := 0;
    while n*n < x loop
      n := n + 1;
    end while;
  end steps;
  model M
    parameter Real double = 2, long[3] = {1, 2, 3};
    Real x[50](each start = 0.5, each fixed = true), exp(start = 1, fixed = true), t1, s;
    Boolean high(start = false, fixed = true);
    Integer count(start = 0, fixed = true);
  equation
    for i in 1:50 loop
      der(x[i]) = (if i > 1 then x[max(i - 1, 1)] else sin(time)) - double*x[i] + long[mod(i, 3) + 1]*tanh(x[i]);
    end for;
    t1 = mean(x) + steps(4 + x[1]);
    der(exp) = -exp + max(x[3], min(x[4], 0.2)) - abs(x[5])^1.5 + (if high and not x[7] > 0.3 or time > 0.5 then 1 else 0);
    s = div(t1, 0.3) + mod(t1, 0.7) + rem(-t1, 0.4) + sign(x[2]) + floor(exp) + atan2(x[1], exp);
    high = x[6] > 0.45;
    when sample(0.1, 0.1) then
      count = pre(count) + 1;
    end when;
    assert(s < 1e6, \"too high\");
    annotation(experiment(StopTime = 1));
  end M;
end P;
";
    let options = Options { model: None, set: Vec::new(), goal: Goal::Run, clock: || 0.0 };
    check("all", &compile(&mut hyd::LibraryPath::new(), "p.hyd", text, &options));
}
