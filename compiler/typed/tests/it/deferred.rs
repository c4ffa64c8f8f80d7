//! What has no meaning is said where it is reached, and not before.

use crate::{check_text, check_typed};

/// A branch may hold anything as long as it is not taken.
#[test]
fn a_branch_keeps_its_messages() {
    let body = "  Real x;
equation
  x = if false then nothing + 1 else 2;
  if false then
    x = nothing;
  end if;";
    insta::assert_snapshot!(check_typed(body), @r"
    x: Real = (if false: Boolean then <unknown name `nothing` in `M`> else 2: Integer): Integer
    if
      <unknown name `nothing` in `M`>
    ");
}

/// Statements about events outside of `when`, wrong numbers of arguments, calls that are none.
#[test]
fn misplaced_calls_say_what_is_wrong() {
    let body = "  Real x(start = 1);
equation
  reinit(x, 1);
  when x > 2 then
    reinit(x);
    reinit(2*x, 1);
    sin(x);
    terminate();
  end when;
  assert(x > 0);
  foo(x);
  x = sin(u = 2) + x(3);
  x = sum(k for k);";
    insta::assert_snapshot!(check_typed(body), @r"
    <`reinit` is allowed only inside `when`>
    when (x: Real > 2: Integer): Boolean
      <`reinit` takes a state and its new value>
      <`reinit` needs a variable>
      <a call by itself determines nothing here>
      <`terminate` takes a text>
    <`assert` takes a condition and a message>
    <there is no function `foo` here>
    <`sin` takes its arguments by position>
    <the range of `k` must be written>
    ");
}

/// A connection of what does not exist does not exist.
#[test]
fn connections_of_absent_components_vanish() {
    let text = "model M
  connector C
    Real p;
    flow Real q;
  end C;
  C a, b if false;
  Real x;
equation
  connect(a, b);
  connect(a, x);
end M;";
    insta::assert_snapshot!(check_text(text), @r"
    field by field
    connect(a: none, x: Real)
    ");
}
