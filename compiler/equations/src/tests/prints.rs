//! The text of the stages, line by line.

use hyd_flat::Section;

use super::model::Model;
use super::plans::sorted;
use crate::{build_system, differentiate, print_jacobian, print_sorted, print_system};

fn throttle() -> Model {
    Model::new(
        &["param k = 2", "param k2 = 2*k", "fixed p = 1", "real q", "real r", "discrete n"],
        &["q = r", "r = k2*sqrt(p)", "k*der(p) = -q + (if time > k then 1 else 0)"],
    )
    .with(Section::Discrete, &["n = if p < 0.5 then 1 else pre(n)"])
}

#[test]
fn the_system_lists_roles_aliases_and_equations() {
    let text = print_system(&build_system(throttle().flat));
    let expected = "\
parameters (2)
  k
  k2
states (1)
  p
algebraic variables (1)
  q
discrete variables (1)
  n
eliminated (1)
  r = q
bindings (2)
  k = 2
  k2 = 2*k
starts (1)
  p.start = 1
equations (2)
  q = k2*sqrt(p)
  k*der(p) = (if time > k then 1 else 0) - q
discrete equations (1)
  n = if p < 0.5 then 1 else pre(n)
";
    assert_eq!(text, expected);
}

#[test]
fn the_sorted_system_reads_as_a_calculation() {
    let text = print_sorted(&sorted(&throttle()));
    let expected = "\
before the run (2)
  k := 2
  k2 := 2*k
starts (1)
  p.start := 1
initial: 3 assignments, 0 unknowns for the solver
initial blocks (3)
  1: p := p.start
  2: q := k2*sqrt(p)
  3: der(p) := ((if relation 1 then 1 else 0) - q)/k
simulation: 1 assignments, 1 unknowns for the solver
simulation blocks (2)
  1: q := k2*sqrt(p)
  2: solve: 0 = der(p) - ((if relation 1 then 1 else 0) - q)/k  for der(p)
at events (1)
  n := if relation 2 then 1 else pre(n)
relations (2)
  1: time > k, right after time k
  2: p < 0.5
";
    assert_eq!(text, expected);
}

#[test]
fn the_jacobian_lists_local_partials_and_the_pattern() {
    let mut sorted = sorted(&throttle());
    let jacobian = differentiate(&mut sorted.system, &sorted.simulation);
    let text = print_jacobian(&sorted.system, &sorted.simulation, &jacobian);
    let expected = "\
partial derivatives (2)
  d(q)/d(p) = k2*(0.5/sqrt(p))
  d(residual 1)/d(der(p)) = 1
  d(residual 1)/d(q) = 1/k
pattern (1)
  residual 1: p, der(p)
";
    assert_eq!(text, expected);
}
