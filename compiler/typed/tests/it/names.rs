//! What names mean.

use crate::{check_text, check_typed};

#[test]
fn components_along_a_path_with_subscripts() {
    let body = "  model Part
    Real x[3];
  end Part;
  Part c[2];
  Real y;
equation
  y = c[2].x[1] + c[1].x[end];
  for i in 1:2, k in 1:3 loop
    c[i].x[k] = time + i*k;
  end for;";
    insta::assert_snapshot!(check_typed(body), @r"
    y: Real = (c[2: Integer].x[1: Integer]: Real + c[1: Integer].x[end: Integer]: Real): Real
    for i in (1: Integer:2: Integer): Integer[:]
      c[local i: Integer].x[local k: Integer]: Real = (time: Real + (local i: Integer * local k: Integer): Integer): Real
    ");
}

#[test]
fn constants_of_packages_and_literals_of_enumerations() {
    let text = "package P
  constant Real g = 9.81;
  type Mode = enumeration(off, on);
end P;
model M
  import P.Mode;
  P.Mode mode;
  Real w;
equation
  mode = if time > 1 then Mode.on else P.Mode.off;
  w = P.g;
end M;";
    insta::assert_snapshot!(check_text(text), @r"
    mode: P.Mode = (if (time: Real > 1: Integer): Boolean then P.Mode.on: P.Mode else P.Mode.off: P.Mode): P.Mode
    w: Real = P.g: Real
    ");
}

/// A loop variable hides a component of its name, and only inside of the loop.
#[test]
fn a_loop_variable_hides_a_component() {
    let body = "  Real k;
  Real x[2];
equation
  k = sum(k*2 for k in 1:3);
  for k in 1:2 loop
    x[k] = k;
  end for;";
    insta::assert_snapshot!(check_typed(body), @r"
    k: Real = sum((local k: Integer * 2: Integer): Integer for k in (1: Integer:3: Integer): Integer[:]): Integer
    for k in (1: Integer:2: Integer): Integer[:]
      x[local k: Integer]: Real = local k: Integer
    ");
}

/// What the language calls `max` is hidden by a declaration.
#[test]
fn a_declared_function_hides_one_of_the_language() {
    let text = "model M
  function max
    input Real a;
    input Real b;
    output Real c;
  algorithm
    c := a;
  end max;
  Real y;
equation
  y = max(1, 2) + min(1, 2);
end M;";
    insta::assert_snapshot!(check_text(text), @r"
    y: Real = (M.max(1: Integer, 2: Integer): Real + min(1: Integer, 2: Integer): Integer): Real
    ");
}

/// A record is taken apart into its fields; those that are final have their values from elsewhere.
#[test]
fn an_equation_of_records_is_one_for_each_field() {
    let text = "model M
  record R
    Real a;
    final parameter Real f = 2;
    Real b[2];
  end R;
  R r, s;
equation
  r = s;
end M;";
    insta::assert_snapshot!(check_text(text), @r"
    field by field
      r.a: Real = s.a: Real
      r.b: Real[:] = s.b: Real[:]
    ");
}
