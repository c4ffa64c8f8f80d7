//! Attempts that are given up leave nothing behind.

use hyd_flat::{Injection, TermShape};

use crate::{check_flat, flat_with};

fn term(line: u32, shape: &str) -> Injection {
    let shape = TermShape::Expression(shape.to_string());
    Injection { path: String::new(), file: None, line, name: "extra".to_string(), shape }
}

/// The condition makes the loop fall into parts after the amplitude was declared, and a delay makes variables in its place.
#[test]
fn an_amplitude_of_an_attempt_given_up_is_declared_again() {
    let body = "  Real x[4](each start = 1, each fixed = true);
  Real y;
equation
  for k in 1:4 loop
    der(x[k]) = -x[k];
  end for;
  y = delay(x[1], 0.1);";
    insta::assert_snapshot!(check_flat(body, &[term(6, "if k > 2 then x[k] else 2*x[k]")]), @r#"
    flat model M
      Real x[4] (fixed = true)
      Real y
      parameter Real extra
      Real delay(x[1], 0.1).source
      Real delay(x[1], 0.1)
      parameter Real delay(x[1], 0.1).time (unit = "s")
    equation (7)
      der(x[1]) = extra*(2*x[1]) - x[1]
      der(x[2]) = extra*(2*x[2]) - x[2]
      der(x[3]) = extra*x[3] - x[3]
      der(x[4]) = extra*x[4] - x[4]
      delay(x[1], 0.1).source = x[1]
      delay(x[1], 0.1) = delayed(delay(x[1], 0.1).source)
      y = delay(x[1], 0.1)
    initial equation (1)
      delay(x[1], 0.1) = delay(x[1], 0.1).source
    value (5)
      x[1].start = 1
      x[2].start = 1
      x[3].start = 1
      x[4].start = 1
      delay(x[1], 0.1).time = 0.1
    "#);
}

/// A loop that is run through, because its subscript is not affine, makes what the same loop written out makes.
#[test]
fn a_loop_that_is_run_through_makes_what_it_makes_written_out() {
    let parts = [
        "floor(3*x[#])",
        "delay(x[#], 0.1)",
        "(if sample(0, 0.5) then 1 else 2)",
        "sum(w[j]*x[#] for j in 1:40)",
        "(if x[#] > 1 then mod(x[#], 2) else 0)",
        "scale(x[#])",
    ];
    let declared = "function scale input Real u(unit = \"m\"); output Real y; algorithm y := 2*u; end scale;
  Real x[9](each start = 1, each fixed = true, each unit = \"m\"); Real y[3], w[40];\nequation\n";
    let rest = "w = fill(time, 40);\nder(x) = -x;\n";
    for kind in 1..1 << parts.len() {
        let chosen: Vec<&str> = (0..parts.len()).filter(|k| kind >> k & 1 == 1).map(|k| parts[k]).collect();
        let sum = |at: &str| chosen.join(" + ").replace('#', at);
        let run_through = format!("for k in 1:3 loop y[k] = {}; end for;", sum("k*k"));
        let written: Vec<String> = (1..4).map(|k| format!("y[{k}] = {};", sum(&(k * k).to_string()))).collect();
        let model = |own: &str| format!("model M\n{declared}{own}\n{rest}end M;\n");
        let (through, said) = flat_with(&model(&run_through), &[]);
        let (out, also) = flat_with(&model(&written.join("\n")), &[]);
        assert_eq!(said, also);
        let numbers = |flat: &hyd_flat::FlatModel| {
            let equations: u32 = flat.equations.iter().map(|block| block.count).sum();
            let delays: u32 = flat.delays.iter().map(|block| block.count).sum();
            let claims: u32 = flat.claims.iter().map(|claim| claim.equations.count).sum();
            (flat.scalars, equations, delays, claims)
        };
        assert_eq!(numbers(&through), numbers(&out), "{run_through}");
    }
}
